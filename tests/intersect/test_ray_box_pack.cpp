// SPDX-License-Identifier: MIT
#include <intersect/random_box_rays.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/numbers/pack.hpp>
#include <support/catch.hpp>

#include <cstring>

using namespace patchrt;

namespace {

/// Whether two numbers are the same bits, or both NaN.
template <class T> bool same(T a, T b) { return std::memcmp(&a, &b, sizeof a) == 0 || (a != a && b != b); }

template <class P, class T> vec3<P> load(T const (&v)[3][lanes_v<P>]) {
  return {P::load(v[0]), P::load(v[1]), P::load(v[2])};
}

template <slab S, class P, class B, class T, class Box>
int lanes_that_differ(slab_ray<P> const& r, box<B> const& b, ray<T> const* rays, Box const& box_of, P t_min, P t_max) {
  slab_span<P> const s = intersect<S>(r, b, t_min, t_max);
  int differ = 0;
  for (int i = 0; i < lanes_v<P>; ++i) {
    slab_ray<T> const one = make_slab_ray(rays[i].origin, rays[i].direction);
    slab_span<T> const e = intersect<S>(one, box_of(i), rays[i].t_min, rays[i].t_max);
    differ += !same(s.entry[i], e.entry) || !same(s.exit[i], e.exit) || (s.entry <= s.exit)[i] != (e.entry <= e.exit);
  }
  return differ;
}

}  // namespace

TEMPLATE_TEST_CASE("every lane of a pack meets a box as one ray does, bit for bit", "", (pack<float, 16>),
                   (pack<float, 4>), (pack<float, 32>), (pack<double, 8>), (pack<double, 2>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int lanes = lanes_v<P>;
  unsigned const seed = 20131u;
  CAPTURE(seed);
  test::random_box_rays<T> random(seed);
  int differ = 0;
  for (int n = 0; n < 1000000 / lanes / 4; ++n) {
    ray<T> rays[lanes];
    box<T> boxes[lanes];
    T o[3][lanes], d[3][lanes], lo[3][lanes], hi[3][lanes], t_min[lanes], t_max[lanes];
    for (int i = 0; i < lanes; ++i) {
      boxes[i] = random.any_box();
      rays[i] = random.any_ray(random.chance(0.5) ? boxes[0] : boxes[i]);
      if (random.chance(0.01)) rays[i].origin[random.pick(3)] = std::numeric_limits<T>::quiet_NaN();
      for (int k = 0; k < 3; ++k) {
        o[k][i] = rays[i].origin[k];
        d[k][i] = rays[i].direction[k];
        lo[k][i] = boxes[i].lo[k];
        hi[k][i] = boxes[i].hi[k];
      }
      t_min[i] = rays[i].t_min;
      t_max[i] = rays[i].t_max;
    }
    slab_ray<P> const r = make_slab_ray(load<P>(o), load<P>(d));
    box<P> const each{load<P>(lo), load<P>(hi)};
    P const from = P::load(t_min), to = P::load(t_max);
    auto const first = [&](int) { return boxes[0]; };
    auto const own = [&](int i) { return boxes[i]; };
    differ += lanes_that_differ<slab::nearest>(r, boxes[0], rays, first, from, to);
    differ += lanes_that_differ<slab::nearest>(r, each, rays, own, from, to);
    differ += lanes_that_differ<slab::conservative>(r, boxes[0], rays, first, from, to);
    differ += lanes_that_differ<slab::conservative>(r, each, rays, own, from, to);
  }
  REQUIRE(differ == 0);
}
