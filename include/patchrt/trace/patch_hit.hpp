// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <cstdint>
#include <limits>

namespace patchrt {

/// A ray's hit: t in units of |direction|, (u, v) in [0, 1]^2 on patch number `patch`; `patch` is -1 and t infinite for
/// a miss. `error` bounds the distance between S(u, v) and the point where the exact ray meets the exact patch, in the
/// user's units, rounded up to a float: to first order for `fast`, `refined` and `reference`, rigorously for
/// `certified`. Infinite where the ray touches the patch and that point cannot be told; S(u, v) is then still a point
/// of the patch that the ray passes within rounding.
struct patch_hit {
  double t = std::numeric_limits<double>::infinity();
  double u = 0, v = 0;
  float error = 0;
  std::int32_t patch = -1;

  bool valid() const { return patch >= 0; }
};

namespace trace::detail {
/// x in float, rounded up: two roundings down are made up for, for x >= 0 or infinite.
template <scalar T, scalar S> PATCHRT_INLINE T round_up(S x) {
  return convert<T>(x * S(lane_t<S>(1 + 0x1p-22))) + T(std::numeric_limits<float>::denorm_min());
}
}  // namespace trace::detail

}  // namespace patchrt
