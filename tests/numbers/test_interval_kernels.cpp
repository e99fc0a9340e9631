// SPDX-License-Identifier: MIT
#include "shapes/exact.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/interval.hpp>
#include <patchrt/roots/newton.hpp>

#include <algorithm>
#include <limits>
#include <random>
#include <tuple>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class T> bool holds(interval<T> a, rational const& x) { return rational(a.lo) <= x && x <= rational(a.hi); }
template <class T> bool holds(vec3<interval<T>> const& a, exact_point const& p) {
  return holds(a.x, p[0]) && holds(a.y, p[1]) && holds(a.z, p[2]);
}
template <class T> T widest(vec3<interval<T>> const& a) { return std::max({width(a.x), width(a.y), width(a.z)}); }
template <class T> vec3<interval<T>> point(vec3<T> const& p) { return {p.x, p.y, p.z}; }

}  // namespace

TEMPLATE_TEST_CASE("cross products of single vectors as intervals hold the exact ones and decide their signs", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  for (int n = 0; n < 4000; ++n) {
    vec3<T> const a{T(d(g)), T(d(g)), T(d(g))};
    T const s = T(d(g));
    vec3<T> const b = n % 2 ? vec3<T>{T(d(g)), T(d(g)), T(d(g))} : scale(a, s);  // nearly parallel
    exact_point const exact = cross(exactly(a), exactly(b));
    vec3<interval<T>> const got = cross(point(a), point(b));
    CAPTURE(n);
    REQUIRE(holds(got, exact));
    REQUIRE((exact[0] > 0) == (interval<T>(T(0)) < got.x));
    REQUIRE((exact[1] < 0) == (got.y < interval<T>(T(0))));
    REQUIRE((exact[2] == 0) == (got.z == interval<T>(T(0))));
  }
}

TEMPLATE_TEST_CASE("patches evaluated over intervals hold all points of the part", "", float, double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  T const eps = std::numeric_limits<T>::epsilon();
  double widest_point = 0;
  for (int n = 0; n < 200; ++n) {
    auto const patch = random_patch<T>(g);
    auto const exact = test::exactly(patch);
    exact_patch const along_u = derivative_u(exact), along_v = derivative_v(exact);
    T const u = T(unit(g)), v = T(unit(g)), size = n % 2 ? T(0) : T(unit(g)) / 8;
    interval<T> const iu(u, u + size), iv(v, v + size);
    auto const got = evaluate(patch, iu, iv);
    for (T const x : {iu.lo, iu.hi, midpoint(iu)}) {
      for (T const y : {iv.lo, iv.hi, midpoint(iv)}) {
        CAPTURE(n, x, y);
        REQUIRE(holds(got.position, value(exact, rational(x), rational(y))));
        REQUIRE(holds(got.du, value(along_u, rational(x), rational(y))));
        REQUIRE(holds(got.dv, value(along_v, rational(x), rational(y))));
      }
    }
    if (size == 0)
      widest_point = std::max(widest_point, double(widest(got.position) / (eps * largest_coordinate(patch))));
  }
  CAPTURE(widest_point);
  CHECK(widest_point <= 36);  // twice the bound of rounding to nearest, on either side
}

TEMPLATE_TEST_CASE("Newton's step over intervals holds the steps of all its systems", "", float, double) {
  using T = TestType;
  unsigned const seed = 3;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  auto const random = [&] {
    T const x = T(d(g)), y = T(d(g)) / 16;
    return interval<T>(std::min(x, x + y), std::max(x, x + y));
  };
  for (int n = 0; n < 1000; ++n) {
    bivariate<interval<T>> const b{random(), random(), random(), random(), random(), random()};
    auto const s = newton_step(b);
    interval<T> const far = std::numeric_limits<T>::max();
    auto const step = limit_step(s, far, far);
    for (unsigned ends = 0; ends < 64; ++ends) {
      auto const end = [ends](interval<T> a, int k) { return rational((ends >> k) & 1 ? a.hi : a.lo); };
      rational const f = end(b.f, 0), fx = end(b.fx, 1), fy = end(b.fy, 2), gg = end(b.g, 3), gx = end(b.gx, 4),
                     gy = end(b.gy, 5);
      rational const det = fx * gy - fy * gx, dx = gg * fy - f * gy, dy = f * gx - gg * fx;
      bool ok = holds(s.det, det) && holds(s.dx, dx) && holds(s.dy, dy);
      ok = ok &&
           (det == 0 || is_whole(interval<T>(T(1)) / s.det) || (holds(step.dx, dx / det) && holds(step.dy, dy / det)));
      CAPTURE(n, ends);
      REQUIRE(ok);
    }
  }
}
