// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <intersect/random_box_rays.hpp>
#include <patchrt/accel/build_sah.hpp>
#include <patchrt/accel/refit.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <support/catch.hpp>

#include <algorithm>
#include <set>

using namespace patchrt;

namespace {

/// The number of the node whose bounds are `b`.
template <class T> std::size_t index_of(bvh<T> const& tree, box<T> const& b) {
  return std::size_t(reinterpret_cast<bvh_node<T> const*>(&b) - tree.nodes.data());
}

/// Which of a node's children comes first for an octant, worked out afresh.
template <class T> std::size_t nearer_child(bvh<T> const& tree, std::size_t i, unsigned octant) {
  std::size_t const first = i + 1, second = tree.nodes[first].skip;
  box<T> const &a = tree.nodes[first].bounds, &b = tree.nodes[second].bounds;
  int axis = 0;
  auto const apart = [&](int k) { return (b.lo[k] - a.lo[k]) + (b.hi[k] - a.hi[k]); };
  for (int k = 1; k < 3; ++k)
    if (abs(apart(k)) > abs(apart(axis))) axis = k;
  bool const negative = (octant >> axis & 1u) != 0;
  return (apart(axis) < 0) == negative ? first : second;
}

template <class T> struct scene {
  unsigned seed;
  std::vector<box<T>> boxes;
  bvh<T> tree;
  std::vector<ray<T>> rays;

  scene(std::size_t n, unsigned s) : seed(s), boxes(test::scattered_boxes<T>(n, s)), tree(build_sah<T>(boxes)) {
    test::random_box_rays<T> random(s);
    auto const u = [&] { return random.uniform(T(-1.5), T(1.5)); };
    for (int i = 0; i < 2000; ++i) {
      vec3<T> o{u(), u(), u()}, d{u(), u(), u()};
      if (random.chance(0.2) && n > 0) {  // in the plane of a face
        box<T> const& b = boxes[std::size_t(random.pick(int(n)))];
        int const k = random.pick(3);
        o[k] = random.chance(0.5) ? b.lo[k] : b.hi[k];
        d[k] = random.chance(0.5) ? T(0) : -T(0);
      }
      if (random.chance(0.2)) d[random.pick(3)] = T(0);
      if (random.chance(0.1)) o = o * T(1000);
      if (random.chance(0.3)) d = -o;
      rays.push_back({o, d, T(0), random.chance(0.5) ? T(1) : std::numeric_limits<T>::infinity()});
    }
  }
};

}  // namespace

TEMPLATE_TEST_CASE("a walk finds just the boxes that testing all of them finds, in any octant's order", "", float,
                   double) {
  using T = TestType;
  for (std::size_t const n : {0u, 1u, 2u, 3u, 10u, 300u}) {
    scene<T> const s(n, 11u);
    CAPTURE(s.seed, n);
    std::size_t hits = 0, inside = 0;
    for (ray<T> const& r : s.rays) {
      slab_ray<T> const slabs = make_slab_ray(r.origin, r.direction);
      auto const met = [&](box<T> const& b) {
        auto const span = intersect(slabs, b, r.t_min, r.t_max);
        return span.entry <= span.exit;
      };
      std::set<std::int32_t> expected;
      for (std::size_t i = 0; i < n; ++i) {
        if (met(s.boxes[i])) expected.insert(std::int32_t(i));
        inside += contains(s.boxes[i], box<T>{r.origin, r.origin});
      }
      hits += expected.size();
      for (unsigned octant = 0; octant < 9; ++octant) {
        std::set<std::int32_t> found;
        auto const leaf = [&](std::int32_t p) {
          REQUIRE(found.insert(p).second);
          return false;
        };
        bool const stopped =
            octant < 8 ? traverse(s.tree.view(), octant, met, leaf) : traverse_unordered(s.tree.view(), met, leaf);
        REQUIRE_FALSE(stopped);
        REQUIRE(found == expected);
      }
    }
    if (n == 300) REQUIRE(hits > 2000);
    if (n == 300) REQUIRE(inside > 50);
  }
}

TEMPLATE_TEST_CASE("the walk without order takes the nodes as they lie, and skips what is below a miss", "", float,
                   double) {
  using T = TestType;
  scene<T> const s(200, 12u);
  CAPTURE(s.seed);
  test::random_box_rays<T> random(s.seed);
  for (double const p : {1.0, 0.9, 0.5}) {
    std::size_t next = 0, leaves = 0;
    traverse_unordered(
        s.tree.view(),
        [&](box<T> const& b) {
          std::size_t const i = index_of(s.tree, b);
          REQUIRE(i == next);
          bool const enter = random.chance(p);
          next = enter ? i + 1 : s.tree.nodes[i].skip;
          return enter;
        },
        [&](std::int32_t primitive) {
          REQUIRE(s.tree.nodes[next - 1].primitive == primitive);
          ++leaves;
          return false;
        });
    REQUIRE(next == s.tree.nodes.size());
    if (p == 1.0) REQUIRE(leaves == s.boxes.size());
  }
}

