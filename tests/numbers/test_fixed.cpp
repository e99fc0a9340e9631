// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/numbers/fixed.hpp>
#include <patchrt/roots/newton.hpp>
#include <patchrt/shapes/bezier_patch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

using namespace patchrt;

namespace {

using ray_engine_number = fixed<std::int16_t, 8>;

__extension__ typedef __int128 wide;

template <class F> constexpr std::int64_t least = std::numeric_limits<decltype(F().units())>::min();
template <class F> constexpr std::int64_t greatest = std::numeric_limits<decltype(F().units())>::max();
/// 1 in units.
template <class F> constexpr std::int64_t one = std::int64_t(1) << F::fraction_bits;

template <class F> F from_units(std::int64_t k) { return F::from_units(static_cast<decltype(F().units())>(k)); }

/// Whether got is n / d units, d > 0, to nearest, ties to even, or the end of the range that lies on the way there.
template <class F> bool is_rounded(F got, wide n, wide d) {
  wide const k = got.units(), twice_error = 2 * (n - k * d);
  if (-d < twice_error && twice_error < d) return true;
  if ((twice_error == d || twice_error == -d) && k % 2 == 0) return true;
  return (k == greatest<F> && n > k * d) || (k == least<F> && n < k * d);
}

template <class F> bool is_sum(F got, F a, F b) { return is_rounded(got, wide(a.units()) + b.units(), 1); }
template <class F> bool is_difference(F got, F a, F b) { return is_rounded(got, wide(a.units()) - b.units(), 1); }
template <class F> bool is_product(F got, F a, F b) { return is_rounded(got, wide(a.units()) * b.units(), one<F>); }
template <class F> bool is_quotient(F got, F a, F b) {
  wide const n = wide(a.units()) * one<F>, d = b.units();
  if (d == 0) return got.units() == (n < 0 ? least<F> : greatest<F>);
  return d < 0 ? is_rounded(got, -n, -d) : is_rounded(got, n, d);
}
template <class F> bool is_fused(F got, F a, F b, F c) {
  return is_rounded(got, wide(a.units()) * b.units() + wide(c.units()) * one<F>, one<F>);
}
template <class F> bool is_root(F got, F a) {
  if (a.units() < 0) return got.units() == greatest<F>;
  wide const k = got.units(), square = wide(a.units()) * one<F>;
  return (k == 0 || (2 * k - 1) * (2 * k - 1) < 4 * square) && 4 * square < (2 * k + 1) * (2 * k + 1);
}

template <class F> bool are_right(F a, F b) {
  double const x = double(a), y = double(b);
  return is_sum(a + b, a, b) && is_difference(a - b, a, b) && is_product(a * b, a, b) && is_quotient(a / b, a, b) &&
         (a < b) == (x < y) && (a <= b) == (x <= y) && (a > b) == (x > y) && (a >= b) == (x >= y) &&
         (a == b) == (x == y) && min(a, b) == (x < y ? a : b) && max(a, b) == (y < x ? a : b) &&
         select(x < y, a, b) == (x < y ? a : b) && copysign(a, b) == (std::signbit(x) == std::signbit(y) ? a : -a);
}

/// What is odd about fixed-point numbers: 0, the ends of the range, the powers of two, and their neighbours.
template <class F> std::vector<F> special_numbers() {
  std::vector<F> all;
  for (int k = 0; k <= std::numeric_limits<F>::digits; ++k) {
    for (std::int64_t const x : {std::int64_t(1) << k, -(std::int64_t(1) << k)}) {
      for (int beside = -1; beside <= 1; ++beside)
        all.push_back(from_units<F>(std::clamp(x + beside, least<F>, greatest<F>)));
    }
  }
  return all;
}

/// A number of any bits; a quarter of them few, so that ties occur.
template <class F> F any_number(std::mt19937_64& g) {
  std::uint64_t const bits = g();
  std::int64_t const k = std::int64_t(bits % std::uint64_t(greatest<F> - least<F> + 1)) + least<F>;
  int const zeros = bits >> 62 == 0 ? int(bits >> 40 & 7) : 0;
  return from_units<F>(k / (1 << zeros) * (1 << zeros));
}

double error_of(vec3<ray_engine_number> const& got, vec3<double> const& wanted) {
  vec3<double> const e = convert_vec<double>(got) - wanted;
  return std::max({std::fabs(e.x), std::fabs(e.y), std::fabs(e.z)});
}

}  // namespace

