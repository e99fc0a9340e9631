// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/numbers/half.hpp>
#include <patchrt/roots/newton.hpp>
#include <patchrt/shapes/bezier_patch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#if defined(__AVX512FP16__)
#  include <immintrin.h>
#endif

using namespace patchrt;

namespace {

__extension__ typedef __int128 wide;

constexpr int infinite = 0x7c00;

/// The half of bits k >= 0 as a multiple of 2^-24; what would follow the greatest half, for infinity.
std::int64_t value(int k) { return k < 1024 ? k : std::int64_t(1024 + k % 1024) << (k / 1024 - 1); }
/// The middle between that and the next as a multiple of 2^-25.
std::int64_t middle_above(int k) { return value(k) + value(k + 1); }

int magnitude(half h) { return h.bits() & 0x7fff; }
bool is_negative(half h) { return (h.bits() >> 15) != 0; }
bool is_nan(half h) { return magnitude(h) > infinite; }
bool is_finite(half h) { return magnitude(h) < infinite; }
/// A finite half as a multiple of 2^-24.
std::int64_t value(half h) { return is_negative(h) ? -value(magnitude(h)) : value(magnitude(h)); }
half half_of(int bits) { return half::from_bits(static_cast<std::uint16_t>(bits)); }

int sign_of(wide x) { return x < 0 ? -1 : x > 0 ? 1 : 0; }
wide size_of(wide x) { return x < 0 ? -x : x; }

/// Whether `got` is the half nearest to x, ties to even, of which side(m) is the sign of |x| - m 2^-25.
template <class Side> bool is_nearest(half got, bool negative, Side const& side) {
  int const k = magnitude(got);
  if (is_nan(got) || is_negative(got) != negative) return false;
  int const to_lower = k == 0 ? 1 : side(middle_above(k - 1)), to_upper = k == infinite ? -1 : side(middle_above(k));
  bool const even = k % 2 == 0;
  return (to_lower > 0 || (even && to_lower == 0)) && (to_upper < 0 || (even && to_upper == 0));
}

/// Whether `got` has the bits of x, which is 0, infinite or NaN.
bool is_special(half got, float x) {
  if (x != x) return got.bits() == 0x7e00;
  return magnitude(got) == (x == 0 ? 0 : infinite) && is_negative(got) == std::signbit(x);
}

bool is_sum(half got, half a, half b) {
  if (!is_finite(a) || !is_finite(b)) return is_special(got, float(a) + float(b));
  std::int64_t const s = value(a) + value(b);
  bool const negative = s < 0 || (s == 0 && is_negative(a) && is_negative(b));
  return is_nearest(got, negative, [s](std::int64_t m) { return sign_of(2 * std::abs(s) - m); });
}

bool is_product(half got, half a, half b) {
  if (!is_finite(a) || !is_finite(b)) return is_special(got, float(a) * float(b));
  wide const p = size_of(wide(value(a)) * value(b));
  return is_nearest(got, is_negative(a) != is_negative(b),
                    [p](std::int64_t m) { return sign_of(p - (wide(m) << 23)); });
}

bool is_quotient(half got, half a, half b) {
  if (!is_finite(a) || !is_finite(b) || value(b) == 0) return is_special(got, float(a) / float(b));
  wide const n = size_of(wide(value(a))) << 25, d = size_of(value(b));
  return is_nearest(got, is_negative(a) != is_negative(b), [n, d](std::int64_t m) { return sign_of(n - m * d); });
}

bool is_root(half got, half a) {
  if (!is_finite(a) || value(a) <= 0) return is_special(got, std::sqrt(float(a)));
  wide const n = wide(value(a)) << 26;
  return is_nearest(got, false, [n](std::int64_t m) { return sign_of(n - wide(m) * m); });
}

bool is_fused(half got, half a, half b, half c) {
  if (!is_finite(a) || !is_finite(b) || !is_finite(c)) return is_special(got, float(a) * float(b) + float(c));
  wide const s = wide(value(a)) * value(b) + wide(value(c)) * (1 << 24);
  bool const negative = s < 0 || (s == 0 && is_negative(c) && is_negative(a) != is_negative(b));
  return is_nearest(got, negative, [s](std::int64_t m) { return sign_of(size_of(s) - (wide(m) << 23)); });
}

template <class F> bool is_conversion(half got, F x) {
  if (!std::isfinite(x)) return is_special(got, float(x));
  return is_nearest(got, std::signbit(x), [x](std::int64_t m) {
    double const to = std::ldexp(double(m), -25), from = std::fabs(double(x));
    return from < to ? -1 : from > to ? 1 : 0;
  });
}

/// Both signs of what is odd about halves.
std::vector<half> special_halves() {
  std::vector<half> all;
  for (int const k : {0x0000, 0x0001, 0x0002, 0x01ff, 0x0200, 0x03ff, 0x0400, 0x0401, 0x13ff, 0x1400, 0x3555, 0x37ff,
                      0x3800, 0x3bff, 0x3c00, 0x3c01, 0x3fff, 0x4000, 0x4248, 0x6bff, 0x7bfe, 0x7bff, 0x7c00, 0x7e00}) {
    all.push_back(half_of(k));
    all.push_back(half_of(k | 0x8000));
  }
  return all;
}

/// 256 of all halves: the special ones and others of all exponents.
std::vector<half> chosen_halves() {
  std::vector<half> all = special_halves();
  for (int k = 0; all.size() < 256; ++k) all.push_back(half_of(k * 40503));
  return all;
}

half any_half(std::mt19937& g) { return half_of(int(g() & 0xffffu)); }

/// Calls check(a, b) for all halves a and 256 b; the first pair it refuses goes to the log.
template <class Check> bool holds_of_pairs(Check const& check) {
  for (half const b : chosen_halves()) {
    for (int k = 0; k < 0x10000; ++k) {
      if (check(half_of(k), b)) continue;
      UNSCOPED_INFO("operands of bits " << k << " and " << b.bits());
      return false;
    }
  }
  return true;
}

template <class Check> bool holds_of_all(Check const& check) {
  for (int k = 0; k < 0x10000; ++k) {
    if (check(half_of(k))) continue;
    UNSCOPED_INFO("operand of bits " << k);
    return false;
  }
  return true;
}

double error_of(vec3<half> const& got, vec3<double> const& wanted) {
  vec3<double> const e = convert_vec<double>(got) - wanted;
  return std::max({std::fabs(e.x), std::fabs(e.y), std::fabs(e.z)});
}

}  // namespace

