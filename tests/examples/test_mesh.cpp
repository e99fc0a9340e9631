// SPDX-License-Identifier: MIT
#include <examples/temporary_folder.hpp>
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/load_mesh.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::examples;

namespace {

using triangle = std::array<std::uint32_t, 3>;

std::string const square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

loaded_mesh mesh_of(std::string const& text) { return triangulate(parse_obj(text, "m.obj")); }

/// The shortest decimal form.
std::string decimal(double x) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, x).ptr};
}

vec3<double> area_vector(mesh const& m, triangle const& t) {
  return cross(m.vertices[t[1]] - m.vertices[t[0]], m.vertices[t[2]] - m.vertices[t[0]]) * 0.5;
}

/// The message of what `f` throws.
template <class F> std::string message_of(F f) {
  try {
    f();
  } catch (std::runtime_error const& error) {
    return error.what();
  }
  return "nothing was thrown";
}

}  // namespace

TEST_CASE("vertices and triangles are read in file order, counted from one or back from the last") {
  for (std::string const face : {"f 1 2 3\n", "f -4 -3 -2\n", "f 1/7 2/8 3/9\n", "f 1//5 2//5 3//5\n",
                                 "f 1/2/3 2/2/3 3/2/3\n", " \tf  +1\t2 3 \n", "f 1 2 3"}) {
    CAPTURE(face);
    mesh const m = mesh_of(square + face);
    REQUIRE(m.vertices.size() == 4);
    CHECK(m.vertices[2] == vec3<double>(1, 1, 0));
    CHECK(m.triangles == std::vector<triangle>{{0, 1, 2}});
  }
  mesh const forward = mesh_of("f 1 2 3\n" + square + "f 2 3 4\n");
  CHECK(forward.triangles == std::vector<triangle>{{0, 1, 2}, {1, 2, 3}});
  mesh const relative = mesh_of("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -3 -2 -1\n");
  CHECK(relative.triangles == std::vector<triangle>{{1, 2, 3}, {2, 3, 4}});
}

TEST_CASE("line ends of any kind, comments, groups and materials change nothing") {
  std::string const plain = square + "f 1 2 3\nf 1 3 4\n";
  auto const expected = mesh_of(plain);
  for (std::string const end : {"\n", "\r\n", "\r", "\n\n", "\r\n\r\n"}) {
    CAPTURE(end.size());
    std::string text =
        "# a comment" + end + "mtllib none.mtl" + end + "o thing" + end + "vn 0 0 1" + end + "vt 0 0" + end;
    for (char const c : plain) text += c == '\n' ? end : std::string(1, c);
    text += "g" + end + "g a b" + end + "usemtl red" + end + "s off" + end + "  # the end";
    auto const m = mesh_of(text);
    CHECK(m.vertices == expected.vertices);
    CHECK(m.triangles == expected.triangles);
    CHECK(describe_skipped(m).empty());
  }
  CHECK(mesh_of("\xEF\xBB\xBF" + plain).vertices == expected.vertices);
}

TEST_CASE("every double comes back from an OBJ bit for bit from its shortest decimal form") {
  auto const seed = std::random_device()();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-300, 300);
  std::string text;
  std::vector<vec3<double>> expected;
  for (int k = 0; k < 500; ++k) {
    vec3<double> v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = std::ldexp(mantissa(random), exponent(random));
    expected.push_back(v);
    text += "v " + decimal(v.x) + " " + decimal(v.y) + " " + decimal(v.z) + "\n";
  }
  CHECK(mesh_of(text + "f 1 2 3\n").vertices == expected);
}

