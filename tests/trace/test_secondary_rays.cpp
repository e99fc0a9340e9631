// SPDX-License-Identifier: MIT
#include "departures.hpp"
#include "joined_patches.hpp"
#include "support/catch.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class R>
std::vector<patch_hit> trace_rays(accuracy level, mixed_hierarchy const& h, std::vector<ray<R>> const& rays) {
  std::vector<patch_hit> hits(rays.size());
  std::span<ray<R> const> const list(rays);
  switch (level) {
    case accuracy::fast:
      trace::closest_hits<accuracy::fast>(h.view(), list, hits, serial{});
      break;
    case accuracy::refined:
      trace::closest_hits<accuracy::refined>(h.view(), list, hits, serial{});
      break;
    case accuracy::certified:
      trace::closest_hits<accuracy::certified>(h.view(), list, hits, serial{});
      break;
    case accuracy::reference:
      trace::closest_hits<accuracy::reference>(h.view(), list, hits, serial{});
      break;
  }
  return hits;
}

hit_departure depart(accuracy level, mixed_hierarchy const& h, patch_hit const& hit) {
  return level == accuracy::fast ? depart_from<accuracy::fast>(h.view(), hit) : depart_from(h.view(), hit);
}

/// Kind 0: control points of coordinates from 1e-8 to 1e8 of either sign, as in pbrt's experiment. Others: sheets,
/// sheets with a pole, tangles, of sizes from 1e-8 to 1e8 and up to `far` sizes, but no more than 1e8, away from 0.
template <class Generator> bicubic_patch<double> patch_of_kind(int kind, double far, Generator& g) {
  bicubic_patch<double> p;
  if (kind == 0) {
    for (auto& c : p.control_points)
      for (int k = 0; k < 3; ++k) c[k] = (g() % 2 ? 1 : -1) * std::pow(10., uniform(g, -8, 8));
    return p;
  }
  p = kind == 1 ? random_patch<double>(g) : random_sheet(g, uniform(g));
  for (int j = 1; j < 4 && kind == 2; ++j) p(0, j) = p(0, 0);
  double const size = std::pow(10., uniform(g, -8, 8));
  vec3<double> const away = random_direction(g) * std::min(1e8, size * std::pow(10., uniform(g, -2, std::log10(far))));
  for (auto& c : p.control_points) c = c * size + away;
  return p;
}

template <class R> ray<double> in_double(ray<R> const& r) {
  return {convert_vec<double>(r.origin), convert_vec<double>(r.direction), double(r.t_min), double(r.t_max)};
}

/// What rays that left one point of a patch met.
struct departure_count {
  int rays = 0;
  int rehits = 0;    ///< hits where they started, and hits near there that the exact ray does not have
  int nearby = 0;    ///< hits near there
  int seconds = 0;   ///< rays that the oracle was asked for a second hit, and said there is one
  int lost = 0;      ///< those of them without a hit there or before
  int invented = 0;  ///< hits of theirs that the oracle does not have
};

/// Second hits that are not to be lost: at angles to the surface with a greater cosine, and farther off in radii of the
/// scene. `refined` may miss one of two roots that projections in float have at one place.
struct second_hit_limits {
  double least_cos;
  double least_distance;
};
constexpr second_hit_limits of_refined{0.05, 1e-3}, of_certified{1e-3, 1e-9};

