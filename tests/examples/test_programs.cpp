// SPDX-License-Identifier: MIT
// The programs as users run them: command lines in, files, messages and exit statuses out.
#include <examples/run_command.hpp>
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/model.hpp>
#include <support/ray_file.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

using namespace patchrt;
using examples::hit_record;
using test::contents;
using test::run;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

std::string const render = "'" PATCHRT_RENDER "' ";
std::string const query = "'" PATCHRT_QUERY "' ";
std::string const accuracy_program = "'" PATCHRT_ACCURACY "' ";

void write_rays(std::filesystem::path const& file, std::vector<ray<double>> const& rays) {
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<char const*>(rays.data()), std::streamsize(rays.size() * sizeof(ray<double>)));
}

std::vector<hit_record> read_hits(std::filesystem::path const& file) {
  std::string const bytes = contents(file);
  std::vector<hit_record> hits(bytes.size() / sizeof(hit_record));
  std::memcpy(static_cast<void*>(hits.data()), bytes.data(), hits.size() * sizeof(hit_record));
  return hits;
}

/// Rays from around the teapot to points in its box.
std::vector<ray<double>> random_rays(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(-1, 1);
  auto const point = [&](double size) {
    return vec3<double>{size * any(random), size * any(random), 1.5 + size * any(random)};
  };
  std::vector<ray<double>> rays(n);
  for (auto& r : rays) {
    r.origin = point(6);
    r.direction = point(1.5) - r.origin;
    r.t_min = 0;
    r.t_max = inf;
  }
  return rays;
}

struct png_size {
  unsigned width, height;
  friend bool operator==(png_size const&, png_size const&) = default;
};

/// Width and height out of a PNG's header, 0 where it is none.
png_size size_of_png(std::filesystem::path const& file) {
  std::string const bytes = contents(file);
  if (bytes.size() < 24 || bytes.compare(0, 8, "\x89PNG\r\n\x1a\n") != 0) return {0, 0};
  auto const number = [&](std::size_t at) {
    unsigned n = 0;
    for (std::size_t k = 0; k < 4; ++k) n = n << 8 | static_cast<unsigned char>(bytes[at + k]);
    return n;
  };
  return {number(16), number(20)};
}

}  // namespace

