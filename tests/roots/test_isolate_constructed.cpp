// SPDX-License-Identifier: MIT
#include "exact_polynomial.hpp"
#include "support/catch.hpp"

#include <patchrt/roots/isolate.hpp>

#include <random>
#include <string>

using namespace patchrt;
using namespace patchrt::test;

namespace {

polynomial const u = in_u(), v = in_v();
rational q(int a, int b = 1) { return {a, b}; }

struct known_root {
  rational u, v;
};
struct constructed {
  std::string origin;
  polynomial f, g;
  std::vector<known_root> simple, multiple;
};

/// (u - a)(u - b).. = (v - c)(v - d).. = 0
constructed grid(std::string origin, std::vector<rational> const& us, std::vector<rational> const& vs) {
  constructed c{std::move(origin), 1, 1, {}, {}};
  for (rational const& a : us) c.f = c.f * (u - a);
  for (rational const& b : vs) c.g = c.g * (v - b);
  for (rational const& a : us) {
    for (rational const& b : vs) c.simple.push_back({a, b});
  }
  return c;
}
/// Other combinations of the same two: the same roots, curves that are not along the axes.
constructed mixed(constructed c) {
  c.origin += ", mixed";
  polynomial const f = c.f;
  c.f = f + c.g;
  c.g = f - polynomial(2) * c.g;
  return c;
}
/// A parabola that touches a line at (a, b), or meets it twice or not at all, `gap` beyond.
constructed contact(std::string origin, rational const& a, rational const& b, rational const& gap = 0) {
  return {std::move(origin), v - b, v - b + (u - a) * (u - a) - gap, {}, {{a, b}}};
}

std::vector<constructed> rows() {
  std::vector<constructed> r{
      grid("one root in the middle", {q(1, 2)}, {q(1, 2)}),
      grid("one root off every dyadic line", {q(1, 3)}, {q(2, 7)}),
      grid("nine roots", {q(1, 5), q(1, 2), q(4, 5)}, {q(1, 7), q(2, 7), q(6, 7)}),
      grid("nine roots on the borders, corners and middle lines", {q(0), q(1, 2), q(1)}, {q(0), q(1, 2), q(1)}),
      grid("roots on lines of halving, levels 2 to 4", {q(1, 4), q(3, 8), q(15, 16)}, {q(1, 4), q(5, 8), q(1, 16)}),
      grid("corners alone", {q(0), q(1)}, {q(0), q(1)}),
      grid("roots 2^-5 apart", {q(1, 2), q(17, 32)}, {q(1, 2), q(17, 32)}),
      // Farouki & Rajan, "On the numerical condition of polynomials in Bernstein form", CAGD 4, 1987: of degree 3
      grid("equidistant roots", {q(1, 3), q(2, 3), q(1)}, {q(1, 3), q(2, 3), q(1)}),
      {"a circle and a line through its middle",
       (u - q(1, 2)) * (u - q(1, 2)) + (v - q(1, 2)) * (v - q(1, 2)) - q(25, 256),
       polynomial(3) * (v - q(1, 2)) - polynomial(4) * (u - q(1, 2)),
       {{q(1, 2) + q(3, 16), q(1, 2) + q(4, 16)}, {q(1, 2) - q(3, 16), q(1, 2) - q(4, 16)}},
       {}},
      {"two ellipses across each other, four roots",
       polynomial(4) * (u - q(1, 2)) * (u - q(1, 2)) + (v - q(1, 2)) * (v - q(1, 2)) - q(5, 64),
       (u - q(1, 2)) * (u - q(1, 2)) + polynomial(4) * (v - q(1, 2)) * (v - q(1, 2)) - q(5, 64),
       {{q(5, 8), q(5, 8)}, {q(5, 8), q(3, 8)}, {q(3, 8), q(5, 8)}, {q(3, 8), q(3, 8)}},
       {}},
      contact("contact in the middle", q(1, 2), q(1, 2)),
      contact("contact on a line of halving", q(3, 8), q(1, 4)),
      contact("contact off every dyadic line", q(1, 3), q(2, 7)),
      contact("contact on a border", q(3, 8), q(0)),
      contact("contact at a corner", q(1), q(1)),
      {"contact across the diagonal",
       v - u + q(1, 8),
       v - u + q(1, 8) + (u + v - q(1)) * (u + v - q(1)),
       {},
       {{q(9, 16), q(7, 16)}}},
      {"two circles that touch from outside",
       (u - q(1, 4)) * (u - q(1, 4)) + (v - q(1, 2)) * (v - q(1, 2)) - q(1, 16),
       (u - q(3, 4)) * (u - q(3, 4)) + (v - q(1, 2)) * (v - q(1, 2)) - q(1, 16),
       {},
       {{q(1, 2), q(1, 2)}}},
      {"two circles that touch from inside",
       (u - q(1, 2)) * (u - q(1, 2)) + (v - q(1, 2)) * (v - q(1, 2)) - q(1, 4),
       (u - q(3, 4)) * (u - q(3, 4)) + (v - q(1, 2)) * (v - q(1, 2)) - q(1, 16),
       {},
       {{q(1), q(1, 2)}}},
      {"a contact and a crossing",
       v - q(1, 4),
       (v - q(1, 4)) + (u - q(1, 4)) * (u - q(1, 4)) * (u - q(7, 8)),
       {{q(7, 8), q(1, 4)}},
       {{q(1, 4), q(1, 4)}}},
      {"an inflexion's tangent, a triple root",
       v - q(1, 4),
       (v - q(1, 4)) + (u - q(5, 8)) * (u - q(5, 8)) * (u - q(5, 8)),
       {},
       {{q(5, 8), q(1, 4)}}},
      {"two crossings in one point, no linear part: Re and Im of z^2",
       (u - q(3, 8)) * (u - q(3, 8)) - (v - q(5, 8)) * (v - q(5, 8)),
       (u - q(3, 8)) * (v - q(5, 8)),
       {},
       {{q(3, 8), q(5, 8)}}},
      {"a double line and a line across it", (u - q(3, 8)) * (u - q(3, 8)), v - q(5, 8), {}, {{q(3, 8), q(5, 8)}}},
      {"a cusp at which a line ends in its tangent",
       (u - q(1, 2)) * (u - q(1, 2)) - (v - q(1, 2)) * (v - q(1, 2)) * (v - q(1, 2)),
       u - q(1, 2),
       {},
       {{q(1, 2), q(1, 2)}}},
  };
  std::size_t const plain = r.size();
  for (std::size_t k = 0; k < plain; ++k) r.push_back(mixed(r[k]));
  return r;
}

}  // namespace

