// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/box.hpp>

namespace patchrt {

/// A ray prepared for many boxes; `inverse` is 1 / direction, infinite where the direction is zero.
template <scalar T> struct slab_ray {
  vec3<T> origin;
  vec3<T> inverse;
};

/// The ray origin + t direction for `intersect` with boxes.
template <scalar T> PATCHRT_INLINE slab_ray<T> make_slab_ray(vec3<T> const& origin, vec3<T> const& direction) {
  T const one(1);
  return {origin, {one / direction.x, one / direction.y, one / direction.z}};
}

/// The t at which a ray enters and leaves a box: a hit where entry <= exit.
template <scalar T> struct slab_span {
  T entry;
  T exit;
};

/// A number for all lanes of T, or one for each.
template <class B, class T>
concept lanes_of = std::same_as<B, T> || std::same_as<B, lane_t<T>>;

/// Whether a span is the nearest that rounding allows, or is wide enough to cover all of its errors.
enum class slab { nearest, conservative };

namespace detail {

/// The greatest `entry` so far and the least `exit`, of one axis and those before it.
///
/// Where the direction is zero, the planes of a box around the origin are at -inf and +inf, and a plane that the origin
/// lies in is at 0 * inf = NaN, which max and min drop: a ray that runs in a face of the box meets it.
template <scalar T, class B> PATCHRT_INLINE void clip(slab_span<T>& span, T origin, T inverse, B lo, B hi) {
  auto const backward = inverse < T(0);
  T const near = (select(backward, T(hi), T(lo)) - origin) * inverse;
  T const far = (select(backward, T(lo), T(hi)) - origin) * inverse;
  span.entry = max(near, span.entry);
  span.exit = min(far, span.exit);
}

}  // namespace detail

/// The part of [t_min, t_max] that r spends in b, one box for all lanes or one for each.
///
/// t = (plane - origin) inverse, by three roundings: at most gamma(3) relative error, far from the origin too (a fused
/// plane inverse - origin inverse would leak there). `slab::conservative` moves both ends, t_min and t_max among them,
/// outward by more than twice that, so that no ray which truly meets the box is missed and entry and exit are bounds.
/// With either, a box inside another has no smaller entry and no greater exit, in computed arithmetic: every operation
/// is monotone in the box's coordinates.
/// \pre    The direction is not zero. Each component of it is zero, or normal and such that no t to a plane of b over- or
///         underflows.
/// \return entry <= exit for a hit; anything else, NaN included, for a miss. Empty boxes are missed.
/// \note   Williams, Barrus, Morley & Shirley, "An efficient and robust ray-box intersection algorithm", JGT 10(1), 2005;
///         Ize, "Robust BVH ray traversal", JCGT 2(2), 2013.
template <slab S = slab::nearest, scalar T, lanes_of<T> B>
PATCHRT_INLINE slab_span<T> intersect(slab_ray<T> const& r, box<B> const& b, T t_min, T t_max) {
  slab_span<T> s{t_min, t_max};
  detail::clip(s, r.origin.x, r.inverse.x, b.lo.x, b.hi.x);
  detail::clip(s, r.origin.y, r.inverse.y, b.lo.y, b.hi.y);
  detail::clip(s, r.origin.z, r.inverse.z, b.lo.z, b.hi.z);
  if constexpr (S == slab::conservative) {
    // 2 gamma(3) = 3 epsilon + ..., rounded up. At the wrong infinity, in a miss, this is NaN.
    T const widening(4 * std::numeric_limits<lane_t<T>>::epsilon());
    s.entry = fma(-widening, abs(s.entry), s.entry);
    s.exit = fma(widening, abs(s.exit), s.exit);
  }
  return s;
}

/// The same for the whole line: t from -infinity to infinity.
template <slab S = slab::nearest, scalar T, lanes_of<T> B>
PATCHRT_INLINE slab_span<T> intersect(slab_ray<T> const& r, box<B> const& b) {
  constexpr lane_t<T> inf = std::numeric_limits<lane_t<T>>::infinity();
  return intersect<S>(r, b, T(-inf), T(inf));
}

}  // namespace patchrt
