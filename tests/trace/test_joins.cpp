// SPDX-License-Identifier: MIT
#include "joined_patches.hpp"
#include "support/catch.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <random>
#include <utility>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <accuracy A> int count_misses(patch_list const& scene, ray_list const& rays, double join_tolerance) {
  mixed_hierarchy_options options;
  options.join_tolerance = join_tolerance;
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, serial{});
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), hits, serial{});
  int misses = 0;
  for (auto const& hit : hits) misses += !hit.valid();
  return misses;
}

/// Sheets that `cut` makes patches of, each moved so that joined edges are up to 1e-6 diagonals apart, and rays to
/// where `aim(k, g)` says that joins are in the sheet's parameters.
template <class Cut, class Aim> void check_joins(unsigned seed, Cut const& cut, Aim const& aim) {
  CAPTURE(seed);
  std::mt19937 g(seed);
  int lost_without = 0;
  for (int n = 0; n < 8; ++n) {
    auto const sheet = random_sheet(g, 0.2);
    patch_list scene = cut(sheet);
    shift_each(scene, 4.9e-7 * 2 * ball_of(scene).radius, g);
    std::vector<vec3<double>> aims;
    for (int k = 0; k < 1000; ++k) {
      auto const [u, v] = aim(k, g);
      aims.push_back(evaluate(sheet, u, v).position + random_direction(g) * (2e-7 * uniform(g)));
    }
    auto const rays = rays_at(aims, g);
    CHECK(count_misses<accuracy::refined>(scene, rays, 1e-6) == 0);
    CHECK(count_misses<accuracy::certified>(scene, rays, 1e-6) == 0);
    CHECK(count_misses<accuracy::fast>(scene, rays, 1e-6) <= 20);
    lost_without += count_misses<accuracy::refined>(scene, rays, 0);
  }
  CHECK(lost_without > 500);
}

}  // namespace

TEST_CASE("rays between patches whose edges are up to 1e-6 diagonals apart hit one of them") {
  check_joins(601, cut_sheet, [](int k, std::mt19937& g) {
    double u = (1 + double(g() % 2)) / 3, v = k % 4 ? uniform(g, 0.01, 0.99) : (1 + double(g() % 2)) / 3;
    if (g() % 2) std::swap(u, v);
    return std::pair(u, v);
  });
}

TEST_CASE("rays at T-junctions whose edges are up to 1e-6 diagonals apart hit one of the patches") {
  check_joins(602, sheet_with_t_junctions, [](int k, std::mt19937& g) {
    return std::pair(0.5, k % 4 ? uniform(g, 0.01, 0.99) : (1 + double(g() % 3)) / 4);
  });
}

TEST_CASE("gaps are 0 on edges that are alone or the same, and bound how far others are apart") {
  unsigned const seed = 603;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const sheet = random_sheet(g, 0.2);
  auto scene = cut_sheet(sheet);
  auto gaps = find_joins(std::span<bicubic_patch<double> const>(scene), 1e-6);
  for (auto const& e : gaps) CHECK((e.u0 == 0 && e.u1 == 0 && e.v0 == 0 && e.v1 == 0));
  vec3<double> const by(3e-7, -2e-7, 1e-7);
  for (auto& c : scene[4].control_points) c += by;  // the middle one
  gaps = find_joins(std::span<bicubic_patch<double> const>(scene), 1e-6);
  double const moved = norm(by);
  for (double const gap :
       {gaps[4].u0, gaps[4].u1, gaps[4].v0, gaps[4].v1, gaps[1].u1, gaps[7].u0, gaps[3].v1, gaps[5].v0}) {
    CHECK(gap >= moved * 0.999999);
    CHECK(gap <= moved * 1.01);
  }
  CHECK((gaps[0].u0 == 0 && gaps[0].v0 == 0 && gaps[8].u1 == 0));
  for (auto& c : scene[4].control_points) c += vec3<double>(0, 0, 1e-4);
  gaps = find_joins(std::span<bicubic_patch<double> const>(scene), 1e-6);
  CHECK((gaps[4].u0 == 0 && gaps[4].v1 == 0));
}
