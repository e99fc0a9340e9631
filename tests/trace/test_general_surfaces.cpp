// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/shapes/bezier_elevate.hpp>
#include <patchrt/shapes/nurbs.hpp>
#include <patchrt/shapes/revolution_patches.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <string>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr double eps = 2.2204460492503131e-16;

template <accuracy A, class Surface>
std::vector<patch_hit> trace_all(std::vector<Surface> const& scene, ray_list const& rays, int depth = -1) {
  mixed_hierarchy_options options;
  options.depth = depth;
  auto const h = build_mixed_hierarchy(std::span<Surface const>(scene), options, serial{});
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), hits, serial{});
  return hits;
}

/// Rays through and past the ball of radius 1 about the origin.
template <class Generator> ray_list ball_rays(int count, Generator& g) {
  ray_list rays;
  for (int k = 0; k < count; ++k) {
    vec3<double> const from = random_direction(g) * uniform(g, 1.5, 4), to = random_direction(g) * uniform(g, 0, 1.2);
    rays.push_back({from, to - from, 0, no_limit});
  }
  return rays;
}

/// The nearest t > 0 at which the ray meets the sphere, or infinity; and how far the discriminant is from 0.
double sphere_hit(ray<double> const& r, vec3<double> const& centre, double radius, double& grazing) {
  using real = long double;
  auto const at = [&](int c) { return real(r.origin[c]) - real(centre[c]); };
  real a = 0, b = 0, c = -real(radius) * real(radius);
  for (int k = 0; k < 3; ++k) {
    a += real(r.direction[k]) * real(r.direction[k]);
    b += real(r.direction[k]) * at(k);
    c += at(k) * at(k);
  }
  real const d = b * b - a * c;
  grazing = double(std::abs(d) / (a * real(radius) * real(radius)));
  if (d < 0) return no_limit;
  real const t = (-b - std::sqrt(d)) / a;
  return t > 0 ? double(t) : double((-b + std::sqrt(d)) / a);
}

template <accuracy A, class Surface>
void check_sphere(std::vector<Surface> const& scene, ray_list const& rays, double tolerance, int depth = -1) {
  auto const hits = trace_all<A>(scene, rays, depth);
  double worst = 0;
  int hit_count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    double grazing = 0;
    double const t = sphere_hit(rays[i], {0, 0, 0}, 1, grazing);
    if (grazing < 1e-2) continue;
    INFO("ray " << i << ": expected t = " << t << ", got " << hits[i].t);
    REQUIRE(hits[i].valid() == (t < no_limit));
    if (!hits[i].valid()) continue;
    ++hit_count;
    worst = std::max(worst, std::fabs(hits[i].t - t) * norm(rays[i].direction));
    auto const& p = scene[std::size_t(hits[i].patch)];
    vec3<double> const at = evaluate(p, hits[i].u, hits[i].v).position;
    REQUIRE(norm(at - (rays[i].origin + rays[i].direction * t)) <= double(hits[i].error) + 1e-15);
  }
  CAPTURE(worst);
  CHECK(hit_count > 500);
  CHECK(worst < tolerance);
}

template <class Surface> std::vector<Surface> as_list(auto const& array) { return {array.begin(), array.end()}; }

}  // namespace

TEST_CASE("rays meet a sphere of eight rational biquadratic patches where the quadric formula says") {
  unsigned const seed = 501;
  CAPTURE(seed);
  std::mt19937 g(seed);
  using surface = rational_patch<double, 2, 2>;
  auto const scene = as_list<surface>(sphere_patches(vec3<double>(0.0), 1.0));
  auto const rays = ball_rays(2000, g);
  check_sphere<accuracy::fast>(scene, rays, 2e-5);
  check_sphere<accuracy::refined>(scene, rays, 200 * eps);
  check_sphere<accuracy::certified>(scene, rays, 200 * eps);
  check_sphere<accuracy::certified>(scene, rays, 200 * eps, 0);
  check_sphere<accuracy::refined>(scene, rays, 200 * eps, 6);
  std::vector<rational_patch<double, 5, 4>> raised;
  for (auto const& p : scene) raised.push_back(elevate<5, 4>(p));
  check_sphere<accuracy::refined>(raised, rays, 200 * eps);
  check_sphere<accuracy::certified>(raised, rays, 200 * eps);
}

TEST_CASE("hits on tori, cones and cylinders are on the implicit surface, and certified") {
  unsigned const seed = 502;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const rays = ball_rays(3000, g);
  auto const check = [&](auto const& scene, bool is_closed, auto&& implicit) {
    using surface = typename std::decay_t<decltype(scene)>::value_type;
    auto const h = build_mixed_hierarchy(std::span<surface const>(scene), {}, serial{});
    std::vector<patch_hit> hits(rays.size());
    std::vector<certainty> certainties(rays.size());
    trace::certified_hits(h.view(), std::span<ray<double> const>(rays), hits, certainties, serial{});
    int hit_count = 0, certified = 0, missed = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      certified += certainties[i] == certainty::certified;
      auto const value = [&](double t) { return implicit(rays[i].origin + rays[i].direction * t); };
      if (hits[i].valid()) {
        ++hit_count;
        REQUIRE(std::fabs(value(hits[i].t)) < 100 * eps + 8 * double(hits[i].error));
      }
      if (!is_closed) continue;
      // No change of sign before the hit: what the implicit function sees at 400 places.
      double const end = hits[i].valid() ? hits[i].t * (1 - 1e-9) : 3;
      bool const starts_inside = value(0) < 0;
      for (int k = 1; k <= 400; ++k) missed += (value(end * k / 401) < 0) != starts_inside;
    }
    CAPTURE(hit_count, certified, missed);
    CHECK(hit_count > 500);
    CHECK(certified >= int(rays.size()) - 30);
    CHECK(missed == 0);
  };
  check(as_list<rational_patch<double, 2, 2>>(torus_patches(vec3<double>(0.0), 0.7, 0.25)), true,
        [](vec3<double> const& p) { return std::hypot(std::hypot(p.x, p.y) - 0.7, p.z) - 0.25; });
  check(as_list<rational_patch<double, 2, 1>>(cylinder_patches(vec3<double>(0.0), 0.6, 0.8)), false,
        [](vec3<double> const& p) { return std::hypot(p.x, p.y) - 0.6; });
  check(as_list<rational_patch<double, 2, 1>>(cone_patches(vec3<double>(0.0), 0.7, 0.9)), false,
        [](vec3<double> const& p) { return std::hypot(p.x, p.y) - 0.7 * (1 - p.z / 0.9); });
}

