// SPDX-License-Identifier: MIT
// Every hard case, in every pose, at every level of accuracy.
#include "judge.hpp"

#include "support/catch.hpp"

#include <cstdio>
#include <map>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// What a level made of the poses of one row.
struct tally {
  int poses = 0, right = 0, certified = 0, tangent = 0, degenerate = 0, alone = 0;
  std::map<outcome, int> wrong;
};

template <accuracy A> void tally_pose(tally& sum, hard_case const& c, posed_case const& there, posed_case const* back) {
  auto const h = hierarchy_of(there.patches);
  ray_list rays(16, there.r);
  if (back)
    for (std::size_t i = 1; i < rays.size(); i += 2) rays[i] = back->r;
  auto const packs = answers<A>(h.view(), rays);
  for (std::size_t i = 0; i < (back ? 2u : 1u); ++i) {
    answer const& a = packs[i];
    auto const verdict = judge(i == 0 ? there : *back, c.is_close, A, a);
    ++sum.poses;
    sum.right += verdict == outcome::right;
    if (verdict != outcome::right) ++sum.wrong[verdict];
    sum.certified += a.proof == certainty::certified;
    sum.tangent += a.proof == certainty::tangent;
    sum.degenerate += a.proof == certainty::degenerate;
    sum.alone += !is_same(a, single_answer<A>(h.view(), rays[i]));
    for (std::size_t k = i; k < rays.size(); k += back ? 2 : 1) sum.alone += !is_same(a, packs[k]);
  }
}

template <accuracy A> tally tally_case(hard_case const& c) {
  tally sum;
  for (int turn = 0; turn < turn_count; ++turn) {
    for (int parameters = 0; parameters < 8; ++parameters) {
      auto const there = posed(c, {turn, parameters, false}), back = posed(c, {turn, parameters, true});
      if (there) tally_pose<A>(sum, c, *there, back ? &*back : nullptr);
    }
  }
  return sum;
}

/// "32" where all poses are right, else "30 lost 2".
std::string describe(tally const& t) {
  std::string text = std::to_string(t.right);
  for (auto const& [what, count] : t.wrong) text += std::string(" ") + name_of(what) + " " + std::to_string(count);
  return text;
}

template <accuracy A> void check(hard_case const& c, tally const& t) {
  INFO("level " << int(A) << ": " << describe(t) << " of " << t.poses);
  CHECK(t.alone == 0);
  unsigned const level = 1u << int(A);
  if (((c.lost | c.defects) & level) == 0) CHECK(t.right == t.poses);
}

}  // namespace

TEST_CASE("every level answers every hard case in every pose, but where the row says what is lost") {
  std::printf("%-12s %-66s poses | fast | refined | certified (proofs) | reference\n", "family", "case");
  for (hard_case const& c : catalogue()) {
    CAPTURE(c.family, c.name, c.origin);
    tally const fast = tally_case<accuracy::fast>(c), refined = tally_case<accuracy::refined>(c),
                certified = tally_case<accuracy::certified>(c), reference = tally_case<accuracy::reference>(c);
    std::printf("%-12s %-66s %d | %s | %s | %s (%d certified, %d tangent, %d degenerate) | %s\n", c.family.c_str(),
                c.name.c_str(), refined.poses, describe(fast).c_str(), describe(refined).c_str(),
                describe(certified).c_str(), certified.certified, certified.tangent, certified.degenerate,
                describe(reference).c_str());
    check<accuracy::fast>(c, fast);
    check<accuracy::refined>(c, refined);
    check<accuracy::certified>(c, certified);
    check<accuracy::reference>(c, reference);
  }
}
