// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Lists of rays to lists of hits on the CPU, in one fused step a pack of rays: traverse, search, correct, and let the
/// nearest hit prune the rest. Needs the component `patchrt::pack`.

#include <patchrt/accel/hierarchy_search.hpp>
#include <patchrt/exec/executor.hpp>
#include <patchrt/numbers/pack.hpp>
#include <patchrt/trace/patch_hit.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>

namespace patchrt {

namespace trace {

/// Rays that are traced together: the lanes of a pack.
inline constexpr int fused_width = 16;

namespace detail {

/// One pack of rays: `rays` and `hits` hold N of each.
template <accuracy A, bool AnyHit, int N, class Surface, class R>
void fused_pack(basic_mixed_hierarchy_view<Surface> const& h, ray<R> const* rays, patch_hit* hits,
                certainty* certainties, std::uint32_t active, hierarchy_counts* counts) {
  using T = pack<float, N>;
  using L = lane_t<search_scalar_t<A, T>>;
  static_assert(sizeof(ray<R>) == 8 * sizeof(R));
  pack<R, N> r[8];
  load_records(&rays->origin.x, r);
  ray<pack<R, N>> const pack_of_rays{{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6], r[7]};
  // The lists stream through the cache: ask for the lines of the pack after the next.
  constexpr int line = 64;
  for (std::size_t i = 0; i < N * sizeof(ray<R>); i += line)
    __builtin_prefetch(reinterpret_cast<char const*>(rays + 2 * N) + i);
  for (std::size_t i = 0; i < N * sizeof(patch_hit); i += line)
    __builtin_prefetch(reinterpret_cast<char const*>(hits + 2 * N) + i, 1);
  static constexpr std::array<patch_hit, N> misses{};
  std::memcpy(hits, misses.data(), sizeof misses);  // whole cache lines: most packs of a picture write nothing else
  if constexpr (A == accuracy::certified)
    if (certainties) std::fill_n(certainties, N, certainty::certified);
  mask_t<T> const near = patchrt::detail::near_scene<T>(h, pack_of_rays) && mask_t<T>::from_bits(active);
  if (!any_of(near)) return;
  patchrt::detail::hierarchy_search<A, Surface, T> search(h, pack_of_rays, near);
  auto const& hit = search.template run<AnyHit>(counts);
  if constexpr (A == accuracy::certified) {
    std::uint32_t const tangent = hit.tangent.bits(), degenerate = hit.degenerate.bits();
    if (certainties && (tangent | degenerate) != 0) {
      for (int i = 0; i < N; ++i)
        if ((degenerate >> i & 1u) != 0) certainties[i] = certainty::degenerate;
        else if ((tangent >> i & 1u) != 0) certainties[i] = certainty::tangent;
    }
  }
  std::uint32_t valid = hit.valid.bits();
  if (valid == 0) return;
  L t[N], u[N], v[N];
  float error[N], patch[N];
  hit.t.store(t);
  hit.u.store(u);
  hit.v.store(v);
  round_up<T>(hit.error).store(error);
  hit.patch_bits.store(patch);
  for (; valid != 0; valid &= valid - 1) {
    int const i = std::countr_zero(valid);
    hits[i] = {t[i], u[i], v[i], error[i], std::bit_cast<std::int32_t>(patch[i])};
  }
}

template <accuracy A, bool AnyHit, class Surface, class R, executor E>
void fused_list(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<R> const> rays,
                std::span<patch_hit> hits, std::span<certainty> certainties, E const& exec, hierarchy_counts* counts) {
  PATCHRT_EXPECTS(hits.size() == rays.size());
  PATCHRT_EXPECTS(certainties.empty() || certainties.size() == rays.size());
  exec.for_each_chunk(rays.size(), std::size_t(1024), [&](std::size_t begin, std::size_t end) {
    hierarchy_counts own;
    constexpr std::uint32_t all = (1u << fused_width) - 1u;
    hierarchy_counts* const c = counts ? &own : nullptr;
    std::size_t i = begin;
    for (; i + fused_width <= end; i += fused_width)
      fused_pack<A, AnyHit, fused_width>(hierarchy, rays.data() + i, hits.data() + i,
                                         certainties.empty() ? nullptr : certainties.data() + i, all, c);
    if (i < end) {
      ray<R> last_rays[fused_width];
      patch_hit last_hits[fused_width];
      certainty last_certainties[fused_width];
      std::fill(std::copy(rays.begin() + std::ptrdiff_t(i), rays.begin() + std::ptrdiff_t(end), last_rays),
                last_rays + fused_width, rays[i]);
      fused_pack<A, AnyHit, fused_width>(hierarchy, last_rays, last_hits, last_certainties, (1u << (end - i)) - 1u, c);
      std::copy(last_hits, last_hits + (end - i), hits.begin() + std::ptrdiff_t(i));
      if (!certainties.empty())
        std::copy(last_certainties, last_certainties + (end - i), certainties.begin() + std::ptrdiff_t(i));
    }
    if (counts) {
      std::atomic_ref(counts->candidates) += own.candidates;
      std::atomic_ref(counts->newton_steps) += own.newton_steps;
      std::atomic_ref(counts->patches) += own.patches;
    }
  });
}

}  // namespace detail

/// The nearest hit of every ray in (t_min, t_max).
///
/// A NaN anywhere in a ray, a direction of length 0 or whose squared length over- or underflows, or t_min >= t_max is a
/// miss. The hits are the same bits for every executor and number of threads, and for every order of the rays.
/// `counts`, where not null, is added to.
/// \pre hits.size() == rays.size()
/// \note Nigam & Narayanan 2012, section 5.1: the single step of the CPU, resuming the BVH with the hit's t.
template <accuracy A = accuracy::refined, class Surface, executor E>
void closest_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<double> const> rays,
                  std::span<patch_hit> hits, E const& exec, hierarchy_counts* counts = nullptr) {
  detail::fused_list<A, false>(hierarchy, rays, hits, {}, exec, counts);
}
/// Rays in float, half as many bytes to read: their hits are those of the same rays in double.
template <accuracy A = accuracy::refined, class Surface, executor E>
void closest_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<float> const> rays,
                  std::span<patch_hit> hits, E const& exec, hierarchy_counts* counts = nullptr) {
  detail::fused_list<A, false>(hierarchy, rays, hits, {}, exec, counts);
}

