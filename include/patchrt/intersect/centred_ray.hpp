// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/ray.hpp>

namespace patchrt {

/// A ray prepared for many spheres and quadrics; `inverse_square` is 1 / d.d, infinite where the direction is zero.
template <scalar T> struct centred_ray {
  vec3<T> origin;
  vec3<T> direction;
  T inverse_square;
};

/// The ray origin + t direction for `crossings` and `intersect`.
template <scalar T> PATCHRT_INLINE centred_ray<T> make_centred_ray(vec3<T> const& origin, vec3<T> const& direction) {
  return {origin, direction, T(1) / dot(direction, direction)};
}

/// A ray's point nearest to a centre, but for rounding.
template <scalar T> struct ray_middle {
  vec3<T> from_origin;  ///< the ray's origin less the centre
  vec3<T> point;        ///< that point less the centre
  T t;                  ///< where it is on the ray
};

/// The ray moved to where it passes `centre`.
///
/// `t` may be any number near the nearest point's: `point` is within an eps / 2 of itself, and of `from_origin`, of the
/// ray's point at `t` as it is. `from_origin` is exact where the centre is 0, where it is within a factor of 2 of the
/// origin, and where numbers are no finer than an ulp of the greater.
template <scalar T> PATCHRT_INLINE ray_middle<T> middle_of(centred_ray<T> const& r, vec3<T> const& centre) {
  vec3<T> const from = difference(r.origin, centre);
  T const t = dot(from, r.direction) * -r.inverse_square;
  return {from, fma(t, r.direction, from), t};
}

}  // namespace patchrt
