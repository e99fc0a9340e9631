// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/ray.hpp>

namespace patchrt {

/// A ray's line as the meeting of two planes: x is on it where n1.x + d1 = 0 and n2.x + d2 = 0.
/// \note Kajiya, "Ray tracing parametric patches", SIGGRAPH 1982; Nigam & Narayanan 2012, section 3.1, eq. 2.
template <scalar T> struct twin_planes {
  vec3<T> n1;
  vec3<T> n2;
  T d1;
  T d2;
};

/// Two unit-scaled normals across `direction`: n1 = e x direction with e the axis of the least |component|, n2 =
/// direction x n1.
///
/// n1, n2 and the direction are orthogonal up to rounding, |n1| >= sqrt(2/3) |direction|, |n2| = |n1| |direction|.
/// \note The paper (section 4.1) takes the second plane through the surface normal, which fails where that normal, the
///       direction and n1 are in one plane; direction x n1 never does. A zero direction gives zero normals, and so no hit.
template <scalar T> PATCHRT_INLINE void plane_normals(vec3<T> const& direction, vec3<T>& n1, vec3<T>& n2) {
  T const ax = abs(direction.x), ay = abs(direction.y), az = abs(direction.z);
  auto const x_least = ax <= ay && ax <= az;
  auto const y_least = !x_least && ay <= az;
  T const zero(0);
  vec3<T> const across_x{zero, -direction.z, direction.y};
  vec3<T> const across_y{direction.z, zero, -direction.x};
  vec3<T> const across_z{-direction.y, direction.x, zero};
  n1 = select(x_least, across_x, select(y_least, across_y, across_z));
  n2 = cross(direction, n1);
}

/// The planes of any ray: those that secondary rays use.
template <scalar T> PATCHRT_HD twin_planes<T> make_twin_planes(vec3<T> const& origin, vec3<T> const& direction) {
  twin_planes<T> p;
  plane_normals(direction, p.n1, p.n2);
  p.d1 = T(0) - dot(p.n1, origin);
  p.d2 = T(0) - dot(p.n2, origin);
  return p;
}

/// The planes of the primary ray through image position (x, y) of a pinhole at `eye` whose rays are `forward` + x
/// `right` + y `up`.
///
/// n1 is the plane of the pixel column, the same for every y; n2 that of the row, the same for every x: M + N planes
/// serve M N rays.
/// \note Nigam & Narayanan 2012, section 4.1, "planes for primary rays".
template <scalar T>
PATCHRT_HD twin_planes<T> make_primary_planes(vec3<T> const& eye, vec3<T> const& forward, vec3<T> const& right,
                                              vec3<T> const& up, T x, T y) {
  twin_planes<T> p;
  p.n1 = cross(up, fma(x, right, forward));
  p.n2 = cross(right, fma(y, up, forward));
  p.d1 = T(0) - dot(p.n1, eye);
  p.d2 = T(0) - dot(p.n2, eye);
  return p;
}

}  // namespace patchrt
