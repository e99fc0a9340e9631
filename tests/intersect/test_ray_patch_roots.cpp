// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/oracle.hpp"
#include "support/rays.hpp"

#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/intersect/reference_root.hpp>
#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using real = long double;
edge_gaps const no_gaps;
constexpr double eps = std::numeric_limits<double>::epsilon();

double largest_coordinate(bicubic_patch<double> const& p) {
  double m = 0;
  for (auto const& c : p.control_points) m = std::max({m, std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)});
  return m;
}

/// A ray that meets a patch, and where: by the oracle.
struct known_root {
  bicubic_patch<double> patch;
  ray<double> line;
  oracle_root root;
  double size;
  vec3<double> du, dv;

  /// An epsilon of (patch size + |origin|) over the cosine between ray and normal.
  double unit() const {
    vec3<double> const& o = line.origin;
    return eps * (size + std::fabs(o.x) + std::fabs(o.y) + std::fabs(o.z)) / root.cos_angle;
  }
  patch_root<double> start(double off_u, double off_v) const {
    return {0, double(root.u) + off_u, double(root.v) + off_v, 0, true};
  }
  /// How far the surface points of two (u, v) near the root are apart, along the tangents.
  double error_in_space(patch_root<double> const& r) const {
    return norm(du * double(real(r.u) - root.u) + dv * double(real(r.v) - root.v));
  }
  double error_along(patch_root<double> const& r) const {
    return double(std::abs(real(r.t) - root.t)) * norm(line.direction);
  }
};

/// Rays through bumpy sheets, some nearly tangent to them, from nearby and from afar, and their regular roots well
/// within the patch.
template <class Generator> std::vector<known_root> make_roots(Generator& g, int count, double least_cos) {
  std::vector<known_root> all;
  while (int(all.size()) < count) {
    known_root k;
    k.patch = random_sheet(g, uniform(g, 0.02, 0.4));
    double const scale = std::ldexp(1, int(g() % 21) - 10);
    for (auto& c : k.patch.control_points) c *= scale;
    k.size = largest_coordinate(k.patch);
    auto const s = evaluate(k.patch, uniform(g, 0.01, 0.99), uniform(g, 0.01, 0.99));
    vec3<double> const normal = cross(s.du, s.dv) / norm(cross(s.du, s.dv));
    vec3<double> const tangent = cross(normal, random_direction(g));
    double const cosine = std::pow(least_cos, uniform(g));
    double const reach = k.size * std::pow(10, uniform(g, -1, 3)), length = std::pow(10, uniform(g, -2, 2));
    vec3<double> const way = tangent / norm(tangent) * std::sqrt(1 - cosine * cosine) + normal * cosine;
    k.line = {s.position - way * reach, way * length, -no_limit, no_limit};
    std::vector<oracle_patch> const patches{numbers_of(k.patch)};
    for (oracle_root const& r : oracle_all_hits(patches, numbers_of(k.line))) {
      if (r.singular || r.cos_angle < 0.5 * least_cos || r.jacobian < 0.05 * r.cos_angle) continue;
      if (!(r.edge_distance > 1e-6 * k.size)) continue;
      k.root = r;
      auto const at = evaluate(k.patch, double(r.u), double(r.v));
      k.du = at.du;
      k.dv = at.dv;
      all.push_back(k);
    }
  }
  return all;
}

/// Control points that are small integers: points at sixteenths of the parameters are exact, and so are rays to them.
template <class Generator> bicubic_patch<double> integer_sheet(Generator& g) {
  bicubic_patch<double> p;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) p(i, j) = {128. * i + double(g() % 64), 128. * j + double(g() % 64), double(g() % 128)};
  }
  return p;
}

template <class Generator> double small_integer(Generator& g) { return double(int(g() % 65) - 32); }

