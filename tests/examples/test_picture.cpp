// SPDX-License-Identifier: MIT
#include <support/camera.hpp>
#include <support/catch.hpp>
#include <support/data.hpp>
#include <support/image.hpp>
#include <support/model.hpp>
#include <support/polish.hpp>

#include <patchrt/shapes/bezier_patch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

using namespace patchrt;
using namespace patchrt::examples;

namespace {

struct image_position {
  double x, y, depth;
};

/// Where a point is seen.
image_position project(camera const& c, vec3<double> const& p) {
  vec3<double> const d = p - c.eye;
  double const depth = dot(d, c.forward);
  return {dot(d, c.right) / dot(c.right, c.right) / depth, dot(d, c.up) / dot(c.up, c.up) / depth, depth};
}

vec3<double> const z_up{0, 0, 1}, y_up{0, 1, 0}, oblique{1, -2, 0.5};

}  // namespace

TEST_CASE("tiled order visits every pixel once, 16 of a whole tile in turn") {
  for (auto const size : {image_size{1, 1}, image_size{4, 4}, image_size{5, 3}, image_size{16, 8}, image_size{7, 9},
                          image_size{1, 13}, image_size{13, 1}}) {
    CAPTURE(size.width, size.height);
    std::vector<int> visits(size.pixels(), 0);
    for (std::size_t i = 0; i < size.pixels(); ++i) {
      pixel const p = tiled_pixel(size, i);
      REQUIRE((0 <= p.x && p.x < size.width && 0 <= p.y && p.y < size.height));
      ++visits[std::size_t(p.y * size.width + p.x)];
    }
    REQUIRE(std::all_of(visits.begin(), visits.end(), [](int n) { return n == 1; }));
  }
  image_size const whole{16, 8};
  for (std::size_t i = 0; i < whole.pixels(); ++i) {
    pixel const first = tiled_pixel(whole, i / 16 * 16), p = tiled_pixel(whole, i);
    REQUIRE((p.x / 4 == first.x / 4 && p.y / 4 == first.y / 4));
  }
}

TEST_CASE("a framed model is all in the picture and touches its border within a tenth") {
  for (auto const& patches :
       {load_bpt(test::project_data("teapot.bpt")), parse_bpt(
                                                        "1 3 3" +
                                                            [] {
                                                              std::string line;
                                                              for (int k = 0; k < 16; ++k)
                                                                line += " 1e6 " + std::to_string(k) + " -3e5";
                                                              return line;
                                                            }(),
                                                        "line.bpt")})
    for (auto const& up : {z_up, y_up, oblique})
      for (double const vfov : {1.0, 35.0, 120.0})
        for (auto const size : {image_size{1024, 1024}, image_size{300, 1000}, image_size{1600, 200}}) {
          CAPTURE(vfov, size.width, size.height, up.x);
          camera const c = frame(patches, up, vfov, size);
          double widest = 0;
          for (auto const& patch : patches)
            for (auto const& p : patch.control_points) {
              auto const at = project(c, p);
              REQUIRE(at.depth > 0);
              widest = std::max({widest, std::abs(at.x), std::abs(at.y)});
            }
          CHECK(widest <= 1);
          if (patches.size() > 1 && vfov <= 35) CHECK(widest > 0.9);
        }
}

TEST_CASE("a model that is one point is framed at a distance") {
  for (double const at : {0.0, 5.0}) {
    bicubic_patch<double> patch;
    for (auto& p : patch.control_points) p = {at, at, at};
    camera const c = frame({&patch, 1}, z_up, 35, {100, 100});
    auto const seen = project(c, {at, at, at});
    CHECK(seen.depth > 0);
    CHECK(std::abs(seen.x) < 1e-9);
  }
}

TEST_CASE("the camera sees its target in the middle, up above and right-handed axes to the right") {
  camera const c = look_at({0, -10, 0}, {0, 0, 0}, z_up, 90, {200, 100});
  CHECK(project(c, {0, 0, 0}).x == Approx(0).margin(1e-15));
  CHECK(project(c, {0, 0, 5}).y == Approx(0.5));
  CHECK(project(c, {5, 0, 0}).x == Approx(0.25));
}

