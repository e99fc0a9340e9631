// SPDX-License-Identifier: MIT
#include "intersect/plane_functions.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>

#include <algorithm>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class T, class Generator> vec3<T> random_vector(Generator& g, double size = 1) {
  std::uniform_real_distribution<double> d(-size, size);
  T const x = T(d(g)), y = T(d(g)), z = T(d(g));
  return {x, y, z};
}

/// Folded patches, bent sheets, and ones that are flat: what models and what nightmares are made of.
template <class T, class Generator> power_patch<T> any_patch(Generator& g, int n) {
  bicubic_patch<double> const p =
      n % 4 == 0 ? random_patch<double>(g) : random_sheet(g, n % 4 == 3 ? 0 : 0.05 * (n % 7));
  power_patch<double> const q = to_power(p);
  power_patch<T> rounded;
  for (int k = 0; k < 16; ++k) rounded.coefficients[k] = convert_vec<T>(q.coefficients[k]);
  return rounded;
}

/// Coordinate `a` of a patch.
template <class T> bicubic<real> coordinate(power_patch<T> const& p, int a) {
  bicubic<real> s;
  for (std::size_t k = 0; k < 16; ++k) s.c[k] = p.coefficients[k][a];
  return s;
}

/// A close bound on |f - its tangent plane in the middle| over a cell: the largest of a grid, and what a function with
/// these second derivatives gains on the way from the grid's nearest point to its extremum.
inline real remainder_of(bicubic<real> const& f, real x, real y, real hx, real hy) {
  bicubic<real> b = over_cell(f, x, y, hx, hy);
  b.c[0] = b.c[1] = b.c[4] = 0;
  constexpr int steps = 8;
  real most = 0;
  for (int i = -steps; i <= steps; ++i) {
    for (int j = -steps; j <= steps; ++j) most = std::max(most, std::abs(b(real(i) / steps, real(j) / steps)));
  }
  real const bend = b.magnitude(2, 0) + 2 * b.magnitude(1, 1) + b.magnitude(0, 2);
  return most + bend / (8 * steps * steps);
}

/// The cell with its remainder, and room in that for the rounding of T: 16 epsilon of what the functions are sums of.
template <class T> patch_cell<T> bounded(power_patch<T> const& p, vec3<T> const& origin, rectangle<T> const& c) {
  patch_cell<T> cell{c.x, c.y, c.half_x, c.half_y, {}};
  for (int a = 0; a < 3; ++a) {
    bicubic<real> const s = coordinate(p, a);
    real const rounding = 16 * std::numeric_limits<T>::epsilon() * (s.magnitude() + std::abs(real(origin[a])));
    cell.remainder[a] = static_cast<T>(remainder_of(s, c.x, c.y, c.half_x, c.half_y) + rounding);
  }
  return cell;
}

/// A ray by two planes through a point of the patch.
template <class T> struct aimed_planes { vec3<T> origin, n1, n2; };
template <class T, class Generator>
aimed_planes<T> planes_through(power_patch<T> const& p, planar_point at, Generator& g) {
  aimed_planes<T> a{{}, random_vector<T>(g), random_vector<T>(g)};
  for (int k = 0; k < 3; ++k) a.origin[k] = static_cast<T>(coordinate(p, k)(at.x, at.y));
  if (g() % 4 == 0) a.n2 = a.n1 + T(0.01) * a.n2;
  return a;
}

template <class T> projected_patch<T> project(power_patch<T> const& p, aimed_planes<T> const& a) {
  return patchrt::project(p, sum(coefficient_sum(p), absolute(a.origin)), a.origin, a.n1, a.n2);
}

