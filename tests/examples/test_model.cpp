// SPDX-License-Identifier: MIT
#include <examples/temporary_folder.hpp>
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/model.hpp>

#include <charconv>
#include <chrono>
#include <clocale>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <locale>
#include <random>
#include <sstream>
#include <string>
#include <vector>

using namespace patchrt;

namespace {

/// One patch's text whose control point (i, j) is `point(i, j)`.
template <class F> std::string patch_text(F point, std::string const& separator = "\n") {
  std::string text = "3 3" + separator;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) text += point(i, j) + separator;
  return text;
}

std::string plane_point(int i, int j) { return std::to_string(i) + " " + std::to_string(j) + " 0"; }
std::string const plane = patch_text(plane_point);

/// The text of the plane with its k-th token (0, 1: the degrees) replaced.
std::string plane_with(int k, std::string const& token) {
  std::istringstream in(plane);
  std::string text, word;
  for (int n = 0; in >> word; ++n) text += (n == k ? token : word) + (n == 1 || (n > 1 && n % 3 == 1) ? "\n" : " ");
  return text;
}

}  // namespace

TEST_CASE("control points are read row by row along u, columns along v") {
  auto const patches = parse_bpt("1\n" + plane, "plane.bpt");
  REQUIRE(patches.size() == 1);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) REQUIRE(patches[0](i, j) == vec3<double>{double(i), double(j), 0.0});
}

TEST_CASE("white space of any kind separates tokens and may surround them") {
  auto const expected = parse_bpt("1\n" + plane, "plane.bpt");
  for (std::string const separator : {"\r\n", " ", "\t", "\n\n", " \v\f\r\n"}) {
    CAPTURE(separator.size());
    auto const patches = parse_bpt(separator + "1" + separator + patch_text(plane_point, separator), "plane.bpt");
    REQUIRE(patches.size() == 1);
    REQUIRE(std::memcmp(&patches[0], &expected[0], sizeof patches[0]) == 0);
  }
  REQUIRE(parse_bpt("1 " + plane.substr(0, plane.size() - 1), "no_last_line_end.bpt").size() == 1);
}

TEST_CASE("every double comes back bit for bit from its shortest decimal form") {
  auto const seed = std::random_device()();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int n = 0; n < 200; ++n) {
    bicubic_patch<double> patch;
    auto const coordinate = [&] {
      double x;
      do {
        std::uint64_t const bits = random();
        std::memcpy(&x, &bits, sizeof x);
      } while (!std::isfinite(x));
      return x;
    };
    for (auto& p : patch.control_points) p = {coordinate(), coordinate(), coordinate()};
    auto const text = patch_text([&](int i, int j) {
      std::string line;
      for (int axis = 0; axis < 3; ++axis) {
        char digits[32];
        line.append(digits, std::to_chars(digits, digits + sizeof digits, patch(i, j)[axis]).ptr) += ' ';
      }
      return line;
    });
    auto const read = parse_bpt("1\n" + text, "random.bpt");
    REQUIRE(std::memcmp(&read[0], &patch, sizeof patch) == 0);
  }
}

TEST_CASE("patches come back bit for bit from the text they are written as") {
  auto const seed = std::random_device()();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-1070, 1023);
  std::vector<bicubic_patch<double>> patches(20);
  for (auto& patch : patches)
    for (auto& p : patch.control_points)
      for (int axis = 0; axis < 3; ++axis) p[axis] = std::ldexp(mantissa(random), exponent(random));
  patches[3](1, 2) = {0.0, -0.0, 1e22};
  auto const read = parse_bpt(to_bpt(patches), "written.bpt");
  REQUIRE(read.size() == patches.size());
  REQUIRE(std::memcmp(read.data(), patches.data(), patches.size() * sizeof patches[0]) == 0);
}

TEST_CASE("the decimal point is a point in every locale") {
  struct comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
  };
  std::string const c_locale = std::setlocale(LC_ALL, nullptr);
  auto const cpp_locale = std::locale::global(std::locale(std::locale::classic(), new comma));
  for (char const* name : {"de_DE.UTF-8", "fr_FR.UTF-8"})  // for strtod, where installed
    if (std::setlocale(LC_ALL, name)) break;
  auto const patches = parse_bpt("1\n" + plane_with(2, "0.5"), "plane.bpt");
  std::locale::global(cpp_locale);
  std::setlocale(LC_ALL, c_locale.c_str());
  REQUIRE(patches[0](0, 0).x == 0.5);
}

TEST_CASE("patches that collapse to a point or a line are models") {
  auto const point = patch_text([](int, int) { return std::string("1 2 3"); });
  auto const line = patch_text([](int i, int) { return std::to_string(i) + " 0 0"; });
  REQUIRE(parse_bpt("2\n" + point + line, "collapsed.bpt").size() == 2);
}

