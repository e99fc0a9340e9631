// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Families of rays for a model of bicubic patches, from pictures to those that solvers lose.

#include "support/rays.hpp"

#include <algorithm>
#include <array>

namespace patchrt::bench {

/// What rays have in common.
enum class ray_family { view, chords, edges, bounces, silhouettes, tangents, axes, afar };

inline constexpr std::array all_families{ray_family::view,    ray_family::chords,      ray_family::edges,
                                         ray_family::bounces, ray_family::silhouettes, ray_family::tangents,
                                         ray_family::axes,    ray_family::afar};

inline char const* name_of(ray_family f) {
  switch (f) {
    case ray_family::view:
      return "view";
    case ray_family::chords:
      return "random chords";
    case ray_family::edges:
      return "edges and corners";
    case ray_family::bounces:
      return "bounces";
    case ray_family::silhouettes:
      return "silhouettes within 1e-3";
    case ray_family::tangents:
      return "tangent";
    case ray_family::axes:
      return "axis-parallel";
    case ray_family::afar:
      return "from 1e4 diagonals";
  }
  return "";
}

template <class Generator>
test::ray_list make_rays(test::patch_list const& scene, ray_family f, std::size_t count, Generator& g) {
  int const n = int(count);
  switch (f) {
    case ray_family::view: {
      int const size = int(std::ceil(std::sqrt(double(count))));
      auto rays = test::view_rays(scene, 1, size, g);
      rays.resize(count);
      return rays;
    }
    case ray_family::chords:
      return test::chords(scene, n, g);
    case ray_family::edges:
      return test::rays_at_edges(scene, n, g);
    case ray_family::bounces:
      return test::bounces(scene, n, g);
    case ray_family::silhouettes:
      return test::rays_along_tangents(scene, n, 1e-3, g);
    case ray_family::tangents:
      return test::rays_along_tangents(scene, n, 0, g);
    case ray_family::axes:
      return test::rays_through_ball(scene, n, 3, true, g);
    case ray_family::afar:
      return test::rays_through_ball(scene, n, 2e4, false, g);
  }
  return {};
}

}  // namespace patchrt::bench
