// SPDX-License-Identifier: MIT
#include "intersect/exact_quadric.hpp"
#include "support/catch.hpp"

#include <patchrt/intersect/quadric_point.hpp>
#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/interval.hpp>
#include <patchrt/numbers/two_float.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

using namespace patchrt;
using namespace patchrt::test;

TEST_CASE("two words give crossings of quadrics to twice the digits") {
  using F = two_float<double>;
  unsigned const seed = 1;
  CAPTURE(seed);
  random_quadrics g(seed);
  double worst = 0, in_double = 0;
  int compared = 0;
  for (int n = 0; n < 4000; ++n) {
    CAPTURE(n);
    auto const at = g.place(3, 1);
    auto const s = g.surface(g.below(random_quadrics::kinds), at);
    double const size = std::cbrt(std::fabs(dot(at.x, cross(at.y, at.z))));
    vec3<double> const aim = transform_point(at, g.vector(-1, 1)), back = scale(g.direction(), 5 * size);
    ray<double> const r{sum(aim, back), -back, 0, 1e300};
    auto const exact = exact_quadric<double>(s).crossings(exactly(r.origin), exactly(r.direction), 1e-6);
    if (!exact.certain) continue;
    ray<F> const f{convert_vec<F>(r.origin), convert_vec<F>(r.direction), F(0), F(1e300)};
    auto const all = crossings(make_centred_ray(f.origin, f.direction), convert_quadric<F>(s));
    auto const once = crossings(make_centred_ray(r.origin, r.direction), s);
    std::size_t k = 0;
    for (int i = 0; i < 4; ++i) {
      REQUIRE(all.hit[i].valid == once.hit[i].valid);
      if (!all.hit[i].valid || !std::isfinite(all.hit[i].t.hi)) continue;
      REQUIRE(k < exact.crossings.size());
      exact_crossing const& c = exact.crossings[k++];
      if (c.cosine < 0.1) continue;
      double const scale = std::fabs(static_cast<double>(c.t)) + 1;
      worst =
          std::max(worst, std::fabs(static_cast<double>(real(all.hit[i].t.hi) + real(all.hit[i].t.lo) - c.t)) / scale);
      in_double = std::max(in_double, std::fabs(static_cast<double>(real(once.hit[i].t) - c.t)) / scale);
      ++compared;
    }
    REQUIRE(k == exact.crossings.size());
  }
  CAPTURE(worst, in_double, compared);
  CHECK(compared > 1500);
  CHECK(worst < 1e-27);
  CHECK(in_double > 1e-16);
}

TEST_CASE("intervals hold the crossings that they are certain of") {
  using I = interval<double>;
  unsigned const seed = 2;
  CAPTURE(seed);
  random_quadrics g(seed);
  int on_surface = 0, on_caps = 0, outer = 0;
  for (int n = 0; n < 3000; ++n) {
    CAPTURE(n);
    auto const at = g.place(3, 1);
    auto const s = g.surface(g.below(random_quadrics::kinds), at);
    double const size = std::cbrt(std::fabs(dot(at.x, cross(at.y, at.z))));
    vec3<double> const aim = transform_point(at, g.vector(-1, 1)), back = scale(g.direction(), 5 * size);
    real_vector const o = exactly(sum(aim, back)), d = exactly(-back);
    exact_quadric<double> const exact(s);
    auto roots = exact.roots(o, d);
    std::sort(roots.begin(), roots.end());
    real entry = -1e300, exit = 1e300;  // of the box
    for (int face = 1; face <= 3 && s.capped; ++face) {
      if (std::isinf(s.clip.lo[face - 1]) && std::isinf(s.clip.hi[face - 1])) continue;
      real const lo = exact.plane(-face, o, d), hi = exact.plane(face, o, d);
      entry = std::max(entry, std::min(lo, hi));
      exit = std::min(exit, std::max(lo, hi));
    }
    auto const all =
        crossings(make_centred_ray(convert_vec<I>(sum(aim, back)), convert_vec<I>(-back)), convert_quadric<I>(s));
    for (int i = 0; i < 4; ++i) {
      auto const& hit = all.hit[i];
      if (!hit.valid || roots.size() == 1) continue;
      REQUIRE((s.capped || roots.size() == 2));
      real t = i < 2 ? entry : exit;
      if (roots.size() == 2 && (i == 1 || i == 2)) t = std::clamp(roots[std::size_t(i - 1)], entry, exit);
      if (i == 0) REQUIRE((roots.size() == 2 && entry <= roots[0]));
      if (i == 3) REQUIRE((roots.size() == 2 && roots[1] <= exit));
      bool const has_face = hit.face.lo != 0 || hit.face.hi != 0;  // at an end of the box, or within rounding of one
      if (std::isinf(hit.t.lo) || std::isinf(hit.t.hi)) continue;
      REQUIRE((hit.t.lo <= t && t <= hit.t.hi));
      if (t == entry || t == exit) REQUIRE(has_face);
      on_surface += !has_face;
      on_caps += has_face;
      outer += i == 0 || i == 3;
    }
  }
  CAPTURE(on_surface, on_caps, outer);
  CHECK(on_surface > 2000);
  CHECK(on_caps > 300);
  CHECK(outer > 20);
}

TEMPLATE_TEST_CASE("short numbers hit and miss what is far from their last digit", "", half, (fixed<std::int16_t, 8>)) {
  using T = TestType;
  auto const ball = convert_quadric<T>(make_sphere(affine<double>::identity()));
  auto const can = convert_quadric<T>(make_cylinder(affine<double>::identity(), -0.5, 0.5, ends::capped));
  sphere<T> const quick{{T(0.0f), T(0.0f), T(0.0f)}, T(1.0f)};
  auto const at = [](float x, float y, float z) { return vec3<T>{T(x), T(y), T(z)}; };
  auto const hits = [&](auto const& s, vec3<T> const& o, vec3<T> const& d, float t) {
    auto const h = intersect(ray<T>{o, d, T(0.0f), T(7.0f)}, s);
    return h.valid && std::fabs(float(h.t) - t) < 0.02f;
  };
  CHECK(hits(ball, at(-2, 0, 0), at(1, 0, 0), 1));
  CHECK(hits(quick, at(-2, 0, 0), at(1, 0, 0), 1));
  CHECK(hits(can, at(-2, 0, 0), at(1, 0, 0), 1));
  CHECK(hits(can, at(0, 0.25f, 2), at(0, 0, -1), 1.5f));
  CHECK(hits(ball, at(0, 0, 0.5f), at(0, 0, -1), 1.5f));
  CHECK_FALSE(intersect(ray<T>{at(-2, 1.25f, 0), at(1, 0, 0), T(0.0f), T(7.0f)}, ball).valid);
  CHECK_FALSE(intersect(ray<T>{at(-2, 1.25f, 0), at(1, 0, 0), T(0.0f), T(7.0f)}, quick).valid);
  CHECK_FALSE(intersect(ray<T>{at(-2, 0, 0.75f), at(1, 0, 0), T(0.0f), T(7.0f)}, can).valid);
}
