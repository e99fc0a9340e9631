// SPDX-License-Identifier: MIT
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/model.hpp>
#include <support/subdivision.hpp>

#include <patchrt/core/box.hpp>
#include <patchrt/shapes/bezier_normal.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::examples;

namespace {

std::string const cube =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
std::string const octahedron =
    "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n"
    "f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";

/// n x n squares over 0 <= x, y <= n whose heights are `height(x, y)`.
template <class F> std::string grid(int n, F height) {
  std::string text;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(height(x, y)) + "\n";
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      int const k = y * (n + 1) + x + 1;
      text += "f " + std::to_string(k) + " " + std::to_string(k + 1) + " " + std::to_string(k + n + 2) + " " +
              std::to_string(k + n + 1) + "\n";
    }
  return text;
}

subdivision_surface surface_of(std::string const& text) { return subdivision_surface(parse_obj(text, "m.obj")); }

double norm(vec3<double> const& v) { return std::sqrt(dot(v, v)); }

double diagonal_of(std::vector<bicubic_patch<double>> const& patches) {
  auto around = box<double>::empty();
  for (auto const& patch : patches) around = merge(around, bounds(patch));
  return norm(extent(around));
}

/// How far the nearest corner of a patch is from `point`.
double nearest_corner(subdivided_model const& model, vec3<double> const& point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (auto const& patch : model.patches)
    for (int i : {0, 3})
      for (int j : {0, 3}) nearest = std::min(nearest, norm(patch(i, j) - point));
  return nearest;
}

/// The largest distance of control points of two patches.
double difference(bicubic_patch<double> const& a, bicubic_patch<double> const& b) {
  double largest = 0;
  for (int k = 0; k < 16; ++k) largest = std::max(largest, norm(a.control_points[k] - b.control_points[k]));
  return largest;
}

constexpr end_cap caps[] = {end_cap::bspline, end_cap::gregory};

}  // namespace

TEST_CASE("the limit points of a cube's vertices and faces are where the Catmull-Clark masks have them") {
  auto const surface = surface_of(cube);
  for (int const level : {1, 2, 3, 6})
    for (end_cap const cap : caps) {
      auto const model = surface.to_bezier(level, cap);
      CAPTURE(level, int(cap));
      CHECK(model.patches.size() == std::size_t(level == 1 ? 24 : 24 + 72 * (level - 1)));
      // (9 V + 4 (sum of edge neighbours) + (sum of face neighbours)) / 24 at valence 3.
      for (double const x : {-0.5, 0.5})
        for (double const y : {-0.5, 0.5})
          for (double const z : {-0.5, 0.5}) CHECK(nearest_corner(model, {x, y, z}) < 1e-15);
      // (16 V + 4 (edge neighbours) + (face neighbours)) / 36 at the face's point, divided once: 1, 3/4 and 5/9 of its height.
      double const height = (16 + 4 * 4 * 0.75 + 4 * 5 / 9.0) / 36;
      CHECK(nearest_corner(model, {height, 0, 0}) < 1e-15);
      CHECK(nearest_corner(model, {0, 0, -height}) < 1e-15);
    }
}

TEST_CASE("a cube with infinitely sharp edges is the cube, exactly") {
  std::string text = cube;
  for (char const* edge : {"0 1", "1 2", "2 3", "3 0", "4 5", "5 6", "6 7", "7 4", "0 4", "1 5", "2 6", "3 7"})
    text += std::string("t crease 2/1/0 ") + edge + " 10\n";
  for (end_cap const cap : caps) {
    auto const model = surface_of(text).to_bezier(3, cap);
    for (auto const& patch : model.patches)
      for (auto const& p : patch.control_points) {
        vec3<double> const size = absolute(p);
        CHECK(std::max({size.x, size.y, size.z}) == 1);
      }
    for (double const x : {-1.0, 1.0}) CHECK(nearest_corner(model, {x, -x, x}) == 0);
  }
}