TEMPLATE_TEST_CASE("roots that are known are found as what they are: simple ones once, multiple ones in a small box",
                   "", float, double) {
  using T = TestType;
  for (constructed const& row : rows()) {
    auto const found = isolate(pair_of<T>(row.f, row.g));
    CAPTURE(row.origin, found.count, found.examined);
    REQUIRE(found.complete);
    CHECK(found.is_certain() == row.multiple.empty());
    CHECK(found.examined < 700);
    for (known_root const& r : row.simple) {
      CAPTURE(r.u, r.v);
      CHECK(row.f(r.u, r.v) == 0);
      CHECK(row.g(r.u, r.v) == 0);
      CHECK(boxes_with(found, r.u, r.v, root_kind::simple) == 1);
    }
    CHECK(count_of(found, root_kind::simple) == int(row.simple.size()));
    for (known_root const& r : row.multiple) {
      CAPTURE(r.u, r.v);
      CHECK(row.f(r.u, r.v) == 0);
      CHECK(row.g(r.u, r.v) == 0);
      CHECK(boxes_with(found, r.u, r.v, root_kind::simple) == 0);
      CHECK(boxes_with(found, r.u, r.v, root_kind::multiple) + boxes_with(found, r.u, r.v, root_kind::degenerate) == 1);
    }
    CHECK(found.count == int(row.simple.size() + row.multiple.size()));
    for (int k = 0; k < found.count; ++k) {
      isolated_root<T> const& r = found.roots[k];
      T const eps = std::numeric_limits<T>::epsilon();
      CAPTURE(k, r.u, r.v, r.radius_u, r.radius_v, int(r.kind));
      if (r.kind != root_kind::simple) {
        CHECK(r.kind == root_kind::multiple);
        // A triple root's is the widest: the cube root of what rounding changes.
        CHECK(std::max(r.radius_u, r.radius_v) < 8 * std::cbrt(100 * eps));
      }
      CHECK(r.on_border == (rational(r.u) - rational(r.radius_u) <= 0 || rational(r.u) + rational(r.radius_u) >= 1 ||
                            rational(r.v) - rational(r.radius_v) <= 0 || rational(r.v) + rational(r.radius_v) >= 1));
      // What the residual says: a pair that near has a root at (u, v).
      CHECK(abs(row.f(rational(r.u), rational(r.v))) <=
            rational(r.residual_f) + rational(pair_of<T>(row.f, row.g).error_f));
      CHECK(abs(row.g(rational(r.u), rational(r.v))) <=
            rational(r.residual_g) + rational(pair_of<T>(row.f, row.g).error_g));
      CHECK(r.residual_f < 1000 * eps);
      CHECK(r.residual_g < 1000 * eps);
    }
  }
}