bool is_same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// z = (x^2 + y^2) / 2 over [-1, 1]^2, in Bernstein form.
bicubic_patch<double> bowl() {
  double const square[4] = {1, -1. / 3, -1. / 3, 1};
  bicubic_patch<double> p;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) p(i, j) = {2. * i / 3 - 1, 2. * j / 3 - 1, (square[i] + square[j]) / 2};
  }
  return p;
}

}  // namespace

TEST_CASE("corrected roots are within 2 epsilon of (patch size + |origin|) over the cosine") {
  unsigned const seed = 350;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst_in_space = 0, worst_along = 0, worst_again = 0, loosest = 0;
  int valid = 0, grazing = 0;
  auto const roots = make_roots(g, 4000, 1e-3);
  for (known_root const& k : roots) {
    // What the search in float leaves, and more: nearer the tangent it leaves less of Newton's reach.
    double const off = std::min(1e-3, 0.02 * k.root.cos_angle);
    auto r = k.start(uniform(g, -off, off), uniform(g, -off, off));
    correct(k.patch, k.size, no_gaps, k.line.origin, k.line.direction, r);
    valid += r.valid;
    grazing += k.root.cos_angle < 0.01;
    worst_in_space = std::max(worst_in_space, k.error_in_space(r) / k.unit());
    worst_along = std::max(worst_along, k.error_along(r) / k.unit());
    // From there on there is nothing to correct.
    auto again = r;
    correct(k.patch, k.size, no_gaps, k.line.origin, k.line.direction, again);
    worst_again = std::max(worst_again, norm(k.du * (again.u - r.u) + k.dv * (again.v - r.v)) / k.unit());
    REQUIRE(k.error_in_space(r) <= r.error);
    loosest = std::max(loosest, r.error / k.unit());
  }
  CAPTURE(worst_in_space, worst_along, worst_again, loosest, grazing);
  CHECK(valid == int(roots.size()));
  CHECK(worst_in_space <= 2);
  CHECK(worst_along <= 2);
  CHECK(worst_in_space > 0.1);
  CHECK(worst_again <= 2);
  CHECK(loosest <= 300);
  CHECK(grazing > 500);
}

TEST_CASE(
    "the chord method settles what the search leaves within the same bound, and never settles for what is no root") {
  unsigned const seed = 351;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst_in_space = 0, worst_along = 0, worst_of_error = 0;
  int settled = 0, poor = 0;
  auto const roots = make_roots(g, 4000, 1e-3);
  for (known_root const& k : roots) {
    auto const power = to_power(k.patch);
    vec3<double> const sums = coefficient_sum(power);
    double const rounding = 16 * eps * (sums.x + sums.y + sums.z);
    vec3<double> const direction = k.line.direction * (1 / norm(k.line.direction));
    bool const from_float = g() % 4 != 0;
    double const off = from_float ? 2e-7 : 0.05;
    double const x = 2 * double(k.root.u) - 1 + uniform(g, -off, off);
    double const y = 2 * double(k.root.v) - 1 + uniform(g, -off, off);
    auto const p = evaluate(power, float(x), float(y));
    chord_rows<float> const rows = make_chord_rows(p, vec3<float>(direction));
    chord_rows<double> const wide{vec3<double>(rows.x), vec3<double>(rows.y), vec3<double>(rows.t), rows.per_cosine};
    patch_root<double> r;
    if (!correct_by_chords(power, rounding, wide, 1., x, y, k.line.origin, direction, 1 / dot(direction, direction), r)
             .settled) {
      poor += from_float && k.root.cos_angle > 0.1;
      continue;
    }
    ++settled;
    r.t /= norm(k.line.direction);
    worst_in_space = std::max(worst_in_space, k.error_in_space(r) / k.unit());
    worst_along = std::max(worst_along, k.error_along(r) / k.unit());
    worst_of_error = std::max(worst_of_error, k.error_in_space(r) / r.error);
  }
  CAPTURE(worst_in_space, worst_along, worst_of_error, settled, poor);
  CHECK(worst_in_space <= 2);
  CHECK(worst_along <= 2);
  CHECK(worst_of_error <= 1);
  CHECK(settled > 2500);
  CHECK(poor < 20);
}

