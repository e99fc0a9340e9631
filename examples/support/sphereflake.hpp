// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/vec.hpp>

#include <vector>

namespace patchrt::examples {

struct flake_sphere {
  vec3<double> centre;
  double radius;
};

/// The spheres of a sphereflake: every sphere has nine children a third as large, outside and touching it, six around its
/// equator and three above; the equator's axis points away from the parent's centre. The first sphere has the centre
/// (0, 0, 0), the radius 1/2 and the axis z.
/// \return (9^(depth + 1) - 1) / 8 spheres, parents before their children; 7381 for depth 4.
/// \pre depth from 0 to 8.
/// \note Haines, "A Proposal for Standard Graphics Environments", IEEE CG&A 7(11), 1987; "balls" of his procedural databases.
std::vector<flake_sphere> sphereflake(int depth);

}  // namespace patchrt::examples