/// `judged` of the rays, evenly spread, are held against the oracle. Hits on edges are true of roots up to `beyond`
/// outside the parameters [0, 1], if their errors say so.
template <class R>
void judge(departure_count& c, oracle const& truth, double radius, hit_departure const& from,
           std::vector<ray<R>> const& rays, std::vector<patch_hit> const& hits, std::size_t judged,
           second_hit_limits limits, double beyond = 1e-9) {
  for (std::size_t k = 0; k < rays.size(); ++k) {
    ++c.rays;
    ray<double> const r = in_double(rays[k]);
    double const length = norm(r.direction), off = norm(r.origin - from.position);
    patch_hit const& hit = hits[k];
    bool const is_near = hit.valid() && hit.t * length < 1e3 * off;
    bool const is_judged = judged != 0 && k % (rays.size() / judged) == 0;
    c.nearby += is_near;
    if (!is_near && !is_judged) continue;
    if (hit.valid()) {
      auto const roots = truth.all_hits(numbers_of(r), beyond);
      bool const is_true = std::any_of(roots.begin(), roots.end(), [&](oracle_root const& root) {
        double const apart = double(std::abs(root.t - (long double)(hit.t)) - root.slack) * length;
        return apart <= double(hit.error) + 1e-14 * radius / std::max(root.cos_angle, 1e-9);
      });
      c.rehits += is_near && (!is_true || hit.t * length < 8 * off);
      c.invented += is_judged && !is_near && !is_true;
    }
    if (!is_judged) continue;
    // The ray that leaves the surface itself: its first root beyond where the offset one has left it, too.
    double const cosine = std::abs(dot(from.normal, r.direction)) / length;
    auto const roots = truth.all_hits(numbers_of(ray<double>{from.position, r.direction, 0, no_limit}));
    auto const next = std::find_if(roots.begin(), roots.end(), [&](oracle_root const& root) {
      double const t = double(root.t) * length, shift = off * (1 + 1 / limits.least_cos);
      return t > std::max({4 * off / cosine, 2 * shift, limits.least_distance * radius}) &&
             root.is_certain(limits.least_cos, 2 * shift);
    });
    if (next == roots.end()) continue;
    ++c.seconds;
    double const shift = off * (1 + 1 / next->cos_angle);
    c.lost += !(hit.valid() && hit.t * length <= double(next->t) * length + 2 * shift);
  }
}

/// Leaves every one of a number of patches, from where a random ray hits it, with `count` rays.
template <class R>
departure_count leave_patches(int patches, int kinds, double far, int count, accuracy level, std::size_t judged,
                              double least_angle, second_hit_limits limits, unsigned seed) {
  std::mt19937 g(seed);
  departure_count c;
  for (int k = 0; k < patches; ++k) {
    patch_list const scene{patch_of_kind(kinds == 1 ? 3 : k % kinds, far, g)};
    auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
    auto const ball = ball_of(scene);
    vec3<double> const eye = ball.middle + random_direction(g) * (2 * ball.radius);
    vec3<double> const aim = position(scene[0], uniform(g), uniform(g));
    patch_hit const first = trace_rays(level, h, ray_list{{eye, aim - eye, 0, no_limit}})[0];
    if (!first.valid()) continue;
    auto const from = depart(level, h, first);
    auto const rays = rays_from<R>(from, count, least_angle, g);
    judge(c, oracle(numbers_of(scene)), ball.radius, from, rays, trace_rays(level, h, rays), judged, limits);
  }
  return c;
}

/// Leaves points of joins of sheets that `cut` makes patches of, with edges up to 1e-6 diagonals apart; `aim(k, g)`
/// says where joins are in the sheet's parameters.
template <class Cut, class Aim>
departure_count leave_joins(Cut const& cut, Aim const& aim, accuracy level, second_hit_limits limits, unsigned seed) {
  std::mt19937 g(seed);
  departure_count c;
  for (int n = 0; n < 10; ++n) {
    auto const sheet = random_sheet(g, 0.5);
    patch_list scene = cut(sheet);
    double const radius = ball_of(scene).radius;
    shift_each(scene, 4.9e-7 * 2 * radius, g);
    auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
    oracle const truth(numbers_of(scene));
    std::vector<vec3<double>> aims;
    for (int k = 0; k < 40; ++k) {
      auto const [u, v] = aim(k, g);
      aims.push_back(position(sheet, u, v) + random_direction(g) * (2e-7 * uniform(g)));
    }
    for (patch_hit const& hit : trace_rays(level, h, rays_at(aims, g))) {
      if (!hit.valid()) continue;
      auto const from = depart(level, h, hit);
      auto const rays = rays_from<double>(from, 100, 1e-9, g);
      judge(c, truth, radius, from, rays, trace_rays(level, h, rays), 10, limits, 1e-3);
    }
  }
  return c;
}

