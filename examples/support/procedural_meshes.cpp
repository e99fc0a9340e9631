// SPDX-License-Identifier: MIT
#include "procedural_meshes.hpp"

#include <patchrt/core/box.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>

namespace patchrt::examples {

mesh cube_mesh(int n) {
  mesh m;
  m.vertices.reserve(6 * std::size_t(n) * std::size_t(n) + 2);
  m.triangles.reserve(12 * std::size_t(n) * std::size_t(n));
  // Vertices are numbered as the sides come upon them; `first_seen` knows those on edges, which several sides have.
  std::unordered_map<std::uint64_t, std::uint32_t> first_seen;
  auto const vertex = [&](std::array<int, 3> const& at) {
    auto const add = [&] {
      auto const coordinate = [&](int i) { return (2.0 * i - n) / n; };
      m.vertices.emplace_back(coordinate(at[0]), coordinate(at[1]), coordinate(at[2]));
      return std::uint32_t(m.vertices.size() - 1);
    };
    if (std::count_if(at.begin(), at.end(), [n](int i) { return i == 0 || i == n; }) == 1) return add();
    std::uint64_t const row = std::uint64_t(n) + 1;
    auto const [place, is_new] =
        first_seen.try_emplace((std::uint64_t(at[0]) * row + std::uint64_t(at[1])) * row + std::uint64_t(at[2]));
    if (is_new) place->second = add();
    return place->second;
  };
  std::vector<std::uint32_t> lattice((std::size_t(n) + 1) * (std::size_t(n) + 1));
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int const side : {0, n}) {
      // (axis, a, b) is a right-handed frame on the far side and a left-handed one on the near side.
      std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
      if (side == 0) std::swap(a, b);
      std::array<int, 3> at{};
      at[axis] = side;
      for (std::size_t k = 0; k < lattice.size(); ++k) {
        at[a] = int(k) / (n + 1);
        at[b] = int(k) % (n + 1);
        lattice[k] = vertex(at);
      }
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          std::size_t const k = std::size_t(i) * (std::size_t(n) + 1) + std::size_t(j), right = k + std::size_t(n) + 1;
          m.triangles.push_back({lattice[k], lattice[right], lattice[right + 1]});
          m.triangles.push_back({lattice[k], lattice[right + 1], lattice[k + 1]});
        }
    }
  return m;
}

mesh sphere_mesh(int n, vec3<double> const& centre, double radius) {
  mesh m = cube_mesh(n);
  for (auto& v : m.vertices) {
    // The tangent spreads the squares evenly over angles; without it those in the corners would be 5 times smaller.
    auto const spread = [](double x) { return std::tan(x * std::numbers::pi / 4); };
    vec3<double> const on_cube(spread(v.x), spread(v.y), spread(v.z));
    v = centre + on_cube * (radius / std::sqrt(dot(on_cube, on_cube)));
  }
  return m;
}

mesh tessellate(std::span<bicubic_patch<double> const> patches, int n) {
  mesh m;
  std::size_t const row = std::size_t(n) + 1;
  m.vertices.reserve(patches.size() * row * row);
  m.triangles.reserve(patches.size() * 2 * std::size_t(n) * std::size_t(n));
  auto const add = [&](std::size_t a, std::size_t b, std::size_t c) {
    auto const& v = m.vertices;
    if (v[a] != v[b] && v[b] != v[c] && v[c] != v[a])
      m.triangles.push_back({std::uint32_t(a), std::uint32_t(b), std::uint32_t(c)});
  };
  for (auto const& patch : patches) {
    std::size_t const first = m.vertices.size();
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) m.vertices.push_back(evaluate(patch, double(i) / n, double(j) / n).position);
    for (std::size_t i = 0; i + 1 < row; ++i)
      for (std::size_t j = 0; j + 1 < row; ++j) {
        std::size_t const k = first + i * row + j;
        add(k, k + row, k + row + 1);
        add(k, k + row + 1, k + 1);
      }
  }
  return m;
}

mesh merge(mesh a, mesh const& b) {
  auto const first = std::uint32_t(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  a.triangles.reserve(a.triangles.size() + b.triangles.size());
  for (auto const& t : b.triangles) a.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return a;
}

mesh stadium(mesh const& model, bool z_up, std::size_t triangles) {
  if (model.vertices.empty()) throw std::runtime_error("stadium: expected a model with vertices, got none");
  if (triangles < model.triangles.size() + 12)
    throw std::runtime_error("stadium: expected 12 triangles or more beside the model's " +
                             std::to_string(model.triangles.size()) + ", got " + std::to_string(triangles) + " in all");
  auto around = box<double>::empty();
  for (auto const& v : model.vertices) around = merge(around, v);
  vec3<double> const size = extent(around), middle = 0.5 * (around.lo + around.hi);
  double const largest = std::max({size.x, size.y, size.z});
  int const up = z_up ? 2 : 1;
  vec3<double> half(30 * largest);
  half[up] = 10 * largest;
  vec3<double> centre = middle;
  centre[up] = around.lo[up] - 1e-3 * largest + half[up];

  mesh room = cube_mesh(int(std::sqrt(double(triangles - model.triangles.size()) / 12)));
  for (auto& v : room.vertices) v = centre + half * v;
  for (auto& t : room.triangles) std::swap(t[1], t[2]);
  return merge(model, room);
}

}  // namespace patchrt::examples
