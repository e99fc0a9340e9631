// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

namespace detail {

/// x rounded once to binary16, ties to even, from binary32 or binary64; NaN becomes 0x7e00.
template <class F> PATCHRT_INLINE constexpr std::uint16_t round_to_half(F x) {
  using U = std::conditional_t<sizeof(F) == 4, std::uint32_t, std::uint64_t>;
  constexpr int kept = std::numeric_limits<F>::digits - 1;  // fraction bits
  constexpr int dropped = kept - 10;
  constexpr U exponent_gap = U(std::numeric_limits<F>::max_exponent - 16);
  constexpr U infinity = std::bit_cast<U>(std::numeric_limits<F>::infinity());
  U const all = std::bit_cast<U>(x);
  std::uint16_t const sign = static_cast<std::uint16_t>(all >> (8 * sizeof(F) - 16) & 0x8000u);
  U const magnitude = all & ~(U(1) << (8 * sizeof(F) - 1));
  if (magnitude > infinity) return 0x7e00u;
  if (magnitude >= (exponent_gap + 31) << kept) return static_cast<std::uint16_t>(sign | 0x7c00u);
  if (magnitude >= (exponent_gap + 1) << kept) {
    // A carry out of the fraction raises the exponent, up to that of infinity, as rounding should.
    U const half_less_tie = (U(1) << (dropped - 1)) - 1 + (magnitude >> dropped & 1u);
    return static_cast<std::uint16_t>(sign | (((magnitude + half_less_tie) >> dropped) - (exponent_gap << 10)));
  }
  // Below 2^-14 halves are the multiples of 2^-24, which is the last place of `unit`: the sum is rounded to one.
  constexpr F unit = F(U(1) << (kept - 1)) * F(0x1p-23);
  return static_cast<std::uint16_t>(sign |
                                    (std::bit_cast<U>(std::bit_cast<F>(magnitude) + unit) - std::bit_cast<U>(unit)));
}

PATCHRT_INLINE constexpr float half_to_float(std::uint16_t h) {
  std::uint32_t const sign = std::uint32_t(h & 0x8000u) << 16, magnitude = h & 0x7fffu;
  std::uint32_t bits = (magnitude << 13) + (112u << 23);
  if (magnitude >= 0x7c00u) bits = magnitude << 13 | 0x7f800000u;
  if (magnitude < 0x400u) bits = std::bit_cast<std::uint32_t>(float(magnitude) * 0x1p-24f);
  return std::bit_cast<float>(sign | bits);
}

}  // namespace detail

/// IEEE 754 binary16: 16 bits of storage, 11 bits of precision, 2^-14 to 65504 and subnormals down to 2^-24.
///
/// Every operation and every conversion to `half` is rounded once, to nearest, ties to even, with infinities, signed
/// zeros and gradual underflow; NaN that an operation makes is 0x7e00, so that all machines agree. Emulated: operations
/// are float's (`fma` double's), and this second rounding never shows. With m the middle between two neighbouring
/// halves, which has at most 12 bits, what could go wrong is that float rounds an exact result beside m to m:
/// - a b has 22 bits: nothing is rounded in float.
/// - a + b with exponents e >= f: up to e = f + 12 the sum has at most 24 bits. Beyond, |b| < 2^(e - 12), a multiple of
///   2^(e - 23), while m is 2^(e - 12) or more from a: the sum is 2^(e - 23) or more from m, and float's error is at
///   most 2^(e - 24).
/// - |a / b - m| = |a - m b| / |b|, and m b has at most 23 bits: unless zero this is more than 2^-23 m (2^-11 m where
///   the last place of a is below that of m b); float's error is at most 2^-24 m.
/// - sqrt(a) with 2^e the last place of m in 12 bits: a and m^2 are multiples of 2^(2 e), so that
///   |sqrt(a) - m| = |a - m^2| / (sqrt(a) + m) > 2^(2 e) / 2^(e + 13) = 2^(e - 13), float's largest error.
/// \note Figueroa, "When is double rounding innocuous?", SIGNUM Newsletter 30(3), 1995: p >= 2 q + 2 digits suffice for
///       normal results, here 24 = 2 * 11 + 2; the above includes subnormal ones.
class half {
 public:
  half() = default;
  PATCHRT_INLINE constexpr explicit half(float x) : bits_(detail::round_to_half(x)) {}
  PATCHRT_INLINE constexpr explicit half(double x) : bits_(detail::round_to_half(x)) {}
  /// Integers that double does not hold are infinite as halves.
  template <std::integral I> PATCHRT_INLINE constexpr explicit half(I x) : half(static_cast<double>(x)) {}
  PATCHRT_INLINE static constexpr half from_bits(std::uint16_t bits) {
    half h;
    h.bits_ = bits;
    return h;
  }

  PATCHRT_INLINE constexpr std::uint16_t bits() const { return bits_; }
  PATCHRT_INLINE constexpr explicit operator float() const { return detail::half_to_float(bits_); }
  PATCHRT_INLINE constexpr explicit operator double() const { return detail::half_to_float(bits_); }

  PATCHRT_INLINE constexpr half operator-() const { return from_bits(bits_ ^ 0x8000u); }
  PATCHRT_INLINE friend constexpr half operator+(half a, half b) { return half(float(a) + float(b)); }
  PATCHRT_INLINE friend constexpr half operator-(half a, half b) { return half(float(a) - float(b)); }
  PATCHRT_INLINE friend constexpr half operator*(half a, half b) { return half(float(a) * float(b)); }
  PATCHRT_INLINE friend constexpr half operator/(half a, half b) { return half(float(a) / float(b)); }
  PATCHRT_INLINE constexpr half& operator+=(half b) { return *this = *this + b; }
  PATCHRT_INLINE constexpr half& operator-=(half b) { return *this = *this - b; }
  PATCHRT_INLINE constexpr half& operator*=(half b) { return *this = *this * b; }
  PATCHRT_INLINE constexpr half& operator/=(half b) { return *this = *this / b; }

