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
  vec3<T> const p{m.point.x - lost_in_difference(centre.x, r.origin.x),
                  m.point.y - lost_in_difference(centre.y, r.origin.y),
                  m.point.z - lost_in_difference(centre.z, r.origin.z)};
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

/// The same, where a ray is used once.
template <scalar T, lanes_of<T> B> PATCHRT_INLINE sphere_hit<T> intersect(ray<T> const& r, sphere<B> const& ball) {
  return intersect(make_centred_ray(r.origin, r.direction), ball, r.t_min, r.t_max);
}

}  // namespace patchrt
