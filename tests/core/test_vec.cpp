// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/core/vec.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <limits>
#include <random>

using namespace patchrt;

namespace {

using rational = boost::multiprecision::cpp_rational;

template <class T, class Generator> vec3<T> random_vector(Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  vec3<T> v;
  v.x = T(d(g));
  v.y = T(d(g));
  v.z = T(d(g));
  return v;
}

template <class T> double error_in_eps(T got, rational const& wanted, rational const& scale) {
  return static_cast<double>(
      rational(abs(rational(rational(got) - wanted)) / scale / rational(std::numeric_limits<T>::epsilon())));
}

}  // namespace

TEMPLATE_TEST_CASE("dot makes three roundings: at most 1.5 eps of the sum of |products|", "", float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 2000; ++n) {
    auto const a = random_vector<T>(g), b = random_vector<T>(g);
    rational const x = rational(a.x) * rational(b.x), y = rational(a.y) * rational(b.y),
                   z = rational(a.z) * rational(b.z);
    // The product of z passes three roundings, that of y two, that of x one; and so to first order.
    rational const scale = rational(abs(x)) + 2 * rational(abs(y)) + 3 * rational(abs(z));
    REQUIRE(error_in_eps(dot(a, b), x + y + z, scale) <= 0.5000001);
  }
}

/// check(a, b, k, first, second) for the components k = first - second of a x b, of vectors every other pair of which is nearly
/// parallel.
template <class T, class Check> void for_cross_products(std::mt19937& g, Check&& check) {
  for (int n = 0; n < 2000; ++n) {
    auto const a = random_vector<T>(g);
    auto const b =
        n % 2 ? random_vector<T>(g) : T(3) * a + T(4) * std::numeric_limits<T>::epsilon() * random_vector<T>(g);
    for (int k = 0; k < 3; ++k) {
      int const i = (k + 1) % 3, j = (k + 2) % 3;
      check(a, b, k, rational(component(a, i)) * rational(component(b, j)),
            rational(component(a, j)) * rational(component(b, i)));
    }
  }
}

TEMPLATE_TEST_CASE("cross is within 1.5 eps a component, for nearly parallel vectors too", "", float, double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for_cross_products<T>(g, [](auto const& a, auto const& b, int k, rational const& first, rational const& second) {
    T const c = component(cross(a, b), k);
    rational const wanted = first - second;
    if (wanted == 0) REQUIRE(c == 0);
    else REQUIRE(error_in_eps(c, wanted, abs(wanted)) <= 1.5);
  });
}

TEMPLATE_TEST_CASE("fused_cross is within half an eps of its second products and the result", "", float, double) {
  using T = TestType;
  unsigned const seed = 4;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for_cross_products<T>(g, [](auto const& a, auto const& b, int k, rational const& first, rational const& second) {
    rational const wanted = first - second;
    REQUIRE(error_in_eps(component(fused_cross(a, b), k), wanted, abs(second) + abs(wanted)) <= 0.5000001);
  });
}

TEMPLATE_TEST_CASE("the cross product of parallel vectors is exactly zero, and axes turn the right way", "", float,
                   double) {
  using T = TestType;
  std::mt19937 g(3);
  for (int n = 0; n < 1000; ++n) {
    auto const a = random_vector<T>(g);
    REQUIRE((cross(a, a) == vec3<T>{0, 0, 0}));
    REQUIRE((cross(a, T(2) * a) == vec3<T>{0, 0, 0}));
  }
  CHECK((cross(vec3<T>{1, 0, 0}, vec3<T>{0, 1, 0}) == vec3<T>{0, 0, 1}));
  CHECK((cross(vec3<T>{0, 1, 0}, vec3<T>{0, 0, 1}) == vec3<T>{1, 0, 0}));
}

TEMPLATE_TEST_CASE("fma, select and component work component by component", "", float, double) {
  using T = TestType;
  vec3<T> const a{1, 2, 3}, b{-4, 5, 6};
  CHECK((fma(T(2), a, b) == vec3<T>{-2, 9, 12}));
  CHECK(select(true, a, b) == a);
  CHECK(select(false, a, b) == b);
  for (int k = 0; k < 3; ++k) CHECK(component(b, k) == b[k]);
  CHECK((convert_vec<double>(vec3<float>{0.1f, 2, 3}) == vec3<double>{double(0.1f), 2, 3}));
}
