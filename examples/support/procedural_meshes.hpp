// SPDX-License-Identifier: MIT
#pragma once

#include "mesh.hpp"

#include <patchrt/shapes/bezier_patch.hpp>

#include <span>

namespace patchrt::examples {

/// The surface of the cube [-1, 1]^3, n x n squares a side, each cut into two triangles: 12 n^2 triangles over 6 n^2 + 2
/// vertices, closed, normals outward.
/// \pre n from 1 to 10000.
mesh cube_mesh(int n);

/// A sphere of triangles of nearly one size: the cube of n x n squares a side, pushed out to the radius; 12 n^2 triangles,
/// closed, normals outward. n = 289 has a million triangles.
/// \return Vertices within two roundings of the centre's and radius' size of the sphere.
/// \pre n from 1 to 10000.
mesh sphere_mesh(int n, vec3<double> const& centre = vec3<double>(0.0), double radius = 1);

/// The patches cut uniformly into n x n cells each, two triangles a cell, normals along Su x Sv. Vertices are not shared
/// between patches. Triangles of collapsed edges, two of whose vertices are the same, are left out.
/// \pre n from 1 to 10000.
mesh tessellate(std::span<bicubic_patch<double> const> patches, int n);

/// Both meshes in one.
mesh merge(mesh a, mesh const& b);

/// "Teapot in a stadium": the model above the middle of the floor of a closed room, normals into the room, of as many
/// triangles as make `triangles` in all at most (12 n^2 of them: 63452 in all beside 6320). The model keeps its place; the
/// room is 60 times the model's largest extent wide and deep, 20 times high, along y or, with `z_up`, z, and its floor a
/// thousandth of that extent below the model, so that no two triangles share a plane.
/// \throws std::runtime_error where the model has no vertices or leaves no triangles for the room.
mesh stadium(mesh const& model, bool z_up, std::size_t triangles = 64000);

}  // namespace patchrt::examples
