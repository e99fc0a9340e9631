// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/core/vec.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <limits>
#include <random>

using namespace patchrt;

namespace {

using rational = boost::multiprecision::cpp_rational;

/// Random numbers of some twenty binades, all exponents of which keep products in range.
template <class T, class Generator> T spread(Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  std::uniform_int_distribution<int> e(-10, 10);
  return T(std::ldexp(d(g), e(g)));
}

/// |got - wanted| in units of eps |wanted|.
template <class T> double error_in_eps(T got, rational const& wanted) {
  if (wanted == 0) return got == 0 ? 0 : std::numeric_limits<double>::infinity();
  rational const e = abs(rational(rational(got) - wanted)) / abs(wanted) / rational(std::numeric_limits<T>::epsilon());
  return static_cast<double>(e);
}

}  // namespace

static_assert(scalar<float> && scalar<double>);
static_assert(lanes_v<float> == 1 && std::same_as<mask_t<double>, bool> && std::same_as<lane_t<float>, float>);

TEMPLATE_TEST_CASE("min and max give their second argument for NaN and for equal zeros, as SSE does", "", float,
                   double) {
  using T = TestType;
  T const nan = std::numeric_limits<T>::quiet_NaN(), inf = std::numeric_limits<T>::infinity();
  CHECK(min(nan, T(1)) == 1);
  CHECK(max(nan, T(1)) == 1);
  CHECK(min(T(1), nan) != min(T(1), nan));
  CHECK(max(T(1), nan) != max(T(1), nan));
  CHECK(std::signbit(min(T(0), T(-0.0))));
  CHECK_FALSE(std::signbit(max(T(-0.0), T(0))));
  CHECK(min(-inf, T(3)) == -inf);
  CHECK(max(-inf, T(3)) == 3);
}

TEMPLATE_TEST_CASE("difference_of_products stays within 1.5 ulp where the products cancel", "", float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_int_distribution<int> ulps(-4, 4);
  double worst = 0;
  for (int n = 0; n < 4000; ++n) {
    T const a = spread<T>(g), b = spread<T>(g), c = spread<T>(g);
    T d = n % 2 ? spread<T>(g) : a * b / c;  // the second cancels all but the last bits
    for (int k = ulps(g); k > 0; --k) d = std::nextafter(d, T(0));
    worst = std::max(
        worst, error_in_eps(difference_of_products(a, b, c, d), rational(a) * rational(b) - rational(c) * rational(d)));
  }
  CAPTURE(worst);
  CHECK(worst <= 1.5);
  CHECK(worst > 0.4);
}

TEMPLATE_TEST_CASE("power_of_two_below is the greatest power of two not above a normal number", "", float, double) {
  using T = TestType;
  unsigned const seed = 5;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int const widest = std::numeric_limits<T>::max_exponent - 1;
  for (int n = 0; n < 10000; ++n) {
    int const exponent = std::uniform_int_distribution<int>(2 - std::numeric_limits<T>::max_exponent, widest)(g);
    T const p = std::ldexp(T(1), exponent);
    T const a = std::min(p * std::uniform_real_distribution<T>(1, 2)(g), std::nextafter(2 * p, T(0)));
    REQUIRE(power_of_two_below(a) == p);
    REQUIRE(power_of_two_below(p) == p);
  }
  CHECK(power_of_two_below(T(0)) == 0);
  CHECK(power_of_two_below(std::numeric_limits<T>::infinity()) == std::numeric_limits<T>::infinity());
}

TEMPLATE_TEST_CASE("fma rounds once", "", float, double) {
  using T = TestType;
  std::mt19937 g(2);
  for (int n = 0; n < 1000; ++n) {
    T const a = spread<T>(g), b = spread<T>(g), c = n % 2 ? spread<T>(g) : -a * b;
    REQUIRE(error_in_eps(fma(a, b, c), rational(a) * rational(b) + rational(c)) <= 0.5);
  }
}

TEMPLATE_TEST_CASE("lerp starts at a, and stays there where a = b", "", float, double) {
  using T = TestType;
  std::mt19937 g(3);
  for (int n = 0; n < 1000; ++n) {
    T const a = spread<T>(g), b = spread<T>(g), t = abs(spread<T>(g));
    REQUIRE(lerp(a, b, T(0)) == a);
    REQUIRE(lerp(a, a, t) == a);
  }
}

TEST_CASE("convert rounds to nearest") {
  CHECK(convert<float>(1 + 0x1p-24) == 1);
  CHECK(convert<float>(1 + 0x1.8p-24) == 1 + 0x1p-23f);
  CHECK(convert<double>(0.1f) == double(0.1f));
}
