// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include "shapes/exact_rational.hpp"  // its `cross` would hide patchrt's from what comes before

#include <patchrt/intersect/offset_origin.hpp>
#include <patchrt/numbers/pack.hpp>
#include <patchrt/shapes/bezier_elevate.hpp>
#include <patchrt/shapes/revolution_patches.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// A place on a patch, in rational arithmetic.
struct exact_place {
  exact_point point;
  exact_point normal;  ///< of any length
};

template <class T, int M, int N> exact_place place_at(bezier_patch<T, M, N> const& patch, double u, double v) {
  exact_patch const p = exactly(patch);
  rational const a(u), b(v);
  return {value(p, a, b), cross(value(derivative_u(p), a, b), value(derivative_v(p), a, b))};
}

rational dot(exact_point const& a, exact_point const& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// |a|, right to a few ulp, and not subject to over- or underflow.
double length(exact_point const& a) {
  rational const m = largest(a);
  return m == 0 ? 0 : static_cast<double>(m) * std::sqrt(static_cast<double>(rational(dot(a, a) / (m * m))));
}

/// Where `start` is, seen from a place of a surface.
struct seen_start {
  double above;   ///< the tangent plane, on the side of the normal
  double beside;  ///< the normal
};
template <class T> seen_start seen_from(exact_place const& place, vec3<T> const& start) {
  exact_point const off = exactly(start) - place.point;
  rational const along = dot(off, place.normal) / dot(place.normal, place.normal);
  double const above = length(along * place.normal);
  return {along < 0 ? -above : above, length(off - along * place.normal)};
}

template <class T> double sum_of_magnitudes(vec3<T> const& a) {
  return std::fabs(double(a.x)) + std::fabs(double(a.y)) + std::fabs(double(a.z));
}

/// Bent sheets and tangled patches of sizes from 1e-8 to 1e8, as many sizes away from 0 as leave them more than a few
/// ulp wide.
template <class Generator> bicubic_patch<double> placed_patch(Generator& g) {
  auto p = g() % 2 ? random_sheet(g, uniform(g)) : random_patch<double>(g);
  double const size = std::pow(10., uniform(g, -8, 8));
  vec3<double> const away = random_direction(g) * (size * std::pow(10., uniform(g, -2, 8)));
  for (auto& c : p.control_points) c = c * size + away;
  return p;
}

template <class T> bool same_bits(T const& a, T const& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

TEMPLATE_TEST_CASE("a start lies on the side that its direction points to, clear of the surface and no farther", "",
                   double, float) {
  using D = TestType;
  unsigned const seed = 30501u;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double nearest = no_limit, farthest = 0, most_beside = 0;
  for (int k = 0; k < 400; ++k) {
    CAPTURE(k);
    auto const patch = placed_patch(g);
    double const u = uniform(g), v = uniform(g);
    exact_place const place = place_at(patch, u, v);
    vec3<D> const direction = convert_vec<D>(random_direction(g));
    vec3<D> const start = offset_origin(patch, u, v, direction);
    auto const from = depart_from(patch, u, v);
    seen_start const seen = seen_from(place, start);
    bool const is_in_front = dot(exactly(direction), place.normal) > 0;
    REQUIRE((seen.above > 0) == is_in_front);
    double const eps_t = std::numeric_limits<double>::epsilon(), eps_d = std::numeric_limits<D>::epsilon();
    double const r = (eps_t + (std::is_same_v<D, double> ? 0 : eps_d / 2)) * sum_of_magnitudes(from.position);
    double const clear = from.clearance;
    nearest = std::min(nearest, std::fabs(seen.above) / clear);
    farthest = std::max(farthest, (std::fabs(seen.above) - 4 * r) / clear);
    most_beside = std::max(most_beside, seen.beside / (clear + r));
    CHECK(std::fabs(seen.above) > 0.7 * clear);
    CHECK(std::fabs(seen.above) < 1.3 * clear + 4 * r);
    CHECK(seen.beside < 0.3 * clear + r);
  }
  CAPTURE(nearest, farthest, most_beside);
  if (std::is_same_v<D, double>) CHECK(nearest < 1.1);  // by patches at 0
}

TEST_CASE("a start is clear of a patch by what a root of it may be wrong by") {
  unsigned const seed = 30502u;
  CAPTURE(seed);
  std::mt19937 g(seed);
  constexpr double eps = std::numeric_limits<double>::epsilon();
  for (int k = 0; k < 1000; ++k) {
    CAPTURE(k);
    auto const patch = k % 2 ? random_sheet(g, uniform(g)) : random_patch<double>(g);
    auto const [lo, hi] = bounds(patch);
    vec3<double> const middle = (lo + hi) * 0.5, half = (hi - lo) * 0.5;
    auto const sums = coefficient_sum(to_power(detail::relative_to<double>(patch, middle)));
    double const size = std::max({half.x, half.y, half.z}), own = 19.5 * eps * sum_of_magnitudes(half);
    double const clear = clearance<double>(patch);
    CHECK(clear >= own + 32 * eps * (sum_of_magnitudes(half) + size));
    CHECK(clear >= own + 20 * eps * sum_of_magnitudes(sums));
    CHECK(clear <= 64.01 * eps * std::max(sum_of_magnitudes(half) + size, sum_of_magnitudes(sums)));
    CHECK(clearance<float>(patch) == Approx(clear * 0x1p29));
  }
}

TEST_CASE("clearance neither depends on where a patch is nor on its orientation, and scales with it") {
  std::mt19937 g(30503u);
  auto const patch = random_sheet(g, 0.5);
  double const clear = clearance<double>(patch);
  auto moved = patch, turned = patch, scaled = patch;
  for (auto& c : moved.control_points) c = c + vec3<double>{1e3, -1e3, 1e3};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) turned(i, j) = patch(j, 3 - i);
  for (auto& c : scaled.control_points) c = c * 0x1p-30;
  CHECK(clearance<double>(moved) == Approx(clear));
  CHECK(clearance<double>(turned) == Approx(clear));
  CHECK(clearance<double>(scaled) == clear * 0x1p-30);
}

TEST_CASE("a start at a smooth pole or a doubled corner is clear of the surface too") {
  // A cap z = 1 - x^2 - y^2 / 2 whose edge u = 0 is its top, and a sheet with two equal points in a corner.
  bicubic_patch<double> cap;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      double const along = i / 3., x = j / 3. - 0.5, y = 1 - j / 6.;
      cap(i, j) = {3 + along * x, -7 + along * y, 5 - (i > 1 ? (along - 1 / 3.) * 1.5 : 0)};
    }
  std::mt19937 g(30504u);
  auto doubled = random_sheet(g, 0.4);
  doubled(0, 1) = doubled(0, 0);
  for (int k = 0; k < 200; ++k) {
    CAPTURE(k);
    double const v = k % 10 == 0 ? 1 : uniform(g);
    vec3<double> const way = random_direction(g);
    auto const at_pole = depart_from(cap, 0., v);
    vec3<double> const start = offset_origin(at_pole, way);
    CHECK((start.z > 5) == (way.z > 0));  // the cap is tangent to z = 5
    CHECK(std::fabs(start.z - 5) >= at_pole.clearance * 0.99);
    CHECK(std::fabs(start.z - 5) <= at_pole.clearance + 4 * 2.3e-16 * 15);
    CHECK(std::fabs(start.x - 3) + std::fabs(start.y + 7) <= 2.3e-16 * 15);
    // In the corner the limit normal is that of the tangents towards (1, 0) and (0, 2) or (1, 1).
    auto const at_corner = depart_from(doubled, 0., 0.);
    vec3<double> const corner = offset_origin(at_corner, way);
    CHECK(norm(corner - doubled(0, 0)) >= 0.99 * at_corner.clearance);
    CHECK(dot(corner - doubled(0, 0), way) >= 0);
  }
}

