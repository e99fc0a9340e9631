// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Patches that meet at edges, or nearly so.

#include "support/rays.hpp"

#include <patchrt/shapes/bezier_split.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace patchrt::test {

/// A sheet cut into 3 x 3 patches that meet in lines of the parameters.
inline patch_list cut_sheet(bicubic_patch<double> const& sheet) {
  patch_list parts;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) parts.push_back(sub_patch(sheet, i / 3., (i + 1) / 3., j / 3., (j + 1) / 3.));
  return parts;
}

/// The left half whole, the right one in four parts: T-junctions along the middle.
inline patch_list sheet_with_t_junctions(bicubic_patch<double> const& sheet) {
  patch_list parts{sub_patch(sheet, 0., 0.5, 0., 1.)};
  for (int j = 0; j < 4; ++j) parts.push_back(sub_patch(sheet, 0.5, 1., j / 4., (j + 1) / 4.));
  return parts;
}

/// Moves every patch by up to `most`: edges that met are up to twice as far apart.
template <class Patch, class Generator> void shift_each(std::vector<Patch>& scene, double most, Generator& g) {
  for (auto& p : scene) {
    vec3<double> const by = random_direction(g) * (most * uniform(g, 0.5, 1));
    for (auto& c : p.control_points) c += by;
  }
}

/// Rays to about each of a list of points, from a way off.
template <class Generator> ray_list rays_at(std::vector<vec3<double>> const& aims, Generator& g) {
  ray_list rays;
  for (auto const& aim : aims) {
    vec3<double> way = random_direction(g);
    way.z = (g() % 2 ? 1 : -1) * (0.3 + std::fabs(way.z));
    rays.push_back({aim - way * uniform(g, 1, 20), way, 0, no_limit});
  }
  return rays;
}

/// A box with slanting walls, each one bilinear patch or cut in four, so that there are T-junctions along its edges.
struct slanting_box {
  vec3<double> sides[3];  ///< from the corner at 0
  std::vector<bezier_patch<double, 1, 1>> patches;
  vec3<double> normals[6];  ///< of the walls, outward: x = 0, x = 1, y = 0, ...
  double heights[6];        ///< of the walls above 0, along their normals

  vec3<double> at(double x, double y, double z) const { return sides[0] * x + sides[1] * y + sides[2] * z; }
  /// How far inside a wall a point is.
  double depth(int wall, vec3<double> const& p) const { return heights[wall] - dot(normals[wall], p); }
  /// The wall that a point with a normal is on.
  int wall_at(vec3<double> const& p, vec3<double> const& normal) const {
    int wall = 0;
    for (int k = 2; k < 6; k += 2)
      if (std::fabs(dot(normal, normals[k])) > std::fabs(dot(normal, normals[wall]))) wall = k;
    return std::fabs(depth(wall, p)) < std::fabs(depth(wall + 1, p)) ? wall : wall + 1;
  }
};

/// With angles of 20 to 160 degrees between its walls.
template <class Generator> slanting_box random_box(Generator& g) {
  slanting_box b;
  double flattest = 1;
  do {
    for (auto& side : b.sides) side = random_direction(g) * uniform(g, 0.5, 2);
    flattest = 0;
    for (int k = 0; k < 3; ++k) {
      vec3<double> const n = cross(b.sides[(k + 1) % 3], b.sides[(k + 2) % 3]);
      vec3<double> const outward = n / (dot(n, b.sides[k]) > 0 ? norm(n) : -norm(n));
      b.normals[2 * k] = -outward, b.heights[2 * k] = 0;
      b.normals[2 * k + 1] = outward, b.heights[2 * k + 1] = dot(outward, b.sides[k]);
    }
    for (int k = 0; k < 3; ++k)
      flattest = std::max(flattest, std::fabs(dot(b.normals[2 * k], b.normals[(2 * k + 2) % 6])));
  } while (flattest > 0.94);
  for (int wall = 0; wall < 6; ++wall) {
    vec3<double> const a = b.sides[(wall / 2 + 1) % 3], c = b.sides[(wall / 2 + 2) % 3];
    bezier_patch<double, 1, 1> whole;
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) whole(i, j) = b.sides[wall / 2] * double(wall % 2) + a * double(i) + c * double(j);
    if (g() % 2) {
      b.patches.push_back(whole);
    } else {
      for (int k = 0; k < 4; ++k)
        b.patches.push_back(sub_patch(whole, k / 2 / 2., (k / 2 + 1) / 2., k % 2 / 2., (k % 2 + 1) / 2.));
    }
  }
  return b;
}

}  // namespace patchrt::test
