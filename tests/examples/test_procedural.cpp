// SPDX-License-Identifier: MIT
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/model.hpp>
#include <support/procedural_meshes.hpp>
#include <support/sphereflake.hpp>

#include <patchrt/core/box.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

using namespace patchrt;
using namespace patchrt::examples;

namespace {

/// Whether every edge belongs to two triangles that walk it in opposite directions.
bool is_closed(mesh const& m) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> there, back;
  for (auto const& t : m.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      there.emplace_back(t[k], t[(k + 1) % 3]);
      back.emplace_back(t[(k + 1) % 3], t[k]);
    }
  std::sort(there.begin(), there.end());
  std::sort(back.begin(), back.end());
  return there == back && std::adjacent_find(there.begin(), there.end()) == there.end();
}

/// Six times the volume within a closed mesh, positive where the normals point outward.
double six_volumes(mesh const& m) {
  double sum = 0;
  for (auto const& t : m.triangles) {
    auto const &a = m.vertices[t[0]], &b = m.vertices[t[1]], &c = m.vertices[t[2]];
    sum += dot(a, cross(b, c));
  }
  return sum;
}

double area(mesh const& m, std::array<std::uint32_t, 3> const& t) {
  vec3<double> const n = cross(m.vertices[t[1]] - m.vertices[t[0]], m.vertices[t[2]] - m.vertices[t[0]]);
  return 0.5 * std::sqrt(dot(n, n));
}

}  // namespace

TEST_CASE("a cube of n by n squares a side is closed, has its counts and the cube's volume") {
  for (int const n : {1, 2, 3, 10}) {
    CAPTURE(n);
    mesh const m = cube_mesh(n);
    auto const squares = std::size_t(n) * std::size_t(n);
    CHECK(m.vertices.size() == 6 * squares + 2);
    CHECK(m.triangles.size() == 12 * squares);
    CHECK(is_closed(m));
    CHECK(six_volumes(m) == Approx(48));
  }
}

TEST_CASE("a sphere of triangles is closed, lies on the sphere, and its triangles are of nearly one size") {
  vec3<double> const centre(1000, -20, 3);
  mesh const m = sphere_mesh(20, centre, 2);
  CHECK(m.triangles.size() == 4800);
  CHECK(is_closed(m));
  double farthest = 0;
  for (auto const& v : m.vertices) {
    vec3<double> const d = v - centre;
    farthest = std::max(farthest, std::abs(std::sqrt(dot(d, d)) - 2));
  }
  CHECK(farthest < 4e-13);
  std::vector<double> areas;
  for (auto const& t : m.triangles) areas.push_back(area(m, t));
  auto const [least, most] = std::minmax_element(areas.begin(), areas.end());
  CHECK(*most < 2 * *least);
}

TEST_CASE("the sphere of 289 squares a side has a million triangles and nearly the ball's volume") {
  mesh const m = sphere_mesh(289);
  CHECK(m.triangles.size() == 1002252);
  CHECK(m.vertices.size() == 501128);
  CHECK(is_closed(m));
  CHECK(six_volumes(m) == Approx(6 * 4.18879020478639).epsilon(3e-5));
}

TEST_CASE("a tessellated patch has its corners, and none of the triangles that a collapsed edge would make") {
  bicubic_patch<double> plane, fan;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      plane(i, j) = {double(i), double(j), 0.0};
      fan(i, j) = {double(i), double(i) * double(j), 0.0};
    }
  std::vector<bicubic_patch<double>> const patches{plane, fan};
  mesh const m = tessellate(patches, 5);
  CHECK(m.vertices.size() == 2 * 36);
  CHECK(m.triangles.size() == 50 + 45);
  CHECK(m.vertices[0] == vec3<double>(0, 0, 0));
  CHECK(m.vertices[35] == vec3<double>(3, 3, 0));
  double total = 0;
  for (auto const& t : m.triangles) {
    CHECK(cross(m.vertices[t[1]] - m.vertices[t[0]], m.vertices[t[2]] - m.vertices[t[0]]).z > 0);
    total += area(m, t);
  }
  CHECK(total == Approx(9 + 13.5));
}

