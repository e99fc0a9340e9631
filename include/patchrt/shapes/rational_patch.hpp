// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_patch.hpp>

namespace patchrt {

/// A control point of a rational curve or patch: a point in space, and how much it counts.
template <scalar T> struct weighted_point {
  vec3<T> point;
  T weight;
};

/// The rational Bezier patch Q(u, v) = sum_ij B_i^M(u) B_j^N(v) w_ij p_ij / sum_ij B_i^M(u) B_j^N(v) w_ij over 0 <= u,
/// v <= 1.
///
/// control_points[i (N + 1) + j] = (p_ij, w_ij). Points are stored, not their products with the weights: points that
/// are equal stay so whatever their weights, bounds and differences from any origin round nothing but their own result,
/// and a plane n.x + d costs the four operations a control point, w (n.p + d), that it costs on homogeneous points.
/// \pre All weights are greater than 0.
template <scalar T, int M = 3, int N = 3> struct rational_patch {
  static_assert(M >= 1 && N >= 1);
  // Beside each other: g++ 12 loses stores of loops over an array of points and one of weights in the same object.
  weighted_point<T> control_points[(M + 1) * (N + 1)];

  PATCHRT_INLINE weighted_point<T>& operator()(int i, int j) { return control_points[i * (N + 1) + j]; }
  PATCHRT_INLINE weighted_point<T> const& operator()(int i, int j) const { return control_points[i * (N + 1) + j]; }
};

/// Points and their weights, weight i (N + 1) + j for point (i, j).
template <scalar T, int M, int N>
PATCHRT_INLINE rational_patch<T, M, N> make_rational(bezier_patch<T, M, N> const& points,
                                                     T const (&weights)[(M + 1) * (N + 1)]) {
  rational_patch<T, M, N> r;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) r.control_points[k] = {points.control_points[k], weights[k]};
  return r;
}

/// A polynomial patch as a rational one: all weights are 1.
template <scalar T, int M, int N>
PATCHRT_INLINE rational_patch<T, M, N> make_rational(bezier_patch<T, M, N> const& points) {
  rational_patch<T, M, N> r;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) r.control_points[k] = {points.control_points[k], T(lane_t<T>(1))};
  return r;
}

/// The polynomial patch of the products w_ij p_ij, one rounding each: what Q is times its denominator.
template <scalar T, int M, int N> PATCHRT_INLINE bezier_patch<T, M, N> numerator(rational_patch<T, M, N> const& patch) {
  bezier_patch<T, M, N> a;
  for (int k = 0; k < (M + 1) * (N + 1); ++k)
    a.control_points[k] = scale(patch.control_points[k].point, patch.control_points[k].weight);
  return a;
}

namespace detail {

/// acc + a; a for the first of a sum.
template <scalar T> PATCHRT_INLINE void accumulate(T& acc, bool first, T a) { acc = first ? a : acc + a; }

/// acc + w a, as for points.
template <scalar T> PATCHRT_INLINE void accumulate(T& acc, bool first, T w, T a) {
  acc = first ? w * a : fma(w, a, acc);
}

/// sum_j b_j w_ij p_ij and sum_j b_j w_ij over row i of a patch: a point times its weight, and the weight.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE weighted_point<T> weighted_row(rational_patch<P, M, N> const& patch, int i, T const (&b)[N + 1]) {
  weighted_point<T> s;
  PATCHRT_UNROLL
  for (int j = 0; j <= N; ++j) {
    T const w = b[j] * convert<T>(patch(i, j).weight);
    accumulate(s.point, j == 0, w, convert_vec<T>(patch(i, j).point));
    accumulate(s.weight, j == 0, w);
  }
  return s;
}

template <scalar T>
PATCHRT_INLINE void accumulate(weighted_point<T>& acc, bool first, T b, weighted_point<T> const& row) {
  accumulate(acc.point, first, b, row.point);
  accumulate(acc.weight, first, b, row.weight);
}

}  // namespace detail

/// Q, Qu and Qv at (u, v), by the quotient rule with one division: Qu = (Au - Wu Q) / W, with Q = A / W.
///
/// With m the largest |coordinate| of the control points, r the ratio of the largest to the least weight and
/// g(n) = n eps / (2 - n eps), the error of each coordinate is at most
///     g(6 (M + N) + 4) m of the position,   M r g(27 (M + N) + 24) m of du,   N r g(27 (M + N) + 24) m of dv
/// for 0 <= u, v <= 1. With k = 3 (M + N) + 1, one more than a polynomial patch has for the products with weights: A is
/// within g(k) m W and W, a sum of positive terms, within g(k) W; so Q within g(2 k + 2) m. Au and Wu are within
/// 2 M g(k) times the largest weight, and |Wu| <= M times that.
/// \pre No over- or underflow. All weights > 0.
/// \note Farin, Curves and Surfaces for CAGD, 5th ed., chapter 13.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE surface_point<T> evaluate(rational_patch<P, M, N> const& patch, T u, T v) {
  auto const wu = detail::bernstein_weights<M>(u);
  auto const wv = detail::bernstein_weights<N>(v);
  weighted_point<T> a, a_u, a_v;
  PATCHRT_UNROLL
  for (int i = 0; i <= M; ++i) {
    auto const row = detail::weighted_row(patch, i, wv.value);
    detail::accumulate(a, i == 0, wu.value[i], row);
    detail::accumulate(a_u, i == 0, wu.first[i], row);
    detail::accumulate(a_v, i == 0, wu.value[i], detail::weighted_row(patch, i, wv.first));
  }
  T const inverse = T(lane_t<T>(1)) / a.weight;
  vec3<T> const q = scale(a.point, inverse);
  return {q, scale(fma(-a_u.weight, q, a_u.point), inverse), scale(fma(-a_v.weight, q, a_v.point), inverse)};
}

/// Q alone at (u, v): the same bits as `evaluate` gives.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE vec3<T> position(rational_patch<P, M, N> const& patch, T u, T v) {
  auto const wu = detail::bernstein_weights<M>(u);
  auto const wv = detail::bernstein_weights<N>(v);
  weighted_point<T> a;
  PATCHRT_UNROLL
  for (int i = 0; i <= M; ++i) detail::accumulate(a, i == 0, wu.value[i], detail::weighted_row(patch, i, wv.value));
  return scale(a.point, T(lane_t<T>(1)) / a.weight);
}

/// The box of the control points, which holds the patch since no weight is negative. No rounding; NaN as for polynomial
/// patches.
template <scalar T, int M, int N> PATCHRT_INLINE box<T> bounds(rational_patch<T, M, N> const& patch) {
  bezier_patch<T, M, N> points;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) points.control_points[k] = patch.control_points[k].point;
  return bounds(points);
}

}  // namespace patchrt