/// Plane functions with two roots in a cell: of a ray through two points of a patch, or of a few powers.
template <class T> struct two_roots {
  projected_patch<T> p;
  rectangle<T> cell;
  planar_root first, second;

  bool is_certain() const {
    real const apart = std::max(std::abs(first.x - second.x) / cell.half_x, std::abs(first.y - second.y) / cell.half_y);
    return first.found && second.found && cell.holds(first) && cell.holds(second) && apart > 1e-3L;
  }
};
template <class T, class Generator> two_roots<T> folded_cell(Generator& g, int n) {
  two_roots<T> r{};
  r.cell = random_cell<T>(g, 4);
  planar_point const a = random_point(r.cell, g), b = random_point(r.cell, g);
  if (n % 2) {
    power_patch<T> const p = any_patch<T>(g, n / 2);
    vec3<T> from, to;
    for (int k = 0; k < 3; ++k) {
      from[k] = static_cast<T>(coordinate(p, k)(a.x, a.y));
      to[k] = static_cast<T>(coordinate(p, k)(b.x, b.y));
    }
    vec3<T> const direction = (to - from) / norm(to - from);
    r.p = project(p, {from, cross(direction, random_vector<T>(g)), cross(direction, random_vector<T>(g))});
  } else {
    std::uniform_real_distribution<double> d(-1, 1);
    T* const functions[2] = {r.p.f, r.p.g};
    for (T* const c : functions) {
      bicubic<real> f{};
      for (int k = int(g() % 4); k >= 0; --k) f.c[g() % 16] = d(g);
      f.c[0] = f.c[1] = f.c[4] = 0;
      // The linear part that makes both points roots, with any slope by y.
      real const slope = d(g), rise = f(b.x, b.y) - f(a.x, a.y) + slope * (b.y - a.y);
      f.c[1] = slope;
      f.c[4] = -rise / (b.x - a.x);
      f.c[0] = -f(a.x, a.y);
      for (std::size_t k = 0; k < 16; ++k) c[k] = static_cast<T>(f.c[k]);
    }
  }
  plane_functions const exact(r.p);
  r.first = find_root(exact, a.x, a.y);
  r.second = find_root(exact, b.x, b.y);
  return r;
}

/// Plane functions over a cell that `convergent` is barely true of, or not: a linear part, and further powers that take
/// nearly all of what the Jacobian may change, or more.
template <class T, class Generator>
projected_patch<T> nearly_linear(rectangle<T> const& cell, planar_point root, Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  projected_patch<T> p;
  bicubic<real> rows[2] = {};
  bool const is_near = g() % 2;
  for (auto& f : rows) {
    int const terms = 1 + int(g() % 3);
    for (int k = 0; k < terms; ++k) f.c[g() % 16] = g() % 2 ? (g() % 2 ? 1 : -1) : d(g);
    f.c[0] = f.c[1] = f.c[4] = 0;
    real const change = f.magnitude(1, 0) + f.magnitude(0, 1), share = is_near ? 0.24L : std::abs(d(g));
    for (real& c : f.c) c *= change > 0 ? share / change : 0;
  }
  rows[0].c[4] = 1;
  rows[1].c[1] = 1;
  // Back to the patch's parameters: p = (x - x0) / hx.
  T* const functions[2] = {p.f, p.g};
  bool const is_mixed = g() % 2;
  real const mix[2][2] = {{is_mixed ? d(g) : 1, is_mixed ? d(g) : 0}, {is_mixed ? d(g) : 0, is_mixed ? d(g) : 1}};
  for (int i = 0; i < 2; ++i) {
    bicubic<real> f;
    for (std::size_t k = 0; k < 16; ++k) f.c[k] = mix[i][0] * rows[0].c[k] + mix[i][1] * rows[1].c[k];
    f = over_cell(f, -real(cell.x) / cell.half_x, -real(cell.y) / cell.half_y, 1 / real(cell.half_x),
                  1 / real(cell.half_y));
    f.c[0] -= f(root.x, root.y);
    for (std::size_t k = 0; k < 16; ++k) functions[i][k] = static_cast<T>(f.c[k]);
  }
  return p;
}

template <class T> cell_verdict<T> examine(projected_patch<T> const& p, rectangle<T> const& c) {
  return examine_cell(p, c.x, c.y, c.half_x, c.half_y);
}

}  // namespace

TEMPLATE_TEST_CASE("a cell's linear part never excludes it where it has a root", "", float, double) {
  using T = TestType;
  unsigned const seed = 340;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int lost = 0, outside = 0, rooted = 0;
  for (int n = 0; n < 20000; ++n) {
    auto const patch = any_patch<T>(g, n);
    auto const cell = random_cell<T>(g, 5);
    auto const planes = planes_through(patch, random_point(cell, g), g);
    auto const start = linear_start(project(patch, planes), absolute(planes.n1), absolute(planes.n2),
                                    bounded(patch, planes.origin, cell));
    ++rooted;
    lost += !start.possible;
    T const spare = std::numeric_limits<T>::epsilon();
    outside += !(abs(start.x - cell.x) <= cell.half_x + spare && abs(start.y - cell.y) <= cell.half_y + spare);
  }
  CAPTURE(rooted);
  CHECK(lost == 0);
  CHECK(outside == 0);
}

