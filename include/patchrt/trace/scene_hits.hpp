// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Lists of rays to lists of hits in a scene, on the CPU. Packs of rays that keep together walk the wide tree as one,
/// others ray by ray. Needs the component `patchrt::pack`.

#include <patchrt/accel/scene_search.hpp>
#include <patchrt/accel/traverse_wide.hpp>
#include <patchrt/exec/executor.hpp>
#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace patchrt::trace {

namespace detail {

/// Rays that are traced together: the lanes of a pack.
inline constexpr int scene_width = 16;
using box_lanes = pack<float, wide_node::width>;

template <class... Shapes> inline constexpr bool wants_packs = (shape_kind<Shapes>::wants_packs || ...);

/// Whether the rays of a pack are near enough to each other to walk as a bundle: origins within a sixteenth of the scene,
/// directions within about 15 degrees of that of lane i.
template <scalar R> bool keeps_together(ray<R> const& r, mask_t<R> const& lanes, int i, double reach) {
  using L = lane_t<R>;
  vec3<R> const o(R(r.origin.x[i]), R(r.origin.y[i]), R(r.origin.z[i]));
  vec3<R> const d(R(r.direction.x[i]), R(r.direction.y[i]), R(r.direction.z[i]));
  auto const near = sum_of_magnitudes(difference(r.origin, o)) <= R(L(reach / 16)) &&
                    sum_of_magnitudes(difference(r.direction, d)) <= R(L(0.25)) * sum_of_magnitudes(d);
  return !any_of(lanes && !near);
}

template <bool AnyHit, class R, class... Shapes>
void trace_one(scene_view<Shapes...> const& scene, ray<R> const& r, scene_hit<R>& hit) {
  patchrt::detail::scene_search<AnyHit, float, R, box_lanes, Shapes...> search(scene, r, true);
  if (!search.active()) return;
  (void)traverse_wide<AnyHit, box_lanes>(
      scene.wide, search.slabs(), search.t_min(), [&]() PATCHRT_INLINE_LAMBDA { return search.nearest(); },
      [&](std::uint32_t leaf, float entry) PATCHRT_INLINE_LAMBDA { return !search.meet_leaf(leaf, true, entry); });
  auto const& h = search.hit();
  if (h.valid)
    hit = {h.t, h.u, h.v, std::bit_cast<std::int32_t>(h.shape_bits), std::bit_cast<std::int32_t>(h.part_bits)};
}

template <bool AnyHit, class R, class... Shapes>
void trace_pack(scene_view<Shapes...> const& scene, ray<R> const* rays, scene_hit<R>* hits, std::uint32_t on) {
  constexpr int N = scene_width;
  using T = pack<float, N>;
  using M = mask_t<T>;
  static_assert(sizeof(ray<R>) == 8 * sizeof(R));
  pack<R, N> r[8];
  load_records(&rays->origin.x, r);
  // The lists stream through the cache: ask for the lines of the pack after the next.
  constexpr int line = 64;
  for (std::size_t i = 0; i < N * sizeof(ray<R>); i += line)
    __builtin_prefetch(reinterpret_cast<char const*>(rays + 2 * N) + i);
  for (std::size_t i = 0; i < N * sizeof(scene_hit<R>); i += line)
    __builtin_prefetch(reinterpret_cast<char const*>(hits + 2 * N) + i, 1);
  static constexpr std::array<scene_hit<R>, N> misses{};
  std::memcpy(hits, misses.data(), sizeof misses);
  ray<pack<R, N>> const pack_of_rays{{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6], r[7]};
  if (!wants_packs<Shapes...> &&
      !keeps_together(pack_of_rays, mask_t<pack<R, N>>::from_bits(on), std::countr_zero(on), scene.reach)) {
    for (; on != 0; on &= on - 1) {
      int const i = std::countr_zero(on);
      trace_one<AnyHit>(scene, rays[i], hits[i]);
    }
    return;
  }
  patchrt::detail::scene_search<AnyHit, T, pack<R, N>, void, Shapes...> search(scene, pack_of_rays, M::from_bits(on));
  auto const span = patchrt::intersect(search.slabs(), scene.bounds, search.t_min(), search.nearest());
  on = (search.active() && span.entry <= span.exit).bits();
  if (on == 0) return;
  auto const& inverse = search.slabs().inverse;
  std::uint32_t const negative[3] = {(inverse.x < T(0)).bits(), (inverse.y < T(0)).bits(), (inverse.z < T(0)).bits()};
  for (std::uint32_t left = on; left != 0;) {
    int const i = std::countr_zero(left);
    std::uint32_t group = left;  // the octant of the first lane that is left
    for (std::uint32_t n : negative) group &= (n >> i & 1u) != 0 ? n : ~n;
    left &= ~group;
    traverse_wide_bundle<box_lanes>(
        scene.wide, search.slabs(), search.t_min(), M::from_bits(group),
        [&]() PATCHRT_INLINE_LAMBDA { return search.nearest(); },
        [&](std::uint32_t leaf, M const& in, T const& entry)
            PATCHRT_INLINE_LAMBDA { return search.meet_leaf(leaf, in, entry); });
  }
  auto const& h = search.hit();
  std::uint32_t valid = h.valid.bits();
  if (valid == 0) return;
  R t[N], u[N], v[N];
  float shape[N], part[N];
  h.t.store(t);
  h.u.store(u);
  h.v.store(v);
  h.shape_bits.store(shape);
  h.part_bits.store(part);
  for (; valid != 0; valid &= valid - 1) {
    int const i = std::countr_zero(valid);
    hits[i] = {t[i], u[i], v[i], std::bit_cast<std::int32_t>(shape[i]), std::bit_cast<std::int32_t>(part[i])};
  }
}

template <bool AnyHit, class R, class... Shapes, executor E>
void scene_list(scene_view<Shapes...> const& scene, std::span<ray<R> const> rays, std::span<scene_hit<R>> hits,
                E const& exec) {
  PATCHRT_EXPECTS(hits.size() == rays.size());
  constexpr int N = scene_width;
  exec.for_each_chunk(rays.size(), std::size_t(1024), [&](std::size_t begin, std::size_t end) {
    std::size_t i = begin;
    for (; i + N <= end; i += N) trace_pack<AnyHit>(scene, rays.data() + i, hits.data() + i, (1u << N) - 1u);
    if (i == end) return;
    ray<R> last_rays[N];
    scene_hit<R> last_hits[N];
    std::fill(std::copy(rays.begin() + std::ptrdiff_t(i), rays.begin() + std::ptrdiff_t(end), last_rays), last_rays + N,
              rays[i]);
    trace_pack<AnyHit>(scene, last_rays, last_hits, (1u << (end - i)) - 1u);
    std::copy(last_hits, last_hits + (end - i), hits.begin() + std::ptrdiff_t(i));
  });
}

}  // namespace detail

