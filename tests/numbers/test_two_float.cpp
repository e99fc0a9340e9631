// SPDX-License-Identifier: MIT
#include "mpfr_reference.hpp"

#include <patchrt/numbers/two_float.hpp>

#include <algorithm>
#include <array>
#include <utility>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr int trials = 1000000;

/// u of the words: half the distance of 1 to the next.
template <class T> constexpr double u = double(std::numeric_limits<T>::epsilon()) / 2;
/// The least result whose relative error is bounded, by its binary exponent.
template <class T> constexpr int least_bounded = least_exponent<T> + 2 * std::numeric_limits<T>::digits;

template <class T> bool is_normalised(two_float<T> a) {
  if (!(std::abs(a.hi) <= std::numeric_limits<T>::max())) return a.lo == 0;
  return a.hi + a.lo == a.hi;
}

/// Numbers with a low word of all sizes: half an ulp of the high word, a random part of it, far smaller, none.
template <class T> two_float<T> random_number(word_source<T>& random, int low, int high) {
  T const hi = random(low, high);
  int const digits = std::numeric_limits<T>::digits;
  T const half_ulp = std::ldexp(T(1), std::ilogb(hi) - digits);
  T lo = 0;
  switch (random.below(8)) {
    case 0:
      break;
    case 1:
      lo = half_ulp;
      break;
    case 2:
      lo = std::ldexp(random(-2 * digits, 0), std::ilogb(half_ulp));
      break;
    default:
      lo = half_ulp * random(-1, -1);
      break;
  }
  if (random.below(2)) lo = -lo;
  auto const sum = fast_two_sum(hi, lo);
  return {sum.value, sum.error};
}

/// Numbers just above a power of two, with nearly half an ulp in the low word: relative errors are largest there.
template <class T> two_float<T> adverse_number(word_source<T>& random, int low, int high) {
  using limits = std::numeric_limits<T>;
  T const power = std::ldexp(T(1), low + random.below(high - low + 1));
  T const hi = power * (1 + T(random.below(1 << (limits::digits / 2))) * limits::epsilon());
  T const lo =
      power * limits::epsilon() / 2 * (1 - std::ldexp(std::abs(random(-1, -1)), -random.below(limits::digits)));
  return random.below(2) ? two_float<T>(hi, lo) : two_float<T>(-hi, -lo);
}

/// A number that differs from a in its last bits, or in its low word.
template <class T> two_float<T> near(word_source<T>& random, two_float<T> a) {
  int const digits = std::numeric_limits<T>::digits;
  T const ulp = std::ldexp(T(1), std::ilogb(a.hi) + 1 - digits);
  T const hi = a.hi + T(random.below(5) - 2) * ulp;
  T const lo = random.below(4) ? std::ldexp(random(-digits, -2), std::ilogb(ulp)) : a.lo;
  auto const sum = fast_two_sum(hi, lo);
  return {sum.value, sum.error};
}

/// |got - exact| / |exact| in units of u^2; infinite where the exact result is 0 and got is not.
template <class T> class error_meter {
 public:
  double operator()(two_float<T> got, mpfr_ptr exact) {
    got_.set(double(got.hi), double(got.lo));
    if (mpfr_zero_p(exact)) return got.hi == 0 ? 0 : std::numeric_limits<double>::infinity();
    mpfr_sub(got_, got_, exact, MPFR_RNDN);
    mpfr_div(got_, got_, exact, MPFR_RNDN);
    return std::abs(mpfr_get_d(got_, MPFR_RNDN)) / (u<T> * u<T>);
  }

 private:
  reference got_;
};

/// The worst error of `operation` over random operands.
///
/// `operands` gives arrays of N numbers, `exact` sets its first argument to the result of the others. `reached` is an
/// error that operands must provoke to be worth their name.
template <class T, std::size_t N, class Operands, class Operation, class Exact>
void check_bound(double bound, double reached, unsigned seed, Operands const& operands, Operation const& operation,
                 Exact const& exact) {
  word_source<T> random{std::mt19937_64(seed)};
  reference wanted;
  std::array<reference, N> x;
  error_meter<T> error;
  double worst = 0;
  for (int n = 0; n < trials; ++n) {
    std::array<two_float<T>, N> const a = operands(random);
    for (std::size_t k = 0; k < N; ++k) x[k].set(double(a[k].hi), double(a[k].lo));
    exact(wanted, x);
    two_float<T> const got = operation(a);
    double const e = error(got, wanted);
    worst = std::max(worst, e);
    if (!(e <= bound) || !is_normalised(got)) {
      CAPTURE(seed, n, e, bound, a[0].hi, a[0].lo, a[N > 1].hi, a[N > 1].lo, a[N - 1].hi, a[N - 1].lo, got.hi, got.lo);
      REQUIRE(e <= bound);
      REQUIRE(is_normalised(got));
    }
  }
  CAPTURE(seed, worst, bound);
  CHECK(worst > reached);
}

}  // namespace