  PATCHRT_INLINE friend constexpr bool operator==(half a, half b) { return float(a) == float(b); }
  PATCHRT_INLINE friend constexpr bool operator<(half a, half b) { return float(a) < float(b); }
  PATCHRT_INLINE friend constexpr bool operator>(half a, half b) { return float(a) > float(b); }
  PATCHRT_INLINE friend constexpr bool operator<=(half a, half b) { return float(a) <= float(b); }
  PATCHRT_INLINE friend constexpr bool operator>=(half a, half b) { return float(a) >= float(b); }

  /// a b + c in one rounding.
  ///
  /// p = a b is exact in double, a multiple of 2^(d - 21) where 2^d <= |p| < 2^(d + 1); let e be the exponent of c.
  /// Where |p| >= 2^17 the sum overflows either way. Where e <= d + 30 and d <= 16, p + c is exact: a multiple of
  /// 2^(d - 21) or of 2^-24, whichever is less, below 2^(max(d, e) + 2), which makes at most 53 bits in the first case
  /// and 42 in the second. Where e > d + 30, |p| < 2^(e - 30), and the middles around c, at least 2^(e - 12) away, are
  /// doubles that the sum does not reach.
  PATCHRT_INLINE friend constexpr half fma(half a, half b, half c) { return half(double(a) * double(b) + double(c)); }
  PATCHRT_INLINE friend half sqrt(half a) { return half(patchrt::sqrt(float(a))); }
  PATCHRT_INLINE friend constexpr half abs(half a) { return from_bits(a.bits_ & 0x7fffu); }
  PATCHRT_INLINE friend constexpr half copysign(half magnitude, half sign) {
    return from_bits(static_cast<std::uint16_t>((magnitude.bits_ & 0x7fffu) | (sign.bits_ & 0x8000u)));
  }
  PATCHRT_INLINE friend constexpr half min(half a, half b) { return a < b ? a : b; }
  PATCHRT_INLINE friend constexpr half max(half a, half b) { return b < a ? a : b; }
  PATCHRT_INLINE friend constexpr half select(bool m, half a, half b) { return m ? a : b; }
  PATCHRT_INLINE friend constexpr half power_of_two_below(half a) { return from_bits(a.bits_ & 0x7c00u); }
  PATCHRT_INLINE friend void store_lanes(half x, half* lanes) { *lanes = x; }
  PATCHRT_INLINE friend void load_lanes(half const* lanes, half& x) { x = *lanes; }
  PATCHRT_INLINE friend half permute(half x, std::int32_t const*) { return x; }

 private:
  std::uint16_t bits_;
};

/// Two halves that share 32 bits.
struct half_pair {
  half low;
  half high;
};

/// Two halves in 32 bits, `low` in the lower ones: three such words and an object's number are a hit point with its
/// normal.
/// \note Wood, McCane & King 2004, figure 5.
PATCHRT_INLINE constexpr std::uint32_t pack_halves(half low, half high) {
  return low.bits() | std::uint32_t(high.bits()) << 16;
}

/// The inverse of `pack_halves`.
PATCHRT_INLINE constexpr half_pair unpack_halves(std::uint32_t both) {
  return {half::from_bits(static_cast<std::uint16_t>(both & 0xffffu)),
          half::from_bits(static_cast<std::uint16_t>(both >> 16))};
}

}  // namespace patchrt

/// binary16's, as those of float and double.
template <> class std::numeric_limits<patchrt::half> {
  using half = patchrt::half;

 public:
  static constexpr bool is_specialized = true, is_signed = true, is_integer = false, is_exact = false;
  static constexpr bool has_infinity = true, has_quiet_NaN = true, has_signaling_NaN = false;
  static constexpr bool is_iec559 = true, is_bounded = true, is_modulo = false, traps = false, tinyness_before = false;
  static constexpr std::float_round_style round_style = std::round_to_nearest;
  static constexpr int radix = 2, digits = 11, digits10 = 3, max_digits10 = 5;
  static constexpr int min_exponent = -13, min_exponent10 = -4, max_exponent = 16, max_exponent10 = 4;
  PATCHRT_INLINE static constexpr half min() noexcept { return half::from_bits(0x0400u); }
  PATCHRT_INLINE static constexpr half max() noexcept { return half::from_bits(0x7bffu); }
  PATCHRT_INLINE static constexpr half lowest() noexcept { return half::from_bits(0xfbffu); }
  PATCHRT_INLINE static constexpr half epsilon() noexcept { return half::from_bits(0x1400u); }
  PATCHRT_INLINE static constexpr half round_error() noexcept { return half::from_bits(0x3800u); }
  PATCHRT_INLINE static constexpr half infinity() noexcept { return half::from_bits(0x7c00u); }
  PATCHRT_INLINE static constexpr half quiet_NaN() noexcept { return half::from_bits(0x7e00u); }
  PATCHRT_INLINE static constexpr half signaling_NaN() noexcept { return half::from_bits(0x7d00u); }
  PATCHRT_INLINE static constexpr half denorm_min() noexcept { return half::from_bits(0x0001u); }
};
