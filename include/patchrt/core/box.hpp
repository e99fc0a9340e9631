// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/vec.hpp>

#include <limits>

namespace patchrt {

/// The points lo <= x <= hi, component by component. Empty where lo > hi.
template <class T> struct box {
  vec3<T> lo;
  vec3<T> hi;

  /// The box that holds nothing: the neutral element of `merge`.
  PATCHRT_HD static box empty() {
    constexpr T inf = std::numeric_limits<T>::infinity();
    return {{inf, inf, inf}, {-inf, -inf, -inf}};
  }
  friend PATCHRT_HD bool operator==(box const& a, box const& b) { return a.lo == b.lo && a.hi == b.hi; }
};

/// The smallest box that holds a and b.
template <class T> PATCHRT_INLINE box<T> merge(box<T> const& a, box<T> const& b) {
  return {{min(a.lo.x, b.lo.x), min(a.lo.y, b.lo.y), min(a.lo.z, b.lo.z)},
          {max(a.hi.x, b.hi.x), max(a.hi.y, b.hi.y), max(a.hi.z, b.hi.z)}};
}

/// The smallest box that holds b and the point p.
template <class T> PATCHRT_INLINE box<T> merge(box<T> const& b, vec3<T> const& p) { return merge(b, box<T>{p, p}); }

template <class T> PATCHRT_INLINE bool is_empty(box<T> const& b) {
  return !(b.lo.x <= b.hi.x && b.lo.y <= b.hi.y && b.lo.z <= b.hi.z);
}

/// Whether a holds all of b; the empty box is held by every box.
template <class T> PATCHRT_INLINE bool contains(box<T> const& a, box<T> const& b) {
  return is_empty(b) || (a.lo.x <= b.lo.x && a.lo.y <= b.lo.y && a.lo.z <= b.lo.z && b.hi.x <= a.hi.x &&
                         b.hi.y <= a.hi.y && b.hi.z <= a.hi.z);
}

/// hi - lo; negative or NaN components where the box is empty.
template <class T> PATCHRT_INLINE vec3<T> extent(box<T> const& b) { return b.hi - b.lo; }

/// Half the surface area of a box that is not empty: the measure of the surface area heuristic.
template <class T> PATCHRT_INLINE T half_area(box<T> const& b) {
  vec3<T> const e = extent(b);
  return fma(e.x, e.y, fma(e.y, e.z, e.z * e.x));
}

}  // namespace patchrt
