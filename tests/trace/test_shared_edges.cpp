// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <numbers>
#include <tuple>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using point = vec3<double>;

struct parameters {
  double u, v;
};

/// Side 0 is u = 0, 1 is u = 1, 2 is v = 0, 3 is v = 1.
parameters on_side(int side, double s) {
  return side == 0 ? parameters{0, s} : side == 1 ? parameters{1, s} : side == 2 ? parameters{s, 0} : parameters{s, 1};
}

std::array<point, 4> side_points(bicubic_patch<double> const& p, int side) {
  std::array<point, 4> c;
  for (int k = 0; k < 4; ++k) c[std::size_t(k)] = side < 2 ? p(side * 3, k) : p(k, (side - 2) * 3);
  return c;
}

/// An edge of two patches whose control points are the same numbers, perhaps in the other order.
struct shared_edge {
  std::size_t patch[2];
  int side[2];
  bool is_reversed;

  parameters at(int which, double s) const { return on_side(side[which], which && is_reversed ? 1 - s : s); }
};

using point_key = std::tuple<double, double, double>;
point_key key_of(point const& p) { return {p.x + 0.0, p.y + 0.0, p.z + 0.0}; }  // one zero

struct edges_of_scene {
  std::vector<shared_edge> shared;
  std::size_t free = 0, crowded = 0, collapsed = 0;  ///< of one patch, of more than two, of no length
};
edges_of_scene find_edges(patch_list const& scene) {
  struct entry {
    std::size_t patch;
    int side;
    bool is_reversed;
  };
  std::map<std::array<point_key, 4>, std::vector<entry>> known;
  edges_of_scene edges;
  for (std::size_t i = 0; i < scene.size(); ++i)
    for (int side = 0; side < 4; ++side) {
      auto const c = side_points(scene[i], side);
      std::array<point_key, 4> key{key_of(c[0]), key_of(c[1]), key_of(c[2]), key_of(c[3])};
      if (key[0] == key[1] && key[1] == key[2] && key[2] == key[3]) {
        ++edges.collapsed;
        continue;
      }
      std::array<point_key, 4> const other{key[3], key[2], key[1], key[0]};
      bool const is_reversed = other < key;
      known[is_reversed ? other : key].push_back({i, side, is_reversed});
    }
  for (auto const& [key, e] : known) {
    if (e.size() == 1) ++edges.free;
    else if (e.size() > 2) ++edges.crowded;
    else
      edges.shared.push_back({{e[0].patch, e[1].patch}, {e[0].side, e[1].side}, e[0].is_reversed != e[1].is_reversed});
  }
  return edges;
}

/// The tangent that leads from a side into its patch.
point inward(bicubic_patch<double> const& p, int side, parameters const& at) {
  auto const q = evaluate(p, at.u, at.v);
  return side == 0 ? q.du : side == 1 ? -q.du : side == 2 ? q.dv : -q.dv;
}

/// How surely a ray of unit direction d crosses from one side of two patches to the other at their shared edge: the
/// smaller |cosine| with their normals; 0 where both patches lie on one side of it, or a tangent vanishes.
double crossing(patch_list const& scene, shared_edge const& e, double s, point const& d) {
  auto const a = e.at(0, s), b = e.at(1, s);
  auto const q = evaluate(scene[e.patch[0]], a.u, a.v);
  point const along = e.side[0] < 2 ? q.dv : q.du;
  point const first = cross(along, inward(scene[e.patch[0]], e.side[0], a));
  point const second = cross(along, inward(scene[e.patch[1]], e.side[1], b));
  double const length_first = norm(first), length_second = norm(second);
  if (!(length_first > 0 && length_second > 0)) return 0;
  double const x = dot(d, first) / length_first, y = dot(d, second) / length_second;
  return x * y < 0 ? std::min(std::fabs(x), std::fabs(y)) : 0;
}

struct aimed_ray {
  ray<double> r;
  double t;  ///< at the point it was aimed at
  double least_cos;
  std::vector<std::size_t> patches;  ///< that meet there
};

struct outcome {
  std::size_t rays = 0;
  std::size_t at_aim = 0;     ///< hit one of the patches that meet there, there
  std::size_t nearer = 0;     ///< hit something nearer
  std::size_t elsewhere = 0;  ///< hit another patch there
  std::size_t lost = 0;

  void add(outcome const& o) {
    rays += o.rays, at_aim += o.at_aim, nearer += o.nearer, elsewhere += o.elsewhere, lost += o.lost;
  }
};
std::ostream& operator<<(std::ostream& out, outcome const& o) {
  return out << o.rays << " rays: " << o.at_aim << " hit a patch that they were aimed at, " << o.nearer
             << " something nearer, " << o.elsewhere << " another patch there, " << o.lost << " lost";
}

