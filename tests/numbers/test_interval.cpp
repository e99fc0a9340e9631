// SPDX-License-Identifier: MIT
#include "mpfr_reference.hpp"

#include <patchrt/numbers/interval.hpp>

#include <algorithm>
#include <array>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr int trials = 1000000;

/// Intervals of all widths, single numbers and such that reach across 0 among them.
template <class T> interval<T> random_interval(word_source<T>& random, int low, int high) {
  T const x = random(low, high - 1);
  switch (random.below(6)) {
    case 0:
      return x;
    case 1:
      return {x, next_up(x)};
    case 2:
      return {std::min(x, -x / 4), std::max(x, -x / 4)};
    case 3:
      return x < 0 ? interval<T>(x, T(0)) : interval<T>(T(0), x);
    case 4: {
      T const y = x + std::ldexp(x, -1 - random.below(std::numeric_limits<T>::digits));
      return {std::min(x, y), std::max(x, y)};
    }
    default: {
      T const y = random(low, high - 1);
      return {std::min(x, y), std::max(x, y)};
    }
  }
}

/// How many numbers lie between a and b, counted up to 2; 0 where a >= b.
template <class T> int numbers_between(T a, T b) { return !(a < b) ? 0 : next_up(a) == b ? 1 : 2; }

/// The exact results of an operation at the ends of its operands, rounded down and up to T at once: the narrowest
/// interval that holds them.
template <class T> class enclosure {
 public:
  /// `result` sets its first argument to the result, rounded in the direction of its second.
  template <class Result> void include(Result const& result) {
    result(x_, MPFR_RNDD);
    take(x_.template get<T>(MPFR_RNDD), true);
    result(x_, MPFR_RNDU);
    take(x_.template get<T>(MPFR_RNDU), false);
  }
  bool valid() const { return lo <= hi; }
  T lo = std::numeric_limits<T>::infinity();
  T hi = -std::numeric_limits<T>::infinity();

 private:
  void take(T end, bool low) {
    if (low) lo = std::min(lo, end);
    else hi = std::max(hi, end);
  }
  reference x_{std::numeric_limits<T>::digits};
};

/// Holds `operation` to the enclosure of `exact` over all ends of random operands: it holds that, and where `is_tight`
/// says so of the enclosure and the operands it is the same.
template <class T, std::size_t N, class Operands, class Operation, class Exact, class Tight>
void check_enclosure(unsigned seed, Operands const& operands, Operation const& operation, Exact const& exact,
                     Tight const& is_tight) {
  word_source<T> random{std::mt19937_64(seed)};
  std::array<reference, N> x;
  for (reference& end : x) mpfr_set_prec(end, std::numeric_limits<T>::digits);
  int inexact = 0, tight = 0, widest = 0;
  for (int n = 0; n < trials; ++n) {
    std::array<interval<T>, N> const a = operands(random);
    enclosure<T> wanted;
    for (unsigned ends = 0; ends < 1u << N; ++ends) {
      bool again = false;
      for (std::size_t k = 0; k < N; ++k) {
        bool const high = (ends >> k) & 1;
        again = again || (high && a[k].lo == a[k].hi);
        x[k].set(double(high ? a[k].hi : a[k].lo), 0);
      }
      if (!again) wanted.include([&](mpfr_ptr r, mpfr_rnd_t mode) { exact(r, x, mode); });
    }
    interval<T> const got = operation(a);
    bool const holds = got.lo <= wanted.lo && wanted.hi <= got.hi;
    int const wider = std::max(numbers_between(got.lo, wanted.lo), numbers_between(wanted.hi, got.hi));
    bool const demanded = is_tight(wanted, a);
    if (!holds || wider > (demanded ? 0 : 1)) {
      CAPTURE(seed, n, demanded, a[0].lo, a[0].hi, a[N > 1].lo, a[N > 1].hi, a[N - 1].lo, a[N - 1].hi, got.lo, got.hi,
              wanted.lo, wanted.hi);
      REQUIRE(holds);
      REQUIRE(wider <= (demanded ? 0 : 1));
    }
    inexact += wanted.lo < wanted.hi;
    tight += demanded;
    widest = std::max(widest, wider);
  }
  CAPTURE(seed, inexact, tight, widest);
  CHECK(inexact > trials / 4);
  CHECK(tight > trials / 2);
}

