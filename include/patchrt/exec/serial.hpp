// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/config.hpp>
#include <patchrt/exec/executor.hpp>

#include <algorithm>

namespace patchrt {

/// Everything in the calling thread, in ascending order.
struct serial {
  static constexpr int concurrency() { return 1; }

  template <class F> void for_each(std::size_t n, F&& f) const {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }

  /// \pre grain > 0
  template <class F> void for_each_chunk(std::size_t n, std::size_t grain, F&& f) const {
    PATCHRT_EXPECTS(grain > 0);
    for (std::size_t begin = 0; begin < n;) {
      std::size_t const end = begin + std::min(grain, n - begin);
      f(begin, end);
      begin = end;
    }
  }
};

}  // namespace patchrt