TEST_CASE("bad input ends a program with status 1 and one line that says what is wrong") {
  test::temporary_folder const folder;
  write_rays(folder / "rays", random_rays(3, 1));
  std::ofstream(folder / "ragged") << std::string(100, 'x');
  std::ofstream(folder / "empty.bpt").flush();
  std::filesystem::create_symlink("/dev/full",
                                  folder / "full");  // a broken program may remove the link, not the device
  std::ofstream(folder / "short.bpt") << "2000000000";
  std::ofstream(folder / "zero.bpt") << "0\n";
  std::ofstream(folder / "nan.bpt") << "1\n3 3\n0 0 nan";
  std::string huge = "1 3 3";
  for (int k = 0; k < 48; ++k) huge += k % 2 ? " 1e300" : " -1e300";
  std::ofstream(folder / "huge.bpt") << huge;

  struct row {
    std::string command;
    std::string message;
  };
  std::string const asked = " --rays rays --hits hits";
  std::vector<row> const rows = {
      // the model
      {query + "none.bpt" + asked, "patchrt-query: none.bpt: expected a file, got nothing of that name"},
      {query + "'no\nmodel.bpt'" + asked, "patchrt-query: no model.bpt: expected a file, got nothing of that name"},
      {query + "." + asked, "patchrt-query: .: expected a file, got a directory"},
      {query + "/dev/zero" + asked, "/dev/zero: expected a file, got a device"},
      {query + "empty.bpt" + asked, "empty.bpt:1: expected the number of patches"},
      {query + "short.bpt" + asked, "short.bpt:1: patch 0: expected degree 3 in u, got the end of the file"},
      {query + "zero.bpt" + asked, "zero.bpt:1: expected the number of patches, 1 or more, got '0'"},
      {query + "nan.bpt" + asked, "nan.bpt:3: patch 0: expected a finite number for z of control point 0, got 'nan'"},
      {query + "huge.bpt" + asked, "expected a scene smaller than"},
      {render + "nan.bpt -o t.png", "patchrt-render: nan.bpt:3: patch 0: expected a finite number"},
      {accuracy_program + "nan.bpt", "patchrt-accuracy: nan.bpt:3: patch 0: expected a finite number"},
      // the rays
      {query + "$teapot --rays none --hits hits", "none: expected a file, got nothing of that name"},
      {query + "$teapot --rays ragged --hits hits", "ragged: expected rays of 64 bytes each, got 100 bytes"},
      {query + "$teapot --rays . --hits hits", ".: expected a file, got a directory"},
      // outputs
      {query + "$teapot --rays rays --hits no/hits", "no/hits: cannot be written: No such file or directory"},
      {query + "$teapot --rays rays --hits .", ".: cannot be written: Is a directory"},
      {query + "$teapot --rays rays --hits full", "full: cannot be written: No space left on device"},
      {query + "$teapot" + asked + " >/dev/full", "the standard output cannot be written"},
      {render + "$teapot -o no/t.png", "no/t.png: cannot be written: No such file or directory"},
      {render + "$teapot -o t.png --stats no/t.json", "no/t.json: cannot be written: No such file or directory"},
      {render + "$teapot --size 8x8 -o full", "full: cannot be written: No space left on device"},
      // values of options
      {query + "$teapot" + asked + " --threads 0", "--threads: expected a number of threads from 1 to 1024, got '0'"},
      {query + "$teapot" + asked + " --threads -1", "--threads: expected a number of threads from 1 to 1024, got '-1'"},
      {query + "$teapot" + asked + " --threads two", "got 'two'"},
      {query + "$teapot" + asked + " --repeat 0", "--repeat: expected a number of runs from 1 to 1000000, got '0'"},
      {query + "$teapot" + asked + " --repeat 1e9", "got '1e9'"},
      {query + "$teapot" + asked + " --accuracy best", "--accuracy: best not in {fast,refined,certified,reference}"},
      {render + "$teapot -o t.png --size 0x0",
       "--size: expected WIDTHxHEIGHT, 1 to 65536 a side and 2^28 pixels at most, got '0x0'"},
      {render + "$teapot -o t.png --size 65537x1", "got '65537x1'"},
      {render + "$teapot -o t.png --size 65536x65536", "got '65536x65536'"},
      {render + "$teapot -o t.png --size -4x4", "got '-4x4'"},
      {render + "$teapot -o t.png --size nanxnan", "got 'nanxnan'"},
      {render + "$teapot -o t.png --size 100", "got '100'"},
      {render + "$teapot -o t.png --size 4x4x4", "got '4x4x4'"},
      {render + "$teapot -o t.png --vfov nan", "--vfov: expected degrees above 0 and below 180, got 'nan'"},
      {render + "$teapot -o t.png --vfov 180", "got '180'"},
      {render + "$teapot -o t.png --vfov 0", "got '0'"},
      {render + "$teapot -o t.png --eye 1,2", "--eye: expected three numbers X,Y,Z, got '1,2'"},
      {render + "$teapot -o t.png --eye 1,2,3,4", "got '1,2,3,4'"},
      {render + "$teapot -o t.png --eye 1,2,inf", "got '1,2,inf'"},
      {render + "$teapot -o t.png --eye 1,,3", "got '1,,3'"},
      {render + "$teapot -o t.png --look-at 1,2,3", "--look-at requires --eye"},
      {render + "$teapot -o t.png --eye 1,2,3 --look-at 1,2,3", "camera: the eye is at the point looked at"},
      {render + "$teapot -o t.png --up 0,0,0", "camera: the up direction has no length"},
      {render + "$teapot -o t.png --eye 0,0,9 --look-at 0,0,0", "camera: the up direction is along the view"},
      {render + "$teapot -o t.png --flip-normals", "--flip-normals requires --cull-back-faces"},
      {render + "$teapot -o t.png --aov colour", "--aov: colour not in {shaded,depth,normal,uv,patch}"},
      {accuracy_program + "$teapot --size 5000", "--size: expected a number of pixels from 1 to 4096, got '5000'"},
      // the command line itself
      {query, "MODEL is required"},
      {query + "$teapot --rays rays", "--hits is required"},
      {render + "$teapot", "--output is required"},
      {render + "$teapot -o t.png --speed", "--speed"},
      {render + "$teapot $teapot -o t.png", "not expected"},
  };
  for (auto const& r : rows) {
    auto const got = run(folder, r.command);
    CAPTURE(r.command, got.out, got.err);
    CHECK(got.status == 1);
    CHECK(got.err.find(r.message) != got.err.npos);
    CHECK(got.err.starts_with("patchrt-"));
    CHECK(std::count(got.err.begin(), got.err.end(), '\n') == 1);
    CHECK(got.err.ends_with('\n'));
    CHECK(!exists(folder / "t.png"));
    if (r.command.find("/dev/full") == r.command.npos) CHECK(!exists(folder / "hits"));
    std::filesystem::remove(folder / "hits");
  }
}