template <class T> bool is_zero_or_above(T x, T least) { return x == 0 || std::abs(x) >= least; }

}  // namespace

static_assert(scalar<interval<float>> && scalar<interval<double>>);

TEMPLATE_TEST_CASE("sums and differences of intervals are the narrowest that hold all results", "", float, double) {
  using T = TestType;
  auto const operands = [](word_source<T>& random) -> std::array<interval<T>, 2> {
    int const low = least_exponent<T> - 4, high = greatest_exponent<T>;
    interval<T> const a = random_interval(random, low, high);
    if (random.below(4) == 0) return {a, random_interval(random, low, high)};
    int const e = std::ilogb(magnitude(a)), digits = std::numeric_limits<T>::digits;
    if (random.below(4) == 0) return {a, interval<T>(-next_up(a.lo), -a.lo)};
    return {a, random_interval(random, std::max(low, e - digits - 2), std::min(high, e + digits + 2))};
  };
  auto const always = [](auto const&, auto const&) { return true; };
  check_enclosure<T, 2>(
      1, operands, [](auto const& a) { return a[0] + a[1]; },
      [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_add(r, x[0], x[1], mode); }, always);
  check_enclosure<T, 2>(
      2, operands, [](auto const& a) { return a[0] - a[1]; },
      [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_sub(r, x[0], x[1], mode); }, always);
}

TEMPLATE_TEST_CASE("products of intervals are the narrowest that hold all results, but for tiny ones", "", float,
                   double) {
  using T = TestType;
  check_enclosure<T, 2>(
      3,
      [](word_source<T>& random) -> std::array<interval<T>, 2> {
        interval<T> const a = random_interval(random, least_exponent<T>, greatest_exponent<T>);
        int const e = std::ilogb(magnitude(a));
        return {a, random_interval(random, std::max(least_exponent<T> - 30 - e, least_exponent<T>),
                                   std::min(greatest_exponent<T> + 3 - e, greatest_exponent<T>))};
      },
      [](auto const& a) { return a[0] * a[1]; },
      [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_mul(r, x[0], x[1], mode); },
      [](enclosure<T> const& wanted, auto const&) {
        return is_zero_or_above(wanted.lo, detail::least_exact<T>) &&
               is_zero_or_above(wanted.hi, detail::least_exact<T>);
      });
}

TEMPLATE_TEST_CASE("quotients of intervals are the narrowest that hold all results, but of tiny ones", "", float,
                   double) {
  using T = TestType;
  check_enclosure<T, 2>(
      4,
      [](word_source<T>& random) -> std::array<interval<T>, 2> {
        interval<T> const a = random_interval(random, least_exponent<T>, greatest_exponent<T>);
        int const e = std::ilogb(magnitude(a));
        interval<T> const b = abs(random_interval(random, std::max(e - greatest_exponent<T> - 3, least_exponent<T>),
                                                  std::min(e - least_exponent<T> + 30, greatest_exponent<T>)));
        interval<T> const d(b.lo > 0 ? b.lo : b.hi, b.hi);
        return {a, random.below(2) ? d : -d};
      },
      [](auto const& a) { return a[0] / a[1]; },
      [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_div(r, x[0], x[1], mode); },
      [](enclosure<T> const&, auto const& a) {
        return is_zero_or_above(a[0].lo, detail::least_exact<T>) && is_zero_or_above(a[0].hi, detail::least_exact<T>);
      });
}

