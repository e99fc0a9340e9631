// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

namespace patchrt {

/// u_low <= u <= u_high, v_low <= v <= v_high.
template <class R> struct parameter_box { R u_low, u_high, v_low, v_high; };

/// Whether `a` is in `b`, borders included.
template <class R> PATCHRT_INLINE bool is_inside(parameter_box<R> const& a, parameter_box<R> const& b) {
  return b.u_low <= a.u_low && a.u_high <= b.u_high && b.v_low <= a.v_low && a.v_high <= b.v_high;
}

/// Whether `a` and `b` have a point in common, or are at most (slack_u, slack_v) apart.
template <class R>
PATCHRT_INLINE bool is_touching(parameter_box<R> const& a, parameter_box<R> const& b, R slack_u = R(0),
                                R slack_v = R(0)) {
  return a.u_low - b.u_high <= slack_u && b.u_low - a.u_high <= slack_u && a.v_low - b.v_high <= slack_v &&
         b.v_low - a.v_high <= slack_v;
}

}  // namespace patchrt
