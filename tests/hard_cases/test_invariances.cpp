// SPDX-License-Identifier: MIT
// What must not change an answer, over all hard cases.
#include "judge.hpp"

#include "support/catch.hpp"

#include <patchrt/trace/all_hits.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// The bits of t, u and v, and the error times `scale`.
bool is_scaled(answer const& a, answer const& b, double scale) {
  return is_same(a, b) &&
         (a.hit.error * scale == b.hit.error || std::fabs(a.hit.error * scale - b.hit.error) <= 1e-6 * b.hit.error);
}

template <accuracy A> void check_scales() {
  for (hard_case const& c : catalogue()) {
    auto const plain = posed(c, {});
    REQUIRE(plain);
    auto const expected = answers<A>(hierarchy_of(plain->patches).view(), {plain->r})[0];
    for (int k : {-20, -7, 3, 20}) {
      auto const scaled = posed(c, {}, two_to(k));
      REQUIRE(scaled);
      auto const found = answers<A>(hierarchy_of(scaled->patches).view(), {scaled->r})[0];
      CAPTURE(c.family, c.name, int(A), k, expected.hit.t, found.hit.t, expected.hit.u, found.hit.u, expected.hit.v,
              found.hit.v, expected.hit.error, found.hit.error);
      if ((c.defects & in_scales) == 0) CHECK(is_scaled(expected, found, std::ldexp(1, k)));
    }
  }
}

/// Whether all the row's roots are of the kind that no level may lose, and nothing comes close to touching.
bool is_plain(hard_case const& c) {
  return !c.is_close && (c.lost & (in_refined | in_certified)) == 0 && c.defects == 0 &&
         std::all_of(c.roots.begin(), c.roots.end(), [](exact_root const& r) { return r.kind < contact::singular; });
}

/// S(u, v) is the root within their errors.
bool is_at(posed_case const& q, patch_hit const& hit, posed_root const& r) {
  auto const apart = length(difference_of(wide_position(q.patches[std::size_t(hit.patch)], hit.u, hit.v), r.point));
  return std::isfinite(hit.error) && apart <= double(hit.error);
}

template <accuracy A> void check_all_roots() {
  int rows = 0;
  for (hard_case const& c : catalogue()) {
    if (!is_plain(c) || std::isfinite(c.t_max) || (c.defects & in_all_hits) != 0) continue;
    for (int parameters = 0; parameters < 8; ++parameters) {
      for (bool reversed : {false, true}) {
        auto q = posed(c, {0, parameters, reversed});
        if (!q) continue;
        q->r.t_min = -no_limit, q->r.t_max = no_limit;
        auto const h = hierarchy_of(q->patches);
        auto const hits = trace::all_hits<A>(h.view(), q->r);
        CAPTURE(c.family, c.name, int(A), parameters, reversed, hits.size());
        ++rows;
        for (posed_root const& r : q->roots) {
          auto const count =
              std::count_if(hits.begin(), hits.end(), [&](patch_hit const& x) { return is_at(*q, x, r); });
          CHECK(count >= 1);
        }
        for (patch_hit const& x : hits)
          CHECK(std::any_of(q->roots.begin(), q->roots.end(), [&](posed_root const& r) { return is_at(*q, x, r); }));
        CHECK(hits.size() <= q->roots.size());
      }
    }
  }
  CHECK(rows > 500);
}

}  // namespace

TEST_CASE("scaling a hard case by a power of two changes no bit of its answer") {
  check_scales<accuracy::refined>();
  check_scales<accuracy::certified>();
  check_scales<accuracy::reference>();
}

TEST_CASE("a hard case away from the origin by a million diagonals has its answer within what its error says there") {
  int moved = 0;
  for (hard_case const& c : catalogue()) {
    if ((c.lost & in_refined) != 0 || c.defects != 0) continue;
    // A million diagonals, of a unit patch: 9 sqrt(2) each.
    exact_point const shift{12000000, -13000000, 4000000};
    for (int parameters : {0, 3, 6}) {
      auto const q = posed(c, {0, parameters, false}, 1, shift);
      if (!q) continue;
      ++moved;
      auto const h = hierarchy_of(q->patches);
      bool const is_plain_row = is_plain(c);
      auto const refined = answers<accuracy::refined>(h.view(), {q->r})[0];
      auto const certified = answers<accuracy::certified>(h.view(), {q->r})[0];
      CAPTURE(c.family, c.name, parameters, refined.hit.t, refined.hit.error, certified.hit.t, int(certified.proof));
      // What was far from touching may come close, as rounding is a million times as large.
      CHECK(judge(*q, true, accuracy::certified, certified) == outcome::right);
      if (is_plain_row) CHECK(judge(*q, true, accuracy::refined, refined) == outcome::right);
    }
  }
  std::cout << moved << " poses a million diagonals away\n";
  CHECK(moved > 200);
}

TEST_CASE(
    "all hits of a ray are the roots of the hard case, each once, from either end and however it is parametrised") {
  check_all_roots<accuracy::refined>();
  check_all_roots<accuracy::certified>();
}