/// Rays from where others, from outside, first hit a closed model, to its inside, but for those within `least_cos` of
/// the tangent plane.
struct inward_count {
  int rays = 0;
  int leaks = 0;   ///< that hit nothing
  int open = 0;    ///< of these, those that hit nothing either when they leave the surface itself
  int rehits = 0;  ///< that hit where they started
};
inward_count look_inside(patch_list const& scene, ray_list const& from_outside, int count, accuracy level,
                         double least_cos, unsigned seed) {
  std::mt19937 g(seed);
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), {}, serial{});
  oracle const truth(numbers_of(scene));
  auto const hits = trace_rays(level, h, from_outside);
  inward_count c;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    if (!hits[k].valid()) continue;
    auto const from = depart(level, h, hits[k]);
    bool const is_inside_behind = dot(from.normal, from_outside[k].direction) < 0;
    auto rays = rays_from<double>(from, count, least_cos, g);
    for (auto& r : rays)
      if ((dot(from.normal, r.direction) < 0) != is_inside_behind) {
        r.direction = -r.direction;
        r.origin = offset_origin(from, r.direction);
      }
    auto const seen = trace_rays(level, h, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      double const length = norm(rays[i].direction);
      if (std::abs(dot(from.normal, rays[i].direction)) < least_cos * length) continue;
      ++c.rays;
      if (seen[i].valid()) {
        c.rehits += seen[i].t * length < 8 * norm(rays[i].origin - from.position);
      } else {
        ++c.leaks;
        double const left_behind =
            4 * norm(rays[i].origin - from.position) / std::abs(dot(from.normal, rays[i].direction));
        auto const roots = truth.all_hits(numbers_of(ray<double>{from.position, rays[i].direction, 0, no_limit}));
        c.open += std::none_of(roots.begin(), roots.end(),
                               [&](oracle_root const& root) { return double(root.t - root.slack) > left_behind; });
      }
    }
  }
  return c;
}

/// Rays from outside through the ball of a scene.
template <class Generator> ray_list rays_from_outside(patch_list const& scene, int count, Generator& g) {
  auto const ball = ball_of(scene);
  ray_list rays = chords(scene, count, g);
  for (auto& r : rays) {
    r.origin = r.origin - r.direction * (4 * ball.radius / norm(r.direction));
    r.t_min = 0;
  }
  return rays;
}

}  // namespace

TEST_CASE(
    "a thousand rays that leave each of a thousand patches neither meet it where they left nor lose another hit") {
  // pbrt's Reintersect experiment, with patches in the place of its shapes, and rays along the surface besides.
  unsigned const seed = 30601u;
  CAPTURE(seed);
  auto const c = leave_patches<double>(1000, 4, 1e6, 1000, accuracy::refined, 2, 1e-9, of_refined, seed);
  CAPTURE(c.rays, c.nearby, c.seconds);
  CHECK(c.rays == 1000000);
  CHECK(c.rehits == 0);
  CHECK(c.invented == 0);
  CHECK(c.lost == 0);
  CHECK(c.seconds > 300);
}

TEST_CASE("certified rays that leave a patch lose no other hit met a thousandth off the tangent plane or more") {
  unsigned const seed = 30602u;
  CAPTURE(seed);
  auto const c = leave_patches<double>(400, 4, 1e6, 200, accuracy::certified, 4, 1e-9, of_certified, seed);
  CAPTURE(c.rays, c.nearby, c.seconds);
  CHECK(c.rehits == 0);
  CHECK(c.invented == 0);
  CHECK(c.lost == 0);
  CHECK(c.seconds > 100);
}

