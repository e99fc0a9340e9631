// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <patchrt/accel/build_sah.hpp>
#include <patchrt/exec/openmp.hpp>
#include <support/catch.hpp>

#include <cstring>

using namespace patchrt;

namespace {

template <class T> bool same_bits(bvh<T> const& a, bvh<T> const& b) {
  auto const same = [](auto const& x, auto const& y) {
    return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof x[0]) == 0);
  };
  return same(a.nodes, b.nodes) && same(a.links, b.links);
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

TEST_CASE("a box refused in a thread is refused to the caller") {
  auto boxes = test::scattered_boxes<float>(10000, 8u);
  boxes[9000].hi.y = std::numeric_limits<float>::quiet_NaN();
  REQUIRE_THROWS_WITH(build_sah<float>(boxes, openmp(2)), test::contains_text("primitive 9000"));
}
