// SPDX-License-Identifier: MIT
#include <intersect/triangle_oracle.hpp>
#include <intersect/triangle_rays.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <support/catch.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

struct error_count {
  int hits = 0, beyond = 0, unbounded = 0;
  double most_used = 0;   ///< error over bound
  double most_error = 0;  ///< of hits at 30 degrees or more to the plane, in epsilon times all lengths
  double most_bound = 0;  ///< of the same
};

/// What a hit's t is wrong by, against what `position_error` says.
template <class Form, class T> void count_error(error_count& n, triangle<T> const& t, ray<T> const& r) {
  auto const prepared = Form::prepare(t);
  auto const constants = Form::make_ray(r.origin, r.direction);
  auto const hit = intersect<Form>(constants, prepared, r.t_min, r.t_max);
  exact_crossing const exact(r.origin, r.direction, t);
  if (!hit.valid || exact.side() == 0) return;
  ++n.hits;
  double const error = exact.position_error(double(hit.t));
  double const bound = double(Form::position_error(constants, prepared, hit.t));
  if (!(error <= bound)) ++n.beyond;
  if (bound == std::numeric_limits<double>::infinity()) {
    ++n.unbounded;
    return;
  }
  n.most_used = std::max(n.most_used, error / bound);
  vec3<double> const normal(cross(vec3<double>(t.b) - vec3<double>(t.a), vec3<double>(t.c) - vec3<double>(t.a)));
  vec3<double> const d(r.direction), off = vec3<double>(t.a) - vec3<double>(r.origin);
  double const cosine = std::fabs(dot(normal, d)) / std::sqrt(dot(normal, normal) * dot(d, d));
  if (cosine < 0.5) return;
  double const lengths =
      std::numeric_limits<T>::epsilon() * (std::sqrt(dot(off, off)) + double(sum_of_magnitudes(extent(bounds(t)))));
  n.most_error = std::max(n.most_error, error / lengths);
  n.most_bound = std::max(n.most_bound, bound / lengths);
}

}  // namespace

TEMPLATE_TEST_CASE("position_error is never less than what t is wrong by", "", (form_over<engine_form, float>),
                   (form_over<moller_trumbore_form, float>), (form_over<watertight_form, float>),
                   (form_over<engine_form, double>), (form_over<moller_trumbore_form, double>),
                   (form_over<watertight_form, double>)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  unsigned const seed = 40201u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  error_count n;
  for (int k = 0; k < 200000; ++k) {
    double const size = std::pow(10., random.uniform(-6, 6));
    double const away = random.pick(3) == 0 ? 1e6 : random.pick(2) ? std::pow(10., random.uniform(-2, 4)) : 0;
    auto const t =
        random_triangle_rays::placed<T>(random.any_shape(k % 2 ? 1e-6 : 0.1), size, random.in_cube() * (size * away));
    ray<T> r = random.ray_at<T>(random.aim(t), size * std::pow(10., random.uniform(-3, 3)));
    if (random.pick(8) == 0) {  // along an edge, but for little
      vec3<double> const edge(t.b - t.a);
      r.direction =
          random_triangle_rays::rounded<T>(edge + random.in_cube() * (size * std::pow(10., random.uniform(-9, -1))));
      r.origin = random_triangle_rays::rounded<T>(random.aim(t) - vec3<double>(r.direction) * random.uniform(0, 4));
    }
    count_error<Form>(n, t, r);
  }
  CAPTURE(n.hits, n.unbounded, n.most_used, n.most_error, n.most_bound);
  CHECK(n.beyond == 0);
  CHECK(n.hits > 60000);
  CHECK(n.most_used > 0.05);
}

TEMPLATE_TEST_CASE(
    "of well-shaped triangles that are not grazed, t is right to a few epsilon of all lengths and the bound says so",
    "", (form_over<engine_form, float>), (form_over<moller_trumbore_form, float>), (form_over<watertight_form, float>),
    (form_over<engine_form, double>), (form_over<moller_trumbore_form, double>), (form_over<watertight_form, double>)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  unsigned const seed = 40202u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  error_count n;
  for (int k = 0; k < 50000; ++k) {
    vec3<double> const x = random.direction(), y = cross(x, random.direction());
    if (dot(y, y) < 0.1) continue;
    triangle<double> const shape{x, y * 0.9 - x * 0.4, y * -0.8 - x * 0.3};
    auto const t = random_triangle_rays::placed<T>(shape, 1, random.in_cube() * 100.);
    count_error<Form>(n, t, random.ray_at<T>(random.aim(t), std::pow(10., random.uniform(-1, 3))));
  }
  CAPTURE(n.hits, n.unbounded, n.most_used, n.most_error, n.most_bound);
  CHECK(n.beyond == 0);
  CHECK(n.most_error < 4);
  CHECK(n.most_bound < 64);
}

TEST_CASE("the bound is infinite where rounding hides whether a ray is parallel to the plane") {
  triangle<float> const t{{0, 0, 0}, {1, 1e-3f, 1e-3f}, {1e-3f, 1, -1e-3f}};
  vec3<float> const along = t.b - t.a, origin{-1, 0.3f, 0.0001f};
  auto const engine = engine_form::prepare(t);
  auto const moller = moller_trumbore_form::prepare(t);
  auto const watertight = watertight_form::prepare(t);
  auto const infinite = std::numeric_limits<float>::infinity();
  CHECK(engine_form::position_error(engine_form::make_ray(origin, along), engine, 1.f) == infinite);
  CHECK(moller_trumbore_form::position_error(engine_form::make_ray(origin, along), moller, 1.f) == infinite);
  CHECK(watertight_form::position_error(watertight_form::make_ray(origin, along), watertight, 1.f) == infinite);
  vec3<float> const steep = along + vec3<float>{0, 0, 1e-3f};
  CHECK(engine_form::position_error(engine_form::make_ray(origin, steep), engine, 1.f) < 0.01f);
  CHECK(moller_trumbore_form::position_error(engine_form::make_ray(origin, steep), moller, 1.f) < 0.01f);
  CHECK(watertight_form::position_error(watertight_form::make_ray(origin, steep), watertight, 1.f) < 0.01f);
}