static_assert(scalar<half> && std::is_trivially_copyable_v<half> && sizeof(half) == 2);
static_assert((half(1) + half(0.5f)) * half(2) == half(3.) && fma(half(3), half(5), half(-16)) == half(-1));

TEST_CASE("every half converts to its value and back to its own bits") {
  CHECK(holds_of_all([](half h) {
    if (is_nan(h)) return std::isnan(float(h)) && std::isnan(double(h)) && half(float(h)).bits() == 0x7e00;
    double const wanted = is_finite(h) ? std::ldexp(double(value(h)), -24) : HUGE_VAL;
    return std::fabs(double(h)) == std::fabs(wanted) && std::signbit(float(h)) == is_negative(h) &&
           double(float(h)) == double(h) && half(float(h)).bits() == h.bits() && half(double(h)).bits() == h.bits();
  }));
}

TEMPLATE_TEST_CASE("conversion rounds to nearest-even at every half, every middle between two and all their neighbours",
                   "", float, double) {
  using F = TestType;
  bool all = true;
  auto const hold = [&all](F x, int k) {
    bool const good = half(x).bits() == k && half(-x).bits() == (k | 0x8000) && is_conversion(half(x), x);
    if (!good) UNSCOPED_INFO("conversion of " << x);
    all = all && good;
  };
  F const far = std::numeric_limits<F>::max();
  for (int k = 0; k < infinite && all; ++k) {
    F const exact = F(std::ldexp(double(value(k)), -24)), middle = F(std::ldexp(double(middle_above(k)), -25));
    hold(exact, k);
    hold(std::nextafter(exact, far), k);
    if (k > 0) hold(std::nextafter(exact, F(0)), k);
    hold(std::nextafter(middle, F(0)), k);
    hold(middle, k % 2 == 0 ? k : k + 1);
    hold(std::nextafter(middle, far), k + 1);
  }
  hold(std::numeric_limits<F>::denorm_min(), 0);
  hold(far, infinite);
  hold(std::numeric_limits<F>::infinity(), infinite);
  CHECK(all);
  CHECK(half(std::numeric_limits<F>::quiet_NaN()).bits() == 0x7e00);
}

