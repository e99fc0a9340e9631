// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <patchrt/accel/build_grouped_sah.hpp>
#include <patchrt/exec/openmp.hpp>
#include <support/catch.hpp>

#include <cstring>

using namespace patchrt;

namespace {

template <class X> bool same_bits(std::vector<X> const& a, std::vector<X> const& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
}
template <class T> bool same_bits(bvh<T> const& a, bvh<T> const& b) {
  return same_bits(a.nodes, b.nodes) && same_bits(a.links, b.links);
}

}  // namespace

TEMPLATE_TEST_CASE("any number of threads builds the same tree", "", float, double) {
  using T = TestType;
  unsigned const seed = 7u;
  for (std::size_t const n : {1u, 100u, 2049u, 30000u})
    for (auto const& [name, boxes] : test::box_sets<T>(n, seed)) {
      CAPTURE(seed, n, name);
      bvh<T> const tree = build_sah<T>(boxes);
      for (int const threads : {1, 2, 3}) REQUIRE(same_bits(tree, build_sah<T>(boxes, openmp(threads))));
    }
}

TEST_CASE("any number of threads makes the same grouped leaves") {
  unsigned const seed = 9u;
  auto const group = [](std::vector<box<float>> const& boxes, auto const& exec) {
    auto const fits = [](std::span<std::uint32_t const> p) { return p[0] % 3 != 0; };
    return detail::build_grouped_sah<8>(detail::sah_primitives(std::span(boxes), exec), fits, exec);
  };
  for (auto const& [name, boxes] : test::box_sets<float>(100000, seed)) {
    CAPTURE(seed, name);
    auto const one = group(boxes, serial{});
    for (int const threads : {1, 2, 3}) {
      auto const other = group(boxes, openmp(threads));
      REQUIRE(same_bits(one.tree, other.tree));
      REQUIRE(one.order == other.order);
      REQUIRE(one.first == other.first);
    }
  }
}

TEST_CASE("a box refused in a thread is refused to the caller") {
  auto boxes = test::scattered_boxes<float>(10000, 8u);
  boxes[9000].hi.y = std::numeric_limits<float>::quiet_NaN();
  REQUIRE_THROWS_WITH(build_sah<float>(boxes, openmp(2)), test::contains_text("primitive 9000"));
}
