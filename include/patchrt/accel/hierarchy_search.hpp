// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays through a mixed hierarchy to hits: one ray, or a pack of them, by the same source.

#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/accel/patch_search.hpp>
#include <patchrt/intersect/ray_box.hpp>

namespace patchrt {

namespace detail {

/// Rays on their way through a mixed hierarchy. T is float or a pack of floats: the search's number; the ray itself and
/// its hits are kept in S, which is T for `accuracy::fast` and T's lanes in double otherwise.
///
/// What makes hits independent of the order in which boxes and lanes are visited: a root of a sub-patch counts only
/// where it is not nearer than the computed entry into the sub-patch's box (and that of its patch), and a box is
/// skipped only where its entry is beyond the nearest root, all in the same arithmetic; so a skipped box never held the
/// answer. In the same way a root in float is left uncorrected where it is beyond the nearest by more than float's
/// error, and counts only where the correction does not bring it nearer by more than that. Ties go to the smaller patch
/// number, then u, then v.
template <accuracy A, class Surface, scalar T, class Sink = nearest_only> class hierarchy_search {
 public:
  using S = search_scalar_t<A, T>;
  using TM = mask_t<T>;
  using L = lane_t<S>;

  /// \pre some lane is in `active`
  template <class R>
  PATCHRT_INLINE hierarchy_search(basic_mixed_hierarchy_view<Surface> const& hierarchy, ray<R> const& r, TM active,
                                  Sink const& sink = {})
      : state_(hierarchy, sink) {
    prepare({convert_vec<S>(r.origin), convert_vec<S>(r.direction), convert<S>(r.t_min), convert<S>(r.t_max)}, active);
  }

  /// The nearest hits, or any where `AnyHit`.
  template <bool AnyHit> PATCHRT_INLINE lane_hit<S, T> const& run(hierarchy_counts* counts) {
    state_.counts = counts;
    state_.hit.tangent = state_.hit.degenerate = state_.active && !state_.active;
    if (!any_of(state_.active)) return state_.hit;
    if constexpr (A == accuracy::certified)
      state_.touches_from = state_.doubt_from = S(std::numeric_limits<L>::infinity());
    unsigned const octant = common_octant(state_.direction, state_.active);  // results do not depend on it
    T nearest = convert<T>(state_.nearest);
    T entry;
    TM lanes;
    traverse(
        state_.hierarchy.top, octant,
        [&](box<float> const& b) PATCHRT_INLINE_LAMBDA {
          auto const span = intersect(state_.slabs, b, state_.search_t_min, nearest);
          entry = span.entry;
          lanes = state_.active && entry <= span.exit;
          return any_of(lanes);
        },
        [&](std::int32_t patch) PATCHRT_INLINE_LAMBDA {
          patch_search<A, Surface, T, Sink>(state_, patch, lanes, entry, octant).run();
          nearest = convert<T>(state_.nearest);
          if constexpr (AnyHit) {
            state_.active = state_.active && !convert<TM>(state_.hit.valid);
            return !any_of(state_.active);
          } else {
            return false;
          }
        });
    if constexpr (A == accuracy::certified) {
      S const end = min(state_.nearest, S(std::numeric_limits<L>::max()));
      state_.hit.tangent = convert<TM>(state_.touches_from <= end);
      state_.hit.degenerate = convert<TM>(state_.doubt_from <= end);
    }
    return state_.hit;
  }

 private:
  /// Everything in search space, and what the search needs of it.
  PATCHRT_INLINE void prepare(ray<S> const& r, TM active) {
    auto& s = state_;
    S const zero(L(0));
    s.origin = r.origin;
    s.t_min = r.t_min;
    s.hit.t = r.t_max;
    s.hit.u = s.hit.v = s.hit.error = zero;
    s.hit.patch_bits = T(0);
    s.hit.valid = zero < zero;
    // Scaled by a power of two, exactly: the largest component is in [1, 2).
    S const scaled = power_of_two_below(max(abs(r.direction.x), max(abs(r.direction.y), abs(r.direction.z))));
    s.per_scaled = S(L(1)) / scaled;
    s.search_direction = scale(r.direction, s.per_scaled);
    s.to_search = scaled * S(static_cast<L>(s.hierarchy.inverse_scale));
    s.direction = convert_vec<T>(s.search_direction);
    s.squared_length = dot(s.direction, s.direction);
    s.search_origin = scale(difference(r.origin, convert_vec<S>(vec3<L>(s.hierarchy.centre))),
                            S(static_cast<L>(s.hierarchy.inverse_scale)));
    // Rays from afar start where they enter the ball of radius 2 around the scene, before anything is rounded to float.
    s.per_squared_length = T(1) / s.squared_length;
    s.per_square = convert<S>(s.per_squared_length);
    S const exact_square = dot(s.search_direction, s.search_direction);
    for (int step = 0; step < 2; ++step) s.per_square = s.per_square * fma(-s.per_square, exact_square, S(L(2)));
    s.shift = max(fma(-dot(s.search_origin, s.search_direction), s.per_square, S(L(-2))), zero);
    s.search_origin = fma(s.shift, s.search_direction, s.search_origin);
    // A direction without a length, or a NaN, is not in the range; such a lane never takes part.
    S const squared = dot(r.direction, r.direction);
    s.active =
        active && convert<TM>(zero < squared && squared < S(std::numeric_limits<L>::infinity()) && r.t_min < r.t_max);
    s.slabs = make_slab_ray(convert_vec<T>(s.search_origin), s.direction);
    plane_normals(s.direction, s.n1, s.n2);
    s.abs_n1 = absolute(s.n1);
    s.abs_n2 = absolute(s.n2);
    s.nearest = fma(r.t_max, s.to_search, -s.shift);
    s.search_t_min = convert<T>(fma(r.t_min, s.to_search, -s.shift)) - T(search_margin);
  }

  search_state<A, Surface, T, Sink> state_;
};

/// False only for lanes whose line misses the scene's box: the separating axes of line and box, which need no division.
/// Rays too far or too long or short for float are not judged.
template <scalar T, class Surface, class R>
PATCHRT_INLINE mask_t<T> near_scene(basic_mixed_hierarchy_view<Surface> const& h, ray<R> const& r) {
  T const inverse_scale(static_cast<float>(h.inverse_scale));
  vec3<T> const d = convert_vec<T>(r.direction), from_zero = scale(convert_vec<T>(r.origin), inverse_scale);
  vec3<float> const centre(h.centre);
  vec3<T> const o{from_zero.x - T(centre.x) * inverse_scale, from_zero.y - T(centre.y) * inverse_scale,
                  from_zero.z - T(centre.z) * inverse_scale};
  vec3<T> const ad = absolute(d);
  T const far = abs(o.x) + abs(o.y) + abs(o.z) + abs(from_zero.x) + abs(from_zero.y) + abs(from_zero.z);
  T const size = ad.x + ad.y + ad.z;
  T const slack = fma(far, T(0x1p-20f), T(0x1p-20f)) * size;
  auto const overlap = [&](T const& oa, T const& da, T const& ob, T const& db, T const& reach) {
    return abs(fma(oa, db, -(ob * da))) <= reach + slack;
  };
  T const hx(h.half_extent.x), hy(h.half_extent.y), hz(h.half_extent.z);
  auto const ordinary = T(1e-12f) < size && size < T(1e12f) && far < T(1e12f);
  return !ordinary || (overlap(o.x, d.x, o.y, d.y, fma(hx, ad.y, hy * ad.x)) &&
                       overlap(o.y, d.y, o.z, d.z, fma(hy, ad.z, hz * ad.y)) &&
                       overlap(o.z, d.z, o.x, d.x, fma(hz, ad.x, hx * ad.z)));
}

}  // namespace detail

/// Nearest hit of each ray in (t_min, t_max); with `AnyHit` some hit, found sooner: for shadow rays.
///
/// T = float traces one ray, T = pack<float, N> N rays at once, with the same bits in every lane. `counts`, where not
/// null, is added to.
template <accuracy A, bool AnyHit, scalar T, class Surface, class R>
PATCHRT_INLINE lane_hit<search_scalar_t<A, T>, T> intersect(basic_mixed_hierarchy_view<Surface> const& hierarchy,
                                                            ray<R> const& r, mask_t<T> active,
                                                            hierarchy_counts* counts = nullptr) {
  detail::hierarchy_search<A, Surface, T> search(hierarchy, r, active && detail::near_scene<T>(hierarchy, r));
  return search.template run<AnyHit>(counts);
}

/// All roots of one ray in (t_min, t_max), in no order, to `sink(patch, patch_root<double>)`; those on borders of
/// sub-patches and on edges that patches share come more than once.
template <accuracy A, class Surface, class R, class Sink>
PATCHRT_INLINE void visit_roots(basic_mixed_hierarchy_view<Surface> const& hierarchy, ray<R> const& r,
                                Sink const& sink) {
  if (!detail::near_scene<float>(hierarchy, r)) return;
  detail::hierarchy_search<A, Surface, float, Sink> search(hierarchy, r, true, sink);
  (void)search.template run<false>(nullptr);
}

}  // namespace patchrt
