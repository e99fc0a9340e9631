// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <patchrt/accel/build_sah.hpp>
#include <support/catch.hpp>

#include <algorithm>
#include <cstring>

using namespace patchrt;

namespace {

/// Empty, or what is wrong with the tree.
template <class T> std::string fault(bvh<T> const& tree, std::vector<box<T>> const& boxes) {
  std::size_t const n = boxes.size(), count = tree.nodes.size();
  if (count != (n == 0 ? 0 : 2 * n - 1) || tree.links.size() != count) return "node count";
  std::vector<int> leaves(n, 0);
  for (std::size_t i = 0; i < count; ++i) {
    bvh_node<T> const& node = tree.nodes[i];
    auto const at = " at node " + std::to_string(i);
    if (node.skip <= i || node.skip > count) return "skip" + at;
    if (node.primitive >= 0) {
      if (node.skip != i + 1) return "leaf's skip" + at;
      if (std::size_t(node.primitive) >= n) return "primitive" + at;
      ++leaves[std::size_t(node.primitive)];
      if (!(node.bounds == boxes[std::size_t(node.primitive)])) return "leaf's bounds" + at;
    } else {
      if (node.primitive != -1) return "inner node's primitive" + at;
      std::size_t const second = tree.nodes[i + 1].skip;
      if (second >= node.skip || tree.nodes[second].skip != node.skip) return "children" + at;
      if (!contains(node.bounds, tree.nodes[i + 1].bounds)) return "first child sticks out" + at;
      if (!contains(node.bounds, tree.nodes[second].bounds)) return "second child sticks out" + at;
      if (!(node.bounds == merge(tree.nodes[i + 1].bounds, tree.nodes[second].bounds))) return "loose bounds" + at;
    }
  }
  if (count > 0 && tree.nodes[0].skip != count) return "root's skip";
  std::vector<octant_links> links(count);
  link_octants<T>(tree.nodes, links);
  if (count > 0 && std::memcmp(links.data(), tree.links.data(), count * sizeof links[0]) != 0) return "links";
  for (std::size_t i = 0; i < n; ++i)
    if (leaves[i] != 1) return "primitive " + std::to_string(i) + " in " + std::to_string(leaves[i]) + " leaves";
  return "";
}

template <class T> int depth(bvh<T> const& tree) {
  std::vector<int> d(tree.nodes.size(), 0);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i)
    if (tree.nodes[i].primitive < 0) d[i + 1] = d[tree.nodes[i + 1].skip] = d[i] + 1;
  return d.empty() ? 0 : *std::max_element(d.begin(), d.end());
}

/// Expected number of nodes that a ray through the root's box visits: the sum of their areas over the root's.
template <class T> double cost(bvh<T> const& tree) {
  double sum = 0;
  for (auto const& node : tree.nodes) sum += double(half_area(node.bounds));
  return sum / double(half_area(tree.nodes[0].bounds));
}

/// The sum of the areas of the tree that tries all splits along each axis everywhere.
double area_of_full_sweep(std::vector<box<double>> boxes) {
  std::size_t const n = boxes.size();
  box<double> all = box<double>::empty();
  for (auto const& b : boxes) all = merge(all, b);
  if (n == 1) return half_area(all);
  double best = std::numeric_limits<double>::infinity();
  std::vector<box<double>> left, right;
  for (int k = 0; k < 3; ++k) {
    std::stable_sort(boxes.begin(), boxes.end(),
                     [k](auto const& a, auto const& b) { return a.lo[k] + a.hi[k] < b.lo[k] + b.hi[k]; });
    std::vector<double> area(n + 1);
    box<double> b = box<double>::empty();
    for (std::size_t i = n; i-- > 0;) area[i] = half_area(b = merge(b, boxes[i]));
    b = box<double>::empty();
    for (std::size_t i = 1; i < n; ++i) {
      b = merge(b, boxes[i - 1]);
      double const c = half_area(b) * double(i) + area[i] * double(n - i);
      if (c < best) {
        best = c;
        left.assign(boxes.begin(), boxes.begin() + std::ptrdiff_t(i));
        right.assign(boxes.begin() + std::ptrdiff_t(i), boxes.end());
      }
    }
  }
  return half_area(all) + area_of_full_sweep(std::move(left)) + area_of_full_sweep(std::move(right));
}

}  // namespace

static_assert(sizeof(bvh_node<float>) == 32 && sizeof(bvh_node<double>) == 56 && sizeof(octant_links) == 32);