TEMPLATE_TEST_CASE("conversion rounds random numbers of all exponents to the nearest half", "", float, double) {
  using F = TestType;
  unsigned const seed = 501;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  std::uniform_int_distribution<int> exponent(-30, 20);
  std::uniform_real_distribution<double> fraction(-2, 2);
  for (int n = 0; n < 1000000; ++n) {
    F const x = F(std::ldexp(fraction(g), exponent(g)));
    if (is_conversion(half(x), x)) continue;
    CAPTURE(x);
    FAIL("not the nearest half");
  }
}

TEST_CASE("conversion of double is rounded once, and integers convert as their values") {
  double const middle = 1 + 0x1p-11;
  CHECK(half(middle + 0x1p-40).bits() == 0x3c01);  // by way of float it would tie to 0x3c00
  CHECK(half(middle - 0x1p-40).bits() == 0x3c00);
  CHECK(half(2049).bits() == half(2048).bits());
  CHECK(half(2051).bits() == half(2052).bits());
  CHECK(half(std::int64_t(1) << 62).bits() == infinite);
  CHECK(half(-3).bits() == 0xc200);
  CHECK(half(65519u).bits() == 0x7bff);
  CHECK(half(65520u).bits() == infinite);
}

TEST_CASE("sums and differences of all halves and 256 others are rounded once") {
  CHECK(holds_of_pairs([](half a, half b) { return is_sum(a + b, a, b); }));
  CHECK(holds_of_pairs([](half a, half b) { return is_sum(a - b, a, -b) && is_sum(b - a, b, -a); }));
}

TEST_CASE("products of all halves and 256 others are rounded once") {
  CHECK(holds_of_pairs([](half a, half b) { return is_product(a * b, a, b); }));
}

TEST_CASE("quotients of all halves and 256 others, both ways, are rounded once") {
  CHECK(holds_of_pairs([](half a, half b) { return is_quotient(a / b, a, b); }));
  CHECK(holds_of_pairs([](half a, half b) { return is_quotient(b / a, b, a); }));
}

TEST_CASE("operations on millions of random halves are rounded once") {
  unsigned const seed = 502;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 4000000; ++n) {
    half const a = any_half(g), b = any_half(g);
    if (is_sum(a + b, a, b) && is_sum(a - b, a, -b) && is_product(a * b, a, b) && is_quotient(a / b, a, b)) continue;
    CAPTURE(a.bits(), b.bits());
    FAIL("not rounded once");
  }
}

TEST_CASE("the square root of every half is rounded once") {
  CHECK(holds_of_all([](half a) { return is_root(sqrt(a), a); }));
}

TEST_CASE("fma of special and random halves is rounded once") {
  unsigned const seed = 503;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const hold = [](half a, half b, half c) {
    if (is_fused(fma(a, b, c), a, b, c)) return;
    CAPTURE(a.bits(), b.bits(), c.bits());
    FAIL("not rounded once");
  };
  auto const special = special_halves();
  for (half const a : special) {
    for (half const b : special) {
      for (half const c : special) hold(a, b, c);
    }
  }
  for (int n = 0; n < 2000000; ++n) hold(any_half(g), any_half(g), any_half(g));
}

TEST_CASE("fma rounds once where the product is the middle between two halves and the sum is just beside it") {
  unsigned const seed = 504;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int beside = 0;
  for (int n = 0; n < 4000000; ++n) {
    half const a = any_half(g), b = any_half(g);
    if (!is_finite(a) || !is_finite(b)) continue;
    double const p = std::fabs(double(a) * double(b));
    bool const is_middle = p < 65520 && half(std::nextafter(p, 0.)).bits() != half(std::nextafter(p, 65520.)).bits();
    if (!is_middle) continue;
    for (int const k : {0x0001, 0x8001, 0x03ff, 0x0400, 0x8400}) {
      half const c = half_of(k);
      ++beside;
      if (!is_fused(fma(a, b, c), a, b, c)) FAIL("not rounded once: " << a.bits() << " " << b.bits() << " " << k);
    }
  }
  CAPTURE(beside);
  CHECK(beside > 10000);
}