TEST_CASE("a corrected root is a root up to rounding, however poor the start") {
  unsigned const seed = 357;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst = 0;
  int valid = 0;
  for (known_root const& k : make_roots(g, 1000, 1e-3)) {
    auto r = k.start(uniform(g, -0.05, 0.05), uniform(g, -0.05, 0.05));
    correct(k.patch, k.size, no_gaps, k.line.origin, k.line.direction, r);
    if (!r.valid) continue;
    ++valid;
    double nearest = no_limit;  // error in units of rounding
    std::vector<oracle_patch> const patches{numbers_of(k.patch)};
    for (oracle_root const& root : oracle_all_hits(patches, numbers_of(k.line))) {
      auto const at = evaluate(k.patch, double(root.u), double(root.v));
      known_root const other{k.patch, k.line, root, k.size, at.du, at.dv};
      nearest = std::min(nearest, root.singular ? 0 : other.error_in_space(r) / other.unit());
    }
    worst = std::max(worst, nearest);
  }
  CAPTURE(worst, valid);
  CHECK(worst <= 4);
  CHECK(valid > 800);
}

TEST_CASE("roots exactly on an edge or in a corner are kept, and reported there") {
  unsigned const seed = 351;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int kept = 0, rays = 0;
  for (int n = 0; n < 4000; ++n) {
    auto const p = integer_sheet(g);
    double u = double(g() % 2), v = double(g() % 17) / 16;
    if (n % 2) std::swap(u, v);
    vec3<double> const at = evaluate(p, u, v).position;
    vec3<double> const direction{small_integer(g), small_integer(g), small_integer(g) + 64};
    ray<double> const line{at - direction * double(1 + g() % 16), direction, -no_limit, no_limit};
    patch_root<double> r{0, std::clamp(u + uniform(g, -1e-4, 1e-4), 0., 1.), v + uniform(g, -1e-4, 1e-4), 0, true};
    correct(p, largest_coordinate(p), no_gaps, line.origin, line.direction, r);
    ++rays;
    kept += r.valid;
    CAPTURE(u, v, r.u, r.v);
    REQUIRE((r.u >= 0 && r.u <= 1 && r.v >= 0 && r.v <= 1));
    REQUIRE(std::fabs(r.u - u) <= 1e-13);
    REQUIRE(std::fabs(r.v - v) <= 1e-13);
  }
  CHECK(kept == rays);
}

TEST_CASE("roots outside an edge by more than rounding are dropped") {
  unsigned const seed = 352;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int kept_outside = 0, kept_inside = 0;
  constexpr int rays = 2000;
  for (int n = 0; n < rays; ++n) {
    auto const p = random_sheet(g, 0.1);
    double const size = largest_coordinate(p);
    for (bool const outside : {true, false}) {
      double const off = std::pow(10, uniform(g, -12, -5)) * (outside ? 1 : -1);
      double u = g() % 2 ? 1 + off : -off, v = uniform(g, 0.01, 0.99);
      if (n % 2) std::swap(u, v);
      vec3<double> const at = evaluate(p, u, v).position;
      vec3<double> const origin = at + vec3<double>{uniform(g, -1, 1), uniform(g, -1, 1), 2};
      patch_root<double> r{0, std::clamp(u, 0., 1.), std::clamp(v, 0., 1.), 0, true};
      correct(p, size, no_gaps, origin, at - origin, r);
      (outside ? kept_outside : kept_inside) += r.valid;
    }
  }
  CHECK(kept_outside == 0);
  CHECK(kept_inside == rays);
}

