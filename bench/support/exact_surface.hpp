// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Points of bicubic patches and distances to them in long double, sharing no code with the kernels that are measured.

#include <patchrt/shapes/bezier_patch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace patchrt::bench {

using real = long double;
using real3 = vec3<real>;

inline real inner(real3 const& a, real3 const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline real length(real3 const& a) { return std::sqrt(inner(a, a)); }

/// A point of a patch and its partial derivatives up to the second.
struct exact_point {
  real3 s, su, sv, suu, suv, svv;
};

inline exact_point evaluate_exactly(bicubic_patch<double> const& patch, real u, real v) {
  struct weights {
    real value[4], first[4], second[4];
    explicit weights(real x) {
      real const y = 1 - x;
      real const w[3][4] = {{y * y * y, 3 * x * y * y, 3 * x * x * y, x * x * x},
                            {-3 * y * y, 3 * y * y - 6 * x * y, 6 * x * y - 3 * x * x, 3 * x * x},
                            {6 * y, 6 * x - 12 * y, 6 * y - 12 * x, 6 * x}};
      std::copy_n(w[0], 4, value);
      std::copy_n(w[1], 4, first);
      std::copy_n(w[2], 4, second);
    }
  };
  weights const a(u), b(v);
  real3 const zero(0, 0, 0);
  exact_point r{zero, zero, zero, zero, zero, zero};
  for (int i = 0; i < 4; ++i) {
    real3 row = zero, row_v = zero, row_vv = zero;
    for (int j = 0; j < 4; ++j) {
      real3 const p(patch.control_points[i * 4 + j]);
      row += b.value[j] * p;
      row_v += b.first[j] * p;
      row_vv += b.second[j] * p;
    }
    r.s += a.value[i] * row;
    r.su += a.first[i] * row;
    r.sv += a.value[i] * row_v;
    r.suu += a.second[i] * row;
    r.suv += a.first[i] * row_v;
    r.svv += a.value[i] * row_vv;
  }
  return r;
}

/// The place of a patch that is nearest to a point, as far as descent from a start finds it.
struct foot {
  real u, v, distance;
  bool at_edge;  ///< the nearest place of the extended patch lies outside [0,1]^2
};

/// Newton's method on |S(u,v) - p|^2 within [0,1]^2, steps halved until the distance falls.
inline foot nearest_foot(bicubic_patch<double> const& patch, real3 const& p, real u, real v) {
  auto const unit = [](real x) { return std::clamp(x, real(0), real(1)); };
  u = unit(u);
  v = unit(v);
  exact_point at = evaluate_exactly(patch, u, v);
  real distance = length(at.s - p);
  bool held_u = false, held_v = false;
  for (int step = 0; step < 32; ++step) {
    real3 const r = at.s - p;
    real gu = inner(at.su, r), gv = inner(at.sv, r);
    held_u = (u == 0 && gu > 0) || (u == 1 && gu < 0);
    held_v = (v == 0 && gv > 0) || (v == 1 && gv < 0);
    real const euu = inner(at.su, at.su), euv = inner(at.su, at.sv), evv = inner(at.sv, at.sv);
    real huu = euu + inner(at.suu, r), huv = euv + inner(at.suv, r), hvv = evv + inner(at.svv, r);
    if (!(huu > 0 && huu * hvv > huv * huv)) huu = euu, huv = euv, hvv = evv;
    if (held_u) gu = 0, huv = 0;
    if (held_v) gv = 0, huv = 0;
    real const det = huu * hvv - huv * huv;
    real du = det > 0 ? (huv * gv - hvv * gu) / det : (huu > 0 ? -gu / huu : 0);
    real dv = det > 0 ? (huv * gu - huu * gv) / det : (hvv > 0 ? -gv / hvv : 0);
    bool nearer = false;
    for (int half = 0; half < 8 && !nearer; ++half, du /= 2, dv /= 2) {
      real const next_u = unit(u + du), next_v = unit(v + dv);
      exact_point const next = evaluate_exactly(patch, next_u, next_v);
      real const next_distance = length(next.s - p);
      if (next_distance < distance) {
        nearer = true;
        u = next_u, v = next_v, at = next, distance = next_distance;
      }
    }
    if (!nearer || std::abs(du) + std::abs(dv) < 1e-12L) break;
  }
  return {u, v, distance, held_u || held_v};
}

/// Distances from points to a model of exact patches.
class exact_surface {
 public:
  explicit exact_surface(std::span<bicubic_patch<double> const> patches) : patches_(patches) {
    for (auto const& p : patches) bounds_.push_back(bounds(p));
  }

  /// The distance from p to the model, p being near the place (u, v) of patch `patch`; the neighbours count too where
  /// the foot on that patch falls on its edge.
  real distance(real3 const& p, std::int32_t patch, real u, real v) const {
    foot const first = nearest_foot(patches_[std::size_t(patch)], p, u, v);
    if (!first.at_edge) return first.distance;
    real best = first.distance;
    for (std::size_t k = 0; k < patches_.size(); ++k)
      if (std::int32_t(k) != patch && distance_to_box(p, bounds_[k]) < best)
        best = std::min(best, nearest_foot_of_all(patches_[k], p).distance);
    return best;
  }

 private:
  static real distance_to_box(real3 const& p, box<double> const& b) {
    auto const outside = [](real x, double lo, double hi) { return std::max({real(0), lo - x, x - hi}); };
    return length({outside(p.x, b.lo.x, b.hi.x), outside(p.y, b.lo.y, b.hi.y), outside(p.z, b.lo.z, b.hi.z)});
  }

  static foot nearest_foot_of_all(bicubic_patch<double> const& patch, real3 const& p) {
    constexpr int samples = 8;
    real best = 0, u = 0, v = 0;
    for (int i = 0; i <= samples; ++i)
      for (int j = 0; j <= samples; ++j) {
        real const d = length(evaluate_exactly(patch, real(i) / samples, real(j) / samples).s - p);
        if ((i == 0 && j == 0) || d < best) best = d, u = real(i) / samples, v = real(j) / samples;
      }
    return nearest_foot(patch, p, u, v);
  }

  std::span<bicubic_patch<double> const> patches_;
  std::vector<box<double>> bounds_;
};

}  // namespace patchrt::bench
