// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Every hit of a ray, not only the nearest: what CAD's point classification and sections ask for.

#include <patchrt/accel/hierarchy_search.hpp>
#include <patchrt/trace/patch_hit.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace patchrt::trace {

namespace detail {

/// What tells a hit from others: where it is, how far it may be off, and how near to an edge it is.
struct placed_hit {
  patch_hit hit;
  vec3<double> position;
  double error;  // at a tangency, where it may be infinite, 2^-20 of the patch
  double edge;   // the distance from the nearest edge of its patch, about
  double gap;    // of that patch's edges
};

template <class Surface>
placed_hit place(basic_mixed_hierarchy_view<Surface> const& h, std::int32_t patch, patch_root<double> const& root) {
  exact_patch<Surface> const& e = h.exact[patch];
  surface_point<double> const p = evaluate(e.patch, root.u, root.v);
  auto const length = [](vec3<double> const& a) { return std::sqrt(dot(a, a)); };
  placed_hit placed;
  placed.hit = {root.t, root.u, root.v, round_up<float>(root.error), patch};
  placed.position = p.position + e.base;
  placed.error = std::min(root.error, 0x1p-20 * e.size);
  placed.edge = std::min(std::min(root.u, 1 - root.u) * length(p.du), std::min(root.v, 1 - root.v) * length(p.dv));
  placed.gap = largest_gap(e.gaps);
  return placed;
}

/// Whether two hits are one: on one patch, or on two of them at an edge that they share, and no farther apart than they
/// may be off.
inline bool is_same(placed_hit const& a, placed_hit const& b) {
  bool const one_patch = a.hit.patch == b.hit.patch;
  bool const across = std::fabs(a.hit.u - b.hit.u) > 0.5 || std::fabs(a.hit.v - b.hit.v) > 0.5;  // of a tube
  double const spare = a.error + b.error + (one_patch && !across ? 0 : a.gap + b.gap);
  if (!one_patch && (a.edge > spare || b.edge > spare)) return false;
  vec3<double> const d = a.position - b.position;
  return std::sqrt(dot(d, d)) <= spare;
}

}  // namespace detail

/// All hits of a ray in (t_min, t_max) by ascending t, each once: hits that are no farther apart than their errors are
/// one where they are on the same patch, or on the edges of two, gaps included. Of equal ones the first by t, then by
/// patch, stays.
template <accuracy A = accuracy::refined, class Surface, class R>
std::vector<patch_hit> all_hits(basic_mixed_hierarchy_view<Surface> const& hierarchy, ray<R> const& r) {
  static_assert(A != accuracy::fast, "all_hits tells hits apart by errors in double");
  std::vector<detail::placed_hit> found;
  auto const add = [&](std::int32_t patch, patch_root<double> const& root) {
    found.push_back(detail::place(hierarchy, patch, root));
  };
  visit_roots<A>(hierarchy, r, add);
  std::sort(found.begin(), found.end(), [](detail::placed_hit const& a, detail::placed_hit const& b) {
    if (a.hit.t != b.hit.t) return a.hit.t < b.hit.t;
    if (a.hit.patch != b.hit.patch) return a.hit.patch < b.hit.patch;
    return a.hit.u != b.hit.u ? a.hit.u < b.hit.u : a.hit.v < b.hit.v;
  });
  std::vector<detail::placed_hit> kept;
  for (detail::placed_hit const& f : found)
    if (std::none_of(kept.begin(), kept.end(), [&](detail::placed_hit const& k) { return detail::is_same(k, f); }))
      kept.push_back(f);
  std::vector<patch_hit> hits;
  for (detail::placed_hit const& k : kept) hits.push_back(k.hit);
  return hits;
}

}  // namespace patchrt::trace
