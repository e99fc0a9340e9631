// SPDX-License-Identifier: MIT
#include "tracing.hpp"

#include "stopwatch.hpp"

#include <patchrt/exec/serial.hpp>

#include <stdexcept>
#include <vector>

namespace patchrt::examples {

namespace {

template <bool Any, executor E>
void trace_at(accuracy level, mixed_hierarchy const& hierarchy, std::span<ray<double> const> rays,
              std::span<patch_hit> hits, E const& exec, hierarchy_counts* counts) {
  auto const view = hierarchy.view();
  switch (level) {
    case accuracy::fast:
      return trace::fused<accuracy::fast, Any>(view, rays, hits, exec, counts);
    case accuracy::refined:
      return trace::fused<accuracy::refined, Any>(view, rays, hits, exec, counts);
    case accuracy::reference:
      return trace::fused<accuracy::reference, Any>(view, rays, hits, exec, counts);
  }
}

template <executor E>
void trace_any_or_nearest(accuracy level, bool any, mixed_hierarchy const& hierarchy, std::span<ray<double> const> rays,
                          std::span<patch_hit> hits, E const& exec, hierarchy_counts* counts) {
  if (any) trace_at<true>(level, hierarchy, rays, hits, exec, counts);
  else trace_at<false>(level, hierarchy, rays, hits, exec, counts);
}

}  // namespace

std::string_view name_of(accuracy level) {
  switch (level) {
    case accuracy::fast:
      return "fast";
    case accuracy::refined:
      return "refined";
    case accuracy::reference:
      return "reference";
  }
  return "unknown";
}

accuracy accuracy_named(std::string_view name) {
  for (accuracy const level : accuracy_levels)
    if (name == name_of(level)) return level;
  throw std::invalid_argument("no accuracy is called " + std::string(name));
}

tracer::tracer(std::span<bicubic_patch<double> const> patches, int threads) : executor_(threads) {
  stopwatch const watch;
  hierarchy_ = build_mixed_hierarchy(patches, mixed_hierarchy_options{}, executor_);
  build_seconds_ = watch.seconds();
}

void tracer::trace(accuracy level, bool any, std::span<ray<double> const> rays, std::span<patch_hit> hits) const {
  trace_any_or_nearest(level, any, hierarchy_, rays, hits, executor_, nullptr);
}

hierarchy_counts tracer::count_work(accuracy level, bool any, std::span<ray<double> const> rays) const {
  hierarchy_counts counts;
  std::vector<patch_hit> hits(rays.size());
  trace_any_or_nearest(level, any, hierarchy_, rays, std::span(hits), serial{}, &counts);
  return counts;
}

}  // namespace patchrt::examples
