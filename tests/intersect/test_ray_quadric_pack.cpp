// SPDX-License-Identifier: MIT
#include "intersect/exact_quadric.hpp"
#include "support/catch.hpp"

#include <patchrt/intersect/quadric_point.hpp>
#include <patchrt/numbers/pack.hpp>

#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Whether two numbers are the same bits, or both NaN.
template <class T> bool same(T a, T b) {
  using bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  return std::bit_cast<bits>(a) == std::bit_cast<bits>(b) || (a != a && b != b);
}

/// One number a lane: `of(i)` for lane i.
template <class P, class F> P load(F&& of) {
  lane_t<P> lane[lanes_v<P>];
  for (int i = 0; i < lanes_v<P>; ++i) lane[i] = of(i);
  return P::load(lane);
}
template <class P, class F> vec3<P> load_vector(F&& of) {
  return {load<P>([&](int i) { return of(i).x; }), load<P>([&](int i) { return of(i).y; }),
          load<P>([&](int i) { return of(i).z; })};
}

template <class P, class T> clipped_quadric<P> load_surfaces(std::vector<clipped_quadric<T>> const& s) {
  auto const at = [&](int i) -> clipped_quadric<T> const& { return s[std::size_t(i)]; };
  clipped_quadric<P> r;
  r.form.squares = load_vector<P>([&](int i) { return at(i).form.squares; });
  r.form.products = load_vector<P>([&](int i) { return at(i).form.products; });
  r.form.linear = load_vector<P>([&](int i) { return at(i).form.linear; });
  r.form.constant = load<P>([&](int i) { return at(i).form.constant; });
  r.clip.lo = load_vector<P>([&](int i) { return at(i).clip.lo; });
  r.clip.hi = load_vector<P>([&](int i) { return at(i).clip.hi; });
  for (int k = 0; k < 3; ++k) r.rows[k] = load_vector<P>([&](int i) { return at(i).rows[k]; });
  r.centre = load_vector<P>([&](int i) { return at(i).centre; });
  r.capped = P(T(0)) < load<P>([&](int i) { return T(at(i).capped); });
  return r;
}

template <class P, class T> int differences(quadric_hit<P> const& got, int i, quadric_hit<T> const& one) {
  if (got.valid[i] != one.valid) return 1;
  return one.valid && !(same(got.t[i], one.t) && same(got.local[i], one.local) && same(got.face[i], one.face));
}

template <class P, class T> int differences(vec3<P> const& got, int i, vec3<T> const& one) {
  return !(same(got.x[i], one.x) && same(got.y[i], one.y) && same(got.z[i], one.z));
}

/// As a call of its own: what is compared with packs is what a caller of one ray gets.
template <class T> PATCHRT_OUTLINE sphere_hit<T> meet(ray<T> const& r, sphere<T> const& s) { return intersect(r, s); }

/// Rays as lanes against surfaces, one for all or one a lane.
template <class P, class S, class T, class Of>
int lanes_that_differ(std::vector<ray<T>> const& rays, S const& surface, Of const& of) {
  auto const at = [&](int i) -> ray<T> const& { return rays[std::size_t(i)]; };
  auto const line = make_centred_ray(load_vector<P>([&](int i) { return at(i).origin; }),
                                     load_vector<P>([&](int i) { return at(i).direction; }));
  P const t_min = load<P>([&](int i) { return at(i).t_min; }), t_max = load<P>([&](int i) { return at(i).t_max; });
  auto const all = crossings(line, surface);
  auto const paper = crossings<tangent::miss>(line, surface);
  auto const first = intersect(line, surface, t_min, t_max);
  auto const point = point_at(line, surface, first);
  int differ = 0;
  for (int i = 0; i < lanes_v<P>; ++i) {
    ray<T> const& r = at(i);
    clipped_quadric<T> const& s = of(i);
    auto const l = make_centred_ray(r.origin, r.direction);
    auto const e = crossings(l, s), f = crossings<tangent::miss>(l, s);
    for (int k = 0; k < 4; ++k) differ += differences(all.hit[k], i, e.hit[k]) + differences(paper.hit[k], i, f.hit[k]);
    auto const one = intersect(r, s);
    differ += differences(first, i, one);
    if (!one.valid) continue;
    auto const p = point_at(l, s, one);
    differ += differences(point.position, i, p.position) + differences(point.normal, i, p.normal) +
              !same(point.error[i], p.error) + !same(point.clearance[i], p.clearance);
  }
  return differ;
}

}  // namespace

