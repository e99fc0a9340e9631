// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Double-word arithmetic: twice the digits of float or double from their own operations, every operation with a proven
/// bound on its relative error.
///
/// With u = epsilon / 2 of the words (2^-24, 2^-53):
///
///     operation   algorithm                                       relative error at most
///     +, -        AccurateDWPlusDW [1, algorithm 6]               3 u^2 / (1 - 4 u)     [1, theorem 3.1]
///     *           DWTimesDW3       [1, algorithm 12]              4 u^2                 [2, theorem 2.8]
///     /           DWDivDW2         [1, algorithm 17]              15 u^2 + 56 u^3       [1, theorem 7.1]
///     sqrt        SQRTDWtoDW       [3, algorithm 8]               25/8 u^2              [3]
///     fma         the first two, exact where they would cancel    12 u^2                below
///
/// [1] Joldes, Muller & Popescu, "Tight and rigorous error bounds for basic building blocks of double-word arithmetic",
/// ACM TOMS 44(2), 2017; [2] Muller & Rideau, "Formalization of double-word arithmetic, and comments on [1]", ACM TOMS
/// 48(1), 2022, where all bounds of [1] are proven in Coq, or corrected; [3] Lefevre, Louvet, Muller, Picot & Rideau,
/// "Accurate calculation of Euclidean norms using double-word arithmetic", ACM TOMS 49(1), 2023.
///
/// The bounds hold for sums and differences of all numbers up to max() / 2 in size; for products, quotients and roots
/// where neither they nor a dividend or radicand are below `std::numeric_limits<two_float<T>>::min()` (min() / u^2 of
/// the words) and dividends are at most max() / 2. Below and above, results are as good as T's own, give or take some
/// denorm_min().

#include <patchrt/core/error_free.hpp>

#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

