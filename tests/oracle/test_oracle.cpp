// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/oracle.hpp"
#include "support/patches.hpp"

#include <cmath>
#include <limits>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Integers in [-512, 512] as control points, a quarter of which are at (i, j, 0) x 128: all arithmetic below is exact.
oracle_patch small_integers(std::mt19937& g, bool sheet) {
  std::uniform_int_distribution<int> d(-512, 512), bump(-96, 96);
  oracle_patch p;
  for (std::size_t k = 0; k < 48; ++k) {
    int const base = k % 3 == 0 ? int(k / 12) * 128 : k % 3 == 1 ? int(k / 3 % 4) * 128 : 0;
    p[k] = sheet ? base + bump(g) : d(g);
  }
  return p;
}

/// The point at u = a/16, v = b/16, exact in double for small integers: sums of products of at most 10 + 12 + 12 bits.
std::array<double, 3> exact_point(oracle_patch const& p, int a, int b) {
  double const wu[4] = {std::pow(16 - a, 3), 3. * a * (16 - a) * (16 - a), 3. * a * a * (16 - a), std::pow(a, 3)};
  double const wv[4] = {std::pow(16 - b, 3), 3. * b * (16 - b) * (16 - b), 3. * b * b * (16 - b), std::pow(b, 3)};
  std::array<double, 3> q{};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      for (std::size_t c = 0; c < 3; ++c) q[c] += wu[i] * wv[j] * p[3 * (4 * i + j) + c];
    }
  }
  for (double& x : q) x = std::ldexp(x, -24);
  return q;
}

/// Crossings of the ray with a grid of n x n pairs of triangles of the patch.
int count_by_triangles(oracle_patch const& patch, oracle_ray const& ray, int n) {
  auto const p = make_patch<double>(patch);
  vec3<double> const o{ray[0], ray[1], ray[2]}, d{ray[3], ray[4], ray[5]};
  vec3<double> const a = std::abs(d.x) < std::abs(d.y) ? vec3<double>{0, -d.z, d.y} : vec3<double>{-d.z, 0, d.x};
  vec3<double> const b = cross(d, a);
  std::vector<std::array<double, 2>> f;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      vec3<double> const q = evaluate(p, double(i) / n, double(j) / n).position - o;
      f.push_back({dot(a, q), dot(b, q)});
    }
  }
  auto const left = [](std::array<double, 2> s, std::array<double, 2> e) { return s[0] * e[1] - s[1] * e[0] > 0; };
  auto const holds = [&](std::array<double, 2> x, std::array<double, 2> y, std::array<double, 2> z) {
    return left(x, y) == left(y, z) && left(y, z) == left(z, x);
  };
  int count = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      std::size_t const k = std::size_t(i * (n + 1) + j), m = k + std::size_t(n) + 1;
      count += holds(f[k], f[m], f[k + 1]) + holds(f[m + 1], f[k + 1], f[m]);
    }
  }
  return count;
}

}  // namespace

TEST_CASE("the oracle finds the root that a ray was built through, to the last bits") {
  unsigned const seed = 20261122;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_int_distribution<int> parameter(1, 15), direction(-64, 64), distance(1, 16);
  int built = 0;
  long double worst_t = 0, worst_uv = 0;
  for (int n = 0; n < 2000; ++n) {
    oracle_patch const p = small_integers(g, n % 2 == 0);
    int const a = parameter(g), b = parameter(g), t = distance(g);
    auto const q = exact_point(p, a, b);
    oracle_ray r{0, 0, 0, double(direction(g)), double(direction(g)), double(direction(g)), 0, infinity};
    for (std::size_t c = 0; c < 3; ++c) r[c] = q[c] - t * r[3 + c];
    if (r[3] == 0 && r[4] == 0 && r[5] == 0) continue;
    auto const hits = oracle_all_hits(std::span(&p, 1), r);
    oracle_root const* nearest = nullptr;
    for (oracle_root const& h : hits) {
      if (!nearest ||
          std::hypot(h.u - a / 16.L, h.v - b / 16.L) < std::hypot(nearest->u - a / 16.L, nearest->v - b / 16.L))
        nearest = &h;
    }
    CAPTURE(n, a, b, t);
    REQUIRE(nearest);
    if (!nearest->is_certain()) continue;
    ++built;
    worst_t = std::max(worst_t, std::abs(nearest->t / t - 1));
    worst_uv = std::max({worst_uv, std::abs(nearest->u - a / 16.L), std::abs(nearest->v - b / 16.L)});
  }
  CHECK(built > 1900);
  CHECK(worst_t <= 2 * std::numeric_limits<long double>::epsilon());
  CHECK(worst_uv <= std::numeric_limits<long double>::epsilon());
}