TEMPLATE_TEST_CASE("the ordered walk takes each node's near child first, all below it, then the far one", "", float,
                   double) {
  using T = TestType;
  scene<T> s(200, 13u);
  CAPTURE(s.seed);
  test::random_box_rays<T> random(s.seed);
  auto const check = [&](unsigned octant, double p) {
    std::vector<std::size_t> expected{0}, seen;  // what is still to come, the next at the back
    traverse(
        s.tree.view(), octant,
        [&](box<T> const& b) {
          std::size_t const i = index_of(s.tree, b);
          REQUIRE(!expected.empty());
          REQUIRE(i == expected.back());
          expected.pop_back();
          seen.push_back(i);
          bool const enter = random.chance(p);
          if (enter && s.tree.nodes[i].primitive < 0) {
            std::size_t const near = nearer_child(s.tree, i, octant), first = i + 1;
            expected.push_back(near == first ? s.tree.nodes[first].skip : first);
            expected.push_back(near);
          }
          return enter;
        },
        [&](std::int32_t primitive) {
          REQUIRE(s.tree.nodes[seen.back()].primitive == primitive);
          return false;
        });
    REQUIRE(expected.empty());
    if (p == 1.0) REQUIRE(seen.size() == s.tree.nodes.size());
  };
  for (unsigned octant = 0; octant < 8; ++octant)
    for (double const p : {1.0, 0.9, 0.5}) check(octant, p);
  refit<T>(s.tree.nodes, test::surface_boxes<T>(200, 14u));
  link_octants<T>(s.tree.nodes, s.tree.links);
  for (unsigned octant = 0; octant < 8; ++octant) check(octant, 1.0);
}

TEMPLATE_TEST_CASE("a walk that t prunes finds the nearest box and visits fewer nodes", "", float, double) {
  using T = TestType;
  scene<T> const s(1000, 15u);
  CAPTURE(s.seed);
  std::size_t visits[2] = {0, 0}, all = 0;
  for (ray<T> const& r : s.rays) {
    slab_ray<T> const slabs = make_slab_ray(r.origin, r.direction);
    T expected = std::numeric_limits<T>::infinity();
    for (auto const& b : s.boxes) {
      auto const span = intersect(slabs, b, r.t_min, r.t_max);
      if (span.entry <= span.exit) expected = min(expected, span.entry);
    }
    unsigned const octant = direction_octant(r.direction);
    for (unsigned const o : {octant, octant ^ 7u}) {
      T nearest = std::numeric_limits<T>::infinity(), entry = 0;
      traverse(
          s.tree.view(), o,
          [&](box<T> const& b) {
            ++visits[o != octant];
            auto const span = intersect(slabs, b, r.t_min, min(nearest, r.t_max));
            entry = span.entry;
            return span.entry <= span.exit;
          },
          [&](std::int32_t) {
            nearest = min(nearest, entry);
            return false;
          });
      REQUIRE(nearest == expected);
    }
    traverse(
        s.tree.view(), octant,
        [&](box<T> const& b) {
          ++all;
          auto const span = intersect(slabs, b, r.t_min, r.t_max);
          return span.entry <= span.exit;
        },
        [](std::int32_t) { return false; });
  }
  CAPTURE(visits[0], visits[1], all);
  REQUIRE(visits[0] * 3 < all * 2);
  REQUIRE(visits[0] * 4 < visits[1] * 3);  // far child first
}

TEMPLATE_TEST_CASE("a leaf that says stop ends the walk", "", float, double) {
  using T = TestType;
  scene<T> const s(100, 16u);
  auto const enter = [](box<T> const&) { return true; };
  for (int stop_at = 1; stop_at <= 100; stop_at += 33) {
    int calls = 0;
    auto const leaf = [&](std::int32_t) { return ++calls == stop_at; };
    REQUIRE(traverse(s.tree.view(), 5u, enter, leaf));
    REQUIRE(calls == stop_at);
    calls = 0;
    REQUIRE(traverse_unordered(s.tree.view(), enter, leaf));
    REQUIRE(calls == stop_at);
  }
}

TEMPLATE_TEST_CASE("leaves of empty boxes are never reached by rays", "", float, double) {
  using T = TestType;
  auto boxes = test::scattered_boxes<T>(90, 17u);
  for (std::size_t i = 0; i < 90; i += 3) boxes[i] = box<T>::empty();
  bvh<T> const tree = build_sah<T>(boxes);
  scene<T> const s(90, 17u);
  std::size_t hits = 0;
  for (ray<T> const& r : s.rays) {
    slab_ray<T> const slabs = make_slab_ray(r.origin, r.direction);
    traverse(
        tree.view(), direction_octant(r.direction),
        [&](box<T> const& b) {
          auto const span = intersect(slabs, b, r.t_min, r.t_max);
          return span.entry <= span.exit;
        },
        [&](std::int32_t p) {
          REQUIRE(p % 3 != 0);
          ++hits;
          return false;
        });
  }
  REQUIRE(hits > 500);
}

TEMPLATE_TEST_CASE("an octant has a bit for each negative component", "", float, double) {
  using T = TestType;
  REQUIRE(direction_octant(vec3<T>{1, 2, 3}) == 0);
  REQUIRE(direction_octant(vec3<T>{-1, 2, 3}) == 1);
  REQUIRE(direction_octant(vec3<T>{1, -2, 3}) == 2);
  REQUIRE(direction_octant(vec3<T>{1, 2, -3}) == 4);
  REQUIRE(direction_octant(vec3<T>{-1, 0, -3}) == 5);
}