/// The unevaluated sum hi + lo, with hi the number nearest to it, which makes the pair unique.
///
/// Infinities and NaN have lo = 0 and come out of operations as they do from T's: inf + 1 is inf, inf - inf is NaN,
/// 1 / 0 is inf. Zeros keep their sign. What overflows becomes an infinity, and so may what is within 3 u of the largest
/// number.
template <std::floating_point T> struct two_float {
  T hi;
  T lo;

  two_float() = default;
  PATCHRT_INLINE constexpr two_float(T h)  // NOLINT(google-explicit-constructor): as a float is a double
      : hi(h), lo(0) {}
  /// h + l. \pre h is the number nearest to h + l.
  PATCHRT_INLINE constexpr two_float(T h, T l) : hi(h), lo(l) {}
  /// From the other floating-point types and integers of up to 53 bits: exact where twice T's digits hold them.
  template <class A>
  requires(std::is_arithmetic_v<A> && !std::same_as<A, T> && std::numeric_limits<A>::digits <= 53) PATCHRT_INLINE
      explicit two_float(A a)
      : two_float(halves(static_cast<double>(a))) {}
  /// The same number in words of the other type, to u^2 of theirs.
  template <class U>
  requires(!std::same_as<U, T>) PATCHRT_INLINE explicit two_float(two_float<U> a) : two_float(T(0)) {
    T const h = static_cast<T>(a);
    *this = joined(h, static_cast<T>((static_cast<double>(a.hi) - static_cast<double>(h)) + static_cast<double>(a.lo)));
  }

  /// The nearest float or double.
  PATCHRT_INLINE explicit operator float() const {
    if constexpr (sizeof(T) == sizeof(float)) {
      return hi;
    } else {
      // Rounded to odd first, so that the second rounding is right: Boldo & Melquiond, IEEE TC 57(4), 2008.
      auto bits = std::bit_cast<std::int64_t>(hi);
      if (lo != 0 && bits % 2 == 0) bits += (lo < 0) == (hi < 0) ? 1 : -1;
      return static_cast<float>(std::bit_cast<double>(bits));
    }
  }
  PATCHRT_INLINE explicit operator double() const {
    if constexpr (sizeof(T) == sizeof(double)) return hi;
    else return static_cast<double>(hi) + static_cast<double>(lo);
  }

  PATCHRT_INLINE two_float& operator+=(two_float b) { return *this = *this + b; }
  PATCHRT_INLINE two_float& operator-=(two_float b) { return *this = *this - b; }
  PATCHRT_INLINE two_float& operator*=(two_float b) { return *this = *this * b; }
  PATCHRT_INLINE two_float& operator/=(two_float b) { return *this = *this / b; }

  PATCHRT_INLINE friend constexpr two_float operator-(two_float a) { return {-a.hi, -a.lo}; }
  PATCHRT_INLINE friend two_float operator+(two_float a, two_float b) {
    auto const s = two_sum(a.hi, b.hi);
    auto const t = two_sum(a.lo, b.lo);
    auto const v = fast_two_sum(s.value, s.error + t.value);
    auto const z = fast_two_sum(v.value, t.error + v.error);
    if (is_plain(z.value)) return {z.value, z.error};
    return s.value != 0 && v.value == v.value ? v.value : s.value;
  }
  PATCHRT_INLINE friend two_float operator-(two_float a, two_float b) { return a + -b; }
  PATCHRT_INLINE friend two_float operator*(two_float a, two_float b) {
    auto const c = two_prod(a.hi, b.hi);
    T const across = fma(a.lo, b.hi, fma(a.hi, b.lo, a.lo * b.lo));
    return settled(fast_two_sum(c.value, c.error + across), c.value);
  }
  PATCHRT_HD friend two_float operator/(two_float a, two_float b) {
    T const q = a.hi / b.hi;
    // b q by DWTimesFP1 [1, algorithm 7], whose smaller error theorem 7.1 rests on
    auto const c = two_prod(b.hi, q);
    auto const t = fast_two_sum(c.value, b.lo * q);
    auto const r = fast_two_sum(t.value, t.error + c.error);
    T const rest = (a.hi - r.value) + (a.lo - r.error);
    return settled(fast_two_sum(q, rest / b.hi), q);
  }

  PATCHRT_HD friend two_float sqrt(two_float a) {
    T const s = sqrt(a.hi);
    if (!(T(0) < a.hi && detail::is_finite(a.hi))) return s;
    T const rest = a.lo + fma(-s, s, a.hi);
    auto const z = fast_two_sum(s, rest / (T(2) * s));
    return {z.value, z.error};
  }

  /// a b + c to 12 u^2, however much of it cancels: so `difference_of_products` errs by 15 u^2 |a b - c d| + 96 u^4
  /// |c d| and terms of u^3 |a b - c d| at most.
  ///
  /// Where the sum s is at least half the product p in size, their own bounds make 3 u^2 |s| + 4 u^2 |p| <= 11 u^2 |s|
  /// and terms of u^3; else the ten words of the exact sum are added with more care, or without error.
  /// \pre |a b + c| >= min() of two_float<T>, no overflow.
  PATCHRT_HD friend two_float fma(two_float a, two_float b, two_float c) {
    two_float const p = a * b;
    two_float const s = p + c;
    return abs(s.hi) < T(0.5) * abs(p.hi) ? cancelling_fma(a, b, c) : s;
  }

  PATCHRT_INLINE friend two_float abs(two_float a) { return is_negative(a) ? -a : a; }
  PATCHRT_INLINE friend two_float copysign(two_float a, two_float s) {
    return is_negative(a) == is_negative(s) ? a : -a;
  }
  /// a where a < b, else b: b where either is NaN. `max` likewise.
  PATCHRT_INLINE friend two_float min(two_float a, two_float b) { return a < b ? a : b; }
  PATCHRT_INLINE friend two_float max(two_float a, two_float b) { return b < a ? a : b; }
  PATCHRT_INLINE friend two_float select(bool m, two_float a, two_float b) { return m ? a : b; }

  PATCHRT_INLINE friend bool operator<(two_float a, two_float b) {
    return a.hi < b.hi || (a.hi == b.hi && a.lo < b.lo);
  }
  PATCHRT_INLINE friend bool operator<=(two_float a, two_float b) {
    return a.hi < b.hi || (a.hi == b.hi && a.lo <= b.lo);
  }
  PATCHRT_INLINE friend bool operator>(two_float a, two_float b) { return b < a; }
  PATCHRT_INLINE friend bool operator>=(two_float a, two_float b) { return b <= a; }
  PATCHRT_INLINE friend bool operator==(two_float a, two_float b) { return a.hi == b.hi && a.lo == b.lo; }

 private:
  PATCHRT_INLINE static bool is_plain(T x) { return x != 0 && detail::is_finite(x); }
  PATCHRT_INLINE static bool is_negative(two_float a) { return copysign(T(1), a.hi) < 0; }

  /// z where it is a number other than 0; else the infinity that the last sum ran into, or what the high words alone
  /// give: a zero with its sign, an infinity, NaN.
  PATCHRT_INLINE static two_float settled(error_free<T> z, T leading) {
    if (is_plain(z.value)) return {z.value, z.error};
    return abs(z.value) == std::numeric_limits<T>::infinity() ? z.value : leading;
  }
  /// h + l for |l| of half an ulp of h at most, give or take the rounding of l.
  PATCHRT_INLINE static two_float joined(T h, T l) { return settled(fast_two_sum(h, l), h); }
  PATCHRT_INLINE static two_float halves(double a) {
    T const h = static_cast<T>(a);
    return joined(h, static_cast<T>(a - static_cast<double>(h)));
  }

  /// a b + c, where |a b + c| < |a b| / 2, from the exact sum of ten words.
  ///
  /// First without the roundings of words of the size u^2 |a b|, which come to u^2 |a b + c| + 128 u^3 |a b| at most:
  /// seven sums of words whose sizes add up to 18 u^2 |a b|, and the error of a.lo b.lo. Where 16 u |a b| or more is
  /// left, that is 9 u^2.
  ///
  /// Else the words are added one by one to an expansion whose words do not touch, small ones first, without error:
  /// GROW-EXPANSION of Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates",
  /// Discrete & Computational Geometry 18, 1997, theorem 10. Such words summed from the smallest give their sum to 3 u.
  /// That is done twice, the second time with the first sum taken away: 9 u^2 in all.
  PATCHRT_OUTLINE static two_float cancelling_fma(two_float a, two_float b, two_float c) {
    constexpr int words = 10;
    auto const p = two_prod(a.lo, b.lo), q = two_prod(a.hi, b.lo), r = two_prod(a.lo, b.hi), s = two_prod(a.hi, b.hi);
    auto const high = two_sum(s.value, c.hi);
    auto const t1 = two_sum(s.error, c.lo), t2 = two_sum(q.value, r.value), t3 = two_sum(t1.value, t2.value);
    auto const low = two_sum(high.error, t3.value);
    T const rest = ((p.value + (q.error + r.error)) + (t1.error + t2.error)) + (t3.error + low.error);
    auto const v = two_sum(high.value, low.value);
    auto const z = fast_two_sum(v.value, v.error + rest);
    if (T(8) * std::numeric_limits<T>::epsilon() * abs(s.value) <= abs(z.value)) return {z.value, z.error};

    T const term[words] = {p.error, p.value, q.error, r.error, q.value, r.value, s.error, c.lo, s.value, c.hi};
    T expansion[words + 1];
    auto const grow = [&expansion](int size, T x) {
      for (int i = 0; i < size; ++i) {
        auto const t = two_sum(x, expansion[i]);
        expansion[i] = t.error;
        x = t.value;
      }
      expansion[size] = x;
    };
    auto const total = [&expansion](int size) {
      T sum = expansion[0];
      for (int i = 1; i < size; ++i) sum = sum + expansion[i];
      return sum;
    };
    for (int k = 0; k < words; ++k) grow(k, term[k]);
    T const leading = total(words);
    grow(words, -leading);
    return joined(leading, total(words + 1));
  }
};

