// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/accel/build_scene.hpp>
#include <patchrt/accel/instance.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/accel/scene_triangle.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>
#include <patchrt/trace/scene_hits.hpp>

#include <cmath>
#include <limits>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using teapot_object = patch_object<bicubic_patch<double>>;

mixed_hierarchy hierarchy_of(patch_list const& patches) {
  return build_mixed_hierarchy(std::span<bicubic_patch<double> const>(patches), {}, serial{});
}

/// Places of copies in a row and turned, nearly as far apart as they are large.
std::vector<affine<double>> places(int count, double step) {
  std::vector<affine<double>> all;
  for (int i = 0; i < count; ++i) {
    affine<double> to = affine<double>::rotation({1, 2, 0.5 * i}, 0.7 * i);
    to.translation = {step * (i % 4 - 1.5), step * (i / 4 % 3 - 1.0), step * (i / 12 - 0.5)};
    all.push_back(to);
  }
  return all;
}

ray_list rays_through(double reach, int count, unsigned seed) {
  std::mt19937_64 random(seed);
  ray_list rays;
  for (int i = 0; i < count; ++i) {
    auto const point = [&](double size) {
      double const x = uniform(random, -size, size), y = uniform(random, -size, size);
      return vec3<double>(x, y, uniform(random, -size, size));
    };
    vec3<double> const o = point(2 * reach);
    rays.push_back({o, point(reach) - o, 0, i % 4 == 0 ? 1.0 : no_limit});
  }
  return rays;
}

template <class Scene> std::vector<scene_hit<double>> closest(Scene const& s, ray_list const& rays) {
  std::vector<scene_hit<double>> hits(rays.size());
  trace::closest_hits(s.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  return hits;
}

}  // namespace

TEST_CASE("24 teapots in one scene give the nearest hit of any of them") {
  auto const teapot = hierarchy_of(load_model("teapot"));
  std::vector<affine<double>> const at = places(24, 7);
  std::vector<instance<teapot_object>> copies;
  for (auto const& to : at) copies.push_back(place(teapot.view(), to));
  auto const scene = build_scene(copies);
  // One more copy costs its matrices and its place in the tree, not a teapot.
  REQUIRE(double(scene.bytes()) / 24 < 1024);

  unsigned const seed = 31;
  CAPTURE(seed);
  ray_list const rays = rays_through(14, 1500, seed);
  auto const hits = closest(scene, rays);
  std::vector<scene_hit<double>> want(rays.size());
  for (std::size_t k = 0; k < at.size(); ++k) {
    ray_list inside;
    for (auto const& r : rays) inside.push_back(transform(inverse(at[k]), r));
    std::vector<patch_hit> found(rays.size());
    trace::closest_hits(teapot.view(), std::span<ray<double> const>(inside), std::span(found), serial{});
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (found[i].valid() && found[i].t < want[i].t)
        want[i] = {found[i].t, found[i].u, found[i].v, std::int32_t(k), found[i].patch};
  }
  int met = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    INFO("ray " << i);
    REQUIRE(hits[i].shape == want[i].shape);
    REQUIRE(hits[i].part == want[i].part);
    REQUIRE(hits[i].t == want[i].t);
    REQUIRE(hits[i].u == want[i].u);
    REQUIRE(hits[i].v == want[i].v);
    met += hits[i].valid();
  }
  REQUIRE(met > 300);

  std::vector<std::uint8_t> some(rays.size());
  trace::any_hits(scene.view(), std::span<ray<double> const>(rays), std::span(some), serial{});
  for (std::size_t i = 0; i < rays.size(); ++i) REQUIRE((some[i] != 0) == hits[i].valid());
}

TEST_CASE("a placed scene is met where its shapes are placed, and says which of them") {
  std::mt19937_64 random(5);
  std::vector<scene_triangle<double>> triangles;
  std::vector<sphere<double>> spheres;
  for (int i = 0; i < 60; ++i) {
    auto const point = [&] {
      double const x = uniform(random, -1, 1), y = uniform(random, -1, 1);
      return vec3<double>(x, y, uniform(random, -1, 1));
    };
    vec3<double> const p = point();
    triangles.push_back({{p, p + point() * 0.4, p + point() * 0.4}});
    spheres.push_back({point(), 0.1});
  }
  auto const object = build_scene(triangles, spheres);
  auto const to = GENERATE(affine<double>::shift({8, -4, 2}),
                           affine<double>::rotation({1, 1, 0}, 1.0) * affine<double>::scaling({2, 0.5, -1}));
  std::vector<instance<scene_view<scene_triangle<double>, sphere<double>>>> const one{place(object.view(), to)};
  std::vector<sphere<double>> const beside{{{100, 0, 0}, 1}};
  auto const scene = build_scene(beside, one);

  ray_list inside = rays_through(1, 2000, 6), outside;
  for (auto const& r : inside) outside.push_back(transform(to, r));
  auto const want = closest(object, inside), hits = closest(scene, outside);
  int met = 0, same = 0;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    met += want[i].valid();
    same += hits[i].valid() == want[i].valid() && hits[i].part == want[i].shape;
    if (!hits[i].valid() || hits[i].part != want[i].shape) continue;
    INFO("ray " << i);
    REQUIRE(hits[i].shape == 1);  // behind the sphere
    // A rounding of the ray moves a hit that grazes by more than one that does not.
    REQUIRE(std::abs(hits[i].t - want[i].t) < 1e-9);
  }
  REQUIRE(met > 800);
  REQUIRE(same >= 1998);
}

TEST_CASE("rays in float meet instances as the same rays in double do") {
  auto const teapot = hierarchy_of(load_model("teapot"));
  std::vector<instance<teapot_object>> copies;
  for (auto const& to : places(5, 7)) copies.push_back(place(teapot.view(), to));
  auto const scene = build_scene(copies);
  std::vector<ray<float>> narrow;
  ray_list wide;
  for (auto const& r : rays_through(14, 800, 7)) {
    narrow.push_back({vec3<float>(r.origin), vec3<float>(r.direction), float(r.t_min), float(r.t_max)});
    auto const& n = narrow.back();
    wide.push_back({vec3<double>(n.origin), vec3<double>(n.direction), n.t_min, n.t_max});
  }
  std::vector<scene_hit<float>> hits(narrow.size());
  trace::closest_hits(scene.view(), std::span<ray<float> const>(narrow), std::span(hits), serial{});
  auto const want = closest(scene, wide);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    INFO("ray " << i);
    REQUIRE(hits[i].shape == want[i].shape);
    REQUIRE(hits[i].part == want[i].part);
    REQUIRE(hits[i].t == float(want[i].t));
  }
}

TEST_CASE("maps that cannot be undone are refused, and objects without shapes are met by no ray") {
  auto const empty = build_scene(std::vector<sphere<double>>{});
  REQUIRE_THROWS_AS(place(empty.view(), affine<double>::scaling({1, 0, 1})), std::invalid_argument);
  std::vector<instance<scene_view<sphere<double>>>> const nothing{place(empty.view(), affine<double>::identity())};
  auto const scene = build_scene(nothing);
  REQUIRE(!closest(scene, {{{0, 0, 3}, {0, 0, -1}, 0, no_limit}})[0].valid());
}
