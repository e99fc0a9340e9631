// SPDX-License-Identifier: MIT
#include "intersect/exact_quadric.hpp"
#include "support/catch.hpp"

#include <patchrt/intersect/quadric_point.hpp>

#include <cmath>
#include <limits>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Of convex solids: what leaves them does not meet them again.
clipped_quadric<double> convex_solid(random_quadrics& g, std::size_t kind, affine<double> const& at) {
  switch (kind) {
    case 0:
      return make_sphere(at);
    case 1:
      return make_cylinder(at, -0.5, g.uniform(0, 2), ends::capped);
    case 2:
      return make_cone(at, 0, g.uniform(0.5, 2), ends::capped);
    case 3:
      return make_paraboloid(at, g.uniform(0.5, 2), ends::capped);
    case 4:
      return make_hyperboloid_two_sheets(at, 0, g.uniform(1.5, 3), ends::capped);
    default:
      return make_quadric(unit_sphere<double>(), at, {{-0.5, -2, -2}, {2, 0.75, 2}}, ends::capped);
  }
}

/// How near a point of a face is to the surface's other faces, in object space: at rims only one face is cleared.
template <class T> double distance_from_rims(clipped_quadric<T> const& s, vec3<T> const& position, int face) {
  exact_quadric<T> const exact(s);
  real_vector const x = exact.to_object(exactly(position), true);
  double nearest = face == 0 ? std::numeric_limits<double>::infinity() : std::fabs(static_cast<double>(exact.value(x)));
  for (std::size_t k = 0; k < 3; ++k) {
    if (int(k) + 1 == std::abs(face)) continue;
    nearest = std::min({nearest, std::fabs(static_cast<double>(x[k]) - double(s.clip.lo[int(k)])),
                        std::fabs(static_cast<double>(x[k]) - double(s.clip.hi[int(k)]))});
  }
  return nearest;
}

}  // namespace

TEMPLATE_TEST_CASE(
    "rays that leave a convex quadric outward never meet it again, inward ones once (pbrt's Reintersect)", "", float,
    double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  unsigned const seed = 7;
  CAPTURE(seed);
  random_quadrics g(seed);
  double const room = sizeof(T) == 4 ? 1e-3 : 1e-8;
  int starts = 0, met_again = 0, not_left = 0, on_caps = 0;
  double farthest = 0;
  for (int n = 0; n < 3000; ++n) {
    CAPTURE(n);
    std::size_t const kind = std::size_t(n) % 6;
    auto at = g.place(10, n % 2 ? 1 : 100);
    double const size = std::cbrt(std::fabs(dot(at.x, cross(at.y, at.z))));
    auto const placed_by = [&](affine<double> const& place, unsigned shape) {
      random_quadrics same(shape);
      return convex_solid(same, kind, place);
    };
    vec3<double> const inside = scale(g.vector(-0.4, 0.6), kind == 4 ? 2. : 1.);
    vec3<double> const back = scale(g.direction(), size * std::pow(10., g.uniform(0.7, 3)));
    if (n % 5 < 2) {  // the hit in the origin of space, where numbers are finest and position's roundings clear nothing
      vec3<double> const aim = transform_point(at, inside);
      auto const first = intersect(ray<double>{sum(aim, back), -back, 0, 1e300}, placed_by(at, unsigned(n)));
      at.translation = difference(at.translation, fma(first.valid ? first.t : 1., -back, sum(aim, back)));
    }
    auto const s = convert_quadric<T>(placed_by(at, unsigned(n)));
    vec3<double> const aim = transform_point(at, inside);
    ray<T> const r{convert_vec<T>(sum(aim, back)), convert_vec<T>(-back), T(0), inf};
    auto const line = make_centred_ray(r.origin, r.direction);
    auto const hit = intersect(line, s, r.t_min, r.t_max);
    if (!hit.valid) continue;
    auto const from = depart_from(line, s, hit);
    if (distance_from_rims(s, from.position, int(hit.face)) < room * (n % 2 ? 1 : 100)) continue;
    if (kind == 2 && length(exact_quadric<T>(s).to_object(exactly(from.position), true)) < 0.1) continue;  // the apex
    on_caps += hit.face != 0;
    farthest = std::max(farthest, double(from.clearance) / (size * double(std::numeric_limits<T>::epsilon())));
    for (int k = 0; k < 64; ++k) {
      vec3<T> d = convert_vec<T>(scale(g.direction(), g.uniform(0.1, 10)));
      if (k % 4 == 0) d = fma(-dot(d, from.normal) * T(g.uniform(0.99, 1)), from.normal, d);  // nearly tangent
      bool const outward = dot(d, from.normal) > 0;
      vec3<T> const start = offset_origin(from, d);
      auto const all = crossings(make_centred_ray(start, d), s);
      int after = 0;
      for (auto const& h : all.hit) after += h.valid && T(0) < h.t && h.t < inf;
      if (outward) met_again += after != 0;
      else not_left += after != 1;
      ++starts;
    }
  }
  CAPTURE(farthest);
  CHECK(starts > 50000);
  CHECK(on_caps > 100);
  CHECK(met_again == 0);
  CHECK(not_left == 0);
}

