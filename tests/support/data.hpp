// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Where tests find models: those of the project, and further ones that may be absent.

#include <filesystem>
#include <string>

namespace patchrt::test {

/// A file of the project's own data folder.
inline std::filesystem::path project_data(std::string const& name) {
  return std::filesystem::path(PATCHRT_PROJECT_DATA) / name;
}

/// A file of the folder that the CMake variable PATCHRT_SHARED_DATA names; empty where there is no such file.
inline std::filesystem::path shared_data(std::string const& name) {
  auto const path = std::filesystem::path(PATCHRT_SHARED_DATA) / name;
  return *PATCHRT_SHARED_DATA != '\0' && exists(path) ? path : std::filesystem::path();
}

}  // namespace patchrt::test
