// SPDX-License-Identifier: MIT
#include <boost/multiprecision/cpp_int.hpp>
#include <intersect/random_box_rays.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <support/catch.hpp>

#include <algorithm>

using namespace patchrt;
using rational = boost::multiprecision::cpp_rational;

namespace {

struct exact_span {
  bool hit;
  rational entry, exit;
};

/// The t of [t_min, t_max] in b, without rounding.
template <class T> exact_span exact(ray<T> const& r, box<T> const& b, rational const& t_min, rational const& t_max) {
  exact_span s{true, t_min, t_max};
  for (int k = 0; k < 3; ++k) {
    rational const o(r.origin[k]), d(r.direction[k]), lo(b.lo[k]), hi(b.hi[k]);
    if (d == 0) {
      s.hit = s.hit && lo <= o && o <= hi;
    } else {
      rational near = (lo - o) / d, far = (hi - o) / d;
      if (far < near) swap(near, far);
      s.entry = std::max(s.entry, near);
      s.exit = std::min(s.exit, far);
    }
  }
  s.hit = s.hit && s.entry <= s.exit;
  return s;
}

}  // namespace

TEMPLATE_TEST_CASE("no ray that truly meets a box misses it in conservative arithmetic", "", float, double) {
  using T = TestType;
  unsigned const seed = 20130u;
  CAPTURE(seed);
  test::random_box_rays<T> random(seed);
  rational const unit_roundoff = rational(std::numeric_limits<T>::epsilon()) / 2;
  rational const gamma = 3 * unit_roundoff / (1 - 3 * unit_roundoff);
  int hits = 0, missed = 0, lost_without = 0, not_bounds = 0, beyond_gamma = 0, far_out = 0;
  for (int i = 0; i < 30000; ++i) {
    box<T> const b = random.any_box();
    ray<T> r = random.any_ray(b);
    if (random.chance(0.7)) {
      r.t_min = T(-0x1p60);
      r.t_max = T(0x1p60);
    }
    r.t_min = std::max(r.t_min, T(-0x1p60));
    r.t_max = std::min(r.t_max, T(0x1p60));
    auto const truth = exact(r, b, rational(r.t_min), rational(r.t_max));
    slab_ray<T> const s = make_slab_ray(r.origin, r.direction);
    auto const wide = intersect<slab::conservative>(s, b, r.t_min, r.t_max);
    auto const plain = intersect(s, b, r.t_min, r.t_max);
    if (!truth.hit) continue;
    ++hits;
    if (!(wide.entry <= wide.exit)) {
      ++missed;
      continue;
    }
    lost_without += !(plain.entry <= plain.exit);
    not_bounds += rational(wide.entry) > truth.entry || rational(wide.exit) < truth.exit;
    beyond_gamma += abs(rational(plain.entry) - truth.entry) > gamma * abs(truth.entry) ||
                    abs(rational(plain.exit) - truth.exit) > gamma * abs(truth.exit);
    far_out += abs(rational(wide.entry) - truth.entry) > 12 * unit_roundoff * abs(truth.entry) ||
               abs(rational(wide.exit) - truth.exit) > 12 * unit_roundoff * abs(truth.exit);
  }
  CAPTURE(hits);
  REQUIRE(missed == 0);
  REQUIRE(not_bounds == 0);
  REQUIRE(beyond_gamma == 0);
  REQUIRE(far_out == 0);
  REQUIRE(lost_without > 10);  // the rays are hard enough that rounding to nearest loses some
  REQUIRE(hits > 5000);
}

TEMPLATE_TEST_CASE("no ray misses a box that it truly meets at a t of 0 or more where exits are widened", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 20131u;
  CAPTURE(seed);
  test::random_box_rays<T> random(seed);
  rational const unit_roundoff = rational(std::numeric_limits<T>::epsilon()) / 2;
  rational const gamma = 3 * unit_roundoff / (1 - 3 * unit_roundoff);
  int hits = 0, missed = 0, lost_without = 0, beyond_gamma = 0, other_by_corners = 0;
  for (int i = 0; i < 30000; ++i) {
    box<T> const b = random.any_box();
    ray<T> const r = random.any_ray(b);
    T const t_min(0), t_max(0x1p60);
    auto const truth = exact(r, b, rational(t_min), rational(t_max));
    auto const s = make_watertight_slab_ray(r.origin, r.direction);
    auto const wide = intersect(s, b, t_min, t_max);
    auto const plain = intersect(make_slab_ray(r.origin, r.direction), b, t_min, t_max);
    vec3<T> near = b.lo, far = b.hi;
    for (int k = 0; k < 3; ++k)
      if (s.inverse[k] < 0) std::swap(near[k], far[k]);
    auto const by_corners = intersect(s, near, far, t_min, t_max);
    other_by_corners += !(by_corners.entry == wide.entry && by_corners.exit == wide.exit) &&
                        (by_corners.entry <= by_corners.exit) != (wide.entry <= wide.exit);
    if (!truth.hit) continue;
    ++hits;
    missed += !(wide.entry <= wide.exit);
    lost_without += !(plain.entry <= plain.exit);
    beyond_gamma += abs(rational(wide.entry) - truth.entry) > gamma * abs(truth.entry);
  }
  CAPTURE(hits);
  REQUIRE(missed == 0);
  REQUIRE(beyond_gamma == 0);
  REQUIRE(other_by_corners == 0);
  REQUIRE(lost_without > 10);
  REQUIRE(hits > 4000);
}
