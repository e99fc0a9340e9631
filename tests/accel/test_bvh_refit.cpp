// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <patchrt/accel/build_sah.hpp>
#include <patchrt/accel/refit.hpp>
#include <support/catch.hpp>

#include <cstring>

using namespace patchrt;

TEMPLATE_TEST_CASE("refitting to the boxes a tree was built from changes nothing", "", float, double) {
  using T = TestType;
  for (std::size_t const n : {0u, 1u, 2u, 500u}) {
    auto const boxes = test::scattered_boxes<T>(n, 9u);
    bvh<T> tree = build_sah<T>(boxes);
    auto const nodes = tree.nodes;
    auto const links = tree.links;
    refit<T>(tree.nodes, boxes);
    link_octants<T>(tree.nodes, tree.links);
    REQUIRE((n == 0 || std::memcmp(nodes.data(), tree.nodes.data(), nodes.size() * sizeof nodes[0]) == 0));
    REQUIRE((n == 0 || std::memcmp(links.data(), tree.links.data(), links.size() * sizeof links[0]) == 0));
  }
}

TEMPLATE_TEST_CASE("a refitted node bounds just the primitives below it, the root those of a new tree", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 10u;
  CAPTURE(seed);
  std::size_t const n = 700;
  bvh<T> tree = build_sah<T>(test::scattered_boxes<T>(n, seed));
  auto const before = tree.nodes;
  auto const moved = test::surface_boxes<T>(n, seed + 1);
  refit<T>(tree.nodes, moved);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    box<T> below = box<T>::empty();
    for (std::size_t k = i; k < tree.nodes[i].skip; ++k)
      if (tree.nodes[k].primitive >= 0) below = merge(below, moved[std::size_t(tree.nodes[k].primitive)]);
    REQUIRE(tree.nodes[i].bounds == below);
    REQUIRE(tree.nodes[i].primitive == before[i].primitive);
    REQUIRE(tree.nodes[i].skip == before[i].skip);
  }
  REQUIRE(tree.nodes[0].bounds == build_sah<T>(moved).nodes[0].bounds);
}
