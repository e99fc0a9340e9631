// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Programs as users run them: command lines in, files, messages and exit statuses out.

#include <examples/temporary_folder.hpp>
#include <support/data.hpp>

#include <sys/wait.h>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace patchrt::test {

inline std::string contents(std::filesystem::path const& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

struct outcome {
  int status;  ///< the exit status; -1 where a signal ended the program
  std::string out, err;
};

/// Runs a command line of the shell in `folder`; $teapot is the project's teapot.
inline outcome run(temporary_folder const& folder, std::string const& command) {
  std::string const shell = "cd '" + (folder / "").string() + "' && teapot='" + project_data("teapot.bpt").string() +
                            "' && { " + command + "; } >out 2>err </dev/null";
  int const status = std::system(shell.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, contents(folder / "out"), contents(folder / "err")};
}

}  // namespace patchrt::test
