// SPDX-License-Identifier: MIT
#include "exact.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>
#include <patchrt/shapes/power_patch.hpp>

#include <cmath>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// The four Bernstein polynomials of degree 3 in u = (1 + x) / 2, in powers of x: row k has the factors of x^k.
rational power_weight(int k, int i) {
  static int const eighths[4][4] = {{1, 3, 3, 1}, {-3, -3, 3, 3}, {3, -3, -3, 3}, {-1, 3, -3, 1}};
  return rational(eighths[k][i], 8);
}

/// Patches of several sizes, some far from the origin.
template <class T, class Generator> bicubic_patch<T> any_patch(Generator& g, int n) {
  auto p = random_patch<T>(g);
  for (auto& c : p.control_points) c = T(std::ldexp(1, n % 9 - 4)) * c + vec3<T>{T(n % 3), T(0), T(-n % 5)};
  return p;
}

/// sum c_kl x^k y^l, power by power; with |c_kl| where `magnitude`.
template <class T>
exact_point polynomial(power_patch<T> const& q, rational const& x, rational const& y, bool magnitude) {
  exact_point s{};
  rational xk = 1;
  for (int k = 0; k < 4; ++k, xk *= x) {
    rational yl = 1;
    for (int l = 0; l < 4; ++l, yl *= y) {
      exact_point c = exactly(q.coefficients[4 * k + l]);
      for (std::size_t a = 0; a < 3; ++a) s[a] += magnitude ? rational(abs(c[a])) : rational(c[a] * xk * yl);
    }
  }
  return s;
}

template <class T> T random_parameter(std::mt19937& g, int n) {
  std::uniform_real_distribution<double> d(-1, 1);
  return n == 0 ? T(-1) : n == 1 ? T(1) : n == 2 ? T(0) : T(d(g));
}

}  // namespace

TEMPLATE_TEST_CASE("the power form's coefficients are within their stated bound of the exact ones", "", float, double) {
  using T = TestType;
  unsigned const seed = 320;
  CAPTURE(seed);
  std::mt19937 g(seed);
  rational const weight[4] = {1, rational(3, 2), rational(3, 2), 1};
  double worst = 0;
  for (int n = 0; n < 60; ++n) {
    auto const p = any_patch<T>(g, n);
    auto const q = to_power(p);
    rational const size(largest_coordinate(p));
    for (int k = 0; k < 4; ++k) {
      for (int l = 0; l < 4; ++l) {
        exact_point wanted{};
        for (int i = 0; i < 4; ++i) {
          for (int j = 0; j < 4; ++j) {
            exact_point const c = power_weight(k, i) * power_weight(l, j) * exactly(p(i, j));
            for (std::size_t a = 0; a < 3; ++a) wanted[a] += c[a];
          }
        }
        exact_point const got = exactly(q.coefficients[4 * k + l]);
        rational const most = weight[k] * weight[l] * size;
        REQUIRE(largest(got) <= most * (1 + gamma_of<T>(8)));
        worst = std::max(worst, static_cast<double>(rational(largest(got - wanted) / (gamma_of<T>(8) * most))));
      }
    }
  }
  CAPTURE(worst);
  CHECK(worst <= 1);
  CHECK(worst > 0.05);
}

TEMPLATE_TEST_CASE("the power form of a patch of small integers is exact: the same surface to the last bit", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 321;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_int_distribution<int> d(-15, 15);
  for (int n = 0; n < 20; ++n) {
    bicubic_patch<T> p;
    for (auto& c : p.control_points) c = {T(d(g)), T(d(g)), T(d(g))};
    auto const q = to_power(p);
    exact_patch const e = exactly(p);
    for (int i = 0; i <= 4; ++i) {
      for (int j = 0; j <= 4; ++j) {
        T const x = T(i) / 2 - 1, y = T(j) / 2 - 1;
        REQUIRE(exactly(position(q, x, y)) == value(e, rational(i, 4), rational(j, 4)));
      }
    }
  }
}

