// SPDX-License-Identifier: MIT
#include <support/catch.hpp>
#include <support/rays.hpp>
#include <support/torus.hpp>

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/shapes/revolution_patches.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;
using patchrt::examples::bounds;
using patchrt::examples::crossings;
using patchrt::examples::intersect;
using patchrt::examples::torus;

namespace {

/// (rho - major)^2 + z^2 - minor^2 in more digits.
long double level(torus const& s, ray<double> const& r, long double t) {
  long double x[3], z = 0, square = 0;
  for (int k = 0; k < 3; ++k) {
    x[k] = static_cast<long double>(r.origin[k]) - s.centre[k] + t * r.direction[k];
    z += x[k] * s.axis[k];
    square += x[k] * x[k];
  }
  long double const rho = std::sqrt(square - z * z) - s.major;
  return rho * rho + z * z - static_cast<long double>(s.minor) * s.minor;
}

/// Where the line through a torus's ball crosses it: changes of sign of `level` on a fine grid, halved until they end.
std::vector<long double> crossings_by_steps(torus const& s, ray<double> const& r, int steps) {
  double const speed = std::sqrt(dot(r.direction, r.direction));
  long double const middle = -dot(r.origin - s.centre, r.direction) / (speed * speed),
                    reach = (s.major + s.minor) / speed;
  std::vector<long double> all;
  for (int k = 0; k < steps; ++k) {
    long double lo = middle + reach * (2.L * k / steps - 1), hi = middle + reach * (2.L * (k + 1) / steps - 1);
    bool const inside = level(s, r, lo) < 0;
    if (inside == (level(s, r, hi) < 0)) continue;
    for (int n = 0; n < 80; ++n) {
      long double const half = (lo + hi) / 2;
      ((level(s, r, half) < 0) == inside ? lo : hi) = half;
    }
    all.push_back(lo);
  }
  return all;
}

template <class Generator> torus random_torus(Generator& g) {
  double const major = std::pow(10., uniform(g, -3, 3)), minor = major * uniform(g, 0.02, 0.98);
  vec3<double> const axis = random_direction(g);
  return {random_direction(g) * (major * uniform(g, 0, 5)), axis, major, minor};
}

}  // namespace

TEST_CASE("rays through a torus along its axes cross it where circles say") {
  torus const s{{1, 2, 3}, {0, 0, 1}, 2, 0.5};
  auto const check = [&](vec3<double> const& o, vec3<double> const& d, std::vector<double> const& wanted) {
    auto const all = crossings({s.centre + o, d, 0, 100}, s);
    REQUIRE(all.count == int(wanted.size()));
    for (int k = 0; k < all.count; ++k) CHECK(all.t[k] == Approx(wanted[std::size_t(k)]).epsilon(1e-14));
  };
  check({-10, 0, 0}, {1, 0, 0}, {7.5, 8.5, 11.5, 12.5});
  check({-10, 0, 0}, {0, 1, 0}, {});
  check({2, 0, 5}, {0, 0, -1}, {4.5, 5.5});
  check({0, -2, 5}, {0, 0, -2}, {2.25, 2.75});
  check({0, 0, 5}, {0, 0, -1}, {});  // through the hole
  check({-10, 0, 0.3}, {1, 0, 0}, {7.6, 8.4, 11.6, 12.4});
  check({-10, 2, 0}, {1, 0, 0}, {8.5, 11.5});  // past the hole: |y| = 2 crosses the outer circle of 2.5
  check({0, 0, 0}, {0, 1, 0}, {-2.5, -1.5, 1.5, 2.5});
  check({1e6, 0, 0}, {-1, 0, 0}, {1e6 - 2.5, 1e6 - 1.5, 1e6 + 1.5, 1e6 + 2.5});
}

TEST_CASE("all crossings of a torus are found, each within 1e-12 of its size where rays do not graze") {
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  int counts[5] = {}, different = 0;
  double worst = 0;
  for (int n = 0; n < 4000; ++n) {
    CAPTURE(n);
    torus const s = random_torus(g);
    double const size = s.major + s.minor, far = std::pow(10., uniform(g, 0, 4));
    vec3<double> const away = random_direction(g) * (size * far);
    vec3<double> const aim = s.centre + random_direction(g) * (size * uniform(g));
    ray<double> const r{aim + away, away * (-uniform(g, 0.1, 2) / size), 0, 1e30};
    auto const got = crossings(r, s);
    auto const wanted = crossings_by_steps(s, r, 2000);
    if (got.count != int(wanted.size())) {  // two within a step of each other, or rounding at a tangent
      ++different;
      continue;
    }
    ++counts[got.count];
    double const speed = std::sqrt(dot(r.direction, r.direction));
    for (int k = 0; k < got.count; ++k) {
      long double const t = wanted[std::size_t(k)], h = 1e-4L * s.minor / speed;
      long double const slope = (level(s, r, t + h) - level(s, r, t - h)) / (2 * h * speed * s.minor);
      if (std::fabs(slope) < 0.2L) continue;
      worst = std::max(worst, static_cast<double>(std::fabs(got.t[k] - t) / (std::fabs(t) + size / speed)));
    }
  }
  CAPTURE(worst, different);
  CHECK(worst < 1e-12);
  CHECK(different < 10);
  CHECK((counts[0] > 100 && counts[2] > 1000 && counts[4] > 300));
  CHECK((counts[1] == 0 && counts[3] == 0));
}