TEMPLATE_TEST_CASE("linear parts exclude nearly all cells of a sheet but the one that a ray meets", "", float, double) {
  using T = TestType;
  unsigned const seed = 341;
  CAPTURE(seed);
  std::mt19937 g(seed);
  constexpr int rays = 300, m = 8;
  int kept = 0;
  for (int n = 0; n < rays; ++n) {
    auto const patch = any_patch<T>(g, 28 * n + 1);
    auto const planes = planes_through(patch, random_point(rectangle<T>{0, 0, 1, 1}, g), g);
    auto const p = project(patch, planes);
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < m; ++j) {
        rectangle<T> const cell{T(2 * i + 1) / m - 1, T(2 * j + 1) / m - 1, T(1) / m, T(1) / m};
        auto const start =
            linear_start(p, absolute(planes.n1), absolute(planes.n2), bounded(patch, planes.origin, cell));
        kept += start.possible;
      }
    }
  }
  CAPTURE(kept);
  CHECK(kept >= rays);
  CHECK(kept < 6 * rays);  // of 64
}

TEMPLATE_TEST_CASE("the start in a cell of a plane is the root, or the cell's nearest along each parameter", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 342;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 2000; ++n) {
    auto const patch = any_patch<T>(g, 7);
    auto const at = random_point(rectangle<T>{0, 0, 1, 1}, g);
    auto const planes = planes_through(patch, at, g);
    auto const p = project(patch, planes);
    auto const root = find_root(plane_functions(p), at.x, at.y);
    REQUIRE(root.found);
    auto const cell = random_cell<T>(g, 4);
    auto const start = linear_start(p, absolute(planes.n1), absolute(planes.n2), bounded(patch, planes.origin, cell));
    auto const verdict = examine(p, cell);
    real const eps = 32 * std::numeric_limits<T>::epsilon();
    real const x = std::clamp<real>(root.x, cell.x - cell.half_x, cell.x + cell.half_x);
    real const y = std::clamp<real>(root.y, cell.y - cell.half_y, cell.y + cell.half_y);
    REQUIRE(std::abs(start.x - x) <= eps * (1 + root.sway_x));
    REQUIRE(std::abs(start.y - y) <= eps * (1 + root.sway_y));
    REQUIRE(std::abs(verdict.x - x) <= eps * (1 + root.sway_x));
    REQUIRE(std::abs(verdict.y - y) <= eps * (1 + root.sway_y));
    // From there Newton's iteration has nothing to do but to see that.
    if (!cell.holds(root) || 4 * eps * std::max(root.sway_x, root.sway_y) > 0x1p-10) continue;
    auto const found = newton(p, start.x, start.y, cell.half_x, cell.half_y, true, T(0x1p-10), 10);
    REQUIRE(found.converged);
    REQUIRE(found.steps == 1);
  }
}

TEMPLATE_TEST_CASE("examining a cell never excludes it where it has a root by more than rounding", "", float, double) {
  using T = TestType;
  unsigned const seed = 343;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int lost = 0, rooted = 0, astray = 0;
  for (int n = 0; n < 200000; ++n) {
    auto const patch = any_patch<T>(g, n);
    auto const cell = random_cell<T>(g, 6);
    auto const at = random_point(cell, g);
    auto const p = project(patch, planes_through(patch, at, g));
    auto const v = examine(p, cell);
    astray += !(abs(v.x - cell.x) <= cell.half_x * T(1.0001) && abs(v.y - cell.y) <= cell.half_y * T(1.0001));
    auto const root = find_root(plane_functions(p), at.x, at.y);
    if (!root.found || !cell.holds(root)) continue;
    ++rooted;
    lost += !v.possible;
  }
  CAPTURE(rooted);
  CHECK(lost == 0);
  CHECK(astray == 0);
  CHECK(rooted > 80000);
}

TEMPLATE_TEST_CASE("a cell with two roots is never shown to have one at most", "", float, double) {
  using T = TestType;
  unsigned const seed = 344;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int folded = 0, excluded = 0, single = 0, convergent = 0;
  for (int n = 0; n < 200000; ++n) {
    auto const r = folded_cell<T>(g, n);
    if (!r.is_certain()) continue;
    ++folded;
    auto const v = examine(r.p, r.cell);
    excluded += !v.possible;
    single += v.at_most_one;
    convergent += v.convergent;
  }
  CAPTURE(folded);
  CHECK(excluded == 0);
  CHECK(single == 0);
  CHECK(convergent == 0);
  CHECK(folded > 20000);
}

