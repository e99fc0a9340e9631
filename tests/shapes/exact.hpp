// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Bezier patches in rational arithmetic: what floating point is held against.

#include <patchrt/shapes/bezier_patch.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace patchrt::test {

using rational = boost::multiprecision::cpp_rational;
using exact_point = std::array<rational, 3>;

template <class T> exact_point exactly(vec3<T> const& p) { return {rational(p.x), rational(p.y), rational(p.z)}; }

inline exact_point operator-(exact_point const& a, exact_point const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline exact_point operator*(rational const& s, exact_point const& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline exact_point lerp(exact_point const& a, exact_point const& b, rational const& t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}
inline exact_point cross(exact_point const& a, exact_point const& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline rational largest(exact_point const& a) {
  rational m = 0;
  for (rational const& x : a) m = std::max(m, rational(abs(x)));
  return m;
}

/// A patch of degree (m, n): point (i, j) at i (n + 1) + j.
struct exact_patch {
  int m;
  int n;
  std::vector<exact_point> points;
  exact_point& operator()(int i, int j) { return points[std::size_t(i * (n + 1) + j)]; }
  exact_point const& operator()(int i, int j) const { return points[std::size_t(i * (n + 1) + j)]; }
};

template <class T, int M, int N> exact_patch exactly(bezier_patch<T, M, N> const& p) {
  exact_patch e{M, N, {}};
  for (auto const& c : p.control_points) e.points.push_back(exactly(c));
  return e;
}

/// dQ/du of degree (m - 1, n).
inline exact_patch derivative_u(exact_patch const& p) {
  if (p.m == 0) return {0, p.n, std::vector<exact_point>(std::size_t(p.n) + 1)};
  exact_patch d{p.m - 1, p.n, std::vector<exact_point>(std::size_t(p.m * (p.n + 1)))};
  for (int i = 0; i < p.m; ++i) {
    for (int j = 0; j <= p.n; ++j) d(i, j) = rational(p.m) * (p(i + 1, j) - p(i, j));
  }
  return d;
}

inline exact_patch transposed(exact_patch const& p) {
  exact_patch t{p.n, p.m, std::vector<exact_point>(p.points.size())};
  for (int i = 0; i <= p.m; ++i) {
    for (int j = 0; j <= p.n; ++j) t(j, i) = p(i, j);
  }
  return t;
}

inline exact_patch derivative_v(exact_patch const& p) { return transposed(derivative_u(transposed(p))); }

/// The part a <= u <= b: point i is the blossom at m - i times a and i times b.
inline exact_patch part_u(exact_patch const& p, rational const& a, rational const& b) {
  exact_patch out = p;
  for (int j = 0; j <= p.n; ++j) {
    for (int i = 0; i <= p.m; ++i) {
      std::vector<exact_point> w;
      for (int k = 0; k <= p.m; ++k) w.push_back(p(k, j));
      for (int level = 0; level < p.m; ++level) {
        for (std::size_t k = 0; k + 1 < w.size(); ++k) w[k] = lerp(w[k], w[k + 1], level < i ? b : a);
        w.pop_back();
      }
      out(i, j) = w[0];
    }
  }
  return out;
}

inline exact_patch part_v(exact_patch const& p, rational const& a, rational const& b) {
  return transposed(part_u(transposed(p), a, b));
}

/// Q(u, v), by de Casteljau's algorithm.
inline exact_point value(exact_patch const& p, rational const& u, rational const& v) {
  std::vector<exact_point> column;
  for (int i = 0; i <= p.m; ++i) {
    std::vector<exact_point> row(p.points.begin() + i * (p.n + 1), p.points.begin() + (i + 1) * (p.n + 1));
    for (; row.size() > 1; row.pop_back()) {
      for (std::size_t k = 0; k + 1 < row.size(); ++k) row[k] = lerp(row[k], row[k + 1], v);
    }
    column.push_back(row[0]);
  }
  for (; column.size() > 1; column.pop_back()) {
    for (std::size_t k = 0; k + 1 < column.size(); ++k) column[k] = lerp(column[k], column[k + 1], u);
  }
  return column[0];
}

template <class T, int M, int N> T largest_coordinate(bezier_patch<T, M, N> const& p) {
  T m = 0;
  for (auto const& c : p.control_points) m = max(m, max(abs(c.x), max(abs(c.y), abs(c.z))));
  return m;
}

/// n eps / (2 - n eps): Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 3.1.
template <class T> rational gamma_of(int n) {
  rational const e = rational(n) * rational(std::numeric_limits<T>::epsilon());
  return e / (2 - e);
}

}  // namespace patchrt::test
