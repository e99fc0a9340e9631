// SPDX-License-Identifier: MIT
#include <intersect/triangle_oracle.hpp>
#include <intersect/triangle_rays.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/interval.hpp>
#include <patchrt/numbers/two_float.hpp>
#include <support/catch.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

#define PATCHRT_FORMS_OVER(T) \
  (form_over<engine_form, T>), (form_over<moller_trumbore_form, T>), (form_over<watertight_form, T>)

template <class T> ray<T> line(vec3<T> const& origin, vec3<T> const& direction) {
  constexpr T inf = std::numeric_limits<T>::infinity();
  return {origin, direction, -inf, inf};
}

template <class T> triangle<T> turned_over(triangle<T> const& t) { return {t.a, t.c, t.b}; }

}  // namespace

TEMPLATE_TEST_CASE("a ray meets a triangle where exact arithmetic says so, but within rounding of an edge", "",
                   PATCHRT_FORMS_OVER(float), PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  double const eps = std::numeric_limits<T>::epsilon();
  unsigned const seed = 40101u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int hits = 0, clear = 0;
  for (int k = 0; k < 60000; ++k) {
    auto const t = random_triangle_rays::rounded<T>(random.any_shape(0.05));
    ray<T> const r = random.ray_at<T>(random.aim(t), random.uniform(0.1, 8));
    exact_crossing const exact(r.origin, r.direction, t);
    if (std::fabs(exact.depth()) < 1e5 * eps || exact.side() == 0) continue;
    ++clear;
    auto const both = intersect<Form>(r, t);
    auto const front = intersect<Form, faces::front>(r, t);
    auto const back = intersect<Form, faces::front>(r, turned_over(t));
    bool const is_hit = exact.is_met() && exact.t() > 0;
    CAPTURE(k, exact.depth(), exact.t());
    REQUIRE(both.valid == is_hit);
    REQUIRE(front.valid == (is_hit && exact.side() > 0));
    REQUIRE(back.valid == (is_hit && exact.side() < 0));
    if (!is_hit) continue;
    ++hits;
    REQUIRE(std::fabs(double(both.u) - exact.u()) < 1e5 * eps);
    REQUIRE(std::fabs(double(both.v) - exact.v()) < 1e5 * eps);
    REQUIRE(exact.position_error(double(both.t)) < 1e5 * eps);
    if (exact.side() > 0) REQUIRE((front.t == both.t && front.u == both.u && front.v == both.v));
  }
  CAPTURE(hits, clear);
  CHECK(hits > 20000);
  CHECK(clear > 50000);
}

TEST_CASE("eq. 8 of the ray engine needs a minus sign: as printed it finds none of the hits") {
  unsigned const seed = 40102u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int const tests = 200000;
  int mended_agrees = 0, printed_agrees = 0, printed_hits = 0, form_agrees = 0, hits = 0;
  for (int k = 0; k < tests; ++k) {
    triangle<double> const t{random.in_cube(), random.in_cube(), random.in_cube()};
    vec3<double> const o = random.in_cube() * 3., d = random.aim(t) - o;
    vec3<double> const n = cross(t.b - t.a, t.c - t.a), ao = o - t.a, bo = o - t.b;
    vec3<double> const aod = cross(ao, d), bod = cross(bo, d);
    bool const plane_and_two_edges =
        dot(n, d) < 0 && dot(n, ao) > 0 && dot(t.c - t.a, aod) >= 0 && dot(t.a - t.b, aod) >= 0;
    double const printed = dot(t.c - t.b, bod);
    exact_crossing const exact(o, d, t);
    bool const is_hit = exact.is_met() && exact.side() > 0 && exact.t() > 0;
    hits += is_hit;
    mended_agrees += (plane_and_two_edges && -printed >= 0) == is_hit;
    printed_agrees += (plane_and_two_edges && printed >= 0) == is_hit;
    printed_hits += is_hit && printed >= 0;
    form_agrees += intersect<engine_form, faces::front>(ray<double>{o, d, 0, 1e30}, t).valid == is_hit;
  }
  CAPTURE(hits, printed_agrees);
  CHECK(mended_agrees == tests);
  CHECK(form_agrees == tests);
  CHECK(printed_hits == 0);
  CHECK(printed_agrees < tests - hits);
  CHECK(hits > tests / 5);
}