TEMPLATE_TEST_CASE("cells that shrink around a regular root come to have one at most, and those beside it none", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 345;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int regular = 0, single[7] = {}, convergent[7] = {}, beside[7] = {};
  while (regular < 1000) {
    auto const patch = any_patch<T>(g, regular);
    auto const at = random_point(rectangle<T>{0, 0, T(0.9), T(0.9)}, g);
    auto const p = project(patch, planes_through(patch, at, g));
    auto const root = find_root(plane_functions(p), at.x, at.y);
    if (!root.found || root.sway_x + root.sway_y > 100) continue;
    ++regular;
    for (int level = 0; level < 7; ++level) {
      T const half = std::ldexp(T(0.25), -level);
      rectangle<T> const cell{T(root.x) + T(0.3) * half, T(root.y) - T(0.6) * half, half, half};
      rectangle<T> const next{cell.x + 4 * half, cell.y, half, half};
      auto const v = examine(p, cell);
      REQUIRE(v.possible);
      if (v.convergent) REQUIRE(v.at_most_one);
      single[level] += v.at_most_one;
      convergent[level] += v.convergent;
      beside[level] += !examine(p, next).possible;
    }
  }
  CAPTURE(single[0], single[3], single[6], convergent[0], convergent[3], convergent[6], beside[0], beside[3],
          beside[6]);
  CHECK(single[0] > 400);
  CHECK(single[3] > 900);
  CHECK(single[6] > 995);
  CHECK(convergent[3] > 500);
  CHECK(convergent[6] > 750);
  CHECK(beside[6] > 950);
}

TEMPLATE_TEST_CASE("in a convergent cell Newton's iteration finds the root from wherever in the cell", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 346;
  CAPTURE(seed);
  std::mt19937 g(seed);
  constexpr T tolerance = sizeof(T) == 4 ? T(0x1p-10) : T(0x1p-20);
  int cells = 0, starts = 0;
  double worst = 0;
  for (int n = 0; n < 40000; ++n) {
    rectangle<T> cell = random_cell<T>(g, 5);
    // Wider cells reach beyond the square by more than the iteration may.
    cell.half_x = min(cell.half_x, T(0.5));
    cell.half_y = min(cell.half_y, T(0.5));
    auto const at = random_point(cell, g);
    auto const patch = any_patch<T>(g, n / 4);
    auto const p = n % 4 == 0 ? project(patch, planes_through(patch, at, g)) : nearly_linear<T>(cell, at, g);
    auto const root = find_root(plane_functions(p), at.x, at.y);
    auto const v = examine(p, cell);
    if (!v.convergent || !root.found || !cell.holds(root, 1)) continue;
    real const noise = 32 * std::numeric_limits<T>::epsilon();
    if (noise * std::max(root.sway_x, root.sway_y) > tolerance) continue;  // no step would be short
    ++cells;
    for (int k = 0; k < 10; ++k) {
      auto const from = random_point(cell, g);
      T const x = k == 0 ? v.x : T(from.x), y = k == 0 ? v.y : T(from.y);
      auto const r = newton(p, x, y, 2 * cell.half_x, 2 * cell.half_y, true, tolerance, 16);
      ++starts;
      CAPTURE(n, k, cell.x, cell.y, cell.half_x, cell.half_y, x, y);
      REQUIRE(r.converged);
      // The last step's square in units of the cell, where slopes change by 1/4 at most, and rounding.
      real const bend = real(tolerance) * tolerance / min(cell.half_x, cell.half_y);
      real const bound_x = bend * std::max<real>(1, cell.half_x / cell.half_y) + noise * (1 + root.sway_x);
      real const bound_y = bend * std::max<real>(1, cell.half_y / cell.half_x) + noise * (1 + root.sway_y);
      worst = std::max(worst, double(std::max(std::abs(r.x - root.x) / bound_x, std::abs(r.y - root.y) / bound_y)));
    }
  }
  CAPTURE(cells, starts, worst);
  CHECK(worst <= 1);
  CHECK(worst > 1e-3);
  CHECK(cells > 3000);
}

TEST_CASE("a cell of NaN is excluded by nothing and proved by nothing") {
  projected_patch<double> p{};
  for (double& c : p.f) c = std::numeric_limits<double>::quiet_NaN();
  p.g[1] = 1;
  auto const v = examine(p, rectangle<double>{0, 0, 1, 1});
  CHECK(v.possible);
  CHECK(!v.at_most_one);
  CHECK(!v.convergent);
}

