// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

namespace patchrt {

/// Two functions on [0, 1]^2 in tensor-product Bernstein form of degree M in u and N in v: coefficient (i, j) is at i
/// (N + 1) + j.
///
/// The true functions are polynomials of these degrees that leave the given ones by at most `error_f`, `error_g` over
/// the square.
template <scalar T, int M = 3, int N = 3> struct bernstein_pair {
  static_assert(lanes_v<T> == 1 && 1 <= M && M <= 5 && 1 <= N && N <= 5);
  T f[(M + 1) * (N + 1)];
  T g[(M + 1) * (N + 1)];
  T error_f;
  T error_g;
};

}  // namespace patchrt
