// SPDX-License-Identifier: MIT
#include "intersect/exact_quadric.hpp"
#include "support/catch.hpp"

#include <patchrt/intersect/quadric_point.hpp>

#include <cmath>
#include <iomanip>
#include <iostream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Both crossings of a line with a sphere, exactly; none for a miss.
struct exact_span {
  bool meets;
  real t[2];
  double cosine;  ///< between ray and normals
};
template <class T> exact_span span_in(sphere<T> const& s, vec3<T> const& origin, vec3<T> const& direction) {
  real_vector const o = exactly(origin) - exactly(s.centre), d = exactly(direction);
  real const a = inner(d, d), h = inner(o, d), c = inner(o, o) - real(s.radius) * real(s.radius), disc = h * h - a * c;
  if (disc < 0) return {false, {}, 0};
  real const root = sqrt(disc);
  return {true, {(-h - root) / a, (-h + root) / a}, static_cast<double>(root / (sqrt(a) * abs(real(s.radius))))};
}

/// b^2 - 4 a c from the origin as it is.
template <class T> T naive_entry(sphere<T> const& s, vec3<T> const& origin, vec3<T> const& direction) {
  vec3<T> const o = difference(origin, s.centre);
  T const a = dot(direction, direction), b = 2 * dot(o, direction), c = dot(o, o) - s.radius * s.radius;
  return (-b - std::sqrt(b * b - 4 * a * c)) / (2 * a);
}
/// Without w: the point nearest the centre taken to be exact (Haines et al. as printed).
template <class T> T entry_as_printed(sphere<T> const& s, vec3<T> const& origin, vec3<T> const& direction) {
  vec3<T> const f = difference(origin, s.centre);
  T const a = dot(direction, direction), b = -dot(f, direction);
  vec3<T> const l = fma(b / a, direction, f);
  T const disc = s.radius * s.radius - dot(l, l), c = dot(f, f) - s.radius * s.radius;
  T const q = b + std::copysign(std::sqrt(a * disc), b);
  return std::min(c / q, q / a);
}

}  // namespace

TEMPLATE_TEST_CASE("t on a sphere is within the bound stated, and under 4 ulp a million radii away", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  random_quadrics g(seed);
  double const eps = double(std::numeric_limits<T>::epsilon());
  std::string lines[3];
  for (int decade = 0; decade <= 6; ++decade) {
    CAPTURE(decade);
    double worst = 0, naive = 0, printed = 0, of_bound = 0;
    int compared = 0;
    for (int n = 0; n < 4000; ++n) {
      double const size = std::pow(10., g.uniform(-4, 4));
      // centres on a grid of 2^-10 sizes, at most a few sizes from 0, and exact differences
      double const step = std::ldexp(1., std::ilogb(size) - 10);
      vec3<double> centre = g.vector(-4, 4);
      for (int k = 0; k < 3; ++k) centre[k] = n % 2 ? step * std::round(1024 * centre[k]) : 0;
      sphere<T> const s{convert_vec<T>(centre), T(size)};
      vec3<double> const away =
          scale(g.direction(), size * (decade == 6 ? 1e6 : std::pow(10., decade) * g.uniform(2, 9)));
      vec3<double> const aim = sum(centre, scale(g.vector(-0.55, 0.55), size));
      vec3<T> const o = convert_vec<T>(sum(aim, away)), d = convert_vec<T>(scale(away, -g.uniform(0.5, 2) / size));
      exact_span const wanted = span_in(s, o, d);
      auto const got = crossings(make_centred_ray(o, d), s);
      REQUIRE(wanted.meets);
      REQUIRE(got.real);
      if (wanted.cosine < 0.3) continue;
      double const speed = length(exactly(d));
      for (int k = 0; k < 2; ++k) {
        T const t = k ? got.t1 : got.t0;
        double const off = static_cast<double>(abs(real(t) - wanted.t[k])),
                     at = std::fabs(static_cast<double>(wanted.t[k]));
        double const bound = 0.5 * eps * at + 12 * eps * size / (speed * wanted.cosine);
        of_bound = std::max(of_bound, off / bound);
        worst = std::max(worst, ulps_between(t, wanted.t[k]));
      }
      auto const ulps_or_none = [&](T t) { return std::isfinite(t) ? ulps_between(t, wanted.t[0]) : 1e99; };
      naive = std::max(naive, ulps_or_none(naive_entry(s, o, d)));
      printed = std::max(printed, ulps_or_none(entry_as_printed(s, o, d)));
      ++compared;
    }
    CAPTURE(worst, naive, printed, of_bound, compared);
    CHECK(compared > 2000);
    CHECK(worst < 4);
    CHECK(of_bound <= 1);
    CHECK(naive > 4);
    double const errors[3] = {worst, printed, naive};
    for (int k = 0; k < 3; ++k) {
      std::ostringstream text;
      if (errors[k] == 1e99) text << " none";
      else text << ' ' << std::setprecision(2) << errors[k];
      lines[k] += text.str();
    }
  }
  std::cout << "sphere, worst ulp of t in " << (sizeof(T) == 4 ? "float" : "double") << " at 10^0 to 10^6 radii: here"
            << lines[0] << "; Haines et al. as printed" << lines[1] << "; naive" << lines[2] << '\n';
}

