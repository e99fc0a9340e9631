// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

namespace patchrt::examples {

/// The bytes of a file or pipe.
/// \throws std::runtime_error "FILE: expected ..., got ..." for what cannot be read, is no file, or exceeds `limit` bytes.
std::string read_file(std::filesystem::path const& file, std::uintmax_t limit);

/// A file that is opened before the work that fills it starts, so that a wrong path costs no work.
///
/// An old file keeps its contents, and a new one vanishes again, when the work fails before `write`.
class output_file {
 public:
  /// \throws std::runtime_error "FILE: cannot be written: REASON"
  explicit output_file(std::filesystem::path file);
  output_file(output_file const&) = delete;
  output_file& operator=(output_file const&) = delete;
  ~output_file();

  /// Makes `bytes` the contents of the file.
  /// \throws std::runtime_error "FILE: cannot be written: REASON"
  void write(std::string_view bytes);

 private:
  std::filesystem::path file_;
  bool is_new_;
  std::ofstream stream_;
};

}  // namespace patchrt::examples