TEMPLATE_TEST_CASE("two roots 2^-k apart are told apart down to a stated k, and never lost", "", float, double) {
  using T = TestType;
  int const resolved = sizeof(T) == 4 ? 6 : 20;
  for (int k = 1; k <= 40; ++k) {
    rational const half = two_to(-k - 1), a = k == 1 ? q(1, 2) : q(3, 8);
    for (bool is_mixed : {false, true}) {
      constructed row = contact("", a, q(1, 4), half * half);
      if (is_mixed) row = mixed(row);
      auto const p = pair_of<T>(row.f, row.g);
      auto const found = isolate(p);
      CAPTURE(k, is_mixed, found.count, found.examined, p.error_f, p.error_g);
      REQUIRE(found.complete);
      int const simple = count_of(found, root_kind::simple);
      for (rational const& x : {rational(a - half), rational(a + half)}) {
        int const here = boxes_with(found, x, q(1, 4), root_kind::simple);
        int const unsure = boxes_with(found, x, q(1, 4), root_kind::multiple);
        CHECK(here <= 1);
        CHECK(here + unsure >= 1);
      }
      if (k <= resolved) CHECK((found.count == 2 && simple == 2));
      else CHECK((simple == 0 || (simple == 2 && found.count == 2)));
      CHECK(found.examined < 400);
    }
  }
}

TEMPLATE_TEST_CASE("curves that pass each other at 2^-k have no root, or one that is not called certain", "", float,
                   double) {
  using T = TestType;
  for (int k = 1; k <= 60; ++k) {
    for (bool is_mixed : {false, true}) {
      constructed row = contact("", q(3, 8), q(1, 4), -two_to(-k));
      if (is_mixed) row = mixed(row);
      auto const found = isolate(pair_of<T>(row.f, row.g));
      CAPTURE(k, is_mixed, found.count, found.examined);
      REQUIRE(found.complete);
      CHECK(count_of(found, root_kind::simple) == 0);
      if (k <= (sizeof(T) == 4 ? 14 : 42)) CHECK(found.count == 0);
      else CHECK(found.count <= 1);
    }
  }
}

TEST_CASE("hyperbolas in a square: all eighteen roots that two bicubics can have") {
  // (u + 1/4)(v + 1/4) = s and the same from the opposite corner meet on u + v = 1, twice for 5/16 < s < 9/16.
  polynomial f = 1, g = 1;
  rational const s[3] = {q(11, 32), q(27, 64), q(1, 2)};
  for (rational const& x : s) {
    f = f * ((u + q(1, 4)) * (v + q(1, 4)) - x);
    g = g * ((q(5, 4) - u) * (q(5, 4) - v) - x);
  }
  auto const found = isolate(pair_of<double>(f, g));
  CAPTURE(found.examined);
  CHECK(found.complete);
  CHECK(found.count == 18);
  CHECK(count_of(found, root_kind::simple) == 18);
}

TEMPLATE_TEST_CASE("a root on a border, a corner or a line of halving is found, once", "", float, double) {
  using T = TestType;
  unsigned const seed = 420;
  std::mt19937 generator(seed);
  auto const pick = [&](int n) { return int(generator() % unsigned(n)); };
  auto const number = [&] { return q(pick(2049) - 1024, 256); };
  auto const place = [&] { return pick(3) == 0 ? q(pick(2)) : q(pick(33), 32); };
  int certain = 0, on_border = 0;
  for (int n = 0; n < 3000; ++n) {
    rational const a = place(), b = place();
    polynomial f, g;
    for (polynomial* p : {&f, &g}) {
      *p = polynomial(number()) * (u - a) + polynomial(number()) * (v - b) + polynomial(number()) * (u - a) * (v - b) +
           polynomial(number()) * (u - a) * (u - a) + polynomial(number()) * (v - b) * (v - b);
    }
    auto const found = isolate(pair_of<T, 2, 2>(f, g));
    CAPTURE(seed, n, a, b, found.count, found.examined);
    REQUIRE(found.complete);
    int const simple = boxes_with(found, a, b, root_kind::simple);
    REQUIRE(simple <= 1);
    REQUIRE(simple + boxes_with(found, a, b, root_kind::multiple) + boxes_with(found, a, b, root_kind::degenerate) >=
            1);
    certain += simple;
    for (int k = 0; k < found.count; ++k) {
      bool const is_it = boxes_with(found, a, b, found.roots[k].kind) > 0;
      on_border += is_it && found.roots[k].on_border;
    }
  }
  CAPTURE(certain, on_border);
  CHECK(certain > 2900);
  CHECK(on_border > 1500);
}
