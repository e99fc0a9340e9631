// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What PTX instructions compute, one function each, as the PTX ISA manual (9.0, section 9.7) defines them.
/// Registers hold bits: `get<T>` reads them as a T, `set` writes a T back.
///
/// NaN results have the bits the host gives them: the manual promises none.

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

namespace ptx {

using u8 = std::uint8_t;
using u16 = std::uint16_t;
using u32 = std::uint32_t;
using u64 = std::uint64_t;
using s8 = std::int8_t;
using s16 = std::int16_t;
using s32 = std::int32_t;
using s64 = std::int64_t;
using b8 = u8;
using b16 = u16;
using b32 = u32;
using b64 = u64;
using f32 = float;
using f64 = double;
using pred = bool;

template <int Bytes> struct bits_of_size;
template <> struct bits_of_size<1> { using type = u8; };
template <> struct bits_of_size<2> { using type = u16; };
template <> struct bits_of_size<4> { using type = u32; };
template <> struct bits_of_size<8> { using type = u64; };
/// The unsigned integer as wide as T.
template <class T> using bits_t = typename bits_of_size<sizeof(T)>::type;
template <class T> inline constexpr u32 width_v = 8 * sizeof(T);

/// The low bits of a register as a T.
template <class T, class Register> T get(Register r) {
  if constexpr (std::is_same_v<T, bool>) return r != 0;
  else return std::bit_cast<T>(static_cast<bits_t<T>>(r));
}

/// Writes a T into a register at least as wide: signed values extend their sign.
template <class Register, class T> void set(Register& r, T value) {
  if constexpr (std::is_same_v<T, bool> || (std::is_signed_v<T> && std::is_integral_v<T>))
    r = static_cast<Register>(value);
  else r = static_cast<Register>(std::bit_cast<bits_t<T>>(value));
}

template <class T> T load(char const* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}
template <class T> void store(char* at, T value) { std::memcpy(at, &value, sizeof value); }

// Arithmetic: floats round to nearest, integers wrap.

template <class T> inline constexpr bool is_float_v = std::is_floating_point_v<T>;

template <class T> T add(T a, T b) {
  if constexpr (is_float_v<T>) return a + b;
  else return T(bits_t<T>(a) + bits_t<T>(b));
}
template <class T> T sub(T a, T b) {
  if constexpr (is_float_v<T>) return a - b;
  else return T(bits_t<T>(a) - bits_t<T>(b));
}
template <class T> T mul(T a, T b) { return a * b; }
template <class T> T fma(T a, T b, T c) { return std::fma(a, b, c); }
template <class T> T sqrt(T a) { return std::sqrt(a); }
template <class T> T rcp(T a) { return T(1) / a; }
/// Division by zero gives all ones, as GPUs do; the manual calls it unspecified.
template <class T> T div(T a, T b) {
  if constexpr (is_float_v<T>) return a / b;
  else if constexpr (std::is_signed_v<T>) return b == 0 ? T(-1) : b == -1 ? sub(T(0), a) : T(a / b);
  else return b == 0 ? T(-1) : T(a / b);
}
template <class T> T rem(T a, T b) {
  if constexpr (std::is_signed_v<T>) return b == 0 ? a : b == -1 ? T(0) : T(a % b);
  else return b == 0 ? a : T(a % b);
}
template <class T> T neg(T a) {
  if constexpr (is_float_v<T>) return -a;
  else return sub(T(0), a);
}
template <class T> T abs(T a) {
  if constexpr (is_float_v<T>) return std::fabs(a);
  else return a < 0 ? neg(a) : a;
}
/// The other operand where one is NaN; -0 is below +0.
template <class T> T min(T a, T b) {
  if constexpr (is_float_v<T>) {
    if (a != a) return b;
    if (b != b) return a;
    if (a == b) return std::signbit(a) ? a : b;
  }
  return a < b ? a : b;
}
template <class T> T max(T a, T b) {
  if constexpr (is_float_v<T>) {
    if (a != a) return b;
    if (b != b) return a;
    if (a == b) return std::signbit(a) ? b : a;
  }
  return a > b ? a : b;
}
/// The value of b with the sign of a.
template <class T> T copysign(T a, T b) { return std::copysign(b, a); }
template <class T> bool unordered(T a, T b) { return a != a || b != b; }

template <class T> T mul_lo(T a, T b) { return T(u64(bits_t<T>(a)) * u64(bits_t<T>(b))); }
template <class T> T mul_hi(T a, T b) {
  using wide = std::conditional_t<std::is_signed_v<T>, __int128, unsigned __int128>;
  return T((wide(a) * wide(b)) >> width_v<T>);
}
/// The full product of two 16- or 32-bit integers.
template <class T> auto mul_wide(T a, T b) {
  using wide = std::conditional_t<std::is_signed_v<T>, std::conditional_t<sizeof(T) == 2, s32, s64>,
                                  std::conditional_t<sizeof(T) == 2, u32, u64>>;
  return mul_lo(wide(a), wide(b));
}
template <class T> T mad_lo(T a, T b, T c) { return add(mul_lo(a, b), c); }
template <class T> T mad_hi(T a, T b, T c) { return add(mul_hi(a, b), c); }
template <class T, class Wide> Wide mad_wide(T a, T b, Wide c) { return add(Wide(mul_wide(a, b)), c); }

// Bits. A shift by the width or more leaves nothing, or the sign.

template <class T> T bit_and(T a, T b) { return T(a & b); }
template <class T> T bit_or(T a, T b) { return T(a | b); }
template <class T> T bit_xor(T a, T b) { return T(a ^ b); }
template <class T> T bit_not(T a) {
  if constexpr (std::is_same_v<T, bool>) return !a;
  else return T(~a);
}
template <class T> T selp(T a, T b, bool p) { return p ? a : b; }
template <class T> T shl(T a, u32 n) { return n >= width_v<T> ? T(0) : T(bits_t<T>(a) << n); }
template <class T> T shr(T a, u32 n) {
  if (n >= width_v<T>) return std::is_signed_v<T> && a < 0 ? T(-1) : T(0);
  return T(a >> n);
}
inline u32 shf_l_clamp(u32 lo, u32 hi, u32 n) { return n >= 32 ? lo : u32(((u64(hi) << 32 | lo) << n) >> 32); }
inline u32 shf_r_clamp(u32 lo, u32 hi, u32 n) { return n >= 32 ? hi : u32((u64(hi) << 32 | lo) >> n); }
inline u32 shf_l_wrap(u32 lo, u32 hi, u32 n) { return shf_l_clamp(lo, hi, n & 31); }
inline u32 shf_r_wrap(u32 lo, u32 hi, u32 n) { return shf_r_clamp(lo, hi, n & 31); }
template <class T> u32 popc(T a) { return u32(std::popcount(bits_t<T>(a))); }
template <class T> u32 clz(T a) { return u32(std::countl_zero(bits_t<T>(a))); }
template <class T> T brev(T a) {
  T r = 0;
  for (u32 i = 0; i < width_v<T>; ++i) r = T(r | T((a >> i) & 1) << (width_v<T> - 1 - i));
  return r;
}
/// Position of the highest bit that differs from the sign (or shift that brings it to the top); all ones if there is
/// none.
template <class T, bool ShiftAmount> u32 bfind(T a) {
  bits_t<T> const v = std::is_signed_v<T> && a < 0 ? bits_t<T>(~a) : bits_t<T>(a);
  if (v == 0) return ~0u;
  u32 const zeros = u32(std::countl_zero(v));
  return ShiftAmount ? zeros : width_v<T> - 1 - zeros;
}
/// Four bytes picked from the eight of b:a, one hexadecimal digit of `selector` each; digit bit 3 spreads the byte's
/// sign.
inline u32 prmt(u32 a, u32 b, u32 selector) {
  u64 const bytes = u64(b) << 32 | a;
  u32 result = 0;
  for (u32 i = 0; i < 4; ++i) {
    u32 const digit = selector >> (4 * i) & 15u;
    u32 byte = u32(bytes >> (8 * (digit & 7u))) & 255u;
    if (digit & 8u) byte = byte & 128u ? 255u : 0u;
    result |= byte << (8 * i);
  }
  return result;
}
/// Bit by bit the function of three bits whose value at (a, b, c) is bit 4a + 2b + c of `table`.
inline u32 lop3(u32 a, u32 b, u32 c, u32 table) {
  u32 result = 0;
  for (u32 i = 0; i < 8; ++i)
    if (table >> i & 1u) result |= (i & 4u ? a : ~a) & (i & 2u ? b : ~b) & (i & 1u ? c : ~c);
  return result;
}
/// `length` bits of a from `position` up; signed T extends the highest bit taken.
template <class T> T bfe(T a, u32 position, u32 length) {
  position &= 255u;
  length &= 255u;
  if (length == 0) return 0;
  u32 const top = position + length - 1 < width_v<T> - 1 ? position + length - 1 : width_v<T> - 1;
  bool const sign = std::is_signed_v<T> && (bits_t<T>(a) >> top & 1u);
  bits_t<T> result = 0;
  for (u32 i = 0; i < width_v<T>; ++i) {
    bool const bit = i < length && position + i < width_v<T> ? bits_t<T>(a) >> (position + i) & 1u : sign;
    result |= bits_t<T>(bit) << i;
  }
  return T(result);
}
/// b with the low `length` bits of a put in from `position` up.
template <class T> T bfi(T a, T b, u32 position, u32 length) {
  position &= 255u;
  length &= 255u;
  for (u32 i = 0; i < length && position + i < width_v<T>; ++i) {
    T const mask = T(T(1) << (position + i));
    b = T((b & ~mask) | ((a >> i & 1u) ? mask : T(0)));
  }
  return b;
}

// Conversions.

enum class rounding { rni, rzi, rmi, rpi };

template <class T, rounding R> T round_to_integral(T a) {
  if constexpr (R == rounding::rni) return std::nearbyint(a);
  else if constexpr (R == rounding::rzi) return std::trunc(a);
  else if constexpr (R == rounding::rmi) return std::floor(a);
  else return std::ceil(a);
}

/// Floats to integers saturate; NaN gives 0 from f32 to at most 32 bits, else the top bit alone.
template <class To, class From> To convert(From a) {
  if constexpr (is_float_v<From> && !is_float_v<To>) {
    using limits = std::numeric_limits<To>;
    if (a != a) return sizeof(From) == 8 || sizeof(To) == 8 ? To(bits_t<To>(1) << (width_v<To> - 1)) : To(0);
    if (a <= From(limits::min())) return limits::min();
    if (a >= From(limits::max())) return limits::max();
    return To(a);
  } else {
    return static_cast<To>(a);
  }
}

}  // namespace ptx
