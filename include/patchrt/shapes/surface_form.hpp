// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/rational_power.hpp>

namespace patchrt {

/// What kernels over any kind of Bezier patch ask of its type: degrees, the same kind in other numbers, and its power
/// form.
template <class Surface> struct surface_form;

template <scalar P, int M, int N> struct surface_form<bezier_patch<P, M, N>> {
  static constexpr int degree_u = M, degree_v = N, points = (M + 1) * (N + 1);
  static constexpr bool is_rational = false;
  template <scalar T> using power = power_patch<T, M, N>;
};

template <scalar P, int M, int N> struct surface_form<rational_patch<P, M, N>> {
  static constexpr int degree_u = M, degree_v = N, points = (M + 1) * (N + 1);
  static constexpr bool is_rational = true;
  template <scalar T> using power = rational_power_patch<T, M, N>;
};

/// Control point k, without its weight.
template <scalar T, int M, int N> PATCHRT_INLINE vec3<T>& control_point(bezier_patch<T, M, N>& patch, int k) {
  return patch.control_points[k];
}
template <scalar T, int M, int N>
PATCHRT_INLINE vec3<T> const& control_point(bezier_patch<T, M, N> const& patch, int k) {
  return patch.control_points[k];
}
template <scalar T, int M, int N> PATCHRT_INLINE vec3<T>& control_point(rational_patch<T, M, N>& patch, int k) {
  return patch.control_points[k].point;
}
template <scalar T, int M, int N>
PATCHRT_INLINE vec3<T> const& control_point(rational_patch<T, M, N> const& patch, int k) {
  return patch.control_points[k].point;
}

/// The weight of control point k: 1 for polynomial patches.
template <scalar T, int M, int N> PATCHRT_INLINE T weight(bezier_patch<T, M, N> const&, int) { return T(lane_t<T>(1)); }
template <scalar T, int M, int N> PATCHRT_INLINE T weight(rational_patch<T, M, N> const& patch, int k) {
  return patch.control_points[k].weight;
}

}  // namespace patchrt
