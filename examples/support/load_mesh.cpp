// SPDX-License-Identifier: MIT
#include "load_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace patchrt::examples {

namespace {

/// Cuts polygons into triangles by clipping ears; tinyobjloader's own (2.0.0-rc10) loses or doubles parts of polygons that
/// are not convex and away from the origin.
class ear_clipper {
 public:
  ear_clipper(std::vector<vec3<double>> const& vertices, std::vector<std::array<std::uint32_t, 3>>& triangles)
      : vertices_(vertices), triangles_(triangles) {}

  /// Adds the triangles of a polygon of three corners or more, without those that have a vertex twice.
  void clip(std::vector<std::uint32_t> polygon) {
    if (polygon.size() > 3) choose_plane(polygon);
    for (std::size_t start = 0; polygon.size() > 3;) {
      std::size_t const n = polygon.size();
      std::size_t tried = 0;
      while (tried < n && !is_ear(polygon, (start + tried) % n)) ++tried;
      if (tried == n) break;
      std::size_t const ear = (start + tried) % n;
      add(polygon[(ear + n - 1) % n], polygon[ear], polygon[(ear + 1) % n]);
      polygon.erase(polygon.begin() + std::ptrdiff_t(ear));
      start = ear % polygon.size();
    }
    // More than a triangle is left only where the polygon crosses itself or has no area: a fan, so that nothing is lost.
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k) add(polygon[0], polygon[k], polygon[k + 1]);
  }

 private:
  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a != b && b != c && c != a) triangles_.push_back({a, b, c});
  }

  /// Projects along the largest component of the polygon's normal by Newell's sum, so that it runs counter-clockwise.
  void choose_plane(std::vector<std::uint32_t> const& polygon) {
    vec3<double> normal(0.0);
    vec3<double> const& origin = vertices_[polygon[0]];
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
      normal = normal + cross(vertices_[polygon[k]] - origin, vertices_[polygon[k + 1]] - origin);
    vec3<double> const size = absolute(normal);
    int const along = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    x_ = (along + 1) % 3;
    y_ = (along + 2) % 3;
    if (normal[along] < 0) std::swap(x_, y_);
  }

  /// Twice the area of the projected triangle, positive where it runs counter-clockwise.
  double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    vec3<double> const ab = vertices_[b] - vertices_[a], ac = vertices_[c] - vertices_[a];
    return difference_of_products(ab[x_], ac[y_], ab[y_], ac[x_]);
  }

  bool is_at(std::uint32_t a, std::uint32_t b) const { return vertices_[a] == vertices_[b]; }

  bool is_ear(std::vector<std::uint32_t> const& polygon, std::size_t k) const {
    std::size_t const n = polygon.size(), before = (k + n - 1) % n, after = (k + 1) % n;
    std::uint32_t const a = polygon[before], b = polygon[k], c = polygon[after];
    if (!(turn(a, b, c) > 0)) return false;
    for (std::size_t other = 0; other < n; ++other) {
      if (other == before || other == k || other == after) continue;
      std::uint32_t const p = polygon[other];
      if (is_at(p, a) || is_at(p, b) || is_at(p, c)) continue;
      if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return false;
    }
    return true;
  }

  std::vector<vec3<double>> const& vertices_;
  std::vector<std::array<std::uint32_t, 3>>& triangles_;
  int x_ = 0, y_ = 1;
};

}  // namespace

loaded_mesh triangulate(obj_model model) {
  loaded_mesh m;
  m.vertices = std::move(model.vertices);
  m.ignored = describe_ignored(model);
  ear_clipper clipper(m.vertices, m.triangles);
  for (auto const& face : model.faces) {
    constexpr std::size_t most_corners = 4096;
    if (face.size > most_corners)
      throw std::runtime_error(model.name + ":" + std::to_string(face.line) + ": expected a face of at most " +
                               std::to_string(most_corners) + " corners, got " + std::to_string(face.size));
    auto const corners = model.corners_of(face);
    std::vector<std::uint32_t> polygon;
    std::unique_copy(corners.begin(), corners.end(), std::back_inserter(polygon));
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    std::size_t const before = m.triangles.size();
    if (polygon.size() >= 3) clipper.clip(polygon);
    if (m.triangles.size() == before && m.skipped_faces++ == 0) m.first_skipped_line = face.line;
  }
  if (m.triangles.empty())
    throw std::runtime_error(model.name + ": expected a face of three different vertices, got " +
                             std::to_string(model.faces.size()) + " faces of fewer");
  return m;
}

loaded_mesh load_mesh(std::filesystem::path const& file) { return triangulate(load_obj(file)); }

std::string describe_skipped(loaded_mesh const& m) {
  std::string said;
  if (m.skipped_faces > 0)
    said = "faces of fewer than three different vertices: " + std::to_string(m.skipped_faces) +
           " skipped, the first in line " + std::to_string(m.first_skipped_line);
  if (!said.empty() && !m.ignored.empty()) said += "; ";
  return said + m.ignored;
}

}  // namespace patchrt::examples
