// SPDX-License-Identifier: MIT
#include "exact_rational.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/shapes/bezier_elevate.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// The largest ratio of error to stated bound over random patches raised from degree (M, N) to (M2, N2).
template <class T, int M, int N, int M2, int N2> double worst_of_stated_bound() {
  std::mt19937 g(unsigned(1000 * M + 100 * N + 10 * M2 + N2));
  rational const eps(std::numeric_limits<T>::epsilon());
  int const l = M2 - M + N2 - N;
  double worst = 0;
  for (int k = 0; k < 10; ++k) {
    auto p = random_rational<T, M, N>(g, k % 4);
    for (auto& c : p.control_points) c.point.x += T(k % 5);
    rational const m(largest_coordinate(points_of(p)));
    auto const polynomial = elevate<M2, N2>(points_of(p));
    auto const exact_polynomial = raised(exactly(points_of(p)), M2, N2);
    for (int i = 0; i <= M2; ++i) {
      for (int j = 0; j <= N2; ++j) {
        rational const e = largest(exactly(polynomial(i, j)) - exact_polynomial(i, j)) / (m * eps * rational(3 * l, 2));
        worst = std::max(worst, static_cast<double>(e));
      }
    }
    worst = std::max(worst,
                     error_ratio(elevate<M2, N2>(p), raised(exactly(p), M2, N2), l * (l + 3) * eps * m, 2 * l * eps));
    REQUIRE(contains(bounds(p), bounds(elevate<M2, N2>(p))));
    REQUIRE(contains(bounds(points_of(p)), bounds(polynomial)));
  }
  return worst;
}

}  // namespace

TEMPLATE_TEST_CASE("patches of raised degree are within their stated bounds of rational arithmetic", "", float,
                   double) {
  double const worst[] = {worst_of_stated_bound<TestType, 3, 3, 4, 3>(), worst_of_stated_bound<TestType, 3, 3, 3, 5>(),
                          worst_of_stated_bound<TestType, 1, 1, 5, 5>(), worst_of_stated_bound<TestType, 2, 2, 3, 3>(),
                          worst_of_stated_bound<TestType, 4, 1, 5, 3>()};
  for (double const w : worst) {
    CHECK(w <= 1);
    CHECK(w > 0.02);
  }
}

TEMPLATE_TEST_CASE("patches of raised degree are the same surface", "", float, double) {
  using T = TestType;
  unsigned const seed = 61;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  T const eps = std::numeric_limits<T>::epsilon();
  for (int n = 0; n < 300; ++n) {
    auto const p = random_rational<T, 2, 3>(g, 1);
    auto const r = elevate<4, 5>(p);
    auto const s = elevate<4, 5>(points_of(p));
    T const u = T(parameter(g)), v = T(parameter(g));
    REQUIRE(norm(position(r, u, v) - position(p, u, v)) <= 100 * eps);
    REQUIRE(norm(evaluate(r, u, v).du - evaluate(p, u, v).du) <= 1500 * eps);
    REQUIRE(norm(position(s, u, v) - position(points_of(p), u, v)) <= 60 * eps);
  }
}

TEMPLATE_TEST_CASE("raising degrees keeps corners, shared edges, equal points and equal weights bit for bit", "", float,
                   double) {
  using T = TestType;
  std::mt19937 g(62);
  auto a = random_rational<T, 3, 2>(g, 2), b = random_rational<T, 3, 2>(g, 2);
  for (int i = 0; i <= 3; ++i) {
    b(i, 0).point = a(i, 2).point;
    b(i, 0).weight = a(i, 2).weight;
    a(i, 0).point = a(0, 0).point;  // collapsed, with weights of its own
  }
  auto const r = elevate<5, 4>(a), s = elevate<5, 4>(b);
  auto const x = elevate<5, 4>(points_of(a)), y = elevate<5, 4>(points_of(b));
  CHECK(r(5, 4).point == a(3, 2).point);
  CHECK(r(5, 4).weight == a(3, 2).weight);
  CHECK(x(0, 4) == a(0, 2).point);
  for (int i = 0; i <= 5; ++i) {
    CHECK(r(i, 4).point == s(i, 0).point);
    CHECK(r(i, 4).weight == s(i, 0).weight);
    CHECK(x(i, 4) == y(i, 0));
    CHECK(r(i, 0).point == a(0, 0).point);
    CHECK(x(i, 0) == a(0, 0).point);
  }
  T const third = T(1) / 3;
  for (auto& c : a.control_points) c.weight = third;
  for (auto const& c : elevate<5, 5>(a).control_points) CHECK(c.weight == third);
  CHECK(is_same(elevate<3, 2>(b), b));
}