TEST_CASE("the oracle's roots lie on the ray and on the patch, each reported once, in order") {
  unsigned const seed = 5;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  std::vector<oracle_patch> patches;
  for (int k = 0; k < 20; ++k) patches.push_back(numbers_of(random_patch<double>(g)));
  oracle const all(patches);
  std::size_t most = 0;
  for (int n = 0; n < 300; ++n) {
    oracle_ray r;
    for (std::size_t c = 0; c < 3; ++c) {
      r[3 + c] = d(g);
      r[c] = d(g) - 2 * r[3 + c];
    }
    r[6] = 0;
    r[7] = infinity;
    auto const hits = all.all_hits(r);
    for (std::size_t k = 0; k < hits.size(); ++k) {
      oracle_root const& h = hits[k];
      if (k > 0) REQUIRE(hits[k - 1].t <= h.t);
      if (h.singular) continue;
      REQUIRE(all.distance(h.patch, r, h.t, h.u, h.v) < 1e-17L);
      for (std::size_t m = 0; m < k; ++m) {
        bool const same = hits[m].patch == h.patch && std::hypot(hits[m].u - h.u, hits[m].v - h.v) < 1e-12L;
        REQUIRE(!same);
      }
    }
    std::size_t per_patch = 0;
    for (oracle_root const& h : hits) per_patch += h.patch == 0;
    most = std::max(most, per_patch);
  }
  CHECK(most >= 2);
}

TEST_CASE("the oracle counts as many hits as fine triangles do, away from silhouettes and edges") {
  unsigned const seed = 11;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  int compared = 0, hit = 0, several = 0;
  for (int n = 0; n < 1500; ++n) {
    oracle_patch const p = numbers_of(n % 3 == 0 ? random_patch<double>(g) : random_sheet(g, n % 3 == 1 ? 0.1 : 0.6));
    oracle_ray r;
    double const middle = n % 3 == 0 ? 0 : 0.5;
    for (std::size_t c = 0; c < 3; ++c) {
      r[3 + c] = d(g);
      r[c] = middle * (c < 2) + 0.4 * d(g) - 9 * r[3 + c];
    }
    r[6] = -infinity;
    r[7] = infinity;
    // Rays within the triangles' error of an edge or a fold may differ: roots that come or go when the ray is moved a little.
    bool stable = true;
    std::size_t const count = oracle_all_hits(std::span(&p, 1), r).size();
    for (int m = 0; m < 6; ++m) {
      oracle_ray moved = r;
      moved[std::size_t(m / 2)] += m % 2 ? 0.02 : -0.02;
      stable = stable && oracle_all_hits(std::span(&p, 1), moved).size() == count;
    }
    if (!stable) continue;
    ++compared;
    hit += count > 0;
    several += count > 1;
    CAPTURE(n);
    REQUIRE(count_by_triangles(p, r, 128) == int(count));
  }
  CAPTURE(compared, hit, several);
  CHECK(compared > 900);
  CHECK(hit > 400);
  CHECK(several > 50);
}