TEST_CASE(
    "a polygon is cut into triangles of its orientation that cover it once, wherever it is and however it starts") {
  // An L, a comb, a square with corners along its sides, and a square with a square hole joined to its edge by a keyhole.
  std::vector<std::vector<std::array<double, 2>>> const polygons = {
      {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}},
      {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1}, {5, 3}, {4, 3}, {4, 1}, {3, 1}, {3, 3}, {0, 3}},
      {{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 2}, {0, 2}, {0, 1}},
      {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}}};
  std::vector<double> const areas = {3, 17, 4, 12};
  for (std::size_t shape = 0; shape < polygons.size(); ++shape)
    for (double const offset : {0.0, 10.0, -10.0, 1000.0})
      for (int const plane : {0, 1, 2})
        for (bool const turned : {false, true})
          for (std::size_t start = 0; start < polygons[shape].size(); ++start) {
            CAPTURE(shape, offset, plane, turned, start);
            auto polygon = polygons[shape];
            if (turned) std::reverse(polygon.begin(), polygon.end());
            std::string text, face = "f";
            for (std::size_t k = 0; k < polygon.size(); ++k) {
              auto const& p = polygon[(start + k) % polygon.size()];
              vec3<double> v;
              v[plane] = 5;
              v[(plane + 1) % 3] = p[0] + offset;
              v[(plane + 2) % 3] = p[1] - offset;
              text += "v " + decimal(v.x) + " " + decimal(v.y) + " " + decimal(v.z) + "\n";
              face += " " + std::to_string(k + 1);
            }
            mesh const m = mesh_of(text + face + "\n");
            CHECK(m.triangles.size() == polygon.size() - 2);
            double covered = 0;
            for (auto const& t : m.triangles) {
              double const area = area_vector(m, t)[plane] * (turned ? -1 : 1);
              CHECK(area >= 0);
              covered += area;
            }
            CHECK(covered == Approx(areas[shape]));
          }
}

TEST_CASE("random polygons that see all of themselves from a point are covered once") {
  auto const seed = std::random_device()();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int trial = 0; trial < 200; ++trial) {
    int const corners = 4 + int(random() % 40);
    CAPTURE(trial, corners);
    vec3<double> const centre(20 * uniform(random) - 10, 20 * uniform(random) - 10, 20 * uniform(random) - 10);
    vec3<double> const a(1, uniform(random), -uniform(random)), b(-uniform(random), 1, uniform(random));
    std::string text, face = "f";
    vec3<double> area(0.0), last(0.0), first(0.0);
    for (int k = 0; k < corners; ++k) {
      double const angle = 2 * std::numbers::pi * k / corners, radius = 0.1 + uniform(random);
      vec3<double> const spoke = a * (radius * std::cos(angle)) + b * (radius * std::sin(angle)), v = centre + spoke;
      if (k == 0) first = spoke;
      else area = area + cross(last, spoke) * 0.5;
      last = spoke;
      text += "v " + decimal(v.x) + " " + decimal(v.y) + " " + decimal(v.z) + "\n";
      face += " " + std::to_string(k + 1);
    }
    area = area + cross(last, first) * 0.5;
    mesh const m = mesh_of(text + face + "\n");
    REQUIRE(m.triangles.size() == std::size_t(corners) - 2);
    double covered = 0;
    for (auto const& t : m.triangles) {
      vec3<double> const n = area_vector(m, t);
      CHECK(dot(n, area) >= 0);
      covered += std::sqrt(dot(n, n));
    }
    CHECK(covered == Approx(std::sqrt(dot(area, area))));
  }
}

TEST_CASE("a polygon of a thousand corners or without any area becomes triangles") {
  std::string circle, face = "f";
  for (int k = 1; k <= 1000; ++k) {
    circle += "v " + decimal(std::cos(k * 2e-3 * std::numbers::pi)) + " " +
              decimal(std::sin(k * 2e-3 * std::numbers::pi)) + " 1\n";
    face += " " + std::to_string(k);
  }
  CHECK(mesh_of(circle + face).triangles.size() == 998);
  std::string line = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\n";
  CHECK(mesh_of(line + "f 1 2 3 4 5\n").triangles.size() == 3);
}

TEST_CASE("faces of fewer than three different vertices are skipped, counted and said") {
  auto const m = mesh_of(square + "f 1 2 3\nf 1 2\nf\nf 1\nf 1 1 2\nf 1 2 1 2\nf 2 3 4 4\nf 1 2 3 3 1\n");
  CHECK(m.triangles == std::vector<triangle>{{0, 1, 2}, {1, 2, 3}, {0, 1, 2}});
  CHECK(m.skipped_faces == 5);
  CHECK(m.first_skipped_line == 6);
  CHECK(describe_skipped(m) == "faces of fewer than three different vertices: 5 skipped, the first in line 6");
  CHECK(describe_skipped(mesh_of(square + "f 1 2 3\n")).empty());
}

