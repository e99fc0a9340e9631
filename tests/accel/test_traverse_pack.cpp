// SPDX-License-Identifier: MIT
#include <accel/random_boxes.hpp>
#include <intersect/random_box_rays.hpp>
#include <patchrt/accel/build_sah.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/numbers/pack.hpp>
#include <support/catch.hpp>

#include <set>

using namespace patchrt;

TEMPLATE_TEST_CASE("every lane of a pack of rays finds the boxes that it finds alone", "", (pack<float, 16>),
                   (pack<float, 8>), (pack<double, 8>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int lanes = lanes_v<P>;
  unsigned const seed = 18u;
  CAPTURE(seed);
  auto const boxes = test::scattered_boxes<T>(300, seed);
  bvh<T> const tree = build_sah<T>(boxes);
  test::random_box_rays<T> random(seed);
  std::size_t hits = 0;
  for (int n = 0; n < 200; ++n) {
    T o[3][lanes], d[3][lanes];
    std::set<std::int32_t> found[lanes], expected[lanes];
    bool const coherent = random.chance(0.5);
    for (int i = 0; i < lanes; ++i) {
      for (int k = 0; k < 3; ++k) {
        o[k][i] = coherent ? T(2) : random.uniform(-2, 2);
        d[k][i] = (coherent ? T(-1) : T(0)) + random.uniform(T(-0.5), T(0.5));
      }
      auto const r = make_slab_ray(vec3<T>{o[0][i], o[1][i], o[2][i]}, vec3<T>{d[0][i], d[1][i], d[2][i]});
      for (std::size_t b = 0; b < boxes.size(); ++b) {
        auto const span = intersect(r, boxes[b], T(0), T(4));
        if (span.entry <= span.exit) expected[i].insert(std::int32_t(b));
      }
      hits += expected[i].size();
    }
    auto const r = make_slab_ray(vec3<P>{P::load(o[0]), P::load(o[1]), P::load(o[2])},
                                 vec3<P>{P::load(d[0]), P::load(d[1]), P::load(d[2])});
    mask_t<P> met(false);
    traverse(
        tree.view(), unsigned(random.pick(8)),
        [&](box<T> const& b) {
          auto const span = intersect(r, b, P(0), P(4));
          met = span.entry <= span.exit;
          return any_of(met);
        },
        [&](std::int32_t p) {
          for (int i = 0; i < lanes; ++i)
            if (met[i]) found[i].insert(p);
          return false;
        });
    for (int i = 0; i < lanes; ++i) REQUIRE(found[i] == expected[i]);
  }
  REQUIRE(hits > 1000);
}
