// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/interval.hpp>
#include <patchrt/numbers/pack.hpp>
#include <patchrt/numbers/two_float.hpp>
#include <patchrt/roots/quadratic.hpp>

#include <boost/multiprecision/mpfr.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

using namespace patchrt;

namespace {

/// Exact for h^2 - a c of doubles of sizes within 2^200 of each other.
using real =
    boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<250>, boost::multiprecision::et_off>;

/// Roots of a t^2 + 2 h t + c = 0 to 250 digits, ascending; how many there are, a double one counted twice.
struct exact_roots {
  int count;
  real at[2];
};
exact_roots solve_exactly(real const& a, real const& h, real const& c) {
  if (a == 0) return h == 0 ? exact_roots{0, {}} : exact_roots{1, {-c / (2 * h), 0}};
  real const d = h * h - a * c;
  if (d < 0) return {0, {}};
  real const s = sqrt(d), q = h < 0 ? real(s - h) : real(-(h + s));
  real const u = q / a, v = q == 0 ? u : real(c / q);
  return {2, {u < v ? u : v, u < v ? v : u}};
}

template <class T> double error_in_ulps(T got, real const& wanted) {
  if (wanted == 0) return got == 0 ? 0 : std::numeric_limits<double>::infinity();
  int const exponent = std::ilogb(static_cast<double>(wanted));
  return static_cast<double>(abs(real(got) - wanted) / ldexp(real(1), exponent + 1 - std::numeric_limits<T>::digits));
}

template <class T, class Generator> T random_number(Generator& g, int binades) {
  T const m = std::uniform_real_distribution<T>(T(1), T(2))(g);
  int const e = std::uniform_int_distribution<int>(-binades, binades)(g);
  return std::ldexp(g() % 2 ? m : -m, e);
}

template <class T> struct equation { T a, h, c; };

/// Of all sorts: any coefficients; cancelling ones, to the last bit some; some that are 0.
template <class T, class Generator> equation<T> random_equation(Generator& g) {
  int const kind = int(g() % 8);
  equation<T> e{random_number<T>(g, 12), random_number<T>(g, 12), random_number<T>(g, 12)};
  if (kind >= 4) e.c = e.h * e.h / e.a;
  if (kind >= 6) e.c = std::nextafter(e.c, g() % 2 ? T(1e9) : T(-1e9));
  if (kind == 3) {  // an exact square: a (t - x)^2
    constexpr int half = std::numeric_limits<T>::digits / 3;
    T const x = std::ldexp(std::round(std::ldexp(random_number<T>(g, 0), half - 1)), -half);
    T const a = std::round(std::ldexp(random_number<T>(g, 0), half - 1));
    e = {a, -a * x, a * x * x};
  }
  if (kind == 2) {
    T* const coefficients[3] = {&e.a, &e.h, &e.c};
    *coefficients[g() % 3] = g() % 2 ? T(0) : T(-0.0);
  }
  return e;
}

/// The naive (-h - sqrt(D)) / a and (-h + sqrt(D)) / a, without fused operations.
template <class T> quadratic_roots<T> solve_naively(T a, T h, T c) {
  T const d = h * h - a * c, s = std::sqrt(d);
  T const u = (-h - s) / a, v = (-h + s) / a;
  return {std::min(u, v), std::max(u, v), d >= 0};
}

template <class T> struct statistics {
  double worst = 0;
  int wrong_count = 0;
  void add(quadratic_roots<T> const& r, exact_roots const& e) {
    if (r.real != (e.count > 0)) {
      ++wrong_count;
      return;
    }
    if (e.count == 2) worst = std::max({worst, error_in_ulps(r.t0, e.at[0]), error_in_ulps(r.t1, e.at[1])});
    if (e.count == 1) worst = std::max(worst, error_in_ulps(std::isinf(r.t0) ? r.t1 : r.t0, e.at[0]));
  }
};

}  // namespace

TEMPLATE_TEST_CASE("roots are there when they are, each within 4 ulp, however much the discriminant cancels", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  statistics<T> ours, naive;
  int real_pairs = 0;
  for (int n = 0; n < 500000; ++n) {
    auto const [a, h, c] = random_equation<T>(g);
    exact_roots const e = solve_exactly(a, h, c);
    ours.add(solve_quadratic(a, h, c), e);
    if (n % 10 == 0) naive.add(solve_naively(a, h, c), e);
    real_pairs += e.count == 2;
  }
  CAPTURE(ours.worst, naive.worst, naive.wrong_count);
  CHECK(ours.wrong_count == 0);
  CHECK(ours.worst < 4);
  CHECK(ours.worst > 1);  // the equations are hard enough to show rounding
  CHECK(real_pairs > 200000);
  CHECK(naive.worst > 1e3);
  CHECK(naive.wrong_count > 500);
}

