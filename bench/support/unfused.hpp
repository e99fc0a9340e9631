// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <limits>

namespace patchrt::bench {

/// A float or double whose `fma` is a product and a sum, each rounded: what kernels compute on machines that do not fuse.
template <std::floating_point F> struct unfused {
  F value;

  unfused() = default;
  template <class A>
  requires std::is_arithmetic_v<A> unfused(A a)
      : value(static_cast<F>(a)) {}  // NOLINT(google-explicit-constructor): constants enter kernels as T(2)
  explicit operator double() const { return double(value); }

  friend unfused operator-(unfused a) { return -a.value; }
  friend unfused operator+(unfused a, unfused b) { return a.value + b.value; }
  friend unfused operator-(unfused a, unfused b) { return a.value - b.value; }
  friend unfused operator*(unfused a, unfused b) { return a.value * b.value; }
  friend unfused operator/(unfused a, unfused b) { return a.value / b.value; }
  unfused& operator+=(unfused b) { return *this = *this + b; }
  unfused& operator-=(unfused b) { return *this = *this - b; }
  unfused& operator*=(unfused b) { return *this = *this * b; }
  unfused& operator/=(unfused b) { return *this = *this / b; }
  friend bool operator==(unfused a, unfused b) { return a.value == b.value; }
  friend bool operator<(unfused a, unfused b) { return a.value < b.value; }
  friend bool operator<=(unfused a, unfused b) { return a.value <= b.value; }
  friend bool operator>(unfused a, unfused b) { return a.value > b.value; }
  friend bool operator>=(unfused a, unfused b) { return a.value >= b.value; }
  /// Two roundings: the project is compiled with -ffp-contract=off.
  friend unfused fma(unfused a, unfused b, unfused c) { return a.value * b.value + c.value; }
  friend unfused sqrt(unfused a) { return std::sqrt(a.value); }
  friend unfused abs(unfused a) { return std::fabs(a.value); }
  friend unfused copysign(unfused a, unfused b) { return std::copysign(a.value, b.value); }
  friend unfused min(unfused a, unfused b) { return patchrt::min(a.value, b.value); }
  friend unfused max(unfused a, unfused b) { return patchrt::max(a.value, b.value); }
  friend unfused select(bool m, unfused a, unfused b) { return m ? a : b; }
};

}  // namespace patchrt::bench

template <class F> class std::numeric_limits<patchrt::bench::unfused<F>> {
  using of_value = std::numeric_limits<F>;
  using number = patchrt::bench::unfused<F>;

 public:
  static constexpr bool is_specialized = true, is_iec559 = true;
  static number epsilon() { return of_value::epsilon(); }
  static number min() { return of_value::min(); }
  static number infinity() { return of_value::infinity(); }
};
