// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/shapes/make_quadric.hpp>
#include <patchrt/shapes/sphere.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace patchrt;
using patchrt::test::contains_text;

namespace {

using rational = boost::multiprecision::cpp_rational;

template <class T, class Generator> vec3<T> random_vector(Generator& g) {
  std::uniform_real_distribution<double> d(-2, 2);
  vec3<T> v;
  for (int k = 0; k < 3; ++k) v[k] = T(d(g));
  return v;
}
template <class T, class Generator> quadric<T> random_quadric(Generator& g) {
  quadric<T> q;
  q.squares = random_vector<T>(g);
  q.products = random_vector<T>(g);
  q.linear = random_vector<T>(g);
  q.constant = random_vector<T>(g).x;
  return q;
}

/// (p, 1) times the symmetric matrix of A to J times (p, 1), or the sum of the terms' magnitudes.
template <class T> rational exact_value(quadric<T> const& q, rational const (&p)[3], bool magnitudes = false) {
  rational const A(q.squares.x), E(q.squares.y), H(q.squares.z), F(q.products.x), C(q.products.y), B(q.products.z),
      D(q.linear.x), G(q.linear.y), I(q.linear.z), J(q.constant);
  rational const matrix[4][4] = {{A, B, C, D}, {B, E, F, G}, {C, F, H, I}, {D, G, I, J}};
  rational const x[4] = {p[0], p[1], p[2], 1};
  rational sum = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      rational const term = x[i] * matrix[i][j] * x[j];
      sum += magnitudes ? rational(abs(term)) : term;
    }
  return sum;
}
template <class T> rational exact_value(quadric<T> const& q, vec3<T> const& p, bool magnitudes = false) {
  rational const at[3] = {rational(p.x), rational(p.y), rational(p.z)};
  return exact_value(q, at, magnitudes);
}

}  // namespace

TEMPLATE_TEST_CASE("a form has the value of its matrix, within 3.5 eps of the terms' magnitudes", "", float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst = 0;
  for (int n = 0; n < 2000; ++n) {
    auto const q = random_quadric<T>(g);
    auto const p = random_vector<T>(g);
    rational const off = abs(rational(rational(evaluate(q, p)) - exact_value(q, p)));
    worst = std::max(worst, static_cast<double>(rational(off / exact_value(q, p, true))));
  }
  worst /= double(std::numeric_limits<T>::epsilon());
  CAPTURE(worst);
  CHECK(worst <= 3.5);
  CHECK(worst > 0.3);
}

TEMPLATE_TEST_CASE("f changes along the half gradient as a quadratic does", "", float, double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 1000; ++n) {
    auto const q = random_quadric<T>(g);
    vec3<T> const p = random_vector<T>(g), d = random_vector<T>(g);
    T const change = 2 * dot(d, half_gradient(q, p)) + dot(d, multiply(q, d));
    rational const to[3] = {rational(p.x) + rational(d.x), rational(p.y) + rational(d.y),
                            rational(p.z) + rational(d.z)};
    double const wanted = static_cast<double>(rational(exact_value(q, to) - exact_value(q, p)));
    REQUIRE(std::fabs(double(change) - wanted) < 300 * double(std::numeric_limits<T>::epsilon()));
  }
}

TEMPLATE_TEST_CASE(
    "a form composed with a map has the values at the mapped points, and a transformed one keeps its surface", "",
    float, double) {
  using T = TestType;
  unsigned const seed = 3;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double const eps = double(std::numeric_limits<T>::epsilon());
  for (int n = 0; n < 1000; ++n) {
    auto const q = random_quadric<T>(g);
    affine<T> m;
    m.x = random_vector<T>(g), m.y = random_vector<T>(g), m.z = random_vector<T>(g),
    m.translation = random_vector<T>(g);
    auto const p = random_vector<T>(g);
    T const there = evaluate(q, transform_point(m, p));
    REQUIRE(std::fabs(double(evaluate(compose(q, m), p)) - double(there)) < 3e4 * eps);
    double const det = std::fabs(double(dot(m.x, cross(m.y, m.z))));
    if (det < 1) continue;
    T const kept = evaluate(transform(m, q), transform_point(m, p));
    REQUIRE(std::fabs(double(kept) - double(evaluate(q, p))) < 1e6 * eps);
  }
}