TEST_CASE("an infinitely sharp loop is a B-spline curve") {
  std::string const creased = cube + "t crease 8/1/0 4 5 5 6 6 7 7 4 10\n";
  auto const model = surface_of(creased).to_bezier(4, end_cap::gregory);
  for (double const x : {-2 / 3.0, 2 / 3.0})
    for (double const y : {-2 / 3.0, 2 / 3.0}) CHECK(nearest_corner(model, {x, y, 1}) < 1e-15);
  // One sharpness for all pairs, and one for each, are the same crease.
  auto const each = surface_of(cube + "t crease 8/4/0 4 5 5 6 6 7 7 4 10 10 10 10\n").to_bezier(4, end_cap::gregory);
  REQUIRE(each.patches.size() == model.patches.size());
  for (std::size_t k = 0; k < each.patches.size(); ++k) CHECK(difference(each.patches[k], model.patches[k]) == 0);
}

TEST_CASE("an infinitely sharp corner is its vertex, a smooth one is not") {
  CHECK(nearest_corner(surface_of(cube + "t corner 1/1/0 6 10\n").to_bezier(4, end_cap::bspline), {1, 1, 1}) < 1e-15);
  CHECK(nearest_corner(surface_of(cube + "t corner 2/2/0 0 6 10 0\n").to_bezier(4, end_cap::bspline), {1, 1, 1}) > 0.1);
}

TEST_CASE("regular faces become patches exactly: heights of x^2 + x y become x^2 + x y + 1/3") {
  auto const surface =
      surface_of(grid(6, [](int x, int y) { return x * x + x * y; }) + "t interpolateboundary 1/0/0 1\n");
  auto const model = surface.to_bezier(0, end_cap::bspline);
  REQUIRE(model.patches.size() == 36);
  for (int y = 1; y < 5; ++y)
    for (int x = 1; x < 5; ++x) {
      auto const& patch = model.patches[std::size_t(6 * y + x)];
      for (double const u : {0.0, 0.3, 1.0})
        for (double const v : {0.0, 0.6, 1.0}) {
          vec3<double> const p = evaluate(patch, u, v).position;
          vec3<double> const expected(x + u, y + v, (x + u) * (x + u) + (x + u) * (y + v) + 1 / 3.0);
          CHECK(norm(p - expected) < 1e-13);
        }
    }
  CHECK(nearest_corner(model, {6, 6, 72}) < 1e-13);  // the grid's corner stays
  CHECK(nearest_corner(model, {1, 0, 1 + 1 / 3.0}) < 1e-13);
  auto const d = surface.distances(model, 5);
  CHECK(d.samples == 36 * 25);
  CHECK(d.exact_patches == 36);
}

TEST_CASE("a plane control mesh of any faces becomes plane patches with the faces' normals") {
  std::string const text =
      "v 0 0 0\nv 4 0 0\nv 5 3 0\nv 2 5 0\nv -1 3 0\nv 8 1 0\nv 7 6 0\nv 2 9 0\nf 1 2 3 4 5\nf 2 6 3\nf 3 6 7 4\nf 4 7 "
      "8\n";
  for (end_cap const cap : caps)
    for (int const level : {1, 4}) {
      auto const model = surface_of(text).to_bezier(level, cap);
      double area = 0;
      for (auto const& domain : model.domains) area += domain.du * domain.dv;
      CHECK(area == 5 + 3 + 1 + 3);
      for (auto const& patch : model.patches)
        for (auto const& p : patch.control_points) CHECK(std::abs(p.z) < 1e-14);
      for (auto const& patch : model.patches) CHECK(normal(patch, 0.5, 0.5).z > 0.99);
    }
}

