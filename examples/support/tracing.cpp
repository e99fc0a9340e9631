// SPDX-License-Identifier: MIT
#include "tracing.hpp"

#include "stopwatch.hpp"

#include <stdexcept>
#include <vector>

namespace patchrt::examples {

namespace {

template <accuracy A>
void trace_at(mixed_hierarchy_view const& hierarchy, bool any, std::span<ray<double> const> rays,
              std::span<patch_hit> hits, openmp const& exec, hierarchy_counts* counts) {
  if (any) trace::any_hits<A>(hierarchy, rays, hits, exec, counts);
  else trace::closest_hits<A>(hierarchy, rays, hits, exec, counts);
}

void trace_with(accuracy level, mixed_hierarchy_view const& hierarchy, bool any, std::span<ray<double> const> rays,
                std::span<patch_hit> hits, openmp const& exec, hierarchy_counts* counts) {
  switch (level) {
    case accuracy::fast:
      return trace_at<accuracy::fast>(hierarchy, any, rays, hits, exec, counts);
    case accuracy::refined:
      return trace_at<accuracy::refined>(hierarchy, any, rays, hits, exec, counts);
    case accuracy::certified:
      return trace_at<accuracy::certified>(hierarchy, any, rays, hits, exec, counts);
    case accuracy::reference:
      return trace_at<accuracy::reference>(hierarchy, any, rays, hits, exec, counts);
  }
}

}  // namespace

std::string_view name_of(accuracy level) {
  switch (level) {
    case accuracy::fast:
      return "fast";
    case accuracy::refined:
      return "refined";
    case accuracy::certified:
      return "certified";
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

double tracer::cull_back_faces(vec3<double> const& eye, patch_front front) {
  visible_ = patchrt::cull_back_faces(hierarchy_, eye, executor_, front);
  return double(visible_->culled_leaves()) / double(visible_->leaf_count());
}

void tracer::trace(accuracy level, bool any, std::span<ray<double> const> rays, std::span<patch_hit> hits) const {
  trace_with(level, view(), any, rays, hits, executor_, nullptr);
}

hierarchy_counts tracer::count_work(accuracy level, bool any, std::span<ray<double> const> rays) const {
  hierarchy_counts counts;
  std::vector<patch_hit> hits(rays.size());
  trace_with(level, view(), any, rays, hits, executor_, &counts);
  return counts;
}

}  // namespace patchrt::examples
