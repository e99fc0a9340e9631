// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <limits>

namespace patchrt {

/// Whether a root where a parabola touches zero counts.
enum class tangent { hit, miss };

/// Both roots of a quadratic equation, t0 <= t1; unspecified where not `real`.
template <scalar T> struct quadratic_roots {
  T t0;
  T t1;
  mask_t<T> real;
};

/// The roots of a t^2 + 2 h t + c = 0; note the halved middle coefficient.
///
///     D = h^2 - a c,   q = -(h + sign(h) sqrt(D)),   t = q / a and c / q.
///
/// Of these sums only D cancels, and that is a difference of exact products, within 2 u of its own size (u = epsilon /
/// 2): it has the right sign, and is 0 where it should be. With the roundings of root, sum and quotient, each root is
/// within 4 u + 16 u^2 of its size of that of the coefficients as given, thus 4 ulp at most, however close the other
/// one is. What the coefficients are off by is another matter: near a double root, half of the digits.
///
/// Where a = 0, one root is -c / (2 h), the other what it tends to from a > 0: -infinity for h > 0, infinity for h < 0.
/// So a t^2 + 2 h t + c < 0 between t0 and t1 wherever a >= 0.
/// \tparam Touch whether D = 0, where t0 and t1 are the same up to rounding, is a root.
/// \pre    The greater of h^2 and |a c| is 0 or between min() / epsilon() and max(). Below, D may be 0 where it should
///         not; above, there is no root.
/// \return `real` is false where a = h = 0, and where a number is infinite or NaN.
/// \note   Kahan, "On the cost of floating-point computation without extra-precise arithmetic", 2004. The bound on D:
///         Jeannerod, Louvet & Muller, "Further analysis of Kahan's algorithm for the accurate computation of 2x2
///         determinants", Math. Comp. 82, 2013.
template <tangent Touch = tangent::hit, scalar T> PATCHRT_INLINE quadratic_roots<T> solve_quadratic(T a, T h, T c) {
  T const zero(0), largest(std::numeric_limits<lane_t<T>>::max());
  T const discriminant = difference_of_products(-a, c, -h, h), size = abs(discriminant);
  T const q = copysign(sqrt(size), -h) - h;
  T const u = q / (a + zero);  // -0 becomes 0
  T const v = select(zero < abs(q), c / q, u);
  auto const crosses = Touch == tangent::hit ? zero <= discriminant : zero < discriminant;
  return {min(u, v), max(u, v), crosses && discriminant <= largest && zero < max(abs(h), abs(a))};
}

}  // namespace patchrt
