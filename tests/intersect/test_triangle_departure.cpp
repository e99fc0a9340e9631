// SPDX-License-Identifier: MIT
#include <intersect/triangle_oracle.hpp>
#include <intersect/triangle_rays.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/intersect/triangle_departure.hpp>
#include <patchrt/numbers/pack.hpp>
#include <support/catch.hpp>

#include <cstdlib>
#include <cstring>

using namespace patchrt;
using namespace patchrt::test;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

/// Triangles whose coordinates are each of any size from 1e-8 to 1e8, and ones of one size beside 0 or far from it.
template <class T> triangle<T> any_triangle(random_triangle_rays& random, int kind) {
  auto const any = [&] { return std::pow(10., random.uniform(-8, 8)) * (random.pick(2) ? 1 : -1); };
  if (kind == 0) {
    triangle<double> t;
    for (auto* p : {&t.a, &t.b, &t.c})
      for (int c = 0; c < 3; ++c) (*p)[c] = any();
    return random_triangle_rays::rounded<T>(t);
  }
  double const size = std::pow(10., random.uniform(-8, 4));
  return random_triangle_rays::placed<T>(random.any_shape(1e-6), size, random.in_cube() * (kind == 1 ? 0 : size * 1e4));
}

template <class T> vec3<double> unit_normal(triangle<T> const& t) {
  vec3<double> const n = normal(triangle<double>{vec3<double>(t.a), vec3<double>(t.b), vec3<double>(t.c)});
  return n / std::sqrt(dot(n, n));
}

}  // namespace

TEMPLATE_TEST_CASE("a ray that leaves a triangle does not meet it again", "", (form_over<engine_form, float>),
                   (form_over<moller_trumbore_form, float>), (form_over<watertight_form, float>),
                   (form_over<engine_form, double>), (form_over<moller_trumbore_form, double>),
                   (form_over<watertight_form, double>)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  unsigned const seed = 40501u;
  char const* const many = std::getenv("PATCHRT_SPAWNED_RAYS");  // 1000 at night
  int const spawned = many ? std::atoi(many) : 100;
  CAPTURE(seed, spawned);
  random_triangle_rays random(seed);
  std::size_t again = 0, from_the_surface = 0, rays = 0;
  for (int k = 0; k < 1000; ++k) {
    auto const t = any_triangle<T>(random, k % 3);
    auto const prepared = Form::prepare(t);
    T const clear = clearance<T>(t);
    vec3<double> const n = unit_normal(t);
    for (int i = 0; i < spawned; ++i) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      if (i % 10 == 0) u = 0;
      if (i % 20 == 0) v = 0;
      vec3<double> way = random.direction();
      if (i % 4 == 0) way = cross(n, way) + n * (std::pow(10., random.uniform(-9, -1)));  // all but along the triangle
      vec3<T> const d = random_triangle_rays::rounded<T>(way);
      auto const from = depart_from(t, T(u), T(v), clear);
      auto const met = [&](vec3<T> const& start) {
        return intersect<Form>(Form::make_ray(start, d), prepared, T(0), T(inf)).valid;
      };
      again += met(offset_origin(from, d));
      from_the_surface += met(from.position);
      ++rays;
    }
  }
  CAPTURE(from_the_surface, rays);
  CHECK(again == 0);
  CHECK(from_the_surface > rays / 5);
}

TEMPLATE_TEST_CASE("a start lies on the side that its direction points to, as far as clearance says", "", float,
                   double) {
  using T = TestType;
  double const eps = std::numeric_limits<T>::epsilon();
  unsigned const seed = 40502u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  for (int k = 0; k < 4000; ++k) {
    CAPTURE(k);
    auto const t = random_triangle_rays::placed<T>(random.any_shape(0.05), std::pow(10., random.uniform(-6, 6)),
                                                   random.in_cube() * std::pow(10., random.uniform(-3, 6)));
    vec3<double> const n = unit_normal(t), way = random.direction();
    if (std::fabs(dot(n, way)) < 0.01 || !(dot(n, n) > 0.5)) continue;
    auto const from = depart_from(t, T(0.25), T(0.5));
    vec3<T> const start = offset_origin(from, random_triangle_rays::rounded<T>(way));
    double const size = double(sum_of_magnitudes(extent(bounds(t))));
    double const above = dot(vec3<double>(start) - vec3<double>(t.a), n) * (dot(n, way) > 0 ? 1 : -1);
    double const rounding = 4 * eps * double(sum_of_magnitudes(from.position));
    CHECK(double(from.clearance) == double(clearance<T>(t)));
    CHECK(above > 0.9 * double(from.clearance));
    CHECK(above < 1.1 * double(from.clearance) + 1.5 * rounding);
    CHECK(double(from.clearance) >= 16 * eps * size);
    CHECK(double(from.clearance) <= 2 * size);
    vec3<double> const middle = vec3<double>(t.a) * 0.25 + vec3<double>(t.b) * 0.25 + vec3<double>(t.c) * 0.5;
    vec3<double> const off = vec3<double>(from.position) - middle;
    CHECK(std::sqrt(dot(off, off)) <= eps * (2 * size + double(sum_of_magnitudes(from.position))));
  }
}

