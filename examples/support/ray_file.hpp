// SPDX-License-Identifier: MIT
#pragma once

#include "file.hpp"

#include <patchrt/core/ray.hpp>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <vector>

namespace patchrt::examples {

static_assert(std::endian::native == std::endian::little, "ray and hit files are little-endian memory");

/// One ray's answer as it stands in a hits file: 32 bytes.
struct hit_record {
  double t = std::numeric_limits<double>::infinity();
  double u = 0;
  double v = 0;
  std::int64_t patch = -1;  ///< -1 is a miss, with t = infinity and u = v = 0.

  friend bool operator==(hit_record const&, hit_record const&) = default;
};
static_assert(sizeof(hit_record) == 32);

/// Rays of 8 little-endian float64 each: origin, direction, t_min, t_max. Any values are rays; kernels miss with absurd ones.
/// \throws std::runtime_error for what cannot be read and for a size that is no multiple of 64 bytes.
std::vector<ray<double>> read_rays(std::filesystem::path const& file);

/// \throws std::runtime_error as `output_file::write`.
void write_hits(output_file& file, std::span<hit_record const> hits);

}  // namespace patchrt::examples