TEST_CASE("rays through pixel middles meet the points that are seen there") {
  image_size const size{6, 10};
  camera const c = look_at({1, 2, 3}, {-4, 5, 1}, oblique, 50, size);
  for (std::size_t i = 0; i < size.pixels(); ++i) {
    auto const r = primary_ray(c, size, i);
    pixel const p = tiled_pixel(size, i);
    auto const at = project(c, r.origin + 3.0 * r.direction);
    CHECK(at.depth == Approx(3));
    CHECK((at.x + 1) / 2 * size.width == Approx(p.x + 0.5));
    CHECK((1 - at.y) / 2 * size.height == Approx(p.y + 0.5));
    CHECK(r.t_min == 0);
    CHECK(r.t_max == std::numeric_limits<double>::infinity());
  }
}

TEST_CASE("directions that leave no camera are refused") {
  image_size const size{10, 10};
  CHECK_THROWS_WITH(look_at({1, 1, 1}, {1, 1, 1}, z_up, 35, size),
                    test::contains_text("the eye is at the point looked at"));
  CHECK_THROWS_WITH(look_at({0, 0, 9}, {0, 0, 0}, z_up, 35, size),
                    test::contains_text("the up direction is along the view"));
  CHECK_THROWS_WITH(look_at({0, 0, 9}, {1e-11, 0, 0}, z_up, 35, size),
                    test::contains_text("the up direction is along the view"));
  CHECK_THROWS_WITH(look_at({0, 9, 9}, {0, 0, 0}, {0, 0, 0}, 35, size),
                    test::contains_text("the up direction has no length"));
}

TEST_CASE("polishing a hit that was moved brings it back to the root") {
  auto const patches = load_bpt(test::project_data("teapot.bpt"));
  auto const seed = std::random_device()();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> inside(0.1, 0.9), any(-1, 1);
  int confirmed = 0, tried = 0;
  for (int n = 0; n < 2000; ++n) {
    auto const& patch = patches[random() % patches.size()];
    double const u = inside(random), v = inside(random);
    auto const s = evaluate(patch, u, v);
    vec3<double> const origin{8 * any(random), 8 * any(random), 8 * any(random)};
    vec3<double> const direction = (s.position - origin) * 0.25;  // the root is at t = 4, up to rounding
    vec3<double> const across = cross(s.du, s.dv);
    double const cosine = dot(direction, across) / std::sqrt(dot(direction, direction) * dot(across, across));
    if (std::abs(cosine) < 0.2) continue;
    ++tried;
    auto const root = polish(patch, {origin, direction, 0, 100}, 4 + 1e-6 * any(random), u + 1e-6 * any(random), v);
    confirmed += root.confirmed;
    CHECK(double(root.t) == Approx(4).epsilon(1e-14));
    CHECK(double(root.moved) < 1e-4);
  }
  CHECK(tried > 500);
  CHECK(confirmed == tried);
}

TEST_CASE("no root is confirmed where a ray passes a patch by") {
  auto const patches = load_bpt(test::project_data("teapot.bpt"));
  for (auto const& patch : patches) CHECK(!polish(patch, {{0, 0, 50}, {0, 1, 0}, 0, 100}, 1, 0.5, 0.5).confirmed);
}

TEST_CASE("polishing stays at a collapsed edge, where one parameter moves nothing but rounding errors") {
  vec3<double> const shift{0.1, 0.2, 0.3};
  int collapsed = 0;
  for (auto patch : load_bpt(test::project_data("teapot.bpt"))) {
    for (auto& p : patch.control_points) p += shift;
    for (int const i : {0, 3}) {
      bool one_point = true;
      for (int j = 1; j < 4; ++j) one_point = one_point && patch(i, j) == patch(i, 0);
      if (!one_point) continue;
      ++collapsed;
      vec3<double> const origin = patch(i, 0) + vec3<double>{0.0, 0.0, 2.0};
      for (double const v : {0.1, 0.3, 0.5, 0.7}) {
        auto const root = polish(patch, {origin, {0, 0, -1}, 0, 10}, 2 + 1e-9, i == 0 ? 1e-18 : 1, v);
        CAPTURE(i, v);
        CHECK(root.confirmed);
        CHECK(double(root.t) == Approx(2).epsilon(1e-15));
      }
    }
  }
  CHECK(collapsed > 0);
}
