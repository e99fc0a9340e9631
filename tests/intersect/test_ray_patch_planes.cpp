// SPDX-License-Identifier: MIT
#include "intersect/plane_functions.hpp"
#include "shapes/exact.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <cstring>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class T> struct plane_case {
  power_patch<T> patch;
  vec3<T> origin, n1, n2;
};

template <class T, class Generator> vec3<T> random_vector(Generator& g, double size) {
  std::uniform_real_distribution<double> d(-size, size);
  T const x = T(d(g)), y = T(d(g)), z = T(d(g));
  return {x, y, z};
}

/// Patches near and far, origins on the patch and off it, normals of any lengths.
template <class T, class Generator> plane_case<T> random_case(Generator& g, int n) {
  auto p = random_patch<T>(g);
  for (auto& c : p.control_points) c += vec3<T>{T(n % 3), T(0), T(-n % 5)};
  plane_case<T> c{to_power(p), {}, random_vector<T>(g, std::ldexp(1., n % 5 - 2)), random_vector<T>(g, 1)};
  c.origin = n % 2 ? random_vector<T>(g, 4) : position(c.patch, T(0.3), T(-0.7));
  return c;
}

/// normal . S in powers, and sum_c |normal_c S_c| for its rounding.
template <class T> bicubic<rational> exact_plane(power_patch<T> const& p, vec3<T> const& normal, bool magnitudes) {
  bicubic<rational> f;
  for (std::size_t k = 0; k < 16; ++k) {
    for (int a = 0; a < 3; ++a) {
      rational const term = rational(normal[a]) * rational(p.coefficients[k][a]);
      f.c[k] += magnitudes ? rational(abs(term)) : term;
    }
  }
  return f;
}

template <class T> rational exact_dot(vec3<T> const& a, vec3<T> const& b, bool magnitudes) {
  rational s = 0;
  for (int k = 0; k < 3; ++k) {
    rational const term = rational(a[k]) * rational(b[k]);
    s += magnitudes ? rational(abs(term)) : term;
  }
  return s;
}

double ratio(double got, rational const& wanted, rational const& bound) {
  return static_cast<double>(rational(abs(rational(got) - wanted) / bound));
}

/// The worst ratios of errors of value and derivatives to 11 and 12 roundings of the terms' magnitudes.
struct worst_ratios {
  double value = 0, slope = 0;

  template <class T>
  void add(plane_case<T> const& c, vec3<T> const& normal, T x, T y, double value_got, double by_x, double by_y) {
    bicubic<rational> f = exact_plane(c.patch, normal, false), m = exact_plane(c.patch, normal, true);
    f.c[0] -= exact_dot(normal, c.origin, false);
    m.c[0] += exact_dot(normal, c.origin, true);
    rational const rx(x), ry(y);
    value = std::max(value, ratio(value_got, f(rx, ry), gamma_of<T>(11) * m.magnitude()));
    slope = std::max({slope, ratio(by_x, f(rx, ry, 1, 0), gamma_of<T>(12) * m.magnitude(1, 0)),
                      ratio(by_y, f(rx, ry, 0, 1), gamma_of<T>(12) * m.magnitude(0, 1))});
  }
};

