// SPDX-License-Identifier: MIT
#include "file.hpp"

#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace patchrt::examples {

namespace fs = std::filesystem;

namespace {

std::string reason() { return std::generic_category().message(errno); }

std::string kind(fs::file_type type) {
  switch (type) {
    case fs::file_type::not_found:
      return "nothing of that name";
    case fs::file_type::directory:
      return "a directory";
    case fs::file_type::character:
    case fs::file_type::block:
      return "a device";
    case fs::file_type::socket:
      return "a socket";
    default:
      return "something unreadable";
  }
}

}  // namespace

std::string read_file(fs::path const& file, std::uintmax_t limit) {
  std::error_code ignored;
  fs::file_type const type = fs::status(file, ignored).type();
  if (type != fs::file_type::regular && type != fs::file_type::fifo)
    throw std::runtime_error(file.string() + ": expected a file, got " + kind(type));
  auto const too_large = [&] {
    return std::runtime_error(file.string() + ": expected at most " + std::to_string(limit) + " bytes, got more");
  };
  std::string bytes;
  if (type == fs::file_type::regular) {
    std::uintmax_t const size = fs::file_size(file, ignored);
    if (size > limit) throw too_large();
    bytes.reserve(std::size_t(size));
  }
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be read: " + reason());
  std::array<char, 1 << 16> block;
  while (stream.read(block.data(), block.size()) || stream.gcount() > 0) {
    bytes.append(block.data(), std::size_t(stream.gcount()));
    if (bytes.size() > limit) throw too_large();
  }
  if (stream.bad()) throw std::runtime_error(file.string() + ": cannot be read: " + reason());
  return bytes;
}

output_file::output_file(fs::path file) : file_(std::move(file)) {
  std::error_code ignored;
  is_new_ = !fs::exists(file_, ignored);
  errno = 0;
  stream_.open(file_, std::ios::binary | std::ios::app);
  if (!stream_) throw std::runtime_error(file_.string() + ": cannot be written: " + reason());
}

output_file::~output_file() {
  std::error_code ignored;
  if (stream_.is_open() && is_new_) fs::remove(file_, ignored);
}

void output_file::write(std::string_view bytes) {
  errno = 0;
  if (fs::is_regular_file(file_)) fs::resize_file(file_, 0);
  stream_.write(bytes.data(), std::streamsize(bytes.size()));
  stream_.flush();
  if (!stream_) throw std::runtime_error(file_.string() + ": cannot be written: " + reason());
  stream_.close();
}

}  // namespace patchrt::examples