TEMPLATE_TEST_CASE("a corrected t on a sphere is rounded once, near its surface and far away", "", float, double) {
  using T = TestType;
  unsigned const seed = 3;
  CAPTURE(seed);
  random_quadrics g(seed);
  double const eps = double(std::numeric_limits<T>::epsilon());
  double worst = 0, before = 0, longest = 0;
  int compared = 0;
  for (int n = 0; n < 40000; ++n) {
    double const size = std::pow(10., g.uniform(-4, 4));
    sphere<T> const s{convert_vec<T>(scale(g.vector(-4, 4), size)), T(size)};
    // From just outside or inside to a million radii away.
    vec3<double> const normal = g.direction(), at = sum(convert_vec<double>(s.centre), scale(normal, size));
    double const away = size * std::pow(10., g.uniform(2 * std::log10(eps), 6)) * (n % 2 ? 1 : -1);
    vec3<double> const towards = sum(g.direction(), scale(normal, -1.2));
    vec3<T> const o = convert_vec<T>(difference(at, scale(towards, away))), d = convert_vec<T>(towards);
    exact_span const wanted = span_in(s, o, d);
    if (!wanted.meets || wanted.cosine < 0.1) continue;
    auto const ray = make_centred_ray(o, d);
    auto const found = crossings(ray, s);
    double const speed = length(exactly(d)), reach = size / (speed * wanted.cosine);
    for (int k = 0; k < 2; ++k) {
      double const t = static_cast<double>(wanted.t[k]);
      T const raw = k ? found.t1 : found.t0, corrected = correct_crossing(ray, s, raw);
      double const of_raw = 0.5 * eps * std::fabs(t) + 12 * eps * reach;
      double const bound = 0.5 * eps * std::fabs(t) + of_raw * of_raw / reach;
      double const off = static_cast<double>(abs(real(corrected) - wanted.t[k]));
      worst = std::max(worst, off / bound);
      before = std::max(before, static_cast<double>(abs(real(raw) - wanted.t[k])) / bound);
      longest = std::max(longest, std::fabs(t) / reach);
      ++compared;
    }
  }
  CAPTURE(compared, worst, before, longest);
  CHECK(compared > 40000);
  CHECK(worst <= 1);
  CHECK(before > 1000);
  CHECK(longest > 1e5);
}

TEMPLATE_TEST_CASE("a t that no step can correct stays as it is", "", float, double) {
  using T = TestType;
  T const nan = std::numeric_limits<T>::quiet_NaN();
  sphere<T> const unit{{0, 0, 0}, 1};
  auto const corrected = [&](vec3<T> const& o, vec3<T> const& d, sphere<T> const& s, T t) {
    return correct_crossing(make_centred_ray(o, d), s, t);
  };
  CHECK(corrected({-2, 1, 0}, {1, 0, 0}, unit, T(2)) == 2);            // touches: no slope
  CHECK(corrected({-2, 0, 0}, {1, 0, 0}, unit, T(1)) == 1);            // exact
  CHECK(corrected({-2, 2, 0}, {1, 0, 0}, unit, T(2)) == 2);            // passes
  CHECK(corrected({5, 6, 8}, {0, 0, -1}, {{5, 6, 7}, 0}, T(1)) == 1);  // a point
  CHECK(corrected({-2, 0, 0}, {0, 0, 0}, unit, T(1)) == 1);
  CHECK(corrected({nan, 0, 0}, {1, 0, 0}, unit, T(1)) == 1);
}

