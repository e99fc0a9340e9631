// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/trace/all_hits.hpp>

#include <algorithm>
#include <string>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <accuracy A> void check_all_hits(patch_list const& scene, ray_list const& rays) {
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  oracle const truth(numbers_of(scene));
  double const size = 2 * ball_of(scene).radius;
  int lost = 0, twice = 0, invented = 0, wanted = 0;
  for (auto const& r : rays) {
    auto const hits = trace::all_hits<A>(h.view(), r);
    REQUIRE(std::is_sorted(hits.begin(), hits.end(), [](auto const& a, auto const& b) { return a.t < b.t; }));
    auto const roots = truth.all_hits(numbers_of(r));
    double const length = norm(r.direction), reach = size + norm(r.origin);
    auto const is_at = [&](patch_hit const& hit, oracle_root const& root) {
      return std::fabs(double((long double)(hit.t) - root.t)) * length <= 1e-9 * reach + double(root.slack) * length;
    };
    for (oracle_root const& root : roots) {
      if (!root.is_certain(1e-4, 1e-7)) continue;
      ++wanted;
      auto const times = std::count_if(
          hits.begin(), hits.end(), [&](patch_hit const& hit) { return hit.patch == root.patch && is_at(hit, root); });
      lost += times == 0;
      twice += times > 1;
    }
    for (patch_hit const& hit : hits)
      invented += std::none_of(roots.begin(), roots.end(), [&](oracle_root const& root) { return is_at(hit, root); });
  }
  CAPTURE(int(A), wanted, lost, twice, invented);
  CHECK(wanted > 500);
  CHECK(lost == 0);
  CHECK(twice == 0);
  CHECK(invented == 0);
}

}  // namespace

TEST_CASE("all hits of chords through the teapot and through folded patches are the oracle's, each once") {
  unsigned const seed = 701;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const teapot = load_model("teapot");
  check_all_hits<accuracy::refined>(teapot, chords(teapot, 500, g));
  check_all_hits<accuracy::certified>(teapot, chords(teapot, 500, g));
  patch_list wild;
  for (int k = 0; k < 8; ++k) wild.push_back(random_patch<double>(g));
  check_all_hits<accuracy::refined>(wild, chords(wild, 300, g));
  check_all_hits<accuracy::certified>(wild, chords(wild, 300, g));
}

TEST_CASE("a hit on an edge or a corner that patches share is reported once") {
  unsigned const seed = 702;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (double const shift : {0., 4e-7}) {
    auto const sheet = random_sheet(g, 0.15);
    patch_list parts;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        parts.push_back(sub_patch(sheet, i / 3., (i + 1) / 3., j / 3., (j + 1) / 3.));
        for (auto& c : parts.back().control_points) c += vec3<double>(0, 0, shift * double((i + j) % 2));
      }
    auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(parts), {}, serial{});
    int once = 0;
    for (int k = 0; k < 2000; ++k) {
      double u = (1 + double(g() % 2)) / 3, v = k % 3 ? uniform(g, 0.02, 0.98) : (1 + double(g() % 2)) / 3;
      if (g() % 2) std::swap(u, v);
      vec3<double> const aim = evaluate(sheet, u, v).position, way(uniform(g, -0.3, 0.3), uniform(g, -0.3, 0.3), -1);
      ray<double> const r{aim - way * 2., way, 0, no_limit};
      auto const hits =
          k % 2 ? trace::all_hits<accuracy::refined>(h.view(), r) : trace::all_hits<accuracy::certified>(h.view(), r);
      INFO("shift " << shift << ", ray " << k << " to (" << u << ", " << v << "): " << hits.size() << " hits");
      REQUIRE(std::count_if(hits.begin(), hits.end(),
                            [](patch_hit const& hit) { return std::fabs(hit.t - 2) < 1e-4; }) == 1);
      ++once;
    }
    CHECK(once == 2000);
  }
}
