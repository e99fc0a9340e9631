// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/roots/enclosure.hpp>
#include <patchrt/roots/parameter_box.hpp>

namespace patchrt {

/// What is known of the roots in a box.
enum class root_kind {
  simple,    ///< exactly one root, whichever the true pair is
  multiple,  ///< two that cannot be told apart, one or none: f = g = 0 is a tangency within what is unknown of the pair
  degenerate  ///< anything: the pair is within its errors along a curve or over an area, or the search was given up
};

/// A box that may hold roots: |u' - u| <= radius_u, |v' - v| <= radius_v.
///
/// A pair that leaves the given one by no more than (residual_f, residual_g) has a root at (u, v) itself.
template <scalar T> struct isolated_root {
  T u, v;
  real_t<T> radius_u, radius_v;
  real_t<T> residual_f, residual_g;
  root_kind kind;
  bool on_border;  ///< the box is not in the domain's interior: a simple root may be just outside
};

/// All roots of a pair: every root in the domain, of whichever true pair, is in one of the boxes.
template <scalar T, int Capacity> struct isolation {
  isolated_root<T> roots[Capacity];
  int count;
  bool complete;  ///< false where the search ran out of steps or room, or the pair is not made of numbers
  int examined;   ///< boxes that were looked at: what the search took

  /// Whether nothing is left open: every box holds exactly one root.
  PATCHRT_HD bool is_certain() const {
    bool all = complete;
    for (int k = 0; k < count; ++k) all = all && roots[k].kind == root_kind::simple;
    return all;
  }
};

/// What an isolation may take, and where it looks.
template <scalar T> struct isolate_options {
  using R = real_t<T>;
  parameter_box<R> domain{R(0), R(1), R(0), R(1)};
  R widest_multiple = R(0x1p-5);  ///< boxes of undecided roots that are wider are `degenerate`
  int most_examined = 1024;       ///< after so many boxes what is left is reported; a contact takes 100 to 300
};

/// A pair of degrees (M, N) has 2 M N isolated roots at most (Bernshtein 1975); and room for what is left over.
template <int M, int N> inline constexpr int isolation_capacity = 2 * (M * N) + 2;

}  // namespace patchrt
