// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/vec.hpp>

#include <tiny_obj_loader.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace patchrt::examples {

/// A face of an OBJ file: a polygon of the corners first, first + 1, ..., first + size - 1; of any size, 0 included.
struct obj_face {
  std::size_t first;
  std::size_t size;
  std::size_t line;
};

/// A line `t NAME I/R/S` with I integers, R reals and S words, as OpenSubdiv's shapes have for creases and the like.
struct obj_tag {
  std::string name;
  std::vector<std::int64_t> integers;
  std::vector<double> reals;
  std::vector<std::string> words;
  std::size_t line;
};

/// What an OBJ file says of vertices, faces and tags, in file order.
struct obj_model {
  std::string name;  ///< the file's, for messages
  std::vector<vec3<double>> vertices;
  std::vector<std::uint32_t> corners;  ///< indices of vertices, counted from 0
  std::vector<obj_face> faces;
  std::vector<obj_tag> tags;
  std::size_t other_statements = 0;  ///< lines, points, curves, surfaces and words that are unknown: none is a face
  std::size_t first_other_line = 0;

  std::span<std::uint32_t const> corners_of(obj_face const& f) const { return {corners.data() + f.first, f.size}; }
};

/// The vertices, faces and tags of a text in the OBJ format.
///
/// Lines end in LF, CR LF or CR. Texture coordinates, normals, groups and materials are passed over. Faces may refer to
/// vertices that come later.
/// \param  name The file's name for messages.
/// \return One vertex and one face or more; all coordinates finite, all indices in range. Coordinates are the doubles nearest
///         to the decimals in the text.
/// \throws std::runtime_error "NAME:LINE: expected ..., got ...", one line.
obj_model parse_obj(std::string_view text, std::string_view name);

/// `parse_obj` of a file.
/// \throws std::runtime_error as `parse_obj`, or "FILE: ..." for what cannot be read.
obj_model load_obj(std::filesystem::path const& file);

/// "statements that are neither vertices nor faces: N ignored, the first in line L"; empty where there are none.
std::string describe_ignored(obj_model const& model);

}  // namespace patchrt::examples
