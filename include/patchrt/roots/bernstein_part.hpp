// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// A pair of Bernstein polynomials over a part of the square, and at a point, with a bound on what rounding changes.

#include <patchrt/roots/bernstein_pair.hpp>
#include <patchrt/roots/enclosure.hpp>
#include <patchrt/roots/newton.hpp>
#include <patchrt/roots/parameter_box.hpp>

#include <limits>

namespace patchrt::detail {

/// Beyond the unit square by this much a box may reach, so that a root on the border has room around it.
template <class R> PATCHRT_INLINE constexpr R overhang() { return R(0x1p-7); }

/// A pair scaled so that the largest coefficient of either function is in [1, 2), coefficients of f and g side by side.
///
/// Row i holds f's coefficients (i, 0..N), then g's. `noise` bounds what rounding changes in a coefficient of a
/// restriction to a box with ends on the grid (`grid_below`), and two thirds of what it changes in a value anywhere.
/// `error` is the pair's own.
///
/// Proof. Both are M + N levels of `blend_rows` with weights t and 1 - t for t in [-h, 1 + h], h = `overhang`. On the
/// grid the weights are exact, and the smaller is at most 1/2: where |x|, |y| <= m, a level adds 3/2 u m (1 + 2h) and
/// takes magnitudes and errors from below at most (1 + 2h) times further; over M + N <= 10 levels that is 3/2 (1 +
/// 2h)^10 u m < 1.8 u m a level. Elsewhere 1 - t is rounded, u m more. `noise` is 2 (M + N) u m, with m >= 1, which
/// leaves room for terms in u^2 and for underflow.
template <scalar T, int M, int N> struct scaled_pair {
  using R = real_t<T>;
  T rows[M + 1][2 * (N + 1)];
  R noise_f, noise_g;
  R error_f, error_g;
  R scale_f, scale_g;  ///< the powers of two that f and g were divided by
  bool is_finite;      ///< false where a coefficient or an error is no number: nothing else is set then
};

/// x (1 + a few roundings): no less than what x stands for after the sums and products of a few terms that made it.
template <class R> PATCHRT_INLINE R rounded_up(R x) { return x * (R(1) + R(16) * std::numeric_limits<R>::epsilon()); }

template <scalar T> PATCHRT_INLINE real_t<T> magnitude(T const& x) {
  return max(abs(enclosure<T>::lower(x)), abs(enclosure<T>::upper(x)));
}

/// One function of a scaled pair; false where it is not made of numbers.
template <int M, int N, scalar T>
PATCHRT_HD bool scale_function(T const* from, T const& error, T (&rows)[M + 1][2 * (N + 1)], int at, real_t<T>& noise,
                               real_t<T>& scaled_error, real_t<T>& scale) {
  using R = real_t<T>;
  R const huge = std::numeric_limits<R>::max();
  R largest(0);
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    R const m = magnitude(from[k]);
    if (!(m <= huge)) return false;
    largest = max(largest, m);
  }
  R const e = enclosure<T>::upper(error);
  if (!(R(0) <= e && e <= huge)) return false;
  scale = power_of_two_below(max(largest, std::numeric_limits<R>::min()));
  for (int k = 0; k < (M + 1) * (N + 1); ++k) rows[k / (N + 1)][at + k % (N + 1)] = from[k] / T(scale);
  noise = rounded_up(R(2 * (M + N)) * enclosure<T>::unit() * max(largest / scale, R(1)));
  // A quotient that underflows is not nothing.
  scaled_error = e > R(0) ? rounded_up(e / scale + std::numeric_limits<R>::min()) : R(0);
  return true;
}

template <int M, int N, scalar T> PATCHRT_HD scaled_pair<T, M, N> scaled(bernstein_pair<T, M, N> const& pair) {
  scaled_pair<T, M, N> s;
  s.is_finite = scale_function<M, N>(pair.f, pair.error_f, s.rows, 0, s.noise_f, s.error_f, s.scale_f) &&
                scale_function<M, N>(pair.g, pair.error_g, s.rows, N + 1, s.noise_g, s.error_g, s.scale_g);
  return s;
}

/// The weights 1 - t and t of two numbers, and which of them is the larger.
template <scalar T> struct blend_weights {
  T first, second;
  bool is_late;
  PATCHRT_INLINE explicit blend_weights(T const& t)
      : first(T(real_t<T>(1)) - t), second(t), is_late(enclosure<T>::lower(t) > real_t<T>(0.5)) {}
};

