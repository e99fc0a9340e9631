// SPDX-License-Identifier: MIT
/// \file
/// Rays against quadrics and spheres, for one number and for packs: time and useful flops a test, the share of the peak
/// that chains of fused operations reach on the same registers, and the error of t.
///
/// Counters as of bench/intersect, and `hits`, the share of tests that meet; `ulp_99`, the error of t that 99 of 100
/// hits do not exceed, in ulps, against the same rays in long double.
///
/// Workload: 256 packs of rays from 1 to 100 radii away at points within a surface's box; surfaces of one kind, each
/// placed at random. `rays`: a pack of rays against one surface, as in a leaf met by a packet; `surfaces`: one ray
/// against a surface a lane, as in a wide leaf met by one ray. The ray's 1 / d.d is prepared beforehand.

#include "support/counted.hpp"
#include "support/microbenchmark.hpp"
#include "support/run_benchmarks.hpp"

#include <patchrt/intersect/ray_quadric.hpp>
#include <patchrt/intersect/ray_sphere.hpp>
#include <patchrt/shapes/make_quadric.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

constexpr std::size_t inputs = 256;

enum class kind { ball, ellipsoid, tube, can, cone, general };
enum class many { rays, surfaces };

affine<double> random_place(random_numbers& next) {
  auto const one = [&] { return next.between(-1, 1); };
  vec3<double> const axis{one(), one(), one()};
  vec3<double> const factors{next.between(0.5, 2), next.between(0.5, 2), next.between(0.5, 2)};
  auto a = affine<double>::rotation(axis, next.between(0, 6)) * affine<double>::scaling(factors);
  a.translation = {one(), one(), one()};
  return a;
}

template <kind K> clipped_quadric<double> random_surface(random_numbers& next) {
  auto const at = random_place(next);
  if constexpr (K == kind::ellipsoid) return make_sphere(at);
  if constexpr (K == kind::tube) return make_cylinder(at, -1, 1);
  if constexpr (K == kind::can) return make_cylinder(at, -1, 1, ends::capped);
  if constexpr (K == kind::cone) return make_cone(at, 0, 1, ends::capped);
  quadric<double> q = compose(unit_hyperboloid_one_sheet<double>(), random_place(next));
  q.constant += 0.25 * next.between(-1, 1);
  return make_quadric(q, at, {{-2, -2, -2}, {2, 2, 2}});
}

sphere<double> random_ball(random_numbers& next) {
  auto const one = [&] { return next.between(-1, 1); };
  return {{one(), one(), one()}, next.between(0.5, 1.5)};
}

struct lane_input {
  vec3<double> origin, direction;
};
lane_input random_ray(random_numbers& next, vec3<double> const& centre) {
  auto const one = [&] { return next.between(-1, 1); };
  vec3<double> const aim = centre + vec3<double>(one(), one(), one()), away{one(), one(), one()};
  double const distance = std::pow(10., next.between(0, 2)) / std::sqrt(dot(away, away));
  return {aim + distance * away, -away};
}

/// Lane i of `of(i)`.
template <class T, class F> T lanes(F&& of) {
  int i = 0;
  return draw<T>([&] { return of(i++); });
}
template <class T, class F> vec3<T> vector_lanes(F&& of) {
  return {lanes<T>([&](int i) { return of(i).x; }), lanes<T>([&](int i) { return of(i).y; }),
          lanes<T>([&](int i) { return of(i).z; })};
}

template <class T> sphere<T> pack_surfaces(std::vector<sphere<double>> const& s) {
  auto const at = [&](int i) -> auto& { return s[std::size_t(i)]; };
  return {vector_lanes<T>([&](int i) { return at(i).centre; }), lanes<T>([&](int i) { return at(i).radius; })};
}
template <class T> clipped_quadric<T> pack_surfaces(std::vector<clipped_quadric<double>> const& s) {
  auto const at = [&](int i) -> auto& { return s[std::size_t(i)]; };
  auto const half = lane_t<T>(0.5);
  return {
      {vector_lanes<T>([&](int i) { return at(i).form.squares; }),
       vector_lanes<T>([&](int i) { return at(i).form.products; }),
       vector_lanes<T>([&](int i) { return at(i).form.linear; }), lanes<T>([&](int i) { return at(i).form.constant; })},
      {vector_lanes<T>([&](int i) { return at(i).clip.lo; }), vector_lanes<T>([&](int i) { return at(i).clip.hi; })},
      {vector_lanes<T>([&](int i) { return at(i).rows[0]; }), vector_lanes<T>([&](int i) { return at(i).rows[1]; }),
       vector_lanes<T>([&](int i) { return at(i).rows[2]; })},
      vector_lanes<T>([&](int i) { return at(i).centre; }),
      T(half) < lanes<T>([&](int i) { return at(i).capped ? 1. : 0.; })};
}
template <class T> sphere<T> convert_surface(sphere<double> const& s) {
  return {convert_vec<T>(s.centre), convert<T>(s.radius)};
}
template <class T> clipped_quadric<T> convert_surface(clipped_quadric<double> const& s) {
  return convert_quadric<T>(s);
}