TEST_CASE("comparisons, min, max and selections are those of the values, and NaN is a miss") {
  CHECK(holds_of_pairs([](half a, half b) {
    double const x = double(a), y = double(b);
    return (a < b) == (x < y) && (a <= b) == (x <= y) && (a > b) == (x > y) && (a >= b) == (x >= y) &&
           (a == b) == (x == y) && (a != b) == (x != y) && min(a, b).bits() == (x < y ? a : b).bits() &&
           max(a, b).bits() == (y < x ? a : b).bits() && select(x < y, a, b).bits() == (x < y ? a : b).bits();
  }));
}

TEST_CASE("negation, abs, copysign and power_of_two_below change the bits they should and no more") {
  CHECK(holds_of_all([](half a) {
    int const k = magnitude(a);
    bool const normal = k >= 0x400 && k < infinite;
    int const exponent = normal ? std::ilogb(double(a)) : 0;
    return (-a).bits() == (a.bits() ^ 0x8000) && abs(a).bits() == k && copysign(a, half(-0.)).bits() == (k | 0x8000) &&
           copysign(a, half(0)).bits() == k &&
           (!normal || double(power_of_two_below(abs(a))) == std::ldexp(1., exponent));
  }));
  CHECK(power_of_two_below(half(0)).bits() == 0);
  CHECK(power_of_two_below(half_of(infinite)).bits() == infinite);
}

TEST_CASE("the limits of half are what its arithmetic has") {
  using limits = std::numeric_limits<half>;
  half const one(1), two(2);
  CHECK(limits::epsilon() == half_of(one.bits() + 1) - one);
  CHECK(one + limits::round_error() * limits::epsilon() == one);
  CHECK(double(limits::max()) == 65504);
  CHECK(limits::max() + half(15) == limits::max());
  CHECK(limits::max() + half(16) == limits::infinity());
  CHECK(limits::lowest() == -limits::max());
  CHECK(double(limits::min()) == std::ldexp(1., limits::min_exponent - 1));
  CHECK(std::ldexp(1., limits::max_exponent - 1) <= double(limits::max()));
  CHECK(limits::denorm_min() / two == half(0));
  CHECK(limits::min() / two > limits::denorm_min());
  CHECK(limits::quiet_NaN() != limits::quiet_NaN());
  CHECK(one / half(0) == limits::infinity());
  CHECK(is_nan(limits::infinity() - limits::infinity()));
}

TEST_CASE("two halves come out of their 32 bits as they went in") {
  CHECK(pack_halves(half(1), half(-2)) == 0xc0003c00u);
  CHECK(holds_of_all([](half a) {
    half const b = half_of(a.bits() * 31 + 7);
    half_pair const p = unpack_halves(pack_halves(a, b));
    return p.low.bits() == a.bits() && p.high.bits() == b.bits();
  }));
}

#if defined(__FLT16_MANT_DIG__)
TEST_CASE("conversions and operations have the bits of the compiler's own _Float16") {
  unsigned const seed = 505;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const same = [](half a, _Float16 b) {
    return a.bits() == std::bit_cast<std::uint16_t>(b) || (is_nan(a) && b != b);
  };
  auto const native = [](half a) { return std::bit_cast<_Float16>(a.bits()); };
  auto const hold = [&](half a, half b) {
    _Float16 const x = native(a), y = native(b);
    _Float16 const sum = x + y, difference = x - y, product = x * y, quotient = x / y;
    return same(a + b, sum) && same(a - b, difference) && same(a * b, product) && same(a / b, quotient) &&
           (a < b) == (x < y) && (a <= b) == (x <= y) && (a == b) == (x == y);
  };
  for (int n = 0; n < 4000000; ++n) {
    half const a = any_half(g), b = any_half(g);
    float const f = std::bit_cast<float>(std::uint32_t(g()));
    double const d = std::ldexp(double(g()) - 0x1p31, int(g() % 50) - 56);
    if (hold(a, b) && same(half(f), static_cast<_Float16>(f)) && same(half(d), static_cast<_Float16>(d))) continue;
    CAPTURE(a.bits(), b.bits(), f, d);
    FAIL("other bits than _Float16");
  }
  for (half const a : chosen_halves()) {
    for (half const b : chosen_halves()) {
      if (!hold(a, b)) FAIL("other bits than _Float16: " << a.bits() << " " << b.bits());
    }
  }
}
#endif

