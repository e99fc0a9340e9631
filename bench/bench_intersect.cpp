// SPDX-License-Identifier: MIT
/// \file
/// The kernels below a ray-patch intersection, each for one number and for packs: time and useful flops a lane, and
/// the share of the peak that chains of fused operations reach on the same registers.
///
/// Counters: `ns_a_lane`; `flops_a_lane`, counted by running the kernel on `counted`, mean over its inputs; `GFLOPS`
/// = the two together over all lanes; `of_peak` = GFLOPS over the measured peak of the register that the lanes fill.
///
/// Workload: the patches of the teapot, or of PATCHRT_MODEL=FILE, and rays at points of them: for walk and trace in
/// bundles of 16 from one eye.

#include "support/counted.hpp"
#include "support/microbenchmark.hpp"
#include "support/run_benchmarks.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/intersect/ray_patch.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/trace/fused.hpp>

#include "../examples/support/model.hpp"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

constexpr std::size_t inputs =
    256;  // packs a kernel runs over, so that nothing is known beforehand and all is in cache

std::vector<bicubic_patch<double>> const& model() {
  static auto const patches = load_bpt(std::getenv("PATCHRT_MODEL") ? std::getenv("PATCHRT_MODEL") : "data/teapot.bpt");
  return patches;
}

template <class To> bicubic_patch<To> convert_patch(bicubic_patch<double> const& p) {
  bicubic_patch<To> q;
  for (int k = 0; k < 16; ++k) q.control_points[k] = convert_vec<To>(convert_vec<lane_t<To>>(p.control_points[k]));
  return q;
}

template <class T> void fma_peak(benchmark::State& state) {
  for (auto _ : state) state.counters["GFLOPS"] = 1e-9 * measure_fma_peak<T>();
}

template <class T> void evaluate_patch(benchmark::State& state) {
  random_numbers next;
  std::vector<T> u(inputs), v(inputs);
  for (std::size_t k = 0; k < inputs; ++k) u[k] = draw<T>(next), v[k] = draw<T>(next);
  std::vector<bicubic_patch<lane_t<T>>> patches;
  for (std::size_t k = 0; k < inputs; ++k) patches.push_back(convert_patch<lane_t<T>>(model()[k % model().size()]));
  double const flops = count_operations([] { evaluate(model()[0], counted(0.3), counted(0.4)); });
  measure<T>(state, inputs, flops, [&](std::size_t k) { return evaluate(patches[k], u[k], v[k]); });
}

template <class T> void split_patch(benchmark::State& state) {
  std::vector<bicubic_patch<T>> patches;
  for (std::size_t k = 0; k < 32; ++k) patches.push_back(convert_patch<T>(model()[k % model().size()]));
  auto const one = convert_patch<counted>(model()[0]);
  measure<T>(state, patches.size(), count_operations([&] { split_u(one); }),
             [&](std::size_t k) { return split_u(patches[k]); });
}

template <class T> vec3<T> draw_direction(random_numbers& next) {
  auto const one = [&] { return next.between(-1, 1); };
  return {draw<T>(one), draw<T>(one), draw<T>(one)};
}

double box_operations() {
  slab_ray<counted> const r{{0, 0, 0}, {1, 1, 1}};
  return count_operations([&] { intersect(r, box<counted>{{0, 0, 0}, {1, 1, 1}}, counted(0), counted(1)); });
}

template <class T> void meet_box(benchmark::State& state) {
  using L = lane_t<T>;
  random_numbers next;
  std::vector<slab_ray<T>> rays;
  std::vector<box<L>> boxes;
  for (std::size_t k = 0; k < inputs; ++k) {
    rays.push_back(make_slab_ray<T>(draw_direction<T>(next), draw_direction<T>(next)));
    vec3<L> const corner = draw_direction<L>(next), size = draw_direction<L>(next);
    boxes.push_back({corner, corner + vec3<L>(std::abs(size.x), std::abs(size.y), std::abs(size.z))});
  }
  measure<T>(state, inputs, box_operations(), [&](std::size_t k) {
    return intersect(rays[k], boxes[k], T(L(0)), T(std::numeric_limits<L>::infinity()));
  });
}

/// A patch and rays at points of one of its 64 cells, from there and relative to the patch's base.
template <class T> struct solver_input {
  power_patch<lane_t<T>> patch;
  vec3<lane_t<T>> reach;
  vec3<T> origin, direction;
  patch_cell<T> cell;
};

