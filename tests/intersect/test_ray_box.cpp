// SPDX-License-Identifier: MIT
#include <intersect/random_box_rays.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <support/catch.hpp>

using namespace patchrt;

namespace {

template <slab S, class T> slab_span<T> span_of(ray<T> const& r, box<T> const& b) {
  return intersect<S>(make_slab_ray(r.origin, r.direction), b, r.t_min, r.t_max);
}
template <class T> bool is_hit(slab_span<T> const& s) { return s.entry <= s.exit; }

template <class T> box<T> const unit_box{{T(0), T(0), T(0)}, {T(1), T(1), T(1)}};

}  // namespace

TEMPLATE_TEST_CASE("a ray spends in a box the t between its planes, within t_min and t_max", "", float, double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  struct row {
    char const* what;
    ray<T> r;
    box<T> b;
    bool hit;
    T entry, exit;
  };
  auto const& unit = unit_box<T>;
  box<T> const flat{{0, 0, 0}, {1, 1, 0}}, point{{1, 1, 1}, {1, 1, 1}};
  row const rows[] = {
      {"through", {{-1, T(.5), T(.5)}, {1, 0, 0}, 0, inf}, unit, true, 1, 2},
      {"t counts in the direction's length", {{-1, T(.5), T(.5)}, {4, 0, 0}, 0, inf}, unit, true, T(.25), T(.5)},
      {"backward", {{3, T(.5), T(.5)}, {-1, 0, 0}, 0, inf}, unit, true, 2, 3},
      {"from inside", {{T(.5), T(.5), T(.5)}, {1, 0, 0}, 0, inf}, unit, true, 0, T(.5)},
      {"the whole line", {{T(.5), T(.5), T(.5)}, {1, 0, 0}, -inf, inf}, unit, true, T(-.5), T(.5)},
      {"behind", {{2, T(.5), T(.5)}, {1, 0, 0}, 0, inf}, unit, false, 0, 0},
      {"ends in front", {{-1, T(.5), T(.5)}, {1, 0, 0}, 0, T(.875)}, unit, false, 0, 0},
      {"begins inside", {{-1, T(.5), T(.5)}, {1, 0, 0}, T(1.5), inf}, unit, true, T(1.5), 2},
      {"beside", {{-1, T(1.5), T(.5)}, {1, 0, 0}, 0, inf}, unit, false, 0, 0},
      {"beside, -0", {{-1, T(1.5), T(.5)}, {1, -T(0), -T(0)}, 0, inf}, unit, false, 0, 0},
      {"along the diagonal", {{-1, -1, -1}, {1, 1, 1}, 0, inf}, unit, true, 1, 2},
      {"touches an edge", {{-1, 1, T(.5)}, {1, 1, 0}, -inf, inf}, unit, false, 0, 0},
      {"through an edge", {{-1, 2, T(.5)}, {1, -1, 0}, 0, inf}, unit, true, 1, 2},
      {"in the face y = 0", {{-1, 0, T(.5)}, {1, 0, 0}, 0, inf}, unit, true, 1, 2},
      {"in the face y = 0, -0", {{-1, 0, T(.5)}, {1, -T(0), 0}, 0, inf}, unit, true, 1, 2},
      {"in the face y = 1", {{-1, 1, T(.5)}, {1, 0, 0}, 0, inf}, unit, true, 1, 2},
      {"in the face y = 1, -0", {{-1, 1, T(.5)}, {1, -T(0), 0}, 0, inf}, unit, true, 1, 2},
      {"in the face z = 0", {{-1, T(.5), 0}, {1, 0, 0}, 0, inf}, unit, true, 1, 2},
      {"in the face x = 1", {{1, -1, T(.5)}, {0, 1, 0}, 0, inf}, unit, true, 1, 2},
      {"along an edge", {{0, 1, -1}, {0, -T(0), 1}, 0, inf}, unit, true, 1, 2},
      {"through a flat box", {{T(.5), T(.5), 1}, {0, 0, -1}, 0, inf}, flat, true, 1, 1},
      {"in a flat box's plane", {{-1, T(.5), 0}, {1, 0, 0}, 0, inf}, flat, true, 1, 2},
      {"in a flat box's plane, -0", {{-1, T(.5), 0}, {1, 0, -T(0)}, 0, inf}, flat, true, 1, 2},
      {"through a point", {{0, 0, 0}, {1, 1, 1}, 0, inf}, point, true, 1, 1},
      {"past a point", {{0, 0, 0}, {1, 1, 1 + std::numeric_limits<T>::epsilon()}, 0, inf}, point, false, 0, 0},
      {"everything", {{1, 2, 3}, {1, 0, -1}, -1, 2}, {{-inf, -inf, -inf}, {inf, inf, inf}}, true, -1, 2},
      {"nothing", {{0, 0, 0}, {1, 0, -1}, -inf, inf}, box<T>::empty(), false, 0, 0},
      {"nothing, from all sides", {{0, 0, 0}, {1, 1, 1}, -inf, inf}, box<T>::empty(), false, 0, 0},
  };
  for (row const& r : rows) {
    CAPTURE(r.what);
    slab_span<T> const s = span_of<slab::nearest>(r.r, r.b);
    REQUIRE(is_hit(s) == r.hit);
    if (r.hit) {
      REQUIRE(s.entry == r.entry);
      REQUIRE(s.exit == r.exit);
      slab_span<T> const wide = span_of<slab::conservative>(r.r, r.b);
      REQUIRE(wide.entry <= r.entry);
      REQUIRE(wide.exit >= r.exit);
      REQUIRE(wide.entry >= r.entry - 5 * std::numeric_limits<T>::epsilon() * abs(r.entry));
      REQUIRE(wide.exit <= r.exit + 5 * std::numeric_limits<T>::epsilon() * abs(r.exit));
    }
  }
}

