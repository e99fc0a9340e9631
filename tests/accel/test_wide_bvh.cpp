// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <intersect/random_box_rays.hpp>
#include <patchrt/accel/build_grouped_sah.hpp>
#include <patchrt/accel/build_wide_bvh.hpp>
#include <patchrt/accel/traverse_wide.hpp>
#include <patchrt/numbers/pack.hpp>
#include <support/catch.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

using namespace patchrt;

namespace {

using boxes_of_eight = pack<float, 8>;
constexpr float inf = std::numeric_limits<float>::infinity();

box<float> child_box(wide_node const& n, int slot) {
  return {{n.bounds[0][slot], n.bounds[2][slot], n.bounds[4][slot]},
          {n.bounds[1][slot], n.bounds[3][slot], n.bounds[5][slot]}};
}

template <std::size_t Most, class Fits>
grouped_bvh<float> group(std::vector<box<float>> const& boxes, Fits const& fits) {
  return detail::build_grouped_sah<Most>(detail::sah_primitives(std::span(boxes), serial{}), fits, serial{});
}

/// An odd rule: primitives of one parity alone.
bool are_of_one_parity(std::span<std::uint32_t const> p) {
  return std::all_of(p.begin(), p.end(), [&](std::uint32_t i) { return i % 2 == p[0] % 2; });
}

/// Leaves of up to four boxes, and the wide tree over them.
struct built {
  unsigned seed;
  std::vector<box<float>> boxes;
  grouped_bvh<float> grouped;
  wide_bvh wide;
  std::vector<box<float>> leaf_boxes;

  built(std::size_t n, unsigned s)
      : seed(s),
        boxes(test::scattered_boxes<float>(n, s)),
        grouped(group<4>(boxes, [](auto) { return true; })),
        wide(build_wide_bvh(grouped.tree)) {
    for (auto const& node : grouped.tree.nodes)
      if (node.primitive >= 0) leaf_boxes.push_back(node.bounds);
  }
};

watertight_slab_ray<float> random_ray(test::random_box_rays<float>& random, std::vector<box<float>> const& boxes) {
  auto const u = [&] { return random.uniform(-1.5f, 1.5f); };
  vec3<float> o{u(), u(), u()}, d{u(), u(), u()};
  if (random.chance(0.2)) {  // in the plane of a face
    box<float> const& b = boxes[std::size_t(random.pick(int(boxes.size())))];
    int const k = random.pick(3);
    o[k] = random.chance(0.5) ? b.lo[k] : b.hi[k];
    d[k] = random.chance(0.5) ? 0.0f : -0.0f;
  }
  if (random.chance(0.1)) o = o * 1000.0f;
  if (random.chance(0.3)) d = -o;
  return make_watertight_slab_ray(o, d);
}

/// Every leaf that a ray meets, with where it enters.
std::map<std::uint32_t, float> leaves_met(built const& b, watertight_slab_ray<float> const& r, float t_max) {
  std::map<std::uint32_t, float> met;
  for (std::size_t i = 0; i < b.leaf_boxes.size(); ++i) {
    auto const span = intersect(r, b.leaf_boxes[i], 0.0f, t_max);
    if (span.entry <= span.exit) met[static_cast<std::uint32_t>(i)] = span.entry;
  }
  return met;
}

}  // namespace

TEST_CASE("grouped leaves share out all primitives, as many as fit, in boxes that hold them") {
  std::size_t const n = GENERATE(std::size_t(1), std::size_t(2), std::size_t(9), std::size_t(1000), std::size_t(9000));
  unsigned const seed = GENERATE(3u, 4u);
  CAPTURE(n, seed);
  auto const boxes = test::scattered_boxes<float>(n, seed);
  auto const g = group<5>(boxes, are_of_one_parity);
  std::set<std::uint32_t> seen(g.order.begin(), g.order.end());
  REQUIRE(seen.size() == n);
  REQUIRE(g.order.size() == n);
  std::size_t const leaves = g.first.size() - 1;
  REQUIRE(g.tree.nodes.size() == 2 * leaves - 1);
  std::size_t next = 0;
  for (std::size_t i = 0; i < g.tree.nodes.size(); ++i) {
    bvh_node<float> const& node = g.tree.nodes[i];
    REQUIRE(node.skip > i);
    REQUIRE(node.skip <= g.tree.nodes.size());
    if (node.primitive < 0) {
      REQUIRE(node.bounds == merge(g.tree.nodes[i + 1].bounds, g.tree.nodes[g.tree.nodes[i + 1].skip].bounds));
      REQUIRE(g.tree.nodes[g.tree.nodes[i + 1].skip].skip == node.skip);
      continue;
    }
    REQUIRE(std::size_t(node.primitive) == next);
    auto const span = std::span(g.order).subspan(g.first[next], g.first[next + 1] - g.first[next]);
    REQUIRE(!span.empty());
    REQUIRE((span.size() == 1 || (span.size() <= 5 && are_of_one_parity(span))));
    box<float> all = box<float>::empty();
    for (std::uint32_t p : span) all = merge(all, boxes[p]);
    REQUIRE(node.bounds == all);
    REQUIRE(node.skip == i + 1);
    ++next;
  }
  REQUIRE(next == leaves);
}

