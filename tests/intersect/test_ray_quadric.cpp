// SPDX-License-Identifier: MIT
#include "intersect/exact_quadric.hpp"
#include "support/catch.hpp"

#include <patchrt/intersect/quadric_point.hpp>

#include <cmath>
#include <iomanip>
#include <iostream>
#include <limits>
#include <numbers>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr double no_root = std::numeric_limits<double>::infinity();

template <class T> std::vector<quadric_hit<T>> valid_hits(quadric_crossings<T> const& c) {
  std::vector<quadric_hit<T>> all;
  for (auto const& h : c.hit)
    if (h.valid && std::isfinite(h.t)) all.push_back(h);
  return all;
}

/// The textbook: coefficients in space from the origin as it is, (-b -+ sqrt(b^2 - 4 a c)) / 2 a.
template <class T> void solve_naively(quadric<T> const& q, vec3<T> const& o, vec3<T> const& d, T (&t)[2]) {
  vec3<T> const qd = multiply(q, d), qo = multiply(q, o);
  T const a = dot(d, qd), b = 2 * dot(d, qo) + 2 * dot(d, q.linear);
  T const c = dot(o, qo) + 2 * dot(o, q.linear) + q.constant;
  T const s = std::sqrt(b * b - 4 * a * c);
  t[0] = std::min((-b - s) / (2 * a), (-b + s) / (2 * a));
  t[1] = std::max((-b - s) / (2 * a), (-b + s) / (2 * a));
}

/// A ray towards a point of object space, from `far` sizes away.
template <class T>
ray<T> aimed_ray(random_quadrics& g, affine<double> const& at, vec3<double> const& object, double far) {
  double const size = std::cbrt(std::fabs(dot(at.x, cross(at.y, at.z))));
  vec3<double> const aim = transform_point(at, object), away = scale(g.direction(), size * far);
  return {convert_vec<T>(sum(aim, away)), convert_vec<T>(scale(away, -g.uniform(0.1, 2) / (size * far))), T(0),
          std::numeric_limits<T>::infinity()};
}

}  // namespace

TEMPLATE_TEST_CASE("roots of unit surfaces are within 4 ulp from 2 to a million radii away where rays do not graze", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  random_quadrics g(seed);
  affine<double> const here = affine<double>::identity();
  clipped_quadric<T> const surfaces[] = {
      convert_quadric<T>(make_sphere(here)),
      convert_quadric<T>(make_cylinder(here, -4, 4)),
      convert_quadric<T>(make_cone(here, -4, 4)),
      convert_quadric<T>(make_paraboloid(here, 4)),
      convert_quadric<T>(make_hyperboloid_one_sheet(here, -4, 4)),
      convert_quadric<T>(make_hyperboloid_two_sheets(here, -4, 4)),
      convert_quadric<T>(make_plane(here)),
  };
  char const* const names[] = {"sphere", "cylinder", "cone", "paraboloid", "one sheet", "two sheets", "plane"};
  for (int k = 0; k < 7; ++k) {
    CAPTURE(names[k]);
    exact_quadric<T> const exact(surfaces[k]);
    std::string line;
    for (int decade = 0; decade <= 6; ++decade) {
      CAPTURE(decade);
      double worst = 0, naive_worst = 0;
      int compared = 0;
      for (int n = 0; n < 300; ++n) {
        double const far = decade == 6 ? 1e6 : 2 * std::pow(10., decade) * g.uniform(1, 5);
        auto const r = aimed_ray<T>(g, here, g.vector(-0.8, 0.8), far);
        exact_answer const wanted = exact.crossings(exactly(r.origin), exactly(r.direction), 1e-3);
        T naive[2];
        solve_naively(surfaces[k].form, r.origin, r.direction, naive);
        for (auto const& hit : valid_hits(crossings(make_centred_ray(r.origin, r.direction), surfaces[k]))) {
          exact_crossing const* nearest = nullptr;
          for (exact_crossing const& c : wanted.crossings)
            if (!nearest || abs(c.t - real(hit.t)) < abs(nearest->t - real(hit.t))) nearest = &c;
          if (!nearest || nearest->cosine < 0.5) continue;
          if (abs(nearest->t) * length(exactly(r.direction)) < 0.5)
            continue;  // not 2 radii from the surface's own middle
          worst = std::max(worst, ulps_between(hit.t, nearest->t));
          double const e = std::min(ulps_between(naive[0], nearest->t), ulps_between(naive[1], nearest->t));
          naive_worst = std::max(naive_worst, std::isfinite(e) ? e : no_root);
          ++compared;
        }
      }
      CAPTURE(worst, naive_worst, compared);
      CHECK(compared > 50);
      CHECK(worst < 4);
      if (k < 6) CHECK(naive_worst > 2 * std::pow(10., std::min(decade, 4)));
      std::ostringstream text;
      text << std::setprecision(2) << "  " << worst << '/' << (naive_worst == no_root ? "none" : "");
      if (naive_worst != no_root) text << naive_worst;
      line += text.str();
    }
    std::cout << names[k] << ", ulp of t in " << (sizeof(T) == 4 ? "float" : "double")
              << " at 10^0 to 10^6 radii, here/naive:" << line << '\n';
  }
}