TEST_CASE("a ray in the plane of a patch has no root, and one through a patch that is a point has that") {
  bicubic_patch<double> flat, point;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      flat(i, j) = {i / 4., j / 4., 0};
      point(i, j) = {0.5, 0.25, 0};
    }
  }
  vec3<double> const origin{-1, 0.25, 0}, direction{1, 0, 0};
  patch_root<double> root{0, 0.5, 0.5, 0, true};
  correct(flat, 1., no_gaps, origin, direction, root);
  CHECK(!root.valid);
  root = {0, 0.5, 0.5, 0, true};
  correct(point, 1., no_gaps, origin, direction, root);
  CHECK((root.valid && root.t == 1.5 && root.error == no_limit));
  correct(point, 1., no_gaps, origin + vec3<double>(0, 1e-13, 0), direction, root);
  CHECK(!root.valid);
  for (auto const& p : {flat, point}) {
    patch_root<double> r{0, 0.5, 0.5, 0, true};
    CHECK(solve_on_planes(p, 1., vec3<double>{0.3, 0.3, 1}, direction, r) <= 16);
    CHECK(!r.valid);
  }
  patch_root<double> none{0, 0.5, 0.5, 0, false};
  correct(flat, 1., no_gaps, vec3<double>{0.375, 0.375, -1}, vec3<double>{0, 0, 1}, none);
  CHECK(!none.valid);
  none = {0, 0.5, 0.5, 0, false};
  CHECK(solve_on_planes(flat, 1., vec3<double>{0.375, 0.375, -1}, vec3<double>{0, 0, 1}, none) == 0);
  CHECK(!none.valid);
}

TEST_CASE("the solver on planes comes from nearby to the root in a few steps and within its stated error") {
  unsigned const seed = 353;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst_in_space = 0, worst_along = 0, worst_of_error = 0;
  int valid = 0, most_steps = 0, steps = 0;
  auto const roots = make_roots(g, 4000, 0.02);
  for (known_root const& k : roots) {
    double const off = std::min(1e-2, 0.02 * k.root.cos_angle);
    auto r = k.start(uniform(g, -off, off), uniform(g, -off, off));
    int const taken = solve_on_planes(k.patch, k.size, k.line.origin, k.line.direction, r);
    most_steps = std::max(most_steps, taken);
    steps += taken;
    if (!r.valid) continue;
    ++valid;
    worst_in_space = std::max(worst_in_space, k.error_in_space(r) / k.unit());
    worst_along = std::max(worst_along, k.error_along(r) / k.unit());
    worst_of_error = std::max(worst_of_error, k.error_in_space(r) / r.error);
  }
  CAPTURE(valid, most_steps, steps, worst_in_space, worst_along, worst_of_error);
  CHECK(valid == int(roots.size()));
  CHECK(most_steps <= 10);
  CHECK(steps < 6 * int(roots.size()));
  CHECK(worst_in_space <= 16);
  CHECK(worst_along <= 16);
  CHECK(worst_of_error <= 1);
}

TEST_CASE("whatever the start, the solver on planes says it has a root only where there is one") {
  unsigned const seed = 354;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int valid = 0, diverged = 0, most_steps = 0;
  double worst = 0;
  for (int n = 0; n < 20000; ++n) {
    auto const p = n % 2 ? random_patch<double>(g) : random_sheet(g, 0.5);
    vec3<double> const origin = random_direction(g) * 3., direction = random_direction(g) - origin;
    double const size = largest_coordinate(p);
    patch_root<double> r{0, uniform(g), uniform(g), 0, true};
    most_steps = std::max(most_steps, solve_on_planes(p, size, origin, direction, r));
    valid += r.valid;
    diverged += !r.valid;
    if (!r.valid) continue;
    REQUIRE((r.u >= 0 && r.u <= 1 && r.v >= 0 && r.v <= 1));
    std::vector<oracle_patch> const patches{numbers_of(p)};
    auto const off = oracle(patches).distance(0, numbers_of({origin, direction, -no_limit, no_limit}), r.t, r.u, r.v);
    double const unit = 1e-15 * (size + std::fabs(origin.x) + std::fabs(origin.y) + std::fabs(origin.z));
    worst = std::max(worst, double(off) / unit);
  }
  CAPTURE(valid, diverged, worst);
  CHECK(worst <= 64);
  CHECK(valid > 1000);
  CHECK(diverged > 1000);
  CHECK(most_steps <= 16);
}