TEST_CASE("patches that are a curve or a point, and directions along the surface or of no length, give finite starts") {
  std::mt19937 g(30505u);
  auto const sheet = random_sheet(g, 0.3);
  auto line = sheet, point = sheet;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) line(i, j) = sheet(i, 0), point(i, j) = sheet(0, 0);
  auto const s = evaluate(sheet, 0.3, 0.6);
  for (auto const& patch : {sheet, line, point}) {
    auto const from = depart_from(patch, 0.3, 0.6);
    for (vec3<double> const& way : {s.du, s.dv, -s.du, s.du - s.dv, vec3<double>{0, 0, 0},
                                    vec3<double>{1e150, 0, 1e150}, vec3<double>{1e-150, 0, 1e-150}}) {
      vec3<double> const start = offset_origin(from, way);
      double const off = norm(start - from.position);
      CHECK(off >= 0.99 * from.clearance);
      CHECK(off <= from.clearance + 4 * 2.3e-16 * sum_of_magnitudes(from.position));
      CHECK(dot(start - from.position, way) >= -1e-15 * norm(way));  // the start is rounded
    }
  }
  CHECK(clearance<double>(point) == 0);
  CHECK(norm(depart_from(point, 0.5, 0.5).position - point(0, 0)) == 0);
}

TEST_CASE("more clearance takes the start farther, by as much") {
  std::mt19937 g(30506u);
  auto const patch = random_sheet(g, 0.5);
  double last = 0;
  for (double clear = clearance<double>(patch); clear < 1e-3; clear *= 2) {
    auto const from = depart_from(patch, 0.25, 0.7, clear);
    double const off = dot(offset_origin(from, from.normal) - from.position, from.normal);
    CHECK(off > last);
    CHECK(off >= clear);
    CHECK(off <= clear + 4 * 2.3e-16 * sum_of_magnitudes(from.position));
    CHECK(dot(offset_origin(from, -from.normal) - from.position, from.normal) == Approx(-off).margin(1e-15));
    last = off;
  }
}