TEMPLATE_TEST_CASE("square roots and squares of intervals are the narrowest that hold all results, but for tiny ones",
                   "", float, double) {
  using T = TestType;
  auto const is_tight = [](auto const&, auto const& a) {
    return is_zero_or_above(a[0].lo, detail::least_exact<T>) && is_zero_or_above(a[0].hi, detail::least_exact<T>);
  };
  check_enclosure<T, 1>(
      5,
      [](word_source<T>& random) -> std::array<interval<T>, 1> {
        interval<T> const a = abs(random_interval(random, least_exponent<T> - 10, greatest_exponent<T>));
        if (random.below(2)) return {a};
        T const root = sqrt(a.hi);  // exact roots, and what is next to them
        return {interval<T>(next_down(root * root), root * root)};
      },
      [](auto const& a) { return sqrt(a[0]); }, [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_sqrt(r, x[0], mode); },
      is_tight);
  check_enclosure<T, 1>(
      6,
      [](word_source<T>& random) -> std::array<interval<T>, 1> {
        interval<T> const a = abs(random_interval(random, least_exponent<T> / 2 - 10, greatest_exponent<T> / 2 + 1));
        return {random.below(2) ? a : -a};
      },
      [](auto const& a) { return sqr(a[0]); }, [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_sqr(r, x[0], mode); },
      [](enclosure<T> const& wanted, auto const&) {
        return is_zero_or_above(wanted.lo, detail::least_exact<T>) &&
               is_zero_or_above(wanted.hi, detail::least_exact<T>);
      });
  CHECK((sqr(interval<T>(T(-2), T(1))).lo == 0 && sqr(interval<T>(T(-2), T(1))).hi == 4));
  CHECK((sqrt(interval<T>(T(-1), T(4))).lo == 0 && sqrt(interval<T>(T(-1), T(4))).hi == 2));
}

TEMPLATE_TEST_CASE("fma of intervals rounds each end once, but for tiny products", "", float, double) {
  using T = TestType;
  check_enclosure<T, 3>(
      7,
      [](word_source<T>& random) -> std::array<interval<T>, 3> {
        int const low = least_exponent<T> / 2, high = greatest_exponent<T> / 2, digits = std::numeric_limits<T>::digits;
        interval<T> const a = random_interval(random, low, high), b = random_interval(random, low, high);
        switch (random.below(4)) {
          case 0:
            return {a, b, interval<T>(-a.hi * b.hi)};
          case 1:
            return {a, b, interval<T>(next_down(-a.lo * b.hi), -a.lo * b.hi)};
          case 2:
            return {a, b, random_interval(random, least_exponent<T>, greatest_exponent<T>)};
          default: {
            int const e = std::ilogb(magnitude(a)) + std::ilogb(magnitude(b));
            return {a, b,
                    random_interval(random, std::max(e - 2 * digits, least_exponent<T>),
                                    std::min(e + 2 * digits, greatest_exponent<T>))};
          }
        }
      },
      [](auto const& a) { return fma(a[0], a[1], a[2]); },
      [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_fma(r, x[0], x[1], x[2], mode); },
      [](enclosure<T> const&, auto const& a) {
        T const least = detail::least_exact<T>;
        return is_zero_or_above(a[0].lo * a[1].lo, least) && is_zero_or_above(a[0].lo * a[1].hi, least) &&
               is_zero_or_above(a[0].hi * a[1].lo, least) && is_zero_or_above(a[0].hi * a[1].hi, least);
      });
}

namespace {

/// What is next to which, where an exact difference of products cancels all but its last bits.
template <class T> std::array<interval<T>, 4> cancelling(word_source<T>& random) {
  T const a = random(-20, 20), b = random(-20, 20), c = random(-20, 20);
  T d = a * b / c;
  for (int k = random.below(4); k > 0; --k) d = next_up(d);
  return {interval<T>(a), interval<T>(b), interval<T>(c), interval<T>(d)};
}

}  // namespace