TEST_CASE("statements that are neither vertices nor faces are ignored, counted and said") {
  auto const m = mesh_of(square + "l 1 2\np 3\nsurf 0 1 0 1 1 2 3\nfoo\nf 1 2 3\nf 1 1\n");
  CHECK(m.triangles.size() == 1);
  CHECK(describe_skipped(m) ==
        "faces of fewer than three different vertices: 1 skipped, the first in line 10; "
        "statements that are neither vertices nor faces: 4 ignored, the first in line 5");
}

TEST_CASE("tags are read with their integers, reals and words") {
  auto const model = parse_obj(
      square + "f 1 2 3 4\nt crease 2/1/0 0 1 2.5\n\nt  names 0/0/2 red blue\r\nt corner 2/2/0 1 2 .5 3\n", "m.obj");
  REQUIRE(model.tags.size() == 3);
  CHECK(model.tags[0].name == "crease");
  CHECK(model.tags[0].integers == std::vector<std::int64_t>{0, 1});
  CHECK(model.tags[0].reals == std::vector<double>{2.5});
  CHECK(model.tags[0].line == 6);
  CHECK(model.tags[1].words == std::vector<std::string>{"red", "blue"});
  CHECK(model.tags[1].line == 8);
  CHECK(model.tags[2].reals == std::vector<double>{0.5, 3});
  CHECK(describe_ignored(model).empty());
}

TEST_CASE("a wrong OBJ is refused by one line that names file, line, what was expected and what was there") {
  struct row {
    char const* what;
    std::string text;
    std::string message;
  };
  std::string const ok = square + "f 1 2 3\n";
  std::vector<row> const rows = {
      {"an empty file", "", "m.obj:0: expected a vertex, got the end of the file"},
      {"comments only", "# a\n\n# b", "m.obj:3: expected a vertex, got the end of the file"},
      {"faces of no vertices", "f 1 2 3\n", "m.obj:1: expected a vertex, got the end of the file"},
      {"no faces", square, "m.obj:4: expected a face, got the end of the file"},
      {"only faces that are skipped", square + "f 1 2\nf 3 3 3\n",
       "m.obj: expected a face of three different vertices, got 2 faces of fewer"},
      {"NaN", "v 0 0 0\nv 1 nan 0\n", "m.obj:2: expected a finite number for y, got 'nan'"},
      {"NaN after CR LF", "v 0 0 0\r\n\r\nv nan 0 0\r\n", "m.obj:3: expected a finite number for x, got 'nan'"},
      {"NaN after CR", "v 0 0 0\r\rv 0 0 nan\r", "m.obj:3: expected a finite number for z, got 'nan'"},
      {"infinity", "v 0 0 -inf\n", "m.obj:1: expected a finite number for z, got '-inf'"},
      {"a number beyond double", "v 1e999 0 0\n", "m.obj:1: expected a finite number for x, got '1e999'"},
      {"a word", "v 1 2 three\n", "m.obj:1: expected a finite number for z, got 'three'"},
      {"a decimal comma", "v 1,5 2 3\n", "m.obj:1: expected a finite number for x, got '1,5'"},
      {"a vertex of two numbers", "v 1 2\n", "m.obj:1: expected a finite number for z, got the end of the line"},
      {"a vertex of none", ok + "v\n", "m.obj:6: expected a statement of OBJ, got 'v'"},
      {"the end within a vertex", ok + "v 0 1", "m.obj:6: expected a finite number for z, got the end of the line"},
      {"index 0", ok + "f 0 1 2\n", "m.obj:6: expected an index of a vertex, from 1 on or negative, got '0'"},
      {"an index too large", ok + "f 1 2 5\n", "m.obj:6: expected an index of one of the 4 vertices, got 5"},
      {"an index too far back", ok + "f -1 -2 -5\n",
       "m.obj:6: expected an index of one of the 4 vertices before this line, got '-5'"},
      {"an index of 2^32 + 1", ok + "f 4294967297 2 3\n",
       "m.obj:6: expected an index of a vertex, from 1 on or negative"},
      {"a fraction as an index", ok + "f 1.5 2 3\n", "m.obj:6: expected an index of a vertex"},
      {"a word as an index", ok + "f 1 two 3\n",
       "m.obj:6: expected an index of a vertex, from 1 on or negative, got 'two'"},
      {"a continued line", ok + "f 1 2 \\\n3\n",
       "m.obj:6: expected an index of a vertex, from 1 on or negative, got '\\'"},
      {"four indices a corner", ok + "f 1/1/1/1 2 3\n", "m.obj:6: expected an index of a vertex"},
      {"a zero byte in a face", ok + std::string("f 1 2 3 \0 4\n", 12),
       "m.obj:6: expected the end of the line, got '?'"},
      {"a zero byte for a face", ok + std::string("f \0\n", 4), "m.obj:6: expected a statement of OBJ, got 'f ?'"},
      {"a tag without counts", ok + "t crease\n",
       "m.obj:6: expected the numbers of integers, reals and words as I/R/S, got the end of the line"},
      {"a tag of two counts", ok + "t crease 2/1 0 1 1\n", "words as I/R/S, got '2/1'"},
      {"a tag without a name", ok + "t\n", "m.obj:6: expected the name of a tag, got the end of the line"},
      {"a tag of too few integers", ok + "t crease 3/1/0 0 1 1.5\n",
       "m.obj:6: expected an integer of the tag 'crease', got '1.5'"},
      {"a tag of absurdly many integers", ok + "t crease 18446744073709551615/1/0 0 1\n",
       "m.obj:6: expected an integer of the tag 'crease', got the end of the line"},
      {"a tag of too few reals", ok + "t crease 2/1/0 0 1\n",
       "m.obj:6: expected a finite number of the tag 'crease', got the end of the line"},
      {"a tag of an infinite real", ok + "t crease 2/1/0 0 1 inf\n", "finite number of the tag 'crease', got 'inf'"},
      {"a tag of too few words", ok + "t a 0/0/1\n",
       "m.obj:6: expected a word of the tag 'a', got the end of the line"},
      {"a tag of too many words", ok + "t a 0/0/1 b c\n", "m.obj:6: expected the end of the line, got 'c'"},
      {"patches", "2\n3 3\n0 0 0\n", "m.obj:3: expected a vertex, got the end of the file"},
  };
  for (auto const& r : rows) {
    std::string const message = message_of([&] { mesh_of(r.text); });
    CAPTURE(r.what, message);
    CHECK(message.starts_with("m.obj:"));
    CHECK(message.find(r.message) != message.npos);
    CHECK(message.find('\n') == message.npos);
  }
}

