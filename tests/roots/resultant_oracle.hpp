// SPDX-License-Identifier: MIT
#pragma once

/// \file All common roots of two Bernstein polynomials by their resultant, in 600-bit arithmetic: no subdivision of the
/// square, no interval, nothing in common with what it is held against. For pairs without multiple roots.

#include <patchrt/roots/bernstein_pair.hpp>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <cstddef>
#include <utility>
#include <vector>

namespace patchrt::test {

using precise =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<600, boost::multiprecision::digit_base_2>,
                                  boost::multiprecision::et_off>;
using precise_vector = std::vector<precise>;

struct precise_root {
  precise u, v;
};

/// Two polynomials of degree (m, n), coefficient (i, j) at i (n + 1) + j.
struct precise_pair {
  int m, n;
  precise_vector f, g;
};

template <class T, int M, int N> precise_pair precisely(bernstein_pair<T, M, N> const& p) {
  precise_pair out{M, N, {}, {}};
  for (T const& x : p.f) out.f.emplace_back(x);
  for (T const& x : p.g) out.g.emplace_back(x);
  return out;
}

inline precise value(precise_vector b, precise const& t) {
  for (; b.size() > 1; b.pop_back()) {
    for (std::size_t k = 0; k + 1 < b.size(); ++k) b[k] += t * (b[k + 1] - b[k]);
  }
  return b[0];
}

inline precise binomial(int n, int k) {
  precise r = 1;
  for (int i = 0; i < k; ++i) r = r * (n - i) / (i + 1);
  return r;
}

class resultant_oracle {
 public:
  explicit resultant_oracle(precise_pair pair) : pair_(std::move(pair)) {}

  /// All roots with low <= u, v <= high.
  std::vector<precise_root> roots(precise const& low, precise const& high) const {
    std::vector<precise_root> found;
    precise_vector const r = resultant(low, high);
    std::vector<std::pair<precise, precise>> pieces;
    isolate(r, 0, 1, 0, pieces);
    for (auto const& [a, b] : pieces) {
      precise const u = low + (high - low) * root_between(r, a, b);
      precise const v = common_root(u);
      if (low <= v && v <= high) found.push_back({u, v});
    }
    return found;
  }

  /// f and g at (u, v).
  std::pair<precise, precise> values(precise const& u, precise const& v) const {
    return {value(row(pair_.f, u), v), value(row(pair_.g, u), v)};
  }

 private:
  precise_pair pair_;

  /// The coefficients in v at u.
  precise_vector row(precise_vector const& c, precise const& u) const {
    precise_vector out;
    for (int j = 0; j <= pair_.n; ++j) {
      precise_vector column;
      for (int i = 0; i <= pair_.m; ++i) column.push_back(c[std::size_t(i * (pair_.n + 1) + j)]);
      out.push_back(value(column, u));
    }
    return out;
  }

  /// Sylvester's matrix of f(u, .) and g(u, .) as polynomials in y = v / (1 - v): columns are y^(2n - 1) .. 1.
  std::vector<precise_vector> sylvester(precise const& u) const {
    auto const n = std::size_t(pair_.n);
    std::vector<precise_vector> s(2 * n, precise_vector(2 * n, precise(0)));
    precise_vector const f = row(pair_.f, u), g = row(pair_.g, u);
    for (std::size_t k = 0; k < n; ++k) {
      for (std::size_t l = 0; l <= n; ++l) {
        precise const b = binomial(pair_.n, int(l));
        s[k][k + n - l] = b * f[l];
        s[n + k][k + n - l] = b * g[l];
      }
    }
    return s;
  }

