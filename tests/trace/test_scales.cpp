// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

using namespace patchrt;
using namespace patchrt::test;

namespace {

mixed_hierarchy build(patch_list const& scene) {
  return build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
}

template <accuracy A> std::vector<patch_hit> hits_one_by_one(mixed_hierarchy const& h, ray_list const& rays) {
  std::vector<patch_hit> hits;
  for (auto const& r : rays) {
    auto const hit = intersect<A, false, float>(h.view(), r, true);
    hits.push_back(hit.valid ? patch_hit{hit.t, hit.u, hit.v, 0, std::bit_cast<std::int32_t>(hit.patch_bits)}
                             : patch_hit{});
  }
  return hits;
}

template <accuracy A> std::vector<patch_hit> list_of_hits(mixed_hierarchy const& h, ray_list const& rays) {
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  return hits;
}

/// A scene, scaled by 2^scene_exponent; the rays too, but for their directions, which are by 2^direction_exponent.
struct scaling {
  int scene_exponent, direction_exponent;

  patch_list operator()(patch_list patches) const {
    for (auto& p : patches)
      for (auto& c : p.control_points) c *= std::ldexp(1.0, scene_exponent);
    return patches;
  }
  ray_list operator()(ray_list rays) const {
    for (auto& r : rays) {
      r.origin *= std::ldexp(1.0, scene_exponent);
      r.direction *= std::ldexp(1.0, direction_exponent);
      r.t_min = t(r.t_min);
      r.t_max = t(r.t_max);
    }
    return rays;
  }
  double t(double x) const { return std::ldexp(x, scene_exponent - direction_exponent); }
};

/// Hits that are not `before` scaled.
std::size_t differences(std::vector<patch_hit> const& before, std::vector<patch_hit> const& after, scaling const& s) {
  auto const bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  std::size_t n = before.size() == after.size() ? 0 : 1;
  for (std::size_t i = 0; i < before.size(); ++i)
    n += before[i].patch != after[i].patch || bits(before[i].u) != bits(after[i].u) ||
         bits(before[i].v) != bits(after[i].v) || bits(s.t(before[i].t)) != bits(after[i].t);
  return n;
}

template <accuracy A> void check_scalings(patch_list const& scene, ray_list const& rays) {
  CAPTURE(int(A));
  auto const h = build(scene);
  auto const list = list_of_hits<A>(h, rays), single = hits_one_by_one<A>(h, rays);
  CHECK(4 * std::size_t(std::count_if(list.begin(), list.end(), [](auto const& x) { return x.valid(); })) >
        rays.size());
  CHECK(differences(list, single, {0, 0}) == 0);
  // 2^400 = 3e120; a determinant, the square of that, still has all its bits.
  for (scaling const s : {scaling{-400, 0},
                          {-100, 0},
                          {-20, 0},
                          {20, 0},
                          {100, 0},
                          {400, 0},
                          scaling{-400, -400},
                          {-20, -20},
                          {20, 20},
                          {400, 400},
                          {0, -400},
                          {0, 300}}) {
    CAPTURE(s.scene_exponent, s.direction_exponent);
    auto const scaled = build(s(scene));
    ray_list const scaled_rays = s(rays);
    CHECK(differences(list, list_of_hits<A>(scaled, scaled_rays), s) == 0);
    CHECK(differences(list, hits_one_by_one<A>(scaled, scaled_rays), s) == 0);
  }
}

}  // namespace

TEST_CASE(
    "a scene and its rays scaled by a power of two, anywhere, are hit at the same bits of u and v and at t scaled") {
  unsigned const seed = 71;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const teapot = load_model("teapot");
  double const diagonal = 2 * ball_of(teapot).radius;
  for (double far : {0.0, 1.0, 1e3, 1e6}) {
    CAPTURE(far);
    vec3<double> const shift = random_direction(g) * (far * diagonal);
    auto scene = teapot;
    for (auto& p : scene)
      for (auto& c : p.control_points) c += shift;
    ray_list rays = view_rays(scene, 1, 16, g);
    for (auto const& more : {chords(scene, 150, g), rays_at_edges(scene, 150, g), bounces(scene, 150, g)})
      rays.insert(rays.end(), more.begin(), more.end());
    for (std::size_t i = 0; i < rays.size(); i += 5) rays[i].t_max = uniform(g, 0, 2);
    check_scalings<accuracy::refined>(scene, rays);
    check_scalings<accuracy::reference>(scene, rays);
  }
}

TEST_CASE("patches that fold, scaled by a power of two, are hit at the same bits of u and v and at t scaled") {
  unsigned const seed = 72;
  CAPTURE(seed);
  std::mt19937 g(seed);
  patch_list scene;
  for (int k = 0; k < 6; ++k) scene.push_back(random_patch<double>(g));
  ray_list rays = chords(scene, 200, g);
  for (auto const& more : {rays_at_edges(scene, 100, g), bounces(scene, 100, g)})
    rays.insert(rays.end(), more.begin(), more.end());
  check_scalings<accuracy::refined>(scene, rays);
  check_scalings<accuracy::reference>(scene, rays);
}