TEST_CASE("a face of absurdly many corners is refused") {
  std::string face = "f";
  for (int k = 0; k < 4097; ++k) face += " 1 2 3 4";
  CHECK(message_of([&] { mesh_of(square + face); }) == "m.obj:5: expected a face of at most 4096 corners, got 16388");
}

TEST_CASE("what is no readable OBJ file is refused by name") {
  test::temporary_folder const folder;
  CHECK_THROWS_WITH(load_mesh(folder / "none.obj"),
                    test::contains_text("none.obj: expected a file, got nothing of that name"));
  CHECK_THROWS_WITH(load_mesh(folder / ""), test::contains_text("expected a file, got a directory"));
  std::ofstream(folder / "bad.obj") << square << "f 1 2 9\n";
  CHECK_THROWS_WITH(load_mesh(folder / "bad.obj"), test::contains_text("bad.obj:5: expected an index of one of the 4"));
}

TEST_CASE("every mesh at hand loads whole, with the triangles of its faces") {
  struct row {
    char const* file;
    std::size_t vertices, triangles;
  };
  bool any = false;
  for (auto const& r : {row{"stanford_bunny.obj", 35947, 69451}, row{"teapot_mesh.obj", 3644, 6320},
                        row{"spot.obj", 2930, 5856}, row{"dragon_res3.obj", 22998, 47794},
                        row{"bigguy.obj", 1452, 2900}, row{"osd_catmark_rook.obj", 768, 44 + 2 * 733}}) {
    auto const file = test::shared_data(r.file);
    if (file.empty()) continue;
    any = true;
    CAPTURE(file.string());
    auto const m = load_mesh(file);
    CHECK(m.vertices.size() == r.vertices);
    CHECK(m.triangles.size() == r.triangles);
    CHECK(describe_skipped(m).empty());
  }
  if (!any) PATCHRT_SKIP("no further models: set PATCHRT_SHARED_DATA");
}
