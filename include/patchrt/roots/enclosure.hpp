// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <concepts>
#include <limits>

namespace patchrt {

/// What a proof asks of a number type beyond `scalar`: plain reals that bound a number, and how far an operation may be
/// off.
///
/// `lower(x)` and `upper(x)` bound every value that x stands for, `centre(x)` is one of them as a T, `unit()` bounds
/// the relative error of a sum and of a product, and that of fma(a, b, c) relative to |ab| + |c|; it is 0 where a
/// number carries its error itself.
template <class T> struct enclosure {
  using real = T;
  PATCHRT_INLINE static constexpr real unit() { return std::numeric_limits<T>::epsilon() / 2; }
  PATCHRT_INLINE static real lower(T x) { return x; }
  PATCHRT_INLINE static real upper(T x) { return x; }
  PATCHRT_INLINE static T centre(T x) { return x; }
};

/// Of a number made of two plain ones, which are called `lo` and `hi`: the ends of an interval, or the words of a sum.
template <class T>
requires(std::floating_point<decltype(T::lo)>&& std::floating_point<decltype(T::hi)>) struct enclosure<T> {
  using real = decltype(T::hi);
  static constexpr bool is_interval = requires(T x, real r) {
    { contains(x, r) } -> std::same_as<bool>;
  };

  PATCHRT_INLINE static real unit() {
    if constexpr (is_interval) return real(0);
    else return std::numeric_limits<T>::epsilon().hi / 2;
  }
  /// The low word is half an ulp of the high one at most.
  PATCHRT_INLINE static real lower(T const& x) {
    if constexpr (is_interval) return x.lo;
    else return x.lo < 0 ? x.hi - std::numeric_limits<real>::epsilon() * abs(x.hi) : x.hi;
  }
  PATCHRT_INLINE static real upper(T const& x) {
    if constexpr (is_interval) return x.hi;
    else return x.lo > 0 ? x.hi + std::numeric_limits<real>::epsilon() * abs(x.hi) : x.hi;
  }
  PATCHRT_INLINE static T centre(T const& x) {
    if constexpr (is_interval) return T(midpoint(x));
    else return x;
  }
};

/// The plain type that positions and bounds of T are kept in.
template <class T> using real_t = typename enclosure<T>::real;

}  // namespace patchrt
