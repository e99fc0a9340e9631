// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <array>
#include <cmath>

using namespace patchrt;
using namespace patchrt::test;

namespace {

mixed_hierarchy build(patch_list const& scene, mixed_hierarchy_options const& options = {}) {
  return build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, serial{});
}

template <accuracy A = accuracy::refined>
std::vector<patch_hit> hits_of(mixed_hierarchy const& h, ray_list const& rays, bool any = false) {
  std::vector<patch_hit> hits(rays.size());
  if (any) trace::any_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  else trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  return hits;
}

/// Rays through the middle of the patches' box and around it, some along the axes.
ray_list rays_around(patch_list const& scene, std::mt19937& g) {
  auto const ball = ball_of(scene);
  double const r = ball.radius > 0 ? ball.radius : 1;
  ray_list rays;
  for (int k = 0; k < 300; ++k) {
    vec3<double> d = random_direction(g);
    if (k % 4 == 0) d = {double(k % 3 == 0), double(k % 3 == 1), double(k % 3 == 2)};
    vec3<double> const off = k % 2 ? random_direction(g) * (0.3 * r * uniform(g)) : vec3<double>{0, 0, 0};
    rays.push_back({ball.middle + off - d * (3 * r), d, 0, no_limit});
  }
  return rays;
}

bool is_sane(std::vector<patch_hit> const& hits) {
  return std::all_of(hits.begin(), hits.end(), [](patch_hit const& h) {
    return !h.valid() || (h.t > 0 && h.t < no_limit && 0 <= h.u && h.u <= 1 && 0 <= h.v && h.v <= 1);
  });
}

}  // namespace

TEST_CASE("patches that collapse to a point or a line are built, and hit without a NaN or not at all") {
  unsigned const seed = 32;
  CAPTURE(seed);
  std::mt19937 g(seed);
  bicubic_patch<double> point, line, segment_there_and_back, flat_edge_on;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      point(i, j) = {1, 2, 3};
      line(i, j) = {i / 3., 2 * i / 3., 1};
      segment_there_and_back(i, j) = {i % 2 + 0.1 * j, 0, 0};
      flat_edge_on(i, j) = {i / 3., j / 3., 0};
    }
  }
  auto const teapot = load_model("teapot");
  for (auto const& degenerate : {point, line, segment_there_and_back, flat_edge_on}) {
    auto with_others = teapot;
    with_others.push_back(degenerate);
    for (patch_list const& scene : {patch_list{degenerate}, patch_list(5, degenerate), with_others}) {
      for (int depth : {-1, 0, 4}) {
        auto const h = build(scene, {depth, 0.5f});
        ray_list const rays = rays_around(scene, g);
        CHECK(is_sane(hits_of<accuracy::refined>(h, rays)));
        CHECK(is_sane(hits_of<accuracy::fast>(h, rays)));
        CHECK(is_sane(hits_of<accuracy::reference>(h, rays)));
      }
    }
  }
}

TEST_CASE("a flat patch, whose boxes have no thickness, is hit wherever a ray crosses it") {
  unsigned const seed = 35;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int axis = 0; axis < 3; ++axis) {
    bicubic_patch<double> flat;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        flat(i, j)[axis] = 2;
        flat(i, j)[(axis + 1) % 3] = i / 3.0;
        flat(i, j)[(axis + 2) % 3] = j / 3.0;
      }
    ray_list rays;
    std::vector<std::array<double, 2>> aims;
    while (rays.size() < 500) {
      vec3<double> d = random_direction(g);
      if (rays.size() % 4 == 0) d = {0, 0, 0}, d[axis] = g() % 2 ? 1 : -1;
      if (std::fabs(d[axis]) < 0.05) continue;
      aims.push_back({uniform(g), uniform(g)});
      vec3<double> aim;
      aim[axis] = 2;
      aim[(axis + 1) % 3] = aims.back()[0];
      aim[(axis + 2) % 3] = aims.back()[1];
      rays.push_back({aim - d, d, 0, no_limit});
    }
    for (int depth : {-1, 0, 4, 8}) {
      CAPTURE(axis, depth);
      auto const h = build({flat}, {depth, 0.5f});
      auto const wrong = [&](std::vector<patch_hit> const& hits, double most) {
        std::size_t n = 0;
        for (std::size_t i = 0; i < hits.size(); ++i)
          n += !(hits[i].valid() && std::fabs(hits[i].t - 1) < most && std::fabs(hits[i].u - aims[i][0]) < most &&
                 std::fabs(hits[i].v - aims[i][1]) < most);
        return n;
      };
      CHECK(wrong(hits_of<accuracy::refined>(h, rays), 1e-13) == 0);
      CHECK(wrong(hits_of<accuracy::fast>(h, rays), 1e-4) == 0);
      CHECK(wrong(hits_of<accuracy::reference>(h, rays), 1e-13) == 0);
    }
  }
}