TEST_CASE("rays in float leave a patch as well") {
  unsigned const seed = 30603u;
  CAPTURE(seed);
  for (accuracy const level : {accuracy::refined, accuracy::certified}) {
    auto const c = leave_patches<float>(200, 4, 30, 200, level, 4, 1e-6, of_refined, seed);
    CAPTURE(c.rays, c.nearby, c.seconds);
    CHECK(c.rehits == 0);
    CHECK(c.invented == 0);
    CHECK(c.lost == 0);
  }
}

TEST_CASE(
    "fast rays more than a hundredth off the tangent plane leave a patch with float's clearance and do not meet it "
    "there") {
  unsigned const seed = 30604u;
  CAPTURE(seed);
  auto const c = leave_patches<float>(300, 1, 10, 200, accuracy::fast, 4, 0.01, of_refined, seed);
  CAPTURE(c.rays, c.nearby, c.seconds);
  CHECK(c.rehits == 0);
  CHECK(c.lost == 0);
}

TEST_CASE("rays that leave a model to its inside get out only through its openings, edges included") {
  unsigned const seed = 30605u;
  for (std::string const name : {"bigguy_osd_L2", "car_osd_L2", "teapot"}) {
    auto const scene = load_model(name);
    if (scene.empty()) {
      WARN(name << " is not at hand: skipped");
      continue;
    }
    std::mt19937 g(seed);
    struct family {
      ray_list outside;
      double least_cos;  // for `certified`
    };
    // Where patches meet, they and their normals differ by what their files are rounded to: no ray near both planes is
    // surely inside.
    for (auto const& [outside, least_cos] :
         {family{rays_from_outside(scene, 300, g), 1e-6}, family{rays_at_edges(scene, 300, g), 0.01}}) {
      auto const certified = look_inside(scene, outside, 60, accuracy::certified, least_cos, seed);
      auto const refined = look_inside(scene, outside, 60, accuracy::refined, 0.05, seed);
      CAPTURE(seed, name, least_cos, certified.rays, certified.leaks, refined.rays, refined.leaks);
      CHECK(certified.rays > 5000);
      CHECK(certified.rehits == 0);
      CHECK(certified.leaks == certified.open);
      CHECK(refined.rehits == 0);
      CHECK(refined.leaks == refined.open);
      if (name == "bigguy_osd_L2") CHECK(certified.leaks + refined.leaks == 0);  // the others have openings
    }
  }
}

TEST_CASE("rays that leave joins whose edges are up to 1e-6 diagonals apart meet neither side of the join") {
  unsigned const seed = 30606u;
  CAPTURE(seed);
  auto const between_patches = [](int k, std::mt19937& g) {
    double u = (1 + double(g() % 2)) / 3, v = k % 4 ? uniform(g, 0.01, 0.99) : (1 + double(g() % 2)) / 3;
    if (g() % 2) std::swap(u, v);
    return std::pair(u, v);
  };
  auto const at_t_junctions = [](int k, std::mt19937& g) {
    return std::pair(0.5, k % 4 ? uniform(g, 0.01, 0.99) : (1 + double(g() % 3)) / 4);
  };
  for (accuracy const level : {accuracy::refined, accuracy::certified}) {
    second_hit_limits const limits = level == accuracy::refined ? of_refined : of_certified;
    for (auto const& c : {leave_joins(cut_sheet, between_patches, level, limits, seed),
                          leave_joins(sheet_with_t_junctions, at_t_junctions, level, limits, seed)}) {
      CAPTURE(c.rays, c.nearby, c.seconds);
      CHECK(c.rays > 30000);
      CHECK(c.rehits == 0);
      CHECK(c.invented == 0);
      CHECK(c.lost == 0);
      CHECK(c.seconds > 20);
    }
  }
}