TEMPLATE_TEST_CASE("crossings of any quadric in any place are those of exact arithmetic, within the error stated", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  random_quadrics g(seed);
  double const margin = sizeof(T) == 4 ? 1e-3 : 1e-9, eps = double(std::numeric_limits<T>::epsilon());
  int certain = 0, compared = 0, bounded = 0, on_caps = 0;
  double worst = 0;
  std::vector<double> tightness;
  for (int n = 0; n < 8000; ++n) {
    CAPTURE(n);
    std::size_t const kind = g.below(random_quadrics::kinds);
    CAPTURE(kind);
    auto const at = g.place(sizeof(T) == 4 ? 10 : 100, n % 2 ? 10 : 0);
    auto const s = convert_quadric<T>(g.surface(kind, at));
    double const far = std::pow(10., g.uniform(-1, n % 3 ? 1 : sizeof(T) == 4 ? 2 : 5));
    auto const r = aimed_ray<T>(g, at, g.vector(-1.2, 1.2), far);
    auto const line = make_centred_ray(r.origin, r.direction);
    exact_quadric<T> const exact(s);
    real_vector const o = exactly(r.origin), d = exactly(r.direction);
    exact_answer const wanted = exact.crossings(o, d, margin);
    auto const got = valid_hits(crossings(line, s));
    // Of an origin far away, and of a surface far from 0, rounding alone may be more than the margin.
    bool const comparable =
        wanted.certain && (far + length(exactly(s.centre)) * length(exact.row(0))) * eps * 1e3 < margin;
    certain += comparable;
    if (comparable) REQUIRE(got.size() == wanted.crossings.size());
    for (std::size_t k = 0; k < got.size(); ++k) {
      auto const p = point_at(line, s, got[k]);
      if (!std::isfinite(p.error)) continue;
      ++bounded;
      // The crossing that it is of: with the same face, the nearest, in the box or not.
      std::vector<real> candidates =
          got[k].face == 0 ? exact.roots(o, d) : std::vector<real>{exact.plane(int(got[k].face), o, d)};
      REQUIRE_FALSE(candidates.empty());
      double distance = no_root;
      for (real const& t : candidates) distance = std::min(distance, length(exactly(p.position) - along(o, t, d)));
      REQUIRE(distance <= double(p.error));
      worst = std::max(worst, distance / double(p.error));
      tightness.push_back(distance / double(p.error));
      if (comparable) {
        REQUIRE(int(got[k].face) == wanted.crossings[k].face);
        on_caps += got[k].face != 0;
        ++compared;
      }
      if (comparable && wanted.crossings[k].cosine > 0.1) {
        real_vector const x = exact.to_object(along(o, wanted.crossings[k].t, d), true);
        real_vector normal =
            got[k].face == 0 ? exact.gradient(x) : exact.row(std::size_t(std::abs(int(got[k].face)) - 1));
        double const sign = got[k].face < 0 ? -1 : 1, size = length(normal);
        if (size > 1e-2 * length(exact.row(0)))
          for (std::size_t i = 0; i < 3; ++i)
            REQUIRE(std::fabs(double(p.normal[int(i)]) - sign * static_cast<double>(normal[i]) / size) < 100 * margin);
      }
    }
  }
  std::nth_element(tightness.begin(), tightness.begin() + std::ptrdiff_t(tightness.size() / 2), tightness.end());
  double const median = tightness[tightness.size() / 2];
  CAPTURE(certain, compared, bounded, on_caps, worst, median);
  CHECK(certain > 4000);
  CHECK(compared > 3000);
  CHECK(on_caps > 300);
  CHECK(worst > 0.05);
  CHECK(median > 0.002);
  std::cout << "error of positions over its bound: greatest " << worst << ", median " << median << ", of " << bounded
            << '\n';
}