TEMPLATE_TEST_CASE("hard equations from the literature and from rays have their roots", "", float, double) {
  using T = TestType;
  T const eps = std::numeric_limits<T>::epsilon(), tiny = std::sqrt(std::numeric_limits<T>::min()) / eps;
  T const huge = std::sqrt(std::numeric_limits<T>::max()) / 4;
  struct row {
    char const* origin;
    equation<T> e;
  };
  row const rows[] = {
      {"Kahan 2004: 1 and 1.000000028975958", {T(94906265.625), T(-94906267), T(94906268.375)}},
      {"Kahan 2004: the same, not real for the last digit", {T(94906266.375), T(-94906267.375), T(94906268.375)}},
      {"Kahan 2004, in float's digits: n - 1, -n, n + 1", {4095, -4096, 4097}},
      {"Goldberg 1991, section 1.4: b^2 = 3.34^2 against 4 ac = 4 1.22 2.28", {T(1.22), T(1.67), T(2.28)}},
      {"Forsythe 1969: roots 1e-5 and 1e5", {1, T(-50000.000005), 1}},
      {"Golden ratio: h^2 and a c of one size", {1, T(-0.5), -1}},
      {"a tangent of the unit sphere, exact", {1, 0, 0}},
      {"a tangent, one ulp inside", {1, 0, -eps}},
      {"a tangent, one ulp outside", {1, 0, eps}},
      {"a double root away from 0", {4, -6, 9}},
      {"a double root, h one ulp more", {4, -6 - 4 * eps, 9}},
      {"a double root, h one ulp less", {4, -6 + 4 * eps, 9}},
      {"a generator of a cone, linear", {0, 2, -3}},
      {"a generator of a cone, linear, -0", {T(-0.0), 2, -3}},
      {"a generator of a cone, nearly", {eps * eps, 2, -3}},
      {"a generator of a cone, nearly, from the other side", {-eps * eps, 2, -3}},
      {"on the surface: c = 0", {1, -3, 0}},
      {"on the surface and tangent", {3, 0, 0}},
      {"h = 0: symmetric", {2, 0, -4}},
      {"far origin: c and h^2 of 1e12", {1, -1000000, T(1e12) - 1}},
      {"near min()", {tiny, 3 * tiny, -tiny}},
      {"near max()", {huge, 3 * huge, -huge}},
  };
  for (row const& r : rows) {
    INFO(r.origin);
    auto const [a, h, c] = r.e;
    exact_roots const e = solve_exactly(a, h, c);
    statistics<T> s;
    s.add(solve_quadratic(a, h, c), e);
    CHECK(s.wrong_count == 0);
    CHECK(s.worst < 4);
    statistics<T> mirrored;
    mirrored.add(solve_quadratic(-a, -h, -c), e);
    CHECK(mirrored.wrong_count == 0);
    CHECK(mirrored.worst < 4);
  }
}

TEMPLATE_TEST_CASE("a double root is real or not by choice, others are not asked", "", float, double) {
  using T = TestType;
  auto const touch = solve_quadratic(T(4), T(-6), T(9));
  CHECK(touch.real);
  CHECK((touch.t0 == T(1.5) && touch.t1 == T(1.5)));
  CHECK_FALSE(solve_quadratic<tangent::miss>(T(4), T(-6), T(9)).real);
  CHECK_FALSE(solve_quadratic<tangent::miss>(T(3), T(0), T(0)).real);
  T const below = std::nextafter(T(9), T(0)), above = std::nextafter(T(9), T(10));
  CHECK(solve_quadratic<tangent::miss>(T(4), T(-6), below).real);
  CHECK(solve_quadratic<tangent::hit>(T(4), T(-6), below).real);
  CHECK_FALSE(solve_quadratic<tangent::hit>(T(4), T(-6), above).real);
}

TEMPLATE_TEST_CASE("where a is 0 the missing root is at the infinity that it tends to from a > 0", "", float, double) {
  using T = TestType;
  T const inf = std::numeric_limits<T>::infinity();
  for (T const zero : {T(0), T(-0.0)}) {
    auto const rising = solve_quadratic(zero, T(2), T(-12)), falling = solve_quadratic(zero, T(-2), T(12));
    CHECK((rising.real && rising.t0 == -inf && rising.t1 == 3));
    CHECK((falling.real && falling.t0 == 3 && falling.t1 == inf));
    for (T const c : {T(0), T(-0.0), T(1), T(-1)}) {
      CHECK_FALSE(solve_quadratic(zero, T(0), c).real);
      CHECK_FALSE(solve_quadratic(zero, T(-0.0), c).real);
    }
  }
}