TEMPLATE_TEST_CASE("differences of products of intervals hold all results, and of numbers are two numbers wide", "",
                   float, double) {
  using T = TestType;
  auto const exact = [](mpfr_ptr r, auto& x, mpfr_rnd_t mode) { mpfr_fmms(r, x[0], x[1], x[2], x[3], mode); };
  unsigned const seed = 8;
  word_source<T> random{std::mt19937_64(seed)};
  std::array<reference, 4> x;
  for (reference& end : x) mpfr_set_prec(end, std::numeric_limits<T>::digits);
  int undecided = 0;
  for (int n = 0; n < trials; ++n) {
    std::array<interval<T>, 4> a = cancelling(random);
    if (n % 4 == 0) a[std::size_t(random.below(4))] = random_interval(random, -20, 20);
    if (n % 8 == 0) a[std::size_t(random.below(4))] = random_interval(random, least_exponent<T>, greatest_exponent<T>);
    enclosure<T> wanted;
    bool single = true;
    for (unsigned ends = 0; ends < 16; ++ends) {
      bool again = false;
      for (std::size_t k = 0; k < 4; ++k) {
        bool const high = (ends >> k) & 1;
        again = again || (high && a[k].lo == a[k].hi);
        single = single && a[k].lo == a[k].hi;
        x[k].set(double(high ? a[k].hi : a[k].lo), 0);
      }
      if (!again) wanted.include([&](mpfr_ptr r, mpfr_rnd_t mode) { exact(r, x, mode); });
    }
    interval<T> const got = difference_of_products(a[0], a[1], a[2], a[3]);
    undecided += single && contains(got, T(0)) && !(wanted.lo <= 0 && 0 <= wanted.hi);
    bool ok = got.lo <= wanted.lo && wanted.hi <= got.hi;
    ok = ok && (!single || (numbers_between(got.lo, wanted.lo) <= 1 && numbers_between(wanted.hi, got.hi) <= 1));
    if (!ok) {
      CAPTURE(seed, n, single, a[0].lo, a[0].hi, a[1].lo, a[1].hi, a[2].lo, a[2].hi, a[3].lo, a[3].hi);
      CAPTURE(got.lo, wanted.lo, wanted.hi, got.hi);
      REQUIRE(ok);
    }
  }
  CHECK(undecided == 0);
}

namespace {

/// Every pair of special numbers as ends, NaN left out.
template <class T> std::vector<interval<T>> special_intervals() {
  auto const numbers = special_numbers<T>();
  std::vector<interval<T>> all;
  for (T const lo : numbers) {
    for (T const hi : numbers) {
      if (lo <= hi) all.push_back({lo, hi});
    }
  }
  return all;
}

/// [inf, inf] or [-inf, -inf].
template <class T> bool is_infinite_number(interval<T> a) {
  return a.lo == a.hi && std::abs(a.lo) > std::numeric_limits<T>::max();
}

/// `got` holds what MPFR makes of the ends; it is the whole line where that is nothing, and else no end is wider by
/// more than one number, unless an operand is infinity itself.
template <class T, class Exact>
void check_special(interval<T> got, interval<T> a, interval<T> b, reference& x, reference& y, Exact const& exact) {
  enclosure<T> wanted;
  for (T const p : {a.lo, a.hi}) {
    for (T const q : {b.lo, b.hi}) {
      x.set(double(p), 0);
      y.set(double(q), 0);
      bool undefined = false;
      auto const result = [&](mpfr_ptr r, mpfr_rnd_t mode) {
        exact(r, x, y, mode);
        undefined = mpfr_nan_p(r) != 0;
        if (undefined) mpfr_set_zero(r, 1);
      };
      enclosure<T> one;
      one.include(result);
      if (undefined) continue;
      wanted.lo = std::min(wanted.lo, one.lo);
      wanted.hi = std::max(wanted.hi, one.hi);
    }
  }
  bool ok = !wanted.valid() ? is_whole(got) : got.lo <= wanted.lo && wanted.hi <= got.hi;
  if (wanted.valid() && !is_infinite_number(a) && !is_infinite_number(b)) {
    ok = ok && numbers_between(got.lo, wanted.lo) <= 1 && numbers_between(wanted.hi, got.hi) <= 1;
  }
  if (!ok) {
    CAPTURE(a.lo, a.hi, b.lo, b.hi, got.lo, got.hi, wanted.lo, wanted.hi);
    REQUIRE(ok);
  }
}

}  // namespace