template <class T> std::vector<solver_input<T>> solver_inputs(std::size_t count) {
  using L = lane_t<T>;
  random_numbers next;
  std::vector<solver_input<T>> all;
  for (std::size_t k = 0; k < count; ++k) {
    auto const& patch = model()[std::size_t(next() * double(model().size()))];
    double const x = 0.125 * (0.5 + std::floor(8 * next())), y = 0.125 * (0.5 + std::floor(8 * next()));
    constexpr int n = lanes_v<T>;
    L lane[6][n];
    for (int i = 0; i < n; ++i) {
      auto const at = evaluate(patch, x + next.between(-0.0625, 0.0625), y + next.between(-0.0625, 0.0625));
      vec3<double> const d = draw_direction<double>(next);
      for (int c = 0; c < 3; ++c) {
        lane[c][i] = static_cast<L>(component(at.position, c) - 4 * component(d, c));
        lane[c + 3][i] = static_cast<L>(component(d, c));
      }
    }
    auto const load = [&](int c) {
      int i = 0;
      return draw<T>([&] { return lane[c][i++]; });
    };
    auto const power = to_power(convert_patch<L>(patch));
    all.push_back({power,
                   scale(coefficient_sum(power), L(5)),  // the origins are up to 4 away
                   {load(0), load(1), load(2)},
                   {load(3), load(4), load(5)},
                   {T(L(2 * x - 1)), T(L(2 * y - 1)), T(L(0.125)), T(L(0.125)), vec3<T>(T(L(0.01)))}});
  }
  return all;
}

/// Planes, projection, the cell's linear start and Newton's iteration until its last step is below `tolerance`.
template <class T, class P> newton_result<T> solve(P const& in, double tolerance) {
  vec3<T> n1, n2;
  plane_normals(in.direction, n1, n2);
  auto const projected = project(in.patch, in.reach, in.origin, n1, n2);
  auto const start = linear_start(projected, absolute(n1), absolute(n2), in.cell);
  return newton(projected, start.x, start.y, T(lane_t<T>(0.5)), T(lane_t<T>(0.5)), start.possible,
                static_cast<lane_t<T>>(tolerance), 8);
}

/// The tolerance leaves the square of it as the error: about one rounding of the lanes.
template <class T> void solve_patch(benchmark::State& state) {
  double const tolerance = sizeof(lane_t<T>) == 4 ? 0x1p-12 : 0x1p-26;
  auto const in = solver_inputs<T>(inputs);
  auto const one = solver_inputs<counted>(inputs);
  double steps = 0, solved = 0;
  double const flops = count_operations([&] {
    for (auto const& i : one) {
      auto const r = solve<counted>(i, tolerance);
      steps += r.steps;
      solved += r.converged;
    }
  });
  measure<T>(state, inputs, flops / double(inputs), [&](std::size_t k) { return solve<T>(in[k], tolerance); });
  state.counters["steps"] = steps / double(inputs);
  state.counters["converged"] = solved / double(inputs);
}

/// Rays at the model in bundles: one origin a bundle of 16, targets within a hundredth of the model.
std::vector<ray<double>> bundles() {
  random_numbers next;
  auto whole = box<double>::empty();
  for (auto const& p : model()) whole = merge(whole, bounds(p));
  double const size = std::sqrt(dot(extent(whole), extent(whole)));
  std::vector<ray<double>> rays;
  for (std::size_t k = 0; k < inputs; ++k) {
    auto const& patch = model()[std::size_t(next() * double(model().size()))];
    vec3<double> const at = evaluate(patch, next(), next()).position, away = draw_direction<double>(next);
    vec3<double> const eye = 0.5 * (whole.lo + whole.hi) + (2 * size / std::sqrt(dot(away, away))) * away;
    for (int i = 0; i < 16; ++i)
      rays.push_back({eye, at + (0.005 * size) * draw_direction<double>(next) - eye, 0, 1e30});
  }
  return rays;
}

