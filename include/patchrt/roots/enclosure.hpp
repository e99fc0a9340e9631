// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <limits>

namespace patchrt {

/// What a proof asks of a number type beyond `scalar`: plain reals that bound a number, and how far an operation may be off.
///
/// `lower(x)` and `upper(x)` bound every value that x stands for, `centre(x)` is one of them as a T, `unit()` bounds the relative
/// error of a sum and of a product, and that of fma(a, b, c) relative to |ab| + |c|; it is 0 where a number carries its error itself.
template <class T> struct enclosure {
  using real = T;
  PATCHRT_INLINE static constexpr real unit() { return std::numeric_limits<T>::epsilon() / 2; }
  PATCHRT_INLINE static real lower(T x) { return x; }
  PATCHRT_INLINE static real upper(T x) { return x; }
  PATCHRT_INLINE static T centre(T x) { return x; }
};

/// The plain type that positions and bounds of T are kept in.
template <class T> using real_t = typename enclosure<T>::real;

}  // namespace patchrt
