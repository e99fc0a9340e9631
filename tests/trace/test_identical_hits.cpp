// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>
#ifdef PATCHRT_HAVE_OPENMP
#  include <patchrt/exec/openmp.hpp>
#endif

#include <algorithm>
#include <bit>
#include <numeric>

using namespace patchrt;
using namespace patchrt::test;

namespace {

bool is_same(patch_hit const& a, patch_hit const& b) {
  auto const bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return a.patch == b.patch && bits(a.t) == bits(b.t) && bits(a.u) == bits(b.u) && bits(a.v) == bits(b.v) &&
         std::bit_cast<std::uint32_t>(a.error) == std::bit_cast<std::uint32_t>(b.error);
}

std::size_t differences(std::vector<patch_hit> const& a, std::vector<patch_hit> const& b) {
  std::size_t n = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) n += !is_same(a[i], b[i]);
  return n;
}

template <accuracy A> patch_hit one_hit(mixed_hierarchy_view const& h, ray<double> const& r) {
  using S = search_scalar_t<A, float>;
  ray<S> const in{vec3<S>(r.origin), vec3<S>(r.direction), S(r.t_min), S(r.t_max)};
  auto const hit = intersect<A, false, float>(h, in, true);
  if (!hit.valid) return {};
  return {hit.t, hit.u, hit.v, trace::detail::round_up<float>(hit.error), std::bit_cast<std::int32_t>(hit.patch_bits)};
}

template <accuracy A, int N> std::vector<patch_hit> hits_by_packs(mixed_hierarchy_view const& h, ray_list const& rays) {
  std::vector<patch_hit> hits(rays.size());
  std::size_t i = 0;
  for (; i + N <= rays.size(); i += N)
    trace::detail::fused_pack<A, false, N>(h, rays.data() + i, hits.data() + i, nullptr, (1u << N) - 1u, nullptr);
  hits.resize(i);
  return hits;
}

template <accuracy A, class E>
std::vector<patch_hit> list_of_hits(mixed_hierarchy_view const& h, ray_list const& rays, E const& exec) {
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h, std::span<ray<double> const>(rays), std::span(hits), exec);
  return hits;
}

ray_list mixed_rays(patch_list const& scene, std::mt19937& g) {
  ray_list rays = view_rays(scene, 2, 40, g);
  for (auto const& more : {chords(scene, 2000, g), rays_at_edges(scene, 2000, g), bounces(scene, 2000, g)})
    rays.insert(rays.end(), more.begin(), more.end());
  rays.resize(rays.size() / 16 * 16);
  return rays;
}

template <accuracy A> void check_scene(patch_list const& scene, unsigned seed) {
  CAPTURE(seed, int(A));
  std::mt19937 g(seed);
  auto const built = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  auto const h = built.view();
  ray_list const rays = mixed_rays(scene, g);
  auto const hits = list_of_hits<A>(h, rays, serial{});
  CHECK(std::count_if(hits.begin(), hits.end(), [](patch_hit const& p) { return p.valid(); }) > 1000);

  std::vector<patch_hit> single;
  for (auto const& r : rays) single.push_back(one_hit<A>(h, r));
  CHECK(differences(hits, single) == 0);
  CHECK(differences(hits, hits_by_packs<A, 4>(h, rays)) == 0);
  CHECK(differences(hits, hits_by_packs<A, 8>(h, rays)) == 0);
  CHECK(differences(hits, hits_by_packs<A, 16>(h, rays)) == 0);

  std::vector<std::size_t> order(rays.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::shuffle(order.begin(), order.end(), g);
  ray_list shuffled;
  for (std::size_t i : order) shuffled.push_back(rays[i]);
  auto const from_shuffled = list_of_hits<A>(h, shuffled, serial{});
  std::vector<patch_hit> back(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) back[order[i]] = from_shuffled[i];
  CHECK(differences(hits, back) == 0);

#ifdef PATCHRT_HAVE_OPENMP
  for (int threads : {1, 2, 3}) CHECK(differences(hits, list_of_hits<A>(h, rays, openmp(threads))) == 0);
#endif

  for (std::size_t n : {0, 1, 15, 17, 1025}) {
    ray_list const some(rays.begin() + 1600, rays.begin() + 1600 + std::ptrdiff_t(n));
    std::vector<patch_hit> const expected(hits.begin() + 1600, hits.begin() + 1600 + std::ptrdiff_t(n));
    CAPTURE(n);
    CHECK(differences(expected, list_of_hits<A>(h, some, serial{})) == 0);
  }

  std::vector<patch_hit> any(rays.size());
  trace::any_hits<A>(h, std::span<ray<double> const>(rays), std::span(any), serial{});
  std::size_t disagree = 0, nearer = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    disagree += any[i].valid() != hits[i].valid();
    if (any[i].valid()) nearer += !(rays[i].t_min < any[i].t && any[i].t < rays[i].t_max && hits[i].t <= any[i].t);
  }
  CHECK(disagree == 0);
  CHECK(nearer == 0);
}

void check_all(patch_list const& scene, unsigned seed) {
  check_scene<accuracy::refined>(scene, seed);
  check_scene<accuracy::certified>(scene, seed);
  check_scene<accuracy::fast>(scene, seed);
  check_scene<accuracy::reference>(scene, seed);
}

}  // namespace

TEST_CASE("one ray, packs, lists of any order and length, and threads give the same bits on the teapot") {
  check_all(load_model("teapot"), 11);
}

TEST_CASE("one ray, packs, lists of any order and length, and threads give the same bits on bigguy") {
  auto const scene = load_model("bigguy_osd_L2");
  if (scene.empty()) PATCHRT_SKIP("no bigguy_osd_L2.bpt in PATCHRT_SHARED_DATA");
  check_all(scene, 12);
}

TEST_CASE("one ray, packs, lists of any order and length, and threads give the same bits on patches that fold") {
  std::mt19937 g(13);
  patch_list scene;
  for (int k = 0; k < 10; ++k) scene.push_back(random_patch<double>(g));
  check_all(scene, 14);
}

TEST_CASE("of patches that coincide the first is hit") {
  std::mt19937 g(15);
  auto const p = random_sheet(g, 0.2);
  patch_list const scene(37, p);
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  auto const hits = list_of_hits<accuracy::refined>(h.view(), chords(scene, 1000, g), serial{});
  std::size_t valid = 0, later = 0;
  for (auto const& hit : hits) valid += hit.valid(), later += hit.patch > 0;
  CHECK(valid > 500);
  CHECK(later == 0);
}