TEMPLATE_TEST_CASE("a ray goes into and out of a capped quadric by turns, through outward normals", "", float, double) {
  using T = TestType;
  unsigned const seed = 3;
  CAPTURE(seed);
  random_quadrics g(seed);
  int pairs = 0, four = 0;
  for (int n = 0; n < 10000; ++n) {
    CAPTURE(n);
    auto const at = g.place(10, 3);
    auto s = convert_quadric<T>(g.surface(1 + g.below(5), at));
    s.capped = true;
    if (!(s.clip.lo.z > -10)) s.clip.lo.z = T(-1);
    auto const r = aimed_ray<T>(g, at, g.vector(-1, 1), g.uniform(1, 10));
    auto const line = make_centred_ray(r.origin, r.direction);
    auto const hits = valid_hits(crossings(line, s));
    REQUIRE(hits.size() % 2 == 0);  // what is closed is left as often as entered
    for (std::size_t k = 0; k < hits.size(); ++k) {
      if (k > 0) REQUIRE(hits[k - 1].t <= hits[k].t);
      auto const p = point_at(line, s, hits[k]);
      T const slope = dot(p.normal, r.direction);
      if (std::isfinite(p.error) && std::fabs(slope) > T(1e-3) * std::sqrt(dot(r.direction, r.direction)))
        REQUIRE((slope < 0) == (k % 2 == 0));
    }
    pairs += hits.size() == 2;
    four += hits.size() == 4;
  }
  CHECK(pairs > 1000);
  CHECK(four > 15);
}

TEMPLATE_TEST_CASE("halfway between a ray's way into a capped quadric and out of it is inside, beyond outside", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 5;
  CAPTURE(seed);
  random_quadrics g(seed);
  double const margin = sizeof(T) == 4 ? 1e-3 : 1e-12;
  auto const surface = [](int kind, affine<double> const& at) {
    switch (kind) {
      case 0:
        return make_cone(at, -1, 1, ends::capped);
      case 1:
        return make_hyperboloid_one_sheet(at, -2, 2, ends::capped);
      case 2:
        return make_hyperboloid_two_sheets(at, -2, 2, ends::capped);
      case 3:
        return make_cylinder(at, -1, 1, ends::capped);
      default:
        return make_quadric(unit_sphere<double>(), at, {{-0.75, -0.5, -2}, {2, 0.75, 0.5}}, ends::capped);
    }
  };
  for (int kind = 0; kind < 5; ++kind) {
    CAPTURE(kind);
    int met = 0, four = 0;
    for (int n = 0; n < 8000; ++n) {
      CAPTURE(n);
      auto const at = g.place(4, 3);
      auto const s = convert_quadric<T>(surface(kind, at));
      auto const r = aimed_ray<T>(g, at, g.vector(-1.2, 1.2), g.uniform(3, 10));
      exact_quadric<T> const exact(s);
      real_vector const o = exactly(r.origin), d = exactly(r.direction);
      auto const hits = valid_hits(crossings(make_centred_ray(r.origin, r.direction), s));
      REQUIRE(hits.size() % 2 == 0);
      for (std::size_t k = 1; k < hits.size(); ++k) {
        REQUIRE(hits[k - 1].t <= hits[k].t);
        real_vector const x = exact.to_object(along(o, (real(hits[k - 1].t) + real(hits[k].t)) / 2, d), true);
        double const f = static_cast<double>(exact.value(x)), off = margin * (1 + static_cast<double>(inner(x, x)));
        REQUIRE((k % 2 ? f <= off : f >= -off));
        for (int i = 0; i < 3; ++i) {
          REQUIRE(x[std::size_t(i)] >= real(s.clip.lo[i]) - margin);
          REQUIRE(x[std::size_t(i)] <= real(s.clip.hi[i]) + margin);
        }
      }
      met += !hits.empty();
      four += hits.size() == 4;
    }
    CAPTURE(met, four);
    CHECK(met > 2000);
    CHECK((kind < 3 ? four > 300 : four == 0));
  }
}