/// The numbers that the lanes hold, as doubles.
template <class L> sphere<double> as_held(sphere<double> const& s) {
  return convert_surface<double>(sphere<double>{convert_vec<double>(convert_vec<L>(s.centre)), double(L(s.radius))});
}
template <class L> clipped_quadric<double> as_held(clipped_quadric<double> const& s) {
  return convert_quadric<double>(convert_quadric<L>(s));
}

template <class T, kind K, many M> void meet(benchmark::State& state) {
  using L = lane_t<T>;
  random_numbers next;
  auto const draw_surface = [&] {
    if constexpr (K == kind::ball) return random_ball(next);
    else return random_surface<K>(next);
  };
  using surface = decltype(draw_surface());
  using shared = decltype(convert_surface<L>(std::declval<surface>()));
  using own = decltype(convert_surface<T>(std::declval<surface>()));
  constexpr std::size_t n = lanes_v<T>;

  std::vector<centred_ray<T>> rays;
  std::vector<shared> one_surface;
  std::vector<own> surfaces;
  std::vector<double> errors;
  double hits = 0, flops = 0;
  for (std::size_t k = 0; k < inputs; ++k) {
    std::vector<surface> lane_surfaces;
    std::vector<lane_input> lane_rays;
    for (std::size_t i = 0; i < n; ++i) {
      bool const new_surface = i == 0 || M == many::surfaces, new_ray = i == 0 || M == many::rays;
      lane_surfaces.push_back(new_surface ? as_held<L>(draw_surface()) : lane_surfaces[0]);
      lane_rays.push_back(new_ray ? random_ray(next, lane_surfaces[i].centre) : lane_rays[0]);
    }
    auto const at = [&](int i) -> auto& { return lane_rays[std::size_t(i)]; };
    rays.push_back(make_centred_ray(vector_lanes<T>([&](int i) { return at(i).origin; }),
                                    vector_lanes<T>([&](int i) { return at(i).direction; })));
    one_surface.push_back(convert_surface<L>(lane_surfaces[0]));
    surfaces.push_back(pack_surfaces<T>(lane_surfaces));
    for (std::size_t i = 0; i < n; ++i) {
      vec3<L> const o = convert_vec<L>(lane_rays[i].origin), d = convert_vec<L>(lane_rays[i].direction);
      auto const hit = intersect(ray<L>{o, d, L(0), L(1e30)}, convert_surface<L>(lane_surfaces[i]));
      auto const exact = intersect(ray<long double>{convert_vec<long double>(o), convert_vec<long double>(d), 0, 1e30L},
                                   convert_surface<long double>(lane_surfaces[i]));
      hits += hit.valid;
      if (hit.valid && exact.valid)
        errors.push_back(static_cast<double>(
            std::fabs(hit.t - exact.t) / std::ldexp(1.L, std::ilogb(exact.t) + 1 - std::numeric_limits<L>::digits)));
      ray<counted> const c{convert_vec<counted>(lane_rays[i].origin), convert_vec<counted>(lane_rays[i].direction), 0.,
                           1e30};
      auto const line = make_centred_ray(c.origin, c.direction);
      auto const s = convert_surface<counted>(lane_surfaces[i]);
      flops += count_operations([&] { intersect(line, s, c.t_min, c.t_max); });
    }
  }
  T const t_min(L(0)), t_max(L(1e30));
  measure<T>(state, inputs, flops / double(inputs * n), [&](std::size_t k) {
    if constexpr (M == many::rays) return intersect(rays[k], one_surface[k], t_min, t_max);
    else return intersect(rays[k], surfaces[k], t_min, t_max);
  });
  auto const rank = errors.begin() + std::ptrdiff_t(0.99 * double(errors.size()));
  std::nth_element(errors.begin(), rank, errors.end());
  state.counters["hits"] = hits / double(inputs * n);
  state.counters["ulp_99"] = *rank;
}

#define PATCHRT_BENCH_KIND(of)                                   \
  BENCHMARK_TEMPLATE(meet, float, of, many::rays);               \
  BENCHMARK_TEMPLATE(meet, pack<float, 8>, of, many::rays);      \
  BENCHMARK_TEMPLATE(meet, pack<float, 16>, of, many::rays);     \
  BENCHMARK_TEMPLATE(meet, pack<float, 16>, of, many::surfaces); \
  BENCHMARK_TEMPLATE(meet, double, of, many::rays);              \
  BENCHMARK_TEMPLATE(meet, pack<double, 8>, of, many::rays);     \
  BENCHMARK_TEMPLATE(meet, pack<double, 16>, of, many::rays);    \
  BENCHMARK_TEMPLATE(meet, pack<double, 8>, of, many::surfaces)

PATCHRT_BENCH_KIND(kind::ball);
PATCHRT_BENCH_KIND(kind::ellipsoid);
PATCHRT_BENCH_KIND(kind::tube);
PATCHRT_BENCH_KIND(kind::can);
PATCHRT_BENCH_KIND(kind::cone);
PATCHRT_BENCH_KIND(kind::general);

}  // namespace

int main(int argc, char** argv) {
  return patchrt::bench::run_benchmarks(argc, argv, [] {});
}
