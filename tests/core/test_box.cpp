// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/core/box.hpp>

#include <random>

using namespace patchrt;

namespace {

template <class T, class Generator> box<T> random_box(Generator& g) {
  std::uniform_int_distribution<int> d(-8, 8);
  auto const point = [&] { return vec3<T>{T(d(g)), T(d(g)), T(d(g))}; };
  return merge(merge(box<T>::empty(), point()), point());
}

}  // namespace

TEMPLATE_TEST_CASE("merge is commutative, associative and idempotent, with the empty box neutral", "", float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 1000; ++n) {
    auto const a = random_box<T>(g), b = random_box<T>(g), c = random_box<T>(g);
    REQUIRE(merge(a, b) == merge(b, a));
    REQUIRE(merge(merge(a, b), c) == merge(a, merge(b, c)));
    REQUIRE(merge(a, a) == a);
    REQUIRE(merge(a, box<T>::empty()) == a);
    REQUIRE(merge(box<T>::empty(), a) == a);
  }
}

TEMPLATE_TEST_CASE("a merged box holds its parts and no less", "", float, double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937 g(seed);
  int held = 0;
  for (int n = 0; n < 1000; ++n) {
    auto const a = random_box<T>(g), b = random_box<T>(g);
    auto const m = merge(a, b);
    REQUIRE(contains(m, a));
    REQUIRE(contains(m, b));
    REQUIRE(contains(a, b) == (m == a));
    held += contains(a, b);
    for (int k = 0; k < 3; ++k) {
      REQUIRE((m.lo[k] == a.lo[k] || m.lo[k] == b.lo[k]));
      REQUIRE((m.hi[k] == a.hi[k] || m.hi[k] == b.hi[k]));
    }
  }
  CHECK(held > 0);
}

TEMPLATE_TEST_CASE("empty boxes are empty, boxes of one point and flat ones are not", "", float, double) {
  using T = TestType;
  T const nan = std::numeric_limits<T>::quiet_NaN();
  CHECK(is_empty(box<T>::empty()));
  CHECK_FALSE(is_empty(box<T>{{1, 2, 3}, {1, 2, 3}}));
  CHECK_FALSE(is_empty(box<T>{{1, 2, 3}, {4, 2, 5}}));
  CHECK(is_empty(box<T>{{1, 2, 3}, {4, 1, 5}}));
  CHECK(is_empty(box<T>{{1, nan, 3}, {4, 1, 5}}));
  CHECK(is_empty(box<T>{{1, 0, 3}, {4, nan, 5}}));
  CHECK(contains(box<T>{{1, 2, 3}, {1, 2, 3}}, box<T>::empty()));
  CHECK(contains(box<T>{{1, 2, 3}, {1, 2, 3}}, box<T>{{9, 9, 9}, {8, 9, 9}}));
  CHECK(contains(box<T>::empty(), box<T>::empty()));
  CHECK_FALSE(contains(box<T>::empty(), box<T>{{1, 2, 3}, {1, 2, 3}}));
}

TEMPLATE_TEST_CASE("half_area and extent are those of the sides", "", float, double) {
  using T = TestType;
  box<T> const b{{-1, 0, 2}, {1, 3, 6}};
  CHECK((extent(b) == vec3<T>{2, 3, 4}));
  CHECK(half_area(b) == 2 * 3 + 3 * 4 + 4 * 2);
  CHECK(half_area(box<T>{{0, 0, 0}, {2, 3, 0}}) == 6);
  CHECK(half_area(box<T>{{1, 1, 1}, {1, 1, 1}}) == 0);
}
