// SPDX-License-Identifier: MIT
#include <intersect/triangle_oracle.hpp>
#include <intersect/triangle_rays.hpp>
#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/pack.hpp>
#include <patchrt/shapes/triangle.hpp>
#include <support/catch.hpp>

using namespace patchrt;
using namespace patchrt::test;

TEMPLATE_TEST_CASE("a triangle's box has its vertices' least and greatest coordinates", "", float, double) {
  using T = TestType;
  triangle<T> const t{{1, -2, 3}, {-4, 5, 3}, {0, 7, -8}};
  CHECK(bounds(t) == box<T>{{-4, -2, -8}, {1, 7, 3}});
}

TEMPLATE_TEST_CASE("u weighs b, v weighs c, and vertices are where they are", "", float, double) {
  using T = TestType;
  double const eps = std::numeric_limits<T>::epsilon();
  unsigned const seed = 40001u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  for (int k = 0; k < 2000; ++k) {
    auto const t = random_triangle_rays::placed<T>(random.any_shape(1e-3), 1, random.in_cube() * 10.);
    CHECK(position(t, T(0), T(0)) == t.a);
    T const u = T(random.uniform()), v = T(random.uniform());
    vec3<double> const p(position(t, u, v));
    for (int c = 0; c < 3; ++c) {
      double const ab = double(t.b[c]) - double(t.a[c]), ac = double(t.c[c]) - double(t.a[c]);
      double const exact = double(t.a[c]) + double(u) * ab + double(v) * ac;
      CHECK(std::fabs(p[c] - exact) <=
            1.5 * eps * (std::fabs(ab) + std::fabs(ac)) + eps / 2 * std::fabs(exact) + 4e-16 * 20);
    }
  }
}

TEMPLATE_TEST_CASE("normals are within three epsilon of their products, needles' as any others'", "", float, double) {
  using T = TestType;
  double const eps = std::numeric_limits<T>::epsilon();
  unsigned const seed = 40002u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  double most = 0, most_of_needles = 0;
  for (int k = 0; k < 20000; ++k) {
    bool const is_needle = k % 2;
    auto shape = random.any_shape(1e-2);
    // A needle whose long edges are a b and a c: their product would lose as many digits as it is long.
    if (is_needle) shape = {random.in_cube(), random.in_cube(), {}}, shape.c = shape.b + random.in_cube() * 1e-5;
    auto const t = random_triangle_rays::placed<T>(shape, 1, random.in_cube() * 3.);
    int const shift = std::max({integer_shift(t.a), integer_shift(t.b), integer_shift(t.c)});
    integer_point const a = to_integers(t.a, shift), b = to_integers(t.b, shift), c = to_integers(t.c, shift);
    integer_point const exact = turned(minus(b, a), minus(c, a));
    vec3<double> const n(normal(t));
    auto const [first, second] = detail::shorter_edges(t);
    vec3<double> const products(detail::cross_of_magnitudes(first, second));
    double length = 0;
    for (int i = 0; i < 3; ++i)
      length += std::pow(std::ldexp(static_cast<double>(exact[std::size_t(i)]), -2 * shift), 2);
    for (int i = 0; i < 3; ++i) {
      double const off = std::fabs(n[i] - std::ldexp(static_cast<double>(exact[std::size_t(i)]), -2 * shift));
      if (products[i] > 0) most = std::max(most, off / (eps * products[i]));
      if (is_needle && length > 1e-12) most_of_needles = std::max(most_of_needles, off / (eps * std::sqrt(length)));
    }
  }
  CAPTURE(most, most_of_needles);
  CHECK(most < 3);
  CHECK(most > 0.5);
  CHECK(most_of_needles < 1e5);
}

TEMPLATE_TEST_CASE("normals point to where a, b, c turn counter-clockwise, as long as twice the area", "", float,
                   double) {
  using T = TestType;
  for (auto const& t : {triangle<T>{{0, 0, 5}, {2, 0, 5}, {0, 3, 5}}, triangle<T>{{2, 0, 5}, {0, 3, 5}, {0, 0, 5}},
                        triangle<T>{{0, 3, 5}, {0, 0, 5}, {2, 0, 5}}})
    CHECK(normal(t) == vec3<T>{0, 0, 6});
  CHECK(normal(triangle<T>{{0, 0, 5}, {0, 3, 5}, {2, 0, 5}}) == vec3<T>{0, 0, -6});
}

TEMPLATE_TEST_CASE("has_area is exact: for points on lines of any direction, and for one moved by a bit", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 40003u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int flat = 0, thin = 0;
  for (int k = 0; k < 40000; ++k) {
    vec3<T> a, step;
    for (int c = 0; c < 3; ++c) a[c] = T(random.pick(4001) - 2000), step[c] = T(random.pick(201) - 100);
    if (k % 3 == 1) step[random.pick(3)] = 0;
    T const unit = T(1) / 4096;  // exact, as are small multiples of the step
    triangle<T> t{a * unit, (a + T(random.pick(9) - 4) * step) * unit, (a + T(random.pick(9) - 4) * step) * unit};
    if (random.pick(2)) t.c[random.pick(3)] *= 1 + std::numeric_limits<T>::epsilon();
    int const shift = std::max({integer_shift(t.a), integer_shift(t.b), integer_shift(t.c)});
    integer_point const p = to_integers(t.a, shift);
    bool const exact =
        turned(minus(to_integers(t.b, shift), p), minus(to_integers(t.c, shift), p)) != integer_point{0, 0, 0};
    REQUIRE(has_area(t) == exact);
    ++(exact ? thin : flat);
  }
  CHECK(flat > 10000);
  CHECK(thin > 10000);
  using P = pack<T, 4>;
  auto const lanes = [](T w, T x, T y, T z) {
    T const lane[] = {w, x, y, z};
    return P::load(lane);
  };
  triangle<P> const four{{P(T(0)), P(T(0)), P(T(0))},
                         {P(T(1)), P(T(1)), P(T(1))},
                         {lanes(0, 1, 2, 2), lanes(0, 1, 2, 0), lanes(0, 1, T(2.5), 0)}};
  CHECK(mask_bits(has_area(four)) == 0b1100);
}

TEMPLATE_TEST_CASE("equal vertices have no area in coarse numbers either", "", half, (fixed<std::int16_t, 8>)) {
  using T = TestType;
  vec3<T> const a{T(0.1), T(0.7), T(-1.3)}, b{T(1.1), T(0.3), T(-0.9)}, c{T(0.5), T(1), T(0.25)};
  CHECK(has_area(triangle<T>{a, b, c}));
  CHECK_FALSE(has_area(triangle<T>{a, a, c}));
  CHECK_FALSE(has_area(triangle<T>{a, b, b}));
  CHECK_FALSE(has_area(triangle<T>{a, b, a}));
}