TEMPLATE_TEST_CASE("a triangle without an area is never met", "", PATCHRT_FORMS_OVER(float),
                   PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  unsigned const seed = 40103u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int flat = 0;
  for (int k = 0; k < 60000; ++k) {
    T const unit = k % 2 ? T(1) / 1024 : T(1) / 3;  // in thirds, edges are rounded and turn off the line
    auto const whole = [&] { return T(random.pick(2001) - 1000) * unit; };
    vec3<T> const a{whole(), whole(), whole()}, b{whole(), whole(), whole()};
    triangle<T> t{a, b, b};
    if (k % 5 == 1) t = {a, a, b};
    if (k % 5 == 2) t = {a, b, a};
    if (k % 5 == 3) t = {a, a, a};
    if (k % 5 == 4) t = {a, b, random_triangle_rays::rounded<T>((vec3<double>(a) + vec3<double>(b)) * 0.5)};
    ray<T> const r = random.ray_at<T>(random.aim(t), 3);
    exact_crossing const exact(r.origin, r.direction, t);
    REQUIRE(has_area(t) == exact.has_area());
    if (exact.has_area()) continue;  // the middle was rounded
    ++flat;
    REQUIRE_FALSE(intersect<Form>(line(r.origin, r.direction), t).valid);
    REQUIRE_FALSE((intersect<Form, faces::front>(r, t).valid));
  }
  CHECK(flat > 50000);
}

TEMPLATE_TEST_CASE("what has a NaN or an infinite vertex is never met", "", PATCHRT_FORMS_OVER(float),
                   PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  constexpr T nan = std::numeric_limits<T>::quiet_NaN(), inf = std::numeric_limits<T>::infinity();
  triangle<T> const good{{-1, -1, 0}, {2, -1, T(.25)}, {-1, 2, T(-.5)}};
  ray<T> const aimed{{T(.125), T(.25), 4}, {T(-.0625), T(.03125), -1}, 0, inf};
  REQUIRE(intersect<Form>(aimed, good).valid);
  for (T const bad : {nan, inf, -inf}) {
    for (int k = 0; k < 9; ++k) {
      CAPTURE(bad, k);
      triangle<T> t = good;
      (k < 3 ? t.a : k < 6 ? t.b : t.c)[k % 3] = bad;
      REQUIRE_FALSE(intersect<Form>(aimed, t).valid);
      REQUIRE_FALSE(intersect<Form>(line(aimed.origin, aimed.direction), t).valid);
    }
    for (int k = 0; k < 6; ++k) {
      CAPTURE(bad, k);
      ray<T> r = aimed;
      (k < 3 ? r.origin : r.direction)[k % 3] = bad;
      REQUIRE_FALSE(intersect<Form>(r, good).valid);
      REQUIRE_FALSE(intersect<Form>(line(r.origin, r.direction), good).valid);
    }
  }
  for (auto const& [t_min, t_max] : {std::pair<T, T>{nan, 9}, {0, nan}, {nan, nan}, {5, 3}, {4, 4}})
    REQUIRE_FALSE(intersect<Form>(ray<T>{aimed.origin, aimed.direction, t_min, t_max}, good).valid);
  REQUIRE_FALSE(intersect<Form>(line(aimed.origin, vec3<T>{0, 0, 0}), good).valid);
}

