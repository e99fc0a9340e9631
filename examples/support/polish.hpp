// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/bezier_patch.hpp>

namespace patchrt::examples {

/// The root that a hit approximates.
struct polished_root {
  long double t;      ///< In units of |direction|.
  long double moved;  ///< The distance along the ray from the hit to the root.
  bool confirmed;     ///< Whether the iteration ended in a root, close to where it began and in the patch.
};

/// Newton's iteration on Q(u, v) = origin + t direction in long double, from a hit (t, u, v) to the limit of long double.
///
/// A reference for hits in double: own evaluation (De Casteljau), own solution of the linear systems (full pivoting, by which
/// parameters that do not move the point, as at collapsed edges, stay as they are).
polished_root polish(bicubic_patch<double> const& patch, ray<double> const& r, double t, double u, double v);

}  // namespace patchrt::examples
