// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

namespace patchrt {

/// Two functions of (x, y) and their Jacobian at one point.
template <scalar T> struct bivariate {
  T f, fx, fy;
  T g, gx, gy;
};

/// Newton's correction scaled by the Jacobian's determinant: the step is (dx, dy) / det.
///
/// Undivided, because that is what tests of size need: |step| > h where |dx| > h |det|, without a division and without
/// a case for det = 0.
template <scalar T> struct scaled_step {
  T dx, dy;
  T det;
};

/// -adj(J) (f, g) and det J, each difference of products within 1.5 ulp.
template <scalar T> PATCHRT_INLINE scaled_step<T> newton_step(bivariate<T> const& b) {
  return {difference_of_products(b.g, b.fy, b.f, b.gy), difference_of_products(b.f, b.gx, b.g, b.fx),
          difference_of_products(b.fx, b.gy, b.fy, b.gx)};
}

/// A step in x and y.
template <scalar T> struct limited_step {
  T dx, dy;
};

/// The step itself, within one epsilon, where it is shorter than the limit, else the limit in its direction; x and y
/// apart. Always a number: a step of 0/0 is the limit.
template <scalar T> PATCHRT_INLINE limited_step<T> limit_step(scaled_step<T> const& s, T limit_x, T limit_y) {
  T const inverse = T(1) / s.det;
  // `min` drops the NaN of 0 times an infinite inverse.
  return {max(min(s.dx * inverse, limit_x), -limit_x), max(min(s.dy * inverse, limit_y), -limit_y)};
}

}  // namespace patchrt
