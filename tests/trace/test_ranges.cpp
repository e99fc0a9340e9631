// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <cmath>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <accuracy A = accuracy::refined>
std::vector<patch_hit> hits_of(patch_list const& scene, ray_list const& rays, int depth = -1) {
  mixed_hierarchy_options options;
  options.depth = depth;
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, serial{});
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  return hits;
}

bool is_at(patch_hit const& a, patch_hit const& b) {
  return a.patch == b.patch && a.t == b.t && a.u == b.u && a.v == b.v;
}

/// x -> scale x + shift.
patch_list moved(patch_list scene, double scale, vec3<double> const& shift) {
  for (auto& p : scene)
    for (auto& c : p.control_points) c = c * scale + shift;
  return scene;
}
ray_list moved(ray_list rays, double scale, vec3<double> const& shift) {
  for (auto& r : rays) {
    r.origin = r.origin * scale + shift;
    r.direction = r.direction * scale;
  }
  return rays;
}

/// Of rays that hit at |cosine| > 0.1 and away from edges: the largest difference of positions along the ray, times
/// |cosine|, between hits and the oracle's nearest roots; infinite where a hit is missing or of another patch.
double worst_error(patch_list const& scene, ray_list const& rays, std::vector<patch_hit> const& hits) {
  auto const numbers = numbers_of(scene);
  oracle const truth(numbers);
  double worst = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    auto const roots = truth.all_hits(numbers_of(rays[i]), 1e-6);
    if (roots.empty() || !roots.front().is_certain(0.1, 1e-3 * ball_of(scene).radius)) continue;
    auto const& root = roots.front();
    double const error = hits[i].patch == root.patch
                             ? std::fabs(double(root.t - hits[i].t)) * norm(rays[i].direction) * root.cos_angle
                             : no_limit;
    worst = std::max(worst, error);
  }
  return worst;
}

}  // namespace

TEST_CASE("t_min and t_max are an open interval around every hit") {
  unsigned const seed = 21;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  ray_list const rays = chords(scene, 2000, g);
  auto const hits = hits_of(scene, rays);
  ray_list before, after, at_end, at_start, around;
  std::vector<patch_hit> known;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    double const t = hits[i].t, step = 1e-9;
    known.push_back(hits[i]);
    auto const cut = [&](double t_min, double t_max) {
      return ray<double>{rays[i].origin, rays[i].direction, t_min, t_max};
    };
    before.push_back(cut(-no_limit, t - step));
    at_end.push_back(cut(-no_limit, t));
    after.push_back(cut(t + step, no_limit));
    at_start.push_back(cut(t, no_limit));
    around.push_back(cut(t - step, t + step));
  }
  REQUIRE(known.size() > 1000);
  auto const count = [&](ray_list const& list, auto holds) {
    auto const found = hits_of(scene, list);
    std::size_t n = 0;
    for (std::size_t i = 0; i < found.size(); ++i) n += holds(found[i], known[i]);
    return n;
  };
  std::size_t const all = known.size();
  CHECK(count(before, [](auto const& f, auto const&) { return !f.valid(); }) == all);
  CHECK(count(at_end, [](auto const& f, auto const& k) { return !f.valid() || f.t < k.t; }) == all);
  CHECK(count(after, [](auto const& f, auto const& k) { return !f.valid() || f.t > k.t; }) == all);
  CHECK(count(at_start, [](auto const& f, auto const& k) { return !f.valid() || f.t > k.t; }) == all);
  CHECK(count(around,
              [](auto const& f, auto const& k) { return f.patch == k.patch && std::fabs(f.t - k.t) < 1e-12; }) == all);
}

TEST_CASE("moving t_min from hit to hit visits every root of the oracle") {
  unsigned const seed = 22;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  auto const numbers = numbers_of(scene);
  oracle const truth(numbers);
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  std::size_t roots_seen = 0, wrong = 0;
  for (ray<double> r : chords(scene, 500, g)) {
    auto const roots = truth.all_hits(numbers_of(r));
    double apart = no_limit;
    for (std::size_t k = 1; k < roots.size(); ++k) apart = std::min(apart, double(roots[k].t - roots[k - 1].t));
    bool const is_clear =
        std::all_of(roots.begin(), roots.end(), [](auto const& x) { return x.is_certain(0.05, 1e-6); });
    if (!is_clear || apart < 1e-3) continue;
    for (auto const& root : roots) {
      auto const hit = intersect<accuracy::refined, false, float>(h.view(), r, true);
      bool const is_found = hit.valid && std::fabs(hit.t - double(root.t)) < 1e-9;
      wrong += !is_found;
      ++roots_seen;
      r.t_min = double(root.t) + 1e-6;
    }
    wrong += intersect<accuracy::refined, false, float>(h.view(), r, true).valid;
  }
  CHECK(roots_seen > 500);
  CHECK(wrong == 0);
}

