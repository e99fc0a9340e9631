// SPDX-License-Identifier: MIT
#include <device/kernels/hierarchy.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

#include <patchrt/accel/build_sah.hpp>

using namespace patchrt;
using namespace patchrt::test;

TEMPLATE_TEST_CASE("walks of a tree visit the same boxes from every compiler and from PTX", "", float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u);
  auto const size = GENERATE(0, 1, 2, 150);
  CAPTURE(seed, size);
  number_source source(seed);
  std::vector<box<T>> boxes;
  for (int i = 0; i < size; ++i) {
    auto const centre = source.point(T(4)), half = vec3<T>(T(0.3)) + source.point(T(0.2));
    boxes.push_back({centre - half, centre + half});
  }
  bvh<T> const tree = build_sah<T>(boxes);
  auto rays = nasty_rays<T>(source, 600);
  for (std::size_t i = 0; i < rays.size(); i += 2) {  // half of the rays go well: from outside towards the boxes
    vec3<T> const origin = source.point(T(8));
    rays[i] = {origin, source.point(T(4)) - origin, T(0), T(10)};
  }
  auto const results =
      check_same_in_every_build<T>("hierarchy", "traverse" + suffix<T>(), 600,
                                   {readable(tree.nodes), readable(tree.links), readable(rays)}, [&](T* out) {
                                     return traverse_kernel<T>{tree.view(), rays.data(), out};
                                   });

  T boxes_visited = 0, leaves = 0;
  for (std::size_t i = 0; i < results.size(); i += traverse_kernel<T>::outputs) {
    boxes_visited += results[i + 2];
    leaves += results[i + 3];
  }
  CHECK((size == 0 ? boxes_visited == 0 : boxes_visited >= 600));
  if (size == 150) CHECK(leaves > 200);
}
