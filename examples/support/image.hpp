// SPDX-License-Identifier: MIT
#pragma once

#include "file.hpp"

#include <stb_image_write.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace patchrt::examples {

struct image_size {
  int width;
  int height;

  std::size_t pixels() const { return std::size_t(width) * std::size_t(height); }
};

using rgb8 = std::array<std::uint8_t, 3>;

/// Pixels in rows from the top.
struct image {
  image_size size;
  std::vector<rgb8> pixels;

  explicit image(image_size s) : size(s), pixels(s.pixels()) {}
  rgb8& operator()(int x, int y) { return pixels[std::size_t(y) * std::size_t(size.width) + std::size_t(x)]; }
};

struct pixel {
  int x;
  int y;

  friend bool operator==(pixel const&, pixel const&) = default;
};

/// Pixel i of an image that is walked in 4x4 tiles, so that consecutive pixels are neighbours; tiles at the right and lower
/// edge are cut.
inline pixel tiled_pixel(image_size size, std::size_t i) {
  constexpr int side = 4;
  std::size_t const strip = std::size_t(size.width) * side;
  int const top = int(i / strip) * side;
  int const rows = size.height - top < side ? size.height - top : side;
  std::size_t const in_strip = i % strip;
  int const left = int(in_strip / std::size_t(side * rows)) * side;
  int const columns = size.width - left < side ? size.width - left : side;
  int const in_tile = int(in_strip % std::size_t(side * rows));
  return {left + in_tile % columns, top + in_tile / columns};
}

/// Writes `picture` to `file` as PNG.
/// \throws std::runtime_error where it cannot be written.
inline void write_png(output_file& file, image const& picture) {
  std::string bytes;
  auto const append = [](void* to, void* data, int size) {
    static_cast<std::string*>(to)->append(static_cast<char const*>(data), std::size_t(size));
  };
  if (!stbi_write_png_to_func(append, &bytes, picture.size.width, picture.size.height, 3, picture.pixels.data(),
                              3 * picture.size.width))
    throw std::runtime_error("out of memory for the PNG");
  file.write(bytes);
}

}  // namespace patchrt::examples
