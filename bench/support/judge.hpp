// SPDX-License-Identifier: MIT
#pragma once

#include "answer.hpp"
#include "exact_surface.hpp"

namespace patchrt::bench {

/// How right a list of answers is. Lengths are in bounding-box diagonals.
struct verdict {
  std::size_t hits = 0;
  std::size_t wrong = 0;   ///< a hit for a miss or a miss for a hit, or hits more than a hundredth apart: another sheet
  double surface_rms = 0;  ///< distance of origin + t direction from the exact surface, over all hits
  double surface_max = 0;
  double along_ray_rms = 0;  ///< |t - exact t| |direction|, over hits that are not wrong
  double along_ray_max = 0;
};

/// \param what with `query::any` nothing but hit and miss is judged.
inline verdict judge(exact_surface const& surface, double diagonal, query what, std::span<ray<double> const> rays,
                     std::span<answer const> reference, std::span<answer const> answers) {
  verdict v;
  if (what == query::any) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      v.hits += is_hit(answers[i]);
      v.wrong += is_hit(answers[i]) != is_hit(reference[i]);
    }
    return v;
  }
  real surface_sum = 0, along_sum = 0;
  std::size_t right = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    answer const &a = answers[i], &exact = reference[i];
    real3 const d(rays[i].direction);
    real const apart = std::abs(real(a.t) - exact.t) * length(d) / diagonal;
    bool const wrong = is_hit(a) != is_hit(exact) || (is_hit(a) && !(apart < 0.01L));
    v.wrong += wrong;
    if (!is_hit(a)) continue;
    ++v.hits;
    real const off = surface.distance(real3(rays[i].origin) + real(a.t) * d, a.patch, a.u, a.v) / diagonal;
    surface_sum += off * off;
    v.surface_max = std::max(v.surface_max, double(off));
    if (wrong) continue;
    ++right;
    along_sum += apart * apart;
    v.along_ray_max = std::max(v.along_ray_max, double(apart));
  }
  v.surface_rms = double(std::sqrt(surface_sum / real(std::max<std::size_t>(v.hits, 1))));
  v.along_ray_rms = double(std::sqrt(along_sum / real(std::max<std::size_t>(right, 1))));
  return v;
}

}  // namespace patchrt::bench