TEMPLATE_TEST_CASE("unit forms are 0 on the points that they are named for, and negative inside", "", float, double) {
  using T = TestType;
  T const o(0), i(1);
  CHECK(evaluate(unit_sphere<T>(), {T(0.6), 0, T(0.8)}) == Approx(0).margin(1e-6));
  CHECK(evaluate(unit_sphere<T>(), {o, o, o}) < 0);
  CHECK(evaluate(unit_cylinder<T>(), {o, i, T(17)}) == 0);
  CHECK(evaluate(unit_cylinder<T>(), {o, o, T(17)}) < 0);
  CHECK(evaluate(unit_cone<T>(), {3, 4, -5}) == 0);
  CHECK(evaluate(unit_cone<T>(), {o, o, i}) < 0);
  CHECK(evaluate(unit_paraboloid<T>(), {i, 2, 5}) == 0);
  CHECK(evaluate(unit_paraboloid<T>(), {o, o, i}) < 0);
  CHECK(evaluate(unit_hyperboloid_one_sheet<T>(), {i, 2, -2}) == 0);
  CHECK(evaluate(unit_hyperboloid_one_sheet<T>(), {o, o, i}) < 0);
  CHECK(evaluate(unit_hyperboloid_two_sheets<T>(), {2, 2, 3}) == 0);
  CHECK(evaluate(unit_hyperboloid_two_sheets<T>(), {o, o, -2}) < 0);
  CHECK(evaluate(unit_plane<T>(), {5, 7, o}) == 0);
  CHECK(evaluate(unit_plane<T>(), {5, 7, -i}) < 0);
}

TEST_CASE("what is no surface is refused at set-up with the reason") {
  using q = quadric<double>;
  double const nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  auto const here = affine<double>::identity();
  struct row {
    char const* why;
    q form;
  };
  row const rows[] = {
      {"whole space", {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 0}},
      {"no points where it is 0", {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, 3}},
      {"no points where it is 0", {{1, 0, 0}, {0, 0, 0}, {0, 0, 0}, 1}},  // x^2 + 1 = 0
      {"no points where it is 0", {{-2, -1, 0}, {0, 0, 0}, {0, 0, 0}, -1}},
      {"no points where it is 0", {{1, 1, 1}, {0, 0, 0}, {-3, 0, 0}, 9.5}},  // (x - 3)^2 + y^2 + z^2 = -1/2
      {"no points where it is 0", {{2, 2, 2}, {-1, -1, -1}, {0, 0, 0}, 1}},  // flat along (1, 1, 1)
      {"a point", {{1, 1, 1}, {0, 0, 0}, {0, 0, 0}, 0}},
      {"a point", {{1, 4, 9}, {0, 0, 0}, {-1, 4, 0}, 5}},
      {"in a line", {{1, 1, 0}, {0, 0, 0}, {0, 0, 0}, 0}},
      {"counts twice", {{1, 1, 0}, {0, 0, 1}, {0, 0, 0}, 0}},  // (x + y)^2 = 0
      {"not finite", {{1, nan, 1}, {0, 0, 0}, {0, 0, 0}, -1}},
      {"not finite", {{1, 1, 1}, {0, inf, 0}, {0, 0, 0}, -1}},
      {"not finite", {{1, 1, 1}, {0, 0, 0}, {0, 0, -inf}, -1}},
      {"not finite", {{1, 1, 1}, {0, 0, 0}, {0, 0, 0}, nan}},
  };
  for (row const& r : rows) {
    CHECK_THROWS_AS(make_quadric(r.form), std::invalid_argument);
    CHECK_THROWS_WITH(make_quadric(r.form), contains_text(r.why));
  }
  CHECK_THROWS_WITH(make_sphere(affine<double>::scaling({1, 0, 1})), contains_text("singular"));
  CHECK_THROWS_WITH(make_ellipsoid({0, 0, 0}, {1, 1, nan}), contains_text("not finite"));
  CHECK_THROWS_WITH(make_cylinder(here, 1, 0), contains_text("empty or NaN"));
  CHECK_THROWS_WITH(make_cylinder(here, 0, nan), contains_text("empty or NaN"));
  CHECK_THROWS_WITH(make_paraboloid(here, -1), contains_text("no points in the box"));
  CHECK_THROWS_WITH(make_hyperboloid_two_sheets(here, -0.5, 0.5), contains_text("no points in the box"));
  CHECK_THROWS_WITH(make_quadric(unit_sphere<double>(), here, {{2, 2, 2}, {3, 3, 3}}),
                    contains_text("no points in the box"));
  CHECK_THROWS_WITH(make_quadric(unit_sphere<double>(), here, {{-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}}),
                    contains_text("no points in the box"));
  CHECK_NOTHROW(make_quadric(unit_sphere<double>(), here, {{-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}}, ends::capped));
  CHECK_NOTHROW(make_quadric({{1, -1, 0}, {0, 0, 0}, {0, 0, 0}, 0}));  // two planes
  CHECK_NOTHROW(make_quadric({{1, 0, 0}, {0, 0, 0}, {0, 0, 0}, -1}));  // two more
}

