// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <bit>

using namespace patchrt;
using namespace patchrt::test;

namespace {

bool is_same(patch_hit const& a, patch_hit const& b) {
  return a.patch == b.patch && std::bit_cast<std::uint64_t>(a.t) == std::bit_cast<std::uint64_t>(b.t) && a.u == b.u &&
         a.v == b.v && a.error == b.error;
}

template <accuracy A> void check(patch_list const& scene, std::vector<ray<float>> const& rays) {
  CAPTURE(int(A));
  std::vector<ray<double>> wide;
  for (auto const& r : rays) wide.push_back({vec3<double>(r.origin), vec3<double>(r.direction), r.t_min, r.t_max});
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  std::vector<patch_hit> narrow_hits(rays.size()), hits(rays.size());
  trace::closest_hits<A>(h.view(), rays, narrow_hits, serial{});
  trace::closest_hits<A>(h.view(), wide, hits, serial{});
  std::size_t different = 0, found = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    different += !is_same(narrow_hits[i], hits[i]);
    found += hits[i].valid();
  }
  CHECK(different == 0);
  CHECK(found > rays.size() / 10);
  trace::any_hits<A>(h.view(), rays, narrow_hits, serial{});
  trace::any_hits<A>(h.view(), wide, hits, serial{});
  for (std::size_t i = 0; i < rays.size(); ++i) different += !is_same(narrow_hits[i], hits[i]);
  CHECK(different == 0);
}

}  // namespace

TEST_CASE("rays in float have the hits, bit for bit, of the same rays in double") {
  unsigned const seed = 71;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  ray_list rays = view_rays(scene, 2, 40, g);
  for (auto const& more : {chords(scene, 2003, g), rays_at_edges(scene, 2000, g), bounces(scene, 2000, g)})
    rays.insert(rays.end(), more.begin(), more.end());
  std::vector<ray<float>> narrow;
  for (auto const& r : rays)
    narrow.push_back({vec3<float>(r.origin), vec3<float>(r.direction), float(r.t_min), float(r.t_max)});
  narrow.push_back({{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1.0f}, 0.0f, std::numeric_limits<float>::infinity()});
  narrow.push_back({{0.0f, 0.0f, 10.0f}, {0.0f, 0.0f, -1e-30f}, 0.0f, 1e38f});
  narrow.push_back({{0.0f, 0.0f, 3e38f}, {0.0f, 0.0f, -3e38f}, 0.0f, 3.0f});
  check<accuracy::fast>(scene, narrow);
  check<accuracy::refined>(scene, narrow);
  check<accuracy::reference>(scene, narrow);
}