TEMPLATE_TEST_CASE("every operation on every pair of special intervals holds all results", "", float, double) {
  using T = TestType;
  auto const all = special_intervals<T>();
  reference x(std::numeric_limits<T>::digits), y(std::numeric_limits<T>::digits);
  auto const add = [](mpfr_ptr r, mpfr_ptr p, mpfr_ptr q, mpfr_rnd_t mode) { mpfr_add(r, p, q, mode); };
  auto const divide = [](mpfr_ptr r, mpfr_ptr p, mpfr_ptr q, mpfr_rnd_t mode) { mpfr_div(r, p, q, mode); };
  auto const root = [](mpfr_ptr r, mpfr_ptr p, mpfr_ptr, mpfr_rnd_t mode) { mpfr_sqrt(r, p, mode); };
  for (interval<T> const a : all) {
    interval<T> const radicand = a.hi < 0 ? a : interval<T>(std::max(a.lo, T(0)), a.hi);
    check_special(sqrt(a), radicand, interval<T>(T(0)), x, y, root);
    for (interval<T> const b : all) {
      bool const of_infinity = is_infinite_number(a) || is_infinite_number(b);
      check_special(a + b, a, b, x, y, add);
      check_special(a * b, a, b, x, y, [of_infinity](mpfr_ptr r, mpfr_ptr p, mpfr_ptr q, mpfr_rnd_t mode) {
        mpfr_mul(r, p, q, mode);
        if (mpfr_nan_p(r) && !of_infinity) mpfr_set_zero(r, 1);  // 0 times the bound of an unbounded set
      });
      if (!contains(b, T(0))) {
        check_special(a / b, a, b, x, y, divide);
      } else if (!is_whole(a / b)) {
        FAIL("a quotient by an interval that holds 0");
      }
    }
  }
}

TEMPLATE_TEST_CASE("fma of special intervals holds all results", "", float, double) {
  using T = TestType;
  using limits = std::numeric_limits<T>;
  T const numbers[] = {
      -limits::infinity(),  -limits::max(),           T(-1.5), -limits::min(), -limits::denorm_min(), T(0),
      limits::denorm_min(), 3 * limits::denorm_min(), T(1),    limits::max(),  limits::infinity()};
  std::vector<interval<T>> all;
  for (T const lo : numbers) {
    for (T const hi : numbers) {
      if (lo <= hi) all.push_back({lo, hi});
    }
  }
  reference x(limits::digits), y(limits::digits), z(limits::digits);
  for (interval<T> const a : all) {
    for (interval<T> const b : all) {
      bool const of_infinity = is_infinite_number(a) || is_infinite_number(b);
      for (interval<T> const c : all) {
        if (is_infinite_number(c)) continue;
        interval<T> const got = fma(a, b, c);
        for (bool const high : {false, true}) {
          T const end = high ? c.hi : c.lo;
          z.set(double(end), 0);
          // a b + one end of c, whose own side alone has to hold
          auto const sum = [&](mpfr_ptr r, mpfr_ptr p, mpfr_ptr q, mpfr_rnd_t mode) {
            mpfr_fma(r, p, q, z, mode);
            if (mpfr_nan_p(r) && !of_infinity && (mpfr_zero_p(p) || mpfr_zero_p(q))) mpfr_set(r, z, mode);
          };
          enclosure<T> wanted;
          for (T const p : {a.lo, a.hi}) {
            for (T const q : {b.lo, b.hi}) {
              x.set(double(p), 0);
              y.set(double(q), 0);
              bool undefined = false;
              enclosure<T> one;
              one.include([&](mpfr_ptr r, mpfr_rnd_t mode) {
                sum(r, x, y, mode);
                undefined = mpfr_nan_p(r) != 0;
                if (undefined) mpfr_set_zero(r, 1);
              });
              if (undefined) continue;
              wanted.lo = std::min(wanted.lo, one.lo);
              wanted.hi = std::max(wanted.hi, one.hi);
            }
          }
          if (!wanted.valid()) continue;
          bool const ok = got.lo <= wanted.lo && wanted.hi <= got.hi;
          if (!ok) {
            CAPTURE(a.lo, a.hi, b.lo, b.hi, c.lo, c.hi, got.lo, got.hi, wanted.lo, wanted.hi);
            REQUIRE(ok);
          }
        }
      }
    }
  }
}