TEST_CASE("a closed mesh of triangles becomes a closed surface with its normals outward") {
  auto const surface = surface_of(octahedron);
  for (end_cap const cap : caps) {
    auto const model = surface.to_bezier(4, cap);
    double area = 0;
    for (auto const& domain : model.domains) area += domain.du * domain.dv;
    CHECK(area == 24);
    for (auto const& patch : model.patches) {
      vec3<double> const p = evaluate(patch, 0.5, 0.5).position;
      CHECK(dot(normal(patch, 0.5, 0.5), p) > 0);
      CHECK(norm(p) < 0.9);
    }
    auto const d = surface.distances(model, 5);
    CHECK(d.largest < 1e-4);
    CHECK(surface.distances(surface.to_bezier(7, cap), 5).largest < d.largest / 20);
  }
}

TEST_CASE("patches of a level share their edges, whatever the end cap's inside is") {
  for (std::string const& text : {cube, octahedron}) {
    auto const model = surface_of(text).to_bezier(3, end_cap::gregory);
    struct edge {
      std::array<vec3<double>, 4> points;
      double length;
    };
    std::vector<edge> edges;
    for (auto const& patch : model.patches)
      for (int side = 0; side < 4; ++side) {
        edge e;
        for (int k = 0; k < 4; ++k) e.points[std::size_t(k)] = side < 2 ? patch(3 * side, k) : patch(k, 3 * (side - 2));
        e.length = norm(e.points[3] - e.points[0]);
        edges.push_back(e);
      }
    std::size_t shared = 0;
    double largest = 0;
    for (std::size_t i = 0; i < edges.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        auto const &a = edges[i].points, &b = edges[j].points;
        if (norm(a[0] - b[0]) + norm(a[3] - b[3]) < 1e-9) {
          ++shared;
          for (std::size_t k = 0; k < 4; ++k) largest = std::max(largest, norm(a[k] - b[k]));
        } else if (norm(a[0] - b[3]) + norm(a[3] - b[0]) < 1e-9) {
          ++shared;
          for (std::size_t k = 0; k < 4; ++k) largest = std::max(largest, norm(a[k] - b[3 - k]));
        }
      }
    CHECK(shared > model.patches.size());
    CHECK(largest < 1e-15);
  }
}

TEST_CASE("semi-sharp creases that are isolated are exact from the level of their sharpness on") {
  // A grid with a crease across, so that there is nothing else to approximate.
  std::string text = grid(6, [](int x, int y) { return x == 3 ? 2 : 0.1 * x * y; }) + "t interpolateboundary 1/0/0 1\n";
  for (int y = 0; y < 6; ++y)
    text += "t crease 2/1/0 " + std::to_string(7 * y + 3) + " " + std::to_string(7 * y + 10) + " 3\n";
  auto const surface = surface_of(text);
  for (int const level : {1, 2}) {
    auto const d = surface.distances(surface.to_bezier(level, end_cap::bspline, semi_sharp::isolate), 4);
    CHECK(d.largest > 1e-4);
    CHECK((0 < d.exact_patches && d.exact_patches < d.samples / 16));
  }
  for (int const level : {3, 5}) {
    auto const model = surface.to_bezier(level, end_cap::bspline, semi_sharp::isolate);
    CHECK(surface.distances(model, 4).exact_patches == model.patches.size());
  }
}

