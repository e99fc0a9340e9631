// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/shapes/rational_patch.hpp>

namespace patchrt {

/// The two parts of a rational patch cut along a parameter line, each over 0 <= u, v <= 1: the lower parameters in
/// `first`.
template <scalar T, int M, int N> struct rational_halves {
  rational_patch<T, M, N> first;
  rational_patch<T, M, N> second;
};

namespace detail {

/// The homogeneous point (1 - t) (w a, w) + t (w b, w) of a segment as a point and a weight.
///
/// Exact at t = 0, at t = 1 and where both points or both weights are equal; between a and b (as rounded) otherwise:
/// the point is a + x (b - a) with x the share of b in the weight, from the end that has more of it.
/// \note Farin, Curves and Surfaces for CAGD, 5th ed., chapter 13 (the rational de Casteljau algorithm).
template <scalar T> struct weighted_segment {
  T of_a;
  T of_b;
  mask_t<T> near_a;

  /// At parameter t.
  PATCHRT_INLINE explicit weighted_segment(T t) : weighted_segment(T(lane_t<T>(1)) - t, t) {}
  /// With shares of a and of b that sum up to 1.
  PATCHRT_INLINE weighted_segment(T a, T b) : of_a(a), of_b(b), near_a(b <= a) {}

  PATCHRT_INLINE weighted_point<T> operator()(weighted_point<T> const& a, weighted_point<T> const& b) const {
    T const x = of_a * a.weight, y = of_b * b.weight;
    auto const more_of_a = y <= x;
    T const share = select(more_of_a, y, -x) / (x + y);
    return {fma(share, difference(b.point, a.point), select(more_of_a, a.point, b.point)),
            fma(select(near_a, of_b, -of_a), b.weight - a.weight, select(near_a, a.weight, b.weight))};
  }
};

}  // namespace detail

/// The parts of a rational patch below and above the parameter u.
///
/// With m the largest |coordinate| of the control points, each coordinate is off by at most M (M + 2) eps m, and each
/// weight by 2 M eps of itself, for 0 <= u <= 1: a step rounds the ratio of two weights three times, their sum and
/// quotient once each, and the point twice, 11/2 eps/2 m together, and weights carry three roundings to the next. At
/// u = 0 and u = 1 one part is the patch itself, bit for bit. Control points that are equal stay equal, both parts
/// share their common edge bit for bit, and their bounds lie within those of the patch.
/// \pre No over- or underflow. All weights > 0.
template <scalar T, int M, int N>
PATCHRT_HD rational_halves<T, M, N> split_u(rational_patch<T, M, N> const& patch, T u) {
  rational_halves<T, M, N> h{patch, patch};
  detail::cut_net_u<M, N>(h.second.control_points, h.first.control_points, detail::weighted_segment<T>(u));
  return h;
}

/// The parts of a rational patch below and above the parameter v, as `split_u`, with N in the place of M.
template <scalar T, int M, int N>
PATCHRT_HD rational_halves<T, M, N> split_v(rational_patch<T, M, N> const& patch, T v) {
  rational_halves<T, M, N> h{patch, patch};
  detail::cut_net_v<M, N>(h.second.control_points, h.first.control_points, detail::weighted_segment<T>(v));
  return h;
}

/// The parts u <= 1/2 and u >= 1/2.
template <scalar T, int M, int N>
PATCHRT_INLINE rational_halves<T, M, N> split_u(rational_patch<T, M, N> const& patch) {
  return split_u(patch, T(lane_t<T>(0.5)));
}

/// The parts v <= 1/2 and v >= 1/2.
template <scalar T, int M, int N>
PATCHRT_INLINE rational_halves<T, M, N> split_v(rational_patch<T, M, N> const& patch) {
  return split_v(patch, T(lane_t<T>(0.5)));
}

/// The part u0 <= u <= u1, v0 <= v <= v1 of a rational patch as a patch over 0 <= u, v <= 1; turned round where u1 < u0
/// or v1 < v0.
///
/// With L = M + N, each coordinate is off by at most L (L + 2) eps m and each weight by 2 L eps of itself for
/// parameters within [0, 1]. Corners and edges depend on their own parameters alone, as those of polynomial patches do.
/// \note By the blossom: Ramshaw, "Blossoms are polar forms", CAGD 6(4), 1989; Farin, 5th ed., section 4.4.
template <scalar T, int M, int N>
PATCHRT_HD rational_patch<T, M, N> sub_patch(rational_patch<T, M, N> const& patch, T u0, T u1, T v0, T v1) {
  rational_patch<T, M, N> part = patch;
  detail::restrict_net<M, N, detail::weighted_segment<T>>(part.control_points, u0, u1, v0, v1);
  return part;
}

}  // namespace patchrt