#define PATCHRT_TEST_FIXED                                                                              \
  (fixed<std::int16_t, 8>), (fixed<std::int16_t, 2>), (fixed<std::int8_t, 2>), (fixed<std::int8_t, 4>), \
      (fixed<std::int32_t, 2>), (fixed<std::int32_t, 1024>)

static_assert(scalar<ray_engine_number> && std::is_trivially_copyable_v<ray_engine_number>);
static_assert(sizeof(ray_engine_number) == 2 && ray_engine_number::fraction_bits == 12);
static_assert(ray_engine_number(1.5) * ray_engine_number(-4) + ray_engine_number(5.f) == ray_engine_number(-1));
static_assert(sqrt(ray_engine_number(6.25)) == ray_engine_number(2.5));

TEMPLATE_TEST_CASE("every number of 8 and 16 bits converts to its value and back", "", (fixed<std::int16_t, 8>),
                   (fixed<std::int16_t, 2>), (fixed<std::int8_t, 4>)) {
  using F = TestType;
  for (std::int64_t k = least<F>; k <= greatest<F>; ++k) {
    F const x = from_units<F>(k);
    REQUIRE(double(x) == double(k) / double(one<F>));
    REQUIRE(double(float(x)) == double(x));
    REQUIRE(F(double(x)) == x);
    REQUIRE(F(float(x)) == x);
  }
}

TEMPLATE_TEST_CASE("conversion rounds to nearest-even at every middle between two numbers and its neighbours", "",
                   (fixed<std::int16_t, 8>), (fixed<std::int16_t, 2>), (fixed<std::int8_t, 2>)) {
  using F = TestType;
  double const far = 1e300;
  for (std::int64_t k = least<F>; k < greatest<F>; ++k) {
    double const middle = (double(k) + 0.5) / double(one<F>);
    REQUIRE(+F(std::nextafter(middle, -far)).units() == k);
    REQUIRE(+F(middle).units() == (k % 2 == 0 ? k : k + 1));
    REQUIRE(+F(std::nextafter(middle, far)).units() == k + 1);
    float const narrow = float(middle);
    REQUIRE(+F(std::nextafter(narrow, -HUGE_VALF)).units() == k);
    REQUIRE(+F(narrow).units() == (k % 2 == 0 ? k : k + 1));
    REQUIRE(+F(std::nextafter(narrow, HUGE_VALF)).units() == k + 1);
  }
}

TEMPLATE_TEST_CASE("conversion of what is out of range gives the nearest end, of NaN the greatest number", "",
                   PATCHRT_TEST_FIXED) {
  using F = TestType;
  double const range = -double(F(-1e9));
  for (double const x : {range, 1.5 * range, 1e30, 1e308, HUGE_VAL}) {
    CAPTURE(x);
    CHECK(+F(x).units() == greatest<F>);
    CHECK(+F(-x).units() == least<F>);
    CHECK(+F(float(x)).units() == greatest<F>);
  }
  CHECK(+F(std::nan("")).units() == greatest<F>);
  CHECK(+F(-std::nan("")).units() == greatest<F>);
  CHECK(+F(1e-300).units() == 0);
  CHECK(+F(-1).units() == -one<F>);
  CHECK(+F(1u).units() == one<F>);
  CHECK(+F(std::int64_t(1) << 62).units() == greatest<F>);
}

TEST_CASE("numbers of 32 bits convert to and from double exactly, to float to nearest") {
  using F = fixed<std::int32_t, 1024>;
  unsigned const seed = 601;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  for (int n = 0; n < 100000; ++n) {
    F const x = any_number<F>(g);
    REQUIRE(F(double(x)) == x);
    REQUIRE(float(x) == static_cast<float>(double(x)));
  }
}

