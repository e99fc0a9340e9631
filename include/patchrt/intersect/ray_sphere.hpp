// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/intersect/centred_ray.hpp>
#include <patchrt/intersect/ray_box.hpp>
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

/// Both crossings of a line with a sphere, one sphere for all lanes or one for each, by 25 operations and a square
/// root.
///
/// At p = o - c + s d with s = -(o - c).d / d.d, and w = -p.d / d.d for what s is wrong by,
///     t = s + (w -+ sqrt(w^2 + (r^2 - p.p) / d.d)):
/// p is one rounding from the line's point at s whatever s is, so nothing that is squared is larger than the sphere,
/// and only its own size is lost in what cancels. For a ray that meets the sphere at an angle of a to its normal, each
/// t is within (1 + tan a) ulp where the origin is far away, and within 12 eps r / (|d| cos a) near.
/// \pre    d.d, and r^2 / d.d, neither over- nor underflow.
/// \return `real` is false where the line misses, and where a number is NaN or d is 0. A tangent is real.
/// \note   Haines, Guenther & Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems,
///         2019, chapter 7; w is what makes it serve origins a million radii away.
template <scalar T, lanes_of<T> B>
PATCHRT_INLINE sphere_crossings<T> crossings(centred_ray<T> const& r, sphere<B> const& ball) {
  T const radius(ball.radius);
  ray_middle<T> const m = middle_of(r, convert_vec<T>(ball.centre));
  T const w = -dot(m.point, r.direction) * r.inverse_square;
  T const inside = fma(-m.point.x, m.point.x, fma(-m.point.y, m.point.y, fma(-m.point.z, m.point.z, radius * radius)));
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

/// The same, where a ray is used once.
template <scalar T, lanes_of<T> B> PATCHRT_INLINE sphere_hit<T> intersect(ray<T> const& r, sphere<B> const& ball) {
  return intersect(make_centred_ray(r.origin, r.direction), ball, r.t_min, r.t_max);
}

}  // namespace patchrt