TEST_CASE("a face with a semi-sharp crease along a side is two patches, or three where the sharpness is no integer") {
  constexpr int around = 8, across = 6;
  struct row {
    double sharpness;
    std::size_t parts;
  };
  for (auto const& r : {row{0.3, 2}, row{1, 2}, row{1.75, 3}, row{4, 2}, row{7.9, 3}})
    for (bool const turned : {false, true}) {
      CAPTURE(r.sharpness, turned);
      std::string text, faces, creases;
      for (int i = 0; i < around; ++i)
        for (int j = 0; j < across; ++j) {
          double const a = 2 * std::numbers::pi * i / around, b = 2 * std::numbers::pi * j / across;
          text += "v " + std::to_string((3 + std::cos(b)) * std::cos(a)) + " " +
                  std::to_string((3 + std::cos(b)) * std::sin(a)) + " " + std::to_string(std::sin(b)) + "\n";
          auto const vertex = [&](int x, int y) {
            return std::to_string((i + x) % around * across + (j + y) % across + 1);
          };
          // Each second face begins at another corner, so that the crease is each of its sides.
          faces += (i + j) % 2
                       ? "f " + vertex(0, 0) + " " + vertex(1, 0) + " " + vertex(1, 1) + " " + vertex(0, 1) + "\n"
                       : "f " + vertex(1, 1) + " " + vertex(0, 1) + " " + vertex(0, 0) + " " + vertex(1, 0) + "\n";
          int const from = i * across + j;
          int const to = turned ? i * across + (j + 1) % across : (i + 1) % around * across + j;
          if (turned ? i == 2 : j == 4)
            creases += "t crease 2/1/0 " + std::to_string(from) + " " + std::to_string(to) + " " +
                       std::to_string(r.sharpness) + "\n";
        }
      auto const surface = surface_of(text + faces + creases);
      std::size_t const faces_at_crease = turned ? 2 * across : 2 * around;
      for (int const level : {int(std::ceil(r.sharpness)), 9}) {
        auto const model = surface.to_bezier(level, end_cap::bspline);
        CHECK(model.patches.size() == around * across + faces_at_crease * (r.parts - 1));
        auto const d = surface.distances(model, 6);
        CHECK(d.largest < 1e-13);
        CHECK(d.exact_patches == model.patches.size());
      }
      CHECK(surface.to_bezier(2, end_cap::bspline, semi_sharp::isolate).patches.size() >
            around * across + faces_at_crease);
    }
}

TEST_CASE("semi-sharp creases are the same surface, cut or isolated, also where they meet and above the level") {
  std::string various = cube, all_but_one = cube;
  for (char const* crease : {"0 1 4.5", "1 2 2", "2 3 7", "3 0 3.25", "4 5 1", "5 6 6.5", "6 7 0.5", "7 4 3", "0 4 5"})
    various += std::string("t crease 2/1/0 ") + crease + "\n";
  for (char const* edge : {"0 1", "1 2", "2 3", "3 0", "4 5", "5 6", "6 7", "7 4", "0 4", "2 6", "3 7"})
    all_but_one += std::string("t crease 2/1/0 ") + edge + " 5\n";
  all_but_one += "t crease 2/1/0 1 5 0.1\n";
  for (std::string const& text : {various, all_but_one}) {
    auto const surface = surface_of(text);
    for (int const level : {2, 3, 4, 5, 8}) {
      CAPTURE(text, level);
      auto const cut = surface.to_bezier(level, end_cap::bspline);
      auto const isolated = surface.to_bezier(level, end_cap::bspline, semi_sharp::isolate);
      CHECK(cut.patches.size() <= isolated.patches.size());
      double const expected = surface.distances(isolated, 5).largest;
      CHECK(surface.distances(cut, 5).largest == Approx(expected).epsilon(0.05).margin(1e-13));
      double narrowest = 1;
      for (auto const& domain : cut.domains) narrowest = std::min({narrowest, domain.du, domain.dv});
      CHECK(narrowest == std::ldexp(1.0, -level));
    }
  }
}

TEST_CASE("distances are those that patches are moved by") {
  auto const surface = surface_of(grid(4, [](int, int) { return 0; }) + "t interpolateboundary 1/0/0 1\n");
  auto model = surface.to_bezier(0, end_cap::bspline);
  double const diagonal = std::sqrt(32);
  for (auto& p : model.patches[5].control_points) p.z = 0.5;
  auto const up = surface.distances(model, 3);
  CHECK(up.largest == Approx(0.5 / std::sqrt(32 + 0.25)));
  CHECK(up.rms == Approx(up.largest / 4));
  CHECK(up.exact_patches == 15);
  for (auto& p : model.patches[5].control_points)
    p.z = 0, p.x += 0.01;  // along the surface: to a side of the face at most
  CHECK(surface.distances(model, 3).largest <= 0.01 / diagonal * (1 + 1e-12));
}

