// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Where rays that leave a triangle start: `offset_origin` of what `depart_from` gives.

#include <patchrt/intersect/offset_origin.hpp>
#include <patchrt/shapes/triangle.hpp>

#include <limits>

namespace patchrt {

namespace detail {

/// A triangle's size, and what rounding may make of its plane.
template <scalar Q> struct triangle_reach {
  vec3<Q> normal;  ///< of length 1
  Q size;          ///< of the box, the sum of its edges
  Q thickness;     ///< (m.e) / |n|: e the box's edges, n the normal, m the magnitudes of its products
};

/// A normal of 0 is called z: whatever is as far as the triangle is large is clear of it to all sides.
template <scalar Q> PATCHRT_HD triangle_reach<Q> reach_of(triangle<Q> const& t) {
  Q const zero(lane_t<Q>(0)), one(lane_t<Q>(1));
  vec3<Q> const ab = difference(t.b, t.a), ac = difference(t.c, t.a), e = extent(bounds(t)), n = normal(t);
  Q const largest = largest_component(n);
  auto const flat = !(zero < largest);
  Q const unit = one / select(flat, one, largest);
  vec3<Q> const direction = select(flat, vec3<Q>{zero, zero, one}, scale(n, unit));
  Q const length = sqrt(dot(direction, direction));
  auto const [first, second] = shorter_edges(t);
  Q const products = max(dot(cross_of_magnitudes(ab, ac), e), dot(cross_of_magnitudes(first, second), e));
  Q const infinite(std::numeric_limits<lane_t<Q>>::infinity());
  return {scale(direction, one / length), sum_of_magnitudes(e), select(flat, infinite, products * unit / length)};
}

}  // namespace detail

/// How far from t a ray has to start so that no form that computes in T's precision meets t where it started.
///
/// min(16 eps (thickness + size), 2 size). A form is off by 8 u m.|ao| / |n| (see `engine_form::position_error`), of
/// which |ao| is within t's box; a ray closer to t's plane than rounding tells has its other crossing so far off that
/// it is outside by more than rounding. The watertight form moves vertices by 30 u times their distance at most;
/// `thickness` is for the normal, which rounding may turn by 4 u |m| / |n|. What starts 2 sizes away along any
/// direction and does not come back is clear of t whatever its normal is.
/// \pre The form meets t itself, not a rounding of it.
/// \note Of needles, thickness is up to their length over their width times their size: that is what the forms that
///       start from edges may be off by there.
template <scalar T, scalar P> PATCHRT_HD T clearance(triangle<P> const& t) {
  using L = lane_t<T>;
  auto const reach = detail::reach_of(t);
  T const size = convert<T>(reach.size);
  T const rounded = T(L(16) * std::numeric_limits<L>::epsilon()) * (convert<T>(reach.thickness) + size);
  return min(rounded, T(L(2)) * size);
}

/// The point (1 - u - v) a + u b + v c, for rays to leave from. What a hit's (u, v) are wrong by does not count: this
/// is a point of the triangle all the same.
///
/// `clear` is `clearance` of the triangle, or more.
/// \pre 0 <= u, v, u + v <= 1 but for a few roundings; no over- or underflow.
template <scalar P, scalar T> PATCHRT_HD surface_departure<T> depart_from(triangle<P> const& t, T u, T v, T clear) {
  using Q = detail::wider_t<P, T>;
  vec3<Q> const a = convert_vec<Q>(t.a), ab = difference(convert_vec<Q>(t.b), a),
                ac = difference(convert_vec<Q>(t.c), a);
  vec3<T> const here = fma(u, convert_vec<T>(ab), scale(convert_vec<T>(ac), v));
  vec3<Q> const n = detail::reach_of(triangle<Q>{a, convert_vec<Q>(t.b), convert_vec<Q>(t.c)}).normal;
  return {sum(convert_vec<T>(t.a), here), convert_vec<T>(n), clear};
}

/// The same, just clear of the triangle.
template <scalar P, scalar T> PATCHRT_HD surface_departure<T> depart_from(triangle<P> const& t, T u, T v) {
  return depart_from(t, u, v, clearance<T>(t));
}

}  // namespace patchrt