TEMPLATE_TEST_CASE("rays that leave open quadrics of all kinds do not meet them where they start", "", float, double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  unsigned const seed = 8;
  CAPTURE(seed);
  random_quadrics g(seed);
  int starts = 0, met_again = 0, wrong_side = 0;
  for (int n = 0; n < 3000; ++n) {
    CAPTURE(n);
    std::size_t const kind = g.below(random_quadrics::kinds);
    auto const at = g.place(10, n % 2 ? 1 : 30);
    auto s = convert_quadric<T>(g.surface(kind, at));
    s.capped = false;
    double const size = std::cbrt(std::fabs(dot(at.x, cross(at.y, at.z))));
    vec3<double> const aim = transform_point(at, g.vector(-1, 1)), back = scale(g.direction(), 10 * size);
    auto const line = make_centred_ray(convert_vec<T>(sum(aim, back)), convert_vec<T>(-back));
    exact_quadric<T> const exact(s);
    for (auto const& hit : crossings(line, s).hit) {
      if (!hit.valid) continue;
      auto const from = depart_from(line, s, hit);
      real_vector const x = exact.to_object(exactly(from.position), true);
      double const steep = length(exact.gradient(x)) * size;
      if (!(steep > 0.1)) continue;  // an apex
      for (int k = 0; k < 32; ++k) {
        vec3<T> const d = convert_vec<T>(g.direction());
        bool const outward = dot(d, from.normal) > 0;
        vec3<T> const start = offset_origin(from, d);
        wrong_side += (exact.value(exact.to_object(exactly(start), true)) > 0) != outward;
        // A surface that bends towards the ray is met at a distance of about the clearance over the angle.
        double const rise = std::fabs(double(dot(d, from.normal)));
        if (rise < 0.05) continue;
        auto const next = intersect(ray<T>{start, d, T(0), inf}, s);
        if (next.valid && double(next.t) < 2 * double(from.clearance) / rise) {
          bool is_there = false;  // where the surface bends that much
          for (auto const& c : exact.crossings(exactly(start), exactly(d), 0).crossings)
            is_there = is_there || (c.t > 0 && c.t < 4 * double(from.clearance) / rise);
          met_again += !is_there;
        }
        ++starts;
      }
    }
  }
  CHECK(starts > 40000);
  CHECK(met_again == 0);
  CHECK(wrong_side == 0);
}

TEMPLATE_TEST_CASE("rays that leave a sphere outward never meet it again, inward ones once", "", float, double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  unsigned const seed = 9;
  CAPTURE(seed);
  random_quadrics g(seed);
  int starts = 0, met_again = 0, not_left = 0;
  double beside = 0;
  for (int n = 0; n < 20000; ++n) {
    CAPTURE(n);
    double const size = std::pow(10., g.uniform(-4, 4));
    sphere<T> const s{convert_vec<T>(scale(g.direction(), size * std::pow(10., g.uniform(-2, 3)))), T(size)};
    vec3<double> const aim = sum(convert_vec<double>(s.centre), scale(g.vector(-0.7, 0.7), size));
    vec3<double> const back = scale(g.direction(), size * std::pow(10., g.uniform(0.7, 5)));
    ray<T> const r{convert_vec<T>(sum(aim, back)), convert_vec<T>(-back), T(0), inf};
    auto const line = make_centred_ray(r.origin, r.direction);
    auto const hit = intersect(r, s);
    if (!hit.valid) continue;
    auto const from = depart_from(line, s, hit);
    double const off = std::fabs(length(exactly(from.position) - exactly(s.centre)) / double(s.radius) - 1);
    double const ulps =
        double(std::numeric_limits<T>::epsilon()) * (4 + 2 * length(exactly(s.centre)) / double(s.radius));
    beside = std::max(beside, off / ulps);
    for (int k = 0; k < 8; ++k) {
      vec3<T> d = convert_vec<T>(scale(g.direction(), g.uniform(0.1, 10)));
      if (k % 2 == 0) d = fma(-dot(d, from.normal) * T(g.uniform(0.99, 1)), from.normal, d);
      bool const outward = dot(d, from.normal) > 0;
      auto const again = crossings(make_centred_ray(offset_origin(from, d), d), s);
      int const after = again.real ? (T(0) < again.t0) + (T(0) < again.t1) : 0;
      if (outward) met_again += after != 0;
      else not_left += after != 1;
      ++starts;
    }
  }
  CAPTURE(beside);
  CHECK(starts > 100000);
  CHECK(met_again == 0);
  CHECK(not_left == 0);
  CHECK(beside <= 1);
}