static_assert(scalar<two_float<float>> && scalar<two_float<double>>);

TEMPLATE_TEST_CASE("sums and differences of two words err by 3 u^2 at most, however much cancels", "", float, double) {
  using T = TestType;
  double const bound = 3 / (1 - 4 * u<T>);
  auto const operands = [](word_source<T>& random) -> std::array<two_float<T>, 2> {
    int const low = least_exponent<T>, high = greatest_exponent<T> - 1;
    two_float<T> const a = random_number(random, low, high);
    if (random.below(2)) return {a, random.below(2) ? near(random, a) : near(random, -a)};
    int const e = std::ilogb(a.hi), digits = std::numeric_limits<T>::digits;
    if (random.below(4)) return {a, random_number(random, std::max(low, e - 2 * digits), std::min(high, e + digits))};
    return {a, random_number(random, low, high)};
  };
  check_bound<T, 2>(
      bound, 1.9, 1, operands, [](auto const& a) { return a[0] + a[1]; },
      [](mpfr_ptr r, auto& x) { mpfr_add(r, x[0], x[1], MPFR_RNDN); });
  check_bound<T, 2>(
      bound, 1.9, 2, operands, [](auto const& a) { return a[0] - a[1]; },
      [](mpfr_ptr r, auto& x) { mpfr_sub(r, x[0], x[1], MPFR_RNDN); });
}

TEMPLATE_TEST_CASE("products of two words err by 4 u^2 at most", "", float, double) {
  using T = TestType;
  check_bound<T, 2>(
      4, 3.8, 3,
      [](word_source<T>& random) -> std::array<two_float<T>, 2> {
        if (random.below(2)) return {adverse_number(random, -9, 9), adverse_number(random, -9, 9)};
        two_float<T> const a = random_number(random, least_exponent<T>, greatest_exponent<T>);
        int const e = std::ilogb(a.hi);
        return {a, random_number(random, std::max(least_bounded<T> - e, least_exponent<T>),
                                 std::min(greatest_exponent<T> - 2 - e, greatest_exponent<T>))};
      },
      [](auto const& a) { return a[0] * a[1]; }, [](mpfr_ptr r, auto& x) { mpfr_mul(r, x[0], x[1], MPFR_RNDN); });
}

TEMPLATE_TEST_CASE("quotients of two words err by 15 u^2 at most", "", float, double) {
  using T = TestType;
  check_bound<T, 2>(
      15 + 56 * u<T>, 4, 4,
      [](word_source<T>& random) -> std::array<two_float<T>, 2> {
        two_float<T> const a = random_number(random, least_bounded<T>, greatest_exponent<T> - 1);
        int const e = std::ilogb(a.hi);
        return {a, random_number(random, std::max(e - greatest_exponent<T> + 2, least_exponent<T>),
                                 std::min(e - least_bounded<T> - 1, greatest_exponent<T>))};
      },
      [](auto const& a) { return a[0] / a[1]; }, [](mpfr_ptr r, auto& x) { mpfr_div(r, x[0], x[1], MPFR_RNDN); });
}

TEMPLATE_TEST_CASE("square roots of two words err by 25/8 u^2 at most", "", float, double) {
  using T = TestType;
  check_bound<T, 1>(
      25. / 8, 2, 5,
      [](word_source<T>& random) -> std::array<two_float<T>, 1> {
        return {abs(random_number(random, least_bounded<T>, greatest_exponent<T>))};
      },
      [](auto const& a) { return sqrt(a[0]); }, [](mpfr_ptr r, auto& x) { mpfr_sqrt(r, x[0], MPFR_RNDN); });
}

TEMPLATE_TEST_CASE("fma errs by 12 u^2 of its result at most, whatever cancels", "", float, double) {
  using T = TestType;
  check_bound<T, 3>(
      12, 3, 6,
      [](word_source<T>& random) -> std::array<two_float<T>, 3> {
        int const middle = least_bounded<T> / 2 + 3 * std::numeric_limits<T>::digits;  // what cancels stays in range
        two_float<T> const a = random_number(random, middle, greatest_exponent<T> / 2 - 2);
        two_float<T> const b = random_number(random, middle, greatest_exponent<T> / 2 - 2);
        two_float<T> const p = a * b;
        switch (random.below(4)) {
          case 0:
            return {a, b, -p};
          case 1:
            return {a, b, near(random, -p)};
          case 2:
            return {a, b, p * random_number(random, -3, 3)};
          default:
            return {a, b, random_number(random, least_bounded<T>, greatest_exponent<T> - 2)};
        }
      },
      [](auto const& a) { return fma(a[0], a[1], a[2]); },
      [](mpfr_ptr r, auto& x) { mpfr_fma(r, x[0], x[1], x[2], MPFR_RNDN); });
}

