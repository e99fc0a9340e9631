// SPDX-License-Identifier: MIT
#include "shapes/exact.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/two_float.hpp>
#include <patchrt/roots/newton.hpp>

#include <algorithm>
#include <limits>
#include <random>
#include <tuple>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class T> rational exactly(two_float<T> a) { return rational(a.hi) + rational(a.lo); }

/// |got - (ab - cd)| as a part of 15 u^2 |ab - cd| + 96 u^4 |cd|, which bounds it.
template <class T> double error_of_difference(two_float<T> got, rational const& ab, rational const& cd) {
  rational const u = rational(std::numeric_limits<T>::epsilon()) / 2;
  rational const exact = ab - cd, bound = u * u * (15 * abs(exact) + 96 * u * u * abs(cd));
  return bound == 0 ? 0 : static_cast<double>(rational(abs(rational(exactly(got) - exact)) / bound));
}

/// Random numbers of some twenty binades, both words full.
template <class T, class Generator> two_float<T> spread(Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  std::uniform_int_distribution<int> e(-10, 10);
  T const hi = T(std::ldexp(d(g), e(g)));
  auto const sum = fast_two_sum(hi, hi * std::numeric_limits<T>::epsilon() * T(d(g)));
  return {sum.value, sum.error};
}

}  // namespace

TEMPLATE_TEST_CASE("difference_of_products of two words holds its bound where the products cancel", "", float, double) {
  using F = two_float<TestType>;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst = 0;
  for (int n = 0; n < 4000; ++n) {
    F const a = spread<TestType>(g), b = spread<TestType>(g), c = spread<TestType>(g);
    F const quotient = a * b / c;  // cancels all but the last bits of two words
    F const d = n % 2 ? spread<TestType>(g) : quotient;
    worst = std::max(worst, error_of_difference(difference_of_products(a, b, c, d), exactly(a) * exactly(b),
                                                exactly(c) * exactly(d)));
    vec3<F> const product = cross(vec3<F>{a, b, c}, vec3<F>{d, c, b});
    worst = std::max(worst, error_of_difference(product.x, exactly(b) * exactly(b), exactly(c) * exactly(c)));
    worst = std::max(worst, error_of_difference(product.z, exactly(a) * exactly(c), exactly(b) * exactly(d)));
  }
  CAPTURE(worst);
  CHECK(worst <= 1);
  CHECK(worst > 0.1);
}

TEMPLATE_TEST_CASE("patches are evaluated in two words to the bound that evaluate states", "", float, double) {
  using F = two_float<TestType>;
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  rational const gamma = 18 * exactly(std::numeric_limits<F>::epsilon()) / 2;
  double worst = 0;
  for (int n = 0; n < 200; ++n) {
    auto const patch = random_patch<double>(g);
    auto const exact = test::exactly(patch);
    F const u = F(unit(g)), v = F(unit(g));
    auto const got = evaluate(patch, u, v);
    // control points are rounded to F first
    rational const bound = 2 * gamma * rational(largest_coordinate(patch));
    exact_patch const along_u = derivative_u(exact), along_v = derivative_v(exact);
    for (auto const& [point, wanted, scale] : {std::tuple(got.position, value(exact, exactly(u), exactly(v)), 1),
                                               std::tuple(got.du, value(along_u, exactly(u), exactly(v)), 6),
                                               std::tuple(got.dv, value(along_v, exactly(u), exactly(v)), 6)}) {
      exact_point const computed{exactly(point.x), exactly(point.y), exactly(point.z)};
      worst = std::max(worst, static_cast<double>(rational(largest(computed - wanted) / (bound * scale))));
    }
  }
  CAPTURE(worst);
  CHECK(worst <= 1);
}

TEMPLATE_TEST_CASE("Newton's step in two words solves nearly singular systems to twice the digits", "", float, double) {
  using T = TestType;
  using F = two_float<T>;
  unsigned const seed = 3;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 1000; ++n) {
    bivariate<F> b{spread<T>(g), spread<T>(g), spread<T>(g), spread<T>(g), spread<T>(g), spread<T>(g)};
    b.gy = b.fy * b.gx / b.fx;  // det is of the last bits alone
    auto const s = newton_step(b);
    rational const fx = exactly(b.fx), fy = exactly(b.fy), gx = exactly(b.gx), gy = exactly(b.gy);
    rational const f_gy = exactly(b.f) * gy, g_fy = exactly(b.g) * fy;
    CAPTURE(n);
    REQUIRE(error_of_difference(s.det, fx * gy, fy * gx) <= 1);
    REQUIRE(error_of_difference(s.dx, g_fy, f_gy) <= 1);
    REQUIRE(error_of_difference(s.dy, exactly(b.f) * gx, exactly(b.g) * fx) <= 1);
    // a determinant of which half the digits are left
    b.gy = b.gy * F(1 + std::numeric_limits<T>::epsilon());
    rational const det = fx * exactly(b.gy) - fy * gx, dx = g_fy - exactly(b.f) * exactly(b.gy);
    F const far = F(std::numeric_limits<T>::max() / 4);
    F const step = limit_step(newton_step(b), far, far).dx;
    rational const epsilon = exactly(std::numeric_limits<F>::epsilon());
    REQUIRE(abs(rational(exactly(step) - dx / det)) <= 4 * epsilon * (abs(dx) + epsilon * abs(f_gy)) / abs(det));
  }
}