TEMPLATE_TEST_CASE("hard rays", "", PATCHRT_FORMS_OVER(float), PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  constexpr T inf = std::numeric_limits<T>::infinity(), tiny = std::numeric_limits<T>::denorm_min();
  triangle<T> const unit{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle<T> const upright{{0, 0, -1}, {0, 0, 1}, {0, 1, 0}};
  triangle<T> const sliver{{0, 0, 0}, {1, 0, 0}, {T(.5), T(1e-6), 0}};
  struct row {
    char const* what;
    triangle<T> t;
    ray<T> r;
    bool hit;
    T at, u, v;
  };
  row const rows[] = {
      {"straight down", unit, {{T(.25), T(.5), 2}, {0, 0, -1}, 0, inf}, true, 2, T(.25), T(.5)},
      {"straight up, at the back", unit, {{T(.25), T(.5), -2}, {0, 0, 1}, 0, inf}, true, 2, T(.25), T(.5)},
      {"a direction of length 1/4", unit, {{T(.25), T(.5), 2}, {0, 0, T(-.25)}, 0, inf}, true, 8, T(.25), T(.5)},
      {"two components of -0", unit, {{T(.25), T(.5), 2}, {-T(0), -T(0), -1}, 0, inf}, true, 2, T(.25), T(.5)},
      {"along x to a triangle across it", upright, {{-3, T(.25), 0}, {1, 0, 0}, 0, inf}, true, 3, T(.375), T(.25)},
      {"back along x", upright, {{3, T(.25), 0}, {-1, 0, 0}, 0, inf}, true, 3, T(.375), T(.25)},
      {"through vertex a", unit, {{0, 0, 1}, {0, 0, -1}, 0, inf}, true, 1, 0, 0},
      {"through vertex b", unit, {{1, 0, 1}, {0, 0, -1}, 0, inf}, true, 1, 1, 0},
      {"through vertex c", unit, {{0, 1, 1}, {0, 0, -1}, 0, inf}, true, 1, 0, 1},
      {"through the edge a b", unit, {{T(.25), 0, 1}, {0, 0, -1}, 0, inf}, true, 1, T(.25), 0},
      {"through the edge b c", unit, {{T(.25), T(.75), 1}, {0, 0, -1}, 0, inf}, true, 1, T(.25), T(.75)},
      {"beside the edge a b by one number", unit, {{T(.25), -tiny, 1}, {0, 0, -1}, 0, inf}, false, 0, 0, 0},
      {"edge-on", unit, {{-1, T(.25), 0}, {1, 0, 0}, 0, inf}, false, 0, 0, 0},
      {"in the plane, from within", unit, {{T(.25), T(.25), 0}, {1, 1, 0}, -inf, inf}, false, 0, 0, 0},
      {"along an edge", unit, {{-1, 0, 0}, {1, 0, 0}, 0, inf}, false, 0, 0, 0},
      {"parallel, above the plane", unit, {{-1, T(.25), 1}, {1, 0, 0}, 0, inf}, false, 0, 0, 0},
      {"from the plane, t = 0 is not above t_min = 0", unit, {{T(.25), T(.25), 0}, {0, 0, 1}, 0, inf}, false, 0, 0, 0},
      {"from the plane, t_min = -1", unit, {{T(.25), T(.25), 0}, {0, 0, 1}, -1, inf}, true, 0, T(.25), T(.25)},
      {"t = t_max", unit, {{T(.25), T(.5), 2}, {0, 0, -1}, 0, 2}, false, 0, 0, 0},
      {"t just below t_max",
       unit,
       {{T(.25), T(.5), 2}, {0, 0, -1}, 0, std::nextafter(T(2), inf)},
       true,
       2,
       T(.25),
       T(.5)},
      {"t = t_min", unit, {{T(.25), T(.5), 2}, {0, 0, -1}, 2, inf}, false, 0, 0, 0},
      {"t just above t_min",
       unit,
       {{T(.25), T(.5), 2}, {0, 0, -1}, std::nextafter(T(2), T(0)), inf},
       true,
       2,
       T(.25),
       T(.5)},
      {"behind", unit, {{T(.25), T(.5), 2}, {0, 0, 1}, 0, inf}, false, 0, 0, 0},
      {"behind, of the whole line", unit, {{T(.25), T(.5), 2}, {0, 0, 1}, -inf, inf}, true, -2, T(.25), T(.5)},
      {"a sliver a million times as long as wide",
       sliver,
       {{T(.5), T(.5e-6), 1}, {0, 0, -1}, 0, inf},
       true,
       1,
       T(.25),
       T(.5)},
      {"beside that sliver", sliver, {{T(.5), T(1.01e-6), 1}, {0, 0, -1}, 0, inf}, false, 0, 0, 0},
  };
  for (row const& r : rows) {
    CAPTURE(r.what);
    auto const h = intersect<Form>(r.r, r.t);
    REQUIRE(h.valid == r.hit);
    if (!r.hit) continue;
    REQUIRE(h.t == r.at);
    REQUIRE(std::fabs(h.u - r.u) <= 4 * std::numeric_limits<T>::epsilon());
    REQUIRE(std::fabs(h.v - r.v) <= 4 * std::numeric_limits<T>::epsilon());
  }
}

TEMPLATE_TEST_CASE("hits are within t_min and t_max, and u, v and u + v within 0 and 1 but for roundings", "",
                   PATCHRT_FORMS_OVER(float), PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  unsigned const seed = 40104u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int hits = 0, cut = 0;
  for (int k = 0; k < 60000; ++k) {
    auto const t = random_triangle_rays::placed<T>(random.any_shape(1e-7), 1, random.in_cube() * 100.);
    ray<T> r = random.ray_at<T>(random.aim(t), 3);
    auto const all = intersect<Form>(r, t);
    if (!all.valid) continue;
    ++hits;
    REQUIRE((all.u >= 0 && all.v >= 0 && all.u + all.v <= 1 + 4 * std::numeric_limits<T>::epsilon()));
    // A range that ends at t, or within rounding of it.
    T const end = random.pick(2) ? all.t : all.t * (1 + T(random.pick(9) - 4) * std::numeric_limits<T>::epsilon());
    (random.pick(2) ? r.t_min : r.t_max) = end;
    auto const some = intersect<Form>(r, t);
    cut += !some.valid;
    if (some.valid) REQUIRE((r.t_min < some.t && some.t < r.t_max && some.t == all.t));
  }
  CHECK(hits > 20000);
  CHECK(cut > hits / 3);
}

TEMPLATE_TEST_CASE("meet decides by signs what intersect decides by t, and leaves weights of one sign", "",
                   PATCHRT_FORMS_OVER(float), PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  T const eps = std::numeric_limits<T>::epsilon();
  unsigned const seed = 40105u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int hits = 0;
  for (int k = 0; k < 30000; ++k) {
    auto const t = random_triangle_rays::rounded<T>(random.any_shape(1e-3));
    ray<T> const r = random.ray_at<T>(random.aim(t), 3);
    auto const prepared = Form::prepare(t);
    auto const constants = Form::make_ray(r.origin, r.direction);
    auto const valid = [&](T t_min, T t_max) { return Form::meet(constants, prepared, t_min, t_max).valid; };
    auto const all = intersect<Form>(constants, prepared, r.t_min, r.t_max);
    REQUIRE(valid(r.t_min, r.t_max) == all.valid);
    if (!all.valid) continue;
    ++hits;
    auto const m = Form::meet(constants, prepared, r.t_min, r.t_max);
    double const side = m.scale > 0 ? 1 : -1;
    REQUIRE((side * m.scale > 0 && side * m.u >= 0 && side * m.v >= 0 && side * m.w >= 0));
    REQUIRE(std::fabs(m.distance / m.scale - all.t) <= eps * all.t);
    T const sooner = all.t * (1 - 4 * eps), later = all.t * (1 + 4 * eps);
    REQUIRE(valid(sooner, later));
    REQUIRE_FALSE(valid(later, r.t_max));
    REQUIRE_FALSE(valid(r.t_min, sooner));
    REQUIRE_FALSE(valid(-r.t_max, sooner));
    T const nan = std::numeric_limits<T>::quiet_NaN();
    REQUIRE_FALSE((valid(nan, r.t_max) || valid(r.t_min, nan)));
  }
  CHECK(hits > 10000);
}

TEMPLATE_TEST_CASE("rays along edges give no NaN", "", PATCHRT_FORMS_OVER(float), PATCHRT_FORMS_OVER(double)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  unsigned const seed = 40106u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  for (int k = 0; k < 30000; ++k) {
    auto const t = random_triangle_rays::rounded<T>(random.any_shape(1e-3));
    vec3<T> const corner[] = {t.a, t.b, t.c};
    int const from = random.pick(3), to = (from + 1 + random.pick(2)) % 3;
    for (auto const& r :
         {line(corner[from], corner[to] - corner[from]), line(corner[from], corner[from] - corner[to])}) {
      auto const h = intersect<Form>(r, t);
      if (h.valid) REQUIRE((h.t - h.t == 0 && h.u - h.u == 0 && h.v - h.v == 0));
    }
  }
}

TEMPLATE_TEST_CASE("coarse, doubled and interval numbers meet triangles by the same kernels", "",
                   PATCHRT_FORMS_OVER(half), PATCHRT_FORMS_OVER(two_float<float>), PATCHRT_FORMS_OVER(interval<double>),
                   (form_over<engine_form, fixed<std::int16_t, 8>>),
                   (form_over<watertight_form, fixed<std::int16_t, 8>>)) {
  using T = typename TestType::number;
  using Form = typename TestType::form;
  auto const vec = [](double x, double y, double z) { return vec3<T>{T(x), T(y), T(z)}; };
  triangle<T> const t{vec(-0.5, -0.5, 0.5), vec(1, -0.5, 0.5), vec(-0.5, 1, 0.5)};
  for (int i = -7; i <= 7; ++i)
    for (int j = -7; j <= 7; ++j) {
      double const x = i * 0.125 + 0.03125, y = j * 0.125 + 0.0625;  // beside the edges, all digits exact
      ray<T> const r{vec(x, y, 2.5), vec(0, 0, -1), T(0), T(7)};
      auto const hit = intersect<Form>(r, t);
      bool const is_inside = x > -0.5 && y > -0.5 && x + y < 0.5;
      CAPTURE(x, y);
      REQUIRE(any_of(hit.valid) == is_inside);
      REQUIRE(any_of(intersect<Form, faces::front>(r, t).valid) == is_inside);
      REQUIRE_FALSE(any_of(intersect<Form, faces::front>(r, turned_over(t)).valid));
      if (!is_inside) continue;
      REQUIRE(double(hit.t) == Approx(2).epsilon(2e-3));
      REQUIRE(double(hit.u) == Approx((x + 0.5) / 1.5).margin(2e-3));
      REQUIRE(double(hit.v) == Approx((y + 0.5) / 1.5).margin(2e-3));
    }
}

TEST_CASE("an interval of rays that may all hit holds the t of every one of them") {
  using I = interval<double>;
  triangle<double> const t{{-1, -1, 0}, {2, -1, 0.5}, {-1, 2, 1}};
  triangle<I> const same{convert_vec<I>(t.a), convert_vec<I>(t.b), convert_vec<I>(t.c)};
  double const width = 1e-3;
  ray<I> const r{{I(0, width), I(0.1, 0.1 + width), I(4)}, {I(0), I(0.25, 0.25 + width), I(-1)}, I(0), I(100)};
  auto const all = intersect<engine_form>(r, same);
  REQUIRE(all.valid);
  CHECK(all.t.hi - all.t.lo < 0.1);
  for (int k = 0; k < 8; ++k) {
    vec3<double> const o{k & 1 ? width : 0, k & 2 ? 0.1 + width : 0.1, 4}, d{0, k & 4 ? 0.25 + width : 0.25, -1};
    auto const one = intersect<engine_form>(ray<double>{o, d, 0, 100}, t);
    REQUIRE(one.valid);
    CHECK((all.t.lo <= one.t && one.t <= all.t.hi && all.u.lo <= one.u && one.u <= all.u.hi));
  }
}
