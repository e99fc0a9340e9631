// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Sums and products together with what rounding took from them: what double-word arithmetic and directed rounding are
/// made of. They are exact in IEEE 754 arithmetic that rounds to nearest and keeps subnormal numbers, which is what
/// compilers give but for -ffast-math and its parts, -ffp-contract other than off, and nvcc's -use_fast_math and its
/// parts.

#if defined(__FAST_MATH__)
#  error "patchrt: -ffast-math reorders the sums that error-free transformations are made of"
#endif

#include <patchrt/core/scalar.hpp>

#include <limits>

namespace patchrt {

namespace detail {
template <class T> PATCHRT_INLINE bool is_finite(T x) { return abs(x) <= std::numeric_limits<T>::max(); }
}  // namespace detail

/// A result rounded to nearest, and the exact result less it.
template <scalar T> struct error_free {
  T value;
  T error;
};

/// a + b = value + error, exactly, subnormal numbers included. The error is NaN where the sum overflows or an operand
/// is not finite, and may be where one is max().
/// \note Moller, BIT 5, 1965; Knuth, The Art of Computer Programming 2, section 4.2.2. On overflow: Boldo, Graillat &
///       Muller, "On the robustness of the 2Sum and Fast2Sum algorithms", ACM TOMS 44(1), 2017.
template <scalar T> PATCHRT_INLINE error_free<T> two_sum(T a, T b) {
  T const s = a + b;
  T const t = s - a;
  return {s, (a - (s - t)) + (b - t)};
}

/// a + b = value + error, exactly.
/// \pre a = 0, or |b| <= |a|, or a is a multiple of b's last bit.
/// \note Dekker, Numerische Mathematik 18, 1971.
template <scalar T> PATCHRT_INLINE error_free<T> fast_two_sum(T a, T b) {
  T const s = a + b;
  return {s, b - (s - a)};
}

/// a b = value + error, exactly where |a b| >= 2 min() / epsilon(). For smaller products the error is rounded, to the
/// next multiple of denorm_min(), and then still has the right sign where it is not 0.
/// \note Muller et al., Handbook of Floating-Point Arithmetic, 2nd ed., section 4.4.
template <scalar T> PATCHRT_INLINE error_free<T> two_prod(T a, T b) {
  T const p = a * b;
  return {p, fma(a, b, -p)};
}

}  // namespace patchrt