TEST_CASE("grouped leaves are the largest subtrees of the tree over single boxes that fit") {
  unsigned const seed = 10u;
  auto const check = [](bvh<float> const& fine, grouped_bvh<float> const& g, std::size_t most, auto const& fits) {
    std::size_t at = 0, leaves = 0;
    for (std::size_t i = 0; i < fine.nodes.size(); ++at) {
      bvh_node<float> const& node = fine.nodes[i];
      std::vector<std::uint32_t> below;
      for (std::size_t k = i; k < node.skip && below.size() <= most; ++k)
        if (fine.nodes[k].primitive >= 0) below.push_back(static_cast<std::uint32_t>(fine.nodes[k].primitive));
      bool const is_leaf = below.size() == 1 || (below.size() <= most && fits(below));
      REQUIRE(at < g.tree.nodes.size());
      REQUIRE(g.tree.nodes[at].bounds == node.bounds);
      REQUIRE(g.tree.nodes[at].primitive == (is_leaf ? std::int32_t(leaves) : -1));
      i = is_leaf ? node.skip : i + 1;
      if (!is_leaf) continue;
      std::vector<std::uint32_t> in(g.order.begin() + g.first[leaves], g.order.begin() + g.first[leaves + 1]);
      std::sort(in.begin(), in.end());
      std::sort(below.begin(), below.end());
      REQUIRE(in == below);
      ++leaves;
    }
    REQUIRE(at == g.tree.nodes.size());
    REQUIRE(leaves + 1 == g.first.size());
  };
  auto const all = [](auto const&) { return true; };
  for (std::size_t const n : {0u, 1u, 8u, 9u, 300u, 2048u, 2049u, 9000u})
    for (auto const& [name, boxes] : test::box_sets<float>(n, seed)) {
      CAPTURE(seed, n, name);
      bvh<float> const fine = build_sah<float>(boxes);
      check(fine, group<1>(boxes, all), 1, all);
      check(fine, group<8>(boxes, all), 8, all);
      check(fine, group<8>(boxes, are_of_one_parity), 8, are_of_one_parity);
    }
}

TEST_CASE("a wide tree has every leaf once, in boxes within their parents'") {
  std::size_t const n = GENERATE(std::size_t(1), std::size_t(5), std::size_t(33), std::size_t(3000));
  built const b(n, 5);
  CAPTURE(n);
  std::vector<int> seen(b.leaf_boxes.size()), reached(b.wide.nodes.size());
  reached[0] = 1;
  for (wide_node const& node : b.wide.nodes)
    for (int k = 0; k < wide_node::width; ++k) {
      box<float> const c = child_box(node, k);
      if (c == box<float>::empty()) continue;
      if ((node.child[k] & wide_node::leaf) != 0) {
        std::uint32_t const leaf = node.child[k] & ~wide_node::leaf;
        REQUIRE(c == b.leaf_boxes[leaf]);
        ++seen[leaf];
      } else {
        ++reached[node.child[k]];
        wide_node const& below = b.wide.nodes[node.child[k]];
        box<float> all = box<float>::empty();
        for (int j = 0; j < wide_node::width; ++j)
          if (!is_empty(child_box(below, j))) all = merge(all, child_box(below, j));
        REQUIRE(all == c);
      }
    }
  REQUIRE(std::all_of(seen.begin(), seen.end(), [](int s) { return s == 1; }));
  REQUIRE(std::all_of(reached.begin(), reached.end(), [](int s) { return s == 1; }));
  // Children fill nodes: with few leaves a node no more than are needed.
  if (n == 3000) REQUIRE(b.wide.nodes.size() < b.leaf_boxes.size() / 4);
}

template <bool AnyHit, class Nearest, class Leaf>
void walk_to_the_end(wide_bvh const& tree, watertight_slab_ray<float> const& r, Nearest const& nearest,
                     Leaf const& leaf) {
  wide_walk<AnyHit, boxes_of_eight> walk(tree.view(), r, 0.0f);
  while (walk.step(nearest, leaf)) {
  }
}