template <class T> bool is_same(T a, T b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

TEMPLATE_TEST_CASE("the plane functions and their derivatives are within 12 roundings of n . (S - origin)", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 330;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  worst_ratios worst;
  for (int n = 0; n < 60; ++n) {
    auto const c = random_case<T>(g, n);
    auto const p = project(c.patch, sum(coefficient_sum(c.patch), absolute(c.origin)), c.origin, c.n1, c.n2);
    for (int k = 0; k < 4; ++k) {
      T const x = k == 0 ? T(-1) : T(d(g)), y = k == 1 ? T(1) : T(d(g));
      bivariate<T> const b = evaluate(p, x, y);
      worst.add(c, c.n1, x, y, double(b.f), double(b.fx), double(b.fy));
      worst.add(c, c.n2, x, y, double(b.g), double(b.gx), double(b.gy));
    }
  }
  CAPTURE(worst.value, worst.slope);
  CHECK(worst.value <= 1);
  CHECK(worst.slope <= 1);
  CHECK(worst.value > 0.02);
  CHECK(worst.slope > 0.02);
}

TEMPLATE_TEST_CASE("the plane functions of small integers are exact", "", float, double) {
  using T = TestType;
  unsigned const seed = 331;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_int_distribution<int> d(-7, 7);
  for (int n = 0; n < 40; ++n) {
    plane_case<T> c;
    for (vec3<T>* const v : {&c.origin, &c.n1, &c.n2}) *v = {T(d(g)), T(d(g)), T(d(g))};
    for (auto& v : c.patch.coefficients) v = {T(d(g)), T(d(g)), T(d(g))};
    auto const p = project(c.patch, sum(coefficient_sum(c.patch), absolute(c.origin)), c.origin, c.n1, c.n2);
    bicubic<rational> f = exact_plane(c.patch, c.n1, false), h = exact_plane(c.patch, c.n2, false);
    f.c[0] -= exact_dot(c.n1, c.origin, false);
    h.c[0] -= exact_dot(c.n2, c.origin, false);
    for (int i = -2; i <= 2; ++i) {
      T const x = T(i) / 2, y = T(d(g)) / 4;
      rational const rx(x), ry(y);
      bivariate<T> const b = evaluate(p, x, y);
      REQUIRE((b.f == f(rx, ry) && b.fx == f(rx, ry, 1, 0) && b.fy == f(rx, ry, 0, 1)));
      REQUIRE((b.g == h(rx, ry) && b.gx == h(rx, ry, 1, 0) && b.gy == h(rx, ry, 0, 1)));
    }
  }
}

TEMPLATE_TEST_CASE("every lane of a pack has the plane functions of the scalar", "", (pack<float, 8>),
                   (pack<float, 16>), (pack<double, 8>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int lanes = lanes_v<P>;
  unsigned const seed = 332;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  for (int n = 0; n < 100; ++n) {
    plane_case<T> one[lanes];
    T numbers[11][lanes];
    for (int i = 0; i < lanes; ++i) {
      one[i] = random_case<T>(g, n + i);
      one[i].patch = one[0].patch;
      for (int a = 0; a < 3; ++a) {
        numbers[a][i] = one[i].origin[a];
        numbers[3 + a][i] = one[i].n1[a];
        numbers[6 + a][i] = one[i].n2[a];
      }
      numbers[9][i] = T(d(g));
      numbers[10][i] = T(d(g));
    }
    auto const vector = [&](int k) {
      return vec3<P>{P::load(numbers[k]), P::load(numbers[k + 1]), P::load(numbers[k + 2])};
    };
    auto const reach = coefficient_sum(one[0].patch);
    auto const p = project(one[0].patch, reach, vector(0), vector(3), vector(6));
    bivariate<P> const b = evaluate(p, P::load(numbers[9]), P::load(numbers[10]));
    for (int i = 0; i < lanes; ++i) {
      auto const q = project(one[i].patch, reach, one[i].origin, one[i].n1, one[i].n2);
      bivariate<T> const e = evaluate(q, numbers[9][i], numbers[10][i]);
      for (int k = 0; k < 16; ++k) REQUIRE((is_same(p.f[k][i], q.f[k]) && is_same(p.g[k][i], q.g[k])));
      REQUIRE((is_same(b.f[i], e.f) && is_same(b.fx[i], e.fx) && is_same(b.fy[i], e.fy)));
      REQUIRE((is_same(b.g[i], e.g) && is_same(b.gx[i], e.gx) && is_same(b.gy[i], e.gy)));
      REQUIRE((is_same(p.rounding_f[i], q.rounding_f) && is_same(p.rounding_g[i], q.rounding_g)));
    }
  }
}
