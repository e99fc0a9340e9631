// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rational Bezier patches in rational arithmetic: what floating point is held against.

#include "exact.hpp"

#include <patchrt/shapes/rational_patch.hpp>

#include <cmath>
#include <random>

namespace patchrt::test {

/// Q as a quotient of two polynomials: points w p, and w as the first coordinate.
struct exact_quotient {
  exact_patch top;
  exact_patch bottom;
};

template <class T, int M, int N> exact_quotient exactly(rational_patch<T, M, N> const& p) {
  exact_quotient e{{M, N, {}}, {M, N, {}}};
  for (std::size_t k = 0; k < std::size_t((M + 1) * (N + 1)); ++k) {
    rational const w(p.control_points[k].weight);
    e.top.points.push_back(w * exactly(p.control_points[k].point));
    e.bottom.points.push_back({w, 0, 0});
  }
  return e;
}

inline exact_point value(exact_quotient const& q, rational const& u, rational const& v) {
  return 1 / value(q.bottom, u, v)[0] * value(q.top, u, v);
}

inline exact_quotient transposed(exact_quotient const& q) { return {transposed(q.top), transposed(q.bottom)}; }
inline exact_quotient part_u(exact_quotient const& q, rational const& a, rational const& b) {
  return {part_u(q.top, a, b), part_u(q.bottom, a, b)};
}
inline exact_quotient part_v(exact_quotient const& q, rational const& a, rational const& b) {
  return {part_v(q.top, a, b), part_v(q.bottom, a, b)};
}

/// dQ/du by the quotient rule.
inline exact_point slope_u(exact_quotient const& q, rational const& u, rational const& v) {
  rational const w = value(q.bottom, u, v)[0], w_u = value(derivative_u(q.bottom), u, v)[0];
  return 1 / w * (value(derivative_u(q.top), u, v) - w_u * value(q, u, v));
}
inline exact_point slope_v(exact_quotient const& q, rational const& u, rational const& v) {
  return slope_u(transposed(q), v, u);
}

/// The same surface by control points of degree m + 1 in u.
inline exact_patch raised_u(exact_patch const& p) {
  exact_patch r{p.m + 1, p.n, std::vector<exact_point>(std::size_t((p.m + 2) * (p.n + 1)))};
  for (int i = 0; i <= p.m + 1; ++i) {
    for (int j = 0; j <= p.n; ++j)
      r(i, j) = lerp(p(std::min(i, p.m), j), p(std::max(i - 1, 0), j), rational(i, p.m + 1));
  }
  return r;
}

/// Degree (m, n) instead.
inline exact_patch raised(exact_patch p, int m, int n) {
  while (p.m < m) p = raised_u(p);
  for (p = transposed(p); p.m < n;) p = raised_u(p);
  return transposed(p);
}
inline exact_quotient raised(exact_quotient const& q, int m, int n) {
  return {raised(q.top, m, n), raised(q.bottom, m, n)};
}

/// The largest errors of control points over `point_bound`, and of weights over `weight_bound` times themselves.
template <class T, int M, int N>
double error_ratio(rational_patch<T, M, N> const& got, exact_quotient const& wanted, rational const& point_bound,
                   rational const& weight_bound) {
  rational worst = 0;
  for (int i = 0; i <= M; ++i) {
    for (int j = 0; j <= N; ++j) {
      rational const w = wanted.bottom(i, j)[0];
      worst = std::max(worst, rational(largest(exactly(got(i, j).point) - 1 / w * wanted.top(i, j)) / point_bound));
      worst = std::max(worst, rational(abs(rational(got(i, j).weight) - w) / w / weight_bound));
    }
  }
  return static_cast<double>(worst);
}

/// Control points anywhere in [-1, 1]^3 and weights of 2^-spread to 2^spread.
template <class T, int M, int N, class Generator> rational_patch<T, M, N> random_rational(Generator& g, double spread) {
  std::uniform_real_distribution<double> d(-1, 1);
  rational_patch<T, M, N> p;
  for (auto& [point, weight] : p.control_points) {
    point.x = T(d(g));
    point.y = T(d(g));
    point.z = T(d(g));
    weight = T(std::exp2(spread * d(g)));
  }
  return p;
}

template <class T> bool is_same(weighted_point<T> const& a, weighted_point<T> const& b) {
  return a.point == b.point && a.weight == b.weight;
}

template <class T, int M, int N> bool is_same(rational_patch<T, M, N> const& a, rational_patch<T, M, N> const& b) {
  return std::equal(std::begin(a.control_points), std::end(a.control_points), std::begin(b.control_points),
                    [](auto const& x, auto const& y) { return is_same(x, y); });
}

/// The control points without their weights.
template <class T, int M, int N> bezier_patch<T, M, N> points_of(rational_patch<T, M, N> const& p) {
  bezier_patch<T, M, N> q;
  for (std::size_t k = 0; k < std::size_t((M + 1) * (N + 1)); ++k) q.control_points[k] = p.control_points[k].point;
  return q;
}

template <class T> struct weight_range {
  T least;
  T largest;
};

template <class T, int M, int N> weight_range<T> weights_of(rational_patch<T, M, N> const& p) {
  weight_range<T> r{p(0, 0).weight, p(0, 0).weight};
  for (auto const& c : p.control_points) r = {std::min(r.least, c.weight), std::max(r.largest, c.weight)};
  return r;
}

}  // namespace patchrt::test
