// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays that leave hits.

#include "support/rays.hpp"

#include <patchrt/trace/depart.hpp>

#include <cmath>
#include <vector>

namespace patchrt::test {

/// Directions to all sides, about the normal as after a diffuse bounce, and along the surface, in turn.
template <class Generator>
vec3<double> direction_from(vec3<double> const& normal, int k, double least_angle, Generator& g) {
  vec3<double> const any = random_direction(g);
  double const side = g() % 2 ? 1 : -1;
  if (k % 4 < 2) return any;
  if (k % 4 == 2) return normal * side + any;
  vec3<double> const along = cross(normal, any);
  return along / norm(along) + normal * (side * std::pow(10., uniform(g, std::log10(least_angle), -1)));
}

template <class R, class Generator>
std::vector<ray<R>> rays_from(hit_departure const& from, int count, double least_angle, Generator& g) {
  std::vector<ray<R>> rays;
  for (int k = 0; k < count; ++k) {
    vec3<R> const way = convert_vec<R>(direction_from(from.normal, k, least_angle, g));
    rays.push_back({offset_origin(from, way), way, 0, R(no_limit)});
  }
  return rays;
}

}  // namespace patchrt::test
