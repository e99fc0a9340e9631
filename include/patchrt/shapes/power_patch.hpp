// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_patch.hpp>

namespace patchrt {

/// A Bezier patch in powers of the centred parameters x = 2u - 1, y = 2v - 1:
///
///     S = sum_kl coefficients[(N + 1) k + l] x^k y^l,   -1 <= x, y <= 1.
///
/// Horner's rule costs 28 fused operations a coordinate of a bicubic for value and both derivatives where the Bernstein
/// form costs 44, and since |x|, |y| <= 1 no coefficient exceeds the control net's size by more than a small factor,
/// nor does the rounding error: gamma_(M + N + 1) sum_kl |coefficients[(N + 1) k + l]| a coordinate.
/// \note Farouki & Rajan, "On the numerical condition of polynomials in Bernstein form", CAGD 4, 1987, section 5: the power
///       form about the middle of the interval is the best conditioned of the power forms.
template <scalar T, int M = 3, int N = 3> struct power_patch { vec3<T> coefficients[(M + 1) * (N + 1)]; };

namespace detail {
/// Control values of degree N over [0, 1] to powers of x = 2t - 1, in place, `stride` apart: the k-th differences'
/// blossom at t = 1/2, times binomial(N, k) / 2^k.
template <int N, class V, class L> PATCHRT_HD void bernstein_to_power(V* p, int stride, L half) {
  for (int k = 0; k <= N; ++k) {
    V level[N + 1];
    for (int i = k; i <= N; ++i) level[i] = p[i * stride];  // the k-th differences
    for (int last = N; last > k; --last)
      for (int i = k; i < last; ++i) level[i] = half * (level[i] + level[i + 1]);
    for (int i = N; i > k; --i) p[i * stride] = p[i * stride] - p[(i - 1) * stride];
    p[k * stride] = (L(binomial(N, k)) / L(1 << k)) * level[k];
  }
}

/// The same of a net of degree (M, N), along v, then along u.
template <int M, int N, class V, class L> PATCHRT_HD void net_to_power(V* net, L half) {
  for (int i = 0; i <= M; ++i) bernstein_to_power<N>(net + (N + 1) * i, 1, half);
  for (int j = 0; j <= N; ++j) bernstein_to_power<M>(net + j, N + 1, half);
}

/// sum a[(N + 1) k + l] x^k y^l.
template <int M, int N, class A, scalar T> PATCHRT_INLINE T horner(A const& a, T x, T y) {
  T value;
  PATCHRT_UNROLL
  for (int k = M; k >= 0; --k) {
    T r = a(k, N);
    PATCHRT_UNROLL
    for (int l = N - 1; l >= 0; --l) r = fma(r, y, a(k, l));
    value = k == M ? r : fma(value, x, r);
  }
  return value;
}

/// The same with its derivatives.
template <int M, int N, class A, scalar T>
PATCHRT_INLINE void horner(A const& a, T x, T y, T& value, T& by_x, T& by_y) {
  PATCHRT_UNROLL
  for (int k = M; k >= 0; --k) {
    T r = fma(a(k, N), y, a(k, N - 1));
    T d = a(k, N);
    PATCHRT_UNROLL
    for (int l = N - 2; l >= 0; --l) {
      d = fma(d, y, r);
      r = fma(r, y, a(k, l));
    }
    by_x = k == M ? T(0) : k == M - 1 ? value : fma(by_x, x, value);
    value = k == M ? r : fma(value, x, r);
    by_y = k == M ? d : fma(by_y, x, d);
  }
}
}  // namespace detail

/// The power form of `patch`; the basis change is computed in the patch's own precision.
///
/// With m the largest |coordinate| of the control points and w_k^M the sum of the magnitudes of the coefficients of
/// binomial(M, k) ((1 + z) / 2)^(M - k) ((1 - z) / 2)^k, which is (1, 3/2, 3/2, 1) for M = 3, coefficient (k, l) is at
/// most w_k^M w_l^N m and gamma_(M + N + 2) w_k^M w_l^N m off: M + 1 roundings along u and N + 1 along v.
template <scalar T, int M, int N> PATCHRT_HD power_patch<T, M, N> to_power(bezier_patch<T, M, N> const& patch) {
  power_patch<T, M, N> q;
  for (int i = 0; i < (M + 1) * (N + 1); ++i) q.coefficients[i] = patch.control_points[i];
  detail::net_to_power<M, N>(q.coefficients, T(lane_t<T>(0.5)));
  return q;
}

/// The sum of the coefficients' magnitudes by coordinate, which bounds |S|, and what its rounding is in proportion to.
template <scalar T, int M, int N> PATCHRT_HD vec3<T> coefficient_sum(power_patch<T, M, N> const& patch) {
  vec3<T> s = absolute(patch.coefficients[0]);
  for (int k = 1; k < (M + 1) * (N + 1); ++k) s = sum(s, absolute(patch.coefficients[k]));
  return s;
}

namespace detail {
/// Coordinate c of the coefficients, as numbers of type T.
template <scalar T, int C, class P, int M, int N> struct power_coordinate {
  power_patch<P, M, N> const& patch;
  PATCHRT_INLINE T operator()(int k, int l) const {
    return convert<T>(component(patch.coefficients[(N + 1) * k + l], C));
  }
};
}  // namespace detail

/// S(x, y) alone: 15 fused operations a coordinate of a bicubic.
template <scalar T, scalar P, int M, int N>
PATCHRT_INLINE vec3<T> position(power_patch<P, M, N> const& patch, T x, T y) {
  return {detail::horner<M, N>(detail::power_coordinate<T, 0, P, M, N>{patch}, x, y),
          detail::horner<M, N>(detail::power_coordinate<T, 1, P, M, N>{patch}, x, y),
          detail::horner<M, N>(detail::power_coordinate<T, 2, P, M, N>{patch}, x, y)};
}

/// S, S_x and S_y at (x, y); `du` and `dv` of the result are the derivatives by x and y.
template <scalar T, scalar P, int M, int N>
PATCHRT_INLINE surface_point<T> evaluate(power_patch<P, M, N> const& patch, T x, T y) {
  surface_point<T> s;
  detail::horner<M, N>(detail::power_coordinate<T, 0, P, M, N>{patch}, x, y, s.position.x, s.du.x, s.dv.x);
  detail::horner<M, N>(detail::power_coordinate<T, 1, P, M, N>{patch}, x, y, s.position.y, s.du.y, s.dv.y);
  detail::horner<M, N>(detail::power_coordinate<T, 2, P, M, N>{patch}, x, y, s.position.z, s.du.z, s.dv.z);
  return s;
}

}  // namespace patchrt
