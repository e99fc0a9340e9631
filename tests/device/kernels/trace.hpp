// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/hierarchy_search.hpp>

namespace patchrt::test {

/// One ray a thread through a mixed hierarchy, closest or any hit, at accuracy A; what is proved of it at `certified`.
template <accuracy A, bool AnyHit> struct trace_kernel {
  using T = search_scalar_t<A, float>;
  static constexpr int outputs = A == accuracy::certified ? 8 : 6;
  mixed_hierarchy_view hierarchy;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    lane_hit<T, float> const hit = intersect<A, AnyHit, float>(hierarchy, rays[i], true);
    T* const y = out + outputs * i;
    y[0] = T(hit.valid);
    y[1] = hit.valid ? hit.t : T(0);
    y[2] = hit.valid ? hit.u : T(0);
    y[3] = hit.valid ? hit.v : T(0);
    y[4] = hit.valid ? hit.error : T(0);
    y[5] = hit.valid ? T(std::bit_cast<std::int32_t>(hit.patch_bits)) : T(-1);
    if constexpr (A == accuracy::certified) {
      y[6] = T(hit.tangent);
      y[7] = T(hit.degenerate);
    }
  }
};

}  // namespace patchrt::test
