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

/// Rays that pass a random point of a patch at an angle of up to `most` to its tangent plane.
template <class Generator>
test::ray_list rays_along_tangents(test::patch_list const& scene, std::size_t count, double most, Generator& g) {
  auto const ball = test::ball_of(scene);
  test::ray_list rays;
  while (rays.size() < count) {
    auto const s = evaluate(scene[g() % scene.size()], test::uniform(g), test::uniform(g));
    vec3<double> const normal = cross(s.du, s.dv);
    vec3<double> const along = cross(normal, test::random_direction(g));
    if (!(test::norm(along) > 1e-12 * ball.radius * ball.radius)) continue;
    vec3<double> const d = along / test::norm(along) + normal / test::norm(normal) * (most * test::uniform(g, -1, 1));
    rays.push_back({s.position - d * (ball.radius * test::uniform(g, 0.5, 3)), d, 0, test::no_limit});
  }
  return rays;
}

/// Rays through random points of the scene's ball that start `distance` radii before them, in random directions or in those of
/// the axes.
template <class Generator>
test::ray_list rays_through_ball(test::patch_list const& scene, std::size_t count, double distance, bool along_axes,
                                 Generator& g) {
  auto const ball = test::ball_of(scene);
  test::ray_list rays;
  for (std::size_t k = 0; k < count; ++k) {
    vec3<double> d = test::random_direction(g);
    vec3<double> const aim = ball.middle + test::random_direction(g) * (ball.radius * test::uniform(g));
    if (along_axes) {
      double const side = d.x < 0 ? -1 : 1;
      d = {k % 3 == 0 ? side : 0, k % 3 == 1 ? side : 0, k % 3 == 2 ? side : 0};
    }
    rays.push_back({aim - d * (distance * ball.radius), d, 0, test::no_limit});
  }
  return rays;
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
      return rays_along_tangents(scene, count, 1e-3, g);
    case ray_family::tangents:
      return rays_along_tangents(scene, count, 0, g);
    case ray_family::axes:
      return rays_through_ball(scene, count, 3, true, g);
    case ray_family::afar:
      return rays_through_ball(scene, count, 2e4, false, g);
  }
  return {};
}

}  // namespace patchrt::bench