namespace {

/// All special numbers, and with low words: the largest, the smallest, half an ulp of either sign.
template <class T> std::vector<two_float<T>> special_pairs() {
  using limits = std::numeric_limits<T>;
  std::vector<two_float<T>> all;
  for (T const x : special_numbers<T>()) {
    all.push_back(x);
    if (!(std::abs(x) <= limits::max() / 2 && std::abs(x) >= limits::min())) continue;
    T const half_ulp = std::ldexp(limits::epsilon() / 2, std::ilogb(x));
    for (T const lo :
         {half_ulp, -half_ulp, std::nextafter(half_ulp, T(0)), limits::denorm_min(), -limits::denorm_min()}) {
      auto const sum = fast_two_sum(x, lo);
      all.push_back({sum.value, sum.error});
    }
  }
  return all;
}

/// What any result of any operands must be: MPFR's NaN, infinity or zero, signs included; the bound where it holds;
/// else as good as T's own.
template <class T> void check_special(two_float<T> got, mpfr_ptr exact, double bound, bool bounded) {
  using limits = std::numeric_limits<T>;
  REQUIRE(is_normalised(got));
  if (mpfr_nan_p(exact)) {
    REQUIRE(got.hi != got.hi);
  } else if (mpfr_inf_p(exact) || mpfr_zero_p(exact)) {
    REQUIRE(got.hi == mpfr_get_d(exact, MPFR_RNDN));
    REQUIRE(std::signbit(got.hi) == (mpfr_signbit(exact) != 0));
    REQUIRE(got.lo == 0);
  } else if (std::abs(got.hi) == limits::infinity()) {
    REQUIRE((got.hi < 0) == (mpfr_sgn(exact) < 0));
    REQUIRE(mpfr_cmpabs(exact, reference().set(double(limits::max()), double(limits::max()) * -(3 * u<T>))) > 0);
  } else {
    error_meter<T> error;
    double const e = error(got, exact);
    if (bounded) {
      REQUIRE(e <= bound);
    } else {
      reference off;
      off.set(double(got.hi), double(got.lo));
      mpfr_sub(off, off, exact, MPFR_RNDN);
      REQUIRE((e <= 4 / u<T> || std::abs(mpfr_get_d(off, MPFR_RNDN)) <= 4 * double(limits::denorm_min())));
    }
  }
}

}  // namespace

TEMPLATE_TEST_CASE("every operation on every pair of special numbers gives what MPFR gives", "", float, double) {
  using T = TestType;
  auto const all = special_pairs<T>();
  reference x(2400), y(2400), exact(5000);
  two_float<T> const least = std::numeric_limits<two_float<T>>::min();
  two_float<T> const half_most = std::numeric_limits<T>::max() / 2;
  for (two_float<T> const a : all) {
    x.set(double(a.hi), double(a.lo));
    mpfr_sqrt(exact, x, MPFR_RNDN);
    CAPTURE(a.hi, a.lo);
    check_special(sqrt(a), exact, 25. / 8, a >= least);
    for (two_float<T> const b : all) {
      y.set(double(b.hi), double(b.lo));
      CAPTURE(b.hi, b.lo);
      mpfr_add(exact, x, y, MPFR_RNDN);
      check_special(a + b, exact, 3 / (1 - 4 * u<T>), abs(a) <= half_most && abs(b) <= half_most);
      mpfr_sub(exact, x, y, MPFR_RNDN);
      check_special(a - b, exact, 3 / (1 - 4 * u<T>), abs(a) <= half_most && abs(b) <= half_most);
      mpfr_mul(exact, x, y, MPFR_RNDN);
      check_special(a * b, exact, 4, abs(a * b) >= least);
      mpfr_div(exact, x, y, MPFR_RNDN);
      if (abs(a) <= half_most) check_special(a / b, exact, 15 + 56 * u<T>, abs(a) >= least && abs(a / b) >= least);
      mpfr_fma(exact, x, y, x, MPFR_RNDN);
      if (abs(a * b) <= half_most) {
        bool const bounded = abs(a) <= half_most && mpfr_cmpabs(exact, reference().set(double(least.hi), 0)) >= 0;
        check_special(fma(a, b, a), exact, 12, bounded);
      }
      REQUIRE((a < b) == (mpfr_less_p(x, y) != 0));
      REQUIRE((a <= b) == (mpfr_lessequal_p(x, y) != 0));
      REQUIRE((a > b) == (mpfr_greater_p(x, y) != 0));
      REQUIRE((a >= b) == (mpfr_greaterequal_p(x, y) != 0));
      REQUIRE((a == b) == (mpfr_equal_p(x, y) != 0));
      REQUIRE((a != b) == (mpfr_equal_p(x, y) == 0));
    }
  }
}

