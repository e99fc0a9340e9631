// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// MPFR for tests of number types: exact sums of words, results far more precise than what is tested, and operands.

#include "support/catch.hpp"

#include <mpfr.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

namespace patchrt::test {

/// A number of MPFR with enough bits for any sum or product of a few floats or doubles; set by what MPFR calls it.
class reference {
 public:
  explicit reference(mpfr_prec_t bits = 640) { mpfr_init2(x_, bits); }
  ~reference() { mpfr_clear(x_); }
  reference(reference const&) = delete;
  reference& operator=(reference const&) = delete;
  operator mpfr_ptr() { return x_; }  // NOLINT(google-explicit-constructor): what MPFR's functions take

  /// hi + lo.
  reference& set(double hi, double lo) {
    mpfr_set_d(x_, hi, MPFR_RNDN);
    if (lo != 0) mpfr_add_d(x_, x_, lo, MPFR_RNDN);  // -0 stays -0
    return *this;
  }
  /// The nearest T in the direction `mode`, subnormal ones included.
  template <class T> T get(mpfr_rnd_t mode) {
    if constexpr (sizeof(T) == sizeof(float)) return mpfr_get_flt(x_, mode);
    else return mpfr_get_d(x_, mode);
  }

 private:
  mpfr_t x_;
};

/// Random words of binary exponents in [low, high] and either sign.
template <class T> struct word_source {
  std::mt19937_64 generator;
  T operator()(int low, int high) {
    constexpr int digits = std::numeric_limits<T>::digits;
    T const significand = T(1) + T(generator() >> (65 - digits)) * std::numeric_limits<T>::epsilon();
    auto const span = unsigned(high - low + 1);
    int const exponent = low + int((generator() >> 20) % span);
    return std::ldexp(generator() & 1 ? significand / 2 : -significand / 2, exponent + 1);
  }
  int below(int n) { return int((generator() >> 30) % unsigned(n)); }
};

/// The exponents of normal numbers.
template <class T> inline constexpr int least_exponent = std::numeric_limits<T>::min_exponent - 1;
template <class T> inline constexpr int greatest_exponent = std::numeric_limits<T>::max_exponent - 1;

/// Zeros, subnormal numbers, powers of two and their neighbours, the largest numbers, infinities and NaN, in both
/// signs.
template <class T> std::vector<T> special_numbers() {
  using limits = std::numeric_limits<T>;
  std::vector<T> all;
  for (T const x : {T(0),
                    limits::denorm_min(),
                    3 * limits::denorm_min(),
                    limits::min() - limits::denorm_min(),
                    limits::min(),
                    3 * limits::min(),
                    limits::min() / limits::epsilon(),
                    std::sqrt(limits::min()),
                    limits::epsilon(),
                    T(0.1),
                    T(0.5),
                    1 - limits::epsilon() / 2,
                    T(1),
                    1 + limits::epsilon(),
                    T(3),
                    T(10),
                    1 / limits::epsilon(),
                    std::sqrt(limits::max()),
                    limits::max() / 2,
                    limits::max(),
                    limits::infinity()}) {
    all.push_back(x);
    all.push_back(-x);
  }
  all.push_back(limits::quiet_NaN());
  return all;
}

}  // namespace patchrt::test
