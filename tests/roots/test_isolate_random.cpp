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
  tally all = against_the_resultant<T, 3, 3>(seed, 2000, T(0), examined);
  CAPTURE(all.inside, all.simple, all.covered);
  CHECK(all.inside > 2500);
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