TEMPLATE_TEST_CASE("sums, products, quotients and comparisons of all pairs of 8 bits are right", "",
                   (fixed<std::int8_t, 2>), (fixed<std::int8_t, 4>), (fixed<std::int8_t, 64>)) {
  using F = TestType;
  for (std::int64_t j = least<F>; j <= greatest<F>; ++j) {
    for (std::int64_t k = least<F>; k <= greatest<F>; ++k) {
      F const a = from_units<F>(j), b = from_units<F>(k);
      if (!are_right(a, b)) FAIL("wrong for " << j << " and " << k << " units");
    }
  }
}

TEST_CASE("sums, products, quotients and comparisons of all numbers of 16 bits with 256 others are right") {
  using F = ray_engine_number;
  std::vector<F> others = special_numbers<F>();
  for (std::int64_t k = 0; others.size() < 256; ++k) others.push_back(from_units<F>(k * 40503 % 65536 + least<F>));
  for (F const b : others) {
    for (std::int64_t k = least<F>; k <= greatest<F>; ++k) {
      F const a = from_units<F>(k);
      if (!are_right(a, b) || !is_quotient(b / a, b, a)) FAIL("wrong for " << k << " and " << b.units() << " units");
    }
  }
}

TEMPLATE_TEST_CASE("operations on special numbers and on a million random ones are rounded once", "",
                   PATCHRT_TEST_FIXED) {
  using F = TestType;
  unsigned const seed = 602;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  auto const hold = [](F a, F b, F c) {
    if (are_right(a, b) && is_fused(fma(a, b, c), a, b, c) && is_root(sqrt(a), a)) return;
    FAIL("wrong for " << std::int64_t(a.units()) << ", " << std::int64_t(b.units()) << ", " << std::int64_t(c.units()));
  };
  auto const special = special_numbers<F>();
  for (F const a : special) {
    for (F const b : special) {
      for (F const c : special) hold(a, b, c);
    }
  }
  for (int n = 0; n < 1000000; ++n) hold(any_number<F>(g), any_number<F>(g), any_number<F>(g));
}

TEST_CASE("fma of all triples of 8 bits is rounded once") {
  using F = fixed<std::int8_t, 4>;
  for (std::int64_t i = least<F>; i <= greatest<F>; ++i) {
    for (std::int64_t j = least<F>; j <= greatest<F>; ++j) {
      for (std::int64_t k = least<F>; k <= greatest<F>; ++k) {
        F const a = from_units<F>(i), b = from_units<F>(j), c = from_units<F>(k);
        if (!is_fused(fma(a, b, c), a, b, c)) FAIL("wrong for " << i << ", " << j << ", " << k << " units");
      }
    }
  }
}

TEMPLATE_TEST_CASE("roots, negatives and magnitudes of all numbers of 8 and 16 bits are right", "",
                   (fixed<std::int16_t, 8>), (fixed<std::int16_t, 2>), (fixed<std::int8_t, 2>)) {
  using F = TestType;
  for (std::int64_t k = least<F>; k <= greatest<F>; ++k) {
    F const a = from_units<F>(k);
    REQUIRE(is_root(sqrt(a), a));
    REQUIRE(+(-a).units() == std::min(-k, greatest<F>));
    REQUIRE(+abs(a).units() == std::min(std::abs(k), greatest<F>));
    if (k > 0) REQUIRE(double(power_of_two_below(a)) == std::ldexp(1., std::ilogb(double(a))));
  }
  CHECK(power_of_two_below(F(0)) == F(0));
}

TEST_CASE("what is NaN or infinite in IEEE arithmetic is the end of the range, and a miss before any limit") {
  using F = ray_engine_number;
  using limits = std::numeric_limits<F>;
  F const zero(0), one(1);
  for (F const x :
       {zero / zero, one / zero, sqrt(-one), F(std::nan("")), F(HUGE_VAL), limits::infinity(), limits::quiet_NaN()}) {
    CHECK(x == limits::max());
    CHECK_FALSE(x < limits::infinity());
  }
  CHECK(-one / zero == limits::lowest());
  CHECK(F(4) + F(5) == limits::max());
  CHECK(F(-4) * F(5) == limits::lowest());
  CHECK(F(7) / F(0.5) == limits::max());
  CHECK(fma(F(4), F(5), F(-8)) == limits::max());
  CHECK(fma(F(3), F(4), F(-8)) == F(4));  // 12 is out of range, the result is not
}