TEST_CASE("the oracle agrees with the closed form of a bilinear patch in a plane") {
  // Q = (4u, 4v, u + 2v) as a bicubic; the ray x = o + t d meets z = x/4 + y/2.
  oracle_patch p;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      std::size_t const k = 3 * (4 * i + j);
      double const u = double(i), v = double(j);  // times 3: no rounding
      p[k] = 4 * u;
      p[k + 1] = 4 * v;
      p[k + 2] = u + 2 * v;
    }
  }
  std::mt19937 g(3);
  std::uniform_real_distribution<double> d(-1, 1);
  int hits = 0;
  for (int n = 0; n < 2000; ++n) {
    oracle_ray const r{12 * (d(g) + 0.5), 12 * (d(g) + 0.5), 20, d(g), d(g), -1 + 0.5 * d(g), 0, infinity};
    using real = long double;
    real const t = (r[0] / real(4) + r[1] / real(2) - r[2]) / (real(r[5]) - r[3] / real(4) - r[4] / real(2));
    real const u = (r[0] + t * r[3]) / 12, v = (r[1] + t * r[4]) / 12;
    real const edge = std::min(std::min(u, 1 - u), std::min(v, 1 - v));
    auto const found = oracle_all_hits(std::span(&p, 1), r);
    CAPTURE(n);
    if (edge < -1e-8L || t < 0) {
      REQUIRE(found.empty());
      continue;
    }
    REQUIRE(found.size() == 1);
    REQUIRE(std::abs(found[0].t - t) < 1e-17L * t);
    REQUIRE(std::abs(found[0].u - u) < 1e-17L);
    REQUIRE(std::abs(found[0].v - v) < 1e-17L);
    ++hits;
  }
  CHECK(hits > 200);
}

TEST_CASE("the oracle keeps to the range of t and to the patch, and says what lies just outside") {
  std::mt19937 g(1);
  oracle_patch const p = numbers_of(random_sheet(g, 0.0));  // the unit square in z = 0
  auto const hits = [&p](double x, double z_min, double z_max) {
    return oracle_all_hits(std::span(&p, 1), {x, 0.5, -2, 0, 0, 1, z_min, z_max});
  };
  CHECK(hits(0.25, 0, 4).size() == 1);
  CHECK(hits(0.25, 0, 1.99).empty());
  CHECK(hits(0.25, 2.01, 4).empty());
  CHECK(hits(-1e-6, 0, 4).empty());
  auto const outside = hits(-1e-12, 0, 4);
  REQUIRE(outside.size() == 1);
  CHECK(outside[0].edge_distance == Approx(-1e-12));
  CHECK_FALSE(outside[0].is_certain());
  auto const end = hits(0.25, 2, 4);
  REQUIRE(end.size() == 1);
  CHECK(end[0].end_distance == 0);
  CHECK_FALSE(end[0].is_certain());
}

