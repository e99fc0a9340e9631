// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/vec.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace patchrt::examples {

/// Triangles over shared vertices, counter-clockwise seen from the side that their normals point to.
///
/// Vertices are doubles, as the control points of patches are; a kernel in float rounds each once.
struct mesh {
  std::vector<vec3<double>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace patchrt::examples
