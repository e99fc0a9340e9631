// SPDX-License-Identifier: MIT
/// \file
/// The crossbar of the ray engine: every ray against every triangle, the nearest hit kept, by each form.
///
/// `rays<form, faces, T>`: the rays of a pack meet one triangle at a time. `triangles<...>`: a ray meets as many
/// triangles as T has lanes. A `mixed` order puts rays into packs that do not go the same way.
///
/// Counters: `ns_a_test`, a test being one ray and one triangle; `flops_a_test`, counted by running the form on
/// `counted`: what all lanes of a pack compute, that is without the plane where no lane is between the edges; `GFLOPS`
/// = the two together; `of_peak` = GFLOPS over the measured peak of the register that the lanes fill; `wrong`, rays
/// that hit and should miss or miss and should hit; `t_error`, the largest relative error of t, both against the
/// watertight form in double.
///
/// Workload: 1024 triangles of a bumpy sheet, 64 x 64 rays of a pinhole above it, four fifths of which hit.

#include "support/counted.hpp"
#include "support/microbenchmark.hpp"
#include "support/run_benchmarks.hpp"

#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/numbers/pack.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

/// Which rays are neighbours: 4 x 4 pixels, or none.
enum class order { tiled, mixed };

constexpr std::size_t columns = 32, rows = 16, pixels = 64;

template <class L> vec3<L> rounded(vec3<double> const& p) { return convert_vec<L>(p); }

template <class L> std::vector<triangle<L>> make_triangles() {
  random_numbers next;
  vec3<L> vertex[rows + 1][columns + 1];
  for (std::size_t i = 0; i <= rows; ++i)
    for (std::size_t j = 0; j <= columns; ++j)
      vertex[i][j] = rounded<L>({(double(i) + next.between(-0.3, 0.3)) / rows,
                                 (double(j) + next.between(-0.3, 0.3)) / columns, next.between(-0.01, 0.01)});
  std::vector<triangle<L>> all;
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j) {
      all.push_back({vertex[i][j], vertex[i + 1][j], vertex[i + 1][j + 1]});
      all.push_back({vertex[i][j], vertex[i + 1][j + 1], vertex[i][j + 1]});
    }
  return all;
}

template <class L> std::vector<ray<L>> make_rays(order o) {
  vec3<L> const eye = rounded<L>({0.4, 0.6, 3});
  std::vector<ray<L>> all;
  for (std::size_t y = 0; y < pixels; y += 4)
    for (std::size_t x = 0; x < pixels; x += 4)
      for (std::size_t k = 0; k < 16; ++k) {
        double const px = double(x + k % 4) + 0.5, py = double(y + k / 4) + 0.5;
        vec3<L> const at = rounded<L>({px / pixels * 1.12 - 0.06, py / pixels * 1.12 - 0.06, 0});
        all.push_back({eye, difference(at, eye), L(0), std::numeric_limits<L>::infinity()});
      }
  random_numbers next;
  for (std::size_t k = all.size(); o == order::mixed && k > 1; --k)
    std::swap(all[k - 1], all[std::size_t(next() * double(k))]);
  return all;
}

/// `of(i)` in lane i.
template <class T, class F> vec3<T> vec_lanes(F&& of) {
  auto const axis = [&](int c) {
    int i = 0;
    return draw<T>([&] { return component(of(i++), c); });
  };
  return {axis(0), axis(1), axis(2)};
}

template <class T, class L> triangle<T> triangle_lanes(std::vector<triangle<L>> const& all, std::size_t first) {
  auto const at = [&](int i) -> triangle<L> const& { return all[first + std::size_t(i)]; };
  return {vec_lanes<T>([&](int i) { return at(i).a; }), vec_lanes<T>([&](int i) { return at(i).b; }),
          vec_lanes<T>([&](int i) { return at(i).c; })};
}

/// Rays and triangles, R and S numbers or packs of them.
template <class Form, class R, class S> struct crossbar {
  std::vector<typename Form::template ray_constants<R>> rays;
  std::vector<typename Form::template prepared<S>> triangles;
};

template <class Form, class R, class S> crossbar<Form, R, S> make_crossbar(order o) {
  using L = lane_t<R>;
  auto const all_rays = make_rays<L>(o);
  auto const all_triangles = make_triangles<L>();
  crossbar<Form, R, S> c;
  for (std::size_t k = 0; k < all_rays.size(); k += std::size_t(lanes_v<R>)) {
    auto const at = [&](int i) -> ray<L> const& { return all_rays[k + std::size_t(i)]; };
    c.rays.push_back(Form::make_ray(vec_lanes<R>([&](int i) { return at(i).origin; }),
                                    vec_lanes<R>([&](int i) { return at(i).direction; })));
  }
  for (std::size_t k = 0; k < all_triangles.size(); k += std::size_t(lanes_v<S>))
    c.triangles.push_back(Form::prepare(triangle_lanes<S>(all_triangles, k)));
  return c;
}

/// The least t in each lane, of all triangles.
template <class Form, faces F, class T, class R, class S>
void nearest_hits(crossbar<Form, R, S> const& c, std::vector<T>& nearest) {
  using L = lane_t<T>;
  T const t_min(L(0));
  for (std::size_t i = 0; i < c.rays.size(); ++i) {
    auto const r = c.rays[i];
    T t_max(std::numeric_limits<L>::infinity());
    for (auto const& t : c.triangles) {
      auto const m = Form::template meet<F>(r, t, t_min, t_max);
      if (any_of(m.valid)) t_max = select(m.valid, m.distance / m.scale, t_max);
    }
    nearest[i] = t_max;
  }
}

