// SPDX-License-Identifier: MIT
#include "exact_polynomial.hpp"
#include "isolation_checks.hpp"

#include <patchrt/numbers/interval.hpp>
#include <patchrt/numbers/two_float.hpp>

#include <algorithm>
#include <cmath>

using namespace patchrt;
using namespace patchrt::test;

TEMPLATE_TEST_CASE("numbers that carry their errors, or twice the digits, isolate random pairs", "", interval<float>,
                   interval<double>, two_float<float>, two_float<double>) {
  using T = TestType;
  using R = real_t<T>;
  unsigned const seed = 440;
  std::mt19937 generator(seed);
  tally all;
  R widest(0);
  for (int n = 0; n < 100; ++n) {
    auto const plain = random_pair<R, 3, 3>(generator, R(0));
    bernstein_pair<T> p;
    for (int k = 0; k < 16; ++k) {
      p.f[k] = T(plain.f[k]);
      p.g[k] = T(plain.g[k]);
    }
    p.error_f = p.error_g = T(R(0));
    auto const found = isolate(p);
    CAPTURE(seed, n, found.count, found.examined);
    REQUIRE(found.complete);
    tally const t =
        compare(found, resultant_oracle(precisely(plain)).roots(precise(-1) / 16, precise(17) / 16), {0, 1, 0, 1});
    CAPTURE(t.inside, t.simple, t.covered, t.lost, t.twice, t.wrong);
    REQUIRE(t.is_right());
    all += t;
    for (int k = 0; k < found.count; ++k) widest = std::max(widest, found.roots[k].radius_u);
  }
  CAPTURE(all.inside, all.simple, all.covered, widest);
  CHECK(all.inside > 100);
  CHECK(all.covered == 0);
  // Random pairs come as near a contact as 2^-6 or so; two words have their square of the rounding of one.
  R const eps = std::numeric_limits<R>::epsilon();
  CHECK(widest < (enclosure<T>::unit() > R(0) ? 1e5 * double(eps) * double(eps) : 1e3 * double(eps)));
}

TEMPLATE_TEST_CASE("coefficients that are intervals stand for every pair within them", "", float, double) {
  using R = TestType;
  using T = interval<R>;
  unsigned const seed = 441;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  tally all;
  for (int n = 0; n < 60; ++n) {
    R const error = std::ldexp(R(1), -int(generator() % 12u) - 4);
    auto const plain = random_pair<R, 3, 3>(generator, R(0));
    bernstein_pair<T> p;
    for (int k = 0; k < 16; ++k) {
      p.f[k] = T(plain.f[k]) + T(-error, error);
      p.g[k] = T(plain.g[k]) + T(-error, error);
    }
    p.error_f = p.error_g = T(R(0));
    auto const found = isolate(p);
    CAPTURE(seed, n, error, found.count, found.examined);
    for (int m = 0; m < 3; ++m) {
      precise_pair q = precisely(plain);
      for (precise_vector* c : {&q.f, &q.g}) {
        for (precise& x : *c) x += precise(error) * (m == 0 ? (generator() % 2u == 0 ? 1. : -1.) : uniform(generator));
      }
      tally const t = compare(found, resultant_oracle(q).roots(precise(-1) / 16, precise(17) / 16), {0, 1, 0, 1});
      CAPTURE(m, t.inside, t.simple, t.covered, t.lost, t.twice, t.wrong);
      REQUIRE(t.is_right());
      all += t;
    }
  }
  CAPTURE(all.inside, all.simple, all.covered);
  CHECK(all.simple > 50);
  CHECK(all.covered > 5);
}

TEST_CASE("two words tell roots apart that are one to a single word") {
  polynomial const u = in_u(), v = in_v();
  rational const a(3, 8), b(1, 4);
  for (int k : {22, 30, 36}) {
    rational const half = two_to(-k - 1);
    polynomial const f = v - b, g = f + (u - a) * (u - a) - rational(half * half);
    auto const plain = pair_of<double>(f, g);
    CHECK(count_of(isolate(plain), root_kind::simple) == 0);
    bernstein_pair<two_float<double>> p;
    auto const two_words = [](rational const& x) {
      double const high = static_cast<double>(x);
      return two_float<double>(high, static_cast<double>(rational(x - rational(high))));
    };
    for (int i = 0; i <= 3; ++i) {
      for (int j = 0; j <= 3; ++j) {
        rational const line = rational(j, 3) - b;
        p.f[4 * i + j] = two_words(line);
        p.g[4 * i + j] = two_words(line + a * a - half * half - rational(2 * i, 3) * a + rational(i * (i - 1), 6));
      }
    }
    p.error_f = p.error_g = two_float<double>(0x1p-104);
    auto const found = isolate(p);
    CAPTURE(k, found.count, found.examined);
    CHECK(found.complete);
    CHECK(found.count == 2);
    CHECK(count_of(found, root_kind::simple) == 2);
    for (rational const& x : {rational(a - half), rational(a + half)}) {
      int held = 0;
      for (int n = 0; n < found.count; ++n) {
        auto const& r = found.roots[n];
        held += abs(x - rational(r.u.hi) - rational(r.u.lo)) <= rational(r.radius_u);
      }
      CHECK(held == 1);
    }
  }
}