/// The walk through the hierarchy over the patches' boxes; a call is one ray, or one a lane out of the same bundle.
template <class T> void walk_boxes(benchmark::State& state) {
  using L = lane_t<T>;
  std::vector<box<L>> boxes;
  for (auto const& p : model()) boxes.push_back(bounds(convert_patch<L>(p)));
  auto const tree = build_sah(std::span<box<L> const>(boxes));
  auto const rays = bundles();
  std::vector<slab_ray<T>> slabs;
  std::vector<unsigned> octants;
  for (std::size_t k = 0; k < inputs; ++k) {
    auto const lanes = [&](vec3<double> ray<double>::*of, int axis) {
      std::size_t i = k * 16;
      return draw<T>([&] { return component(rays[i++].*of, axis); });
    };
    auto const vector = [&](vec3<double> ray<double>::*of) -> vec3<T> {
      return {lanes(of, 0), lanes(of, 1), lanes(of, 2)};
    };
    slabs.push_back(make_slab_ray<T>(vector(&ray<double>::origin), vector(&ray<double>::direction)));
    octants.push_back(direction_octant(rays[k * 16].direction));
  }
  T const t_min(L(0)), t_max(std::numeric_limits<L>::max());
  auto const walk = [&](std::size_t k, auto&& visit) {
    int leaves = 0;
    traverse(
        tree.view(), octants[k],
        [&](box<L> const& b) {
          visit();
          auto const span = intersect(slabs[k], b, t_min, t_max);
          return any_of(span.entry <= span.exit);
        },
        [&](std::int32_t) {
          ++leaves;
          return false;
        });
    return leaves;
  };
  double visited = 0;
  for (std::size_t k = 0; k < inputs; ++k) walk(k, [&] { ++visited; });
  measure<T>(state, inputs, visited / double(inputs) * box_operations(), [&](std::size_t k) { return walk(k, [] {}); });
  state.counters["nodes"] = visited / double(inputs);
}

/// The whole of an intersection by the mixed hierarchy; a call is a bundle of 16 rays.
template <accuracy A, int N> void trace_bundle(benchmark::State& state) {
  auto const rays = bundles();
  auto const hierarchy = build_mixed_hierarchy(model(), {}, serial{});
  auto const view = hierarchy.view();
  std::vector<patch_hit> hits(16);
  hierarchy_counts counts;
  std::vector<patch_hit> all(rays.size());
  trace::closest_hits<A>(view, rays, all, serial{}, &counts);
  std::size_t k = 0;
  double const seconds = thread_seconds([&] {
    for (auto _ : state) {
      for (int i = 0; i < 16; i += N)
        trace::closest_hits<A>(view, std::span(rays).subspan(k * 16 + std::size_t(i), N), std::span(hits).first(N),
                               serial{});
      benchmark::DoNotOptimize(hits.data());
      k = k + 1 == inputs ? 0 : k + 1;
    }
  });
  state.counters["ns_a_ray"] = 1e9 * seconds / (16 * double(state.iterations()));
  state.counters["patches_a_ray"] = double(counts.patches) / double(rays.size());
  state.counters["candidates_a_ray"] = double(counts.candidates) / double(rays.size());
}

#define PATCHRT_BENCH_LANES(kernel)            \
  BENCHMARK_TEMPLATE(kernel, float);           \
  BENCHMARK_TEMPLATE(kernel, pack<float, 8>);  \
  BENCHMARK_TEMPLATE(kernel, pack<float, 16>); \
  BENCHMARK_TEMPLATE(kernel, double);          \
  BENCHMARK_TEMPLATE(kernel, pack<double, 4>); \
  BENCHMARK_TEMPLATE(kernel, pack<double, 8>)

BENCHMARK_TEMPLATE(fma_peak, float)->Iterations(1);
BENCHMARK_TEMPLATE(fma_peak, double)->Iterations(1);
BENCHMARK_TEMPLATE(fma_peak, pack<float, pack<float, 8>::width>)->Iterations(1);
BENCHMARK_TEMPLATE(fma_peak, pack<double, pack<double, 4>::width>)->Iterations(1);
BENCHMARK_TEMPLATE(fma_peak, pack<float, pack<float, 16>::width>)->Iterations(1);
BENCHMARK_TEMPLATE(fma_peak, pack<double, pack<double, 8>::width>)->Iterations(1);
PATCHRT_BENCH_LANES(evaluate_patch);
PATCHRT_BENCH_LANES(split_patch);
PATCHRT_BENCH_LANES(meet_box);
PATCHRT_BENCH_LANES(solve_patch);
PATCHRT_BENCH_LANES(walk_boxes);
BENCHMARK_TEMPLATE(trace_bundle, accuracy::fast, 16);
BENCHMARK_TEMPLATE(trace_bundle, accuracy::refined, 16);
BENCHMARK_TEMPLATE(trace_bundle, accuracy::reference, 16);
BENCHMARK_TEMPLATE(trace_bundle, accuracy::refined, 1);

}  // namespace

int main(int argc, char** argv) { return patchrt::bench::run_benchmarks(argc, argv, model); }