TEST_CASE("the solver on planes soon gives up on a ray under a bowl, however close") {
  unsigned const seed = 355;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const p = bowl();
  int steps = 0;
  constexpr int rays = 2000;
  for (int n = 0; n < rays; ++n) {
    vec3<double> const origin{-2, 0, -std::pow(10, uniform(g, -11, 0))};
    patch_root<double> r{0, uniform(g), uniform(g), 0, true};
    CAPTURE(origin.z, r.u, r.v);
    steps += solve_on_planes(p, 1., origin, vec3<double>{1, 0, 0}, r);
    REQUIRE(!r.valid);
  }
  CHECK(steps < 12 * rays);
}

TEST_CASE("every lane of a pack is corrected and solved as the scalar is, and lanes without a root stay without") {
  using P = pack<double, 8>;
  constexpr std::size_t lanes = 8;
  unsigned const seed = 356;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int valid = 0, dropped = 0;
  for (int n = 0; n < 500; ++n) {
    auto const patch = n % 3 ? random_sheet(g, 0.3) : random_patch<double>(g);
    double const size = largest_coordinate(patch);
    ray<double> line[lanes];
    double numbers[8][lanes];
    std::uint32_t const on = std::uint32_t(g()) & 0xffu;
    for (std::size_t i = 0; i < lanes; ++i) {
      double const u = uniform(g, -0.05, 1.05), v = uniform(g, -0.05, 1.05);
      vec3<double> const at = evaluate(patch, u, v).position, direction = random_direction(g);
      line[i] = {at - direction * uniform(g, 0, 4), direction, 0, no_limit};
      double const row[8] = {line[i].origin.x, line[i].origin.y, line[i].origin.z, direction.x,
                             direction.y,      direction.z,      u + 1e-3,         v - 1e-3};
      for (std::size_t k = 0; k < 8; ++k) numbers[k][i] = row[k];
    }
    auto const number = [&](std::size_t k) { return P::load(numbers[k]); };
    vec3<P> const origin{number(0), number(1), number(2)}, direction{number(3), number(4), number(5)};
    patch_root<P> const start{P(0.), number(6), number(7), P(0.), mask_t<P>::from_bits(on)};
    patch_root<P> corrected = start, solved = start;
    correct(patch, size, no_gaps, origin, direction, corrected);
    int const steps = solve_on_planes(patch, size, origin, direction, solved);
    int most_steps = 0;
    for (std::size_t i = 0; i < lanes; ++i) {
      patch_root<double> const from{0, numbers[6][i], numbers[7][i], 0, (on >> i & 1u) != 0};
      patch_root<double> one = from, other = from;
      correct(patch, size, no_gaps, line[i].origin, line[i].direction, one);
      most_steps = std::max(most_steps, solve_on_planes(patch, size, line[i].origin, line[i].direction, other));
      auto const same = [i](patch_root<P> const& a, patch_root<double> const& b) {
        int const k = int(i);
        if (a.valid[k] != b.valid) return false;
        return !b.valid ||
               (is_same(a.t[k], b.t) && is_same(a.u[k], b.u) && is_same(a.v[k], b.v) && is_same(a.error[k], b.error));
      };
      REQUIRE(same(corrected, one));
      REQUIRE(same(solved, other));
      if (!from.valid) REQUIRE((!one.valid && !other.valid));
      valid += one.valid;
      dropped += from.valid && !one.valid;
    }
    REQUIRE(steps == most_steps);
  }
  CAPTURE(valid, dropped);
  CHECK(valid > 1000);
  CHECK(dropped > 50);
}
