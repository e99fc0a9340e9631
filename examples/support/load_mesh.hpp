// SPDX-License-Identifier: MIT
#pragma once

#include "mesh.hpp"
#include "obj.hpp"

#include <cstddef>
#include <filesystem>
#include <string>

namespace patchrt::examples {

/// A mesh with what its file has besides.
struct loaded_mesh : mesh {
  std::size_t skipped_faces = 0;  ///< faces of fewer than three different vertices
  std::size_t first_skipped_line = 0;
  std::string ignored;  ///< what `describe_ignored` says of the file
};

/// The triangles of a model: polygons are cut into as many triangles as they have corners, less two, without overlap where
/// they are plane and cross themselves nowhere. Corners that repeat their predecessor and triangles that have a vertex twice
/// are dropped, faces of which nothing is left then are skipped and counted. Triangles keep the order and the orientation of
/// the faces.
/// \throws std::runtime_error "NAME: expected ..., got ..." where no triangle is left, or "NAME:LINE: ..." for a polygon of
///         more than 4096 corners.
loaded_mesh triangulate(obj_model model);

/// `triangulate` of an OBJ file.
/// \throws std::runtime_error as `load_obj` and `triangulate`.
loaded_mesh load_mesh(std::filesystem::path const& file);

/// One line of what was not taken from the file, for people; empty where all was.
std::string describe_skipped(loaded_mesh const& m);

}  // namespace patchrt::examples
