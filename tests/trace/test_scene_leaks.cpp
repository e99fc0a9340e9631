// SPDX-License-Identifier: MIT
// Rays through the hierarchy of a scene of watertight triangles: no ray may slip between triangles, nor past a box.
#include "support/catch.hpp"

#include <patchrt/accel/build_scene.hpp>
#include <patchrt/accel/scene_triangle.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/scene_hits.hpp>

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>
#include <string>

using namespace patchrt;

namespace {

struct indexed {
  std::vector<vec3<float>> vertices;
  std::vector<std::array<std::size_t, 3>> triangles;

  std::vector<scene_triangle<float>> shapes() const {
    std::vector<scene_triangle<float>> all;
    for (auto const& t : triangles) all.push_back({{vertices[t[0]], vertices[t[1]], vertices[t[2]]}});
    return all;
  }
};

/// A sphere of 2 n (n - 1) quads in rings, closed at the poles; vertices rounded once.
indexed ball(vec3<double> const& centre, double radius, std::size_t n) {
  indexed m;
  auto const add = [&](double a, double b) {
    vec3<double> const d(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
    m.vertices.emplace_back(centre + radius * d);
  };
  for (std::size_t j = 1; j < n; ++j)
    for (std::size_t i = 0; i < 2 * n; ++i)
      add(std::numbers::pi * double(i) / double(n), std::numbers::pi * double(j) / double(n));
  add(0, 0);
  add(0, std::numbers::pi);
  std::size_t const north = m.vertices.size() - 2, south = north + 1;
  auto const at = [n](std::size_t j, std::size_t i) { return (j - 1) * 2 * n + i % (2 * n); };
  for (std::size_t i = 0; i < 2 * n; ++i) {
    m.triangles.push_back({north, at(1, i), at(1, i + 1)});
    for (std::size_t j = 1; j + 1 < n; ++j) {
      m.triangles.push_back({at(j, i), at(j + 1, i), at(j + 1, i + 1)});
      m.triangles.push_back({at(j, i), at(j + 1, i + 1), at(j, i + 1)});
    }
    m.triangles.push_back({at(n - 1, i), south, at(n - 1, i + 1)});
  }
  return m;
}

/// A sheet of n x n vertices over [-1, 1]^2, bumpy.
indexed sheet(std::size_t n, unsigned seed) {
  indexed m;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> bump(-0.2f, 0.2f);
  for (std::size_t j = 0; j < n; ++j)
    for (std::size_t i = 0; i < n; ++i)
      m.vertices.emplace_back(2 * float(i) / float(n - 1) - 1, 2 * float(j) / float(n - 1) - 1, bump(random));
  for (std::size_t j = 0; j + 1 < n; ++j)
    for (std::size_t i = 0; i + 1 < n; ++i) {
      std::size_t const k = j * n + i;
      m.triangles.push_back({k, k + 1, k + n});
      m.triangles.push_back({k + 1, k + n + 1, k + n});
    }
  return m;
}

/// Ten thousand rays; PATCHRT_LEAK_RAYS sets another number.
int ray_count() {
  char const* const asked = std::getenv("PATCHRT_LEAK_RAYS");
  return asked ? std::stoi(asked) : 10000;
}

int misses(indexed const& m, std::vector<ray<float>> const& rays) {
  auto const shapes = m.shapes();
  auto const built = build_scene(shapes);
  std::vector<scene_hit<float>> hits(rays.size());
  trace::closest_hits(built.view(), std::span<ray<float> const>(rays), std::span(hits), serial{});
  int missed = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    auto const without_stack = intersect<false, float>(built.view(), rays[i], true);
    missed += !hits[i].valid() || !without_stack.valid;
  }
  return missed;
}

constexpr float no_end = std::numeric_limits<float>::infinity();

}  // namespace

TEST_CASE(
    "no ray from inside leaves a closed mesh far from the origin") {  // experiment A of Woop, Benthin & Wald's kind
  unsigned const seed = 51;
  CAPTURE(seed);
  vec3<double> const centre(148376, 1234, -223423);
  indexed const m = ball(centre, 2, 60);
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  std::vector<ray<float>> rays;
  for (int i = 0; i < ray_count(); ++i)
    rays.push_back({vec3<float>(centre), {normal(random), normal(random), normal(random)}, 0, no_end});
  CHECK(misses(m, rays) == 0);
}

TEST_CASE("no ray from inside leaves a closed mesh through its vertices") {
  unsigned const seed = 52;
  CAPTURE(seed);
  indexed const m = ball({0, 0, 0}, 2, 60);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> near(-0.5f, 0.5f);
  std::uniform_int_distribution<std::size_t> pick(0, m.vertices.size() - 1);
  std::vector<ray<float>> rays;
  for (int i = 0; i < ray_count(); ++i) {
    vec3<float> const o(near(random), near(random), near(random));
    rays.push_back({o, m.vertices[pick(random)] - o, 0, no_end});
  }
  CHECK(misses(m, rays) == 0);
}

TEST_CASE("no ray slips through the inner vertices of a bumpy sheet") {
  unsigned const seed = 53;
  CAPTURE(seed);
  std::size_t const n = 16;
  indexed const m = sheet(n, seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> across(-0.5f, 0.5f);
  std::uniform_int_distribution<std::size_t> inner(1, n - 2);
  std::vector<ray<float>> rays;
  for (int i = 0; i < ray_count(); ++i) {
    std::size_t const row = inner(random), column = inner(random);
    vec3<float> const aim = m.vertices[row * n + column], o = aim + vec3<float>(across(random), across(random), 3);
    rays.push_back({o, aim - o, 0, no_end});
  }
  CHECK(misses(m, rays) == 0);
}

TEST_CASE("a triangle of a mesh takes less than 100 bytes with both trees") {
  auto const shapes = ball({0, 0, 0}, 2, 100).shapes();
  CHECK(double(build_scene(shapes).bytes()) / double(shapes.size()) < 100);
}

TEST_CASE("no ray from a hundred thousand radii away slips through a closed mesh") {
  unsigned const seed = 54;
  CAPTURE(seed);
  indexed const m = ball({0, 0, 0}, 2, 60);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<ray<float>> rays;
  for (int i = 0; i < ray_count();) {
    vec3<double> const d(normal(random), normal(random), normal(random));
    vec3<float> const o(2e5 * d / std::sqrt(dot(d, d)));
    vec3<double> const aim(normal(random), normal(random), normal(random));
    ray<float> const r{o, vec3<float>(aim) - o, 0, no_end};
    // Of the rounded ray: how far it passes from the middle.
    vec3<double> const from(r.origin), along(r.direction), across = cross(from, along);
    if (dot(across, across) > 3.6 * dot(along, along)) continue;
    rays.push_back(r);
    ++i;
  }
  CHECK(misses(m, rays) == 0);
}
