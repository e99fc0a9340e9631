// SPDX-License-Identifier: MIT
#pragma once

#include "tracing.hpp"

#include <nlohmann/json.hpp>

#include <cstddef>

namespace patchrt::examples {

/// What tracing a list of rays took.
struct trace_statistics {
  std::size_t rays = 0;
  std::size_t hits = 0;
  double seconds = 0;  ///< of tracing alone
  hierarchy_counts counts;

  double mrays_per_s() const { return seconds > 0 ? double(rays) / seconds * 1e-6 : 0; }
};

/// The keys rays, hits, seconds, mrays_per_s, build_seconds, hierarchy_bytes, patch_bytes, candidates_per_ray,
/// newton_steps_per_ray, in this order.
nlohmann::ordered_json to_json(trace_statistics const& statistics, tracer const& model);

}  // namespace patchrt::examples
