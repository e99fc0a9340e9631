// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// A torus, as an example of a shape that patchrt does not know: all that a scene asks for is `bounds` and `intersect`.

#include <patchrt/core/box.hpp>
#include <patchrt/core/ray.hpp>

namespace patchrt::examples {

/// The points at `minor` from a circle of radius `major` about an axis.
struct torus {
  vec3<double> centre;
  vec3<double> axis;  ///< of length 1
  double major;
  double minor;
};

/// The nearest crossing in t_min < t < t_max; t and normal are unspecified where not `valid`.
struct torus_hit {
  double t;
  vec3<double> normal;  ///< of length 1, outward
  bool valid;
};

/// All t where a line crosses a torus, ascending.
struct torus_crossings {
  double t[4];
  int count;
};

/// The box of a torus, a few eps of its size and place wider than the tightest.
box<double> bounds(torus const& s);

/// All crossings of a line with a torus.
///
/// The line is moved to its point nearest the centre, where the distance from the surface times a positive number is a
/// quartic. Between the roots of its derivative, found between those of the second derivative, it has one root at most:
/// where the ends have different signs, Newton's iteration finds it, by halves where it would leave its bracket. The
/// last steps are on the distance itself, ((rho - major)^2 + z^2 - minor^2), which loses fewer digits.
/// \pre    0 < minor < major, |axis| = 1.
/// \return Each t within 1e-12 (|t| + major / |d|) where a ray does not graze. A ray that touches without crossing may
///         have no crossing there. None where a number is NaN or the direction is 0.
torus_crossings crossings(ray<double> const& r, torus const& s);

/// The nearest crossing of a ray.
torus_hit intersect(ray<double> const& r, torus const& s);

}  // namespace patchrt::examples
