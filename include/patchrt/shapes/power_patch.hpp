// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_patch.hpp>

namespace patchrt {

/// A bicubic patch in powers of the centred parameters x = 2u - 1, y = 2v - 1:
///
///     S = sum_kl coefficients[4k + l] x^k y^l,   -1 <= x, y <= 1.
///
/// Horner's rule costs 28 fused operations a coordinate for value and both derivatives where the Bernstein form costs 44,
/// and since |x|, |y| <= 1 no coefficient exceeds the control net's size by more than a small factor, nor does the
/// rounding error: gamma_7 sum_kl |coefficients[4k + l]| a coordinate.
/// \note Farouki & Rajan, "On the numerical condition of polynomials in Bernstein form", CAGD 4, 1987, section 5: the power
///       form about the middle of the interval is the best conditioned of the power forms.
template <scalar T> struct power_patch { vec3<T> coefficients[16]; };

namespace detail {
/// Control values of a cubic over [0, 1] to powers of x = 2t - 1, in place, `stride` apart.
template <class V> PATCHRT_HD void bernstein_to_power(V* p, int stride) {
  using L = typename V::value_type;
  V const p0 = p[0], p1 = p[stride], p2 = p[2 * stride], p3 = p[3 * stride];
  V const ends = p0 + p3, mids = p1 + p2, rise = p3 - p0, inner = p2 - p1;
  p[0] = (ends + L(3) * mids) * L(0.125);
  p[stride] = (rise + inner) * L(0.375);
  p[2 * stride] = (ends - mids) * L(0.375);
  p[3 * stride] = (rise - L(3) * inner) * L(0.125);
}
}  // namespace detail

/// The power form of `patch`; the basis change is computed in the patch's own precision.
///
/// With m the largest |coordinate| of the control points and w = (1, 3/2, 3/2, 1), coefficient (k, l) is at most w_k w_l m and
/// gamma_6 w_k w_l m off: three roundings along either parameter.
template <scalar T> PATCHRT_HD power_patch<T> to_power(bicubic_patch<T> const& patch) {
  power_patch<T> q;
  for (int i = 0; i < 16; ++i) q.coefficients[i] = patch.control_points[i];
  for (int i = 0; i < 4; ++i) detail::bernstein_to_power(q.coefficients + 4 * i, 1);
  for (int j = 0; j < 4; ++j) detail::bernstein_to_power(q.coefficients + j, 4);
  return q;
}

/// The sum of the coefficients' magnitudes by coordinate, which bounds |S|, and what its rounding is in proportion to.
template <scalar T> PATCHRT_HD vec3<T> coefficient_sum(power_patch<T> const& patch) {
  vec3<T> s = absolute(patch.coefficients[0]);
  for (int k = 1; k < 16; ++k) s = sum(s, absolute(patch.coefficients[k]));
  return s;
}

/// S(x, y) alone: 15 fused operations a coordinate.
template <scalar T, scalar P> PATCHRT_INLINE vec3<T> position(power_patch<P> const& patch, T x, T y) {
  vec3<T> s(T(0), T(0), T(0));
  PATCHRT_UNROLL
  for (int k = 3; k >= 0; --k) {
    vec3<P> const* const row = patch.coefficients + 4 * k;
    vec3<T> r = convert_vec<T>(row[3]);
    PATCHRT_UNROLL
    for (int l = 2; l >= 0; --l) r = {fma(r.x, y, T(row[l].x)), fma(r.y, y, T(row[l].y)), fma(r.z, y, T(row[l].z))};
    s = k == 3 ? r : vec3<T>{fma(s.x, x, r.x), fma(s.y, x, r.y), fma(s.z, x, r.z)};
  }
  return s;
}

}  // namespace patchrt
