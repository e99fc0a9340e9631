// SPDX-License-Identifier: MIT
#include "exact_polynomial.hpp"
#include "isolation_checks.hpp"

#include <limits>
#include <string>

using namespace patchrt;
using namespace patchrt::test;

namespace {

polynomial const u = in_u(), v = in_v();
rational q(int a, int b = 1) { return {a, b}; }

template <class T, int C> bool is_covered(isolation<T, C> const& found, rational const& a, rational const& b) {
  return boxes_with(found, a, b, root_kind::simple) + boxes_with(found, a, b, root_kind::multiple) +
             boxes_with(found, a, b, root_kind::degenerate) >
         0;
}

/// f = g = 0 on (u(t), v(t)), 0 <= t <= 1.
struct curve {
  std::string origin;
  polynomial f, g;
  polynomial at_u, at_v;  ///< in u, for t
};

}  // namespace

TEMPLATE_TEST_CASE("a curve of roots is covered by boxes that say so, in a bounded number of steps", "", float,
                   double) {
  using T = TestType;
  polynomial const a = u - v - q(1, 8), zero = 0;
  std::vector<curve> const rows{
      {"the same function twice", a, a, u * q(7, 8) + q(1, 8), u * q(7, 8)},
      {"a multiple", a, polynomial(-3) * a, u * q(7, 8) + q(1, 8), u * q(7, 8)},
      {"one function is zero", a, zero, u * q(7, 8) + q(1, 8), u * q(7, 8)},
      {"the other is", zero, a, u * q(7, 8) + q(1, 8), u * q(7, 8)},
      {"a planar patch edge on: a line of roots along v", (u - q(3, 8)) * (u + v + q(1)),
       (u - q(3, 8)) * (u - v + q(2)), q(3, 8), u},
      {"the same along a border", u * (u + v + q(1)), u * (u - v + q(2)), q(0), u},
      {"a line with a crossing on it", (u - q(3, 8)) * (u + v - q(3, 4)), (u - q(3, 8)) * (u - v), q(3, 8), u},
      {"two curves twice over: no Jacobian anywhere on them", (u - v) * (u - v), (u - v) * (u + v), u, u},
      {"a line and a root beside it", (u - q(1, 8)) * (v - q(1, 2)), (u - q(1, 8)) * (u - q(3, 4)), q(1, 8), u},
  };
  for (curve const& row : rows) {
    auto const found = isolate(pair_of<T>(row.f, row.g));
    CAPTURE(row.origin, found.count, found.examined);
    CHECK(found.examined < 800);
    CHECK(count_of(found, root_kind::degenerate) >= 1);
    CHECK_FALSE(found.is_certain());
    CHECK(count_of(found, root_kind::simple) <= 1);
    for (int k = 0; k <= 64; ++k) {
      rational const x = row.at_u(q(k, 64), 0), y = row.at_v(q(k, 64), 0);
      CAPTURE(x, y);
      REQUIRE(row.f(x, y) == 0);
      REQUIRE(row.g(x, y) == 0);
      REQUIRE(is_covered(found, x, y));
      REQUIRE(boxes_with(found, x, y, root_kind::simple) == 0);
    }
  }
  auto const beside = isolate(pair_of<T>(rows.back().f, rows.back().g));
  CHECK(boxes_with(beside, q(3, 4), q(1, 2), root_kind::simple) == 1);
}

TEMPLATE_TEST_CASE("functions without a zero have no root, the zero functions have them everywhere", "", float,
                   double) {
  using T = TestType;
  auto const none = isolate(pair_of<T>(polynomial(1), u - v));
  CHECK(none.complete);
  CHECK(none.count == 0);
  auto const all = isolate(pair_of<T>(polynomial(0), polynomial(0)));
  CHECK(all.complete);
  REQUIRE(all.count == 1);
  CHECK(all.roots[0].kind == root_kind::degenerate);
  for (int a : {0, 1}) {
    for (int b : {0, 1}) CHECK(is_covered(all, q(a), q(b)));
  }
  CHECK(all.examined < 10);
}

