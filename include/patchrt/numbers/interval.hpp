// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/numbers/directed.hpp>

#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

/// The real numbers lo <= x <= hi: every operation gives an interval that holds the exact result for all x of its
/// operands.
///
/// Ends are rounded outward, only where they are inexact and by one number at most (`directed.hpp` says where that
/// cannot be told). No end is ever NaN: NaN, and operations without a result (inf - inf, 0 inf, division by an interval
/// that holds 0, the square root of an interval below 0), give the whole line, which every test of certainty fails. An
/// infinite end is a bound of an unbounded set; [inf, inf] is what T(infinity) is, more than any number. Empty where
/// lo > hi, which only `intersection` gives and no operation takes.
///
/// Comparisons are certain: true only where they are for all pairs, so that `!(a < b)` says that a >= b is possible,
/// and both a < b and b <= a may be false. `possibly_less` and its like say what may be.
template <std::floating_point T> struct interval {
  T lo;
  T hi;

  interval() = default;
  PATCHRT_INLINE constexpr interval(T x)  // NOLINT(google-explicit-constructor): as a float is a double
      : lo(x == x ? x : -infinity()), hi(x == x ? x : infinity()) {}
  /// [l, h]. \pre neither is NaN.
  PATCHRT_INLINE constexpr interval(T l, T h) : lo(l), hi(h) {}
  /// From the other floating-point types and integers of up to 53 bits: the narrowest interval that holds a.
  template <class A>
  requires(std::is_arithmetic_v<A> && !std::same_as<A, T> && std::numeric_limits<A>::digits <= 53) PATCHRT_INLINE
      explicit interval(A a)
      : interval(interval<double>(static_cast<double>(a))) {}
  template <class U>
  requires(!std::same_as<U, T>) PATCHRT_INLINE explicit interval(interval<U> a)
      : lo(convert_down<T>(static_cast<double>(a.lo))), hi(convert_up<T>(static_cast<double>(a.hi))) {}

  /// The number nearest to the midpoint.
  template <std::floating_point A> PATCHRT_INLINE explicit operator A() const {
    return static_cast<A>(midpoint(*this));
  }

  PATCHRT_INLINE static constexpr interval whole() { return {-infinity(), infinity()}; }

  PATCHRT_INLINE interval& operator+=(interval b) { return *this = *this + b; }
  PATCHRT_INLINE interval& operator-=(interval b) { return *this = *this - b; }
  PATCHRT_INLINE interval& operator*=(interval b) { return *this = *this * b; }
  PATCHRT_INLINE interval& operator/=(interval b) { return *this = *this / b; }

  PATCHRT_INLINE friend constexpr interval operator-(interval a) { return {-a.hi, -a.lo}; }
  PATCHRT_INLINE friend interval operator+(interval a, interval b) {
    return {add_down(a.lo, b.lo), add_up(a.hi, b.hi)};
  }
  PATCHRT_INLINE friend interval operator-(interval a, interval b) { return a + -b; }
  PATCHRT_HD friend interval operator*(interval a, interval b) {
    if (is_undefined_product(a, b)) return whole();
    factors const f(a, b);
    return {min(mul_down(f.least_lo, b.lo), mul_down(f.least_hi, b.hi)),
            max(mul_up(f.greatest_lo, b.lo), mul_up(f.greatest_hi, b.hi))};
  }
  PATCHRT_HD friend interval operator/(interval a, interval b) {
    if (contains(b, T(0))) return whole();
    bool const negative = b.hi < 0;
    interval const n = negative ? -a : a, d = negative ? -b : b;
    return {div_down(n.lo, n.lo >= 0 ? d.hi : d.lo), div_up(n.hi, n.hi >= 0 ? d.lo : d.hi)};
  }
  /// a b + c, each end rounded once.
  PATCHRT_HD friend interval fma(interval a, interval b, interval c) {
    if (is_undefined_product(a, b)) return whole();
    factors const f(a, b);
    return {min(fma_down(f.least_lo, b.lo, c.lo), fma_down(f.least_hi, b.hi, c.lo)),
            max(fma_up(f.greatest_lo, b.lo, c.hi), fma_up(f.greatest_hi, b.hi, c.hi))};
  }
  /// The square root of the part that is not negative.
  PATCHRT_HD friend interval sqrt(interval a) {
    if (a.hi < 0) return whole();
    return {sqrt_down(max(a.lo, T(0))), sqrt_up(a.hi)};
  }
  /// a a, which is never negative.
  PATCHRT_INLINE friend interval sqr(interval a) {
    interval const m = abs(a);
    return {mul_down(m.lo, m.lo), mul_up(m.hi, m.hi)};
  }
  PATCHRT_INLINE friend interval abs(interval a) {
    if (a.lo >= 0) return a;
    if (a.hi <= 0) return -a;
    return {T(0), max(-a.lo, a.hi)};
  }
  /// |a| with the sign of s: of either where s holds 0, which may have either.
  PATCHRT_INLINE friend interval copysign(interval a, interval s) {
    interval const m = abs(a);
    if (s.lo > 0) return m;
    if (s.hi < 0) return -m;
    return {-m.hi, m.hi};
  }
  PATCHRT_INLINE friend interval min(interval a, interval b) { return {min(a.lo, b.lo), min(a.hi, b.hi)}; }
  PATCHRT_INLINE friend interval max(interval a, interval b) { return {max(a.lo, b.lo), max(a.hi, b.hi)}; }
  PATCHRT_INLINE friend interval select(bool m, interval a, interval b) { return m ? a : b; }

  PATCHRT_INLINE friend constexpr bool operator<(interval a, interval b) { return a.hi < b.lo; }
  PATCHRT_INLINE friend constexpr bool operator<=(interval a, interval b) { return a.hi <= b.lo; }
  PATCHRT_INLINE friend constexpr bool operator>(interval a, interval b) { return b < a; }
  PATCHRT_INLINE friend constexpr bool operator>=(interval a, interval b) { return b <= a; }
  PATCHRT_INLINE friend constexpr bool operator==(interval a, interval b) { return a <= b && b <= a; }
  PATCHRT_INLINE friend constexpr bool operator!=(interval a, interval b) { return a < b || b < a; }
  PATCHRT_INLINE friend constexpr bool possibly_less(interval a, interval b) { return a.lo < b.hi; }
  PATCHRT_INLINE friend constexpr bool possibly_less_equal(interval a, interval b) { return a.lo <= b.hi; }
  PATCHRT_INLINE friend constexpr bool possibly_equal(interval a, interval b) { return a.lo <= b.hi && b.lo <= a.hi; }

  PATCHRT_INLINE friend constexpr bool contains(interval a, T x) { return a.lo <= x && x <= a.hi; }
  /// Whether a holds all of b. \pre b is not empty.
  PATCHRT_INLINE friend constexpr bool contains(interval a, interval b) { return a.lo <= b.lo && b.hi <= a.hi; }
  /// Whether all of a is in the interior of b: between its ends, on neither. Never where they share an infinite end.
  PATCHRT_INLINE friend constexpr bool is_inside(interval a, interval b) { return b.lo < a.lo && a.hi < b.hi; }
  PATCHRT_INLINE friend constexpr bool is_empty(interval a) { return !(a.lo <= a.hi); }
  PATCHRT_INLINE friend constexpr bool is_whole(interval a) { return a.lo == -infinity() && a.hi == infinity(); }

  /// The smallest interval that holds a and b.
  PATCHRT_INLINE friend interval hull(interval a, interval b) { return {min(a.lo, b.lo), max(a.hi, b.hi)}; }
  /// What a and b share; empty where they share nothing.
  PATCHRT_INLINE friend interval intersection(interval a, interval b) { return {max(a.lo, b.lo), min(a.hi, b.hi)}; }
  /// hi - lo rounded up.
  PATCHRT_INLINE friend T width(interval a) { return add_up(a.hi, -a.lo); }
  /// The greatest |x|.
  PATCHRT_INLINE friend T magnitude(interval a) { return max(abs(a.lo), abs(a.hi)); }
  /// A finite number in a, of finite ends the middle but for rounding; 0 of the whole line, +-max() of a half-line.
  PATCHRT_INLINE friend T midpoint(interval a) {
    constexpr T most = std::numeric_limits<T>::max();
    if (is_whole(a)) return T(0);
    T const l = max(a.lo, -most), h = min(a.hi, most);
    T const sum = l + h;
    return a.lo < -most ? -most : a.hi > most ? most : abs(sum) <= most ? T(0.5) * sum : T(0.5) * l + T(0.5) * h;
  }

  /// a b - c d with the least and the greatest of each product, the four of them exact and summed before they are
  /// rounded: of single numbers, which may cancel, to two ulps of the result and u^2 of the products.
  /// \note Kahan's form would take the same product twice, as if they were two.
  PATCHRT_HD friend interval difference_of_products(interval a, interval b, interval c, interval d) {
    auto const p = products(a, b), q = products(c, d);
    if (!(p.exact && q.exact)) return fma(a, b, -(c * d));
    return {difference_down(p.least, q.greatest), -difference_down(q.least, p.greatest)};
  }

 private:
  PATCHRT_INLINE static constexpr T infinity() { return std::numeric_limits<T>::infinity(); }

  /// Of a, the ends that make the products with b.lo and with b.hi least and greatest.
  struct factors {
    T least_lo, least_hi, greatest_lo, greatest_hi;
    PATCHRT_INLINE factors(interval a, interval b)
        : least_lo(b.lo >= 0 ? a.lo : a.hi),
          least_hi(b.hi >= 0 ? a.lo : a.hi),
          greatest_lo(b.lo >= 0 ? a.hi : a.lo),
          greatest_hi(b.hi >= 0 ? a.hi : a.lo) {}
  };
  /// 0 times what is infinite and nothing else.
  PATCHRT_INLINE static bool is_undefined_product(interval a, interval b) {
    return (is_infinite(a) && contains(b, T(0))) || (is_infinite(b) && contains(a, T(0)));
  }
  PATCHRT_INLINE static bool is_infinite(interval a) { return a.lo == infinity() || a.hi == -infinity(); }

  /// The least and the greatest product, and whether both are known exactly.
  struct product_range {
    error_free<T> least, greatest;
    bool exact;
  };
  PATCHRT_INLINE static product_range products(interval a, interval b) {
    factors const f(a, b);
    auto const l1 = two_prod(f.least_lo, b.lo), l2 = two_prod(f.least_hi, b.hi);
    auto const g1 = two_prod(f.greatest_lo, b.lo), g2 = two_prod(f.greatest_hi, b.hi);
    auto const is_less = [](error_free<T> p, error_free<T> q) {
      return p.value < q.value || (p.value == q.value && p.error < q.error);
    };
    auto const is_exact = [](T x, T y, error_free<T> p) {
      return x == 0 || y == 0 || (detail::least_exact<T> <= abs(p.value) && detail::is_finite(p.value));
    };
    return {is_less(l2, l1) ? l2 : l1, is_less(g1, g2) ? g2 : g1,
            is_exact(f.least_lo, b.lo, l1) && is_exact(f.least_hi, b.hi, l2) && is_exact(f.greatest_lo, b.lo, g1) &&
                is_exact(f.greatest_hi, b.hi, g2) && detail::is_finite(magnitude(a)) &&
                detail::is_finite(magnitude(b))};
  }
  /// p - q rounded down: once, and what is left of p and q twice before.
  PATCHRT_INLINE static T difference_down(error_free<T> p, error_free<T> q) {
    auto const s = two_sum(p.value, -q.value);
    return add_down(s.value, add_down(add_down(s.error, p.error), -q.error));
  }
};