TEST_CASE("starts on an exact sphere are inside or outside of it as their directions point, poles included") {
  std::mt19937 g(30507u);
  vec3<double> const centre{0.5, -0.25, 8};
  auto const octants = sphere_patches(centre, 3.);
  for (int k = 0; k < 2000; ++k) {
    CAPTURE(k);
    auto const& patch = octants[g() % octants.size()];
    double const u = k % 4 == 1 ? double(g() % 2) : uniform(g), v = k % 4 == 2 ? double(g() % 2) : uniform(g);
    vec3<double> const way = random_direction(g);
    auto const from = depart_from(patch, u, v);
    vec3<double> const start = offset_origin(from, way);
    exact_point const off = exactly(start) - exactly(centre);
    double const above = (static_cast<double>(rational(dot(off, off) - 9))) / 6;
    vec3<double> const outward = (from.position - centre) / 3.;
    if (std::fabs(dot(way, outward)) < 1e-12) continue;
    REQUIRE((above > 0) == (dot(way, outward) > 0));
    CHECK(std::fabs(above) > 0.7 * from.clearance);
    CHECK(std::fabs(above) < 1.1 * from.clearance + 4 * 2.3e-16 * sum_of_magnitudes(from.position));
  }
}

TEST_CASE("patches of every degree and of float give starts that are clear of them") {
  std::mt19937 g(30508u);
  for (int k = 0; k < 50; ++k) {
    CAPTURE(k);
    double const u = uniform(g), v = uniform(g);
    vec3<double> const way = random_direction(g);
    auto const check = [&](auto const& patch, auto a, auto b) {
      using T = decltype(a);
      exact_place const place = place_at(patch, double(a), double(b));
      auto const from = depart_from(patch, a, b);
      seen_start const seen = seen_from(place, offset_origin(from, convert_vec<T>(way)));
      double const eps = std::numeric_limits<T>::epsilon();
      CHECK((seen.above > 0) == (dot(exactly(convert_vec<T>(way)), place.normal) > 0));
      CHECK(std::fabs(seen.above) > 0.6 * double(from.clearance));
      CHECK(std::fabs(seen.above) < 1.4 * double(from.clearance) + 4 * eps * sum_of_magnitudes(from.position));
    };
    check(random_patch<double, 1, 1>(g), u, v);
    check(random_patch<double, 2, 4>(g), u, v);
    check(random_patch<double, 5, 5>(g), u, v);
    check(random_patch<float>(g), float(u), float(v));
    check(random_patch<float>(g), u, v);
  }
}

TEST_CASE("every lane of a pack starts where one ray does, bit for bit") {
  using P = pack<double, 8>;
  std::mt19937 g(30509u);
  for (int k = 0; k < 50; ++k) {
    auto const patch = placed_patch(g);
    double u[8], v[8], way[3][8];
    for (int i = 0; i < 8; ++i) {
      u[i] = i == 3 ? 0 : uniform(g), v[i] = i == 5 ? 1 : uniform(g);
      vec3<double> const d = random_direction(g);
      way[0][i] = d.x, way[1][i] = d.y, way[2][i] = d.z;
    }
    vec3<P> const starts =
        offset_origin(patch, P::load(u), P::load(v), vec3<P>{P::load(way[0]), P::load(way[1]), P::load(way[2])});
    for (int i = 0; i < 8; ++i) {
      vec3<double> const one = offset_origin(patch, u[i], v[i], vec3<double>{way[0][i], way[1][i], way[2][i]});
      CHECK(same_bits(one, vec3<double>{starts.x[i], starts.y[i], starts.z[i]}));
    }
  }
}