TEST_CASE("a wrong model is refused by one line that names file, line, patch, and what was expected") {
  struct row {
    char const* what;
    std::string text;
    std::string message;
  };
  std::string const two = "2\n" + plane;
  std::vector<row> const rows = {
      {"an empty file", "", "m.bpt:1: expected the number of patches, 1 or more, got the end of the file"},
      {"white space only", " \n\n", "m.bpt:3: expected the number of patches, 1 or more, got the end of the file"},
      {"no patches", "0\n", "m.bpt:1: expected the number of patches, 1 or more, got '0'"},
      {"a negative count", "-1\n", "m.bpt:1: expected the number of patches, 1 or more, got '-1'"},
      {"a fraction as the count", "1.0\n", "m.bpt:1: expected the number of patches, 1 or more, got '1.0'"},
      {"a count beyond 64 bits", "18446744073709551616\n", "got '18446744073709551616'"},
      {"another format", "# Wavefront\nv 0 0 0\n", "m.bpt:1: expected the number of patches, 1 or more, got '#'"},
      {"an absurd count", "2000000000", "m.bpt:1: patch 0: expected degree 3 in u, got the end of the file"},
      {"an absurd count and a patch", "2000000000\n" + plane,
       "m.bpt:19: patch 1: expected degree 3 in u, got the end of"},
      {"a wrong degree in u", "1\n" + plane_with(0, "2"), "m.bpt:2: patch 0: expected degree 3 in u, got '2'"},
      {"a wrong degree in v", two + plane_with(1, "4"), "m.bpt:19: patch 1: expected degree 3 in v, got '4'"},
      {"NaN", "1\n" + plane_with(2 + 3 * 5 + 1, "nan"),
       "m.bpt:8: patch 0: expected a finite number for y of control point 5, got 'nan'"},
      {"infinity", two + plane_with(2 + 3 * 15 + 2, "-inf"),
       "m.bpt:35: patch 1: expected a finite number for z of control point 15, got '-inf'"},
      {"a number beyond double", "1\n" + plane_with(2, "1e999"),
       "m.bpt:3: patch 0: expected a finite number for x of control point 0, got '1e999'"},
      {"a word", "1\n" + plane_with(3, "one"), "expected a finite number for y of control point 0, got 'one'"},
      {"a number with a tail", "1\n" + plane_with(2, "1.5f"), "got '1.5f'"},
      {"a decimal comma", "1\n" + plane_with(2, "1,5"), "got '1,5'"},
      {"a hexadecimal number", "1\n" + plane_with(2, "0x10"), "got '0x10'"},
      {"two signs", "1\n" + plane_with(2, "+-1"), "got '+-1'"},
      {"the end between patches", two, "m.bpt:19: patch 1: expected degree 3 in u, got the end of the file"},
      {"the end within a patch", two + "3 3\n0 0 0\n0 1",
       "m.bpt:21: patch 1: expected a finite number for z of control point 1, got the end of the file"},
      {"text after the last patch", "1\n" + plane + "3 3\n",
       "m.bpt:19: expected the end of the file after patch 0, got '3'"},
      {"bytes that are no text", std::string("1\n3 3\n\0\x1b[2J\xff", 12), "got '??[2J?'"},
      {"a long token", std::string(10000, '7'), "got '77777777777777777777777777777777...'"},
  };
  for (auto const& r : rows) {
    CAPTURE(r.what);
    try {
      parse_bpt(r.text, "m.bpt");
      FAIL("was not refused");
    } catch (std::runtime_error const& error) {
      std::string const message = error.what();
      CAPTURE(message);
      CHECK(message.find(r.message) != message.npos);
      CHECK(message.find('\n') == message.npos);
    }
  }
}

TEST_CASE("every cut of a model is refused") {
  std::string const text = "2\n" + plane + plane.substr(0, plane.size() - 1);
  REQUIRE(parse_bpt(text, "whole.bpt").size() == 2);
  for (std::size_t length = 0; length < text.size(); ++length) {
    CAPTURE(length);
    REQUIRE_THROWS_AS(parse_bpt(std::string_view(text).substr(0, length), "cut.bpt"), std::runtime_error);
  }
}

TEST_CASE("what is no readable file is refused by name") {
  test::temporary_folder const folder;
  REQUIRE_THROWS_WITH(load_bpt(folder / "none.bpt"),
                      test::contains_text("none.bpt: expected a file, got nothing of that name"));
  REQUIRE_THROWS_WITH(load_bpt(folder / ""), test::contains_text("expected a file, got a directory"));
  REQUIRE_THROWS_WITH(load_bpt("/dev/zero"), test::contains_text("expected a file, got a device"));
  std::ofstream(folder / "sparse.bpt") << "1";
  std::filesystem::resize_file(folder / "sparse.bpt", std::uintmax_t(1) << 40);
  REQUIRE_THROWS_WITH(load_bpt(folder / "sparse.bpt"),
                      test::contains_text("sparse.bpt: expected at most 4294967296 bytes"));
}

TEST_CASE("the teapot of the project has 32 patches in the known box") {
  auto const patches = load_bpt(test::project_data("teapot.bpt"));
  REQUIRE(patches.size() == 32);
  auto b = box<double>::empty();
  for (auto const& patch : patches) b = merge(b, bounds(patch));
  REQUIRE(b == box<double>{{-3.0, -2.0, 0.0}, {3.525, 2.0, 3.15}});
}

TEST_CASE("eleven thousand patches load in well under a second") {
  std::string text = "11331\n";
  for (int k = 0; k < 11331; ++k)
    text += patch_text([k](int i, int j) {
      return std::to_string(0.1234567 * i + k) + " " + std::to_string(-7.654321 * j) + " " +
             std::to_string(0.5 * i * j);
    });
  auto const start = std::chrono::steady_clock::now();
  REQUIRE(parse_bpt(text, "large.bpt").size() == 11331);
  double const seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  CAPTURE(seconds);
  CHECK(seconds < 1);
}

TEST_CASE("every model at hand loads with the number of patches it announces") {
  struct row {
    char const* file;
    std::size_t patches;
  };
  bool any = false;
  for (auto const& r : {row{"gumbo.bpt", 128}, row{"bigguy_osd_L2.bpt", 5554}, row{"car_osd_L2.bpt", 11331},
                        row{"pawn_osd_L2.bpt", 2928}, row{"teapot_newell28_nobottom.bpt", 28}}) {
    auto const file = test::shared_data(r.file);
    if (file.empty()) continue;
    any = true;
    CAPTURE(file.string());
    REQUIRE(load_bpt(file).size() == r.patches);
  }
  if (!any) PATCHRT_SKIP("no further models: set PATCHRT_SHARED_DATA");
}
