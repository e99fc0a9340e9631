// SPDX-License-Identifier: MIT
#include "isolation_checks.hpp"

#include <patchrt/roots/krawczyk.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

bool is_in(precise_root const& r, parameter_box<double> const& box) {
  return box.u_low <= r.u && r.u <= box.u_high && box.v_low <= r.v && r.v <= box.v_high;
}

/// What was claimed of boxes, and how often.
struct claims {
  int excluded = 0, injective = 0, exactly_one = 0, contracted = 0;
};

template <class T, int M, int N> claims check_claims(unsigned seed, int pairs) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  claims made;
  for (int n = 0; n < pairs; ++n) {
    double const error = n % 3 == 0 ? 0 : std::ldexp(1., -int(generator() % 10u) - 3);
    auto const p = random_pair<T, M, N>(generator, T(error));
    precise_pair q = precisely(p);
    for (precise_vector* c : {&q.f, &q.g}) {
      double const shift = n % 2 == 0 ? (generator() % 2u == 0 ? 1 : -1) : 0;
      for (precise& x : *c) x += precise(error) * (shift != 0 ? shift : uniform(generator));
    }
    auto const roots = resultant_oracle(q).roots(precise(-1) / 16, precise(17) / 16);
    auto const pair = detail::scaled(p);
    for (int m = 0; m < 200; ++m) {
      // Around roots, with borders on any side of them, and anywhere.
      double const width = std::ldexp(1., -int(generator() % 8u)), height = std::ldexp(1., -int(generator() % 8u));
      double u = (uniform(generator) + 1) / 2, v = (uniform(generator) + 1) / 2;
      if (!roots.empty() && m % 4 != 0) {
        precise_root const& r = roots[generator() % roots.size()];
        u = static_cast<double>(r.u) + width * uniform(generator) * 0.7;
        v = static_cast<double>(r.v) + height * uniform(generator) * 0.7;
      }
      double const h = detail::overhang<double>();
      parameter_box<T> const box{
          detail::grid_below(T(std::max(u - width / 2, -h))), detail::grid_above(T(std::min(u + width / 2, 1 + h))),
          detail::grid_below(T(std::max(v - height / 2, -h))), detail::grid_above(T(std::min(v + height / 2, 1 + h)))};
      if (!(box.u_low < box.u_high && box.v_low < box.v_high)) continue;
      auto const facts = detail::examine(pair, box);
      auto const held = [&](parameter_box<T> const& b) {
        int count = 0;
        for (precise_root const& r : roots) count += is_in(r, {b.u_low, b.u_high, b.v_low, b.v_high});
        return count;
      };
      CAPTURE(seed, n, m, error, box.u_low, box.u_high, box.v_low, box.v_high);
      if (facts.is_excluded) {
        ++made.excluded;
        REQUIRE(held(box) == 0);
      }
      if (facts.is_excluded || facts.is_vanishing) continue;
      if (detail::is_injective(facts)) {
        ++made.injective;
        REQUIRE(held(box) <= 1);
      }
      if (detail::has_exactly_one(facts)) {
        ++made.exactly_one;
        REQUIRE(held(box) == 1);
      }
      parameter_box<T> part = box;
      detail::contract<M>(facts.row[0], part.u_low, part.u_high);
      detail::contract<N>(facts.row[1], part.v_low, part.v_high);
      made.contracted += !(part.u_low == box.u_low && part.u_high == box.u_high && part.v_low == box.v_low &&
                           part.v_high == box.v_high);
      REQUIRE(held(part) == held(box));
    }
  }
  return made;
}

}  // namespace

TEMPLATE_TEST_CASE("what is proved of a box holds for every pair within the errors", "", float, double) {
  unsigned const seed = 450;
  claims const c = check_claims<TestType, 3, 3>(seed, 150);
  CAPTURE(c.excluded, c.injective, c.exactly_one, c.contracted);
  CHECK(c.excluded > 5000);
  CHECK(c.injective > 1500);
  CHECK(c.exactly_one > 500);
  CHECK(c.contracted > 3000);
  check_claims<TestType, 1, 2>(seed + 1, 100);
  check_claims<TestType, 4, 2>(seed + 2, 50);
}