TEMPLATE_TEST_CASE("a point in powers is within its stated bound of rational arithmetic", "", float, double) {
  using T = TestType;
  unsigned const seed = 322;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst_of_horner = 0, worst_of_both = 0;
  for (int n = 0; n < 40; ++n) {
    auto const p = any_patch<T>(g, n);
    auto const q = to_power(p);
    exact_patch const e = exactly(p);
    exact_point const magnitude = polynomial(q, rational(1), rational(1), true);
    rational const whole = rational(25) * gamma_of<T>(13) * rational(largest_coordinate(p));
    for (int k = 0; k < 9; ++k) {
      T const x = random_parameter<T>(g, k / 3), y = random_parameter<T>(g, k % 3);
      rational const rx(x), ry(y);
      exact_point const got = exactly(position(q, x, y));
      exact_point const off = got - polynomial(q, rx, ry, false);
      for (std::size_t a = 0; a < 3; ++a) {
        rational const bound = gamma_of<T>(7) * magnitude[a];
        worst_of_horner = std::max(worst_of_horner, static_cast<double>(rational(abs(off[a]) / bound)));
      }
      exact_point const surface = value(e, (1 + rx) / 2, (1 + ry) / 2);
      worst_of_both = std::max(worst_of_both, static_cast<double>(rational(largest(got - surface) / whole)));
    }
  }
  CAPTURE(worst_of_horner, worst_of_both);
  CHECK(worst_of_horner <= 1);
  CHECK(worst_of_horner > 0.05);
  CHECK(worst_of_both <= 1);
  CHECK(worst_of_both > 0.005);
}

TEMPLATE_TEST_CASE("a point alone has the bits of the point with its tangents", "", float, double, (pack<float, 16>),
                   (pack<double, 8>)) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  unsigned const seed = 323;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-0.1, 1.1);
  for (int n = 0; n < 500; ++n) {
    auto const p = any_patch<L>(g, n);
    L u[lanes], v[lanes];
    for (int i = 0; i < lanes; ++i) {
      u[i] = n % 7 == 0 ? L(i % 2) : L(d(g));
      v[i] = n % 5 == 0 ? L(i / 2 % 2) : L(d(g));
    }
    T uu(u[0]), vv(v[0]);
    if constexpr (lanes > 1) {
      uu = T::load(u);
      vv = T::load(v);
    }
    vec3<T> const alone = position(p, uu, vv), together = evaluate(p, uu, vv).position;
    for (int a = 0; a < 3; ++a) REQUIRE(all_of(component(alone, a) == component(together, a)));
  }
}

TEMPLATE_TEST_CASE("every lane of a pack has the point in powers of the scalar", "", (pack<float, 8>),
                   (pack<float, 16>), (pack<double, 8>)) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  unsigned const seed = 324;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 300; ++n) {
    auto const q = to_power(any_patch<L>(g, n));
    L x[lanes], y[lanes];
    for (int i = 0; i < lanes; ++i) {
      x[i] = random_parameter<L>(g, i);
      y[i] = random_parameter<L>(g, lanes - i);
    }
    auto const s = position(q, T::load(x), T::load(y));
    for (int i = 0; i < lanes; ++i) {
      vec3<L> const one = position(q, x[i], y[i]);
      REQUIRE((s.x[i] == one.x && s.y[i] == one.y && s.z[i] == one.z));
    }
  }
}

TEST_CASE("a power form in float evaluates in double as its widened coefficients do") {
  unsigned const seed = 325;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const q = to_power(any_patch<float>(g, 3));
  power_patch<double> wide;
  for (int k = 0; k < 16; ++k) wide.coefficients[k] = convert_vec<double>(q.coefficients[k]);
  for (int n = 0; n < 100; ++n) {
    double const x = random_parameter<double>(g, n), y = random_parameter<double>(g, n / 3);
    REQUIRE(position(q, x, y) == position(wide, x, y));
  }
}
