// SPDX-License-Identifier: MIT
#include <examples/temporary_folder.hpp>
#include <support/catch.hpp>
#include <support/file.hpp>
#include <support/ray_file.hpp>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::examples;

namespace {

std::string contents(std::filesystem::path const& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace

TEST_CASE("rays are read in the order ox oy oz dx dy dz t_min t_max, whatever their values") {
  test::temporary_folder const folder;
  double const nan = std::numeric_limits<double>::quiet_NaN();
  double const inf = std::numeric_limits<double>::infinity();
  std::vector<double> const numbers = {1, 2, 3, 4, 5, 6, 7, 8, nan, inf, 0, 0, 0, 0, 9, -9};
  std::ofstream(folder / "rays", std::ios::binary).write(reinterpret_cast<char const*>(numbers.data()), 128);
  auto const rays = read_rays(folder / "rays");
  REQUIRE(rays.size() == 2);
  CHECK(rays[0].origin == vec3<double>{1.0, 2.0, 3.0});
  CHECK(rays[0].direction == vec3<double>{4.0, 5.0, 6.0});
  CHECK(rays[0].t_min == 7);
  CHECK(rays[0].t_max == 8);
  CHECK(rays[1].origin.x != rays[1].origin.x);
  CHECK(rays[1].t_max == -9);
}

TEST_CASE("a file of rays is empty or a multiple of 64 bytes") {
  test::temporary_folder const folder;
  for (int size : {0, 64, 6400}) {
    std::ofstream(folder / "rays") << std::string(std::size_t(size), '\0');
    REQUIRE(read_rays(folder / "rays").size() == std::size_t(size) / 64);
  }
  for (int size : {1, 8, 63, 65, 72, 100}) {
    CAPTURE(size);
    std::ofstream(folder / "rays") << std::string(std::size_t(size), '\0');
    REQUIRE_THROWS_WITH(read_rays(folder / "rays"), test::contains_text("rays: expected rays of 64 bytes each, got " +
                                                                        std::to_string(size) + " bytes"));
  }
}

TEST_CASE("a hit is 32 bytes of t, u, v and patch") {
  test::temporary_folder const folder;
  output_file file(folder / "hits");
  std::vector<hit_record> const hits = {{1.5, 0.25, 0.75, 7}, {}};
  write_hits(file, hits);
  std::string const bytes = contents(folder / "hits");
  REQUIRE(bytes.size() == 64);
  double numbers[3];
  std::int64_t patch;
  std::memcpy(numbers, bytes.data(), 24);
  std::memcpy(&patch, bytes.data() + 24, 8);
  CHECK(std::vector<double>(numbers, numbers + 3) == std::vector<double>{1.5, 0.25, 0.75});
  CHECK(patch == 7);
  std::memcpy(numbers, bytes.data() + 32, 24);
  std::memcpy(&patch, bytes.data() + 56, 8);
  CHECK(std::vector<double>(numbers, numbers + 3) ==
        std::vector<double>{std::numeric_limits<double>::infinity(), 0, 0});
  CHECK(patch == -1);
}

TEST_CASE("an output file that is not written leaves things as they were") {
  test::temporary_folder const folder;
  { output_file const file(folder / "new"); }
  CHECK(!exists(folder / "new"));
  std::ofstream(folder / "old") << "old";
  { output_file const file(folder / "old"); }
  CHECK(contents(folder / "old") == "old");
}

TEST_CASE("writing replaces all that was in the file") {
  test::temporary_folder const folder;
  std::ofstream(folder / "old") << "longer than the new";
  output_file file(folder / "old");
  file.write("short");
  CHECK(contents(folder / "old") == "short");
}

TEST_CASE("an output file that cannot be written is refused before any work, a full disk after it") {
  test::temporary_folder const folder;
  REQUIRE_THROWS_WITH(output_file(folder / "no/folder"),
                      test::contains_text("cannot be written: No such file or directory"));
  REQUIRE_THROWS_WITH(output_file(folder / ""), test::contains_text("cannot be written: Is a directory"));
  if (!std::filesystem::exists("/dev/full")) PATCHRT_SKIP("no /dev/full here");
  std::filesystem::create_symlink("/dev/full", folder / "full");  // broken code may remove the link, not the device
  output_file full(folder / "full");
  REQUIRE_THROWS_WITH(full.write("bytes"), test::contains_text("full: cannot be written: No space left on device"));
}
