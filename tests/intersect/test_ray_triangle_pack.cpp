// SPDX-License-Identifier: MIT
#include <intersect/triangle_rays.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/numbers/pack.hpp>
#include <support/catch.hpp>

#include <cstring>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Whether two numbers are the same bits, or both NaN.
template <class T> bool same(T a, T b) { return std::memcmp(&a, &b, sizeof a) == 0 || (a != a && b != b); }

/// `of(i)` in lane i.
template <class P, class F> P lanes(F&& of) {
  lane_t<P> lane[std::size_t(lanes_v<P>)];
  for (int i = 0; i < lanes_v<P>; ++i) lane[i] = of(i);
  return P::load(lane);
}
template <class P, class F> vec3<P> vec_lanes(F&& of) {
  return {lanes<P>([&](int i) { return of(i).x; }), lanes<P>([&](int i) { return of(i).y; }),
          lanes<P>([&](int i) { return of(i).z; })};
}

template <class T> struct lane_input {
  triangle<T> t;
  ray<T> r;
};

template <class Form, class P> struct agreement {
  int differ = 0, hits = 0;

  /// Lane i of `h`, and of its error, against the one ray and triangle `of(i)`.
  template <faces F, class Ray, class Triangle, class Of>
  void check(Ray const& r, Triangle const& t, P t_min, P t_max, Of const& of) {
    auto const h = intersect<Form, F>(r, t, t_min, t_max);
    P const error = Form::position_error(r, t, h.t);
    for (int i = 0; i < lanes_v<P>; ++i) {
      auto const [one_t, one_r] = of(i);
      auto const prepared = Form::prepare(one_t);
      auto const constants = Form::make_ray(one_r.origin, one_r.direction);
      auto const one = intersect<Form, F>(constants, prepared, one_r.t_min, one_r.t_max);
      differ += bool(h.valid[i]) != one.valid;
      if (!one.valid) continue;
      ++hits;
      differ += !same(h.t[i], one.t) || !same(h.u[i], one.u) || !same(h.v[i], one.v) ||
                !same(error[i], Form::position_error(constants, prepared, one.t));
    }
  }
};

}  // namespace

TEMPLATE_TEST_CASE("every lane gives the bits of one ray and one triangle, whichever of them the lanes share", "",
                   (form_over<engine_form, pack<float, 4>>), (form_over<engine_form, pack<float, 8>>),
                   (form_over<engine_form, pack<float, 16>>), (form_over<engine_form, pack<double, 8>>),
                   (form_over<moller_trumbore_form, pack<float, 16>>),
                   (form_over<moller_trumbore_form, pack<double, 4>>), (form_over<watertight_form, pack<float, 4>>),
                   (form_over<watertight_form, pack<float, 16>>), (form_over<watertight_form, pack<double, 8>>)) {
  using P = typename TestType::number;
  using Form = typename TestType::form;
  using T = lane_t<P>;
  unsigned const seed = 40301u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  agreement<Form, P> shared_triangle, shared_ray, own;
  for (int n = 0; n < 64000 / lanes_v<P>; ++n) {
    std::vector<lane_input<T>> in(std::size_t(lanes_v<P>));
    vec3<double> const place = random.in_cube() * (n % 3 ? 1. : 1000.);
    for (auto& [t, r] : in) {
      t = random_triangle_rays::placed<T>(random.any_shape(1e-6), 1, place);
      if (random.pick(20) == 0) t.b = t.a;
      if (random.pick(50) == 0) t.c.y = std::numeric_limits<T>::quiet_NaN();
      r = random.ray_at<T>(random.aim(in[0].t), 3);
      if (random.pick(5) == 0) r = random.ray_at<T>(vec3<double>(in[0].t.b), 3);
      if (random.pick(50) == 0) r.direction.z = std::numeric_limits<T>::quiet_NaN();
      r.t_min = T(random.uniform(-5, 3));
    }
    auto const at = [&](int i) -> lane_input<T> const& { return in[std::size_t(i)]; };
    P const t_min = lanes<P>([&](int i) { return at(i).r.t_min; }), t_max(std::numeric_limits<T>::infinity());
    auto const rays = Form::make_ray(vec_lanes<P>([&](int i) { return at(i).r.origin; }),
                                     vec_lanes<P>([&](int i) { return at(i).r.direction; }));
    auto const triangles = Form::prepare(triangle<P>{vec_lanes<P>([&](int i) { return at(i).t.a; }),
                                                     vec_lanes<P>([&](int i) { return at(i).t.b; }),
                                                     vec_lanes<P>([&](int i) { return at(i).t.c; })});
    auto const one_ray = Form::make_ray(in[0].r.origin, in[0].r.direction);
    auto const one_triangle = Form::prepare(in[0].t);
    auto const of_one_triangle = [&](int i) { return lane_input<T>{in[0].t, at(i).r}; };
    auto const of_one_ray = [&](int i) {
      ray<T> r = in[0].r;
      r.t_min = at(i).r.t_min;
      return lane_input<T>{at(i).t, r};
    };
    shared_triangle.template check<faces::both>(rays, one_triangle, t_min, t_max, of_one_triangle);
    shared_triangle.template check<faces::front>(rays, one_triangle, t_min, t_max, of_one_triangle);
    shared_ray.template check<faces::both>(one_ray, triangles, t_min, t_max, of_one_ray);
    shared_ray.template check<faces::front>(one_ray, triangles, t_min, t_max, of_one_ray);
    own.template check<faces::both>(rays, triangles, t_min, t_max, at);
    own.template check<faces::front>(rays, triangles, t_min, t_max, at);
  }
  CAPTURE(shared_triangle.hits, shared_ray.hits, own.hits);
  CHECK(shared_triangle.differ == 0);
  CHECK(shared_ray.differ == 0);
  CHECK(own.differ == 0);
  CHECK(std::min({shared_triangle.hits, shared_ray.hits, own.hits}) > 5000);
}
