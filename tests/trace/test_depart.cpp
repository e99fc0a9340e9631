// SPDX-License-Identifier: MIT
#include "departures.hpp"
#include "joined_patches.hpp"
#include "support/catch.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/shapes/bezier_elevate.hpp>
#include <patchrt/shapes/revolution_patches.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <accuracy A, class Surface>
std::vector<patch_hit> trace_rays(basic_mixed_hierarchy<Surface> const& h, ray_list const& rays) {
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), hits, serial{});
  return hits;
}

template <class Surface> basic_mixed_hierarchy<Surface> hierarchy_of(std::vector<Surface> const& patches) {
  return build_mixed_hierarchy(std::span<Surface const>(patches), {}, serial{});
}

/// Bilinear patches as some of another kind.
template <class Surface> std::vector<Surface> as_kind(std::vector<bezier_patch<double, 1, 1>> const& patches) {
  using form = surface_form<Surface>;
  std::vector<Surface> kind;
  for (auto const& p : patches) {
    auto const raised = elevate<form::degree_u, form::degree_v>(p);
    if constexpr (form::is_rational) kind.push_back(make_rational(raised));
    else kind.push_back(raised);
  }
  return kind;
}

/// Rays that leave points of edges and corners of boxes whose walls are up to 1e-6 diagonals apart there.
struct box_count {
  int rays = 0;
  int leaks = 0;        ///< that go inside and meet no wall
  int rehits = 0;       ///< that go inside and meet a wall they do not go to, or outside and meet one
  double farthest = 0;  ///< of the starts, in clearances
};
template <class Surface> box_count leave_boxes(int boxes, unsigned seed) {
  std::mt19937 g(seed);
  box_count c;
  for (int n = 0; n < boxes; ++n) {
    auto model = random_box(g);
    double const diagonal = norm(model.at(1, 1, 1)), near = 1e-5 * diagonal;
    shift_each(model.patches, 4.9e-7 * diagonal, g);
    auto const h = hierarchy_of(as_kind<Surface>(model.patches));
    ray_list aimed;
    for (int k = 0; k < 100; ++k) {
      double at[3] = {double(g() % 2), double(g() % 2), double(g() % 2)};
      if (k % 4) at[g() % 3] = k % 4 == 1 ? 0.5 : uniform(g);
      vec3<double> const aim = model.at(at[0], at[1], at[2]) + random_direction(g) * (2e-7 * uniform(g));
      vec3<double> const eye = k % 8 < 4 ? model.at(0.4, 0.5, 0.3) : random_direction(g) * 9.;
      aimed.push_back({eye, aim - eye, 0, no_limit});
    }
    for (patch_hit const& hit : trace_rays<accuracy::refined>(h, aimed)) {
      if (!hit.valid()) continue;
      auto const from = depart_from(h.view(), hit);
      int const wall = model.wall_at(from.position, from.normal);
      auto const rays = rays_from<double>(from, 100, 1e-9, g);
      auto const hits = trace_rays<accuracy::refined>(h, rays);
      for (std::size_t k = 0; k < rays.size(); ++k) {
        ++c.rays;
        auto const& [origin, direction, t_min, t_max] = rays[k];
        double const length = norm(direction), inward = -dot(model.normals[wall], direction) / length;
        double const off = norm(origin - from.position);
        c.farthest = std::max(c.farthest, off / from.clearance);
        c.leaks += inward > 1e-3 && !hits[k].valid();
        // Walls have steps where patches meet, which rays along them and from beside them truly meet.
        bool const is_near = hits[k].t * length < 1e3 * off;
        if (!hits[k].valid() || (!is_near && inward < 0.05)) continue;
        vec3<double> const seen = origin + direction * hits[k].t;
        bool is_met = false;
        for (int other = 0; other < 6 && inward > 0; ++other)
          is_met |= dot(model.normals[other], direction) > 0 && std::fabs(model.depth(other, seen)) < near;
        c.rehits += !is_met;
      }
    }
  }
  return c;
}

}  // namespace

TEMPLATE_TEST_CASE(
    "rays that leave creases and corners whose walls are up to 1e-6 diagonals apart stay on their side of all walls",
    "", bicubic_patch<double>, (bezier_patch<double, 1, 4>), (rational_patch<double, 2, 1>)) {
  unsigned const seed = 30701u;
  auto const c = leave_boxes<TestType>(20, seed);
  CAPTURE(seed, c.rays, c.farthest);
  CHECK(c.rays > 100000);
  CHECK(c.leaks == 0);
  CHECK(c.rehits == 0);
  CHECK(c.farthest > 2);
  CHECK(c.farthest < 64);
}

