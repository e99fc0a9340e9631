// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Lists of rays to lists of hits on the CPU, in one fused step a pack of rays: traverse, search, correct, and let the nearest
/// hit prune the rest. Needs the component `patchrt::pack`.

#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/exec/executor.hpp>
#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace patchrt {

/// A ray's hit: t in units of |direction|, (u, v) in [0, 1]^2 on patch number `patch`; `patch` is -1 and t infinite for a miss.
/// `residual` as in `patch_root`.
struct patch_hit {
  double t = std::numeric_limits<double>::infinity();
  double u = 0, v = 0;
  double residual = 0;
  std::int32_t patch = -1;

  bool valid() const { return patch >= 0; }
};

namespace trace {

/// Rays that are traced together: the lanes of a pack.
inline constexpr int fused_width = 16;

namespace detail {

template <accuracy A, bool AnyHit, int N>
void fused_pack(mixed_hierarchy_view const& h, ray<double> const* rays, patch_hit* hits, int count,
                hierarchy_counts* counts) {
  using T = pack<float, N>;
  using S = hit_scalar_t<A, T>;
  using L = lane_t<S>;
  L lane[8][N];
  for (int i = 0; i < N; ++i) {
    ray<double> const& r = rays[i < count ? i : 0];
    lane[0][i] = static_cast<L>(r.origin.x);
    lane[1][i] = static_cast<L>(r.origin.y);
    lane[2][i] = static_cast<L>(r.origin.z);
    lane[3][i] = static_cast<L>(r.direction.x);
    lane[4][i] = static_cast<L>(r.direction.y);
    lane[5][i] = static_cast<L>(r.direction.z);
    lane[6][i] = static_cast<L>(r.t_min);
    lane[7][i] = static_cast<L>(r.t_max);
  }
  ray<S> const r{{S::load(lane[0]), S::load(lane[1]), S::load(lane[2])},
                 {S::load(lane[3]), S::load(lane[4]), S::load(lane[5])},
                 S::load(lane[6]),
                 S::load(lane[7])};
  auto const active = mask_t<T>::from_bits((1u << count) - 1u);
  auto const hit = intersect<A, AnyHit, T>(h, r, active, counts);
  std::uint32_t const valid = hit.valid.bits();
  if (valid == 0) {
    for (int i = 0; i < count; ++i) hits[i] = {};
    return;
  }
  float patch[N];
  hit.t.store(lane[0]);
  hit.u.store(lane[1]);
  hit.v.store(lane[2]);
  hit.residual.store(lane[3]);
  hit.patch_bits.store(patch);
  for (int i = 0; i < count; ++i)
    hits[i] = valid >> i & 1u ? patch_hit{lane[0][i], lane[1][i], lane[2][i], lane[3][i], std::bit_cast<std::int32_t>(patch[i])}
                              : patch_hit{};
}

template <accuracy A, bool AnyHit, executor E>
void fused_list(mixed_hierarchy_view const& hierarchy, std::span<ray<double> const> rays, std::span<patch_hit> hits,
                E const& exec, hierarchy_counts* counts) {
  PATCHRT_EXPECTS(hits.size() == rays.size());
  exec.for_each_chunk(rays.size(), std::size_t(1024), [&](std::size_t begin, std::size_t end) {
    hierarchy_counts own;
    for (std::size_t i = begin; i < end; i += fused_width)
      fused_pack<A, AnyHit, fused_width>(hierarchy, rays.data() + i, hits.data() + i,
                                         static_cast<int>(std::min<std::size_t>(fused_width, end - i)),
                                         counts ? &own : nullptr);
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
/// A NaN anywhere in a ray, a zero direction, or t_min >= t_max is a miss. The hits are the same bits for every executor and
/// number of threads, and for every order of the rays. `counts`, where not null, is added to.
/// \pre hits.size() == rays.size()
/// \note Nigam & Narayanan 2012, section 5.1: the single step of the CPU, resuming the BVH with the hit's t.
template <accuracy A = accuracy::refined, executor E>
void closest_hits(mixed_hierarchy_view const& hierarchy, std::span<ray<double> const> rays, std::span<patch_hit> hits,
                  E const& exec, hierarchy_counts* counts = nullptr) {
  detail::fused_list<A, false>(hierarchy, rays, hits, exec, counts);
}

/// Some hit of every ray that has one in (t_min, t_max), found sooner: what shadow rays ask.
///
/// Which rays hit does not depend on executor, threads or order; which of its hits a ray reports does.
template <accuracy A = accuracy::refined, executor E>
void any_hits(mixed_hierarchy_view const& hierarchy, std::span<ray<double> const> rays, std::span<patch_hit> hits,
              E const& exec, hierarchy_counts* counts = nullptr) {
  detail::fused_list<A, true>(hierarchy, rays, hits, exec, counts);
}

}  // namespace trace
}  // namespace patchrt