TEMPLATE_TEST_CASE(
    "what is at an end of the box has the cap's face, at an edge that of the way in, then of the way out", "", float,
    double) {
  using T = TestType;
  auto const faces = [](box<double> const& clip, vec3<T> const& o, vec3<T> const& d) {
    auto const s =
        convert_quadric<T>(make_quadric(unit_sphere<double>(), affine<double>::identity(), clip, ends::capped));
    auto const line = make_centred_ray(o, d);
    auto const all = crossings(line, s);
    auto const hits = valid_hits(all);
    REQUIRE(hits.size() == 2);
    CHECK(nearest(all, T(0), T(9)).face == hits[0].face);
    CHECK(intersect(line, s, T(0), T(9)).face == hits[0].face);
    return std::vector<T>{hits[0].t, hits[0].face, hits[1].t, hits[1].face};
  };
  CHECK(faces({vec3<double>(-1), vec3<double>(1)}, {-2, 0, 0}, {1, 0, 0}) == std::vector<T>{1, -1, 3, 1});
  CHECK(faces({vec3<double>(-1), vec3<double>(2)}, {-2, 0, 0}, {1, 0, 0}) == std::vector<T>{1, -1, 3, 0});
  CHECK(faces({vec3<double>(-0.5), vec3<double>(0.5)}, {T(-1.5), 0, T(-0.5)}, {1, 0, 1}) ==
        std::vector<T>{1, -1, 1, 3});
}

TEMPLATE_TEST_CASE("no ray gets into a can through its rim", "", float, double) {
  using T = TestType;
  unsigned const seed = 4;
  CAPTURE(seed);
  random_quadrics g(seed);
  int lost = 0;
  for (int n = 0; n < 20000; ++n) {
    auto const at = g.place(10, 3);
    bool const cone = n % 2;
    auto const s =
        convert_quadric<T>(cone ? make_cone(at, 0.25, 1, ends::capped) : make_cylinder(at, 0, 1, ends::capped));
    double const turn = g.uniform(0, 2 * std::numbers::pi), inward = g.uniform(0.01, 1);
    // from outside through a point of the rim to a point of the axis: through the inside, whatever rounding does
    vec3<double> const rim{std::cos(turn), std::sin(turn), 1}, middle{0, 0, g.uniform(0.3, 0.9)};
    vec3<double> const from = sum(rim, scale(difference(rim, middle), inward * 3));
    vec3<double> const a = transform_point(at, from), b = transform_point(at, middle);
    ray<T> const r{convert_vec<T>(a), convert_vec<T>(difference(b, a)), T(0), T(1)};
    lost += !intersect(r, s).valid;
  }
  CHECK(lost == 0);
}

