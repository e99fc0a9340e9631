// SPDX-License-Identifier: MIT
// The rows themselves: what they say is so, by rational arithmetic and by the oracle.
#include "known_losses.hpp"
#include "pose.hpp"
#include "rows_contact.hpp"
#include "rows_scene.hpp"
#include "rows_shape.hpp"

#include "support/catch.hpp"
#include "support/oracle.hpp"

#include <set>

using namespace patchrt;
using namespace patchrt::test;

std::vector<hard_case> const& patchrt::test::catalogue() {
  static std::vector<hard_case> const rows = [] {
    std::vector<hard_case> all;
    add_contacts(all);
    add_folds(all);
    add_poles(all);
    add_flat(all);
    add_borders(all);
    add_axes(all);
    add_sizes(all);
    for (known_loss const& loss : known_losses())
      for (hard_case& c : all)
        if (c.name == loss.name) c.lost |= loss.lost, c.defects |= loss.defects;
    return all;
  }();
  return rows;
}

namespace {

/// det(S_u, S_v, direction).
rational jacobian(hard_case const& c, exact_root const& r) {
  test::exact_patch const& p = c.patches[std::size_t(r.patch)];
  exact_point const n = cross(value(derivative_u(p), r.u, r.v), value(derivative_v(p), r.u, r.v));
  return n[0] * c.ray_direction[0] + n[1] * c.ray_direction[1] + n[2] * c.ray_direction[2];
}

/// Or as near to it as rounding is.
bool is_on_border(exact_root const& r) {
  rational const near = two_to(-48);
  return abs(r.u * (1 - r.u)) < near || abs(r.v * (1 - r.v)) < near;
}

}  // namespace

TEST_CASE("every hard case has its roots where it says, of the kind it says, and a name of its own") {
  std::set<std::string> names;
  for (hard_case const& c : catalogue()) {
    CAPTURE(c.family, c.name);
    CHECK(names.insert(c.name).second);
    CHECK(!c.origin.empty());
    rational last = -1000;
    for (exact_root const& r : c.roots) {
      test::exact_patch const& p = c.patches[std::size_t(r.patch)];
      exact_point const on_ray = c.ray_origin - rational(-r.t) * c.ray_direction;
      CHECK(value(p, r.u, r.v) == on_ray);
      bool const is_inside = 0 <= r.u && r.u <= 1 && 0 <= r.v && r.v <= 1;
      CHECK(is_inside == (r.kind != contact::beyond));
      CHECK(last <= r.t);
      last = r.t;
      bool const is_regular = jacobian(c, r) != 0;
      CHECK(is_regular == (r.kind < contact::singular || r.kind == contact::beyond));
      if (r.kind == contact::simple) CHECK(!is_on_border(r));
      if (r.kind == contact::border || r.kind == contact::beyond) CHECK(is_on_border(r));
    }
  }
  std::cout << catalogue().size() << " hard cases\n";
  CHECK(names.size() >= 100);
}

TEST_CASE("every loss that is known is of a hard case") {
  for (known_loss const& loss : known_losses()) {
    CAPTURE(loss.name);
    CHECK(std::count_if(catalogue().begin(), catalogue().end(), [&](auto const& c) { return c.name == loss.name; }) ==
          1);
  }
}

TEST_CASE("every hard case can be held in doubles exactly, and most in every pose") {
  int exact = 0, all = 0;
  for (hard_case const& c : catalogue()) {
    CAPTURE(c.family, c.name);
    CHECK(posed(c, {}));
    for (int turn = 0; turn < turn_count; ++turn)
      for (bool reversed : {false, true}) exact += posed(c, {turn, 0, reversed}).has_value(), ++all;
  }
  std::cout << exact << " of " << all << " poses are exact\n";
  CHECK(10 * exact > 8 * all);
}

TEST_CASE("the oracle finds the regular roots of every hard case and no other") {
  for (hard_case const& c : catalogue()) {
    CAPTURE(c.family, c.name);
    auto const q = posed(c, {});
    REQUIRE(q);
    auto numbers = numbers_of(q->r);
    numbers[6] = -no_limit, numbers[7] = no_limit;
    auto const found = oracle(numbers_of(q->patches)).all_hits(numbers, 1e-14);
    auto const speed = static_cast<long double>(length(widely(q->r.direction)));
    auto const is_near = [&](oracle_root const& o, posed_root const& r) {
      bool const is_in = r.kind == contact::curve && static_cast<long double>(r.t) <= o.t + 1e-9L &&
                         o.t <= static_cast<long double>(r.t_end) + 1e-9L;
      long double const spread =
          o.singular ? 2 * o.slack * speed + 0.02L * (long double)(q->size) : 1e-13L * (long double)(q->size);
      return is_in || std::fabs(o.t - static_cast<long double>(r.t)) * speed <= spread;
    };
    for (oracle_root const& o : found) {
      bool const is_listed =
          std::any_of(q->roots.begin(), q->roots.end(), [&](auto const& r) { return is_near(o, r); });
      if (o.is_certain(1e-7, 1e-12)) CHECK(is_listed);
    }
    for (posed_root const& r : q->roots) {
      if (r.kind != contact::simple && r.kind != contact::border) continue;
      CHECK(std::any_of(found.begin(), found.end(), [&](auto const& o) { return is_near(o, r); }));
    }
  }
}
