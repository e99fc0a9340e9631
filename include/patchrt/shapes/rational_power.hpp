// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/power_patch.hpp>
#include <patchrt/shapes/rational_patch.hpp>

namespace patchrt {

/// A rational Bezier patch A / W in powers of the centred parameters x = 2u - 1, y = 2v - 1: coefficient (k, l) holds
/// that of the numerator A as its point and that of the denominator W as its weight.
template <scalar T, int M = 3, int N = 3> struct rational_power_patch {
  weighted_point<T> coefficients[(M + 1) * (N + 1)];
};

/// Homogeneous points as the vectors they are.
template <scalar T> PATCHRT_INLINE weighted_point<T> operator+(weighted_point<T> const& a, weighted_point<T> const& b) {
  return {sum(a.point, b.point), a.weight + b.weight};
}
template <scalar T> PATCHRT_INLINE weighted_point<T> operator-(weighted_point<T> const& a, weighted_point<T> const& b) {
  return {difference(a.point, b.point), a.weight - b.weight};
}
template <scalar T> PATCHRT_INLINE weighted_point<T> operator*(T s, weighted_point<T> const& a) {
  return {scale(a.point, s), s * a.weight};
}

namespace detail {
/// Coordinate C of the numerator's coefficients, or the weights where C is 3, as numbers of type T.
template <scalar T, int C, class P, int M, int N> struct rational_coordinate {
  rational_power_patch<P, M, N> const& patch;
  PATCHRT_INLINE T operator()(int k, int l) const {
    weighted_point<P> const& c = patch.coefficients[(N + 1) * k + l];
    if constexpr (C == 3) return convert<T>(c.weight);
    else return convert<T>(component(c.point, C));
  }
};
}  // namespace detail

/// The power form of `patch`: errors as for polynomial patches, one rounding more for the products of points and
/// weights.
template <scalar T, int M, int N>
PATCHRT_HD rational_power_patch<T, M, N> to_power(rational_patch<T, M, N> const& patch) {
  rational_power_patch<T, M, N> q;
  for (int i = 0; i < (M + 1) * (N + 1); ++i) {
    weighted_point<T> const& p = patch.control_points[i];
    q.coefficients[i] = {scale(p.point, p.weight), p.weight};
  }
  detail::net_to_power<M, N>(q.coefficients, T(lane_t<T>(0.5)));
  return q;
}

/// The sums of the magnitudes of the numerator's coefficients, by coordinate, and of the weights.
template <scalar T, int M, int N>
PATCHRT_HD weighted_point<T> coefficient_sum(rational_power_patch<T, M, N> const& patch) {
  weighted_point<T> s{absolute(patch.coefficients[0].point), abs(patch.coefficients[0].weight)};
  for (int k = 1; k < (M + 1) * (N + 1); ++k) {
    s.point = sum(s.point, absolute(patch.coefficients[k].point));
    s.weight = s.weight + abs(patch.coefficients[k].weight);
  }
  return s;
}

/// S(x, y) alone.
template <scalar T, scalar P, int M, int N>
PATCHRT_INLINE vec3<T> position(rational_power_patch<P, M, N> const& patch, T x, T y) {
  using detail::rational_coordinate;
  T const inverse = T(lane_t<T>(1)) / detail::horner<M, N>(rational_coordinate<T, 3, P, M, N>{patch}, x, y);
  return scale(vec3<T>{detail::horner<M, N>(rational_coordinate<T, 0, P, M, N>{patch}, x, y),
                       detail::horner<M, N>(rational_coordinate<T, 1, P, M, N>{patch}, x, y),
                       detail::horner<M, N>(rational_coordinate<T, 2, P, M, N>{patch}, x, y)},
               inverse);
}

/// S, S_x and S_y at (x, y) by the quotient rule; `du` and `dv` of the result are the derivatives by x and y.
template <scalar T, scalar P, int M, int N>
PATCHRT_INLINE surface_point<T> evaluate(rational_power_patch<P, M, N> const& patch, T x, T y) {
  using detail::rational_coordinate;
  surface_point<T> a;
  T w, w_x, w_y;
  detail::horner<M, N>(rational_coordinate<T, 0, P, M, N>{patch}, x, y, a.position.x, a.du.x, a.dv.x);
  detail::horner<M, N>(rational_coordinate<T, 1, P, M, N>{patch}, x, y, a.position.y, a.du.y, a.dv.y);
  detail::horner<M, N>(rational_coordinate<T, 2, P, M, N>{patch}, x, y, a.position.z, a.du.z, a.dv.z);
  detail::horner<M, N>(rational_coordinate<T, 3, P, M, N>{patch}, x, y, w, w_x, w_y);
  T const inverse = T(lane_t<T>(1)) / w;
  vec3<T> const q = scale(a.position, inverse);
  return {q, scale(fma(-w_x, q, a.du), inverse), scale(fma(-w_y, q, a.dv), inverse)};
}

}  // namespace patchrt
