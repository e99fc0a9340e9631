// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

/// The fixed-point numbers k 2^-fraction_bits, k a `Storage`, from -Range up to but not including Range.
///
/// `fixed<std::int16_t, 8>`, 12 bits of fraction, is what the ray engine's pixel shaders compute in. Every operation is
/// rounded once, to nearest, ties to even, and saturates: what is beyond the range is its nearest end. No floating
/// point takes part but in conversions.
///
/// There is no NaN and no infinity. Where IEEE arithmetic gives either, fixed gives the greatest number (the lowest for
/// -infinity): a / 0 for a >= 0, so also 0 / 0, sqrt of negative numbers, conversion of NaN. `numeric_limits::infinity`
/// is that same greatest number. A comparison `t < t_max` then fails for all of these, whatever t_max: as NaN is a
/// miss, so are they. `0 < x` holds of them, as it does of infinity: a kernel that bounds its results on both sides
/// takes no such value for a hit.
/// \tparam Storage a signed integer type of at most 32 bits.
/// \tparam Range a power of two, at least 2, so that 1 is a number. -Range is one; its negative and its `abs` are Range
///         less one unit.
/// \note Carr, Hall & Hart 2002, figure 4: in 16 bits over [-8, 8) rays leak through the teapot.
template <std::signed_integral Storage, int Range> class fixed {
  static_assert(sizeof(Storage) <= 4 && Range >= 2 && std::has_single_bit(unsigned(Range)));
  using limits = std::numeric_limits<Storage>;

 public:
  static constexpr int fraction_bits = limits::digits + 1 - std::bit_width(unsigned(Range));
  static_assert(fraction_bits >= 1);

  fixed() = default;
  /// float is exact in double, and so is scaling by a power of two that does not underflow.
  PATCHRT_INLINE constexpr explicit fixed(double x) : units_(units_of(x)) {}
  PATCHRT_INLINE constexpr explicit fixed(float x) : fixed(static_cast<double>(x)) {}
  /// Integers that double does not hold are out of range.
  template <std::integral I> PATCHRT_INLINE constexpr explicit fixed(I x) : fixed(static_cast<double>(x)) {}
  /// k 2^-fraction_bits.
  PATCHRT_INLINE static constexpr fixed from_units(Storage k) {
    fixed x;
    x.units_ = k;
    return x;
  }

  PATCHRT_INLINE constexpr Storage units() const { return units_; }
  /// Exact where float holds all bits of Storage, else rounded to nearest.
  PATCHRT_INLINE constexpr explicit operator float() const { return static_cast<float>(units_) / float(one); }
  PATCHRT_INLINE constexpr explicit operator double() const { return units_ / double(one); }

  PATCHRT_INLINE constexpr fixed operator-() const { return saturated(-wide(units_)); }
  PATCHRT_INLINE friend constexpr fixed operator+(fixed a, fixed b) { return saturated(wide(a.units_) + b.units_); }
  PATCHRT_INLINE friend constexpr fixed operator-(fixed a, fixed b) { return saturated(wide(a.units_) - b.units_); }
  PATCHRT_INLINE friend constexpr fixed operator*(fixed a, fixed b) { return descaled(wide(a.units_) * b.units_); }
  PATCHRT_INLINE friend constexpr fixed operator/(fixed a, fixed b) {
    if (b.units_ == 0) return from_units(a.units_ < 0 ? limits::min() : limits::max());
    wide const dividend = wide(a.units_) * one, divisor = b.units_;
    wide const n = dividend < 0 ? -dividend : dividend, d = divisor < 0 ? -divisor : divisor;
    wide quotient = n / d;
    wide const twice_rest = 2 * (n % d);
    if (twice_rest > d || (twice_rest == d && quotient % 2 != 0)) ++quotient;
    return saturated((dividend < 0) == (divisor < 0) ? quotient : -quotient);
  }
  PATCHRT_INLINE constexpr fixed& operator+=(fixed b) { return *this = *this + b; }
  PATCHRT_INLINE constexpr fixed& operator-=(fixed b) { return *this = *this - b; }
  PATCHRT_INLINE constexpr fixed& operator*=(fixed b) { return *this = *this * b; }
  PATCHRT_INLINE constexpr fixed& operator/=(fixed b) { return *this = *this / b; }

  PATCHRT_INLINE friend constexpr bool operator==(fixed a, fixed b) { return a.units_ == b.units_; }
  PATCHRT_INLINE friend constexpr bool operator<(fixed a, fixed b) { return a.units_ < b.units_; }
  PATCHRT_INLINE friend constexpr bool operator>(fixed a, fixed b) { return a.units_ > b.units_; }
  PATCHRT_INLINE friend constexpr bool operator<=(fixed a, fixed b) { return a.units_ <= b.units_; }
  PATCHRT_INLINE friend constexpr bool operator>=(fixed a, fixed b) { return a.units_ >= b.units_; }

  /// a b + c, rounded and saturated once: no part of it leaves 64 bits.
  PATCHRT_INLINE friend constexpr fixed fma(fixed a, fixed b, fixed c) {
    return descaled(wide(a.units_) * b.units_ + wide(c.units_) * one);
  }
  /// The root bit by bit, then to nearest; no root is half way between two numbers.
  PATCHRT_INLINE friend constexpr fixed sqrt(fixed a) {
    if (a.units_ < 0) return from_units(limits::max());
    wide const square = wide(a.units_) * one;
    wide root = 0;
    for (wide bit = wide(1) << ((limits::digits + fraction_bits) / 2); bit != 0; bit >>= 1) {
      if ((root + bit) * (root + bit) <= square) root += bit;
    }
    return saturated(square - root * root > root ? root + 1 : root);
  }
  PATCHRT_INLINE friend constexpr fixed abs(fixed a) { return a.units_ < 0 ? -a : a; }
  PATCHRT_INLINE friend constexpr fixed copysign(fixed magnitude, fixed sign) {
    return (magnitude.units_ < 0) == (sign.units_ < 0) ? magnitude : -magnitude;
  }
  PATCHRT_INLINE friend constexpr fixed min(fixed a, fixed b) { return a < b ? a : b; }
  PATCHRT_INLINE friend constexpr fixed max(fixed a, fixed b) { return b < a ? a : b; }
  PATCHRT_INLINE friend constexpr fixed select(bool m, fixed a, fixed b) { return m ? a : b; }
  /// \pre a >= 0.
  PATCHRT_INLINE friend constexpr fixed power_of_two_below(fixed a) {
    return from_units(static_cast<Storage>(std::bit_floor(static_cast<std::make_unsigned_t<Storage>>(a.units_))));
  }
  PATCHRT_INLINE friend void store_lanes(fixed x, fixed* lanes) { *lanes = x; }
  PATCHRT_INLINE friend void load_lanes(fixed const* lanes, fixed& x) { x = *lanes; }
  PATCHRT_INLINE friend fixed permute(fixed x, std::int32_t const*) { return x; }

 private:
  using wide = std::int64_t;
  static constexpr wide one = wide(1) << fraction_bits;

  PATCHRT_INLINE static constexpr fixed saturated(wide k) {
    if (k < limits::min()) return from_units(limits::min());
    if (k > limits::max()) return from_units(limits::max());
    return from_units(static_cast<Storage>(k));
  }
  /// k / one, to nearest, ties to even: the shift rounds down.
  PATCHRT_INLINE static constexpr fixed descaled(wide k) {
    wide const down = k >> fraction_bits, twice_rest = 2 * (k & (one - 1));
    return saturated(down + (twice_rest > one || (twice_rest == one && (down & 1) != 0)));
  }
  PATCHRT_INLINE static constexpr Storage units_of(double x) {
    double const scaled = x * double(one);
    if (!(scaled < double(limits::max()))) return limits::max();
    if (scaled < double(limits::min())) return limits::min();
    constexpr double integers = 0x1.8p52;  // the last place of doubles about here is 1
    return static_cast<Storage>((scaled + integers) - integers);
  }

  Storage units_;
};

}  // namespace patchrt