/// (1 - t) x + t y for all but the last of some rows of W numbers and the rows after them: the smaller product is
/// rounded first. A form that does not widen intervals.
template <bool IsLate, int W, scalar T>
PATCHRT_INLINE void blend_rows(T (*rows)[W], int count, blend_weights<T> const& weights) {
  for (int k = 0; k < count; ++k) {
    for (int w = 0; w < W; ++w) {
      T const x = rows[k][w], y = rows[k + 1][w];
      rows[k][w] = IsLate ? fma(weights.second, y, weights.first * x) : fma(weights.first, x, weights.second * y);
    }
  }
}
template <int W, scalar T> PATCHRT_INLINE void blend_rows(T (*rows)[W], int count, blend_weights<T> const& weights) {
  if (weights.is_late) blend_rows<true>(rows, count, weights);
  else blend_rows<false>(rows, count, weights);
}

/// x or the grid's next number below: of the grid, 1 - x is a number too. \pre |x - 1/2| < 1
template <class R> PATCHRT_INLINE R grid_below(R x) {
  R const step = R(2) * std::numeric_limits<R>::epsilon();
  R const y = (x + R(2)) - R(2);
  return y > x ? y - step : y;
}
template <class R> PATCHRT_INLINE R grid_above(R x) {
  R const step = R(2) * std::numeric_limits<R>::epsilon();
  R const y = (x + R(2)) - R(2);
  return y < x ? y + step : y;
}

/// The K + 1 rows of a polynomial of degree K in the row's parameter, for its part from a to b: row i is the blossom at
/// K - i times a and i times b, from the given rows and not from a parent's part, so that rounding does not add up from
/// one halving to the next.
/// \note Ramshaw, "Blossoms are polar forms", CAGD 6, 1989.
template <int K, int W, scalar T>
PATCHRT_HD void restrict_rows(T (&rows)[K + 1][W], T const& a, T const& b, T (&out)[K + 1][W]) {
  blend_weights<T> const at_a(a), at_b(b);
  for (int i = 0; i <= K; ++i) {
    T part[K + 1][W];
    for (int k = 0; k <= K - i; ++k) {
      for (int w = 0; w < W; ++w) part[k][w] = rows[k][w];
    }
    for (int n = K - i; n > 0; --n) blend_rows(part, n, at_a);
    for (int w = 0; w < W; ++w) out[i][w] = part[0][w];
    blend_rows(rows, K - i, at_b);
  }
}

/// A pair's part over a box: coefficient (i, j) of f is x[j][i], of g x[j][M + 1 + i].
template <scalar T, int M, int N> struct restricted_pair { T x[N + 1][2 * (M + 1)]; };

template <scalar T, int M, int N>
PATCHRT_HD restricted_pair<T, M, N> restricted(scaled_pair<T, M, N> const& pair, parameter_box<real_t<T>> const& box) {
  T rows[M + 1][2 * (N + 1)], along_u[M + 1][2 * (N + 1)], turned[N + 1][2 * (M + 1)];
  for (int i = 0; i <= M; ++i) {
    for (int w = 0; w < 2 * (N + 1); ++w) rows[i][w] = pair.rows[i][w];
  }
  restrict_rows<M>(rows, T(box.u_low), T(box.u_high), along_u);
  for (int j = 0; j <= N; ++j) {
    for (int i = 0; i <= M; ++i) {
      turned[j][i] = along_u[i][j];
      turned[j][M + 1 + i] = along_u[i][N + 1 + j];
    }
  }
  restricted_pair<T, M, N> r;
  restrict_rows<N>(turned, T(box.v_low), T(box.v_high), r.x);
  return r;
}

/// f, g and their derivatives by u and v at (u, v), by de Casteljau's algorithm.
template <scalar T, int M, int N>
PATCHRT_HD bivariate<T> evaluate(scaled_pair<T, M, N> const& pair, T const& u, T const& v) {
  constexpr int W = 2 * (N + 1);
  T rows[M + 1][W], by_u[W];
  blend_weights<T> const at_u(u), at_v(v);
  for (int i = 0; i <= M; ++i) {
    for (int w = 0; w < W; ++w) rows[i][w] = pair.rows[i][w];
  }
  for (int n = M; n > 0; --n) {
    if (n == 1) {
      for (int w = 0; w < W; ++w) by_u[w] = T(lane_t<T>(M)) * (rows[1][w] - rows[0][w]);
    }
    blend_rows(rows, n, at_u);
  }
  T columns[N + 1][4], by_v[2];
  for (int j = 0; j <= N; ++j) {
    columns[j][0] = rows[0][j];
    columns[j][1] = rows[0][N + 1 + j];
    columns[j][2] = by_u[j];
    columns[j][3] = by_u[N + 1 + j];
  }
  for (int n = N; n > 0; --n) {
    if (n == 1) {
      for (int c = 0; c < 2; ++c) by_v[c] = T(lane_t<T>(N)) * (columns[1][c] - columns[0][c]);
    }
    blend_rows(columns, n, at_v);
  }
  T const* const at = columns[0];
  return {at[0], at[2], by_v[0], at[1], at[3], by_v[1]};
}

}  // namespace patchrt::detail
