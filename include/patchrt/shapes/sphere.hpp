// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/box.hpp>

#include <limits>

namespace patchrt {

/// The points at `radius` from `centre`: 16 bytes in float.
template <class T> struct sphere {
  vec3<T> centre;
  T radius;
};

/// The box of a sphere, wider than the tightest by no more than 2 eps (|centre| + 2 radius) a side.
template <class T> PATCHRT_HD box<T> bounds(sphere<T> const& s) {
  vec3<T> const slack = scale(absolute(s.centre), T(std::numeric_limits<lane_t<T>>::epsilon()));
  T const reach = abs(s.radius) * T(1 + 2 * std::numeric_limits<lane_t<T>>::epsilon());
  vec3<T> const half{slack.x + reach, slack.y + reach, slack.z + reach};
  return {difference(s.centre, half), sum(s.centre, half)};
}

}  // namespace patchrt