/// Those of a floating-point type as kernels use them: `min` is the least positive number, `epsilon` the step from 1 to
/// the next, both of them one unit; `infinity` and `quiet_NaN` are the greatest number, which stands for them.
template <class Storage, int Range> class std::numeric_limits<patchrt::fixed<Storage, Range>> {
  using fixed = patchrt::fixed<Storage, Range>;
  using storage = std::numeric_limits<Storage>;

 public:
  static constexpr bool is_specialized = true, is_signed = true, is_integer = false, is_exact = false;
  static constexpr bool has_infinity = false, has_quiet_NaN = false, has_signaling_NaN = false;
  static constexpr bool is_iec559 = false, is_bounded = true, is_modulo = false, traps = false, tinyness_before = false;
  static constexpr std::float_round_style round_style = std::round_to_nearest;
  static constexpr int radix = 2, digits = storage::digits, digits10 = storage::digits10;
  static constexpr int min_exponent = 1 - fixed::fraction_bits, max_exponent = storage::digits - fixed::fraction_bits;
  PATCHRT_INLINE static constexpr fixed min() noexcept { return fixed::from_units(1); }
  PATCHRT_INLINE static constexpr fixed max() noexcept { return fixed::from_units(storage::max()); }
  PATCHRT_INLINE static constexpr fixed lowest() noexcept { return fixed::from_units(storage::min()); }
  PATCHRT_INLINE static constexpr fixed epsilon() noexcept { return fixed::from_units(1); }
  PATCHRT_INLINE static constexpr fixed round_error() noexcept { return fixed(0.5); }
  PATCHRT_INLINE static constexpr fixed infinity() noexcept { return max(); }
  PATCHRT_INLINE static constexpr fixed quiet_NaN() noexcept { return max(); }
  PATCHRT_INLINE static constexpr fixed signaling_NaN() noexcept { return max(); }
  PATCHRT_INLINE static constexpr fixed denorm_min() noexcept { return min(); }
};