TEST_CASE("help is printed on the standard output with status 0") {
  test::temporary_folder const folder;
  for (auto const& program : {render, query, accuracy_program}) {
    auto const got = run(folder, program + "--help");
    CAPTURE(program, got.err);
    CHECK(got.status == 0);
    CHECK(got.out.find("--threads") != got.out.npos);
    CHECK(got.err.empty());
  }
}

TEST_CASE("a query answers every ray with a point of a patch, the JSON says how") {
  test::temporary_folder const folder;
  auto const seed = std::random_device()();
  CAPTURE(seed);
  auto const rays = random_rays(5000, seed);
  write_rays(folder / "rays", rays);
  auto const patches = load_bpt(test::project_data("teapot.bpt"));
  for (std::string const level : {"fast", "refined", "certified", "reference"}) {
    auto const got = run(folder, query + "$teapot --rays rays --hits hits --repeat 3 --json --accuracy " + level);
    CAPTURE(level, got.err);
    REQUIRE(got.status == 0);
    REQUIRE(got.err.empty());
    auto const hits = read_hits(folder / "hits");
    REQUIRE(hits.size() == rays.size());
    std::size_t found = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      auto const& h = hits[i];
      CAPTURE(i);
      if (h.patch == -1) {
        REQUIRE(h == hit_record{});
        continue;
      }
      ++found;
      REQUIRE((0 <= h.patch && h.patch < 32 && 0 <= h.u && h.u <= 1 && 0 <= h.v && h.v <= 1 && 0 < h.t));
      auto const& r = rays[i];
      vec3<double> const apart =
          evaluate(patches[std::size_t(h.patch)], h.u, h.v).position - (r.origin + h.t * r.direction);
      REQUIRE(std::sqrt(dot(apart, apart)) < 1e-4);
    }
    CHECK(found > rays.size() / 4);
    CHECK(found < rays.size());

    auto const json = nlohmann::json::parse(got.out);
    CHECK(json.size() == 9);
    CHECK(json.at("rays") == rays.size());
    CHECK(json.at("hits") == found);
    for (auto const* key : {"seconds", "mrays_per_s", "build_seconds", "hierarchy_bytes", "patch_bytes",
                            "candidates_per_ray", "newton_steps_per_ray"}) {
      CAPTURE(key);
      CHECK(json.at(key).get<double>() > 0);
    }
    CHECK(json.at("mrays_per_s").get<double>() ==
          Approx(double(rays.size()) * 1e-6 / json.at("seconds").get<double>()));
  }
}

TEST_CASE("without --json the same figures come as lines of key and value") {
  test::temporary_folder const folder;
  write_rays(folder / "rays", random_rays(100, 1));
  auto const got = run(folder, query + "$teapot --rays rays --hits hits");
  REQUIRE(got.status == 0);
  CHECK(got.out.starts_with("rays 100\nhits "));
  CHECK(std::count(got.out.begin(), got.out.end(), '\n') == 9);
}

TEST_CASE("hits do not depend on the number of threads") {
  test::temporary_folder const folder;
  auto const seed = std::random_device()();
  CAPTURE(seed);
  write_rays(folder / "rays", random_rays(20000, seed));
  for (std::string const level : {"fast", "refined", "certified", "reference"}) {
    CAPTURE(level);
    REQUIRE(run(folder, query + "$teapot --rays rays --hits one --threads 1 --accuracy " + level).status == 0);
    REQUIRE(run(folder, query + "$teapot --rays rays --hits two --threads 2 --accuracy " + level).status == 0);
    CHECK(contents(folder / "one") == contents(folder / "two"));
  }
}

