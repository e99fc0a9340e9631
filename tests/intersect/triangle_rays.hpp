// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Triangles of all shapes and places, rays at them, and meshes without gaps.

#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/triangle.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace patchrt::test {

/// A form and the numbers it is tested in: the parameter of tests that hold for all.
template <class F, class N> struct form_over {
  using form = F;
  using number = N;
};

class random_triangle_rays {
 public:
  explicit random_triangle_rays(unsigned seed) : random_(seed) {}

  double uniform(double lo = 0, double hi = 1) { return lo + (hi - lo) * double(random_()) * 0x1p-32; }
  int pick(int n) { return int(random_() % unsigned(n)); }

  vec3<double> direction() {
    double const z = uniform(-1, 1), turn = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(turn), r * std::sin(turn), z};
  }
  vec3<double> in_cube() {
    double const x = uniform(-1, 1), y = uniform(-1, 1);
    return {x, y, uniform(-1, 1)};
  }

  /// Of size 1 around 0: any shape, or a needle or a cap as thin as `thinnest`.
  triangle<double> any_shape(double thinnest) {
    triangle<double> t{in_cube(), in_cube(), in_cube()};
    int const kind = pick(4);
    double const thin = std::pow(thinnest, uniform());
    if (kind == 1) t.b = t.a + (t.b - t.a) * thin;                            // needle
    if (kind == 2) t.c = t.a + (t.b - t.a) * uniform() + (t.c - t.a) * thin;  // cap
    if (kind == 3) t.a.z = t.b.z = t.c.z = uniform(-1, 1);                    // in a plane of axes
    return t;
  }
  /// Out of line: g++ 12's vectoriser drops some of the roundings of double to float and back that it sees together.
  template <class T> PATCHRT_OUTLINE static vec3<T> rounded(vec3<double> const& p) { return {T(p.x), T(p.y), T(p.z)}; }
  template <class T> static triangle<T> rounded(triangle<double> const& t) {
    return {rounded<T>(t.a), rounded<T>(t.b), rounded<T>(t.c)};
  }
  /// `t` times `scale`, moved by `offset`, rounded.
  template <class T> static triangle<T> placed(triangle<double> const& t, double scale, vec3<double> const& offset) {
    return rounded<T>(triangle<double>{t.a * scale + offset, t.b * scale + offset, t.c * scale + offset});
  }
  /// A point of t, or one outside as far as the triangle is large.
  template <class T> vec3<double> aim(triangle<T> const& t) {
    vec3<double> const a(t.a), b(t.b), c(t.c);
    double u = uniform(), v = uniform();
    if (pick(2) && u + v > 1) u = 1 - u, v = 1 - v;
    return a + u * (b - a) + v * (c - a);
  }
  /// A ray at `target` from `distance` away, its direction of any length; one in eight has a component of 0.
  template <class T> ray<T> ray_at(vec3<double> const& target, double distance) {
    vec3<double> way = direction();
    if (pick(8) == 0) way[pick(3)] = 0;
    vec3<T> const origin = rounded<T>(target - way * distance);
    double const length = std::pow(2., uniform(-3, 3));
    vec3<T> d = rounded<T>(way * length);
    if (pick(2)) d = rounded<T>(target - vec3<double>(origin));
    return {origin, d, T(0), std::numeric_limits<T>::infinity()};
  }

 private:
  std::mt19937 random_;
};

/// Vertices, rounded, and triangles of three of them each.
template <class T> struct triangle_mesh {
  std::vector<vec3<T>> vertices;
  std::vector<std::array<std::size_t, 3>> faces;

  triangle<T> operator[](std::size_t k) const {
    auto const& f = faces[k];
    return {vertices[f[0]], vertices[f[1]], vertices[f[2]]};
  }
};

/// A closed sphere of 2 n (n - 1) triangles around its axis z, fronts outside.
template <class T> triangle_mesh<T> sphere_mesh(vec3<double> const& centre, double radius, int n) {
  triangle_mesh<T> m;
  auto const add = [&](double turn, double tilt) {
    double const r = std::sin(tilt);
    vec3<double> const p = centre + radius * vec3<double>{r * std::cos(turn), r * std::sin(turn), std::cos(tilt)};
    m.vertices.push_back(random_triangle_rays::rounded<T>(p));
  };
  std::size_t const columns = std::size_t(n);
  add(0, 0);
  for (int i = 1; i < n; ++i)
    for (int j = 0; j < n; ++j) add(2 * std::numbers::pi * (j + 0.5 * (i % 2)) / n, std::numbers::pi * i / n);
  add(0, std::numbers::pi);
  std::size_t const last = m.vertices.size() - 1;
  auto const at = [&](std::size_t i, std::size_t j) { return 1 + (i - 1) * columns + j % columns; };
  for (std::size_t j = 0; j < columns; ++j) {
    m.faces.push_back({0, at(1, j), at(1, j + 1)});
    m.faces.push_back({last, at(columns - 1, j + 1), at(columns - 1, j)});
  }
  for (std::size_t i = 1; i + 1 < columns; ++i)
    for (std::size_t j = 0; j < columns; ++j) {
      std::size_t const k = j + i % 2;  // odd rows are turned by half a column
      m.faces.push_back({at(i, j), at(i + 1, k), at(i, j + 1)});
      m.faces.push_back({at(i, j + 1), at(i + 1, k), at(i + 1, k + 1)});
    }
  return m;
}

/// n x n quads of two triangles each over [0, 1]^2, with slopes of up to 40 degrees, fronts up.
template <class T> triangle_mesh<T> bumpy_sheet(random_triangle_rays& random, int n) {
  triangle_mesh<T> m;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      double const x = (i + random.uniform(-0.3, 0.3)) / n, y = (j + random.uniform(-0.3, 0.3)) / n;
      m.vertices.push_back(random_triangle_rays::rounded<T>(vec3<double>{x, y, random.uniform(-0.16, 0.16) / n}));
    }
  std::size_t const side = std::size_t(n) + 1;
  for (std::size_t i = 0; i + 1 < side; ++i)
    for (std::size_t j = 0; j + 1 < side; ++j) {
      std::size_t const k = i * side + j;
      m.faces.push_back({k, k + side, k + side + 1});
      m.faces.push_back({k, k + side + 1, k + 1});
    }
  return m;
}

}  // namespace patchrt::test
