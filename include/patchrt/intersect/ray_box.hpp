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

/// Whether a span is the nearest that rounding allows, or is wide enough to cover all of its errors.
enum class slab { nearest, conservative };

namespace detail {

/// The greatest `entry` so far and the least `exit`, of one axis and those before it.
///
/// Where the direction is zero, the planes of a box around the origin are at -inf and +inf, and a plane that the origin
/// lies in is at 0 * inf = NaN, which max and min drop: a ray that runs in a face of the box meets it.
template <scalar T> PATCHRT_INLINE void clip(slab_span<T>& span, T origin, T inverse, T exit_inverse, T near, T far) {
  span.entry = max((near - origin) * inverse, span.entry);
  span.exit = min((far - origin) * exit_inverse, span.exit);
}

/// The same for the planes lo and hi, in any order.
template <scalar T, class B>
PATCHRT_INLINE void clip_pair(slab_span<T>& span, T origin, T inverse, T exit_inverse, B lo, B hi) {
  auto const backward = inverse < T(0);
  clip(span, origin, inverse, exit_inverse, select(backward, T(hi), T(lo)), select(backward, T(lo), T(hi)));
}

/// 1 and 2 gamma(3) = 3 epsilon + ..., and the rounding of a product with it.
template <class L> PATCHRT_INLINE constexpr L exit_widening() { return 1 + 4 * std::numeric_limits<L>::epsilon(); }

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
  detail::clip_pair(s, r.origin.x, r.inverse.x, r.inverse.x, b.lo.x, b.hi.x);
  detail::clip_pair(s, r.origin.y, r.inverse.y, r.inverse.y, b.lo.y, b.hi.y);
  detail::clip_pair(s, r.origin.z, r.inverse.z, r.inverse.z, b.lo.z, b.hi.z);
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

/// A ray prepared so as to miss no box that it meets at a t of 0 or more: `exit_inverse` is `inverse`, longer by what the
/// three roundings of both ends of a span may come to.
/// \note Ize, "Robust BVH ray traversal", JCGT 2(2), 2013, section 3.
template <scalar T> struct watertight_slab_ray {
  vec3<T> origin;
  vec3<T> inverse;
  vec3<T> exit_inverse;
};

template <scalar T>
PATCHRT_INLINE watertight_slab_ray<T> make_watertight_slab_ray(vec3<T> const& origin, vec3<T> const& direction) {
  // Number by number: vectors that g++ stores in pieces and loads whole make a single ray wait.
  T const one(1), widening(detail::exit_widening<lane_t<T>>());
  T const x = one / direction.x, y = one / direction.y, z = one / direction.z;
  return {{origin.x, origin.y, origin.z}, {x, y, z}, {x * widening, y * widening, z * widening}};
}

/// The part of [t_min, t_max] that r spends in b, up to the widened exit. A span's entry is within gamma(3) of the truth.
/// \pre    As for `slab_ray`. Where t < 0 nothing is widened enough: then boxes must be larger than what they hold.
/// \return entry <= exit for a hit.
template <scalar T, lanes_of<T> B>
PATCHRT_INLINE slab_span<T> intersect(watertight_slab_ray<T> const& r, box<B> const& b, T t_min, T t_max) {
  slab_span<T> s{t_min, t_max};
  detail::clip_pair(s, r.origin.x, r.inverse.x, r.exit_inverse.x, b.lo.x, b.hi.x);
  detail::clip_pair(s, r.origin.y, r.inverse.y, r.exit_inverse.y, b.lo.y, b.hi.y);
  detail::clip_pair(s, r.origin.z, r.inverse.z, r.exit_inverse.z, b.lo.z, b.hi.z);
  return s;
}

/// The same for rays of one octant, to whom `near` and `far` are the corners of the box that they pass first and last:
/// the same bits by fewer operations.
template <scalar T, lanes_of<T> B>
PATCHRT_INLINE slab_span<T> intersect(watertight_slab_ray<T> const& r, vec3<B> const& near, vec3<B> const& far, T t_min,
                                      T t_max) {
  slab_span<T> s{t_min, t_max};
  detail::clip(s, r.origin.x, r.inverse.x, r.exit_inverse.x, T(near.x), T(far.x));
  detail::clip(s, r.origin.y, r.inverse.y, r.exit_inverse.y, T(near.y), T(far.y));
  detail::clip(s, r.origin.z, r.inverse.z, r.exit_inverse.z, T(near.z), T(far.z));
  return s;
}

}  // namespace patchrt