TEMPLATE_TEST_CASE("what has no result is the whole line, of which nothing is certain", "", float, double) {
  using T = TestType;
  using I = interval<T>;
  T const inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
  CHECK(is_whole(I(nan)));
  CHECK(is_whole(I(inf) - I(inf)));
  CHECK(is_whole(I(inf) * I(T(0))));
  CHECK(is_whole(I(T(-1), T(1)) * I(-inf)));
  CHECK(is_whole(fma(I(T(0)), I(inf), I(T(1)))));
  CHECK(is_whole(I(T(1)) / I(T(-0.0))));
  CHECK(is_whole(I(T(1)) / I(T(-1), T(2))));
  CHECK(is_whole(sqrt(I(T(-2), T(-1)))));
  CHECK(I(inf) + I(T(1)) == I(inf));
  I const w = I::whole();
  CHECK_FALSE(w < I(inf));
  CHECK_FALSE(w <= I(T(0)));
  CHECK_FALSE(w == w);
  CHECK_FALSE(w != I(T(0)));
  CHECK(possibly_less(w, I(T(0))));
  CHECK(possibly_equal(w, w));
  CHECK_FALSE(is_inside(w, w));
  CHECK(contains(w, I(inf)));
}

TEMPLATE_TEST_CASE("comparisons are certain where they hold for all pairs, possible where for any", "", float, double) {
  using T = TestType;
  for (interval<T> const a : special_intervals<T>()) {
    for (interval<T> const b : special_intervals<T>()) {
      // the pairs that are least and most in favour
      bool ok = (a < b) == (a.hi < b.lo) && possibly_less(a, b) == (a.lo < b.hi);
      ok = ok && (a <= b) == (a.hi <= b.lo) && possibly_less_equal(a, b) == (a.lo <= b.hi);
      ok = ok && (a > b) == (b < a) && (a >= b) == (b <= a);
      ok = ok && (a == b) == (a.lo == a.hi && b.lo == b.hi && a.lo == b.lo) && (a != b) == !possibly_equal(a, b);
      ok = ok && possibly_equal(a, b) == !is_empty(intersection(a, b));
      ok = ok && contains(hull(a, b), a) && contains(hull(a, b), b) &&
           (contains(a, b) == (hull(a, b).lo == a.lo && hull(a, b).hi == a.hi));
      ok = ok && (is_empty(intersection(a, b)) || (contains(a, intersection(a, b)) && contains(b, intersection(a, b))));
      ok = ok && is_inside(a, b) == (contains(b, a) && a.lo != b.lo && a.hi != b.hi);
      for (T const x : {a.lo, a.hi}) {
        for (T const y : {b.lo, b.hi}) {
          ok = ok && contains(min(a, b), std::min(x, y)) && contains(max(a, b), std::max(x, y));
          ok = ok && contains(copysign(a, b), std::copysign(x, y)) && contains(abs(a), std::abs(x));
        }
      }
      ok = ok && (!contains(a, T(0)) || abs(a).lo == 0) && magnitude(a) == abs(a).hi;
      if (!ok) {
        CAPTURE(a.lo, a.hi, b.lo, b.hi);
        REQUIRE(ok);
      }
    }
  }
  CHECK(select(true, interval<T>(T(1)), interval<T>(T(2))) == interval<T>(T(1)));
  CHECK(select(false, interval<T>(T(1)), interval<T>(T(2))) == interval<T>(T(2)));
  CHECK(copysign(interval<T>(T(1), T(2)), interval<T>(T(-3), T(-2))).hi == -1);
  CHECK(copysign(interval<T>(T(-1), T(2)), interval<T>(T(3))).lo == 0);
  CHECK(copysign(interval<T>(T(1), T(2)), interval<T>(T(0))).lo == -2);
}