TEMPLATE_TEST_CASE("a tree holds every box in one leaf, depth-first, inside tight parents", "", float, double) {
  using T = TestType;
  unsigned const seed = 1u;
  for (std::size_t const n : {0u, 1u, 2u, 3u, 4u, 7u, 8u, 9u, 10u, 33u, 300u, 2047u, 2048u, 2049u, 4097u, 9000u})
    for (auto const& [name, boxes] : test::box_sets<T>(n, seed)) {
      CAPTURE(seed, n, name);
      bvh<T> const tree = build_sah<T>(boxes);
      REQUIRE(fault(tree, boxes) == "");
      REQUIRE(depth(tree) <= 64 + 14);
      REQUIRE(tree.bytes() == tree.nodes.size() * (sizeof(bvh_node<T>) + 32));
    }
}

TEMPLATE_TEST_CASE("a million boxes make a shallow tree, wherever their centres are", "", float, double) {
  using T = TestType;
  std::size_t const n = 1000000;
  for (auto const& boxes : {test::scattered_boxes<T>(n, 2u), std::vector<box<T>>(n, box<T>{{0, 0, 0}, {1, 1, 1}})}) {
    bvh<T> const tree = build_sah<T>(boxes);
    REQUIRE(fault(tree, boxes) == "");
    REQUIRE(depth(tree) <= 32);
  }
}

TEST_CASE("a tree costs at most a twentieth more than one that tries all splits") {
  unsigned const seed = 3u;
  CAPTURE(seed);
  for (auto const& boxes : {test::scattered_boxes<double>(5000, seed), test::surface_boxes<double>(5000, seed)}) {
    bvh<double> const tree = build_sah<double>(boxes);
    double const best = area_of_full_sweep(boxes) / half_area(tree.nodes[0].bounds);
    CAPTURE(best);
    REQUIRE(cost(tree) < 1.05 * best);
  }
}

TEMPLATE_TEST_CASE("centres that coincide are halved", "", float, double) {
  using T = TestType;
  for (std::size_t const n : {2u, 3u, 64u, 1000u, 5000u}) {
    CAPTURE(n);
    bvh<T> const tree = build_sah<T>(std::vector<box<T>>(n, box<T>{{1, 2, 3}, {1, 2, 3}}));
    REQUIRE(std::size_t(1) << (depth(tree) - 1) < n);
  }
}

TEMPLATE_TEST_CASE("of primitives far apart each side of the tree takes one group", "", float, double) {
  using T = TestType;
  unsigned const seed = 4u;
  CAPTURE(seed);
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t const n : {4u, 20u, 4000u}) {
      CAPTURE(axis, n);
      auto boxes = test::scattered_boxes<T>(n, seed);
      for (std::size_t i = 0; i < n; i += 4) {
        boxes[i].lo[axis] += T(1000);
        boxes[i].hi[axis] += T(1000);
      }
      bvh<T> const tree = build_sah<T>(boxes);
      box<T> const &one = tree.nodes[1].bounds, &other = tree.nodes[tree.nodes[1].skip].bounds;
      REQUIRE(min(one.hi[axis], other.hi[axis]) < T(500));
      REQUIRE(max(one.lo[axis], other.lo[axis]) > T(500));
    }
}

TEMPLATE_TEST_CASE("a box with a NaN coordinate is refused by its number", "", float, double) {
  using T = TestType;
  for (std::size_t const n : {5u, 5000u})
    for (int k = 0; k < 6; ++k) {
      CAPTURE(n, k);
      auto boxes = test::scattered_boxes<T>(n, 5u);
      (k < 3 ? boxes[n - 2].lo : boxes[n - 2].hi)[k % 3] = std::numeric_limits<T>::quiet_NaN();
      REQUIRE_THROWS_AS(build_sah<T>(boxes), std::invalid_argument);
      REQUIRE_THROWS_WITH(build_sah<T>(boxes), test::contains_text("primitive " + std::to_string(n - 2)));
    }
}

TEST_CASE("numbers of bins without sense are refused") {
  auto const boxes = test::scattered_boxes<float>(100, 6u);
  for (int const bins : {-1, 0, 1, 33, 1 << 30})
    REQUIRE_THROWS_AS(build_sah<float>(boxes, {bins}), std::invalid_argument);
  for (int const bins : {2, 3, 31, 32}) REQUIRE(fault(build_sah<float>(boxes, {bins}), boxes) == "");
}