template <accuracy A>
outcome trace_aimed(patch_list const& scene, std::vector<aimed_ray> const& aimed, int depth = -1) {
  mixed_hierarchy_options options;
  options.depth = depth;
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, serial{});
  auto const ball = ball_of(scene);
  ray_list rays;
  for (auto const& a : aimed) rays.push_back(a.r);
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  outcome o;
  o.rays = rays.size();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    double const epsilon = A == accuracy::fast ? 0x1p-23 : 0x1p-52;
    double const near = 64 * epsilon * (ball.radius + norm(rays[i].origin - ball.middle)) / aimed[i].least_cos;
    auto const& there = aimed[i].patches;
    if (!(hits[i].t <= aimed[i].t + near)) ++o.lost;
    else if (hits[i].t < aimed[i].t - near) ++o.nearer;
    else if (std::find(there.begin(), there.end(), std::size_t(hits[i].patch)) != there.end()) ++o.at_aim;
    else ++o.elsewhere;
  }
  return o;
}

/// A ray of unit direction d that comes from 1 to 4 `radius` away, through the aim but for rounding.
aimed_ray aim_at(point const& aim, point const& d, double radius, std::mt19937& g) {
  double const t = radius * uniform(g, 1, 4);
  return {{aim - d * t, d, 0, no_limit}, t, 1, {}};
}

/// Rays in random directions across shared edges, |cosine| with both patches `least_cos` at least.
std::vector<aimed_ray> rays_at_shared_edges(patch_list const& scene, std::vector<shared_edge> const& edges, int count,
                                            double least_cos, std::mt19937& g) {
  double const radius = ball_of(scene).radius;
  std::vector<aimed_ray> rays;
  for (int tries = 0; int(rays.size()) < count && tries < 50 * count; ++tries) {
    auto const& e = edges[g() % edges.size()];
    double const s = tries % 4 == 0 ? double(1 + g() % 15) / 16 : uniform(g, 1e-3, 1 - 1e-3);
    point const d = random_direction(g);
    double const cos = crossing(scene, e, s, d);
    if (cos < least_cos) continue;
    auto const at = e.at(0, s);
    rays.push_back(aim_at(evaluate(scene[e.patch[0]], at.u, at.v).position, d, radius, g));
    rays.back().least_cos = cos;
    rays.back().patches = {e.patch[0], e.patch[1]};
  }
  return rays;
}

/// A corner of a patch: its parameters are 0 or 1.
struct patch_corner {
  std::size_t patch;
  int u, v;
};

/// Corners of three patches or more that are the same numbers.
std::vector<std::vector<patch_corner>> shared_corners(patch_list const& scene) {
  std::map<point_key, std::vector<patch_corner>> known;
  for (std::size_t i = 0; i < scene.size(); ++i)
    for (int k = 0; k < 4; ++k) known[key_of(scene[i](3 * (k & 1), 3 * (k >> 1)))].push_back({i, k & 1, k >> 1});
  std::vector<std::vector<patch_corner>> corners;
  for (auto const& [key, c] : known)
    if (c.size() > 2) corners.push_back(c);
  return corners;
}

/// The smallest |cosine| between d and the normals of patches that meet in a corner; 0 where they do not surround it,
/// seen along d.
double crossing(patch_list const& scene, std::vector<patch_corner> const& corner, point const& d) {
  double least = 1, turn = 0;
  for (auto const& c : corner) {
    auto const q = evaluate(scene[c.patch], double(c.u), double(c.v));
    point const a = c.u ? -q.du : q.du, b = c.v ? -q.dv : q.dv, n = cross(a, b);
    if (!(norm(n) > 1e-3 * norm(a) * norm(b))) return 0;
    least = std::min(least, std::fabs(dot(d, n)) / norm(n));
    point const seen_a = a - d * dot(a, d), seen_b = b - d * dot(b, d);
    turn += std::atan2(norm(cross(seen_a, seen_b)), dot(seen_a, seen_b));
  }
  return std::fabs(turn - 2 * std::numbers::pi) < 1e-6 ? least : 0;
}

std::vector<aimed_ray> rays_at_shared_corners(patch_list const& scene, int count, double least_cos, std::mt19937& g) {
  double const radius = ball_of(scene).radius;
  auto const corners = shared_corners(scene);
  std::vector<aimed_ray> rays;
  for (int tries = 0; !corners.empty() && int(rays.size()) < count && tries < 50 * count; ++tries) {
    auto const& c = corners[g() % corners.size()];
    point const d = random_direction(g);
    double const cos = crossing(scene, c, d);
    if (cos < least_cos) continue;
    rays.push_back(aim_at(scene[c[0].patch](3 * c[0].u, 3 * c[0].v), d, radius, g));
    rays.back().least_cos = cos;
    for (auto const& each : c) rays.back().patches.push_back(each.patch);
  }
  return rays;
}