TEST_CASE("clearance scales with a triangle, does not depend on where it is, and is small for all but needles") {
  triangle<double> const t{{0, 0, 0}, {1, 0.25, 0}, {0.25, 1, 0.5}};
  triangle<double> const moved{t.a + 1024., t.b + 1024., t.c + 1024.},
      scaled{t.a * 0x1p-30, t.b * 0x1p-30, t.c * 0x1p-30};
  double const clear = clearance<double>(t);
  CHECK(clear < 4e-14);
  CHECK(clearance<double>(moved) == clear);
  CHECK(clearance<double>(scaled) == clear * 0x1p-30);
  CHECK(clearance<float>(t) == Approx(clear * 0x1p29));
  triangle<double> const needle{{0, 0, 0}, {1, 1, 1}, {1, 1, 1 + 1e-9}};
  CHECK(clearance<double>(needle) > 1e3 * clear);
  CHECK(clearance<double>(needle) < 1e-4);
}

TEST_CASE("triangles without an area give finite starts away from them") {
  vec3<double> const p{1, 2, 3}, q{2, 2, 4};
  for (auto const& t : {triangle<double>{p, p, p}, triangle<double>{p, q, q}, triangle<double>{p, q, (p + q) * 0.5}}) {
    auto const from = depart_from(t, 0.25, 0.5);
    vec3<double> const start = offset_origin(from, vec3<double>{0.25, 0.5, -1}), off = start - from.position;
    double const size = sum_of_magnitudes(extent(bounds(t))), distance = std::sqrt(dot(off, off));
    CHECK(dot(from.normal, from.normal) == Approx(1));
    CHECK(distance >= 2 * size);
    CHECK(distance <= 2 * size + 1e-13);
  }
}

TEST_CASE("starts in float and in double from a triangle of floats are clear of it") {
  unsigned const seed = 40503u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  std::size_t again = 0;
  for (int k = 0; k < 20000; ++k) {
    auto const t = random_triangle_rays::placed<double>(random.any_shape(0.01), 1, random.in_cube() * 100.);
    auto const in_float = random_triangle_rays::rounded<float>(t);
    vec3<float> const d = random_triangle_rays::rounded<float>(random.direction());
    vec3<float> const start = offset_origin(in_float, 0.25f, 0.5f, d);
    again += intersect<watertight_form>(ray<float>{start, d, 0, float(inf)}, in_float).valid;
    vec3<double> const fine = offset_origin(depart_from(in_float, 0.25, 0.5), vec3<double>(d));
    again += intersect<watertight_form>(
                 ray<double>{fine, vec3<double>(d), 0, inf},
                 triangle<double>{vec3<double>(in_float.a), vec3<double>(in_float.b), vec3<double>(in_float.c)})
                 .valid;
  }
  CHECK(again == 0);
}

TEST_CASE("every lane of a pack leaves a triangle where one ray does, bit for bit") {
  using P = pack<float, 16>;
  unsigned const seed = 40504u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  for (int k = 0; k < 300; ++k) {
    auto const t = any_triangle<float>(random, k % 3);
    float lane[5][16];
    for (int i = 0; i < 16; ++i) {
      vec3<float> const d = random_triangle_rays::rounded<float>(random.direction());
      lane[0][i] = float(random.uniform(0, 0.5)), lane[1][i] = float(random.uniform(0, 0.5));
      lane[2][i] = d.x, lane[3][i] = d.y, lane[4][i] = d.z;
    }
    auto const at = [&](int c) { return P::load(lane[c]); };
    vec3<P> const starts = offset_origin(t, at(0), at(1), vec3<P>{at(2), at(3), at(4)});
    for (int i = 0; i < 16; ++i) {
      vec3<float> const one = offset_origin(t, lane[0][i], lane[1][i], vec3<float>{lane[2][i], lane[3][i], lane[4][i]});
      vec3<float> const lane_start{starts.x[i], starts.y[i], starts.z[i]};
      CHECK(std::memcmp(&one, &lane_start, sizeof one) == 0);
    }
  }
}