TEMPLATE_TEST_CASE("without t_min and t_max the span is that of the whole line", "", float, double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  auto const r = make_slab_ray(vec3<T>{T(.5), T(.5), T(.5)}, vec3<T>{T(.5), 0, 0});
  REQUIRE(intersect(r, unit_box<T>).entry == T(-1));
  REQUIRE(intersect(r, unit_box<T>).exit == T(1));
  REQUIRE(intersect<slab::conservative>(r, unit_box<T>).entry < T(-1));
  REQUIRE(intersect<slab::conservative>(r, unit_box<T>).exit > T(1));
  REQUIRE(intersect(r, box<T>{{-inf, 0, 0}, {inf, 1, 1}}).exit == inf);
}

TEMPLATE_TEST_CASE("a range that is NaN or reversed is a miss", "", float, double) {
  using T = TestType;
  constexpr T nan = std::numeric_limits<T>::quiet_NaN();
  vec3<T> const o{-1, T(.5), T(.5)}, d{1, 0, 0};
  for (auto const& [t_min, t_max] : {std::pair<T, T>{nan, 5}, {0, nan}, {nan, nan}, {T(1.75), T(1.25)}}) {
    CAPTURE(t_min, t_max);
    REQUIRE_FALSE(is_hit(span_of<slab::nearest>(ray<T>{o, d, t_min, t_max}, unit_box<T>)));
    REQUIRE_FALSE(is_hit(span_of<slab::conservative>(ray<T>{o, d, t_min, t_max}, unit_box<T>)));
  }
}

TEMPLATE_TEST_CASE("a box inside another is entered no sooner and left no later, in computed arithmetic", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 20120u;
  CAPTURE(seed);
  test::random_box_rays<T> random(seed);
  int hits = 0, wrong = 0;
  auto const check = [&](slab_span<T> const& inner, slab_span<T> const& outer) {
    if (!is_hit(inner)) return;
    ++hits;
    wrong += !(is_hit(outer) && outer.entry <= inner.entry && inner.exit <= outer.exit);
  };
  for (int i = 0; i < 1000000; ++i) {
    box<T> const inner = random.any_box(), outer = random.around(inner);
    ray<T> const r = random.any_ray(inner);
    check(span_of<slab::nearest>(r, inner), span_of<slab::nearest>(r, outer));
    check(span_of<slab::conservative>(r, inner), span_of<slab::conservative>(r, outer));
    check(span_of<slab::nearest>(r, inner), span_of<slab::conservative>(r, inner));
  }
  REQUIRE(wrong == 0);
  REQUIRE(hits > 500000);
}