TEMPLATE_TEST_CASE("midpoints are inside, widths no less than what they measure", "", float, double) {
  using T = TestType;
  unsigned const seed = 9;
  word_source<T> random{std::mt19937_64(seed)};
  std::vector<interval<T>> all = special_intervals<T>();
  for (int n = 0; n < trials; ++n) all.push_back(random_interval(random, least_exponent<T> - 10, greatest_exponent<T>));
  reference w(std::numeric_limits<T>::digits);
  for (interval<T> const a : all) {
    T const m = midpoint(a);
    bool ok = contains(a, m) || is_infinite_number(a);
    ok = ok && std::abs(m) <= std::numeric_limits<T>::max();
    w.set(double(a.hi), 0);
    mpfr_sub_d(w, w, double(a.lo), MPFR_RNDU);
    T const wanted = w.template get<T>(MPFR_RNDU);
    ok = ok && (width(a) == wanted || wanted != wanted);
    w.set(double(a.lo), 0);
    mpfr_add_d(w, w, double(a.hi), MPFR_RNDN);
    mpfr_div_2ui(w, w, 1, MPFR_RNDN);
    T const middle = w.template get<T>(MPFR_RNDN);
    ok = ok &&
         (numbers_between(std::min(m, middle), std::max(m, middle)) <= 1 || wanted > std::numeric_limits<T>::max());
    if (!ok) {
      CAPTURE(seed, a.lo, a.hi, m, width(a), wanted);
      REQUIRE(ok);
    }
  }
  CHECK(midpoint(interval<T>(T(1), T(2))) == T(1.5));
  CHECK(static_cast<double>(interval<T>(T(1), T(2))) == 1.5);
}

TEST_CASE("conversions of intervals round outward, and once") {
  unsigned const seed = 10;
  word_source<double> random{std::mt19937_64(seed)};
  std::vector<double> all = special_numbers<double>();
  for (int n = 0; n < trials; ++n) all.push_back(random(-160, 130));
  reference x(53);
  for (double const a : all) {
    auto const f = convert<interval<float>>(a);
    x.set(a, 0);
    bool ok = a == a ? f.lo == x.get<float>(MPFR_RNDD) && f.hi == x.get<float>(MPFR_RNDU) : is_whole(f);
    auto const back = convert<interval<double>>(f);
    ok = ok && back.lo == double(f.lo) && back.hi == double(f.hi);
    auto const again = convert<interval<float>>(back);
    ok = ok && again.lo == f.lo && again.hi == f.hi;
    if (!ok) {
      CAPTURE(seed, a, f.lo, f.hi);
      REQUIRE(ok);
    }
  }
  using I = interval<float>;
  CHECK(I(16777217).lo == 16777216.f);
  CHECK(I(16777217).hi == 16777218.f);
  CHECK(I(lane_t<I>(0.5)) == I(0.5f));
  CHECK((power_of_two_below(I(3.f, 9.f)).lo == 2 && power_of_two_below(I(3.f, 9.f)).hi == 8));
  CHECK((power_of_two_below(I(-3.f, 9.f)).lo == 0));
  CHECK(next_down(0.f) == -std::numeric_limits<float>::denorm_min());
  CHECK(next_up(-0.f) == std::numeric_limits<float>::denorm_min());
}