/// A sheet cut into sixteen: neighbours share their edges bit for bit.
patch_list cut_sheet(std::mt19937& g, double rough) {
  auto const sheet = random_sheet(g, rough);
  patch_list patches;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) patches.push_back(sub_patch(sheet, i / 4.0, (i + 1) / 4.0, j / 4.0, (j + 1) / 4.0));
  return patches;
}

constexpr double least_cos = 0.05;

template <class Aim> void check_model(char const* name, unsigned seed, Aim&& aim) {
  auto const scene = load_model(name);
  if (scene.empty()) PATCHRT_SKIP(std::string("no ") + name + ".bpt in PATCHRT_SHARED_DATA");
  CAPTURE(name, seed);
  std::mt19937 g(seed);
  std::vector<aimed_ray> const rays = aim(scene, g);
  auto const refined = trace_aimed<accuracy::refined>(scene, rays);
  std::cout << name << ", refined: " << refined << '\n'
            << name << ", fast: " << trace_aimed<accuracy::fast>(scene, rays) << '\n'
            << name << ", reference: " << trace_aimed<accuracy::reference>(scene, rays) << std::endl;
  CAPTURE(refined);
  CHECK(refined.rays > 1000);
  CHECK(10 * refined.at_aim > refined.rays);
  CHECK(refined.elsewhere == 0);
  CHECK(refined.lost == 0);
}

std::vector<aimed_ray> at_edges(patch_list const& scene, std::mt19937& g) {
  return rays_at_shared_edges(scene, find_edges(scene).shared, 10000, least_cos, g);
}
std::vector<aimed_ray> at_corners(patch_list const& scene, std::mt19937& g) {
  return rays_at_shared_corners(scene, 5000, least_cos, g);
}

}  // namespace

// What `refined` promises: a root counts where the ray passes a point of the patch within that point's rounding. So where the
// boundary curves of two patches are the same numbers, a ray that crosses from one to the other, not grazing either,
// meets one of them. Curves that are equal only nearly, and rays that touch an edge from outside, have no such promise,
// nor have `fast`, whose hits reach 2^-20 beyond edges, and `reference`, which has the paper's closed [0, 1]^2.

TEST_CASE("a ray aimed at an edge that two patches share hits one of them there, or something nearer: teapot") {
  auto const edges = find_edges(load_model("teapot"));
  CHECK(edges.shared.size() == 52);
  CHECK(edges.collapsed == 8);
  CHECK(edges.crowded == 0);
  check_model("teapot", 81, at_edges);
}
TEST_CASE("a ray aimed at an edge that two patches share hits one of them there, or something nearer: Gumbo") {
  check_model("gumbo", 82, at_edges);
}
TEST_CASE("a ray aimed at an edge that two patches share hits one of them there, or something nearer: bigguy") {
  check_model("bigguy_osd_L2", 83, at_edges);
}

TEST_CASE("a ray aimed at a corner that patches surround hits one of them there, or something nearer: teapot") {
  check_model("teapot", 84, at_corners);
}
TEST_CASE("a ray aimed at a corner that patches surround hits one of them there, or something nearer: bigguy") {
  check_model("bigguy_osd_L2", 85, at_corners);
}

TEST_CASE("a ray aimed at a pole, where edges of patches collapse, or beside it, hits there, or something nearer") {
  unsigned const seed = 89;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  double const radius = ball_of(scene).radius;
  std::vector<aimed_ray> beside, through;
  for (std::size_t i = 0; i < scene.size(); ++i)
    for (int side = 0; side < 4; ++side) {
      auto const c = side_points(scene[i], side);
      if (!std::all_of(c.begin(), c.end(), [&](point const& p) { return key_of(p) == key_of(c[0]); })) continue;
      for (int k = 0; k < 2000; ++k) {
        double const off = std::pow(10, uniform(g, -15, -1));
        auto at = on_side(side, uniform(g));
        (side < 2 ? at.u : at.v) += side % 2 ? -off : off;
        auto const q = evaluate(scene[i], at.u, at.v);
        point const normal = cross(q.du, q.dv), d = random_direction(g);
        double const cos = std::fabs(dot(d, normal)) / norm(normal);
        if (!(cos > 0.1 && std::fabs(d.z) > 0.1)) continue;  // level where the teapot's patches collapse
        beside.push_back(aim_at(q.position, d, radius, g));
        beside.back().least_cos = cos;
        beside.back().patches = {i};
        through.push_back(aim_at(c[0], d, radius, g));
        through.back().least_cos = std::fabs(d.z);
        through.back().patches = {i};
      }
    }
  auto const refined = trace_aimed<accuracy::refined>(scene, beside);
  auto const at_pole = trace_aimed<accuracy::refined>(scene, through);
  std::cout << "beside poles, refined: " << refined << '\n'
            << "through poles, refined: " << at_pole << '\n'
            << "through poles, reference: " << trace_aimed<accuracy::reference>(scene, through) << std::endl;
  CAPTURE(refined, at_pole);
  CHECK(at_pole.lost == 0);
  CHECK(refined.rays > 10000);
  CHECK(3 * refined.at_aim > refined.rays);
  CHECK(refined.lost == 0);
}