TEMPLATE_TEST_CASE("rays hit or miss a sphere as exact arithmetic says, up to rounding of its own size", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  random_quadrics g(seed);
  double const eps = double(std::numeric_limits<T>::epsilon());
  int wrong = 0, near = 0, hit = 0;
  for (int n = 0; n < 20000; ++n) {
    sphere<T> const s{{T(0), T(0), T(0)}, T(g.uniform(0.5, 2))};
    double const far = std::pow(10., g.uniform(0.5, 6));
    vec3<double> const away = scale(g.direction(), far);
    // towards the silhouette, to 1 +- 1e-6 radii or so
    vec3<double> across = cross(away, g.direction());
    across = scale(across, double(s.radius) * (1 + g.uniform(-1, 1) * std::pow(10., g.uniform(-8, 0))) /
                               std::sqrt(dot(across, across)));
    vec3<T> const o = convert_vec<T>(sum(away, across)), d = convert_vec<T>(away);
    exact_span const wanted = span_in(s, o, d);
    real_vector const eo = exactly(o), ed = exactly(d);
    real const square = inner(eo, eo) - inner(eo, ed) * inner(eo, ed) / inner(ed, ed);
    double const beside = std::fabs(static_cast<double>(sqrt(square)) / double(s.radius) - 1);
    bool const got = crossings(make_centred_ray(o, d), s).real;
    near += beside < 8 * eps;
    hit += got;
    wrong += beside >= 8 * eps && got != wanted.meets;
  }
  CAPTURE(near);
  CHECK(wrong == 0);
  CHECK((hit > 5000 && hit < 15000));
  CHECK(near < 2500);
}

TEMPLATE_TEST_CASE("hard rays at spheres have the crossings that they have", "", float, double) {
  using T = TestType;
  T const eps = std::numeric_limits<T>::epsilon(), inf = std::numeric_limits<T>::infinity();
  T const nan = std::numeric_limits<T>::quiet_NaN();
  sphere<T> const unit{{0, 0, 0}, 1};
  auto const t = [&](vec3<T> const& o, vec3<T> const& d, sphere<T> const& s) {
    auto const h = intersect(ray<T>{o, d, T(0), inf}, s);
    return h.valid ? h.t : T(-1);
  };
  CHECK(t({-2, 0, 0}, {1, 0, 0}, unit) == 1);
  CHECK(t({-2, 0, 0}, {4, 0, 0}, unit) == T(0.25));
  CHECK(t({0, 0, 0}, {0, 0, -2}, unit) == T(0.5));     // from the centre
  CHECK(t({1, 0, 0}, {1, 0, 0}, unit) == -1);          // leaves
  CHECK(t({1, 0, 0}, {-1, 0, 0}, unit) == 2);          // enters: t = 0 is not after 0
  CHECK(t({-1 - eps, 0, 0}, {1, 0, 0}, unit) == eps);  // just before
  CHECK(t({-2, 1, 0}, {1, 0, 0}, unit) == 2);          // touches
  CHECK(t({-2, 1 + eps, 0}, {1, 0, 0}, unit) == -1);
  CHECK(t({2, 0, 0}, {1, 0, 0}, unit) == -1);  // behind
  CHECK(t({T(-1e6), 0, 0}, {1, 0, 0}, unit) == T(999999));
  CHECK(t({0, 0, 2}, {0, 0, -1}, {{0, 0, -6371000}, 6371000}) == 2);  // Haines 2019: metres above a planet
  CHECK(t({5, 6, 8}, {0, 0, -1}, {{5, 6, 7}, T(0.5)}) == T(0.5));
  CHECK(t({5, 6, 8}, {0, 0, -1}, {{5, 6, 7}, 0}) == 1);  // a point
  for (int k = 0; k < 3; ++k) {
    for (T const bad : {nan, inf}) {
      vec3<T> o{-2, 0, 0}, d{1, 0, 0}, c{0, 0, 0};
      o[k] = bad;
      CHECK(t(o, {1, 0, 0}, unit) == -1);
      d[k] = bad;
      CHECK(t({-2, 0, 0}, d, unit) == -1);
      c[k] = bad;
      CHECK(t({-2, 0, 0}, {1, 0, 0}, {c, 1}) == -1);
    }
  }
  CHECK(t({-2, 0, 0}, {1, 0, 0}, {{0, 0, 0}, nan}) == -1);
  CHECK(t({-2, 0, 0}, {0, 0, 0}, unit) == -1);
  CHECK_FALSE(intersect(ray<T>{{-2, 0, 0}, {1, 0, 0}, nan, inf}, unit).valid);
  CHECK_FALSE(intersect(ray<T>{{-2, 0, 0}, {1, 0, 0}, T(0), nan}, unit).valid);
  CHECK_FALSE(intersect(ray<T>{{-2, 0, 0}, {1, 0, 0}, T(0), T(1)}, unit).valid);
  CHECK(intersect(ray<T>{{-2, 0, 0}, {1, 0, 0}, T(1), T(4)}, unit).t == 3);
}
