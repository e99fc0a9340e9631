// SPDX-License-Identifier: MIT
#include <examples/run_command.hpp>
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/model.hpp>
#include <support/subdivision.hpp>

#include <cstring>
#include <fstream>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::examples;
using test::contents;
using test::run;

namespace {

std::string const import_program = "'" PATCHRT_IMPORT "' ";

std::string const cube =
    "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
    "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

bool are_same(std::vector<bicubic_patch<double>> const& a, std::vector<bicubic_patch<double>> const& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
}

}  // namespace

TEST_CASE("import writes the patches of a control mesh and says how far they are from the limit surface") {
  test::temporary_folder const folder;
  std::ofstream(folder / "cube.obj") << cube << "l 1 2\n";
  subdivision_surface const surface(load_obj(folder / "cube.obj"));
  auto const got = run(folder, import_program + "cube.obj -o out.bpt --level 3 --end-cap gregory");
  CAPTURE(got.err);
  REQUIRE(got.status == 0);
  CHECK(got.out ==
        "out.bpt: 168 patches of 6 faces, level 3, end caps gregory\n"
        "cube.obj: statements that are neither vertices nor faces: 1 ignored, the first in line 15\n"
        "distance from the limit surface, in diagonals, at 4200 points: largest 3.3e-05, rms 6.7e-06; 144 patches "
        "exact\n");
  CHECK(are_same(load_bpt(folder / "out.bpt"), surface.to_bezier(3, end_cap::gregory).patches));

  auto const plain = run(folder, import_program + "cube.obj -o out.bpt --samples 0");
  CHECK(plain.out.find("distance") == plain.out.npos);
  CHECK(are_same(load_bpt(folder / "out.bpt"), surface.to_bezier(8, end_cap::bspline).patches));

  auto const quiet = run(folder, import_program + "cube.obj -o out.bpt --quiet");
  CHECK(quiet.status == 0);
  CHECK((quiet.out.empty() && quiet.err.empty()));
}

TEST_CASE("no ray from within an imported surface with creases gets out between its patches") {
  test::temporary_folder const folder;
  std::ofstream(folder / "cube.obj") << cube << "t crease 8/4/0 0 1 1 2 2 3 3 0 4.5 2 7 3.25\n"
                                     << "t crease 6/3/0 4 5 5 6 2 6 1 6.5 2.75\n";
  for (std::string const options :
       {"--level 3", "--level 4 --end-cap gregory", "--level 6", "--level 4 --creases isolate"}) {
    REQUIRE(run(folder, import_program + "cube.obj -o cube.bpt --quiet " + options).status == 0);
    for (std::string const direction : {"1,0,0", "-1,0,0", "0,1,0", "0,-1,0", "0,0,1", "0,0,-1"}) {
      CAPTURE(options, direction);
      auto const got = run(folder, "'" PATCHRT_RENDER
                                   "' cube.bpt -o t.png --size 300x300 --vfov 100 --up 0.1,0.3,0.9 "
                                   "--eye 0.01,0.02,0.03 --look-at " +
                                       direction);
      CHECK(got.out.find("300x300 pixels, 90000 hits") != got.out.npos);
    }
  }
}

TEST_CASE("import writes several meshes into a folder under their names") {
  test::temporary_folder const folder;
  std::ofstream(folder / "a.obj") << cube;
  std::ofstream(folder / "b.c.obj") << cube << "t crease 2/1/0 0 1 3\n";
  std::filesystem::create_directory(folder / "models");
  auto const got = run(folder, import_program + "a.obj b.c.obj -o models --level 2");
  CAPTURE(got.err);
  REQUIRE(got.status == 0);
  CHECK(load_bpt(folder / "models/a.bpt").size() == 96);
  CHECK(!are_same(load_bpt(folder / "models/a.bpt"), load_bpt(folder / "models/b.c.bpt")));
}

TEST_CASE("bad control meshes and options end import with status 1 and one line, and leave no file") {
  test::temporary_folder const folder;
  std::ofstream(folder / "cube.obj") << cube;
  std::ofstream(folder / "empty.obj").flush();
  std::ofstream(folder / "crease.obj") << cube << "t crease 2/1/0 0 6 1\n";
  std::ofstream(folder / "fan.obj") << cube << "v 0 0 3\nf 7 8 9\n";
  std::ofstream(folder / "triangle.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  std::ofstream(folder / "nan.obj") << "v 0 nan 0\n";
  struct row {
    std::string command;
    std::string message;
  };
  std::vector<row> const rows = {
      {"none.obj -o out.bpt", "patchrt-import: none.obj: expected a file, got nothing of that name"},
      {"empty.obj -o out.bpt", "patchrt-import: empty.obj:0: expected a vertex, got the end of the file"},
      {"nan.obj -o out.bpt", "patchrt-import: nan.obj:1: expected a finite number for y, got 'nan'"},
      {"crease.obj -o out.bpt", "patchrt-import: crease.obj:15: expected an edge of a face, got vertices 0 and 6"},
      {"fan.obj -o out.bpt", "patchrt-import: fan.obj:10: expected edges of one face, or of two"},
      {"triangle.obj -o out.bpt --level 0", "patchrt-import: triangle.obj: expected a level from 1 to 10, got 0"},
      {"cube.obj -o none/out.bpt", "patchrt-import: none/out.bpt: cannot be written"},
      {"cube.obj crease.obj -o out.bpt", "patchrt-import: out.bpt: expected a folder for 2 meshes, got none"},
      {"cube.obj -o out.bpt --level 11", "--level: expected a level from 0 to 10, got '11'"},
      {"cube.obj -o out.bpt --level 1e9", "--level: expected a level from 0 to 10, got '1e9'"},
      {"cube.obj -o out.bpt --samples 1", "--samples: expected 0 or a number from 2 to 64, got '1'"},
      {"cube.obj -o out.bpt --end-cap none", "--end-cap"},
      {"cube.obj -o out.bpt --creases none", "--creases"},
      {"cube.obj", "--output is required"},
      {"-o out.bpt", "MESH is required"},
  };
  for (auto const& r : rows) {
    auto const got = run(folder, import_program + r.command);
    CAPTURE(r.command, got.err);
    CHECK(got.status == 1);
    CHECK(got.out.empty());
    CHECK(got.err.find(r.message) != got.err.npos);
    CHECK(got.err.find('\n') == got.err.size() - 1);
    CHECK(!exists(folder / "out.bpt"));
  }
}