/// One lane, which is the interval itself. `T(lane_t<T>(0.5))` is a half; of a constant that T cannot hold, `T(L(0.1))`
/// with T = interval<float> holds the double 0.1.
template <std::floating_point T> struct scalar_traits<interval<T>> {
  using lane = interval<T>;
  using mask = bool;
  template <class L> using rebind = L;
  static constexpr int lanes = 1;
};

template <std::floating_point T> PATCHRT_INLINE void store_lanes(interval<T> x, interval<T>* lanes) { *lanes = x; }
template <std::floating_point T> PATCHRT_INLINE void load_lanes(interval<T> const* lanes, interval<T>& x) {
  x = *lanes;
}
template <std::floating_point T> PATCHRT_INLINE interval<T> permute(interval<T> x, std::int32_t const*) { return x; }

/// 2^floor(log2 x) of all x in a that are not negative, subnormal numbers counting as 0.
template <std::floating_point T> PATCHRT_INLINE interval<T> power_of_two_below(interval<T> a) {
  return {power_of_two_below(max(a.lo, T(0))), power_of_two_below(max(a.hi, T(0)))};
}

}  // namespace patchrt

/// Of interval: those of its ends.
template <std::floating_point T> struct std::numeric_limits<patchrt::interval<T>> : std::numeric_limits<T> {
 private:
  using end = std::numeric_limits<T>;
  using number = patchrt::interval<T>;

 public:
  static constexpr bool is_iec559 = false;
  PATCHRT_HD static constexpr number epsilon() { return end::epsilon(); }
  PATCHRT_HD static constexpr number min() { return end::min(); }
  PATCHRT_HD static constexpr number max() { return end::max(); }
  PATCHRT_HD static constexpr number lowest() { return end::lowest(); }
  PATCHRT_HD static constexpr number denorm_min() { return end::denorm_min(); }
  PATCHRT_HD static constexpr number infinity() { return end::infinity(); }
  PATCHRT_HD static constexpr number quiet_NaN() { return number::whole(); }
};