/// One number a ray: of a ray that has the lanes for triangles, the least of its lanes.
template <class R, class T> std::vector<double> by_ray(std::vector<T> const& nearest) {
  std::vector<double> all;
  for (T const& n : nearest) {
    lane_t<T> lane[std::size_t(lanes_v<T>)];
    store_lanes(n, lane);
    if constexpr (lanes_v<R> == lanes_v<T>) all.insert(all.end(), lane, lane + lanes_v<T>);
    else all.push_back(*std::min_element(lane, lane + lanes_v<T>));
  }
  return all;
}

template <class L> std::vector<double> const& reference_hits(order o) {
  static auto const make = [](order which) {
    crossbar<watertight_form, double, double> c;
    for (auto const& r : make_rays<L>(which))
      c.rays.push_back(watertight_form::make_ray(convert_vec<double>(r.origin), convert_vec<double>(r.direction)));
    for (auto const& t : make_triangles<L>())
      c.triangles.push_back({convert_vec<double>(t.a), convert_vec<double>(t.b), convert_vec<double>(t.c)});
    std::vector<double> nearest(c.rays.size());
    nearest_hits<watertight_form, faces::both>(c, nearest);
    return nearest;
  };
  static auto const tiled = make(order::tiled), mixed = make(order::mixed);
  return o == order::tiled ? tiled : mixed;
}

/// Operations of a test, where some lane is between the edges and where none is.
template <class Form, faces F> double operations(bool between) {
  triangle<counted> const t{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  auto const prepared = Form::prepare(t);
  auto const r = Form::make_ray(vec3<counted>{between ? 0.25 : 2, 0.25, 1}, vec3<counted>{0, 0, -1});
  return count_operations([&] { Form::template meet<F>(r, prepared, counted(0), counted(10)); });
}

/// The share of tests in packs of which a lane is between the edges.
template <class Form, faces F, class T, class R, class S> double share_between(crossbar<Form, R, S> const& c) {
  T const infinity(std::numeric_limits<lane_t<T>>::infinity());
  std::size_t between = 0;
  for (auto const& r : c.rays)
    for (auto const& t : c.triangles) between += any_of(Form::template meet<F>(r, t, -infinity, infinity).valid);
  return double(between) / double(c.rays.size() * c.triangles.size());
}

template <class Form, faces F, order O, class T, class R, class S> void measure_crossbar(benchmark::State& state) {
  auto const c = make_crossbar<Form, R, S>(O);
  std::vector<T> nearest(c.rays.size());
  double const seconds = thread_seconds([&] {
    for (auto _ : state) {
      nearest_hits<Form, F>(c, nearest);
      benchmark::DoNotOptimize(nearest.data());
      benchmark::ClobberMemory();
    }
  });
  double const between = share_between<Form, F, T>(c);
  double const flops = between * operations<Form, F>(true) + (1 - between) * operations<Form, F>(false);
  double const tests = double(state.iterations()) * double(c.rays.size() * c.triangles.size()) * double(lanes_v<T>);
  auto const found = by_ray<R>(nearest);
  auto const& wanted = reference_hits<lane_t<T>>(O);
  double wrong = 0, error = 0;
  for (std::size_t k = 0; k < found.size(); ++k) {
    bool const hit = found[k] < 1e30, should_hit = wanted[k] < 1e30;
    wrong += hit != should_hit;
    if (hit && should_hit) error = std::max(error, std::abs(found[k] - wanted[k]) / wanted[k]);
  }
  state.counters["ns_a_test"] = 1e9 * seconds / tests;
  state.counters["flops_a_test"] = flops;
  state.counters["GFLOPS"] = 1e-9 * flops * tests / seconds;
  state.counters["of_peak"] = flops * tests / seconds / peak<typename register_type<T>::type>();
  state.counters["wrong"] = wrong;
  state.counters["t_error"] = error;
}

template <class Form, faces F, class T, order O = order::tiled> void rays(benchmark::State& state) {
  measure_crossbar<Form, F, O, T, T, lane_t<T>>(state);
}
template <class Form, faces F, class T, order O = order::tiled> void triangles(benchmark::State& state) {
  measure_crossbar<Form, F, O, T, lane_t<T>, T>(state);
}

#define PATCHRT_BENCH_FORM(form)                                               \
  BENCHMARK_TEMPLATE(rays, form, faces::front, float);                         \
  BENCHMARK_TEMPLATE(rays, form, faces::front, pack<float, 8>);                \
  BENCHMARK_TEMPLATE(rays, form, faces::front, pack<float, 16>);               \
  BENCHMARK_TEMPLATE(rays, form, faces::both, pack<float, 16>);                \
  BENCHMARK_TEMPLATE(rays, form, faces::front, pack<float, 16>, order::mixed); \
  BENCHMARK_TEMPLATE(rays, form, faces::front, double);                        \
  BENCHMARK_TEMPLATE(rays, form, faces::front, pack<double, 8>);               \
  BENCHMARK_TEMPLATE(rays, form, faces::front, pack<double, 16>);              \
  BENCHMARK_TEMPLATE(triangles, form, faces::front, pack<float, 8>);           \
  BENCHMARK_TEMPLATE(triangles, form, faces::front, pack<float, 16>);          \
  BENCHMARK_TEMPLATE(triangles, form, faces::front, pack<double, 8>)

PATCHRT_BENCH_FORM(engine_form);
PATCHRT_BENCH_FORM(moller_trumbore_form);
PATCHRT_BENCH_FORM(watertight_form);

}  // namespace

int main(int argc, char** argv) {
  return patchrt::bench::run_benchmarks(argc, argv, [] {});
}
