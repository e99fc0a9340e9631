// SPDX-License-Identifier: MIT
/// \file
/// Building the mixed hierarchy of a model: microseconds and bytes a patch by the depth of the sub-patch trees (-1:
/// by each patch's shape), on one thread and on more.
///
/// Arguments of a benchmark: depth, threads. `us_a_patch` is thread time on one thread and wall time on more.
/// PATCHRT_MODEL=FILE names another model than the teapot; patches are repeated, moved apart, until there are 4096,
/// so that threads have work.

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#if PATCHRT_HAVE_OPENMP
#  include <patchrt/exec/openmp.hpp>
#endif

#include "support/cpu_clock.hpp"
#include "support/run_benchmarks.hpp"

#include "../examples/support/model.hpp"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <thread>

namespace {

using namespace patchrt;

std::vector<bicubic_patch<double>> make_patches() {
  char const* const file = std::getenv("PATCHRT_MODEL");
  auto const model = load_bpt(file ? file : "data/teapot.bpt");
  constexpr std::size_t wanted = 4096;
  auto patches = model;
  for (int copy = 1; patches.size() < wanted; ++copy)
    for (auto p : model) {
      for (auto& c : p.control_points) c += vec3<double>(8.0 * (copy % 16), 8.0 * (copy / 16), 0.0);
      patches.push_back(p);
    }
  return patches;
}

std::vector<bicubic_patch<double>> const& patches() {
  static auto const all = make_patches();
  return all;
}

template <executor E> void build(benchmark::State& state, E const& exec, clockid_t clock) {
  mixed_hierarchy_options options;
  options.depth = int(state.range(0));
  auto const& all = patches();
  std::size_t bytes = 0;
  double seconds = 0;
  for (auto _ : state) {
    double const start = bench::clock_seconds(clock);
    auto const hierarchy = build_mixed_hierarchy(all, options, exec);
    seconds += bench::clock_seconds(clock) - start;
    bytes = hierarchy.hierarchy_bytes();
  }
  double const count = double(all.size());
  state.counters["us_a_patch"] = 1e6 * seconds / (count * double(state.iterations()));
  state.counters["bytes_a_patch"] = double(bytes) / count;
  state.counters["patches"] = count;
}

void build_serial(benchmark::State& state) { build(state, serial{}, CLOCK_THREAD_CPUTIME_ID); }
BENCHMARK(build_serial)->ArgName("depth")->DenseRange(-1, max_subpatch_depth)->Unit(benchmark::kMillisecond);

#if PATCHRT_HAVE_OPENMP
void build_openmp(benchmark::State& state) { build(state, openmp{int(state.range(1))}, CLOCK_MONOTONIC); }
BENCHMARK(build_openmp)
    ->ArgNames({"depth", "threads"})
    ->Apply([](auto* b) {
      int const cores = int(std::max(1u, std::thread::hardware_concurrency()));
      for (int depth : {-1, 0, 2, 4, 6, 8})
        for (int threads = 1; threads <= cores; threads *= 2) b->Args({depth, threads});
    }) -> UseRealTime() -> Unit(benchmark::kMillisecond);
#endif

}  // namespace

int main(int argc, char** argv) { return patchrt::bench::run_benchmarks(argc, argv, patches); }
