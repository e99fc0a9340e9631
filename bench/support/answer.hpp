// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/ray.hpp>

#include <cstdint>

namespace patchrt::bench {

/// What is asked of a ray: its nearest hit, or only whether it has one.
enum class query { nearest, any };

/// What any of the compared methods says of one ray: the point origin + t direction, on `patch` at (u, v); patch -1:
/// a miss.
struct answer {
  double t;
  double u;
  double v;
  std::int32_t patch;
};

inline answer miss() { return {0, 0, 0, -1}; }
inline bool is_hit(answer const& a) { return a.patch >= 0; }

}  // namespace patchrt::bench