TEST_CASE("holes, boundaries and faces without a limit surface are as the tags say") {
  auto const flat = [](int, int) { return 0; };
  CHECK(surface_of(grid(4, flat) + "t hole 2/0/0 5 6\n").to_bezier(0, end_cap::bspline).patches.size() == 14);
  CHECK(surface_of(grid(4, flat) + "t interpolateboundary 1/0/0 0\n").to_bezier(0, end_cap::bspline).patches.size() ==
        4);
  auto const with = [&](std::string const& tags) {
    return surface_of(grid(4, flat) + tags).to_bezier(3, end_cap::gregory);
  };
  CHECK(nearest_corner(with("t interpolateboundary 1/0/0 1\n"), {0, 0, 0}) == 0);
  // A smooth corner is a point of the boundary's B-spline curve: 4/6 of the vertex, 1/6 of its neighbours.
  CHECK(nearest_corner(with("t interpolateboundary 1/0/0 2\n"), {1 / 6.0, 1 / 6.0, 0}) < 1e-15);
  CHECK(nearest_corner(with(""), {1 / 6.0, 1 / 6.0, 0}) < 1e-15);  // the default
  auto const holed = surface_of(grid(4, flat) + "t hole 2/0/0 5 6\n");
  CHECK(holed.distances(holed.to_bezier(2, end_cap::bspline), 3).largest < 1);
}

TEST_CASE("vertices of no face and tags of texture coordinates change nothing") {
  auto const expected = surface_of(cube).to_bezier(2, end_cap::bspline);
  auto const got =
      surface_of("t facevaryinginterpolateboundary 1/0/0 1\n" + cube + "v 7 7 7\n").to_bezier(2, end_cap::bspline);
  REQUIRE(got.patches.size() == expected.patches.size());
  for (std::size_t k = 0; k < got.patches.size(); ++k) CHECK(difference(got.patches[k], expected.patches[k]) == 0);
}

TEST_CASE("the rules for creases and triangles change the surface as their tags say") {
  auto const vertical = [&](std::string const& tag) {
    return surface_of(cube + "t crease 8/4/0 4 5 5 6 6 7 7 4 1 2 1 2\n" + tag).to_bezier(4, end_cap::bspline).patches;
  };
  auto const plain = vertical("");
  CHECK(difference(plain[0], vertical("t creasemethod 0/0/1 normal\n")[0]) == 0);
  double largest = 0;
  auto const chaikin = vertical("t creasemethod 0/0/1 chaikin\n");
  for (std::size_t k = 0; k < std::min(plain.size(), chaikin.size()); ++k)
    largest = std::max(largest, difference(plain[k], chaikin[k]));
  CHECK(largest > 1e-3);
  auto const triangles = [&](std::string const& tag) {
    return surface_of(octahedron + tag).to_bezier(2, end_cap::bspline).patches;
  };
  CHECK(difference(triangles("")[0], triangles("t smoothtriangles 0/0/1 catmark\n")[0]) == 0);
  CHECK(difference(triangles("")[0], triangles("t smoothtriangles 0/0/1 smooth\n")[0]) > 1e-3);
}

