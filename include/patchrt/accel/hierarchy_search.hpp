// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays through a mixed hierarchy to hits: one ray, or a pack of them, by the same source.

#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/accel/patch_search.hpp>
#include <patchrt/intersect/ray_box.hpp>

namespace patchrt {

namespace detail {

/// Rays on their way through a mixed hierarchy. T is float or a pack of floats: the search's number; the ray itself and its
/// hits are kept in S, which is T for `accuracy::fast` and T's lanes in double otherwise.
///
/// What makes hits independent of the order in which boxes and lanes are visited: a root of a sub-patch counts only where
/// it is not nearer than the computed entry into the sub-patch's box (and that of its patch), and a box is skipped only where
/// its entry is beyond the nearest root, all in the same arithmetic; so a skipped box never held the answer. Ties go
/// to the smaller patch number, then u, then v.
template <accuracy A, scalar T> class hierarchy_search {
 public:
  using S = search_scalar_t<A, T>;
  using TM = mask_t<T>;
  using L = lane_t<S>;

  PATCHRT_INLINE hierarchy_search(mixed_hierarchy_view const& hierarchy, ray<S> const& r, TM active)
      : state_(hierarchy, r) {
    state_.active = active && near_scene();
    if (any_of(state_.active)) prepare(r);
  }

  /// The nearest hits, or any where `AnyHit`.
  template <bool AnyHit> PATCHRT_INLINE lane_hit<S, T> const& run(hierarchy_counts* counts) {
    if (!any_of(state_.active)) return state_.hit;
    state_.counts = counts;
    unsigned const octant = common_octant();
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
          patch_search<A, T>(state_, patch, lanes, entry, octant).run();
          nearest = convert<T>(state_.nearest);
          if constexpr (AnyHit) {
            state_.active = state_.active && !convert<TM>(state_.hit.valid);
            return !any_of(state_.active);
          } else {
            return false;
          }
        });
    return state_.hit;
  }

 private:
  /// Everything in search space, and what the search needs of it.
  PATCHRT_INLINE void prepare(ray<S> const& r) {
    auto& s = state_;
    S const length = sqrt(dot(r.direction, r.direction));
    s.to_search = length * S(static_cast<L>(s.hierarchy.inverse_scale));
    s.search_direction = scale(r.direction, S(1) / length);
    // Rays from afar start where they enter the ball of radius 2 around the scene, before anything is rounded to float.
    s.shift = max(-dot(s.search_origin, s.search_direction) - S(L(2)), S(0));
    s.search_origin = fma(s.shift, s.search_direction, s.search_origin);
    // A direction without a length, or a NaN, is not in the range; such a lane never takes part.
    s.active =
        s.active && convert<TM>(S(0) < length && length < S(std::numeric_limits<L>::infinity()) && r.t_min < r.t_max);
    s.direction = convert_vec<T>(s.search_direction);
    s.slabs = make_slab_ray(convert_vec<T>(s.search_origin), s.direction);
    plane_normals(s.direction, s.n1, s.n2);
    s.abs_n1 = {abs(s.n1.x), abs(s.n1.y), abs(s.n1.z)};
    s.abs_n2 = {abs(s.n2.x), abs(s.n2.y), abs(s.n2.z)};
    s.nearest = fma(r.t_max, s.to_search, -s.shift);
    s.search_t_min = convert<T>(fma(r.t_min, s.to_search, -s.shift)) - T(search_margin);
  }

  /// False only for lanes whose line misses the scene's box: the separating axes of line and box,
  /// which need no division. Rays too far or too long or short for float are not judged.
  PATCHRT_INLINE TM near_scene() const {
    vec3<T> const o = convert_vec<T>(state_.search_origin), d = convert_vec<T>(state_.user.direction);
    vec3<T> const ad{abs(d.x), abs(d.y), abs(d.z)};
    vec3<float> const& half = state_.hierarchy.half_extent;
    T const far = abs(o.x) + abs(o.y) + abs(o.z);
    T const size = ad.x + ad.y + ad.z;
    T const slack = fma(far, T(0x1p-20f), T(0x1p-20f)) * size;
    auto const overlap = [&](T const& oa, T const& da, T const& ob, T const& db, T const& reach) {
      return abs(fma(oa, db, -(ob * da))) <= reach + slack;
    };
    T const hx(half.x), hy(half.y), hz(half.z);
    auto const ordinary = T(1e-12f) < size && size < T(1e12f) && far < T(1e12f);
    return !ordinary || (overlap(o.x, d.x, o.y, d.y, fma(hx, ad.y, hy * ad.x)) &&
                         overlap(o.y, d.y, o.z, d.z, fma(hy, ad.z, hz * ad.y)) &&
                         overlap(o.z, d.z, o.x, d.x, fma(hz, ad.x, hx * ad.z)));
  }

  /// The octant of most lanes: it says in which order boxes are visited, on which results do not depend.
  PATCHRT_INLINE unsigned common_octant() const {
    unsigned const on = mask_bits(state_.active);
    auto const most = [on](TM negative) {
      return 2 * std::popcount(mask_bits(negative) & on) > std::popcount(on) ? 1u : 0u;
    };
    return most(state_.direction.x < T(0)) | most(state_.direction.y < T(0)) << 1 |
           most(state_.direction.z < T(0)) << 2;
  }

  search_state<A, T> state_;
};

}  // namespace detail

/// Nearest hit of each ray in (t_min, t_max); with `AnyHit` some hit, found sooner: for shadow rays.
///
/// T = float traces one ray, T = pack<float, N> N rays at once, with the same bits in every lane. `counts`, where not null, is
/// added to.
template <accuracy A, bool AnyHit, scalar T>
PATCHRT_INLINE lane_hit<search_scalar_t<A, T>, T> intersect(mixed_hierarchy_view const& hierarchy,
                                                            ray<search_scalar_t<A, T>> const& r, mask_t<T> active,
                                                            hierarchy_counts* counts = nullptr) {
  detail::hierarchy_search<A, T> search(hierarchy, r, active);
  return search.template run<AnyHit>(counts);
}

}  // namespace patchrt
