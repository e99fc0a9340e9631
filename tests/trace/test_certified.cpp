// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <iostream>
#include <string>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// What certificates and bounds were worth, over a list of rays.
struct certificate_count {
  int certified = 0, tangent = 0, degenerate = 0;
  int lost = 0;      ///< certified, but the nearest certain root is not the hit
  int invented = 0;  ///< certified, but the oracle has no root where the hit is
  int beyond = 0;    ///< hits farther from the root than their error says
  double worst = 0;  ///< error along the ray of hits away from grazing, in epsilons of (scene + distance)
};

certificate_count judge(patch_list const& scene, ray_list const& rays) {
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  oracle const truth(numbers_of(scene));
  double const size = 2 * ball_of(scene).radius;
  std::vector<patch_hit> hits(rays.size());
  std::vector<certainty> certainties(rays.size());
  trace::certified_hits(h.view(), std::span<ray<double> const>(rays), hits, certainties, serial{});
  certificate_count c;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    bool const is_certified = certainties[i] == certainty::certified;
    c.certified += is_certified;
    c.tangent += certainties[i] == certainty::tangent;
    c.degenerate += certainties[i] == certainty::degenerate;
    patch_hit const& hit = hits[i];
    auto const roots = truth.all_hits(numbers_of(rays[i]));
    double const length = norm(rays[i].direction), reach = size + norm(rays[i].origin);
    auto const first =
        std::find_if(roots.begin(), roots.end(), [](oracle_root const& r) { return r.is_certain(1e-9, 1e-12); });
    c.lost += is_certified && first != roots.end() && !(hit.t - double(first->t) <= 1e-9 * reach / length);
    if (!hit.valid()) continue;
    auto const apart = [&](oracle_root const& r) {
      return double(std::abs(r.t - (long double)(hit.t)) - r.slack) * length;
    };
    auto const nearest =
        std::min_element(roots.begin(), roots.end(), [&](auto const& a, auto const& b) { return apart(a) < apart(b); });
    if (nearest == roots.end() || apart(*nearest) > 1e-9 * reach) {
      c.invented += is_certified;
      continue;
    }
    if (nearest->singular || nearest->patch != hit.patch) continue;
    auto const& patch = scene[std::size_t(hit.patch)];
    auto const at = evaluate(patch, hit.u, hit.v);
    double const off =
        norm(at.du * double((long double)(hit.u) - nearest->u) + at.dv * double((long double)(hit.v) - nearest->v));
    c.beyond += off > double(hit.error) + 1e-15 * reach;
    if (nearest->cos_angle > 0.05) c.worst = std::max(c.worst, apart(*nearest) / (2.2e-16 * reach));
  }
  return c;
}

/// Every family of rays of one scene; every certificate must hold.
void check_certificates(std::string const& name, patch_list const& scene, unsigned seed) {
  if (scene.empty()) {
    WARN(name << " is not at hand: skipped");
    return;
  }
  CAPTURE(name, seed);
  std::mt19937 g(seed);
  struct family {
    char const* name;
    ray_list rays;
    double least_certified;
  };
  family const families[] = {{"view", view_rays(scene, 1, 24, g), 0.99},
                             {"chords", chords(scene, 500, g), 0.99},
                             {"edges and corners", rays_at_edges(scene, 500, g), 0.8},
                             {"bounces", bounces(scene, 300, g), 0.99},
                             {"within 1e-3 of silhouettes", rays_along_tangents(scene, 500, 1e-3, g), 0.9},
                             {"tangent", rays_along_tangents(scene, 300, 0, g), 0.0},
                             {"axis-parallel", rays_through_ball(scene, 300, 3, true, g), 0.99},
                             {"from 1e4 diagonals away", rays_through_ball(scene, 300, 2e4, false, g), 0.99}};
  for (family const& f : families) {
    certificate_count const c = judge(scene, f.rays);
    std::cout << name << ", " << f.name << ": " << f.rays.size() << " rays, " << c.certified << " certified, "
              << c.tangent << " tangent, " << c.degenerate << " degenerate, at most " << c.worst << " epsilons off\n";
    CAPTURE(f.name);
    CHECK(c.lost == 0);
    CHECK(c.invented == 0);
    CHECK(c.beyond == 0);
    CHECK(c.worst < 16);
    CHECK(c.certified >= f.least_certified * double(f.rays.size()));
  }
}

}  // namespace

TEST_CASE("no certified answer on the teapot misses a root, invents one, or is farther off than it says") {
  check_certificates("teapot", load_model("teapot"), 401);
}
TEST_CASE("no certified answer on Gumbo misses a root, invents one, or is farther off than it says") {
  check_certificates("gumbo", load_model("gumbo"), 402);
}
TEST_CASE("no certified answer on patches that fold and cross themselves misses a root or invents one") {
  unsigned const seed = 403;
  std::mt19937 g(seed);
  patch_list scene;
  for (int k = 0; k < 12; ++k) {
    scene.push_back(k % 2 ? random_patch<double>(g) : random_sheet(g, 0.4));
    for (auto& c : scene.back().control_points) c += vec3<double>(k % 4, k / 4, 0.);
  }
  check_certificates("wild", scene, seed);
}

TEST_CASE("a ray in a flat patch is reported as degenerate, one beside it as a certified miss") {
  patch_list scene(1);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) scene[0](i, j) = {i / 4., j / 4., 0};
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  ray_list const rays = {{{-1, 0.3, 0}, {1, 0, 0}, 0, no_limit},
                         {{-1, 0.3, 1e-3}, {1, 0, 0}, 0, no_limit},
                         {{0.3, 0.3, 1}, {0, 0, -1}, 0, no_limit},
                         {{3, 0.3, 1}, {0, 0, -1}, 0, no_limit}};
  std::vector<patch_hit> hits(rays.size());
  std::vector<certainty> certainties(rays.size());
  trace::certified_hits(h.view(), std::span<ray<double> const>(rays), hits, certainties, serial{});
  CHECK(certainties[0] == certainty::degenerate);
  CHECK((certainties[1] == certainty::certified && !hits[1].valid()));
  CHECK((certainties[2] == certainty::certified && hits[2].valid()));
  CHECK(hits[2].t == Approx(1));
  CHECK((certainties[3] == certainty::certified && !hits[3].valid()));
}