TEST_CASE("rays that leave a sphere of rational patches, poles and seams too, meet its other side or nothing") {
  unsigned const seed = 30702u;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (double const away : {0., 100.}) {
    CAPTURE(away);
    vec3<double> const centre = vec3<double>(0.3, -0.4, 0.5) * away;
    double const radius = 0.7;
    auto const octants = sphere_patches(centre, radius);
    using surface = std::decay_t<decltype(octants[0])>;
    auto const h = hierarchy_of(std::vector<surface>(octants.begin(), octants.end()));
    ray_list aimed;
    for (int k = 0; k < 300; ++k) {
      vec3<double> aim = random_direction(g);
      if (k % 3 == 0) aim[int(g() % 3)] = 0;
      if (k % 9 == 0) aim = {0, 0, g() % 2 ? 1 : -1};
      vec3<double> const eye = centre + random_direction(g) * (k % 2 ? 3 : 0.2);
      aimed.push_back({eye, centre + aim * (radius / norm(aim)) - eye, 0, no_limit});
    }
    for (patch_hit const& hit : trace_rays<accuracy::certified>(h, aimed)) {
      REQUIRE(hit.valid());
      auto const from = depart_from(h.view(), hit);
      CHECK(std::fabs(norm(from.position - centre) - radius) < 4e-16 * (radius + 3 * away));
      auto const rays = rays_from<double>(from, 60, 1e-9, g);
      auto const hits = trace_rays<accuracy::certified>(h, rays);
      for (std::size_t k = 0; k < rays.size(); ++k) {
        vec3<double> const out = rays[k].origin - centre, way = rays[k].direction / norm(rays[k].direction);
        double const along = dot(out, way), inward = -dot(from.normal, way);
        CAPTURE(hit.u, hit.v, inward);
        if (inward < 0) {
          CHECK(!hits[k].valid());
        } else if (inward > 1e-6) {
          REQUIRE(hits[k].valid());
          double const t = std::sqrt(along * along - dot(out, out) + radius * radius) - along;
          CHECK(std::fabs(hits[k].t * norm(rays[k].direction) - t) < 2 * double(hits[k].error) + 1e-14 / inward);
        }
      }
    }
  }
}

TEST_CASE("inside a patch a departure is clear of what an intersector may be off by there, along the normal") {
  unsigned const seed = 30703u;
  CAPTURE(seed);
  std::mt19937 g(seed);
  constexpr double eps = std::numeric_limits<double>::epsilon();
  for (int n = 0; n < 200; ++n) {
    auto const sheet = random_sheet(g, uniform(g));
    auto const h = hierarchy_of(cut_sheet(sheet));
    patch_hit hit;
    hit.patch = int(g() % 9), hit.u = uniform(g, 0.01, 0.99), hit.v = uniform(g, 0.01, 0.99);
    auto const& e = h.exact[std::size_t(hit.patch)];
    vec3<double> const across = extent(bounds(e.patch));
    double const half = 0.5 * (across.x + across.y + across.z);
    auto const from = depart_from(h.view(), hit);
    CHECK(from.clearance >= 9.5 * eps * half + 32 * eps * (half + e.size));
    CHECK(from.clearance >= 9.5 * eps * half + e.rounding + 4 * eps * half);
    CHECK(from.clearance <= e.rounding + 256.01 * eps * e.size);
    CHECK(depart_from<accuracy::fast>(h.view(), hit).clearance > 0x1p29 * from.clearance);
    CHECK(norm(from.position - position(e.patch, hit.u, hit.v) - e.base) <= eps * norm(from.position));
    vec3<double> const way = random_direction(g);
    vec3<double> const off = offset_origin(h.view(), hit, way) - from.position;
    double const side = dot(from.normal, way) < 0 ? -1 : 1;
    CHECK(off == offset_origin(from, way) - from.position);
    CHECK(norm(off - from.normal * (side * norm(off))) <= 4 * eps * norm(from.position));
    CHECK(norm(off) <= from.clearance + 14 * eps * norm(from.position));
    vec3<float> const in_float = offset_origin(from, convert_vec<float>(way));
    CHECK(dot(convert_vec<double>(in_float) - from.position, from.normal) * side >= from.clearance);
  }
}

TEST_CASE("a departure at a join is clear of the largest patch there, and of gaps, one inside of its own patch alone") {
  unsigned const seed = 30704u;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 50; ++n) {
    auto const sheet = random_sheet(g, 0.5);
    auto scene = sheet_with_t_junctions(sheet);
    auto const exact = hierarchy_of(scene);
    double const radius = ball_of(scene).radius;
    shift_each(scene, 4.9e-7 * 2 * radius, g);
    auto const apart = hierarchy_of(scene);
    patch_hit at_join;  // of a small patch to the large one
    at_join.patch = 1 + int(g() % 4), at_join.u = 0, at_join.v = uniform(g, 0.1, 0.9);
    patch_hit inside = at_join, beyond = at_join;
    inside.u = 0.5;
    beyond.patch = 0, beyond.u = 0.5;
    double const own = depart_from(exact.view(), inside).clearance;
    double const neighbours = depart_from(exact.view(), beyond).clearance;
    CHECK(neighbours > 1.1 * own);
    CHECK(depart_from(exact.view(), at_join).clearance >= neighbours);
    CHECK(depart_from(exact.view(), at_join).clearance < 64 * own);
    CHECK(depart_from(apart.view(), inside).clearance < 2 * own);
    double const gap = apart.exact[0].gaps.u1;
    CHECK(depart_from(apart.view(), at_join).clearance >= 4 * gap);
    CHECK(depart_from(apart.view(), at_join).clearance < 1.6e-5 * radius);
    CHECK(gap > 1e-9 * radius);
  }
}