TEST_CASE("a ray through a wide tree meets the leaves that it meets one by one, where it enters them") {
  unsigned const seed = GENERATE(6u, 7u);
  CAPTURE(seed);
  built const b(700, seed);
  test::random_box_rays<float> random(seed);
  std::size_t total = 0;
  for (int i = 0; i < 1000; ++i) {
    auto const r = random_ray(random, b.boxes);
    float const t_max = random.chance(0.5) ? 1.0f : inf;
    std::map<std::uint32_t, float> ordered;
    auto const nearest = [t_max] { return t_max; };
    auto const collect = [](std::map<std::uint32_t, float>& to) {
      return [&to](std::uint32_t leaf, float entry) {
        REQUIRE(to.emplace(leaf, entry).second);
        return false;
      };
    };
    walk_to_the_end<false>(b.wide, r, nearest, collect(ordered));
    std::set<std::uint32_t> unordered;
    walk_to_the_end<true>(b.wide, r, nearest, [&](std::uint32_t leaf, float entry) {
      REQUIRE(unordered.insert(leaf).second);
      REQUIRE(entry == 0.0f);
      return false;
    });
    auto const want = leaves_met(b, r, t_max);
    REQUIRE(ordered == want);
    REQUIRE(unordered.size() == want.size());
    for (auto const& [leaf, entry] : want) REQUIRE(unordered.count(leaf) == 1);
    total += want.size();
    // The walk ends by true, and leaves out what is beyond the nearest.
    if (want.empty()) continue;
    int calls = 0;
    walk_to_the_end<false>(b.wide, r, nearest, [&calls](std::uint32_t, float) { return ++calls == 1; });
    REQUIRE(calls == 1);
    float near = inf;
    std::set<std::uint32_t> few;
    walk_to_the_end<false>(
        b.wide, r, [&] { return min(near, t_max); },
        [&](std::uint32_t leaf, float entry) {
          few.insert(leaf);
          near = min(near, entry);
          return false;
        });
    for (auto const& [leaf, entry] : want)
      if (entry <= near) REQUIRE(few.count(leaf) == 1);
  }
  REQUIRE(total > 2000);
}

TEST_CASE("a bundle of rays meets for each lane the leaves that the lane meets") {
  unsigned const seed = GENERATE(8u, 9u);
  CAPTURE(seed);
  using T = pack<float, 16>;
  built const b(700, seed);
  test::random_box_rays<float> random(seed);
  std::size_t total = 0;
  for (int i = 0; i < 300; ++i) {
    vec3<float> const o{random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
    vec3<float> const d{random.uniform(-1, 1) - o.x, random.uniform(-1, 1) - o.y, random.uniform(-1, 1) - o.z};
    float const spread = random.chance(0.5) ? 0.02f : 0.5f;
    float origin[3][16], direction[3][16];
    for (int k = 0; k < 16; ++k)
      for (int a = 0; a < 3; ++a) {
        origin[a][k] = o[a] + float(i % 2) * spread * random.uniform(-1, 1);
        float const x = d[a] + spread * random.uniform(-1, 1);
        direction[a][k] = random.chance(0.02) ? std::copysign(0.0f, d[a]) : std::copysign(x, d[a]);
      }
    auto const pack_of = [](float const(&x)[3][16]) { return vec3<T>{T::load(x[0]), T::load(x[1]), T::load(x[2])}; };
    auto const rays = make_watertight_slab_ray(pack_of(origin), pack_of(direction));
    std::uint32_t const lanes = i % 3 == 0 ? 0xffffu : unsigned(random.pick(0xffff)) + 1u;
    T const t_max(random.chance(0.5) ? 1.5f : inf);
    std::map<std::uint32_t, float> met[16];
    traverse_wide_bundle<boxes_of_eight>(
        b.wide.view(), rays, T(0.0f), mask_t<T>::from_bits(lanes), [&] { return t_max; },
        [&](std::uint32_t leaf, mask_t<T> const& in, T const& entry) {
          for (int k = 0; k < 16; ++k)
            if (in[k]) REQUIRE(met[k].emplace(leaf, entry[k]).second);
          return mask_t<T>(true);
        });
    for (int k = 0; k < 16; ++k) {
      if ((lanes >> k & 1u) == 0) {
        REQUIRE(met[k].empty());
        continue;
      }
      auto const one = make_watertight_slab_ray(vec3<float>{origin[0][k], origin[1][k], origin[2][k]},
                                                vec3<float>{direction[0][k], direction[1][k], direction[2][k]});
      auto const want = leaves_met(b, one, t_max[0]);
      REQUIRE(met[k] == want);
      total += want.size();
    }
  }
  REQUIRE(total > 10000);
}

TEST_CASE("an empty tree is walked to its end") {
  using T = pack<float, 16>;
  wide_bvh const none = build_wide_bvh(bvh<float>{});
  auto const rays = make_watertight_slab_ray(vec3<T>{T(0.0f), T(0.0f), T(0.0f)}, vec3<T>{T(1.0f), T(0.0f), T(0.0f)});
  int leaves = 0;
  traverse_wide_bundle<boxes_of_eight>(
      none.view(), rays, T(0.0f), mask_t<T>(true), [] { return T(inf); },
      [&leaves](std::uint32_t, mask_t<T> const& in, T const&) {
        ++leaves;
        return in;
      });
  REQUIRE(leaves == 0);
}
