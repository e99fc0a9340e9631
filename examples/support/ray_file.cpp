// SPDX-License-Identifier: MIT
#include "ray_file.hpp"

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>

namespace patchrt::examples {

static_assert(sizeof(ray<double>) == 64 && offsetof(ray<double>, direction) == 24 &&
              offsetof(ray<double>, t_min) == 48);

std::vector<ray<double>> read_rays(std::filesystem::path const& file) {
  constexpr std::uintmax_t sixty_four_gib = std::uintmax_t(64) << 30;
  std::string const bytes = read_file(file, sixty_four_gib);
  if (bytes.size() % sizeof(ray<double>) != 0)
    throw std::runtime_error(file.string() + ": expected rays of 64 bytes each, got " + std::to_string(bytes.size()) +
                             " bytes");
  std::vector<ray<double>> rays(bytes.size() / sizeof(ray<double>));
  if (!rays.empty()) std::memcpy(static_cast<void*>(rays.data()), bytes.data(), bytes.size());
  return rays;
}

void write_hits(output_file& file, std::span<hit_record const> hits) {
  file.write(std::string_view(reinterpret_cast<char const*>(hits.data()), hits.size_bytes()));
}

}  // namespace patchrt::examples
