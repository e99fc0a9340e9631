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

/// The point a + t (b - a) of a segment, from the nearer end: exact at t = 0, at t = 1 and where a = b, and between a
/// and b (as rounded) for 0 <= t <= 1.
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
template <int N, class V, class Point>
PATCHRT_INLINE void cut_curve(V* second, V* first, int stride, Point const& point) {
  first[0] = second[0];
  for (int n = 1; n <= N; ++n) {
    for (int k = 0; k <= N - n; ++k) second[k * stride] = point(second[k * stride], second[(k + 1) * stride]);
    first[n * stride] = second[0];
  }
}

/// Control points of degree (M, N) cut along u or v: those of the second part take their place.
template <int M, int N, class V, class Point> PATCHRT_INLINE void cut_net_u(V* second, V* first, Point const& point) {
  for (int j = 0; j <= N; ++j) cut_curve<M>(second + j, first + j, N + 1, point);
}
template <int M, int N, class V, class Point> PATCHRT_INLINE void cut_net_v(V* second, V* first, Point const& point) {
  for (int i = 0; i <= M; ++i) cut_curve<N>(second + i * (N + 1), first + i * (N + 1), 1, point);
}

template <scalar T, int M, int N, class Point>
PATCHRT_INLINE patch_halves<T, M, N> cut_u(bezier_patch<T, M, N> const& patch, Point const& point) {
  patch_halves<T, M, N> h{patch, patch};
  cut_net_u<M, N>(h.second.control_points, h.first.control_points, point);
  return h;
}

template <scalar T, int M, int N, class Point>
PATCHRT_INLINE patch_halves<T, M, N> cut_v(bezier_patch<T, M, N> const& patch, Point const& point) {
  patch_halves<T, M, N> h{patch, patch};
  cut_net_v<M, N>(h.second.control_points, h.first.control_points, point);
  return h;
}

/// Points of the curve's part from t = a to t = b, by its blossom: point k is the blossom at N - k times a and k times
/// b.
template <int N, class V, class Point>
PATCHRT_INLINE void restrict_curve(V* p, int stride, Point const& at_a, Point const& at_b) {
  V at[N + 1];  // the blossom at n times a
  for (int k = 0; k <= N; ++k) at[k] = p[k * stride];
  for (int n = 0; n <= N; ++n) {
    V rest[N + 1];
    for (int k = 0; k <= N - n; ++k) rest[k] = at[k];
    for (int m = N - n; m > 0; --m) {
      for (int k = 0; k < m; ++k) rest[k] = at_b(rest[k], rest[k + 1]);
    }
    p[(N - n) * stride] = rest[0];
    for (int k = 0; k < N - n; ++k) at[k] = at_a(at[k], at[k + 1]);
  }
}

/// Control points of degree (M, N) to those of a part, first along u, then along v.
template <int M, int N, class Point, class V, scalar T> PATCHRT_HD void restrict_net(V* net, T u0, T u1, T v0, T v1) {
  Point const at_u0(u0), at_u1(u1), at_v0(v0), at_v1(v1);
  for (int j = 0; j <= N; ++j) restrict_curve<M>(net + j, N + 1, at_u0, at_u1);
  for (int i = 0; i <= M; ++i) restrict_curve<N>(net + i * (N + 1), 1, at_v0, at_v1);
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
/// Each coordinate is off by at most M eps times the patch's largest |coordinate| for 0 <= u <= 1; at u = 0 and u = 1
/// one part is the patch itself, bit for bit. What `split_u` at 1/2 says of equal points, edges and bounds holds.
template <scalar T, int M, int N>
PATCHRT_INLINE patch_halves<T, M, N> split_u(bezier_patch<T, M, N> const& patch, T u) {
  return detail::cut_u(patch, detail::segment_point<T>(u));
}

/// The parts of a patch below and above the parameter v, as `split_u`.
template <scalar T, int M, int N>
PATCHRT_INLINE patch_halves<T, M, N> split_v(bezier_patch<T, M, N> const& patch, T v) {
  return detail::cut_v(patch, detail::segment_point<T>(v));
}

/// The part u0 <= u <= u1, v0 <= v <= v1 of a patch as a patch over 0 <= u, v <= 1; turned round where u1 < u0 or v1 <
/// v0.
///
/// Each coordinate is off by at most (M + N) eps times the patch's largest |coordinate| for parameters within [0, 1].
/// The corners depend on their own parameters alone, and an edge on its own line and its ends: neighbours with the same
/// ends share it bit for bit.
/// \note By the blossom: Ramshaw, "Blossoms are polar forms", CAGD 6(4), 1989; Farin, 5th ed., section 4.4.
template <scalar T, int M, int N>
PATCHRT_HD bezier_patch<T, M, N> sub_patch(bezier_patch<T, M, N> const& patch, T u0, T u1, T v0, T v1) {
  bezier_patch<T, M, N> part = patch;
  detail::restrict_net<M, N, detail::segment_point<T>>(part.control_points, u0, u1, v0, v1);
  return part;
}

}  // namespace patchrt