TEMPLATE_TEST_CASE("scaling either function by a power of two changes no bit of the roots", "", float, double) {
  using T = TestType;
  unsigned const seed = 430;
  std::mt19937 generator(seed);
  int const most = sizeof(T) == 4 ? 100 : 900;
  int found_some = 0;
  for (int n = 0; n < 1000; ++n) {
    auto const p = random_pair<T, 3, 3>(generator, T(0x1p-20));
    int const by_f = int(generator() % unsigned(2 * most)) - most, by_g = int(generator() % unsigned(2 * most)) - most;
    auto scaled = p;
    for (T& x : scaled.f) x = std::ldexp(x, by_f);
    for (T& x : scaled.g) x = std::ldexp(x, by_g);
    scaled.error_f = std::ldexp(p.error_f, by_f);
    scaled.error_g = std::ldexp(p.error_g, by_g);
    auto const a = isolate(p), b = isolate(scaled);
    CAPTURE(seed, n, by_f, by_g);
    REQUIRE(a.count == b.count);
    REQUIRE(a.examined == b.examined);
    for (int k = 0; k < a.count; ++k) {
      isolated_root<T> const &r = a.roots[k], &s = b.roots[k];
      REQUIRE((r.u == s.u && r.v == s.v && r.radius_u == s.radius_u && r.radius_v == s.radius_v && r.kind == s.kind));
      REQUIRE(s.residual_f == std::ldexp(r.residual_f, by_f));
      ++found_some;
    }
  }
  CHECK(found_some > 1000);
}

TEMPLATE_TEST_CASE("the largest and the smallest numbers isolate like others", "", float, double) {
  using T = TestType;
  using limits = std::numeric_limits<T>;
  auto const base = pair_of<T>(u - q(1, 2), v - q(1, 4));
  for (T const scale : {limits::max(), limits::min() * 4, limits::min(), limits::denorm_min() * 1024}) {
    auto p = base;
    for (T& x : p.f) x *= scale;
    for (T& x : p.g) x *= scale;
    // Coefficients may have been rounded to subnormal numbers.
    p.error_f = p.error_g = scale < 1 ? limits::denorm_min() : T(0);
    auto const found = isolate(p);
    CAPTURE(scale, found.count, found.examined);
    CHECK(found.complete);
    CHECK(is_covered(found, q(1, 2), q(1, 4)));
    if (scale >= limits::min()) CHECK(boxes_with(found, q(1, 2), q(1, 4), root_kind::simple) == 1);
  }
}

TEMPLATE_TEST_CASE("what is not a number is refused at once, and the domain is all that is said", "", float, double) {
  using T = TestType;
  T const nan = std::numeric_limits<T>::quiet_NaN(), inf = std::numeric_limits<T>::infinity();
  auto const base = pair_of<T>(u - q(1, 2), v - q(1, 4));
  auto const is_refused = [](bernstein_pair<T> const& p) {
    auto const found = isolate(p);
    return !found.complete && found.count == 1 && found.examined == 0 && found.roots[0].kind == root_kind::degenerate &&
           is_covered(found, q(0), q(0)) && is_covered(found, q(1), q(1));
  };
  for (T const bad : {nan, inf, -inf}) {
    for (int k = 0; k < 16; ++k) {
      auto p = base;
      p.f[k] = bad;
      CHECK(is_refused(p));
      p = base;
      p.g[k] = bad;
      CHECK(is_refused(p));
    }
    auto p = base;
    p.error_f = bad;
    CHECK(is_refused(p));
    p = base;
    p.error_g = bad;
    CHECK(is_refused(p));
  }
  auto p = base;
  p.error_f = T(-1);
  CHECK(is_refused(p));
}

TEMPLATE_TEST_CASE("a search that may take few steps says so, and still covers every root", "", float, double) {
  using T = TestType;
  unsigned const seed = 431;
  std::mt19937 generator(seed);
  int stopped = 0;
  tally all;
  for (int n = 0; n < 200; ++n) {
    auto const p = random_pair<T, 3, 3>(generator, T(0));
    isolate_options<T> options;
    options.most_examined = int(generator() % 40u);
    auto const found = isolate(p, options);
    CAPTURE(seed, n, options.most_examined, found.count);
    REQUIRE(found.examined <= options.most_examined + 2);
    stopped += !found.complete;
    tally const t =
        compare(found, resultant_oracle(precisely(p)).roots(precise(-1) / 16, precise(17) / 16), {0, 1, 0, 1});
    REQUIRE(t.is_right());
    all += t;
  }
  CHECK(stopped > 50);
  CHECK(all.covered > 30);
}

TEMPLATE_TEST_CASE("a list too short for all roots covers them in its last box", "", float, double) {
  using T = TestType;
  polynomial f = 1, g = 1;
  for (rational const& a : {q(1, 5), q(1, 2), q(4, 5)}) f = f * (u - a), g = g * (v - a);
  auto const found = isolate<T, 3, 3, 4>(pair_of<T>(f, g));
  CHECK(found.count == 4);
  CHECK(count_of(found, root_kind::simple) == 3);
  CHECK_FALSE(found.complete);
  CHECK(found.roots[3].kind == root_kind::degenerate);
  for (rational const& a : {q(1, 5), q(1, 2), q(4, 5)}) {
    for (rational const& b : {q(1, 5), q(1, 2), q(4, 5)}) CHECK(is_covered(found, a, b));
  }
}
