// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/rational_split.hpp>

namespace patchrt {

namespace detail {

/// a + t (b - a) with t = i / n, from the nearer end.
template <scalar T> struct segment_fraction {
  T weight;
  bool from_a;
  PATCHRT_INLINE segment_fraction(int i, int n)
      : weight(T(lane_t<T>(2 * i <= n ? i : i - n)) / T(lane_t<T>(n))), from_a(2 * i <= n) {}
  PATCHRT_INLINE vec3<T> operator()(vec3<T> const& a, vec3<T> const& b) const {
    return fma(weight, difference(b, a), from_a ? a : b);
  }
};

/// The same of weighted points.
template <scalar T> struct weighted_fraction : weighted_segment<T> {
  using L = lane_t<T>;
  PATCHRT_INLINE weighted_fraction(int i, int n) : weighted_segment<T>(T(L(n - i)) / T(L(n)), T(L(i)) / T(L(n))) {}
};

/// The n + 1 control points of a curve of degree n, `stride` apart, become the n + 2 of degree n + 1: point i is
/// i/(n + 1) of the way from p_i to p_(i - 1).
/// \note Farin, Curves and Surfaces for CAGD, 5th ed., section 6.1.
template <class Fraction, class V> PATCHRT_HD void raise_curve(V* c, int stride, int n) {
  c[(n + 1) * stride] = c[n * stride];
  for (int i = n; i > 0; --i) c[i * stride] = Fraction(i, n + 1)(c[i * stride], c[(i - 1) * stride]);
}

/// Control points of degree (M, N) to those of degree (M2, N2), first along v, then along u.
template <int M, int N, int M2, int N2, class Fraction, class V> PATCHRT_HD void raise_net(V const* net, V* raised) {
  for (int i = 0; i <= M; ++i) {
    V* const row = raised + i * (N2 + 1);
    for (int j = 0; j <= N; ++j) row[j] = net[i * (N + 1) + j];
    for (int n = N; n < N2; ++n) raise_curve<Fraction>(row, 1, n);
  }
  for (int j = 0; j <= N2; ++j) {
    for (int n = M; n < M2; ++n) raise_curve<Fraction>(raised + j, N2 + 1, n);
  }
}

}  // namespace detail

/// The same surface by control points of degree (M2, N2): `elevate<3, 3>(patch)`.
///
/// With L = M2 - M + N2 - N, each coordinate is off by at most 3/2 L eps times the patch's largest |coordinate|.
/// Corners keep their bits, control points that are equal stay equal, patches that share an edge still do, and bounds
/// do not grow.
/// \pre No difference of coordinates overflows.
template <int M2, int N2, scalar T, int M, int N>
PATCHRT_HD bezier_patch<T, M2, N2> elevate(bezier_patch<T, M, N> const& patch) {
  static_assert(M <= M2 && N <= N2);
  bezier_patch<T, M2, N2> raised;
  detail::raise_net<M, N, M2, N2, detail::segment_fraction<T>>(patch.control_points, raised.control_points);
  return raised;
}

/// The same for rational patches: each coordinate is off by at most L (L + 3) eps times the largest |coordinate|, each
/// weight by 2 L eps of itself. Weights that are all equal stay so.
/// \pre No over- or underflow. All weights > 0.
template <int M2, int N2, scalar T, int M, int N>
PATCHRT_HD rational_patch<T, M2, N2> elevate(rational_patch<T, M, N> const& patch) {
  static_assert(M <= M2 && N <= N2);
  rational_patch<T, M2, N2> raised;
  detail::raise_net<M, N, M2, N2, detail::weighted_fraction<T>>(patch.control_points, raised.control_points);
  return raised;
}

}  // namespace patchrt