TEMPLATE_TEST_CASE("infinite and NaN coefficients, and squares that overflow, have no roots", "", float, double) {
  using T = TestType;
  T const inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
  T const most = std::numeric_limits<T>::max();
  int real = 0;
  for (T const bad : {inf, -inf, nan})
    for (T const x : {T(0), T(-0.0), T(1), T(-2), inf, -inf, nan})
      for (T const y : {T(0), T(-0.0), T(1), T(-2), inf, -inf, nan}) {
        real += solve_quadratic(bad, x, y).real + solve_quadratic(x, bad, y).real + solve_quadratic(x, y, bad).real;
        real += solve_quadratic<tangent::miss>(bad, x, y).real + solve_quadratic<tangent::miss>(x, bad, y).real;
      }
  CHECK(real == 0);
  CHECK_FALSE(solve_quadratic(T(1), most, T(1)).real);
  CHECK_FALSE(solve_quadratic(most, T(1), -most).real);
}

TEMPLATE_TEST_CASE("a lane of a pack has the roots of one number, bit for bit", "", (pack<float, 16>),
                   (pack<float, 32>), (pack<double, 8>), (pack<double, 2>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int n = lanes_v<P>;
  unsigned const seed = 3;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  T const inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
  int differ = 0;
  for (int round = 0; round < 100000 / n; ++round) {
    T at[3][n];
    for (int i = 0; i < n; ++i) {
      auto const e = random_equation<T>(g);
      at[0][i] = e.a, at[1][i] = e.h, at[2][i] = e.c;
      if (g() % 50 == 0) at[g() % 3][i] = g() % 2 ? inf : nan;
    }
    auto const r = solve_quadratic(P::load(at[0]), P::load(at[1]), P::load(at[2]));
    auto const s = solve_quadratic<tangent::miss>(P::load(at[0]), P::load(at[1]), P::load(at[2]));
    for (int i = 0; i < n; ++i) {
      auto const one = solve_quadratic(at[0][i], at[1][i], at[2][i]);
      T const x[2] = {r.t0[i], r.t1[i]}, y[2] = {one.t0, one.t1};
      differ += r.real[i] != one.real || (one.real && std::memcmp(x, y, sizeof x) != 0);
      differ += s.real[i] != solve_quadratic<tangent::miss>(at[0][i], at[1][i], at[2][i]).real;
    }
  }
  CHECK(differ == 0);
}

TEST_CASE("two words give roots to twice the digits") {
  using F = two_float<double>;
  unsigned const seed = 4;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  double const u = std::numeric_limits<double>::epsilon() / 2;
  double worst = 0;
  for (int n = 0; n < 20000; ++n) {
    auto const [a, h, c] = random_equation<double>(g);
    exact_roots const e = solve_exactly(a, h, c);
    auto const r = solve_quadratic(F(a), F(h), F(c));
    REQUIRE(r.real == (e.count > 0));
    if (e.count != 2) continue;
    for (auto const& [got, wanted] : {std::pair(r.t0, e.at[0]), std::pair(r.t1, e.at[1])}) {
      if (wanted == 0) {
        REQUIRE(got.hi == 0);
        continue;
      }
      real const off = abs(real(got.hi) + real(got.lo) - wanted) / abs(wanted);
      worst = std::max(worst, static_cast<double>(off) / (u * u));
    }
  }
  CAPTURE(worst);
  CHECK(worst < 40);  // half of 15, 25/8, 3, 15 u^2: products, root, sum, quotient
}

TEST_CASE("intervals hold the roots of all coefficients in them, and say real only when that is certain") {
  using I = interval<double>;
  unsigned const seed = 5;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  int certain = 0;
  for (int n = 0; n < 20000; ++n) {
    auto const [a, h, c] = random_equation<double>(g);
    exact_roots const e = solve_exactly(a, h, c);
    auto const r = solve_quadratic(I(a), I(h), I(c));
    if (!r.real || h == 0) continue;
    ++certain;
    REQUIRE(e.count > 0);
    if (e.count != 2) continue;
    REQUIRE((r.t0.lo <= e.at[0] && e.at[0] <= r.t0.hi));
    REQUIRE((r.t1.lo <= e.at[1] && e.at[1] <= r.t1.hi));
  }
  CHECK(certain > 5000);
}

TEMPLATE_TEST_CASE("short numbers find roots that they hold", "", half, (fixed<std::int16_t, 8>)) {
  using T = TestType;
  auto const r = solve_quadratic(T(1.0f), T(-1.5f), T(2.0f));
  CHECK(r.real);
  CHECK((float(r.t0) == 1 && float(r.t1) == 2));
  CHECK_FALSE(solve_quadratic(T(1.0f), T(0.0f), T(1.0f)).real);
  auto const touch = solve_quadratic(T(1.0f), T(-1.0f), T(1.0f));
  CHECK((touch.real && float(touch.t0) == 1));
  CHECK_FALSE(solve_quadratic<tangent::miss>(T(1.0f), T(-1.0f), T(1.0f)).real);
  CHECK_FALSE(solve_quadratic(T(0.0f), T(0.0f), T(1.0f)).real);  // where 0 / 0 may be a number
}
