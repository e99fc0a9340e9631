// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#ifdef PATCHRT_HAVE_OPENMP
#  include <patchrt/exec/openmp.hpp>
#endif

#include <algorithm>
#include <cstring>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using real = long double;

struct real_point {
  real x[3];
};

/// The user's surface less `from`, by the definition: differences of near doubles are exact.
real_point plain_position(bicubic_patch<double> const& p, vec3<double> const& from, double u, double v) {
  real const s = 1 - real(u), t = 1 - real(v);
  real const wu[] = {s * s * s, 3 * s * s * u, 3 * s * u * u, real(u) * u * u};
  real const wv[] = {t * t * t, 3 * t * t * v, 3 * t * v * v, real(v) * v * v};
  real_point q{{0, 0, 0}};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int c = 0; c < 3; ++c) q.x[c] += wu[i] * wv[j] * (real(p(i, j)[c]) - from[c]);
  return q;
}

template <class E>
mixed_hierarchy build(patch_list const& scene, mixed_hierarchy_options const& options, E const& exec) {
  return build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, exec);
}
mixed_hierarchy build(patch_list const& scene, int depth = -1) {
  mixed_hierarchy_options options;
  options.depth = depth;
  return build(scene, options, serial{});
}

/// A scene somewhere, of some size.
struct placed_scene {
  std::string name;
  patch_list patches;
  double size;    ///< half the diagonal
  double offset;  ///< how far from the origin
};

/// The teapot, patches of all shapes, one sheet, and a scene that is a point, in every place and size.
std::vector<placed_scene> placed_scenes(std::mt19937& g) {
  patch_list shapes;
  for (int k = 0; k < 12; ++k) {
    auto p = k % 2 ? random_patch<double>(g) : random_sheet(g, 0.3);
    vec3<double> const at = random_direction(g) * 3.0;
    double const squeeze = k % 3 == 0 ? 1 : k % 3 == 1 ? 0 : 1e-3;
    for (auto& c : p.control_points) c = at + vec3<double>{c.x, c.y, c.z * squeeze};
    shapes.push_back(p);
  }
  bicubic_patch<double> point;
  for (auto& c : point.control_points) c = {1, 2, 3};
  std::vector<std::pair<std::string, patch_list>> const models{
      {"teapot", load_model("teapot")}, {"shapes", shapes}, {"sheet", {random_sheet(g, 0.2)}}, {"point", {point}}};
  std::vector<placed_scene> scenes;
  for (auto const& [name, patches] : models)
    for (double scale : {1e-100, 1e-6, 1.0, 1e6, 1e100})
      for (double far : {0.0, 1.0, 1e3, 1e6}) {
        placed_scene s{name, patches, 0, 0};
        double const diagonal = 2 * std::max(ball_of(patches).radius, 1.0);
        vec3<double> const shift = random_direction(g) * (far * diagonal);
        for (auto& p : s.patches)
          for (auto& c : p.control_points) c = (c + shift) * scale;
        s.size = ball_of(s.patches).radius;
        s.offset = norm(shift) * scale;
        scenes.push_back(s);
      }
  return scenes;
}

/// f(u, v) at corners, edges and inside of a cell of the parameter square.
template <class F> void for_samples(patch_cell<float> const& cell, int count, std::mt19937& g, F&& f) {
  for (int k = 0; k < count; ++k) {
    double x = uniform(g, -1, 1), y = uniform(g, -1, 1);
    if (k < 4) x = k & 1 ? 1 : -1, y = k & 2 ? 1 : -1;
    else if (k % 4 == 0) x = g() % 2 ? 1 : -1;
    else if (k % 4 == 1) y = g() % 2 ? 1 : -1;
    f(0.5 + 0.5 * (cell.x + x * double(cell.half_x)), 0.5 + 0.5 * (cell.y + y * double(cell.half_y)));
  }
}

