// SPDX-License-Identifier: MIT
#pragma once

/// \file Polynomials in u and v with rational coefficients, and pairs of them in Bernstein form: exactly, or with the
/// error that rounding the coefficients made.

#include <patchrt/roots/bernstein_pair.hpp>
#include <patchrt/roots/isolation.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

namespace patchrt::test {

using rational = boost::multiprecision::cpp_rational;

/// c[k][l] is the coefficient of u^k v^l.
struct polynomial {
  std::vector<std::vector<rational>> c;

  polynomial(rational const& constant = 0) : c{{constant}} {}   // NOLINT(google-explicit-constructor)
  polynomial(int constant) : polynomial(rational(constant)) {}  // NOLINT(google-explicit-constructor)
  rational at(std::size_t k, std::size_t l) const { return k < c.size() && l < c[k].size() ? c[k][l] : rational(0); }
  std::size_t degree_u() const { return c.size() - 1; }
  std::size_t degree_v() const { return c[0].size() - 1; }
  rational operator()(rational const& u, rational const& v) const {
    rational sum = 0;
    for (std::size_t k = c.size(); k-- > 0;) {
      rational row = 0;
      for (std::size_t l = c[k].size(); l-- > 0;) row = row * v + c[k][l];
      sum = sum * u + row;
    }
    return sum;
  }
};

inline polynomial zeros(std::size_t degree_u, std::size_t degree_v) {
  polynomial p;
  p.c.assign(degree_u + 1, std::vector<rational>(degree_v + 1, rational(0)));
  return p;
}
inline polynomial operator+(polynomial const& a, polynomial const& b) {
  polynomial s = zeros(std::max(a.degree_u(), b.degree_u()), std::max(a.degree_v(), b.degree_v()));
  for (std::size_t k = 0; k < s.c.size(); ++k) {
    for (std::size_t l = 0; l < s.c[k].size(); ++l) s.c[k][l] = a.at(k, l) + b.at(k, l);
  }
  return s;
}
inline polynomial operator*(polynomial const& a, polynomial const& b) {
  polynomial p = zeros(a.degree_u() + b.degree_u(), a.degree_v() + b.degree_v());
  for (std::size_t k = 0; k < a.c.size(); ++k) {
    for (std::size_t l = 0; l < a.c[k].size(); ++l) {
      for (std::size_t i = 0; i < b.c.size(); ++i) {
        for (std::size_t j = 0; j < b.c[i].size(); ++j) p.c[k + i][l + j] += a.c[k][l] * b.c[i][j];
      }
    }
  }
  return p;
}
inline polynomial operator-(polynomial const& a, polynomial const& b) { return a + polynomial(-1) * b; }

inline polynomial in_u() {
  polynomial p = zeros(1, 0);
  p.c[1][0] = 1;
  return p;
}
inline polynomial in_v() {
  polynomial p = zeros(0, 1);
  p.c[0][1] = 1;
  return p;
}
inline rational two_to(int k) {
  boost::multiprecision::cpp_int const one = 1;
  return k >= 0 ? rational(one << k) : rational(1, one << -k);
}

inline rational rational_binomial(std::size_t n, std::size_t k) {
  rational r = 1;
  for (std::size_t i = 0; i < k; ++i) r = r * (n - i) / (i + 1);
  return r;
}

/// The nearest coefficients of degree (M, N), and how far the farthest is off.
template <int M, int N, class T> T to_bernstein(polynomial const& p, T (&out)[(M + 1) * (N + 1)]) {
  rational worst = 0;
  for (std::size_t i = 0; i <= M; ++i) {
    for (std::size_t j = 0; j <= N; ++j) {
      rational b = 0;
      for (std::size_t k = 0; k <= i; ++k) {
        for (std::size_t l = 0; l <= j; ++l) {
          b += p.at(k, l) * rational_binomial(i, k) / rational_binomial(M, k) * rational_binomial(j, l) /
               rational_binomial(N, l);
        }
      }
      T& x = out[i * (N + 1) + j];
      x = static_cast<T>(b);
      worst = std::max(worst, rational(abs(b - rational(x))));
    }
  }
  T error = static_cast<T>(worst);
  return rational(error) < worst ? error * (1 + std::numeric_limits<T>::epsilon()) : error;
}

template <class T, int M = 3, int N = 3> bernstein_pair<T, M, N> pair_of(polynomial const& f, polynomial const& g) {
  bernstein_pair<T, M, N> p;
  p.error_f = to_bernstein<M, N>(f, p.f);
  p.error_g = to_bernstein<M, N>(g, p.g);
  return p;
}

/// How many of the boxes of a kind hold the point.
template <class T, int C>
int boxes_with(isolation<T, C> const& found, rational const& u, rational const& v, root_kind kind) {
  int n = 0;
  for (int k = 0; k < found.count; ++k) {
    auto const& r = found.roots[k];
    n += r.kind == kind && abs(u - rational(r.u)) <= rational(r.radius_u) &&
         abs(v - rational(r.v)) <= rational(r.radius_v);
  }
  return n;
}
template <class T, int C> int count_of(isolation<T, C> const& found, root_kind kind) {
  int n = 0;
  for (int k = 0; k < found.count; ++k) n += found.roots[k].kind == kind;
  return n;
}

}  // namespace patchrt::test
