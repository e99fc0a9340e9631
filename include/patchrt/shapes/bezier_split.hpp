// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_patch.hpp>

namespace patchrt {

/// The two parts of a patch cut along a parameter line, each over 0 <= u, v <= 1: the lower parameters in `first`.
template <scalar T, int M, int N> struct patch_halves {
  bezier_patch<T, M, N> first;
  bezier_patch<T, M, N> second;
};

namespace detail {

/// The point a + t (b - a) of a segment, from the nearer end: exact at t = 0, at t = 1 and where a = b, and between a and b
/// (as rounded) for 0 <= t <= 1.
template <scalar T> struct segment_point {
  mask_t<T> from_a;
  T weight;
  PATCHRT_INLINE explicit segment_point(T t)
      : from_a(t <= T(lane_t<T>(0.5))), weight(select(from_a, t, t - T(lane_t<T>(1)))) {}
  PATCHRT_INLINE vec3<T> operator()(vec3<T> const& a, vec3<T> const& b) const {
    return fma(weight, b - a, select(from_a, a, b));
  }
};

/// The middle of a segment, correctly rounded unless a + b overflows or half of it underflows.
template <scalar T> struct segment_middle {
  PATCHRT_INLINE vec3<T> operator()(vec3<T> const& a, vec3<T> const& b) const { return T(lane_t<T>(0.5)) * (a + b); }
};

/// De Casteljau's triangle over N + 1 points `stride` apart, in place: they become those of the second part.
template <int N, scalar T, class Point>
PATCHRT_INLINE void cut_curve(vec3<T>* second, vec3<T>* first, int stride, Point const& point) {
  first[0] = second[0];
  for (int n = 1; n <= N; ++n) {
    for (int k = 0; k <= N - n; ++k) second[k * stride] = point(second[k * stride], second[(k + 1) * stride]);
    first[n * stride] = second[0];
  }
}

template <scalar T, int M, int N, class Point>
PATCHRT_INLINE patch_halves<T, M, N> cut_u(bezier_patch<T, M, N> const& patch, Point const& point) {
  patch_halves<T, M, N> h{patch, patch};
  for (int j = 0; j <= N; ++j) cut_curve<M>(h.second.control_points + j, h.first.control_points + j, N + 1, point);
  return h;
}

template <scalar T, int M, int N, class Point>
PATCHRT_INLINE patch_halves<T, M, N> cut_v(bezier_patch<T, M, N> const& patch, Point const& point) {
  patch_halves<T, M, N> h{patch, patch};
  for (int i = 0; i <= M; ++i) {
    int const row = i * (N + 1);
    cut_curve<N>(h.second.control_points + row, h.first.control_points + row, 1, point);
  }
  return h;
}

/// Points of the curve's part from t = a to t = b, by its blossom: point k is the blossom at N - k times a and k times b.
template <int N, scalar T>
PATCHRT_INLINE void restrict_curve(vec3<T>* p, int stride, segment_point<T> const& at_a, segment_point<T> const& at_b) {
  vec3<T> at[N + 1];  // the blossom at n times a
  for (int k = 0; k <= N; ++k) at[k] = p[k * stride];
  for (int n = 0; n <= N; ++n) {
    vec3<T> rest[N + 1];
    for (int k = 0; k <= N - n; ++k) rest[k] = at[k];
    for (int m = N - n; m > 0; --m) {
      for (int k = 0; k < m; ++k) rest[k] = at_b(rest[k], rest[k + 1]);
    }
    p[(N - n) * stride] = rest[0];
    for (int k = 0; k < N - n; ++k) at[k] = at_a(at[k], at[k + 1]);
  }
}

}  // namespace detail

/// The parts u <= 1/2 and u >= 1/2 of a patch by de Casteljau's algorithm.
///
/// Each coordinate is off by at most M eps/2 times the patch's largest |coordinate|; control points that are equal stay
/// equal, both parts share their common edge bit for bit, and their bounds lie within those of the patch.
/// \pre No sum of two coordinates overflows.
template <scalar T, int M, int N> PATCHRT_INLINE patch_halves<T, M, N> split_u(bezier_patch<T, M, N> const& patch) {
  return detail::cut_u(patch, detail::segment_middle<T>{});
}

/// The parts v <= 1/2 and v >= 1/2, as `split_u`, with N in the place of M.
template <scalar T, int M, int N> PATCHRT_INLINE patch_halves<T, M, N> split_v(bezier_patch<T, M, N> const& patch) {
  return detail::cut_v(patch, detail::segment_middle<T>{});
}

/// The parts of a patch below and above the parameter u.
///
/// Each coordinate is off by at most M eps times the patch's largest |coordinate| for 0 <= u <= 1; at u = 0 and u = 1 one
/// part is the patch itself, bit for bit. What `split_u` at 1/2 says of equal points, edges and bounds holds.
template <scalar T, int M, int N>
PATCHRT_INLINE patch_halves<T, M, N> split_u(bezier_patch<T, M, N> const& patch, T u) {
  return detail::cut_u(patch, detail::segment_point<T>(u));
}

/// The parts of a patch below and above the parameter v, as `split_u`.
template <scalar T, int M, int N>
PATCHRT_INLINE patch_halves<T, M, N> split_v(bezier_patch<T, M, N> const& patch, T v) {
  return detail::cut_v(patch, detail::segment_point<T>(v));
}

/// The part u0 <= u <= u1, v0 <= v <= v1 of a patch as a patch over 0 <= u, v <= 1; turned round where u1 < u0 or v1 < v0.
///
/// Each coordinate is off by at most (M + N) eps times the patch's largest |coordinate| for parameters within [0, 1]. The
/// corners depend on their own parameters alone, and an edge on its own line and its ends: neighbours with the same ends
/// share it bit for bit.
/// \note By the blossom: Ramshaw, "Blossoms are polar forms", CAGD 6(4), 1989; Farin, 5th ed., section 4.4.
template <scalar T, int M, int N>
PATCHRT_HD bezier_patch<T, M, N> sub_patch(bezier_patch<T, M, N> const& patch, T u0, T u1, T v0, T v1) {
  bezier_patch<T, M, N> part = patch;
  detail::segment_point<T> const at_u0(u0), at_u1(u1), at_v0(v0), at_v1(v1);
  for (int j = 0; j <= N; ++j) detail::restrict_curve<M>(part.control_points + j, N + 1, at_u0, at_u1);
  for (int i = 0; i <= M; ++i) detail::restrict_curve<N>(part.control_points + i * (N + 1), 1, at_v0, at_v1);
  return part;
}

}  // namespace patchrt
