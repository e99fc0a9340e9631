// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/error_free.hpp>
#include <patchrt/intersect/centred_ray.hpp>
#include <patchrt/shapes/sphere.hpp>

#include <limits>

namespace patchrt {

/// Where a ray's line enters and leaves a sphere.
template <scalar T> struct sphere_crossings {
  T t0;
  T t1;
  mask_t<T> real;
};

/// The nearest crossing in a range of t; t is unspecified where not `valid`.
template <scalar T> struct sphere_hit {
  T t;
  mask_t<T> valid;
};

/// Both crossings of a line with a sphere, one sphere for all lanes or one for each, by 43 operations and a square
/// root.
///
/// At p = o - c + s d with s = -(o - c).d / d.d, and w = -p.d / d.d for what s is wrong by,
///     t = s + (w -+ sqrt(w^2 + (r^2 - p.p) / d.d)):
/// p, with what o - c loses to rounding added again, is within roundings of its own size from the line's point at s
/// whatever s is, so nothing that is squared is larger than the sphere, and only its own size is lost in what cancels.
/// For a ray that meets the sphere at an angle of a to its normal, each t is within half an ulp, its own rounding, and
/// 12 eps r / (|d| cos a).
/// \pre    d.d, and r^2 / d.d, neither over- nor underflow.
/// \return `real` is false where the line misses, and where a number is NaN or d is 0. A tangent is real.
/// \note   Haines, Guenther & Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems,
///         2019, chapter 7; w and what o - c loses are what make it serve origins a million radii away.
template <scalar T, lanes_of<T> B>
PATCHRT_INLINE sphere_crossings<T> crossings(centred_ray<T> const& r, sphere<B> const& ball) {
  T const radius(ball.radius);
  vec3<T> const centre = convert_vec<T>(ball.centre);
  ray_middle<T> const m = middle_of(r, centre);
  vec3<T> const p{m.point.x + two_sum(r.origin.x, -centre.x).error, m.point.y + two_sum(r.origin.y, -centre.y).error,
                  m.point.z + two_sum(r.origin.z, -centre.z).error};
  T const w = -dot(p, r.direction) * r.inverse_square;
  T const inside = fma(-p.x, p.x, fma(-p.y, p.y, fma(-p.z, p.z, radius * radius)));
  T const square = fma(w, w, inside * r.inverse_square);
  T const zero(0), root = sqrt(max(square, zero));
  return {m.t + (w - root), m.t + (w + root), zero <= square};
}

/// The nearest crossing of a ray with a sphere in t_min < t < t_max.
template <scalar T, lanes_of<T> B>
PATCHRT_INLINE sphere_hit<T> intersect(centred_ray<T> const& r, sphere<B> const& ball, T t_min, T t_max) {
  auto const [t0, t1, real] = crossings(r, ball);
  auto const first = t_min < t0 && t0 < t_max;
  return {select(first, t0, t1), real && (first || (t_min < t1 && t1 < t_max))};
}

/// A crossing's t after a step of Newton's method on f(t) = |o - c + t d|^2 - r^2, whose value is computed with twice the
/// digits: within half an ulp and, of a t that was off by e, e^2 |d| / (r cos a), at an angle of a to the normal. A step
/// that is longer than half the chord is not taken.
/// \note  Dekker, "A floating-point technique for extending the available precision", Numerische Mathematik 18, 1971.
template <scalar T, lanes_of<T> B>
PATCHRT_INLINE T correct_crossing(centred_ray<T> const& r, sphere<B> const& ball, T t) {
  vec3<T> const centre = convert_vec<T>(ball.centre);
  T const radius(ball.radius);
  error_free<T> const square = two_prod(radius, radius);
  T f = -square.value, lost = -square.error, slope(0);
  PATCHRT_UNROLL
  for (int k = 0; k < 3; ++k) {
    T const d = component(r.direction, k);
    error_free<T> const from = two_sum(component(r.origin, k), -component(centre, k)), way = two_prod(t, d);
    error_free<T> const sum = two_sum(from.value, way.value);
    error_free<T> const x = fast_two_sum(sum.value, sum.error + (from.error + way.error));
    error_free<T> const xx = two_prod(x.value, x.value), partial = two_sum(f, xx.value);
    f = partial.value;
    lost = lost + (partial.error + fma(x.value + x.value, x.error, xx.error));
    slope = fma(x.value, d, slope);
  }
  T const step = (f + lost) / (slope + slope);
  return select(abs(step) <= abs(slope) * r.inverse_square, t - step, t);
}

/// The same, where a ray is used once.
template <scalar T, lanes_of<T> B> PATCHRT_INLINE sphere_hit<T> intersect(ray<T> const& r, sphere<B> const& ball) {
  return intersect(make_centred_ray(r.origin, r.direction), ball, r.t_min, r.t_max);
}

}  // namespace patchrt
