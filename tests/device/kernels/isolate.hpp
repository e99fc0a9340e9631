// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/roots/isolate.hpp>

namespace patchrt::test {

/// All roots of each pair of bicubic functions, with everything that is said of them. Places without a root are
/// written as 0.
template <class T> struct isolate_kernel {
  static constexpr int capacity = isolation_capacity<3, 3>;
  static constexpr int per_root = 8;
  static constexpr int outputs = 3 + per_root * capacity;
  bernstein_pair<T> const* pairs;
  isolate_options<T> const* options;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    isolation<T, capacity> const found = isolate(pairs[i], options[i]);
    T* y = out + outputs * i;
    *y++ = T(found.count);
    *y++ = T(found.complete);
    *y++ = T(found.examined);
    for (int k = 0; k < found.count; ++k) {
      isolated_root<T> const& root = found.roots[k];
      *y++ = root.u;
      *y++ = root.v;
      *y++ = root.radius_u;
      *y++ = root.radius_v;
      *y++ = root.residual_f;
      *y++ = root.residual_g;
      *y++ = T(static_cast<int>(root.kind));
      *y++ = T(root.on_border);
    }
    while (y != out + outputs * (i + 1)) *y++ = T(0);
  }
};

}  // namespace patchrt::test