TEST_CASE("a ray's hit on a torus is the first in its range, with the outward normal, and NaN and no direction miss") {
  torus const s{{0, 0, 0}, {0, 0, 1}, 2, 0.5};
  double const nan = std::numeric_limits<double>::quiet_NaN();
  auto const hit = intersect(ray<double>{{-10, 0, 0}, {1, 0, 0}, 7.75, 100}, s);
  CHECK(hit.valid);
  CHECK(hit.t == Approx(8.5));
  CHECK(hit.normal.x == Approx(1));
  CHECK(intersect(ray<double>{{-10, 0, 0}, {1, 0, 0}, 0, 100}, s).normal.x == Approx(-1));
  CHECK_FALSE(intersect(ray<double>{{-10, 0, 0}, {1, 0, 0}, 0, 7}, s).valid);
  CHECK_FALSE(intersect(ray<double>{{-10, 0, 0}, {1, 0, 0}, 13, 100}, s).valid);
  CHECK_FALSE(intersect(ray<double>{{-10, 0, 0}, {0, 0, 0}, 0, 100}, s).valid);
  CHECK_FALSE(intersect(ray<double>{{nan, 0, 0}, {1, 0, 0}, 0, 100}, s).valid);
  CHECK_FALSE(intersect(ray<double>{{-10, 0, 0}, {1, nan, 0}, 0, 100}, s).valid);
  CHECK_FALSE(intersect(ray<double>{{-10, 0, 0}, {1, 0, 0}, nan, 100}, s).valid);
}

TEST_CASE("the box of a torus holds it, and each side touches it") {
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  for (int n = 0; n < 200; ++n) {
    torus const s = random_torus(g);
    box<double> const b = bounds(s);
    for (int k = 0; k < 3; ++k) {
      // the point of the torus that is farthest along axis k: out from the middle circle's farthest point
      vec3<double> e{0, 0, 0};
      e[k] = 1;
      vec3<double> const flat = e - s.axis * dot(e, s.axis),
                         top = s.centre + flat * (s.major / std::sqrt(dot(flat, flat))) + e * s.minor;
      CHECK(top[k] <= b.hi[k]);
      CHECK(b.hi[k] - top[k] < 1e-14 * (s.major + s.minor + std::fabs(s.centre[k])));
      CHECK(b.hi[k] - s.centre[k] == Approx(s.centre[k] - b.lo[k]));
    }
  }
}

TEST_CASE("the torus has the hits of its rational patches, certified") {
  unsigned const seed = 3;
  CAPTURE(seed);
  std::mt19937_64 g(seed);
  vec3<double> const centre{0.5, -1, 2};
  torus const s{centre, {0, 0, 1}, 2, 0.75};
  auto const quarters = torus_patches(centre, s.major, s.minor);
  std::vector<rational_patch<double, 2, 2>> const patches(quarters.begin(), quarters.end());
  auto const hierarchy = build_mixed_hierarchy(std::span<rational_patch<double, 2, 2> const>(patches), {}, serial{});
  std::vector<ray<double>> rays;
  for (int n = 0; n < 4000; ++n) {
    vec3<double> const aim = centre + random_direction(g) * (3 * uniform(g)), away = random_direction(g) * 10.;
    rays.push_back({aim + away, -away, 0, 1e30});
  }
  std::vector<patch_hit> hits(rays.size());
  std::vector<certainty> proved(rays.size());
  trace::certified_hits(hierarchy.view(), std::span<ray<double> const>(rays), std::span(hits), std::span(proved),
                        serial{});
  int compared = 0, different = 0;
  double worst = 0;
  for (std::size_t n = 0; n < rays.size(); ++n) {
    if (proved[n] != certainty::certified) continue;
    auto const hit = intersect(rays[n], s);
    ++compared;
    if (hit.valid != hits[n].valid()) {
      ++different;
      continue;
    }
    if (hit.valid && std::fabs(dot(hit.normal, rays[n].direction)) > 0.5)
      worst = std::max(worst, std::fabs(hit.t - hits[n].t));
  }
  CAPTURE(compared, different, worst);
  CHECK(compared > 3900);
  CHECK(different == 0);
  CHECK(worst < 1e-13);
}