TEST_CASE("a wrong control mesh is refused by one line that names file, line, what was expected and what was there") {
  struct row {
    char const* what;
    std::string text;
    std::string message;
  };
  std::vector<row> const rows = {
      {"an edge of three faces", cube + "v 0 0 3\nf 7 8 9\n",
       "m.obj:10: expected edges of one face, or of two that run them in opposite directions, got 3 faces at the edge "
       "of "
       "vertices 7 and 8"},
      {"a face turned round", octahedron + "v 9 9 9\nf 1 3 7\n", "expected edges of one face, or of two"},
      {"two faces that meet in a vertex alone", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n",
       "m.obj:6: expected vertices whose faces are joined by edges, got vertex 1"},
      {"a face of two vertices", cube + "f 1 2\n", "m.obj:15: expected a face of 3 to 255 different vertices, got 2"},
      {"a face with a vertex twice", cube + "f 1 2 1 3\n",
       "m.obj:15: expected a face of 3 to 255 different vertices, got one of them twice"},
      {"a crease on no edge", cube + "\nt crease 2/1/0 0 6 1\n",
       "m.obj:16: expected an edge of a face, got vertices 0 and 6"},
      {"a crease at no vertex", cube + "t crease 2/1/0 0 8 1\n", "m.obj:15: expected a vertex from 0 to 7, got 8"},
      {"a crease at a negative vertex", cube + "t crease 2/1/0 0 -1 1\n", "expected a vertex from 0 to 7, got -1"},
      {"a crease of three vertices", cube + "t crease 3/1/0 0 1 2 1\n",
       "m.obj:15: expected pairs of vertices and one sharpness or one for each, got 3 integers and 1 reals"},
      {"a crease without a sharpness", cube + "t crease 2/0/0 0 1\n", "got 2 integers and 0 reals"},
      {"a negative sharpness", cube + "t crease 2/1/0 0 1 -1\n", "m.obj:15: expected a sharpness of 0 or more, got -1"},
      {"a corner with too many sharpnesses", cube + "t corner 1/2/0 0 1 2\n",
       "m.obj:15: expected vertices and one sharpness or one for each, got 1 integers and 2 reals"},
      {"a corner at no vertex", cube + "t corner 1/1/0 99999999999 1\n",
       "expected a vertex from 0 to 7, got 99999999999"},
      {"a hole in no face", cube + "t hole 1/0/0 6\n", "m.obj:15: expected a face from 0 to 5, got 6"},
      {"an unknown tag", cube + "t sharp 0/0/0\n",
       "m.obj:15: expected the tag crease, corner, hole, interpolateboundary, creasemethod or smoothtriangles, got "
       "'sharp'"},
      {"an unknown rule for boundaries", cube + "t interpolateboundary 1/0/0 3\n",
       "m.obj:15: expected one integer from 0 to 2 for 'interpolateboundary', got 3"},
      {"no rule for boundaries", cube + "t interpolateboundary 0/0/0\n", "for 'interpolateboundary', got 0 integers"},
      {"an unknown rule for creases", cube + "t creasemethod 0/0/1 smooth\n",
       "m.obj:15: expected 'normal' or 'chaikin' for 'creasemethod', got 'smooth'"},
      {"no rule for triangles", cube + "t smoothtriangles 0/0/0\n",
       "m.obj:15: expected 'catmark' or 'smooth' for 'smoothtriangles', got 0 words"},
  };
  for (auto const& r : rows) {
    std::string message = "nothing was thrown";
    try {
      surface_of(r.text);
    } catch (std::runtime_error const& error) {
      message = error.what();
    }
    CAPTURE(r.what, message);
    CHECK(message.starts_with("m.obj:"));
    CHECK(message.find(r.message) != message.npos);
    CHECK(message.find('\n') == message.npos);
  }
}

TEST_CASE("levels that a mesh does not have, and meshes without a limit surface, are refused") {
  auto const quads = surface_of(cube), triangles = surface_of(octahedron);
  for (int const level : {-1, 11, 1000000}) {
    CAPTURE(level);
    CHECK_THROWS_WITH(quads.to_bezier(level, end_cap::bspline),
                      test::contains_text("m.obj: expected a level from 0 to 10, got " + std::to_string(level)));
  }
  auto const pyramid = surface_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 4 3 2 1\nf 1 2 5\nf 2 3 5\n");
  for (auto const* mesh : {&triangles, &pyramid})
    CHECK_THROWS_WITH(mesh->to_bezier(0, end_cap::bspline),
                      test::contains_text("m.obj: expected a level from 1 to 10, got 0"));
  CHECK_THROWS_WITH(surface_of(cube + "t hole 6/0/0 0 1 2 3 4 5\n").to_bezier(2, end_cap::bspline),
                    test::contains_text("m.obj: expected a face with a limit surface, got none"));
}

