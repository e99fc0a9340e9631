// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What a kernel asks of its number type: arithmetic, `fma`, `sqrt`, `abs`, `copysign`, `min`, `max`, ordered
/// comparison giving `mask_t<T>`, `select`, `any_of`, `all_of`. Types other than float and double supply these by
/// argument-dependent lookup and specialise `scalar_traits` and, where they convert, `scalar_convert`.

#include <patchrt/core/config.hpp>

#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>

namespace patchrt {

/// How a number type is made up: the lane it is made of, how many lanes, and what its comparisons give.
template <class T> struct scalar_traits {
  using lane = T;
  using mask = bool;
  template <class L> using rebind = L;
  static constexpr int lanes = 1;
};
/// The type that comparisons of T give: bool, or one flag a lane.
template <class T> using mask_t = typename scalar_traits<T>::mask;
/// The type of one lane of T: float for float and for packs of float.
template <class T> using lane_t = typename scalar_traits<T>::lane;
/// As many lanes as T has, each an L: pack<double, 16> for pack<float, 16> and double.
template <class T, class L> using rebind_lane_t = typename scalar_traits<T>::template rebind<L>;
/// The number of lanes of T: 1 for everything but packs.
template <class T> inline constexpr int lanes_v = scalar_traits<T>::lanes;

template <std::floating_point T> PATCHRT_INLINE T fma(T a, T b, T c) { return std::fma(a, b, c); }
template <std::floating_point T> PATCHRT_INLINE T sqrt(T a) { return std::sqrt(a); }
template <std::floating_point T> PATCHRT_INLINE T abs(T a) { return std::fabs(a); }
template <std::floating_point T> PATCHRT_INLINE T copysign(T mag, T sgn) { return std::copysign(mag, sgn); }
/// a where a < b, else b: b where either is NaN.
template <std::floating_point T> PATCHRT_INLINE T min(T a, T b) { return a < b ? a : b; }
/// a where b < a, else b: b where either is NaN.
template <std::floating_point T> PATCHRT_INLINE T max(T a, T b) { return b < a ? a : b; }
/// 2^floor(log2 a) for normal a > 0, by its bits; 0 and infinity stay what they are.
PATCHRT_INLINE float power_of_two_below(float a) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(a) & 0x7f800000u);
}
PATCHRT_INLINE double power_of_two_below(double a) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(a) & 0x7ff0000000000000u);
}
template <std::floating_point T> PATCHRT_INLINE T select(bool m, T a, T b) { return m ? a : b; }
PATCHRT_INLINE constexpr bool all_of(bool m) { return m; }
PATCHRT_INLINE constexpr bool any_of(bool m) { return m; }

/// One bit a lane, lane 0 lowest; `convert` makes a mask of such bits again.
PATCHRT_INLINE constexpr unsigned mask_bits(bool m) { return m ? 1u : 0u; }
/// The lanes of x to an array.
template <std::floating_point T> PATCHRT_INLINE void store_lanes(T x, T* lanes) { *lanes = x; }

/// And from one.
template <std::floating_point T> PATCHRT_INLINE void load_lanes(T const* lanes, T& x) { x = *lanes; }
/// Lane i of the result is lane index[i] of x.
template <std::floating_point T> PATCHRT_INLINE T permute(T x, std::int32_t const*) { return x; }

/// The least of the lanes of x; unspecified where one is NaN.
template <std::floating_point T> PATCHRT_INLINE T least_lane(T x) { return x; }

/// A number with many lanes in parts that each fill a register: steps with many variables take one part at a time. What
/// has one lane is its own part.
template <class T> struct scalar_parts {
  using part = T;
  static constexpr int count = 1;
  PATCHRT_INLINE static T const& get(T const& x, int) { return x; }
  PATCHRT_INLINE static void set(T& x, int, T const& part) { x = part; }
};
template <class T> using part_t = typename scalar_parts<T>::part;

/// The conversion behind `convert`; specialised by number types with lanes.
template <class To, class From> struct scalar_convert {
  PATCHRT_INLINE static To apply(From a) { return static_cast<To>(a); }
};
/// a as a `To`, lane by lane, rounded to nearest.
template <class To, class From> PATCHRT_INLINE To convert(From a) { return scalar_convert<To, From>::apply(a); }

/// The operations the kernels use, and no more.
template <class T>
concept scalar = requires(T a, T b, T c, mask_t<T> m) {
  T(lane_t<T>(1));
  { a* b + c - a / b } -> std::convertible_to<T>;
  { -a } -> std::convertible_to<T>;
  { fma(a, b, c) } -> std::convertible_to<T>;
  { sqrt(a) } -> std::convertible_to<T>;
  { abs(a) } -> std::convertible_to<T>;
  { min(a, b) } -> std::convertible_to<T>;
  { max(a, b) } -> std::convertible_to<T>;
  { copysign(a, b) } -> std::convertible_to<T>;
  { a < b } -> std::convertible_to<mask_t<T>>;
  { a <= b } -> std::convertible_to<mask_t<T>>;
  { !m && (m || m) } -> std::convertible_to<mask_t<T>>;
  { select(m, a, b) } -> std::convertible_to<T>;
  { any_of(m) } -> std::convertible_to<bool>;
  { all_of(m) } -> std::convertible_to<bool>;
};

/// A number for all lanes of T, or one for each.
template <class B, class T>
concept lanes_of = std::same_as<B, T> || std::same_as<B, lane_t<T>>;

/// ab - cd by Kahan's compensated product: at most 1.5 ulp off without over- or underflow.
/// \note Jeannerod, Louvet & Muller, "Further analysis of Kahan's algorithm", Math. Comp. 82, 2013.
template <scalar T> PATCHRT_INLINE T difference_of_products(T a, T b, T c, T d) {
  T const cd = c * d;
  return fma(a, b, -cd) + fma(-c, d, cd);
}

/// a + t (b - a), exact at t = 0; one rounding more than the exact line elsewhere.
template <scalar T> PATCHRT_INLINE T lerp(T a, T b, T t) { return fma(t, b - a, a); }

}  // namespace patchrt