TEST_CASE("t counts in lengths of the direction") {
  unsigned const seed = 23;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  ray_list const rays = view_rays(scene, 2, 32, g);
  auto const hits = hits_of(scene, rays);
  for (double length : {0x1p-60, 0x1p-3, 0x1p7, 0x1p60}) {
    ray_list other = rays;
    for (auto& r : other) r.direction = r.direction * length;
    auto const found = hits_of(scene, other);
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < rays.size(); ++i)
      wrong += found[i].patch != hits[i].patch || found[i].u != hits[i].u || found[i].v != hits[i].v ||
               found[i].t * length != hits[i].t;
    CAPTURE(length);
    CHECK(wrong == 0);
  }
}

TEST_CASE("scaling by a power of two changes no bit of u, v and t") {
  unsigned const seed = 24;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  ray_list rays = view_rays(scene, 2, 24, g);
  for (auto const& more : {chords(scene, 500, g), rays_at_edges(scene, 500, g)})
    rays.insert(rays.end(), more.begin(), more.end());
  for (int depth : {-1, 6}) {
    auto const hits = hits_of(scene, rays, depth);
    auto const fast = hits_of<accuracy::fast>(scene, rays, depth);
    for (int exponent : {-20, -1, 1, 20}) {
      double const s = std::ldexp(1, exponent);
      auto const found = hits_of(moved(scene, s, {0, 0, 0}), moved(rays, s, {0, 0, 0}), depth);
      auto const found_fast = hits_of<accuracy::fast>(moved(scene, s, {0, 0, 0}), moved(rays, s, {0, 0, 0}), depth);
      std::size_t wrong = 0, wrong_fast = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        wrong += !is_at(found[i], hits[i]);
        wrong_fast += !is_at(found_fast[i], fast[i]);
      }
      CAPTURE(depth, exponent);
      CHECK(wrong == 0);
      CHECK(wrong_fast == 0);
    }
  }
}

TEST_CASE("models of any size are hit where the oracle hits them") {
  unsigned const seed = 25;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  ray_list const rays = view_rays(scene, 2, 16, g);
  for (double s : {1e-100, 1e-30, 1e-6, 1e6, 1e30}) {
    auto const other = moved(scene, s, {0, 0, 0});
    auto const others = moved(rays, s, {0, 0, 0});
    auto const hits = hits_of(other, others);
    CAPTURE(s);
    CHECK(std::count_if(hits.begin(), hits.end(), [](auto const& x) { return x.valid(); }) > 60);
    if (s < 1e-6 || s > 1e6) {
      auto const expected = hits_of(scene, rays);
      std::size_t wrong = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) wrong += hits[i].valid() != expected[i].valid();
      CHECK(wrong == 0);
    } else {
      CHECK(worst_error(other, others, hits) < 8 * 0x1p-52 * 4 * ball_of(other).radius);
    }
  }
}

TEST_CASE("models far from the origin lose what doubles there cannot hold, and nothing else") {
  unsigned const seed = 26;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const teapot = load_model("teapot");
  double const size = ball_of(teapot).radius;
  for (double far : {1e2, 1e4, 1e6}) {
    vec3<double> const shift = random_direction(g) * (2 * far * size);
    auto const scene = moved(teapot, 1, shift);
    ray_list const rays = view_rays(scene, 2, 16, g);
    auto const hits = hits_of(scene, rays);
    CAPTURE(far);
    CHECK(std::count_if(hits.begin(), hits.end(), [](auto const& x) { return x.valid(); }) > 60);
    CHECK(worst_error(scene, rays, hits) < 8 * 0x1p-52 * (4 * size + norm(shift)));
  }
}

TEST_CASE("rays from afar hit to the rounding of their origin") {
  unsigned const seed = 27;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  auto const ball = ball_of(scene);
  for (double far : {1e2, 1e4, 1e6}) {
    ray_list rays;
    for (int k = 0; k < 500; ++k) {
      vec3<double> const d = random_direction(g);
      vec3<double> const aim = ball.middle + random_direction(g) * (0.7 * ball.radius * uniform(g));
      rays.push_back({aim - d * (2 * far * ball.radius), d, 0, no_limit});
    }
    auto const hits = hits_of(scene, rays);
    CAPTURE(far);
    CHECK(std::count_if(hits.begin(), hits.end(), [](auto const& x) { return x.valid(); }) > 200);
    CHECK(worst_error(scene, rays, hits) < 8 * 0x1p-52 * 2 * far * ball.radius);
  }
}
