// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <support/gallery.hpp>
#include <support/model.hpp>
#include <support/procedural_meshes.hpp>

#include <algorithm>
#include <cmath>
#include <set>

using namespace patchrt;
using namespace patchrt::examples;

namespace {

gallery shapes_of(std::string const& name, int depth = 2) {
  return make_gallery(name, depth, load_bpt(std::string(PATCHRT_PROJECT_DATA) + "/teapot.bpt"),
                      sphere_mesh(3, {2.9, 2.6, 0.8}, 0.8));
}

}  // namespace

TEST_CASE("a sphereflake of depth 4 has 7381 spheres") { REQUIRE(shapes_of("sphereflake", 4).spheres.size() == 7381); }

TEST_CASE("the table carries shapes of every kind") {
  gallery const g = shapes_of("table");
  REQUIRE(!g.triangles.empty());
  REQUIRE(!g.spheres.empty());
  REQUIRE(!g.quadrics.empty());
  REQUIRE(!g.tori.empty());
  REQUIRE(!g.patches.empty());
}

TEST_CASE("rays leave every surface of a gallery on the side that they came from, and do not meet it there again") {
  auto const name = GENERATE(std::string("sphereflake"), std::string("quadrics"), std::string("table"));
  CAPTURE(name);
  gallery const g = shapes_of(name);
  gallery_view const view(g, 1);
  image_size const size{96, 72};
  camera const eye = look_at(g.eye, g.target, {0, 0, 1}, g.vfov, size);
  std::vector<ray<double>> rays;
  for (std::size_t i = 0; i < size.pixels(); ++i) rays.push_back(primary_ray(eye, size, i));
  std::vector<scene_hit<double>> const hits = view.trace(rays);
  std::vector<ray<double>> back;
  std::set<int> seen;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    seen.insert(hits[i].shape);
    auto const [start, normal] = view.surface_at(rays[i], hits[i]);
    REQUIRE(std::abs(dot(normal, normal) - 1) < 1e-12);
    REQUIRE(dot(normal, rays[i].direction) <= 0);
    vec3<double> const hit = rays[i].origin + hits[i].t * rays[i].direction;
    REQUIRE(dot(start - hit, start - hit) < 1e-12);
    back.push_back({start, rays[i].origin - start, 0, 1});
  }
  // What the eye sees sees the eye.
  std::vector<scene_hit<double>> const between = view.trace(back);
  REQUIRE(std::none_of(between.begin(), between.end(), [](auto const& h) { return h.valid(); }));
  REQUIRE(seen.size() > 8);
}

TEST_CASE("a gallery of no known name is refused") {
  REQUIRE_THROWS_AS(make_gallery("moon", 1, {}, {}), std::invalid_argument);
}
