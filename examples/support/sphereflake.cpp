// SPDX-License-Identifier: MIT
#include "sphereflake.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace patchrt::examples {

namespace {

/// The directions of the children of a sphere whose axis is z, of unit length.
std::array<vec3<double>, 9> child_directions() {
  std::array<vec3<double>, 9> directions;
  auto const at = [](double degrees, double height) {
    double const azimuth = degrees * std::numbers::pi / 180, across = std::sqrt(1 - height * height);
    return vec3<double>(across * std::cos(azimuth), across * std::sin(azimuth), height);
  };
  for (std::size_t k = 0; k < 6; ++k) directions[k] = at(15 + 60 * double(k), 0);
  for (std::size_t k = 0; k < 3; ++k) directions[6 + k] = at(45 + 120 * double(k), std::sqrt(2.0 / 3));
  return directions;
}

/// v turned by the smallest rotation that takes z to the unit vector `axis`.
vec3<double> turn(vec3<double> const& v, vec3<double> const& axis) {
  if (axis.z < -1 + 1e-12) return {-v.x, v.y, -v.z};
  vec3<double> const w(-axis.y, axis.x, 0);
  return axis.z * v + cross(w, v) + w * (dot(w, v) / (1 + axis.z));
}

}  // namespace

std::vector<flake_sphere> sphereflake(int depth) {
  auto const directions = child_directions();
  std::vector<flake_sphere> spheres{{vec3<double>(0.0), 0.5}};
  std::vector<vec3<double>> axes{{0, 0, 1}};
  for (std::size_t level_start = 0; depth > 0; --depth) {
    std::size_t const level_end = spheres.size();
    for (std::size_t parent = level_start; parent < level_end; ++parent) {
      auto const [centre, radius] = spheres[parent];
      vec3<double> const axis = axes[parent];
      for (auto const& direction : directions) {
        vec3<double> const d = turn(direction, axis);
        spheres.push_back({centre + d * (radius * 4 / 3), radius / 3});
        axes.push_back(d / std::sqrt(dot(d, d)));
      }
    }
    level_start = level_end;
  }
  return spheres;
}

}  // namespace patchrt::examples
