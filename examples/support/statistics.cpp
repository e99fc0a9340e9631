// SPDX-License-Identifier: MIT
#include "statistics.hpp"

#include <algorithm>
#include <cstdint>

namespace patchrt::examples {

nlohmann::ordered_json to_json(trace_statistics const& s, tracer const& model) {
  auto const per_ray = [&](std::uint64_t n) { return double(n) / double(std::max<std::size_t>(s.rays, 1)); };
  return {{"rays", s.rays},
          {"hits", s.hits},
          {"seconds", s.seconds},
          {"mrays_per_s", s.mrays_per_s()},
          {"build_seconds", model.build_seconds()},
          {"hierarchy_bytes", model.hierarchy_bytes()},
          {"patch_bytes", model.patch_bytes()},
          {"candidates_per_ray", per_ray(s.counts.candidates)},
          {"newton_steps_per_ray", per_ray(s.counts.newton_steps)}};
}

}  // namespace patchrt::examples
