// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/roots/enclosure.hpp>
#include <patchrt/roots/newton.hpp>

namespace patchrt {

/// Two functions on [0, 1]^2 in tensor-product Bernstein form of degree M in u and N in v: coefficient (i, j) is at i (N + 1) + j.
///
/// The true functions are polynomials of these degrees that leave the given ones by at most `error_f`, `error_g` over the square.
template <scalar T, int M = 3, int N = 3> struct bernstein_pair {
  static_assert(lanes_v<T> == 1 && 1 <= M && M <= 5 && 1 <= N && N <= 5);
  T f[(M + 1) * (N + 1)];
  T g[(M + 1) * (N + 1)];
  T error_f;
  T error_g;
};

/// u_low <= u <= u_high, v_low <= v <= v_high.
template <class R> struct parameter_box { R u_low, u_high, v_low, v_high; };

/// Whether `a` is in `b`, borders included.
template <class R> PATCHRT_INLINE bool is_inside(parameter_box<R> const& a, parameter_box<R> const& b) {
  return b.u_low <= a.u_low && a.u_high <= b.u_high && b.v_low <= a.v_low && a.v_high <= b.v_high;
}

/// Whether `a` and `b` have a point in common, or are at most (slack_u, slack_v) apart.
template <class R>
PATCHRT_INLINE bool is_touching(parameter_box<R> const& a, parameter_box<R> const& b, R slack_u = R(0),
                                R slack_v = R(0)) {
  return a.u_low - b.u_high <= slack_u && b.u_low - a.u_high <= slack_u && a.v_low - b.v_high <= slack_v &&
         b.v_low - a.v_high <= slack_v;
}

namespace detail {

/// Beyond the unit square by this much a box may reach, so that a root on the border has room around it.
template <class R> PATCHRT_INLINE constexpr R overhang() { return R(0x1p-7); }

/// A pair scaled so that the largest coefficient of either function is in [1, 2), coefficients of f and g side by side.
///
/// Row i holds f's coefficients (i, 0..N), then g's. `noise` bounds what rounding changes, per function, in any of: a coefficient of
/// its restriction to a box, a combination's share of it, half a difference of two such, a value. `error` is the pair's own.
///
/// Proof of `noise`. Restriction is M + N levels of lerp(x, y, t) = fma(t, y - x, x) with t in [-h, 1 + h], h = `overhang`. Where
/// |x|, |y| <= m, a level adds at most 3 u m (1 + 2h) and takes magnitudes and errors from below at most (1 + 2h) times further; over
/// M + N <= 10 levels that is 3 (1 + 2h)^11 u m < 3.6 u m a level, with room for terms in u^2 and for underflow, as m >= 1. Values are
/// lerps as well. A combination a f + b g with |a|, |b| <= 1 rounds each share twice more, 2.4 u m; a difference halved once more
/// than that; a mean over the coefficients by weights that are powers of two's multiples M + N + 2 times, 1.2 u m each. All stay below
/// 6 (M + N + 1) u m. Where fma rounds its product first, u is to bound |ab| + |c|'s part and a lerp adds 5 u m instead: 6 (M + N) u m.
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
  noise = rounded_up(R(6 * (M + N + 1)) * enclosure<T>::unit() * max(largest / scale, R(1)));
  scaled_error = rounded_up(e / scale);
  return true;
}

template <int M, int N, scalar T> PATCHRT_HD scaled_pair<T, M, N> scaled(bernstein_pair<T, M, N> const& pair) {
  scaled_pair<T, M, N> s;
  s.is_finite = scale_function<M, N>(pair.f, pair.error_f, s.rows, 0, s.noise_f, s.error_f, s.scale_f) &&
                scale_function<M, N>(pair.g, pair.error_g, s.rows, N + 1, s.noise_g, s.error_g, s.scale_g);
  return s;
}

/// The K + 1 rows of a polynomial of degree K in the row's parameter, for its part from a to b: row i is the blossom at K - i times a
/// and i times b, from the given rows and not from a parent's part, so that rounding does not add up from one halving to the next.
/// \note Ramshaw, "Blossoms are polar forms", CAGD 6, 1989.
template <int K, int W, scalar T>
PATCHRT_HD void restrict_rows(T (&rows)[K + 1][W], T const& a, T const& b, T (&out)[K + 1][W]) {
  for (int i = 0; i <= K; ++i) {
    T part[K + 1][W];
    for (int k = 0; k <= K - i; ++k) {
      for (int w = 0; w < W; ++w) part[k][w] = rows[k][w];
    }
    for (int n = K - i; n > 0; --n) {
      for (int k = 0; k < n; ++k) {
        for (int w = 0; w < W; ++w) part[k][w] = lerp(part[k][w], part[k + 1][w], a);
      }
    }
    for (int w = 0; w < W; ++w) out[i][w] = part[0][w];
    for (int k = 0; k < K - i; ++k) {
      for (int w = 0; w < W; ++w) rows[k][w] = lerp(rows[k][w], rows[k + 1][w], b);
    }
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
  for (int i = 0; i <= M; ++i) {
    for (int w = 0; w < W; ++w) rows[i][w] = pair.rows[i][w];
  }
  for (int n = M; n > 0; --n) {
    if (n == 1) {
      for (int w = 0; w < W; ++w) by_u[w] = T(lane_t<T>(M)) * (rows[1][w] - rows[0][w]);
    }
    for (int k = 0; k < n; ++k) {
      for (int w = 0; w < W; ++w) rows[k][w] = lerp(rows[k][w], rows[k + 1][w], u);
    }
  }
  T value[2], slope_u[2], slope_v[2];
  for (int c = 0; c < 2; ++c) {
    T* const a = rows[0] + c * (N + 1);
    T* const d = by_u + c * (N + 1);
    for (int n = N; n > 0; --n) {
      if (n == 1) slope_v[c] = T(lane_t<T>(N)) * (a[1] - a[0]);
      for (int k = 0; k < n; ++k) {
        a[k] = lerp(a[k], a[k + 1], v);
        d[k] = lerp(d[k], d[k + 1], v);
      }
    }
    value[c] = a[0];
    slope_u[c] = d[0];
  }
  return {value[0], slope_u[0], slope_v[0], value[1], slope_u[1], slope_v[1]};
}

}  // namespace detail
}  // namespace patchrt
