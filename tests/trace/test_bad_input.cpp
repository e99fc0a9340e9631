// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

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

double& number(ray<double>& r, int k) {
  double* const numbers[] = {&r.origin.x,    &r.origin.y,    &r.origin.z, &r.direction.x,
                             &r.direction.y, &r.direction.z, &r.t_min,    &r.t_max};
  return *numbers[k];
}

/// `good` with each kind of what is no ray.
ray_list bad_rays(ray<double> const& good) {
  ray_list bad;
  auto const with = [&](int k, double x) {
    bad.push_back(good);
    number(bad.back(), k) = x;
  };
  for (int k = 0; k < 8; ++k) with(k, not_a_number);
  for (int k = 0; k < 6; ++k) with(k, no_limit), with(k, -no_limit);
  with(6, no_limit);
  with(7, -no_limit);
  bad.push_back(good);
  bad.back().direction = {0, 0, 0};
  bad.push_back(good);
  bad.back().direction = {-0.0, 0, -0.0};
  bad.push_back(good);
  bad.back().t_min = bad.back().t_max = 1;
  bad.push_back(good);
  bad.back().t_min = 2, bad.back().t_max = 0.5;
  vec3<double> const nowhere(not_a_number);
  bad.push_back({nowhere, nowhere, not_a_number, not_a_number});
  return bad;
}

template <accuracy A> void check_bad_rays(mixed_hierarchy const& h, ray_list const& good) {
  auto const expected = hits_of<A>(h, good);
  for (auto const& bad : bad_rays(good[5])) {
    for (std::size_t lane : {std::size_t(0), std::size_t(5), std::size_t(15)}) {
      ray_list rays = good;
      rays[lane] = bad;
      CAPTURE(lane, numbers_of(bad));
      for (bool any : {false, true}) {
        auto const hits = hits_of<A>(h, rays, any);
        REQUIRE(hits[lane].patch == -1);
        REQUIRE(hits[lane].t == no_limit);
        std::size_t changed = 0;
        for (std::size_t i = 0; i < rays.size(); ++i)
          changed += i != lane && (any ? hits[i].valid() != expected[i].valid()
                                       : hits[i].t != expected[i].t || hits[i].patch != expected[i].patch ||
                                             hits[i].u != expected[i].u || hits[i].v != expected[i].v);
        REQUIRE(changed == 0);
      }
    }
  }
}

/// Ranges (t_min, t_max) that hold no number, around a hit at t and to both sides of it.
std::vector<std::array<double, 2>> empty_ranges(double t) {
  return {{t, t},
          {t + 1e-9, t - 1e-9},
          {std::nextafter(t, no_limit), t},
          {t + 1, t - 1},
          {t + 1, t + 0.5},
          {t - 0.5, t - 1},
          {t - 1, t - 1},
          {no_limit, -no_limit},
          {no_limit, no_limit},
          {-no_limit, -no_limit},
          {not_a_number, t + 1},
          {t - 1, not_a_number}};
}

template <accuracy A> void check_empty_ranges(mixed_hierarchy const& h, ray_list const& whole_lines) {
  auto const hits = hits_of<A>(h, whole_lines);
  ray_list rays;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].valid()) continue;
    for (auto const& range : empty_ranges(hits[i].t))
      rays.push_back({whole_lines[i].origin, whole_lines[i].direction, range[0], range[1]});
  }
  CAPTURE(int(A));
  CHECK(rays.size() > 1000);
  std::vector<patch_hit> found(rays.size());
  hierarchy_counts counts;
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(found), serial{}, &counts);
  CHECK(std::none_of(found.begin(), found.end(), [](patch_hit const& x) { return x.valid(); }));
  trace::any_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(found), serial{}, &counts);
  CHECK(std::none_of(found.begin(), found.end(), [](patch_hit const& x) { return x.valid(); }));
  // Hits have to lie in the range whatever comes before, and boxes refuse such ranges but for the rounding that they
  // allow for: only a ray that is left out from the start costs nothing.
  CHECK(counts.patches == 0);
}

}  // namespace

TEST_CASE("what is no ray misses, and changes no other ray of its pack") {
  unsigned const seed = 31;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  auto const h = build(scene);
  ray_list good;
  for (auto const& r : chords(scene, 200, g))
    if (good.size() < 16 && hits_of(h, {r})[0].valid()) good.push_back(r);
  REQUIRE(good.size() == 16);
  check_bad_rays<accuracy::refined>(h, good);
  check_bad_rays<accuracy::fast>(h, good);
  check_bad_rays<accuracy::reference>(h, good);
}

TEST_CASE("a range of t that holds no number is a miss, and no patch is looked at, wherever the surface is") {
  unsigned const seed = 34;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  auto const h = build(scene);
  ray_list const rays = chords(scene, 300, g);
  check_empty_ranges<accuracy::refined>(h, rays);
  check_empty_ranges<accuracy::fast>(h, rays);
  check_empty_ranges<accuracy::reference>(h, rays);
}

TEST_CASE("control points that are not finite are refused by patch and point") {
  auto const scene = load_model("teapot");
  for (double x : {not_a_number, no_limit, -no_limit}) {
    for (int c = 0; c < 3; ++c) {
      auto bad = scene;
      bad[17].control_points[11][c] = x;
      CHECK_THROWS_AS(build(bad), std::invalid_argument);
      CHECK_THROWS_WITH(build(bad), contains_text("patch 17") && contains_text("control point 11"));
    }
  }
}

TEST_CASE("no patches, scenes too large for double, and options out of range are refused") {
  CHECK_THROWS_AS(build({}), std::invalid_argument);
  std::mt19937 g(1);
  patch_list scene{random_sheet(g, 0.1)};
  for (int depth : {-2, max_subpatch_depth + 1, 1 << 30, std::numeric_limits<int>::min()}) {
    CAPTURE(depth);
    CHECK_THROWS_WITH(build(scene, {depth, 0.5f}), contains_text("depth"));
  }
  for (float turn : {0.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    CAPTURE(turn);
    CHECK_THROWS_WITH(build(scene, {-1, turn}), contains_text("max_turn"));
  }
  scene[0].control_points[3].x = 1e308;
  CHECK_THROWS_AS(build(scene), std::invalid_argument);
  scene[0].control_points[12].x = -1e308;
  CHECK_THROWS_AS(build(scene), std::invalid_argument);
}

TEST_CASE("a degenerate patch far away takes no hit from the others") {
  unsigned const seed = 33;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  auto more = scene;
  bicubic_patch<double> point;
  for (auto& c : point.control_points) c = {3, 3, 3};
  more.push_back(point);
  ray_list const rays = chords(scene, 1000, g);
  auto const expected = hits_of(build(scene), rays), found = hits_of(build(more), rays);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    wrong += expected[i].patch != found[i].patch ||
             (expected[i].valid() && std::fabs(expected[i].t - found[i].t) > 1e-12 * (1 + std::fabs(found[i].t)));
  CHECK(wrong == 0);
}