TEST_CASE("a stadium is the teapot above the floor of a closed room of about 64000 triangles in all") {
  mesh const teapot = tessellate(load_bpt(test::project_data("teapot.bpt")), 10);
  mesh const all = stadium(teapot, true);
  CHECK(all.triangles.size() <= 64000);
  CHECK(all.triangles.size() > 62000);
  CHECK(std::equal(teapot.triangles.begin(), teapot.triangles.end(), all.triangles.begin()));

  mesh room;
  room.vertices = all.vertices;
  room.triangles.assign(all.triangles.begin() + std::ptrdiff_t(teapot.triangles.size()), all.triangles.end());
  CHECK(is_closed(room));
  auto const model_vertices = std::ptrdiff_t(teapot.vertices.size());
  auto inner = box<double>::empty(), outer = inner;
  for (auto const& v : teapot.vertices) inner = merge(inner, v);
  std::for_each(all.vertices.begin() + model_vertices, all.vertices.end(), [&](auto& v) { outer = merge(outer, v); });
  CHECK(contains(outer, inner));
  vec3<double> const size = extent(outer), teapot_size = extent(inner);
  CHECK(outer.lo.z == Approx(inner.lo.z - 1e-3 * teapot_size.x));
  CHECK(size.x == Approx(60 * teapot_size.x));
  CHECK(size.y == Approx(60 * teapot_size.x));
  CHECK(size.z == Approx(20 * teapot_size.x));
  CHECK(six_volumes(room) == Approx(-6 * size.x * size.y * size.z));

  mesh const y_up = stadium(teapot, false, teapot.triangles.size() + 12);
  CHECK(y_up.triangles.size() == teapot.triangles.size() + 12);
  auto lowest = box<double>::empty();
  for (auto const& v : y_up.vertices) lowest = merge(lowest, v);
  CHECK(lowest.lo.y == Approx(inner.lo.y - 1e-3 * teapot_size.x));
  CHECK_THROWS_WITH(stadium(teapot, true, teapot.triangles.size() + 11), test::contains_text("expected 12 triangles"));
  CHECK_THROWS_WITH(stadium(mesh(), true), test::contains_text("expected a model with vertices"));
}

TEST_CASE("a sphereflake has nine children a sphere, a third as large, that touch their parent from outside") {
  auto const flake = sphereflake(4);
  REQUIRE(flake.size() == 7381);
  CHECK(sphereflake(0).size() == 1);
  CHECK(sphereflake(2).size() == 91);
  CHECK(flake[0].radius == 0.5);
  double worst_touch = 0, worst_ratio = 0, most_inward = 0;
  for (std::size_t child = 1; child < flake.size(); ++child) {
    std::size_t const parent = (child - 1) / 9;
    auto const &c = flake[child], &p = flake[parent];
    vec3<double> const d = c.centre - p.centre;
    worst_touch = std::max(worst_touch, std::abs(std::sqrt(dot(d, d)) / (c.radius + p.radius) - 1));
    worst_ratio = std::max(worst_ratio, std::abs(3 * c.radius / p.radius - 1));
    if (parent > 0) {
      auto const& grandparent = flake[(parent - 1) / 9];
      most_inward = std::min(most_inward, dot(d, p.centre - grandparent.centre) / (p.radius * p.radius));
    }
  }
  CHECK(worst_touch < 1e-13);
  CHECK(worst_ratio < 1e-15);
  CHECK(most_inward > -1e-12);
}

TEST_CASE("the children of a sphere are packed as balls are: six around the equator, three in their hollows above") {
  auto const flake = sphereflake(1);
  int neighbours = 0;
  for (std::size_t j = 1; j <= 9; ++j) {
    CHECK(flake[j].centre.z == Approx(j <= 6 ? 0 : 2 / 3.0 * std::sqrt(2 / 3.0)).margin(1e-15));
    for (std::size_t k = 1; k < j; ++k) {
      vec3<double> const d = flake[j].centre - flake[k].centre;
      double const distance = std::sqrt(dot(d, d));
      CHECK(distance > 2 / 3.0 - 1e-15);
      neighbours += distance < 2 / 3.0 + 1e-12;
    }
  }
  CHECK(neighbours == 15);
}