TEST_CASE("random control meshes with random creases are covered by patches near the limit surface") {
  auto const seed = std::random_device()();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    std::string text = grid(5, [&](int, int) { return 2 * uniform(random); });
    for (int k = 0; k < 8; ++k) {
      int const vertex = int(random() % 30), to = vertex % 6 < 5 && random() % 2 ? vertex + 1 : vertex + 6;
      text += "t crease 2/1/0 " + std::to_string(vertex) + " " + std::to_string(to) + " " +
              std::to_string(12 * uniform(random)) + "\n";
    }
    text += "t corner 1/1/0 " + std::to_string(random() % 36) + " " + std::to_string(5 * uniform(random)) + "\n";
    auto const surface = surface_of(text);
    double before = 1;
    for (int const level : {2, 5, 8}) {
      CAPTURE(level);
      double const largest = surface.distances(surface.to_bezier(level, caps[random() % 2]), 3).largest;
      CHECK(largest < before);
      before = std::max(largest, 1e-12);
    }
    CHECK(before < 1e-3);
  }
}

TEST_CASE("models of level 2 have the patches that OpenSubdiv's float evaluation gives") {
  struct row {
    char const *mesh, *patches;
    std::size_t count, otherwise;
  };
  bool any = false;
  // The car has four corners of its boundary that are smooth; the file has OpenSubdiv's older patches there, with sharp ones.
  for (auto const& r :
       {row{"bigguy.obj", "bigguy_osd_L2.bpt", 5554, 0}, row{"osd_catmark_pawn.obj", "pawn_osd_L2.bpt", 2928, 0},
        row{"osd_catmark_car.obj", "car_osd_L2.bpt", 11331, 4}}) {
    auto const mesh = test::shared_data(r.mesh), patches = test::shared_data(r.patches);
    if (mesh.empty() || patches.empty()) continue;
    any = true;
    CAPTURE(r.mesh);
    auto const model = subdivision_surface(load_obj(mesh)).to_bezier(2, end_cap::bspline, semi_sharp::isolate);
    auto const expected = load_bpt(patches);
    REQUIRE(model.patches.size() == r.count);
    REQUIRE(expected.size() == r.count);
    double const diagonal = diagonal_of(expected);
    std::size_t otherwise = 0;
    for (std::size_t k = 0; k < r.count; ++k) {
      double const d = difference(model.patches[k], expected[k]) / diagonal;
      CHECK(d < 2e-4);
      otherwise += d > 2e-6;
    }
    CHECK(otherwise == r.otherwise);
  }
  if (!any) PATCHRT_SKIP("no control meshes and patches: set PATCHRT_SHARED_DATA");
}

TEST_CASE("every control mesh at hand is imported with the distances that the documentation gives") {
  struct row {
    char const* mesh;
    std::size_t patches;
    double largest;
  };
  bool any = false;
  for (auto const& r : {row{"osd_catmark_pawn.obj", 2064, 1.3e-7}, row{"osd_catmark_rook.obj", 22548, 9.8e-6},
                        row{"osd_catmark_car.obj", 32043, 2.95e-7}, row{"bigguy.obj", 19522, 9.5e-8}}) {
    auto const mesh = test::shared_data(r.mesh);
    if (mesh.empty()) continue;
    any = true;
    CAPTURE(r.mesh);
    subdivision_surface const surface(load_obj(mesh));
    auto const model = surface.to_bezier(8, end_cap::bspline);
    CHECK(model.patches.size() == r.patches);
    double const largest = surface.distances(model, 5).largest;
    CHECK(largest < r.largest);
    CHECK(largest > 0.9 * r.largest);
  }
  if (!any) PATCHRT_SKIP("no control meshes: set PATCHRT_SHARED_DATA");
}
