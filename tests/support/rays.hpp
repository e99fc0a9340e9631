// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Scenes of bicubic patches and rays for them: what the tracer is held against the oracle with.

#include "support/data.hpp"
#include "support/oracle.hpp"
#include "support/patches.hpp"

#include <patchrt/core/ray.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace patchrt::test {

using patch_list = std::vector<bicubic_patch<double>>;
using ray_list = std::vector<ray<double>>;

inline constexpr double no_limit = std::numeric_limits<double>::infinity();

/// The patches of a model: "teapot" is the project's, others are of the shared data. Empty where there is no such file.
inline patch_list load_model(std::string const& name) {
  auto const path = name == "teapot" ? project_data("teapot.bpt") : shared_data(name + ".bpt");
  patch_list patches;
  if (path.empty()) return patches;
  for (oracle_patch const& p : read_patches(path)) patches.push_back(make_patch<double>(p));
  return patches;
}

inline std::vector<oracle_patch> numbers_of(patch_list const& patches) {
  std::vector<oracle_patch> numbers;
  for (auto const& p : patches) numbers.push_back(numbers_of(p));
  return numbers;
}

inline oracle_ray numbers_of(ray<double> const& r) {
  return {r.origin.x, r.origin.y, r.origin.z, r.direction.x, r.direction.y, r.direction.z, r.t_min, r.t_max};
}

/// Middle of the control points' box, and half its diagonal.
struct scene_ball {
  vec3<double> middle;
  double radius;
};
inline scene_ball ball_of(patch_list const& patches) {
  box<double> b = box<double>::empty();
  for (auto const& p : patches) b = merge(b, bounds(p));
  return {(b.lo + b.hi) * 0.5, 0.5 * norm(b.hi - b.lo)};
}

template <class Generator> double uniform(Generator& g, double lo = 0, double hi = 1) {
  return std::uniform_real_distribution<double>(lo, hi)(g);
}

template <class Generator> vec3<double> random_direction(Generator& g) {
  double const z = uniform(g, -1, 1), turn = uniform(g, 0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

/// Rays of pinholes around the scene, a tile of size x size each, row by row.
template <class Generator> ray_list view_rays(patch_list const& scene, int views, int size, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays;
  for (int k = 0; k < views; ++k) {
    vec3<double> const back = random_direction(g);
    vec3<double> const eye = ball.middle + back * (2.5 * ball.radius);
    vec3<double> const any = std::fabs(back.x) < 0.5 ? vec3<double>{1, 0, 0} : vec3<double>{0, 1, 0};
    vec3<double> const right = cross(any, back), up = cross(back, right);
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        double const sx = (x + 0.5) / size - 0.5, sy = (y + 0.5) / size - 0.5;
        rays.push_back({eye, right * sx + up * sy - back, 0, no_limit});
      }
    }
  }
  return rays;
}

template <class Generator> vec3<double> random_point(scene_ball const& ball, Generator& g) {
  double const distance = ball.radius * uniform(g);  // before the direction, whatever the compiler
  return ball.middle + random_direction(g) * distance;
}

/// Whole lines through two random points of the scene's ball.
template <class Generator> ray_list chords(patch_list const& scene, int count, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays;
  for (int k = 0; k < count; ++k) {
    vec3<double> const a = random_point(ball, g), b = random_point(ball, g);
    rays.push_back({a, b - a, -no_limit, no_limit});
  }
  return rays;
}

/// Rays from outside the scene through points of patches: on edges, in corners, and where sub-patches meet.
template <class Generator> ray_list rays_at_edges(patch_list const& scene, int count, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays;
  for (int k = 0; k < count; ++k) {
    auto const& p = scene[g() % scene.size()];
    double u = double(g() % 2), v = uniform(g);
    if (k % 4 == 1) v = double(g() % 2);
    if (k % 4 == 2) u = double(g() % 9) / 8;
    if (k % 4 == 3) u = double(g() % 9) / 8, v = double(g() % 9) / 8;
    if (g() % 2) std::swap(u, v);
    vec3<double> const aim = evaluate(p, u, v).position;
    vec3<double> const eye = ball.middle + random_direction(g) * (2 * ball.radius);
    rays.push_back({eye, aim - eye, 0, no_limit});
  }
  return rays;
}

/// Rays that leave random points of the surface to all sides, as after a diffuse bounce.
template <class Generator> ray_list bounces(patch_list const& scene, int count, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays;
  for (int k = 0; k < count; ++k) {
    auto const& p = scene[g() % scene.size()];
    double const v = uniform(g), u = uniform(g);
    rays.push_back({evaluate(p, u, v).position, random_direction(g), 1e-4 * ball.radius, no_limit});
  }
  return rays;
}

/// Rays that pass a random point of a patch at an angle of up to `most` to its tangent plane.
template <class Generator> ray_list rays_along_tangents(patch_list const& scene, int count, double most, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays;
  while (int(rays.size()) < count) {
    double const v = uniform(g), u = uniform(g);
    auto const s = evaluate(scene[g() % scene.size()], u, v);
    vec3<double> const normal = cross(s.du, s.dv);
    vec3<double> const along = cross(normal, random_direction(g));
    if (!(norm(along) > 1e-12 * ball.radius * ball.radius)) continue;
    vec3<double> const d = along / norm(along) + normal / norm(normal) * (most * uniform(g, -1, 1));
    rays.push_back({s.position - d * (ball.radius * uniform(g, 0.5, 3)), d, 0, no_limit});
  }
  return rays;
}

/// Rays through random points of the scene's ball that start `distance` radii before them, in random directions or in
/// those of the axes.
template <class Generator>
ray_list rays_through_ball(patch_list const& scene, int count, double distance, bool along_axes, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays;
  for (int k = 0; k < count; ++k) {
    vec3<double> d = random_direction(g);
    vec3<double> const aim = random_point(ball, g);
    if (along_axes) {
      double const side = d.x < 0 ? -1 : 1;
      d = {k % 3 == 0 ? side : 0, k % 3 == 1 ? side : 0, k % 3 == 2 ? side : 0};
    }
    rays.push_back({aim - d * (distance * ball.radius), d, 0, no_limit});
  }
  return rays;
}

}  // namespace patchrt::test