/// The nearest hits at level `certified`, and what is proved of each answer, a miss included, in `certainties`.
/// \pre hits.size() == rays.size() == certainties.size()
template <class Surface, executor E>
void certified_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<double> const> rays,
                    std::span<patch_hit> hits, std::span<certainty> certainties, E const& exec,
                    hierarchy_counts* counts = nullptr) {
  detail::fused_list<accuracy::certified, false>(hierarchy, rays, hits, certainties, exec, counts);
}
/// The same for rays in float.
template <class Surface, executor E>
void certified_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<float> const> rays,
                    std::span<patch_hit> hits, std::span<certainty> certainties, E const& exec,
                    hierarchy_counts* counts = nullptr) {
  detail::fused_list<accuracy::certified, false>(hierarchy, rays, hits, certainties, exec, counts);
}

/// Some hit of every ray that has one in (t_min, t_max), found sooner: what shadow rays ask.
///
/// Which rays hit does not depend on executor, threads or order; which of its hits a ray reports does.
template <accuracy A = accuracy::refined, class Surface, executor E>
void any_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<double> const> rays,
              std::span<patch_hit> hits, E const& exec, hierarchy_counts* counts = nullptr) {
  detail::fused_list<A, true>(hierarchy, rays, hits, {}, exec, counts);
}
/// The same for rays in float.
template <accuracy A = accuracy::refined, class Surface, executor E>
void any_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, std::span<ray<float> const> rays,
              std::span<patch_hit> hits, E const& exec, hierarchy_counts* counts = nullptr) {
  detail::fused_list<A, true>(hierarchy, rays, hits, {}, exec, counts);
}

}  // namespace trace
}  // namespace patchrt