TEMPLATE_TEST_CASE("hard rays have the crossings of exact arithmetic", "", float, double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  T const eps = std::numeric_limits<T>::epsilon(), far = T(1e6);
  affine<double> const here = affine<double>::identity();
  auto const thin = affine<double>::scaling({1, 1, 1e-5});
  struct row {
    char const* origin;
    clipped_quadric<double> surface;
    vec3<T> from, direction;
    std::vector<T> t;
  };
  auto const cylinder = make_cylinder(here, 0, 1), can = make_cylinder(here, 0, 1, ends::capped);
  auto const cone = make_cone(here, 0, 1), capped_cone = make_cone(here, 0, 1, ends::capped);
  auto const both = make_cone(here, -1, 1), bowl = make_paraboloid(here, 1), ball = make_sphere(here);
  auto const saddle = make_quadric({{1, -1, 0}, {0, 0, 0}, {0, 0, T(-0.5)}, 0}, here, {{-1, -1, -1}, {1, 1, 1}});
  row const rows[] = {
      {"PEERS: a = 0, a generator of the cone from below: it lies in it", cone, {1, 0, -1}, {-1, 0, 1}, {}},
      {"PEERS: a = 0, parallel to a generator", cone, {T(0.5), 0, 0}, {T(-0.5), 0, T(0.5)}, {T(0.5)}},
      {"PEERS: a = 0, the axis of the paraboloid", bowl, {0, 0, 2}, {0, 0, -1}, {2}},
      {"PEERS: a = 0, parallel to that axis", bowl, {T(0.5), 0, 2}, {0, 0, -1}, {T(1.75)}},
      {"PEERS: a = h = 0, the axis of a cylinder", cylinder, {0, 0, 2}, {0, 0, -1}, {}},
      {"PEERS: a = h = 0, a generator of a cylinder lies in it", cylinder, {1, 0, 2}, {0, 0, -1}, {}},
      {"PEERS: the axis of a can, through both caps", can, {0, 0, 2}, {0, 0, -1}, {1, 2}},
      {"Q15: outside a can along its axis", can, {2, 0, 2}, {0, 0, -1}, {}},
      {"Q15: a can from the side", can, {-2, 0, T(0.5)}, {1, 0, 0}, {1, 3}},
      {"Q15: in by a cap, out by the side", can, {0, 0, 2}, {1, 0, -2}, {T(0.5), 1}},
      {"Q15: a tube from the end, the near root is clipped away",
       cylinder,
       {T(-0.5), 0, T(1.5)},
       {1, 0, T(-0.75)},
       {T(1.5)}},
      {"Q15: from inside a tube", cylinder, {0, 0, T(0.5)}, {0, 1, 0}, {-1, 1}},
      {"PEERS: a tangent of the sphere", ball, {-2, 1, 0}, {1, 0, 0}, {2, 2}},
      {"PEERS: a tangent, one ulp inside",
       ball,
       {-2, 1 - eps / 2, 0},
       {1, 0, 0},
       {2 - std::sqrt(eps), 2 + std::sqrt(eps)}},
      {"PEERS: a tangent, one ulp outside", ball, {-2, 1 + eps, 0}, {1, 0, 0}, {}},
      {"PEERS: the origin on the sphere, outward", ball, {1, 0, 0}, {1, 0, 0}, {-2, 0}},
      {"PEERS: the origin on the sphere, across", ball, {0, 1, 0}, {0, -2, 0}, {0, 1}},
      {"PEERS: the origin inside", ball, {0, 0, T(0.5)}, {0, 0, 1}, {T(-1.5), T(0.5)}},
      {"PEERS: the origin in the centre", ball, {0, 0, 0}, {0, 4, 0}, {T(-0.25), T(0.25)}},
      {"PEERS: an origin far away", ball, {-far, 0, 0}, {1, 0, 0}, {far - 1, far + 1}},
      {"PEERS: an origin far away, b^2 - 4 a c cancels",
       ball,
       {-far, T(0.5), 0},
       {1, 0, 0},
       {T(999999.13397459621556L), T(1000000.8660254037844L)}},
      {"PEERS: t just above 0", ball, {-1 - eps, 0, 0}, {1, 0, 0}, {eps, 2 + eps}},
      {"PEERS: a long direction", ball, {-2, 0, 0}, {1024, 0, 0}, {T(0x1p-10), T(3 * 0x1p-10)}},
      {"PEERS: a short direction", ball, {-2, 0, 0}, {T(0x1p-20), 0, 0}, {T(0x1p20), T(3 * 0x1p20)}},
      {"PEERS: a plane as quadric", make_plane(here), {1, 2, 3}, {0, 0, -2}, {T(1.5)}},
      {"PEERS: a plane as quadric, far from its centre", make_plane(here), {far, 2, 3}, {1, 0, -1}, {3}},
      {"PEERS: a ray in the plane", make_plane(here), {1, 2, 0}, {1, 0, 0}, {}},
      {"PEERS: a ray beside the plane", make_plane(here), {1, 2, 1}, {1, 0, 0}, {}},
      {"PEERS: a near-degenerate map, a flat ellipsoid",
       make_sphere(thin),
       {0, 0, 1},
       {0, 0, -1},
       {T(1 - 1e-5), T(1 + 1e-5)}},
      {"the edge of a flat ellipsoid", make_sphere(thin), {2, 0, 0}, {-1, 0, 0}, {1, 3}},
      {"the apex of a cone, along the axis, is touched", cone, {0, 0, -1}, {0, 0, 1}, {1, 1}},
      {"the apex of a cone, across", cone, {-1, 0, 0}, {1, 0, 0}, {1, 1}},
      {"the axis of a capped cone: cap, apex twice, the box's end there",
       capped_cone,
       {0, 0, 2},
       {0, 0, -1},
       {1, 2, 2, 2}},
      {"both nappes", both, {T(-0.5), 0, -1}, {T(0.5), 0, 2}, {T(1) / 3, T(0.6)}},
      {"a ray through the rim of a cone, from outside", cone, {2, 0, 2}, {-1, 0, -1}, {}},
      {"a ray in the plane of a cap", can, {-2, 0, 1}, {1, 0, 0}, {1, 3}},
      {"a ray in the plane of the other cap, -0 its height", can, {-2, 0, T(-0.0)}, {1, 0, T(-0.0)}, {1, 3}},
      {"a ray through both rims of a can", can, {-3, 0, T(-0.5)}, {2, 0, T(0.5)}, {1, 2}},
      {"a saddle along an asymptote, in it", saddle, {0, 0, 0}, {1, 1, 0}, {}},
      {"a saddle across, beyond its box", saddle, {0, 2, T(0.25)}, {0, -1, 0}, {}},
      {"a saddle from above", saddle, {T(0.5), T(0.25), 2}, {0, 0, -1}, {T(1.8125)}},
      {"Haines 2019: a ball as big as a planet's radius in metres",
       make_ellipsoid({0, 0, -6371000}, vec3<double>(6371000.)),
       {0, 0, 2},
       {0, 0, -1},
       {2, 12742002}},
      {"an infinite box, capped, is the surface alone",
       make_quadric(unit_sphere<double>(), here, whole_space<double>(), ends::capped),
       {-2, 0, 0},
       {1, 0, 0},
       {1, 3}},
      {"a box inside the ball, capped: its faces",
       make_quadric(unit_sphere<double>(), here, {vec3<double>(-0.5), vec3<double>(0.5)}, ends::capped),
       {-2, 0, 0},
       {1, 0, 0},
       {T(1.5), T(2.5)}},
      {"the same box, open",
       make_quadric(unit_sphere<double>(), here, {{-0.5, -0.5, -2}, {0.5, 0.5, 2}}),
       {-2, 0, 0},
       {1, 0, 0},
       {}},
  };
  for (row const& r : rows) {
    INFO(r.origin);
    auto const s = convert_quadric<T>(r.surface);
    auto const hits = valid_hits(crossings(make_centred_ray(r.from, r.direction), s));
    CAPTURE(hits.size());
    REQUIRE(hits.size() == r.t.size());
    if (s.capped) CHECK(hits.size() % 2 == 0);  // into the solid and out of it
    for (std::size_t k = 0; k < hits.size(); ++k) {
      CAPTURE(k, hits[k].t, r.t[k]);
      CHECK(std::fabs(hits[k].t - r.t[k]) <=
            4 * eps *
                std::max(std::fabs(r.t[k]),
                         std::max(T(1), r.t.back() * T(0.5)) / std::sqrt(dot(r.direction, r.direction))));
    }
    for (std::size_t k = 0; k < hits.size(); ++k) {  // each is found where the range of t ends just before and after it
      if (k > 0 && hits[k - 1].t == hits[k].t) continue;
      auto const first = intersect(ray<T>{r.from, r.direction, std::nextafter(hits[k].t, -inf), inf}, s);
      CHECK((first.valid && first.t == hits[k].t));
      auto const next = intersect(ray<T>{r.from, r.direction, hits[k].t, inf}, s);
      CHECK((!next.valid || next.t > hits[k].t));
      CHECK_FALSE(intersect(ray<T>{r.from, r.direction, std::nextafter(hits[k].t, -inf), hits[k].t}, s).valid);
    }
  }
}