TEMPLATE_TEST_CASE("signs, min, max and select take whole numbers", "", float, double) {
  using T = TestType;
  using F = two_float<T>;
  T const e = std::numeric_limits<T>::epsilon() / 4, nan = std::numeric_limits<T>::quiet_NaN();
  F const below(1, -e / 4), one(1), above(1, e);
  CHECK(min(below, one) == below);
  CHECK(max(below, one) == one);
  CHECK(min(above, one) == one);
  CHECK(min(F(nan), one) == one);
  CHECK(max(F(nan), one) == one);
  CHECK(min(one, F(nan)) != min(one, F(nan)));
  CHECK(abs(-below) == below);
  CHECK(abs(below) == below);
  CHECK_FALSE(std::signbit(abs(F(T(-0.0))).hi));
  CHECK(copysign(above, F(T(-0.0))) == -above);
  CHECK(copysign(-above, F(T(0))) == above);
  CHECK(select(true, below, above) == below);
  CHECK(select(false, below, above) == above);
  CHECK(power_of_two_below(above) == one);
  CHECK(power_of_two_below(below) == F(T(0.5)));
  CHECK(power_of_two_below(F(T(7))) == F(T(4)));
  CHECK(power_of_two_below(F(T(7), -e)) == F(T(4)));
  F lanes[1];
  store_lanes(below, lanes);
  F loaded;
  load_lanes(lanes, loaded);
  CHECK(loaded == below);
  CHECK(mask_bits(below < one) == 1u);
  F x = above;
  x += below;
  x -= below;
  x *= F(T(2));
  x /= F(T(2));
  CHECK(x == above);
}

TEST_CASE("conversions round once, and keep both words") {
  unsigned const seed = 7;
  CAPTURE(seed);
  word_source<double> random{std::mt19937_64(seed)};
  for (int n = 0; n < trials; ++n) {
    two_float<double> a = random_number(random, -60, 60);
    if (n % 2)
      a.hi = double(std::nextafter(float(a.hi), 0.f)) +
             0.5 * (double(float(a.hi)) - double(std::nextafter(float(a.hi), 0.f)));
    if (n % 2) a.lo = std::ldexp(a.lo, -200);
    reference x;
    x.set(a.hi, a.lo);
    CAPTURE(n, a.hi, a.lo);
    REQUIRE(convert<float>(a) == x.get<float>(MPFR_RNDN));
    REQUIRE(convert<double>(a) == a.hi);
    auto const f = convert<two_float<float>>(a.hi);
    REQUIRE(is_normalised(f));
    REQUIRE(std::abs(convert<double>(f) - a.hi) <= u<float> * u<float> * std::abs(a.hi));
    auto const g = convert<two_float<float>>(a);
    REQUIRE(is_normalised(g));
    REQUIRE(std::abs(convert<double>(g) - a.hi) <= 1.01 * u<float> * u<float> * std::abs(a.hi));
    auto const wide = convert<two_float<double>>(f);
    REQUIRE(is_normalised(wide));
    REQUIRE(wide.hi == double(f.hi) + double(f.lo));
    REQUIRE(wide.lo == 0);
  }
  using F = two_float<float>;
  double const inf = std::numeric_limits<double>::infinity();
  CHECK(F(1e300) == F(std::numeric_limits<float>::infinity()));
  CHECK(F(-inf) == F(-std::numeric_limits<float>::infinity()));
  CHECK(F(std::nan("")) != F(std::nan("")));
  CHECK(convert<F>(two_float<double>(inf)) == F(std::numeric_limits<float>::infinity()));
  CHECK(convert<float>(two_float<double>(inf)) == std::numeric_limits<float>::infinity());
  CHECK(convert<two_float<double>>(F(1.f, 0x1p-100f)) == two_float<double>(1., 0x1p-100));
  CHECK(convert<double>(F(0x1.fffffep0f, 0x1p-60f)) == 0x1.fffffep0);
  CHECK(F(16777217) == F(16777216.f, 1.f));
  CHECK(F(lane_t<F>(0.5)) == F(0.5f));
  CHECK(F(0.1) != F(0.1f));
}