TEMPLATE_TEST_CASE("a restricted pair and its values are within the bound on rounding", "", float, double) {
  using T = TestType;
  unsigned const seed = 452;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1. / 128, 1 + 1. / 128);
  double worst = 0, worst_value = 0;
  for (int n = 0; n < 2000; ++n) {
    auto p = random_pair<T, 3, 3>(generator, T(0));
    // Largest rounding where all are of one size and one sign, or cancel.
    for (T& x : p.f) x = n % 2 == 0 ? std::copysign(T(1) + x / 64, n % 4 == 0 ? T(1) : x) : x;
    auto const pair = detail::scaled(p);
    double ends[4];
    for (double& x : ends) x = uniform(generator);
    if (ends[0] > ends[1]) std::swap(ends[0], ends[1]);
    if (ends[2] > ends[3]) std::swap(ends[2], ends[3]);
    T const h = detail::overhang<T>();
    parameter_box<T> const box{
        detail::grid_below(std::max(T(ends[0]), -h)), detail::grid_above(std::min(T(ends[1]), 1 + h)),
        detail::grid_below(std::max(T(ends[2]), -h)), detail::grid_above(std::min(T(ends[3]), 1 + h))};
    auto const part = detail::restricted(pair, box);
    // The blossom at i times the right end, 3 - i times the left.
    auto const blossom = [](precise_vector b, int i, T low, T high) {
      for (; b.size() > 1; b.pop_back(), --i) {
        precise const t(i > 0 ? high : low);
        for (std::size_t k = 0; k + 1 < b.size(); ++k) b[k] += t * (b[k + 1] - b[k]);
      }
      return b[0];
    };
    for (int i = 0; i <= 3; ++i) {
      for (int j = 0; j <= 3; ++j) {
        precise_vector across;
        for (int k = 0; k <= 3; ++k) {
          precise_vector column;
          for (int l = 0; l <= 3; ++l) column.emplace_back(pair.rows[l][k]);
          across.push_back(blossom(column, i, box.u_low, box.u_high));
        }
        precise const off = abs(blossom(across, j, box.v_low, box.v_high) - precise(part.x[j][i]));
        worst = std::max(worst, static_cast<double>(precise(off / pair.noise_f)));
      }
    }
    T const u = T(ends[0]), v = T(ends[2]);
    precise const exact = resultant_oracle(precisely(p)).values(precise(u), precise(v)).first / pair.scale_f;
    precise const off = abs(exact - precise(detail::evaluate(pair, u, v).f));
    worst_value = std::max(worst_value, static_cast<double>(precise(off / pair.noise_f)));
  }
  CAPTURE(seed, worst, worst_value);
  CHECK(worst <= 1);
  CHECK(worst > 0.1);
  CHECK(worst_value <= 1.5);
  CHECK(worst_value > 0.05);
}

TEMPLATE_TEST_CASE("one root is not proved where an error as small as allowed makes it three", "", float, double) {
  using T = TestType;
  // f = 4 (u - 1/2), wrong by 1 at most: with Chebyshev's T_3(2 u - 1) it is 4 y^3 - y, y = 2 u - 1.
  bernstein_pair<T> p;
  for (int i = 0; i <= 3; ++i) {
    for (int j = 0; j <= 3; ++j) {
      p.f[4 * i + j] = T(4 * i - 6) / 3;
      p.g[4 * i + j] = T(2 * j - 3) / 6;
    }
  }
  p.error_f = 1 + std::numeric_limits<T>::epsilon() * 8;
  p.error_g = std::numeric_limits<T>::epsilon();
  CHECK_FALSE(detail::has_exactly_one(detail::examine(detail::scaled(p), {0, 1, 0, 1})));
  auto const found = isolate(p);
  for (double u : {0.25, 0.5, 0.75}) {
    int simple = 0, other = 0;
    for (int k = 0; k < found.count; ++k) {
      if (holds(found.roots[k], u, 0.5)) ++(found.roots[k].kind == root_kind::simple ? simple : other);
    }
    CAPTURE(u, found.count);
    CHECK(simple == 0);
    CHECK(other == 1);
  }
}