TEST_CASE("any hit is found for just the rays that have a nearest one") {
  test::temporary_folder const folder;
  auto const seed = std::random_device()();
  CAPTURE(seed);
  write_rays(folder / "rays", random_rays(5000, seed));
  REQUIRE(run(folder, query + "$teapot --rays rays --hits nearest").status == 0);
  REQUIRE(run(folder, query + "$teapot --rays rays --hits any --any").status == 0);
  auto const nearest = read_hits(folder / "nearest"), any = read_hits(folder / "any");
  REQUIRE(any.size() == nearest.size());
  int later = 0;
  for (std::size_t i = 0; i < any.size(); ++i) {
    CAPTURE(i);
    REQUIRE((any[i].patch == -1) == (nearest[i].patch == -1));
    if (any[i].patch >= 0) REQUIRE(any[i].t >= nearest[i].t);
    later += any[i].t > nearest[i].t;
  }
  CHECK(later > 0);  // or the search for the nearest was not cut short
}

TEST_CASE("rays that are none are misses beside rays that hit") {
  test::temporary_folder const folder;
  ray<double> const down{{0.3, 0.2, 9}, {0, 0, -2}, 0, inf};  // onto the lid
  std::vector<ray<double>> rays = {down};
  auto const with = [&](auto change) {
    ray<double> r = down;
    change(r);
    rays.push_back(r);
    rays.push_back(down);
  };
  with([](auto& r) { r.direction = {0, 0, 0}; });
  with([](auto& r) { r.direction = {0, 0, -inf}; });
  with([](auto& r) { r.direction = {not_a_number, 0, -1}; });
  with([](auto& r) { r.origin.x = not_a_number; });
  with([](auto& r) { r.origin.y = inf; });
  with([](auto& r) { r.t_min = not_a_number; });
  with([](auto& r) { r.t_max = not_a_number; });
  with([](auto& r) { r.t_min = 5, r.t_max = 1; });
  with([](auto& r) { r.t_min = inf; });
  with([](auto& r) { r.t_max = -inf; });
  with([](auto& r) {
    vec3<double> const nowhere(not_a_number);
    r = {nowhere, nowhere, not_a_number, not_a_number};
  });
  write_rays(folder / "rays", rays);
  for (std::string const level : {"fast", "refined", "certified", "reference"})
    for (std::string const any : {"", " --any"}) {
      CAPTURE(level, any);
      REQUIRE(run(folder, query + "$teapot --rays rays --hits hits --accuracy " + level + any).status == 0);
      auto const hits = read_hits(folder / "hits");
      REQUIRE(hits.size() == rays.size());
      CHECK(hits[0].t == Approx(3.2).margin(any.empty() ? 0.3 : 2));
      for (std::size_t i = 0; i < hits.size(); ++i) {
        CAPTURE(i);
        if (i % 2 == 0) CHECK(hits[i] == hits[0]);
        else CHECK(hits[i] == hit_record{});
      }
    }
}

TEST_CASE("no rays are answered by no hits") {
  test::temporary_folder const folder;
  write_rays(folder / "rays", {});
  auto const got = run(folder, query + "$teapot --rays rays --hits hits --json");
  REQUIRE(got.status == 0);
  CHECK(exists(folder / "hits"));
  CHECK(std::filesystem::file_size(folder / "hits") == 0);
  CHECK(nlohmann::json::parse(got.out).at("hits") == 0);
}

TEST_CASE("a model collapsed to a point or a line is traced and drawn") {
  test::temporary_folder const folder;
  std::ofstream file(folder / "collapsed.bpt");
  file << "2\n3 3\n";
  for (int k = 0; k < 16; ++k) file << "1 2 3\n";
  file << "3 3\n";
  for (int k = 0; k < 16; ++k) file << k / 4 << " 0 0\n";
  file.close();
  std::ofstream(folder / "point.bpt") << "1 3 3" + [] {
    std::string points;
    for (int k = 0; k < 48; ++k) points += " 7";
    return points;
  }();
  write_rays(folder / "rays", random_rays(1000, 1));
  for (std::string const model : {"collapsed.bpt", "point.bpt"}) {
    CAPTURE(model);
    CHECK(run(folder, query + model + " --rays rays --hits hits").status == 0);
    CHECK(run(folder, render + model + " --quiet --size 64x64 -o t.png").status == 0);
    CHECK(size_of_png(folder / "t.png") == png_size{64, 64});
  }
}