/// The nearest hit of every ray in (t_min, t_max) in a scene that was built for wide walks.
///
/// A NaN anywhere in a ray, a direction of length 0 or whose squared length over- or underflows, or t_min >= t_max is a miss.
/// The hits are the same bits for every executor and number of threads, for every order of the rays, and those of `intersect`
/// without a stack.
/// \pre hits.size() == rays.size()
template <class... Shapes, executor E>
void closest_hits(scene_view<Shapes...> const& scene, std::span<ray<float> const> rays,
                  std::span<scene_hit<float>> hits, E const& exec) {
  detail::scene_list<false>(scene, rays, hits, exec);
}
template <class... Shapes, executor E>
void closest_hits(scene_view<Shapes...> const& scene, std::span<ray<double> const> rays,
                  std::span<scene_hit<double>> hits, E const& exec) {
  detail::scene_list<false>(scene, rays, hits, exec);
}

/// The same of one ray.
template <class... Shapes, class R> scene_hit<R> closest_hit(scene_view<Shapes...> const& scene, ray<R> const& r) {
  scene_hit<R> hit;
  detail::trace_one<false>(scene, r, hit);
  return hit;
}
/// And some hit of one ray.
template <class... Shapes, class R> scene_hit<R> any_hit(scene_view<Shapes...> const& scene, ray<R> const& r) {
  scene_hit<R> hit;
  detail::trace_one<true>(scene, r, hit);
  return hit;
}

/// Some hit of every ray that has one in (t_min, t_max), found sooner: what shadow rays ask.
///
/// Which rays hit does not depend on executor, threads or order; which of its hits a ray reports does.
template <class... Shapes, executor E>
void any_hits(scene_view<Shapes...> const& scene, std::span<ray<float> const> rays, std::span<scene_hit<float>> hits,
              E const& exec) {
  detail::scene_list<true>(scene, rays, hits, exec);
}
template <class... Shapes, executor E>
void any_hits(scene_view<Shapes...> const& scene, std::span<ray<double> const> rays, std::span<scene_hit<double>> hits,
              E const& exec) {
  detail::scene_list<true>(scene, rays, hits, exec);
}

}  // namespace patchrt::trace