TEMPLATE_TEST_CASE("a root on the edge of two cells is possible in one of them", "", float, double) {
  using T = TestType;
  unsigned const seed = 348;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int lost = 0, rooted = 0;
  for (int n = 0; n < 100000; ++n) {
    auto const patch = any_patch<T>(g, n);
    auto const cell = random_cell<T>(g, 5);
    rectangle<T> const next{cell.x + 2 * cell.half_x, cell.y, cell.half_x, cell.half_y};
    planar_point at = random_point(rectangle<T>{cell.x, cell.y, cell.half_x, cell.half_y * T(0.99)}, g);
    at.x = real(cell.x) + cell.half_x;
    if (std::abs(at.y - cell.y) > 0.99 * cell.half_y) at.y = cell.y;
    auto const planes = planes_through(patch, at, g);
    auto const p = project(patch, planes);
    auto const root = find_root(plane_functions(p), at.x, at.y);
    if (!root.found) continue;
    real const noise = 32 * std::numeric_limits<T>::epsilon() * (1 + root.sway_y);
    if (std::abs(root.y - cell.y) > cell.half_y - noise) continue;
    ++rooted;
    lost += !examine(p, cell).possible && !examine(p, next).possible;
  }
  CAPTURE(rooted);
  CHECK(lost == 0);
  CHECK(rooted > 90000);
}

TEMPLATE_TEST_CASE("every lane of a pack comes to the verdicts and roots of the scalar, and rests where it is inactive",
                   "", (pack<float, 8>), (pack<float, 16>), (pack<double, 8>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int lanes = lanes_v<P>;
  unsigned const seed = 347;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int possible = 0, single = 0, converged = 0, stopped = 0;
  for (int n = 0; n < 400; ++n) {
    auto const patch = any_patch<T>(g, n);
    rectangle<T> cell[lanes];
    aimed_planes<T> planes[lanes];
    patch_cell<T> bound[lanes];
    T numbers[16][lanes];
    for (int i = 0; i < lanes; ++i) {
      cell[i] = random_cell<T>(g, 4);
      planes[i] = planes_through(patch, random_point(i % 2 ? cell[i] : rectangle<T>{0, 0, 1, 1}, g), g);
      bound[i] = bounded(patch, planes[i].origin, cell[i]);
      T const row[16] = {
          planes[i].origin.x,  planes[i].origin.y, planes[i].origin.z, planes[i].n1.x,       planes[i].n1.y,
          planes[i].n1.z,      planes[i].n2.x,     planes[i].n2.y,     planes[i].n2.z,       cell[i].x,
          cell[i].y,           cell[i].half_x,     cell[i].half_y,     bound[i].remainder.x, bound[i].remainder.y,
          bound[i].remainder.z};
      for (int k = 0; k < 16; ++k) numbers[k][i] = row[k];
    }
    auto const number = [&](int k) { return P::load(numbers[k]); };
    auto const vector = [&](int k) { return vec3<P>{number(k), number(k + 1), number(k + 2)}; };
    auto const reach = scale(coefficient_sum(patch), T(2));
    auto const p = patchrt::project(patch, reach, vector(0), vector(3), vector(6));
    auto const start = linear_start(p, absolute(vector(3)), absolute(vector(6)),
                                    patch_cell<P>{number(9), number(10), number(11), number(12), vector(13)});
    auto const v = examine_cell(p, number(9), number(10), number(11), number(12));
    std::uint32_t const on = std::uint32_t(g());
    auto const active = mask_t<P>::from_bits(on & ((1u << lanes) - 1u));
    auto const r = newton(p, v.x, v.y, number(11), number(12), active, T(0x1p-10), 10);
    int steps = 0;
    for (int i = 0; i < lanes; ++i) {
      auto const q = patchrt::project(patch, reach, planes[i].origin, planes[i].n1, planes[i].n2);
      auto const s = linear_start(q, absolute(planes[i].n1), absolute(planes[i].n2), bound[i]);
      REQUIRE((start.x[i] == s.x && start.y[i] == s.y && start.possible[i] == s.possible));
      auto const e = examine(q, cell[i]);
      REQUIRE((v.x[i] == e.x && v.y[i] == e.y && v.possible[i] == e.possible && v.at_most_one[i] == e.at_most_one));
      REQUIRE(v.convergent[i] == e.convergent);
      possible += e.possible;
      single += e.at_most_one;
      bool const is_on = on >> i & 1u;
      auto const one = newton(q, e.x, e.y, cell[i].half_x, cell[i].half_y, is_on, T(0x1p-10), 10);
      steps = std::max(steps, one.steps);
      REQUIRE((r.x[i] == one.x && r.y[i] == one.y && r.converged[i] == one.converged));
      if (!is_on) REQUIRE((one.x == e.x && one.y == e.y && !one.converged && one.steps == 0));
      converged += one.converged;
      stopped += is_on && !one.converged;
    }
    REQUIRE(r.steps == steps);
  }
  CAPTURE(possible, single, converged, stopped);
  CHECK(std::min({possible, single, converged}) > 400);
  CHECK(stopped > 20);
}