  /// Gaussian elimination with complete pivoting; order[k] is the column of pivot k. Returns the determinant.
  static precise eliminate(std::vector<precise_vector>& a, std::vector<std::size_t>& order) {
    std::size_t const n = a.size();
    precise det = 1;
    order.resize(n);
    for (std::size_t k = 0; k < n; ++k) order[k] = k;
    for (std::size_t k = 0; k < n; ++k) {
      std::size_t p = k, q = k;
      for (std::size_t i = k; i < n; ++i) {
        for (std::size_t j = k; j < n; ++j) {
          if (abs(a[i][j]) > abs(a[p][q])) p = i, q = j;
        }
      }
      if (p != k) std::swap(a[p], a[k]), det = -det;
      if (q != k) {
        for (precise_vector& line : a) std::swap(line[q], line[k]);
        std::swap(order[q], order[k]);
        det = -det;
      }
      det *= a[k][k];
      if (a[k][k] == 0) return 0;
      for (std::size_t i = k + 1; i < n; ++i) {
        precise const factor = a[i][k] / a[k][k];
        for (std::size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
      }
    }
    return det;
  }

  /// The resultant by v as a polynomial in u, in Bernstein form on [low, high]: interpolated, by divided differences.
  precise_vector resultant(precise const& low, precise const& high) const {
    int const degree = 2 * pair_.m * pair_.n;
    precise_vector d;
    for (int k = 0; k <= degree; ++k) {
      auto s = sylvester(low + (high - low) * k / degree);
      std::vector<std::size_t> order;
      d.push_back(eliminate(s, order));
    }
    for (int level = 1; level <= degree; ++level) {
      for (int k = degree; k >= level; --k) {
        d[std::size_t(k)] = (d[std::size_t(k)] - d[std::size_t(k) - 1]) * degree / level;
      }
    }
    precise_vector powers(1, d.back());  // Horner's rule over the nodes k / degree
    for (int k = degree - 1; k >= 0; --k) {
      precise const node = precise(k) / degree;
      powers.push_back(0);
      for (std::size_t i = powers.size() - 1; i > 0; --i) powers[i] = powers[i - 1] - node * powers[i];
      powers[0] = d[std::size_t(k)] - node * powers[0];
    }
    precise_vector out;
    for (int i = 0; i <= degree; ++i) {
      precise sum = 0;
      for (int k = 0; k <= i; ++k) sum += binomial(i, k) / binomial(degree, k) * powers[std::size_t(k)];
      out.push_back(sum);
    }
    return out;
  }

  /// Descartes' rule: parts of [0, 1] with one root each.
  static void isolate(precise_vector const& b, precise const& low, precise const& high, int depth,
                      std::vector<std::pair<precise, precise>>& pieces) {
    int changes = 0;
    for (std::size_t k = 0; k + 1 < b.size(); ++k) changes += (b[k] < 0) != (b[k + 1] < 0);
    if (changes == 0 || depth > 150) return;
    if (changes == 1) return pieces.emplace_back(low, high), void();
    precise_vector left, right(b), w(b);
    for (std::size_t n = b.size(); n > 0; --n) {
      left.push_back(w[0]);
      right[n - 1] = w[n - 1];
      for (std::size_t k = 0; k + 1 < n; ++k) w[k] = (w[k] + w[k + 1]) / 2;
    }
    precise const middle = (low + high) / 2;
    isolate(left, low, middle, depth + 1, pieces);
    isolate(right, middle, high, depth + 1, pieces);
  }

  /// By bisection, then the secant's.
  static precise root_between(precise_vector b, precise low, precise high) {
    int const degree = int(b.size()) - 1;
    for (int k = 0; k <= degree; ++k) b[std::size_t(k)] *= binomial(degree, k);
    auto const at = [&](precise const& t) {
      precise const rest = 1 - t;
      precise sum = b[0], power = t;
      for (std::size_t k = 1; k < b.size(); ++k, power *= t) sum = sum * rest + b[k] * power;
      return sum;
    };
    bool const rises = at(low) < 0;
    for (int n = 0; n < 30; ++n) {
      precise const middle = (low + high) / 2;
      ((at(middle) < 0) == rises ? low : high) = middle;
    }
    precise x = low, y = high, at_x = at(x), at_y = at(y);
    for (int n = 0; n < 8 && at_x != at_y; ++n) {
      precise const next = y - at_y * (y - x) / (at_y - at_x);
      x = y, at_x = at_y;
      y = next, at_y = at(y);
    }
    return y;
  }

  /// The common root of f(u, .) and g(u, .), from the vector that Sylvester's matrix takes to 0.
  precise common_root(precise const& u) const {
    auto s = sylvester(u);
    std::vector<std::size_t> order;
    (void)eliminate(s, order);
    std::size_t const n = s.size();
    precise_vector x(n), y(n);
    x[n - 1] = 1;
    for (std::size_t k = n - 1; k-- > 0;) {
      precise sum = 0;
      for (std::size_t j = k + 1; j < n; ++j) sum += s[k][j] * x[j];
      x[k] = -sum / s[k][k];
    }
    for (std::size_t k = 0; k < n; ++k) y[order[k]] = x[k];
    // The two neighbouring powers that are largest.
    bool const is_low = abs(y[n - 1]) > abs(y[0]);
    precise const above = is_low ? y[n - 2] : y[0], below = is_low ? y[n - 1] : y[1];
    return above / (above + below);
  }
};

}  // namespace patchrt::test