TEST_CASE("render writes a picture of the size that is asked for, of everything it can show") {
  test::temporary_folder const folder;
  for (std::string const aov : {"shaded", "depth", "normal", "uv", "patch"}) {
    auto const got = run(folder, render + "$teapot --size 60x41 --aov " + aov + " -o " + aov + ".png");
    CAPTURE(aov, got.err);
    CHECK(got.status == 0);
    CHECK(got.err.empty());  // no progress bar where there is no terminal
    CHECK(size_of_png(folder / (aov + ".png")) == png_size{60, 41});
  }
  CHECK(contents(folder / "shaded.png") != contents(folder / "depth.png"));
}

TEST_CASE("quiet rendering prints nothing and draws the same with one thread and two") {
  test::temporary_folder const folder;
  for (std::string const threads : {"1", "2"}) {
    auto const got =
        run(folder, render + "$teapot --quiet --size 64x64 --threads " + threads + " -o " + threads + ".png");
    CHECK(got.status == 0);
    CHECK(got.out.empty());
    CHECK(got.err.empty());
  }
  CHECK(contents(folder / "1.png") == contents(folder / "2.png"));
}

TEST_CASE("the framed teapot covers a good part of the picture, and none where the camera looks away") {
  test::temporary_folder const folder;
  auto const hits = [&](std::string const& camera) {
    REQUIRE(run(folder, render + "$teapot --size 100x100 -o t.png --stats t.json " + camera).status == 0);
    auto const json = nlohmann::json::parse(contents(folder / "t.json"));
    CHECK(json.at("rays") == 10000);
    CHECK(json.at("candidates_per_ray").get<double>() >= 0);
    return json.at("hits").get<int>();
  };
  int const framed = hits("");
  CHECK((2000 < framed && framed < 6000));
  int const side = hits("--eye -1.5,-20,1.5 --look-at 0.2,0,1.5 --vfov 20");
  CHECK((2000 < side && side < 6000));
  CHECK(hits("--eye 0,-20,1.5 --look-at 0,-40,1.5") == 0);
  CHECK(hits("--eye 0,0,1 --look-at 3,0,1") == 10000);  // from within
}

TEST_CASE("culling back faces leaves the picture of the teapot's outside as it is, for less work") {
  test::temporary_folder const folder;
  auto const work = [&](std::string const& name, std::string const& options) {
    std::string const camera = " --eye 2,-20,-2 --look-at 0.2,0,1.5 --vfov 20";  // not through the gap below the lid
    auto const got = run(folder, render + "$teapot --size 120x120 --stats t.json -o " + name + camera + options);
    REQUIRE(got.status == 0);
    CHECK((got.out.find("sub-patches culled") != got.out.npos) == !options.empty());
    return nlohmann::json::parse(contents(folder / "t.json")).at("candidates_per_ray").get<double>();
  };
  double const all = work("all.png", "");
  double const outside = work("outside.png", " --cull-back-faces --flip-normals");
  work("inside.png", " --cull-back-faces");  // the teapot's normals point inward
  CHECK((contents(folder / "outside.png") == contents(folder / "all.png")));
  CHECK((contents(folder / "inside.png") != contents(folder / "all.png")));
  CHECK((0 < outside && outside < all));
}

TEST_CASE("the accuracy table has a row a level, errors falling from fast to refined") {
  test::temporary_folder const folder;
  auto const got = run(folder, accuracy_program + "$teapot --size 64");
  REQUIRE(got.status == 0);
  std::istringstream lines(got.out);
  std::string line;
  std::getline(lines, line);
  std::getline(lines, line);
  std::vector<double> rms;
  for (std::string const level : {"fast", "refined", "certified", "reference"}) {
    std::string name;
    double rate, hits, error;
    REQUIRE((lines >> name >> rate >> hits >> error));
    std::getline(lines, line);
    CHECK(name == level);
    CHECK(hits > 500);
    rms.push_back(error);
  }
  CHECK(rms[0] < 1e-5);
  CHECK(rms[1] < rms[0]);
}
