// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/rational_patch.hpp>

#include <array>
#include <concepts>
#include <cstddef>

/// \file
/// Sphere, torus, cone and cylinder as rational patches, without any approximation but rounding: surfaces with
/// answers in closed form. The axis is z, Qu x Qv points outward; other places and affine images by mapping the control
/// points.

namespace patchrt {

namespace detail {

/// A control point of the curve that revolves: its distance from the axis, its height, and whether it is the middle one
/// of a quarter of a circle.
template <std::floating_point T> struct profile_point {
  T radial;
  T axial;
  bool middle;
};

/// Quarter k = 0..3 of a profile's turn about the axis through `centre`, from angle k pi/2.
/// \note Piegl & Tiller, The NURBS Book, 2nd ed., sections 7.3 and 8.5: a quarter of a circle has weights 1, sqrt(1/2),
///       1.
template <int N, std::floating_point T>
rational_patch<T, 2, N> quarter_turn(vec3<T> const& centre, int k, std::array<profile_point<T>, N + 1> const& profile) {
  rational_patch<T, 2, N> q;
  T const cosine[] = {1, 0, -1, 0, 1};
  for (int i = 0; i <= 2; ++i) {
    T const x = i == 0 ? cosine[k] : i == 2 ? cosine[k + 1] : cosine[k] + cosine[k + 1];
    T const y = i == 0 ? -cosine[k + 1] : i == 2 ? cosine[k] : cosine[k] - cosine[k + 1];
    for (int j = 0; j <= N; ++j) {
      profile_point<T> const& p = profile[std::size_t(j)];
      bool const either = i == 1 || p.middle, both = i == 1 && p.middle;
      q(i, j) = {{fma(x, p.radial, centre.x), fma(y, p.radial, centre.y), centre.z + p.axial},
                 both     ? T(0.5)
                 : either ? T(0.70710678118654752440)
                          : T(1)};
    }
  }
  return q;
}

/// Quarter k of a circle in the plane of radius and height, counter-clockwise from (distance + radius, 0).
template <std::floating_point T> std::array<profile_point<T>, 3> quarter_circle(T distance, T radius, int k) {
  T const cosine[] = {1, 0, -1, 0, 1};
  T const c = cosine[k], d = cosine[k + 1];
  return {{{fma(c, radius, distance), -d * radius, false},
           {fma(c + d, radius, distance), (c - d) * radius, true},
           {fma(d, radius, distance), c * radius, false}}};
}

}  // namespace detail

/// A sphere as 8 octants of degree (2, 2), collapsed to a point at the poles: for each quarter turn the southern, then
/// the northern one, v towards the north.
///
/// Points are within 2 eps (|centre| + radius) of the sphere.
/// \pre radius > 0.
template <std::floating_point T>
std::array<rational_patch<T, 2, 2>, 8> sphere_patches(vec3<T> const& centre, T radius) {
  PATCHRT_EXPECTS(T(0) < radius);
  std::array<rational_patch<T, 2, 2>, 8> patches;
  for (int k = 0; k < 8; ++k)
    patches[std::size_t(k)] =
        detail::quarter_turn<2>(centre, k / 2, detail::quarter_circle(T(0), radius, k % 2 == 0 ? 3 : 0));
  return patches;
}

/// A torus as 16 patches of degree (2, 2): four quarters of the tube for each quarter turn.
///
/// Points are within 3 eps (|centre| + major + minor) of the torus.
/// \param major the distance of the tube's middle from the axis, \param minor the tube's radius.
/// \pre 0 < minor < major.
template <std::floating_point T>
std::array<rational_patch<T, 2, 2>, 16> torus_patches(vec3<T> const& centre, T major, T minor) {
  PATCHRT_EXPECTS(T(0) < minor && minor < major);
  std::array<rational_patch<T, 2, 2>, 16> patches;
  for (int k = 0; k < 16; ++k)
    patches[std::size_t(k)] = detail::quarter_turn<2>(centre, k / 4, detail::quarter_circle(major, minor, k % 4));
  return patches;
}

/// A cylinder without lids as 4 patches of degree (2, 1) that rise from `base` by `height`.
///
/// Points are within 2 eps (|base| + radius) of the infinite cylinder.
/// \pre radius > 0, height > 0.
template <std::floating_point T>
std::array<rational_patch<T, 2, 1>, 4> cylinder_patches(vec3<T> const& base, T radius, T height) {
  PATCHRT_EXPECTS(T(0) < radius && T(0) < height);
  std::array<rational_patch<T, 2, 1>, 4> patches;
  for (int k = 0; k < 4; ++k)
    patches[std::size_t(k)] = detail::quarter_turn<1, T>(base, k, {{{radius, T(0), false}, {radius, height, false}}});
  return patches;
}

/// A cone without lid as 4 patches of degree (2, 1) that rise from `base` by `height` to the apex, at which they are
/// collapsed.
///
/// Points are within 2 eps (|base| + radius + height) (1 + radius / height) of the infinite cone.
/// \pre radius > 0, height > 0.
template <std::floating_point T>
std::array<rational_patch<T, 2, 1>, 4> cone_patches(vec3<T> const& base, T radius, T height) {
  PATCHRT_EXPECTS(T(0) < radius && T(0) < height);
  std::array<rational_patch<T, 2, 1>, 4> patches;
  for (int k = 0; k < 4; ++k)
    patches[std::size_t(k)] = detail::quarter_turn<1, T>(base, k, {{{radius, T(0), false}, {T(0), height, false}}});
  return patches;
}

}  // namespace patchrt
