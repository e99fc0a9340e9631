// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Operations rounded down or up, by operations rounded to nearest: the sign of what rounding took says whether the
/// result is to be moved by one number. The rounding mode, which compilers ignore and devices lack, stays what it is.
///
/// Results are the nearest numbers on their side, but may be the next one where an exact product, dividend or radicand
/// below `detail::least_exact` in size makes that sign uncertain. Infinite operands are bounds of unbounded sets: their
/// products with 0 are 0, finite numbers divided by them are 0, and inf - inf and inf / inf are -inf rounded down, inf
/// rounded up. What overflows is max() on the side of 0.
/// \note Rump, Ogita, Oishi & Boldo, "Interval operations in rounding to nearest", BIT 49, 2009, moves always.

#include <patchrt/core/error_free.hpp>

#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

/// The greatest number below x; -infinity and NaN stay what they are.
template <std::floating_point T> PATCHRT_INLINE T next_down(T x) {
  using bits = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
  static_assert(sizeof(T) == sizeof(bits));
  if (x == 0) return -std::numeric_limits<T>::denorm_min();
  if (!(-std::numeric_limits<T>::max() <= x)) return x;
  auto const b = std::bit_cast<bits>(x);
  return std::bit_cast<T>(b < 0 ? b + 1 : b - 1);
}
/// The least number above x; infinity and NaN stay what they are.
template <std::floating_point T> PATCHRT_INLINE T next_up(T x) { return -next_down(-x); }

namespace detail {

/// Products of this size and above have an exact error that does not underflow.
template <class T>
inline constexpr T least_exact = std::numeric_limits<T>::min() /
                                 (std::numeric_limits<T>::epsilon() * std::numeric_limits<T>::epsilon());

/// x or, where it is above the exact result, the number below. \pre x is finite and not 0, or not above.
template <class T> PATCHRT_INLINE T lowered(T x, bool above) {
  using bits = std::conditional_t<sizeof(T) == 4, std::int32_t, std::int64_t>;
  auto const b = std::bit_cast<bits>(x);
  return std::bit_cast<T>(above ? (b < 0 ? b + 1 : b - 1) : b);
}

/// What an infinite or undefined result to nearest is rounded down; `exact` where an operand is infinite.
template <class T> PATCHRT_INLINE T lowered_infinity(T x, bool exact) {
  constexpr T inf = std::numeric_limits<T>::infinity();
  return x == inf ? (exact ? inf : std::numeric_limits<T>::max()) : -inf;
}

template <class T> PATCHRT_OUTLINE T mul_down_rarely(T a, T b, error_free<T> p) {
  if (a == 0 || b == 0) return T(0);
  if (!is_finite(p.value)) return lowered_infinity(p.value, !is_finite(a) || !is_finite(b));
  if (p.error > 0) return p.value;
  return p.value == 0 && (a < 0) == (b < 0) ? T(0) : next_down(p.value);
}

template <class T> PATCHRT_OUTLINE T div_down_rarely(T a, T b, T q, T rest) {
  if (a == 0 || (is_finite(a) && !is_finite(b))) return T(0);
  if (!is_finite(q)) return lowered_infinity(q, !is_finite(a));
  bool const positive = (a < 0) == (b < 0);
  if (q == 0) return positive ? T(0) : next_down(q);
  return rest != 0 && (rest < 0) == (b < 0) ? q : next_down(q);
}

template <class T> PATCHRT_OUTLINE T fma_down_rarely(T a, T b, T c, T r) {
  if (a == 0 || b == 0) return c;
  if (!is_finite(r)) return lowered_infinity(r, !is_finite(a) || !is_finite(b) || !is_finite(c));
  return c == 0 ? mul_down_rarely(a, b, two_prod(a, b)) : next_down(r);
}

}  // namespace detail

/// a + b rounded down.
template <std::floating_point T> PATCHRT_INLINE T add_down(T a, T b) {
  auto const s = two_sum(a, b);
  if (!detail::is_finite(s.value))
    return detail::lowered_infinity(s.value, !detail::is_finite(a) || !detail::is_finite(b));
  return detail::lowered(s.value, !(s.error >= 0));
}
/// a b rounded down.
template <std::floating_point T> PATCHRT_INLINE T mul_down(T a, T b) {
  auto const p = two_prod(a, b);
  if (!(detail::least_exact<T> <= abs(p.value) && detail::is_finite(p.value))) return detail::mul_down_rarely(a, b, p);
  return detail::lowered(p.value, p.error < 0);
}
/// a / b rounded down. \pre b != 0.
template <std::floating_point T> PATCHRT_INLINE T div_down(T a, T b) {
  T const q = a / b;
  T const rest = fma(-q, b, a);
  if (!(detail::least_exact<T> <= abs(a) && q != 0 && detail::is_finite(q)))
    return detail::div_down_rarely(a, b, q, rest);
  return detail::lowered(q, b < 0 ? rest > 0 : rest < 0);
}
/// sqrt(a) rounded down. \pre a >= 0.
template <std::floating_point T> PATCHRT_INLINE T sqrt_down(T a) {
  T const s = sqrt(a);
  if (a == 0 || !detail::is_finite(a)) return s;
  T const rest = fma(-s, s, a);
  return detail::lowered(s, detail::least_exact<T> <= a ? rest < 0 : rest <= 0);
}
/// a b + c rounded down, once.
/// \note The error is that of Boldo & Muller, "Exact and approximated error of the FMA", IEEE TC 60(2), 2011,
///       ErrFmaNearest, of which the sign is enough.
template <std::floating_point T> PATCHRT_INLINE T fma_down(T a, T b, T c) {
  T const r = fma(a, b, c);
  auto const p = two_prod(a, b);
  if (!(detail::least_exact<T> <= abs(p.value) && detail::is_finite(r))) return detail::fma_down_rarely(a, b, c, r);
  auto const low = two_sum(c, p.error);
  auto const high = two_sum(p.value, low.value);
  T const rest = ((high.value - r) + high.error) + low.error;
  return detail::lowered(r, !(rest >= 0));
}

/// The same rounded up.
template <std::floating_point T> PATCHRT_INLINE T add_up(T a, T b) { return -add_down(-a, -b); }
template <std::floating_point T> PATCHRT_INLINE T mul_up(T a, T b) { return -mul_down(-a, b); }
template <std::floating_point T> PATCHRT_INLINE T div_up(T a, T b) { return -div_down(-a, b); }
template <std::floating_point T> PATCHRT_INLINE T fma_up(T a, T b, T c) { return -fma_down(-a, b, -c); }
template <std::floating_point T> PATCHRT_INLINE T sqrt_up(T a) {
  T const s = sqrt(a);
  if (a == 0 || !detail::is_finite(a)) return s;
  T const rest = fma(-s, s, a);
  return -detail::lowered(-s, detail::least_exact<T> <= a ? rest > 0 : rest >= 0);
}

/// a in another type, rounded down or up.
template <std::floating_point T> PATCHRT_INLINE T convert_down(double a) {
  T const r = static_cast<T>(a);
  return static_cast<double>(r) <= a ? r : next_down(r);
}
template <std::floating_point T> PATCHRT_INLINE T convert_up(double a) { return -convert_down<T>(-a); }

}  // namespace patchrt