TEMPLATE_TEST_CASE("a tangent and an apex count by choice", "", float, double) {
  using T = TestType;
  auto const ball = convert_quadric<T>(make_sphere(affine<double>::identity()));
  auto const cone = convert_quadric<T>(make_cone(affine<double>::identity(), -1, 0, ends::capped));
  auto const meets = [](auto const& choice, auto const& s, vec3<T> const& o, vec3<T> const& d) {
    constexpr tangent touch = std::decay_t<decltype(choice)>::value;
    return intersect<touch>(ray<T>{o, d, T(0), T(100)}, s);
  };
  std::integral_constant<tangent, tangent::hit> const hit{};
  std::integral_constant<tangent, tangent::miss> const miss{};
  CHECK(meets(hit, ball, {-2, 1, 0}, {1, 0, 0}).valid);
  CHECK_FALSE(meets(miss, ball, {-2, 1, 0}, {1, 0, 0}).valid);
  CHECK(meets(miss, ball, {-2, T(0.999), 0}, {1, 0, 0}).valid);
  CHECK(meets(hit, cone, {0, 0, 1}, {0, 0, -1}).t == 1);
  CHECK(meets(miss, cone, {0, 0, -2}, {0, 0, 1}).t == 1);  // the cap all the same
}

TEMPLATE_TEST_CASE("a number that is NaN anywhere, and a direction of zero, hit nothing", "", float, double) {
  using T = TestType;
  T const nan = std::numeric_limits<T>::quiet_NaN(), inf = std::numeric_limits<T>::infinity();
  auto const any_hit = [&](clipped_quadric<T> const& s, vec3<T> const& o, vec3<T> const& d) {
    return !valid_hits(crossings(make_centred_ray(o, d), s)).empty();
  };
  for (ends const end : {ends::open, ends::capped}) {
    auto const can = convert_quadric<T>(make_cylinder(affine<double>::identity(), -1, 1, end));
    vec3<T> const o{-2, 0, T(0.25)}, d{1, T(0.125), T(0.0625)};
    REQUIRE(any_hit(can, o, d));
    CHECK_FALSE(any_hit(can, o, {0, 0, 0}));
    CHECK_FALSE(any_hit(can, o, {T(-0.0), 0, 0}));
    for (int k = 0; k < 3; ++k) {
      for (T const bad : {nan, inf}) {
        vec3<T> p = o, e = d;
        p[k] = bad;
        CHECK_FALSE(any_hit(can, p, d));
        e[k] = bad;
        CHECK_FALSE(any_hit(can, o, e));
      }
      auto s = can;
      s.form.squares[k] = nan;
      CHECK_FALSE(any_hit(s, o, d));
      s = can, s.form.products[k] = nan;
      CHECK_FALSE(any_hit(s, o, d));
      s = can, s.form.linear[k] = nan;
      CHECK_FALSE(any_hit(s, o, d));
      s = can, s.form.constant = nan;
      CHECK_FALSE(any_hit(s, o, d));
      s = can, s.clip.lo[k] = nan;
      CHECK_FALSE(any_hit(s, o, d));
      s = can, s.clip.hi[k] = nan;
      CHECK_FALSE(any_hit(s, o, d));
      s = can, s.centre[k] = nan;
      CHECK_FALSE(any_hit(s, o, d));
      for (int j = 0; j < 3; ++j) {
        s = can, s.rows[j][k] = nan;
        CHECK_FALSE(any_hit(s, o, d));
      }
    }
    CHECK_FALSE(intersect(ray<T>{o, d, nan, T(100)}, can).valid);
    CHECK_FALSE(intersect(ray<T>{o, d, T(0), nan}, can).valid);
    CHECK_FALSE(intersect(ray<T>{o, d, T(100), T(0)}, can).valid);
  }
}