/// One lane, which is the number itself: lanes that are stored keep both words, and kernels that take epsilon of the
/// lane for their tolerances take two_float's. `T(lane_t<T>(0.5))` is a half.
template <std::floating_point T> struct scalar_traits<two_float<T>> {
  using lane = two_float<T>;
  using mask = bool;
  template <class L> using rebind = L;
  static constexpr int lanes = 1;
};

template <std::floating_point T> PATCHRT_INLINE void store_lanes(two_float<T> x, two_float<T>* lanes) { *lanes = x; }
template <std::floating_point T> PATCHRT_INLINE void load_lanes(two_float<T> const* lanes, two_float<T>& x) {
  x = *lanes;
}
template <std::floating_point T> PATCHRT_INLINE two_float<T> permute(two_float<T> x, std::int32_t const*) { return x; }

/// 2^floor(log2 a) for a > 0 with a normal high word; 0 and infinity stay what they are.
template <std::floating_point T> PATCHRT_INLINE two_float<T> power_of_two_below(two_float<T> a) {
  T const p = power_of_two_below(a.hi);
  return a.hi == p && a.lo < 0 ? T(0.5) * p : p;
}

}  // namespace patchrt

/// Of two_float: epsilon / 2 = 16 u^2 bounds the relative error of every operation, so that kernels' bounds in terms of
/// epsilon hold; min is where that begins.
template <std::floating_point T> struct std::numeric_limits<patchrt::two_float<T>> : std::numeric_limits<T> {
 private:
  using word = std::numeric_limits<T>;
  using number = patchrt::two_float<T>;

 public:
  static constexpr bool is_iec559 = false;
  static constexpr int digits = 2 * word::digits;
  PATCHRT_HD static constexpr number epsilon() { return T(8) * word::epsilon() * word::epsilon(); }
  PATCHRT_HD static constexpr number min() { return T(4) * word::min() / (word::epsilon() * word::epsilon()); }
  PATCHRT_HD static constexpr number max() { return {word::max(), word::max() * (word::epsilon() / T(4))}; }
  PATCHRT_HD static constexpr number lowest() { return -max(); }
  PATCHRT_HD static constexpr number denorm_min() { return word::denorm_min(); }
  PATCHRT_HD static constexpr number infinity() { return word::infinity(); }
  PATCHRT_HD static constexpr number quiet_NaN() { return word::quiet_NaN(); }
};