TEMPLATE_TEST_CASE("every lane of a pack meets quadrics as one ray does, bit for bit", "", (pack<float, 16>),
                   (pack<float, 4>), (pack<float, 32>), (pack<double, 8>), (pack<double, 16>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int lanes = lanes_v<P>;
  unsigned const seed = 5;
  CAPTURE(seed);
  random_quadrics g(seed);
  int differ = 0, hits = 0;
  for (int n = 0; n < 16000 / lanes; ++n) {
    std::vector<clipped_quadric<T>> surfaces;
    std::vector<ray<T>> rays;
    bool const mixed = n % 2;  // else all are of one place, kind by kind
    affine<double> const shared = g.place(10, 3);
    for (int i = 0; i < lanes; ++i) {
      affine<double> const at = mixed ? g.place(10, 3) : shared;
      surfaces.push_back(convert_quadric<T>(g.surface(g.below(random_quadrics::kinds), at)));
      vec3<double> const aim = transform_point(shared, g.vector(-1, 1)), d = g.direction();
      double const far = std::pow(10., g.uniform(-1, 3));
      rays.push_back({convert_vec<T>(sum(aim, scale(d, far))), convert_vec<T>(scale(d, -1.5)), T(0), T(1e6)});
      if (g.below(40) == 0) rays.back().direction[int(g.below(3))] = T(0);
      if (g.below(40) == 0) rays.back().origin[int(g.below(3))] = std::numeric_limits<T>::quiet_NaN();
    }
    for (int i = 0; i < lanes; ++i) hits += intersect(rays[std::size_t(i)], surfaces[0]).valid;
    differ += lanes_that_differ<P>(
        rays, surfaces[0], [&](int) -> auto& { return surfaces[0]; });
    differ += lanes_that_differ<P>(
        rays, load_surfaces<P>(surfaces), [&](int i) -> auto& { return surfaces[std::size_t(i)]; });
    std::vector<ray<T>> const one(std::size_t(lanes), rays[0]);
    differ += lanes_that_differ<P>(
        one, load_surfaces<P>(surfaces), [&](int i) -> auto& { return surfaces[std::size_t(i)]; });
  }
  CHECK(hits > 1000);
  CHECK(differ == 0);
}

TEMPLATE_TEST_CASE("every lane of a pack meets spheres as one ray does, bit for bit", "", (pack<float, 16>),
                   (pack<float, 32>), (pack<double, 8>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int lanes = lanes_v<P>;
  unsigned const seed = 6;
  CAPTURE(seed);
  random_quadrics g(seed);
  int differ = 0, hits = 0;
  for (int n = 0; n < 100000 / lanes; ++n) {
    std::vector<sphere<T>> balls;
    std::vector<ray<T>> rays;
    for (int i = 0; i < lanes; ++i) {
      balls.push_back({convert_vec<T>(g.vector(-1, 1)), T(g.uniform(0.1, 1))});
      rays.push_back({convert_vec<T>(g.vector(-3, 3)), convert_vec<T>(g.vector(-1, 1)), T(0), T(1e6)});
      if (g.below(40) == 0) rays.back().origin[int(g.below(3))] = std::numeric_limits<T>::quiet_NaN();
    }
    auto const line = make_centred_ray(load_vector<P>([&](int i) { return rays[std::size_t(i)].origin; }),
                                       load_vector<P>([&](int i) { return rays[std::size_t(i)].direction; }));
    sphere<P> const each{load_vector<P>([&](int i) { return balls[std::size_t(i)].centre; }),
                         load<P>([&](int i) { return balls[std::size_t(i)].radius; })};
    auto const shared = intersect(line, balls[0], P(T(0)), P(T(1e6))), own = intersect(line, each, P(T(0)), P(T(1e6)));
    auto const leave = depart_from(line, each, own);
    for (int i = 0; i < lanes; ++i) {
      ray<T> const& r = rays[std::size_t(i)];
      auto const a = meet(r, balls[0]), b = meet(r, balls[std::size_t(i)]);
      hits += b.valid;
      differ += shared.valid[i] != a.valid || (a.valid && !same(shared.t[i], a.t));
      differ += own.valid[i] != b.valid || (b.valid && !same(own.t[i], b.t));
      if (!b.valid) continue;
      auto const d = depart_from(make_centred_ray(r.origin, r.direction), balls[std::size_t(i)], b);
      differ += differences(leave.position, i, d.position) + differences(leave.normal, i, d.normal) +
                !same(leave.clearance[i], d.clearance);
    }
  }
  CHECK(hits > 1000);
  CHECK(differ == 0);
}