TEST_CASE("object space is shifted to a quadric's centre, or to the point of the box nearest to it") {
  quadric<double> const q{
      {1, 1, 1}, {0, 0, 0}, {-100, 20, 3}, 100 * 100 + 20 * 20 + 9 - 4};  // radius 2 at (100, -20, -3)
  auto const ball = make_quadric(q);
  CHECK(ball.centre == vec3<double>(100, -20, -3));
  CHECK(ball.form.linear == vec3<double>(0, 0, 0));
  CHECK(ball.form.constant / ball.form.squares.x == -4);
  auto const huge = make_quadric(q, affine<double>::identity(), {{99, -21, -1.5}, {101, -19, 0}});
  CHECK(huge.centre == vec3<double>(100, -20, -1.5));
  CHECK(huge.clip.lo == vec3<double>(-1, -1, 0));
  auto const turned = make_quadric(q, affine<double>{{0, 2, 0}, {-2, 0, 0}, {0, 0, 2}, {1, 1, 1}});
  CHECK(turned.centre == vec3<double>(41, 201, -5));
  // A paraboloid and a plane have no centre: 0 is on them.
  quadric<double> const bowl{{1, 1, 0}, {0, 0, 0}, {-5, 0, -0.5}, 25 + 7};
  CHECK(make_quadric(bowl).centre.x == Approx(5).epsilon(1e-14));
  CHECK(make_quadric(bowl).centre.z == Approx(7).epsilon(1e-14));
  CHECK(make_quadric({{0, 0, 0}, {0, 0, 0}, {0, 0.5, 0}, -3}).centre.y == Approx(3).epsilon(1e-14));
}

TEST_CASE("forms of any size and sign give the same surface, the sign its inside") {
  auto const here = affine<double>::identity();
  for (double const size : {1., 3., 1e-200, 1e150, -1., -1e-8}) {
    auto q = unit_cone<double>();
    for (int k = 0; k < 3; ++k) q.squares[k] *= size;
    auto const s = make_quadric(q, here, between_heights(0., 1.));
    CHECK((std::fabs(s.form.squares.x) >= 1 && std::fabs(s.form.squares.x) < 2));
    CHECK(std::signbit(s.form.squares.x) == std::signbit(size));
  }
}

TEMPLATE_TEST_CASE("the box of a sphere holds its ends, and is no more than roundings wider", "", float, double) {
  using T = TestType;
  unsigned const seed = 4;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 10000; ++n) {
    sphere<T> const s{random_vector<T>(g), std::fabs(random_vector<T>(g).x)};
    box<T> const b = bounds(s);
    for (int k = 0; k < 3; ++k) {
      rational const lo = rational(s.centre[k]) - rational(s.radius), hi = rational(s.centre[k]) + rational(s.radius);
      rational const slack =
          2 * rational(std::numeric_limits<T>::epsilon()) * rational(std::fabs(s.centre[k]) + 2 * s.radius);
      REQUIRE((rational(b.lo[k]) <= lo && hi <= rational(b.hi[k])));
      REQUIRE((lo - slack <= rational(b.lo[k]) && rational(b.hi[k]) <= hi + slack));
    }
  }
}