bool is_power_of_two(double x) {
  int exponent = 0;
  return x > 0 && std::isfinite(x) && std::frexp(x, &exponent) == 0.5;
}

template <class T> bool same_bytes(std::vector<T> const& a, std::vector<T> const& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

/// Equal trees but for the bytes that only fill them up.
bool same_tree(subpatch_tree const& a, subpatch_tree const& b) {
  auto const same = [](vec3<float> const& x, vec3<float> const& y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  return same(a.grid_origin, b.grid_origin) && same(a.grid_step, b.grid_step) &&
         same(a.remainder_step, b.remainder_step) && a.first_node == b.first_node && a.first_leaf == b.first_leaf &&
         a.depth == b.depth && a.splits_v == b.splits_v;
}

bool same_hierarchy(mixed_hierarchy const& a, mixed_hierarchy const& b) {
  auto const same = [](auto const& x, auto const& y) { return std::memcmp(&x, &y, sizeof x) == 0; };
  return same_bytes(a.top.nodes, b.top.nodes) && same_bytes(a.top.links, b.top.links) && same_bytes(a.nodes, b.nodes) &&
         same_bytes(a.leaves, b.leaves) && same_bytes(a.exact, b.exact) && same(a.centre, b.centre) &&
         same(a.inverse_scale, b.inverse_scale) && same(a.half_extent, b.half_extent) &&
         std::equal(a.search.begin(), a.search.end(), b.search.begin(), b.search.end(),
                    [&](auto const& x, auto const& y) { return same(x.power, y.power) && same_tree(x.tree, y.tree); });
}

}  // namespace

TEST_CASE("search space is the user's, its middle moved to 0 and scaled by a power of two into [-1, 1]") {
  unsigned const seed = 61;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (auto const& scene : placed_scenes(g)) {
    CAPTURE(scene.name, scene.size, scene.offset);
    auto const h = build(scene.patches);
    REQUIRE(is_power_of_two(h.inverse_scale));
    // What doubles at the scene's place can hold, in search space.
    double const grain = 0x1p-52 * (scene.offset + 2 * scene.size) * h.inverse_scale;
    double widest = 0;
    std::size_t outside = 0, elsewhere = 0, rounded = 0;
    double lo[3] = {1, 1, 1}, hi[3] = {-1, -1, -1};
    for (std::size_t i = 0; i < scene.patches.size(); ++i) {
      auto const& e = h.exact[i];
      double size = 0;
      for (int k = 0; k < 16; ++k)
        for (int c = 0; c < 3; ++c) {
          double const user = scene.patches[i].control_points[k][c], x = (user - h.centre[c]) * h.inverse_scale;
          lo[c] = std::min(lo[c], x);
          hi[c] = std::max(hi[c], x);
          widest = std::max(widest, std::fabs(x));
          outside += !(std::fabs(x) <= double(h.half_extent[c]));
          double const moved = e.patch.control_points[k][c];
          size = std::max(size, std::fabs(moved));
          rounded += !(std::fabs((real(e.base[c]) + moved - user) * h.inverse_scale) <= grain);
        }
      CHECK(e.size == size);
      for (int c = 0; c < 3; ++c) elsewhere += e.search_base[c] != (e.base[c] - h.centre[c]) * h.inverse_scale;
    }
    CHECK(outside == 0);
    CHECK(elsewhere == 0);
    CHECK(rounded == 0);
    CHECK(widest <= 1 + grain);
    CHECK((scene.name == "point" || widest >= 0.5 - grain));
    for (int c = 0; c < 3; ++c) CHECK(std::fabs(lo[c] + hi[c]) <= 4 * grain);
  }
}

TEST_CASE("a patch in powers is the user's surface about its base, to float's rounding of its size") {
  unsigned const seed = 62;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (auto const& scene : placed_scenes(g)) {
    CAPTURE(scene.name, scene.size, scene.offset);
    auto const h = build(scene.patches);
    real worst = 0;
    for (std::size_t i = 0; i < scene.patches.size(); ++i) {
      auto const& e = h.exact[i];
      for_samples({0, 0, 1, 1, {0, 0, 0}}, 40, g, [&](double u, double v) {
        auto const s = position(h.search[i].power, 2 * u - 1, 2 * v - 1);
        auto const user = plain_position(scene.patches[i], e.base, u, v);
        for (int c = 0; c < 3; ++c)
          worst = std::max(worst, std::fabs(real(s[c]) - user.x[c] * h.inverse_scale) /
                                      std::max(real(e.size * h.inverse_scale), real(1e-30L)));
      });
    }
    CHECK(double(worst) < 16 * 0x1p-24);
  }
}

TEST_CASE("every box of the hierarchy holds the user's surface under it, wherever and however large the scene is") {
  unsigned const seed = 63;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (auto const& scene : placed_scenes(g)) {
    for (int depth : {-1, 0, 3, 6}) {
      CAPTURE(scene.name, scene.size, scene.offset, depth);
      auto const h = build(scene.patches, depth);
      std::vector<box<float>> top(scene.patches.size(), box<float>::empty());
      std::size_t outside_parent = 0, outside_top = 0, outside_node = 0;
      for (std::size_t i = 0; i < h.top.nodes.size(); ++i) {
        auto const& node = h.top.nodes[i];
        if (node.primitive >= 0) top[std::size_t(node.primitive)] = node.bounds;
        for (std::size_t k = i; k < node.skip; ++k)
          for (int c = 0; c < 3; ++c)
            outside_parent +=
                !(node.bounds.lo[c] <= h.top.nodes[k].bounds.lo[c] && h.top.nodes[k].bounds.hi[c] <= node.bounds.hi[c]);
      }
      for (std::size_t i = 0; i < scene.patches.size(); ++i) {
        auto const& tree = h.search[i].tree;
        auto const& e = h.exact[i];
        for_samples({0, 0, 1, 1, {0, 0, 0}}, 40, g, [&](double u, double v) {
          auto const q = plain_position(scene.patches[i], h.centre, u, v);
          for (int c = 0; c < 3; ++c) {
            real const x = q.x[c] * h.inverse_scale;
            outside_top += !(top[i].lo[c] <= x && x <= top[i].hi[c]);
          }
        });
        for (std::uint32_t k = 2; k < 2u << tree.depth; ++k) {
          subpatch_node const& node = h.nodes[tree.first_node + k - 1];
          for_samples(subpatch_cell(tree, k), 8, g, [&](double u, double v) {
            auto const q = plain_position(scene.patches[i], e.base, u, v);
            for (int c = 0; c < 3; ++c) {
              real const x = (q.x[c] * h.inverse_scale - tree.grid_origin[c]) / tree.grid_step[c];
              outside_node += !(node.lo[c] <= x && x <= node.hi[c]);
            }
          });
        }
      }
      CHECK(outside_parent == 0);
      CHECK(outside_top == 0);
      CHECK(outside_node == 0);
    }
  }
}

// What keeps the rounding of rays to float, an ulp of 2 at the farthest, from losing a patch.
TEST_CASE("top boxes stand off from the user's surface by 2^-20 of search space at least") {
  unsigned const seed = 64;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (auto const& scene : placed_scenes(g)) {
    CAPTURE(scene.name, scene.size, scene.offset);
    auto const h = build(scene.patches);
    real least = 1;
    for (auto const& node : h.top.nodes) {
      if (node.primitive < 0) continue;
      for_samples({0, 0, 1, 1, {0, 0, 0}}, 40, g, [&](double u, double v) {
        auto const q = plain_position(scene.patches[std::size_t(node.primitive)], h.centre, u, v);
        for (int c = 0; c < 3; ++c) {
          real const x = q.x[c] * h.inverse_scale;
          least = std::min({least, x - node.bounds.lo[c], node.bounds.hi[c] - x});
        }
      });
    }
    CHECK(double(least) >= 0x1p-20);
  }
}

TEST_CASE("the bytes of a hierarchy are those that its view leads to, and under 1 KiB a patch by default") {
  unsigned const seed = 65;
  CAPTURE(seed);
  std::mt19937 g(seed);
  patch_list shapes;
  for (int k = 0; k < 25; ++k) shapes.push_back(k % 2 ? random_patch<double>(g) : random_sheet(g, 0.1));
  for (auto const& scene : {load_model("teapot"), shapes, patch_list(1, shapes[0])}) {
    for (int depth : {-1, 0, 1, 5, max_subpatch_depth}) {
      CAPTURE(scene.size(), depth);
      auto const h = build(scene, depth);
      auto const v = h.view();
      std::size_t bytes = v.top.count * (sizeof *v.top.nodes + sizeof *v.top.links), leaves = 0;
      std::vector<int> node_owners(h.nodes.size()), leaf_owners(h.leaves.size());
      traverse_unordered(
          v.top, [](box<float> const&) { return true; },
          [&](std::int32_t patch) {
            auto const& tree = v.search[patch].tree;
            ++leaves;
            bytes += sizeof tree + ((2u << tree.depth) - 1) * sizeof *v.nodes + (1u << tree.depth) * sizeof *v.leaves;
            for (std::uint32_t k = 0; k < (2u << tree.depth) - 1; ++k) ++node_owners.at(tree.first_node + k);
            for (std::uint32_t k = 0; k < 1u << tree.depth; ++k) ++leaf_owners.at(tree.first_leaf + k);
            if (depth >= 0) CHECK(int(tree.depth) == depth);
            return false;
          });
      CHECK(leaves == scene.size());
      CHECK(h.patch_count() == scene.size());
      CHECK(h.hierarchy_bytes() == bytes);
      std::size_t const all = h.top.bytes() + h.nodes.size() * sizeof *v.nodes + h.leaves.size() * sizeof *v.leaves +
                              scene.size() * (sizeof *v.search + sizeof *v.exact);
      CHECK(h.hierarchy_bytes() + h.patch_bytes() == all);
      CHECK(std::count(node_owners.begin(), node_owners.end(), 1) == std::ptrdiff_t(node_owners.size()));
      CHECK(std::count(leaf_owners.begin(), leaf_owners.end(), 1) == std::ptrdiff_t(leaf_owners.size()));
      if (depth == -1) CHECK(bytes <= 1024 * scene.size());
    }
  }
}

#ifdef PATCHRT_HAVE_OPENMP
TEST_CASE("any number of threads builds the same hierarchy, byte for byte") {
  unsigned const seed = 66;
  CAPTURE(seed);
  std::mt19937 g(seed);
  patch_list many;
  for (int k = 0; k < 3000; ++k) {
    auto p = k % 7 == 0 ? random_patch<double>(g) : random_sheet(g, 0.2);
    vec3<double> const at = random_direction(g) * 20.0;
    for (auto& c : p.control_points) c += at;
    many.push_back(p);
  }
  for (auto const& scene : {load_model("teapot"), many, patch_list(1, many[0]), patch_list(200, many[1])})
    for (int depth : {-1, 0, 4}) {
      mixed_hierarchy_options options;
      options.depth = depth;
      auto const expected = build(scene, options, serial{});
      for (int threads : {1, 2, 3, 7}) {
        CAPTURE(scene.size(), depth, threads);
        CHECK(same_hierarchy(expected, build(scene, options, openmp(threads))));
      }
    }
}

TEST_CASE("a patch refused in a thread is refused to the caller") {
  auto scene = load_model("teapot");
  scene[29].control_points[7].y = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(build(scene, {}, openmp(2)), std::invalid_argument);
  CHECK_THROWS_WITH(build(scene, {}, openmp(2)), contains_text("patch 29") && contains_text("control point 7"));
}
#endif