#if defined(__AVX512FP16__)
TEST_CASE("fma and sqrt have the bits of the processor's own half arithmetic") {
  unsigned const seed = 506;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const lane = [](half a) { return _mm_set_sh(std::bit_cast<_Float16>(a.bits())); };
  auto const same = [](half a, __m128h b) {
    half const h = half::from_bits(std::bit_cast<std::uint16_t>(_mm_cvtsh_h(b)));
    return a.bits() == h.bits() || (is_nan(a) && is_nan(h));
  };
  for (int n = 0; n < 4000000; ++n) {
    half const a = any_half(g), b = any_half(g), c = any_half(g);
    if (same(fma(a, b, c), _mm_fmadd_sh(lane(a), lane(b), lane(c))) && same(sqrt(a), _mm_sqrt_sh(lane(a), lane(a))))
      continue;
    CAPTURE(a.bits(), b.bits(), c.bits());
    FAIL("other bits than the processor");
  }
}
#endif

TEST_CASE("a patch of halves evaluates within the stated bound of the same patch in double") {
  unsigned const seed = 507;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> coordinate(-1, 1), parameter(0, 1);
  double const eps = 0x1p-10, bound = 18 * eps / (2 - 18 * eps) + 100 * 0x1p-25;  // and what underflows
  double worst = 0, worst_tangent = 0;
  for (int n = 0; n < 2000; ++n) {
    bicubic_patch<half> p;
    bicubic_patch<double> q;
    for (std::size_t k = 0; k < 16; ++k) {
      p.control_points[k] = {half(coordinate(g)), half(coordinate(g)), half(coordinate(g))};
      q.control_points[k] = convert_vec<double>(p.control_points[k]);
    }
    half const u(parameter(g)), v(parameter(g));
    auto const got = evaluate(p, u, v);
    auto const wanted = evaluate(q, double(u), double(v));
    worst = std::max(worst, error_of(got.position, wanted.position) / bound);
    worst_tangent =
        std::max({worst_tangent, error_of(got.du, wanted.du) / (6 * bound), error_of(got.dv, wanted.dv) / (6 * bound)});
    auto const mixed = evaluate(p, double(u), double(v));  // stored as halves, computed in double
    REQUIRE(mixed.position == wanted.position);
  }
  CAPTURE(worst, worst_tangent);
  CHECK(worst <= 1);
  CHECK(worst_tangent <= 1);
  CHECK(std::min(worst, worst_tangent) > 0.05);
}

TEST_CASE("cross products of halves are within 1.5 ulp and Newton's iteration converges in halves") {
  unsigned const seed = 508;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-100, 100);
  for (int n = 0; n < 20000; ++n) {
    vec3<half> const a{half(d(g)), half(d(g)), half(d(g))}, b{half(d(g)), half(d(g)), half(d(g))};
    vec3<double> const x = convert_vec<double>(a), y = convert_vec<double>(b), wanted = cross(x, y);
    vec3<half> const got = cross(a, b);
    for (int c = 0; c < 3; ++c) {
      double const exact = component(wanted, c), ulp = std::ldexp(1., std::max(std::ilogb(exact), -14) - 10);
      REQUIRE(std::fabs(double(component(got, c)) - exact) <= 1.5 * ulp);
    }
  }
  half x(1), y(0.25);  // on the circle of radius 1 where x = y
  for (int n = 0; n < 6; ++n) {
    auto const s = newton_step(bivariate<half>{fma(x, x, fma(y, y, half(-1))), x + x, y + y, x - y, half(1), half(-1)});
    x += s.dx / s.det;
    y += s.dy / s.det;
  }
  CHECK(std::fabs(double(x) - std::sqrt(0.5)) <= 0x1p-10);
  CHECK(std::fabs(double(y) - std::sqrt(0.5)) <= 0x1p-10);
}