TEST_CASE("a bicubic patch, raised to higher degrees or given equal weights, is hit where it was") {
  unsigned const seed = 503;
  CAPTURE(seed);
  std::mt19937 g(seed);
  patch_list scene;
  for (int k = 0; k < 6; ++k) {
    scene.push_back(k % 2 ? random_patch<double>(g) : random_sheet(g, 0.4));
    for (auto& c : scene.back().control_points) c += vec3<double>(k % 3, k / 3, 0.);
  }
  auto const rays = chords(scene, 3000, g);
  auto const wanted = trace_all<accuracy::certified>(scene, rays);
  std::vector<bezier_patch<double, 4, 5>> raised;
  std::vector<rational_patch<double, 3, 3>> rational;
  for (auto const& p : scene) {
    raised.push_back(elevate<4, 5>(p));
    rational.push_back(make_rational(p));
    for (auto& c : rational.back().control_points) c.weight = 3;
  }
  auto const check = [&](std::vector<patch_hit> const& hits) {
    int different = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i].valid() != wanted[i].valid()) ++different;
      else if (hits[i].valid() && std::fabs(hits[i].t - wanted[i].t) * norm(rays[i].direction) >
                                      2 * double(hits[i].error) + 2 * double(wanted[i].error))
        ++different;
    }
    return different;
  };
  CHECK(check(trace_all<accuracy::certified>(raised, rays)) == 0);
  CHECK(check(trace_all<accuracy::certified>(rational, rays)) == 0);
  CHECK(check(trace_all<accuracy::refined>(raised, rays)) == 0);
  CHECK(check(trace_all<accuracy::refined>(rational, rays)) == 0);
}

TEST_CASE("a bilinear patch is hit where its raised bicubic is") {
  unsigned const seed = 504;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::vector<bezier_patch<double, 1, 1>> scene;
  patch_list raised;
  for (int k = 0; k < 8; ++k) {
    scene.push_back(random_patch<double, 1, 1>(g));
    raised.push_back(elevate<3, 3>(scene.back()));
  }
  auto const rays = chords(raised, 3000, g);
  auto const hits = trace_all<accuracy::certified>(scene, rays), wanted = trace_all<accuracy::certified>(raised, rays);
  int hit_count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    REQUIRE(hits[i].valid() == wanted[i].valid());
    if (!hits[i].valid()) continue;
    ++hit_count;
    REQUIRE(std::fabs(hits[i].t - wanted[i].t) * norm(rays[i].direction) <=
            2 * double(hits[i].error) + 2 * double(wanted[i].error));
  }
  CHECK(hit_count > 1000);
}

TEST_CASE("a NURBS sphere, cut into Bezier patches, is hit where the quadric formula says") {
  unsigned const seed = 505;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double const h = std::sqrt(0.5);
  // Piegl & Tiller, The NURBS Book, 2nd ed., section 7.5: the circle of nine points, here turned about z.
  double const circle[9][3] = {{1, 0, 1},   {1, 1, h},  {0, 1, 1},  {-1, 1, h}, {-1, 0, 1},
                               {-1, -1, h}, {0, -1, 1}, {1, -1, h}, {1, 0, 1}};
  double const meridian[5][3] = {
      {0, -1, 1}, {1, -1, h}, {1, 0, 1}, {1, 1, h}, {0, 1, 1}};  // distance from the axis, z, weight
  nurbs_surface s;
  s.degree_u = s.degree_v = 2;
  s.count_u = 9;
  s.count_v = 5;
  s.knots_u = {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4};
  s.knots_v = {0, 0, 0, 1, 1, 2, 2, 2};
  for (auto const& c : circle)
    for (auto const& m : meridian) {
      s.control_points.push_back({m[0] * c[0], m[0] * c[1], m[1]});
      s.weights.push_back(m[2] * c[2]);
    }
  std::vector<rational_patch<double, 2, 2>> scene;
  for (auto const& piece : bezier_pieces<2, 2>(s)) scene.push_back(piece.patch);
  REQUIRE(scene.size() == 8);
  check_sphere<accuracy::certified>(scene, ball_rays(2000, g), 200 * eps);
}

TEST_CASE("weights that are not positive numbers are refused, naming patch and control point") {
  std::vector<rational_patch<double, 2, 2>> scene =
      as_list<rational_patch<double, 2, 2>>(sphere_patches(vec3<double>(0.0), 1.0));
  for (double const bad : {0., -1., no_limit, std::numeric_limits<double>::quiet_NaN(), 1e-300}) {
    auto broken = scene;
    broken[3].control_points[4].weight = bad;
    CAPTURE(bad);
    CHECK_THROWS_WITH(build_mixed_hierarchy(std::span<rational_patch<double, 2, 2> const>(broken), {}, serial{}),
                      contains_text("patch 3, control point 4"));
  }
}
