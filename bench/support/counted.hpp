// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <cstdint>
#include <limits>

namespace patchrt::bench {

/// A double that counts the floating-point operations of the kernel it runs through: 2 for a fused multiply-add, 1
/// for a sum, product, quotient or square root; none for signs, comparisons, minima and selections.
struct counted {
  double value;
  static inline std::uint64_t operations = 0;

  counted() = default;
  counted(double v) : value(v) {}  // NOLINT(google-explicit-constructor): constants enter kernels as T(2)
  explicit operator double() const { return value; }

  counted& operator+=(counted b) { return *this = *this + b; }
  counted& operator-=(counted b) { return *this = *this - b; }
  counted& operator*=(counted b) { return *this = *this * b; }
  counted& operator/=(counted b) { return *this = *this / b; }
  friend counted operator-(counted a) { return {-a.value}; }
  friend counted operator+(counted a, counted b) { return one(a.value + b.value); }
  friend counted operator-(counted a, counted b) { return one(a.value - b.value); }
  friend counted operator*(counted a, counted b) { return one(a.value * b.value); }
  friend counted operator/(counted a, counted b) { return one(a.value / b.value); }
  friend counted sqrt(counted a) { return one(std::sqrt(a.value)); }
  friend counted fma(counted a, counted b, counted c) {
    operations += 2;
    return {std::fma(a.value, b.value, c.value)};
  }
  friend counted abs(counted a) { return {std::fabs(a.value)}; }
  friend counted copysign(counted a, counted b) { return {std::copysign(a.value, b.value)}; }
  friend counted min(counted a, counted b) { return a.value < b.value ? a : b; }
  friend counted max(counted a, counted b) { return b.value < a.value ? a : b; }
  friend counted select(bool m, counted a, counted b) { return m ? a : b; }
  friend bool operator<(counted a, counted b) { return a.value < b.value; }
  friend bool operator<=(counted a, counted b) { return a.value <= b.value; }
  friend bool operator>(counted a, counted b) { return b.value < a.value; }
  friend bool operator>=(counted a, counted b) { return b.value <= a.value; }
  friend bool operator==(counted a, counted b) { return a.value == b.value; }

 private:
  static counted one(double v) {
    ++operations;
    return {v};
  }
};

/// Operations that f() takes.
template <class F> double count_operations(F&& f) {
  std::uint64_t const before = counted::operations;
  f();
  return double(counted::operations - before);
}

}  // namespace patchrt::bench

template <> class std::numeric_limits<patchrt::bench::counted> : public std::numeric_limits<double> {};