TEST_CASE("the oracle names tangencies, edge-on patches and degenerate points singular, and stops") {
  std::mt19937 g(2);
  SECTION("a ray that grazes a fold") {
    oracle_patch p = numbers_of(random_sheet(g, 0.0));
    for (std::size_t i = 0; i < 4; ++i) {  // z = u (1 - u) in four equal columns
      for (std::size_t j = 0; j < 4; ++j) p[3 * (4 * i + j) + 2] = i == 1 || i == 2 ? 1 / 4. : 0;
    }
    double const top = 3 / 16.;
    auto const at = [&p](double z) { return oracle_all_hits(std::span(&p, 1), {-1, 0.5, z, 1, 0, 0, 0, infinity}); };
    CHECK(at(top + 1e-12).empty());
    CHECK(at(top - 1e-6).size() == 2);
    CHECK(at(top - 1e-12).size() == 2);
    auto const touch = at(top);
    REQUIRE(touch.size() == 1);
    CHECK(touch[0].singular);
    CHECK(std::abs(touch[0].t - 1.5L) <= touch[0].slack);
    CHECK(touch[0].slack < 1e-6L);
  }
  SECTION("a flat patch seen edge-on along a diagonal") {
    oracle_patch const p = numbers_of(random_sheet(g, 0.0));
    auto const hits = oracle_all_hits(std::span(&p, 1), {-1, -0.9, 0, 1, 1.1, 0, 0, infinity});
    REQUIRE_FALSE(hits.empty());
    for (oracle_root const& h : hits) CHECK(h.singular);
  }
  SECTION("a ray through a collapsed edge") {
    oracle_patch p = numbers_of(random_sheet(g, 0.3));
    for (std::size_t k = 0; k < 48; k += 3) {
      if (k % 12 == 0) p[k] = p[k + 1] = p[k + 2] = 0.5;
    }
    auto const hits = oracle_all_hits(std::span(&p, 1), {0.5, 0.5, -1.5, 0, 0, 1, 0, infinity});
    bool pole = false;
    for (oracle_root const& h : hits) pole = pole || (h.singular && std::abs(h.t - 2) < 1e-12L && h.slack < 1e-12L);
    CHECK(pole);
  }
  SECTION("a patch collapsed to a point or a line") {
    oracle_patch p;
    p.fill(0.5);
    auto const hits = oracle_all_hits(std::span(&p, 1), {0.5, 0.5, -1.5, 0, 0, 1, 0, infinity});
    REQUIRE(hits.size() == 1);
    CHECK(hits[0].singular);
    CHECK(hits[0].t == 2);
    CHECK(oracle_all_hits(std::span(&p, 1), {0.5, 0.4, -1.5, 0, 0, 1, 0, infinity}).empty());
    for (std::size_t k = 0; k < 48; k += 3) p[k] = double(k) / 45;
    CHECK(oracle_all_hits(std::span(&p, 1), {0.4, 0.4, -1.5, 0, 0, 1, 0, infinity}).empty());
    for (oracle_root const& h : oracle_all_hits(std::span(&p, 1), {0.4, 0.5, -1.5, 0, 0, 1, 0, infinity})) {
      CHECK(h.singular);
      CHECK(std::abs(h.t - 2) <= h.slack + 1e-12L);
    }
  }
}

TEST_CASE("the oracle returns nothing for rays that are no rays") {
  std::mt19937 g(1);
  oracle_patch const p = numbers_of(random_sheet(g, 0.1));
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(oracle_all_hits(std::span(&p, 1), {0.5, 0.5, -2, 0, 0, 0, 0, infinity}).empty());
  CHECK(oracle_all_hits(std::span(&p, 1), {0.5, 0.5, nan, 0, 0, 1, 0, infinity}).empty());
  CHECK(oracle_all_hits(std::span(&p, 1), {0.5, 0.5, -2, 0, 0, infinity, 0, infinity}).empty());
  CHECK(oracle_all_hits(std::span(&p, 1), {0.5, 0.5, -2, 0, 0, 1, nan, infinity}).empty());
  CHECK(oracle_all_hits(std::span(&p, 1), {0.5, 0.5, -2, 0, 0, 1, 4, 0}).empty());
}

TEST_CASE("the oracle does not depend on the ray's distance or scale") {
  unsigned const seed = 8;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_int_distribution<int> d(-1000, 1000);
  auto const patches = read_patches(project_data("teapot.bpt"));
  oracle const teapot(patches);
  int hits = 0;
  for (int n = 0; n < 200; ++n) {
    oracle_ray r{d(g) / 512., d(g) / 512., d(g) / 512. + 1.5, d(g) / 512.,
                 d(g) / 512., d(g) / 512., -infinity,         infinity};
    auto const near = teapot.all_hits(r);
    oracle_ray far = r;
    for (std::size_t c = 0; c < 3; ++c) {
      far[c] -= 1048576 * r[3 + c];
      far[3 + c] = 1024 * r[3 + c];
    }
    auto const found = teapot.all_hits(far);
    CAPTURE(n);
    REQUIRE(found.size() == near.size());
    for (std::size_t k = 0; k < near.size(); ++k) {
      if (!near[k].is_certain() || found[k].patch != near[k].patch) continue;
      REQUIRE(std::abs(1024 * (found[k].t - 1024) - near[k].t) < 1e-12L);  // a far t has 2^20 times the ulp
      REQUIRE(std::abs(found[k].u - near[k].u) < 1e-18L);
      ++hits;
    }
  }
  CHECK(hits > 150);
}