TEST_CASE("a sheet cut into patches has no gaps at its cuts and their crossings") {
  unsigned const seed = 86;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (double rough : {0.0, 1e-3, 0.3, 1.0}) {
    outcome refined;
    for (int k = 0; k < 10; ++k) {
      auto const scene = cut_sheet(g, rough);
      auto const edges = find_edges(scene);
      REQUIRE(edges.shared.size() == 24);
      auto rays = rays_at_shared_edges(scene, edges.shared, 500, least_cos, g);
      auto const more = rays_at_shared_corners(scene, 100, least_cos, g);
      rays.insert(rays.end(), more.begin(), more.end());
      for (int depth : {-1, 0, 4}) refined.add(trace_aimed<accuracy::refined>(scene, rays, depth));
    }
    CAPTURE(rough, refined);
    CHECK(refined.rays > 10000);
    CHECK(10 * refined.at_aim > refined.rays);
    CHECK(refined.elsewhere == 0);
    CHECK(refined.lost == 0);
  }
}

TEST_CASE("a patch has no gaps where its sub-patches meet") {
  unsigned const seed = 87;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (double rough : {0.0, 1e-5, 1e-3, 0.05, 0.3, 1.0})
    for (int depth : {-1, 3, 6, 8}) {
      outcome refined;
      for (int k = 0; k < 10; ++k) {
        patch_list const scene{random_sheet(g, rough)};
        std::vector<aimed_ray> rays;
        while (rays.size() < 500) {
          double u = double(1 + g() % 15) / 16, v = g() % 4 ? uniform(g, 0.01, 0.99) : double(1 + g() % 15) / 16;
          if (g() % 2) std::swap(u, v);
          auto const q = evaluate(scene[0], u, v);
          point const n = cross(q.du, q.dv), d = random_direction(g);
          double const cos = std::fabs(dot(n, d)) / norm(n);
          if (!(cos > least_cos)) continue;
          rays.push_back(aim_at(q.position, d, 1, g));
          rays.back().least_cos = cos;
          rays.back().patches = {0};
        }
        refined.add(trace_aimed<accuracy::refined>(scene, rays, depth));
      }
      CAPTURE(rough, depth, refined);
      CHECK(2 * refined.at_aim > refined.rays);
      CHECK(refined.lost == 0);
    }
}

// The teapot's halves meet in edges that lie in y = 0 as a whole, and so do these rays: one of a ray's two plane
// functions is 0 all along the border of cells.
TEST_CASE("rays in a plane of symmetry meet the edges that lie in it") {
  unsigned const seed = 88;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const scene = load_model("teapot");
  auto edges = find_edges(scene).shared;
  std::erase_if(edges, [&](shared_edge const& e) {
    auto const c = side_points(scene[e.patch[0]], e.side[0]);
    return std::any_of(c.begin(), c.end(), [](point const& p) { return p.y != 0; });
  });
  REQUIRE(edges.size() > 10);
  double const radius = ball_of(scene).radius;
  for (double beside : {0.0, 1e-17}) {
    std::vector<aimed_ray> rays;
    while (rays.size() < 2000) {
      auto const& e = edges[g() % edges.size()];
      double const s = uniform(g, 1e-3, 1 - 1e-3);
      auto const at = e.at(0, s), second = e.at(0, uniform(g));
      point const aim = evaluate(scene[e.patch[0]], at.u, at.v).position;
      point const apart = evaluate(scene[e.patch[0]], second.u, second.v).position - aim, d = apart / norm(apart);
      double const cos = crossing(scene, e, s, d);
      if (!(cos >= least_cos)) continue;
      rays.push_back(aim_at(aim, d, radius, g));
      rays.back().r.origin.y = beside;
      rays.back().least_cos = cos;
      rays.back().patches = {e.patch[0], e.patch[1]};
    }
    auto const refined = trace_aimed<accuracy::refined>(scene, rays);
    CAPTURE(beside, refined);
    CHECK(10 * (refined.at_aim + refined.nearer) > 9 * refined.rays);
    CHECK(refined.lost == 0);
  }
}
