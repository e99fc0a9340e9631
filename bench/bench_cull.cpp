// SPDX-License-Identifier: MIT
/// \file
/// Primary rays of eyes around a model with and without back-face culling, and what culling takes: once a model, once a
/// frame.
///
/// A view is 512 x 512 pixels, a fifth of which hit; whole and culled are traced in turn, so that both meet the same
/// machine. All times are those of one thread. PATCHRT_MODEL=FILE names another model than the teapot; its front is the
/// side that the first view's nearest hits show most of.
#include "support/round_robin.hpp"
#include "support/run_benchmarks.hpp"
#include "support/workload.hpp"

#include <patchrt/accel/cull_back_faces.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include "../examples/support/model.hpp"

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <cstring>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

/// The model and rays of the eyes around it, a list each.
struct study {
  std::vector<bicubic_patch<double>> patches;
  mixed_hierarchy hierarchy;
  patch_front front = patch_front::along_normal;
  std::vector<std::vector<ray<double>>> views;
};

using hit_list = std::vector<patch_hit>;

template <accuracy A> hit_list trace_list(mixed_hierarchy_view const& h, std::span<ray<double> const> rays) {
  hit_list hits(rays.size());
  trace::closest_hits<A>(h, rays, hits, serial{});
  return hits;
}

patch_front find_front(study const& s) {
  auto const& rays = s.views[0];
  hit_list const hits = trace_list<accuracy::refined>(s.hierarchy.view(), rays);
  int along = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (hits[i].valid()) {
      auto const p = evaluate(s.patches[std::size_t(hits[i].patch)], hits[i].u, hits[i].v);
      along += dot(cross(p.du, p.dv), rays[i].direction) < 0 ? 1 : -1;
    }
  return along >= 0 ? patch_front::along_normal : patch_front::against_normal;
}

study make_study() {
  char const* const file = std::getenv("PATCHRT_MODEL");
  study s;
  s.patches = load_bpt(file ? file : "data/teapot.bpt");
  s.hierarchy = build_mixed_hierarchy(s.patches, {}, serial{});
  constexpr int size = 512;
  for (vec3<double> const direction : {vec3<double>{0.4, -1, 0.5}, {1, 0.3, -0.2}, {-0.5, 0.6, 1}, {-1, -0.4, 0.3}}) {
    camera const c = frame(s.patches, direction, {0, 0, 1}, 40, 0.2);
    s.views.push_back(primary_rays(c, size, size));
  }
  s.front = find_front(s);
  return s;
}

study const& the_study() {
  static study const s = make_study();
  return s;
}

void prepare(benchmark::State& state) {
  study const& s = the_study();
  double seconds = 0;
  for (auto _ : state)
    seconds += thread_seconds([&] { benchmark::DoNotOptimize(visible_hierarchy(s.hierarchy, serial{})); });
  state.counters["us"] = 1e6 * seconds / double(state.iterations());
  state.counters["sub_patches"] = double(s.hierarchy.leaves.size());
}
BENCHMARK(prepare)->Unit(benchmark::kMicrosecond);

void cull(benchmark::State& state) {
  study const& s = the_study();
  visible_hierarchy visible(s.hierarchy, serial{});
  double seconds = 0, share = 0;
  std::size_t k = 0;
  for (auto _ : state) {
    vec3<double> const eye = s.views[k++ % s.views.size()][0].origin;
    seconds += thread_seconds([&] { visible.cull(eye, serial{}, s.front); });
    share += double(visible.culled_leaves()) / double(visible.leaf_count());
  }
  state.counters["us"] = 1e6 * seconds / double(state.iterations());
  state.counters["culled_%"] = 100 * share / double(state.iterations());
}
BENCHMARK(cull)->Unit(benchmark::kMicrosecond);

/// Rays a second through the whole and the culled hierarchy and the work of both; an iteration traces one view by each.
template <accuracy A> void trace_views(benchmark::State& state) {
  study const& s = the_study();
  visible_hierarchy visible(s.hierarchy, serial{});
  std::vector<double> ratios;
  double whole_seconds = 0, culled_seconds = 0;
  std::size_t rays = 0, hits = 0, other = 0, k = 0;
  hierarchy_counts whole_counts, culled_counts;
  hit_list whole, culled;
  for (auto _ : state) {
    auto const& list = s.views[k++ % s.views.size()];
    visible.cull(list[0].origin, serial{}, s.front);
    double const a = thread_seconds([&] { whole = trace_list<A>(s.hierarchy.view(), list); });
    double const b = thread_seconds([&] { culled = trace_list<A>(visible.view(), list); });
    whole_seconds += a;
    culled_seconds += b;
    ratios.push_back(a / b);
    state.PauseTiming();
    rays += list.size();
    for (std::size_t i = 0; i < list.size(); ++i) {
      hits += whole[i].valid();
      other += std::memcmp(&whole[i], &culled[i], sizeof whole[i]) != 0;
    }
    trace::closest_hits<A>(s.hierarchy.view(), list, whole, serial{}, &whole_counts);
    trace::closest_hits<A>(visible.view(), list, culled, serial{}, &culled_counts);
    state.ResumeTiming();
  }
  auto const saved = [](std::uint64_t now, std::uint64_t before) { return 100 - 100 * double(now) / double(before); };
  state.counters["whole_Mrays_s"] = 1e-6 * double(rays) / whole_seconds;
  state.counters["culled_Mrays_s"] = 1e-6 * double(rays) / culled_seconds;
  state.counters["times_as_fast"] = median(ratios);
  state.counters["hit_%"] = 100 * double(hits) / double(rays);
  state.counters["other_hits_%"] = 100 * double(other) / double(hits);
  state.counters["patches_saved_%"] = saved(culled_counts.patches, whole_counts.patches);
  state.counters["candidates_saved_%"] = saved(culled_counts.candidates, whole_counts.candidates);
}
BENCHMARK_TEMPLATE(trace_views, accuracy::fast)->Unit(benchmark::kMillisecond)->Iterations(48);
BENCHMARK_TEMPLATE(trace_views, accuracy::refined)->Unit(benchmark::kMillisecond)->Iterations(48);
BENCHMARK_TEMPLATE(trace_views, accuracy::reference)->Unit(benchmark::kMillisecond)->Iterations(48);

}  // namespace

int main(int argc, char** argv) { return patchrt::bench::run_benchmarks(argc, argv, the_study); }
