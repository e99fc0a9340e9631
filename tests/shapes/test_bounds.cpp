// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/patches.hpp"

#include <limits>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Whether `points` random points of the patch are within its bounds, up to the error of their evaluation.
template <class Generator> bool bounds_hold(bicubic_patch<double> const& p, int points, Generator& g) {
  std::uniform_real_distribution<double> parameter(0, 1);
  box<double> b = bounds(p);
  double m = 0;
  for (auto const& c : p.control_points) m = max(m, max(abs(c.x), max(abs(c.y), abs(c.z))));
  double const error = 10 * std::numeric_limits<double>::epsilon() * m;
  b.lo -= error;
  b.hi += error;
  for (int n = 0; n < points; ++n) {
    vec3<double> const q = evaluate(p, parameter(g), parameter(g)).position;
    if (!contains(b, box<double>{q, q})) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("bounds contain a million points of random patches and of the teapot") {
  unsigned const seed = 17;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int k = 0; k < 250; ++k) REQUIRE(bounds_hold(random_patch<double>(g), 4000, g));
  auto const teapot = read_patches(project_data("teapot.bpt"));
  REQUIRE(teapot.size() == 32);
  for (auto const& p : teapot) REQUIRE(bounds_hold(make_patch<double>(p), 4000, g));
}

TEST_CASE("bounds are the tightest box of the control points") {
  std::mt19937 g(2);
  auto const p = random_patch<float>(g);
  auto const b = bounds(p);
  for (int axis = 0; axis < 3; ++axis) {
    bool touches_lo = false, touches_hi = false;
    for (auto const& c : p.control_points) {
      CHECK(component(b.lo, axis) <= component(c, axis));
      CHECK(component(c, axis) <= component(b.hi, axis));
      touches_lo = touches_lo || component(b.lo, axis) == component(c, axis);
      touches_hi = touches_hi || component(b.hi, axis) == component(c, axis);
    }
    CHECK(touches_lo);
    CHECK(touches_hi);
  }
}

TEST_CASE("bounds show a NaN wherever it stands, and infinities") {
  std::mt19937 g(3);
  auto const p = random_patch<double>(g);
  double const nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 16; ++k) {
    auto q = p;
    q.control_points[k].y = nan;
    auto const b = bounds(q);
    CHECK(b.lo.y != b.lo.y);
    CHECK(b.hi.y != b.hi.y);
    CHECK(b.lo.x == bounds(p).lo.x);
    CHECK(is_empty(b));
    q.control_points[k].y = -inf;
    CHECK(bounds(q).lo.y == -inf);
    CHECK(bounds(q).hi.y < inf);
  }
}

TEST_CASE("bounds of coordinates whose sum overflows are exact") {
  bicubic_patch<float> p;
  float const big = std::numeric_limits<float>::max();
  for (std::size_t k = 0; k < 16; ++k) p.control_points[k] = {k % 2 ? big : big / 2, -big, k < 8 ? big : -big};
  auto const b = bounds(p);
  CHECK((b.lo == vec3<float>{big / 2, -big, -big}));
  CHECK((b.hi == vec3<float>{big, -big, big}));
}