TEMPLATE_TEST_CASE("the limits of fixed are what its arithmetic has", "", PATCHRT_TEST_FIXED) {
  using F = TestType;
  using limits = std::numeric_limits<F>;
  F const one(1), zero(0);
  CHECK(limits::min() == limits::epsilon());
  CHECK(one + limits::epsilon() > one);
  CHECK(zero < limits::min());
  CHECK(limits::min() * F(0.5) == zero);
  CHECK(limits::max() + limits::epsilon() == limits::max());
  CHECK(limits::lowest() - limits::epsilon() == limits::lowest());
  CHECK(double(limits::min()) == std::ldexp(1., limits::min_exponent - 1));
  CHECK(double(limits::lowest()) == -std::ldexp(1., limits::max_exponent));
  CHECK(limits::round_error() == F(0.5));
}

TEST_CASE("a patch of fixed-point numbers evaluates within what its roundings add up to") {
  using F = ray_engine_number;
  unsigned const seed = 603;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> coordinate(-1, 1), parameter(0, 1);
  // In halves of a unit, one a rounding: weights are 6 off, 8 the differences that weigh tangents, before they are
  // tripled. Sums of four: 4 * 6 + 4 along v, as much along u over points of size 1, or 4 * 25 + 4 and 4 * 6 * 6 + 4
  // for tangents.
  double const half_unit = 0x1p-13, bound = 60 * half_unit, tangent_bound = 252 * half_unit;
  double worst = 0, worst_tangent = 0;
  for (int n = 0; n < 2000; ++n) {
    bicubic_patch<F> p;
    bicubic_patch<double> q;
    for (std::size_t k = 0; k < 16; ++k) {
      p.control_points[k] = {F(coordinate(g)), F(coordinate(g)), F(coordinate(g))};
      q.control_points[k] = convert_vec<double>(p.control_points[k]);
    }
    F const u(parameter(g)), v(parameter(g));
    auto const got = evaluate(p, u, v);
    auto const wanted = evaluate(q, double(u), double(v));
    worst = std::max(worst, error_of(got.position, wanted.position) / bound);
    worst_tangent = std::max(
        {worst_tangent, error_of(got.du, wanted.du) / tangent_bound, error_of(got.dv, wanted.dv) / tangent_bound});
  }
  CAPTURE(worst, worst_tangent);
  CHECK(worst <= 1);
  CHECK(worst_tangent <= 1);
  CHECK(std::min(worst, worst_tangent) > 0.02);
}

TEST_CASE("cross products of fixed-point numbers are within two units and Newton's iteration converges in them") {
  using F = ray_engine_number;
  unsigned const seed = 604;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1.9, 1.9);
  for (int n = 0; n < 20000; ++n) {
    vec3<F> const a{F(d(g)), F(d(g)), F(d(g))}, b{F(d(g)), F(d(g)), F(d(g))};
    REQUIRE(error_of(cross(a, b), cross(convert_vec<double>(a), convert_vec<double>(b))) <= 0x1p-11);
    REQUIRE(std::fabs(double(dot(a / F(2), b / F(2))) -
                      dot(convert_vec<double>(a / F(2)), convert_vec<double>(b / F(2)))) <= 0x1.8p-12);
  }
  F x(1), y(0.25);  // on the circle of radius 1 where x = y
  for (int n = 0; n < 6; ++n) {
    auto const s = newton_step(bivariate<F>{fma(x, x, fma(y, y, F(-1))), x + x, y + y, x - y, F(1), F(-1)});
    x += s.dx / s.det;
    y += s.dy / s.det;
  }
  CHECK(std::fabs(double(x) - std::sqrt(0.5)) <= 0x1p-12);
  CHECK(std::fabs(double(y) - std::sqrt(0.5)) <= 0x1p-12);
}
