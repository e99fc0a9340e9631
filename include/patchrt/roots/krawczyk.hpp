// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What two functions in Bernstein form are known to do in a box: the tests of exclusion, contraction, existence
/// and uniqueness.
///
/// All of them look at combinations a f + b g, by what their coefficients and the differences of these enclose. Two
/// combinations come from the mean Jacobian's adjoint: the one that loses its slope along v tells where in u a root can
/// be, and the other way round. Where the Jacobian is nearly singular both become the one combination without a linear
/// part, which keeps curves that nearly touch apart in cells as long as their distance from the point of contact.
/// \note Krawczyk, Computing 4, 1969; Neumaier, Interval Methods for Systems of Equations, 1990, chapter 5; Garloff &
///       Smith, "Investigation of a subdivision based algorithm for solving systems of polynomial equations", Nonlinear
///       Analysis 47, 2001; Mourrain & Pavone, "Subdivision methods for solving polynomial equations", JSC 44, 2009,
///       section 3.

#include <patchrt/roots/bernstein_part.hpp>

namespace patchrt::detail {

/// a f + b g over a box, where (s, t) in [0, 1]^2 is the place in the box.
template <class R> struct combination {
  R a, b;                     ///< the larger of |a|, |b| is 1
  R error;                    ///< what the true values may differ from computed ones
  R low, high;                ///< of its computed coefficients
  R middle_low, middle_high;  ///< of its computed value at s = t = 1/2
  R least_slope;              ///< of the true |derivative| along its own parameter; 0 or less where that may vanish
  R slope_low, slope_high;    ///< of the true derivative along its own parameter
  R cross_slope;              ///< of the true |derivative| along the other, at most
};

/// What is known of a pair in a box.
template <class R> struct box_facts {
  combination<R> row[2];       ///< what has no mean slope along t, whose own parameter is s; and the other way round
  R variation_u, variation_v;  ///< the largest difference of neighbouring coefficients along either parameter
  bool is_excluded;            ///< there is no root
  bool is_vanishing;           ///< both functions are within their errors all over the box
};

template <class R> PATCHRT_INLINE bool is_apart_from_zero(R low, R high, R error) {
  return low > error || high < -error;
}

/// The least and the largest of some numbers.
template <scalar T> struct hull {
  real_t<T> low, high;
  PATCHRT_INLINE explicit hull(T const& x) : low(enclosure<T>::lower(x)), high(enclosure<T>::upper(x)) {}
  PATCHRT_INLINE void add(T const& x) {
    low = min(enclosure<T>::lower(x), low);
    high = max(enclosure<T>::upper(x), high);
  }
};

template <scalar T> PATCHRT_INLINE real_t<T> approximately(T const& x) {
  return (enclosure<T>::lower(x) + enclosure<T>::upper(x)) / real_t<T>(2);
}

/// The weight of coefficient i in the value at 1/2.
template <int K, class R> PATCHRT_HD R middle_weight(int i) {
  int w = 1;
  for (int k = 0; k < i; ++k) w = w * (K - k) / (k + 1);
  return R(w) / R(1 << K);
}

/// By how much more than in the unit square the pair's errors count in `box`: Chebyshev polynomials grow most outside,
/// and T_5(1 + 2 overhang)^2 < 2.01.
template <class R> PATCHRT_INLINE R error_growth(parameter_box<R> const& box) {
  return is_inside(box, parameter_box<R>{R(0), R(1), R(0), R(1)}) ? R(1) : R(2.0625);
}

/// The bounds of a f + b g, whose own parameter is s (Own = 0) or t.
template <int Own, int M, int N, scalar T>
PATCHRT_HD combination<real_t<T>> combine(restricted_pair<T, M, N> const& part, scaled_pair<T, M, N> const& pair,
                                          real_t<T> a, real_t<T> b, real_t<T> largest_f, real_t<T> largest_g,
                                          parameter_box<real_t<T>> const& box) {
  using R = real_t<T>;
  R const width_u = box.u_high - box.u_low, width_v = box.v_high - box.v_low, growth = error_growth(box);
  T c[N + 1][M + 1];
  for (int j = 0; j <= N; ++j) {
    for (int i = 0; i <= M; ++i) c[j][i] = fma(T(a), part.x[j][i], T(b) * part.x[j][M + 1 + i]);
  }
  hull<T> all(c[0][0]), by_s(c[0][1] - c[0][0]), by_t(c[1][0] - c[0][0]);
  T middle(R(0));
  for (int j = 0; j <= N; ++j) {
    T across(R(0));
    for (int i = 0; i <= M; ++i) {
      all.add(c[j][i]);
      if (i < M) by_s.add(c[j][i + 1] - c[j][i]);
      if (j < N) by_t.add(c[j + 1][i] - c[j][i]);
      across = fma(T(middle_weight<M, R>(i)), c[j][i], across);
    }
    middle = fma(T(middle_weight<N, R>(j)), across, middle);
  }
  // A coefficient is rounded twice, its half differences half as often again, the middle M + N + 2 times more.
  R const local = R(M + N + 4) * enclosure<T>::unit() * (abs(a) * largest_f + abs(b) * largest_g);
  R const noise = abs(a) * pair.noise_f + abs(b) * pair.noise_g + local;
  R const error = abs(a) * pair.error_f + abs(b) * pair.error_g;
  // Differences of the error's polynomial are unknown, its derivatives are bounded: 4 K^2 error by Markov's inequality.
  R const slope_error_s = rounded_up(R(2 * M) * noise + R(4 * M * M) * error * width_u);
  R const slope_error_t = rounded_up(R(2 * N) * noise + R(4 * N * N) * error * width_v);
  hull<T> const& own = Own == 0 ? by_s : by_t;
  hull<T> const& cross = Own == 0 ? by_t : by_s;
  R const own_error = Own == 0 ? slope_error_s : slope_error_t, own_degree(Own == 0 ? M : N);
  R const cross_error = Own == 0 ? slope_error_t : slope_error_s, cross_degree(Own == 0 ? N : M);
  combination<R> r;
  r.a = a;
  r.b = b;
  r.error = rounded_up(noise + growth * error);
  r.low = all.low;
  r.high = all.high;
  r.middle_low = enclosure<T>::lower(middle);
  r.middle_high = enclosure<T>::upper(middle);
  // Fused by hand: side by side, g++ 12 fuses a difference and a sum of products, whatever -ffp-contract says.
  r.slope_low = fma(own_degree, own.low, -own_error);
  r.slope_high = fma(own_degree, own.high, own_error);
  R const slack = R(4) * std::numeric_limits<R>::epsilon() * max(abs(r.slope_low), abs(r.slope_high));
  r.slope_low = r.slope_low - slack;
  r.slope_high = r.slope_high + slack;
  r.least_slope = max(r.slope_low, -r.slope_high);
  r.cross_slope = rounded_up(cross_degree * max(abs(cross.low), abs(cross.high)) + cross_error);
  return r;
}

/// \pre the box's ends are on the grid
template <int M, int N, scalar T>
PATCHRT_OUTLINE box_facts<real_t<T>> examine(scaled_pair<T, M, N> const& pair, parameter_box<real_t<T>> const& box) {
  using R = real_t<T>;
  restricted_pair<T, M, N> const part = restricted(pair, box);
  R const growth = error_growth(box);
  box_facts<R> facts;
  hull<T> f(part.x[0][0]), g(part.x[0][M + 1]);
  for (int j = 0; j <= N; ++j) {
    for (int i = 0; i <= M; ++i) {
      f.add(part.x[j][i]);
      g.add(part.x[j][M + 1 + i]);
    }
  }
  R const error_f = rounded_up(pair.noise_f + growth * pair.error_f);
  R const error_g = rounded_up(pair.noise_g + growth * pair.error_g);
  R const largest_f = max(abs(f.low), abs(f.high)), largest_g = max(abs(g.low), abs(g.high));
  facts.is_vanishing = largest_f <= error_f && largest_g <= error_g;
  facts.is_excluded = is_apart_from_zero(f.low, f.high, error_f) || is_apart_from_zero(g.low, g.high, error_g);
  if (facts.is_excluded || facts.is_vanishing) return facts;

  // Mean slopes up to a factor that does not matter.
  R slope[2][2] = {};
  facts.variation_u = facts.variation_v = R(0);
  for (int c = 0; c < 2; ++c) {
    int const at = c * (M + 1);
    for (int j = 0; j <= N; ++j) {
      for (int i = 0; i < M; ++i) {
        R const d = approximately(part.x[j][at + i + 1] - part.x[j][at + i]);
        slope[c][0] = slope[c][0] + d;
        facts.variation_u = max(facts.variation_u, abs(d));
      }
    }
    for (int j = 0; j < N; ++j) {
      for (int i = 0; i <= M; ++i) {
        R const d = approximately(part.x[j + 1][at + i] - part.x[j][at + i]);
        slope[c][1] = slope[c][1] + d;
        facts.variation_v = max(facts.variation_v, abs(d));
      }
    }
  }
  R const by_t = max(abs(slope[0][1]), abs(slope[1][1])), by_s = max(abs(slope[0][0]), abs(slope[1][0]));
  bool const has_t = by_t > R(0), has_s = by_s > R(0);
  facts.row[0] = combine<0>(part, pair, has_t ? slope[1][1] / by_t : R(1), has_t ? -slope[0][1] / by_t : R(0),
                            largest_f, largest_g, box);
  facts.row[1] = combine<1>(part, pair, has_s ? -slope[1][0] / by_s : R(0), has_s ? slope[0][0] / by_s : R(1),
                            largest_f, largest_g, box);
  for (combination<R> const& c : facts.row) {
    facts.is_excluded = facts.is_excluded || is_apart_from_zero(c.low, c.high, c.error);
  }
  return facts;
}

/// Whether one of the combinations is, all over the box, within a few times what is unknown of it: no smaller box would
/// say more.
template <class R> PATCHRT_INLINE bool is_at_floor(box_facts<R> const& facts) {
  auto const is_unknown = [](combination<R> const& c) { return max(abs(c.low), abs(c.high)) <= R(3) * c.error; };
  return is_unknown(facts.row[0]) || is_unknown(facts.row[1]);
}

/// Whether the preconditioned Jacobian is diagonally dominant all over the box: the pair is injective there.
template <class R> PATCHRT_INLINE bool is_injective(box_facts<R> const& facts) {
  return facts.row[0].cross_slope < facts.row[0].least_slope && facts.row[1].cross_slope < facts.row[1].least_slope;
}

/// Whether the interval Newton operator takes the box into its interior: then it holds exactly one root, for every true
/// pair.
template <class R> PATCHRT_INLINE bool has_exactly_one(box_facts<R> const& facts) {
  auto const is_inward = [](combination<R> const& c) {
    R const reach = max(abs(c.middle_low), abs(c.middle_high)) + c.error + c.cross_slope / R(2);
    return rounded_up(reach) < c.least_slope / R(2);
  };
  return is_inward(facts.row[0]) && is_inward(facts.row[1]);
}

/// The part of [low, high] where c can be 0, by its slopes: empty (high < low) where there is none.
///
/// Not so thin that the error, which counts 2 K times in slopes, leaves none of them certain.
template <int K, class R> PATCHRT_HD void contract(combination<R> const& c, R& low, R& high) {
  if (!(c.least_slope > R(0))) return;
  R const open = rounded_up(c.error + c.cross_slope / R(2));
  R const d_low = c.least_slope, d_high = max(abs(c.slope_low), abs(c.slope_high));
  // -c(1/2) in units of the slope's sign
  R const from = (c.slope_low > R(0) ? -c.middle_high : c.middle_low) - open;
  R const to = (c.slope_low > R(0) ? -c.middle_low : c.middle_high) + open;
  R s_low = from / (from < R(0) ? d_low : d_high);
  R s_high = to / (to > R(0) ? d_low : d_high);
  R const eps = std::numeric_limits<R>::epsilon();
  R const spare = R(6 * K) * c.error / d_low;
  R const middle = (s_low + s_high) / R(2);
  s_low = R(0.5) + min(s_low - R(16) * eps * (abs(s_low) + R(1)), middle - spare);
  s_high = R(0.5) + max(s_high + R(16) * eps * (abs(s_high) + R(1)), middle + spare);
  R const width = high - low;
  R const slack = R(4) * eps * max(abs(low), abs(high));
  if (s_high < R(1)) high = min(high, grid_above(low + width * s_high + slack));
  if (s_low > R(0)) low = max(low, grid_below(low + width * s_low - slack));
  if (s_low > R(1) || s_high < R(0)) {
    low = R(1);
    high = R(0);
  }
}

}  // namespace patchrt::detail
