// SPDX-License-Identifier: MIT
#include "isolation_checks.hpp"

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class T, int M, int N> tally against_the_resultant(unsigned seed, int pairs, T error, int& most_examined) {
  std::mt19937 generator(seed);
  tally all;
  for (int n = 0; n < pairs; ++n) {
    auto const p = random_pair<T, M, N>(generator, error);
    auto const found = isolate(p);
    CAPTURE(seed, n, M, N, found.count, found.examined);
    REQUIRE(found.complete);
    tally const t =
        compare(found, resultant_oracle(precisely(p)).roots(precise(-1) / 16, precise(17) / 16), {0, 1, 0, 1});
    CAPTURE(t.inside, t.simple, t.covered, t.lost, t.twice, t.wrong);
    REQUIRE(t.is_right());
    most_examined = std::max(most_examined, found.examined);
    all += t;
  }
  return all;
}

}  // namespace

TEMPLATE_TEST_CASE("every root of a random pair is in one box, and each simple box holds one", "", float, double) {
  using T = TestType;
  unsigned const seed = 410;
  int examined = 0;
  tally all = against_the_resultant<T, 3, 3>(seed, 1000, T(0), examined);
  CAPTURE(all.inside, all.simple, all.covered);
  CHECK(all.inside > 1250);
  CHECK(all.covered <= (sizeof(T) == 4 ? 20 : 0));
  CHECK(examined < 400);
}

TEMPLATE_TEST_CASE("degrees 1 to 5 in u and v all isolate", "", float, double) {
  using T = TestType;
  unsigned const seed = 411;
  int examined = 0;
  tally all;
  all += against_the_resultant<T, 1, 1>(seed, 500, T(0), examined);
  all += against_the_resultant<T, 1, 3>(seed, 300, T(0), examined);
  all += against_the_resultant<T, 2, 2>(seed, 300, T(0), examined);
  all += against_the_resultant<T, 4, 2>(seed, 200, T(0), examined);
  all += against_the_resultant<T, 3, 5>(seed, 50, T(0), examined);
  all += against_the_resultant<T, 5, 5>(seed, 20, T(0), examined);
  CAPTURE(all.inside, all.simple, all.covered);
  CHECK(all.inside > 1000);
  CHECK(all.covered <= (sizeof(T) == 4 ? 20 : 0));
  CHECK(examined < 800);
}

TEMPLATE_TEST_CASE("boxes hold the roots of every pair within the given errors, simple ones one each", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 412;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  tally all;
  for (int n = 0; n < 250; ++n) {
    double const error = std::ldexp(1., -int(generator() % 12u) - 4);
    auto const p = random_pair<T, 3, 3>(generator, T(error));
    auto const found = isolate(p);
    CAPTURE(seed, n, error, found.count, found.examined);
    for (int m = 0; m < 4; ++m) {
      precise_pair q = precisely(p);
      for (precise_vector* c : {&q.f, &q.g}) {
        int const kind = int(generator() % 4u);
        for (std::size_t k = 0; k < 16; ++k) {
          // Any coefficients of that size, the same for all, of alternating signs; and Chebyshev's polynomials, whose
          // coefficients are far larger than they are.
          double const chebyshev[4] = {-1, 5, -5, 1};
          double const by = kind == 0   ? uniform(generator)
                            : kind == 1 ? (n % 2 == 0 ? 1 : -1)
                            : kind == 2 ? ((k / 4 + k % 4) % 2 == 0 ? 1 : -1)
                                        : chebyshev[k / 4] * chebyshev[k % 4];
          (*c)[k] += precise(error) * by;
        }
      }
      CAPTURE(m);
      tally const t = compare(found, resultant_oracle(q).roots(precise(-1) / 16, precise(17) / 16), {0, 1, 0, 1});
      CAPTURE(t.inside, t.simple, t.covered, t.lost, t.twice, t.wrong);
      REQUIRE(t.is_right());
      all += t;
    }
  }
  CAPTURE(all.inside, all.simple, all.covered);
  CHECK(all.simple > 500);
  CHECK(all.covered > 20);
}

TEMPLATE_TEST_CASE("in a part of the square, the roots of that part are found", "", float, double) {
  using T = TestType;
  unsigned const seed = 413;
  std::mt19937 generator(seed);
  tally all;
  for (int n = 0; n < 500; ++n) {
    auto const p = random_pair<T, 3, 3>(generator, T(0));
    isolate_options<T> options;
    T const width = std::ldexp(T(1), -int(generator() % 5u));
    T const steps = T(1) / width;
    T const low_u = width * T(int(generator() % unsigned(steps))),
            low_v = width * T(int(generator() % unsigned(steps)));
    options.domain = {low_u, low_u + width, low_v, low_v + width};
    auto const found = isolate(p, options);
    CAPTURE(seed, n, low_u, low_v, width, found.count, found.examined);
    REQUIRE(found.complete);
    tally const t =
        compare(found, resultant_oracle(precisely(p)).roots(precise(-1) / 16, precise(17) / 16), options.domain);
    CAPTURE(t.inside, t.simple, t.covered, t.lost, t.twice, t.wrong);
    REQUIRE(t.is_right());
    all += t;
  }
  CHECK(all.simple > 100);
}
