// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Hard cases turned, mirrored and re-parametrised without rounding, as doubles; and their roots to 512 bits.

#include "hard_case.hpp"

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <algorithm>
#include <array>
#include <optional>

namespace patchrt::test {

using wide =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<512, boost::multiprecision::digit_base_2>,
                                  boost::multiprecision::et_off>;
using wide_point = std::array<wide, 3>;

inline wide widely(rational const& x) { return wide(numerator(x)) / wide(denominator(x)); }
inline wide_point widely(exact_point const& p) { return {widely(p[0]), widely(p[1]), widely(p[2])}; }
inline wide_point widely(vec3<double> const& p) { return {wide(p.x), wide(p.y), wide(p.z)}; }
inline wide length(wide_point const& a) { return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]); }
inline wide_point difference_of(wide_point const& a, wide_point const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// S(u, v), exactly but for the last of 512 bits.
inline wide_point wide_position(bicubic_patch<double> const& p, double u, double v) {
  auto const weights = [](wide const& t) {
    wide const s = 1 - t;
    return std::array<wide, 4>{s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
  };
  auto const in_u = weights(u), in_v = weights(v);
  wide_point sum{0, 0, 0};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      auto const& c = p(int(i), int(j));
      wide const w = in_u[i] * in_v[j];
      sum[0] += w * wide(c.x);
      sum[1] += w * wide(c.y);
      sum[2] += w * wide(c.z);
    }
  }
  return sum;
}

/// A turn of space, what becomes of the parameters, and of the ray.
struct pose {
  int turn = 0;           ///< of `turns`
  int parameters = 0;     ///< bit 0: u and v change places; bit 1: u runs backwards; bit 2: v runs backwards
  bool reversed = false;  ///< the ray comes from the other end
};

inline constexpr int turn_count = 4;

/// Matrices of integers: the identity, a turn of the axes, a mirror image, and three times a rotation.
inline std::array<int, 9> turn_matrix(int k) {
  constexpr std::array<int, 9> turns[turn_count] = {{1, 0, 0, 0, 1, 0, 0, 0, 1},
                                                    {0, 1, 0, 0, 0, 1, 1, 0, 0},
                                                    {0, 0, -1, 0, 1, 0, -1, 0, 0},
                                                    {2, -1, 2, 2, 2, -1, -1, 2, 2}};
  return turns[k];
}

struct posed_root {
  wide t, t_end;
  wide_point point;
  contact kind;
  int patch;
};

struct posed_case {
  patch_list patches;
  ray<double> r;
  std::vector<posed_root> roots;
  double size;  ///< of the largest coordinate of all, and what the ray's |origin| adds
};

namespace detail {
inline exact_point turned(exact_point const& p, int k) {
  auto const m = turn_matrix(k);
  exact_point q;
  for (std::size_t i = 0; i < 3; ++i) q[i] = m[3 * i] * p[0] + m[3 * i + 1] * p[1] + m[3 * i + 2] * p[2];
  return q;
}
inline std::optional<vec3<double>> as_doubles(exact_point const& p) {
  vec3<double> const q(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
  if (exactly(q) != p) return {};
  return q;
}
}  // namespace detail

/// The case in a pose, times `scale`, moved by `shift`; nothing where doubles cannot hold it exactly.
inline std::optional<posed_case> posed(hard_case const& c, pose const& how, rational const& scale = 1,
                                       exact_point const& shift = {0, 0, 0}) {
  posed_case out;
  auto const place = [&](exact_point const& p) { return detail::turned(scale * p, how.turn) - rational(-1) * shift; };
  double size = 0;
  for (exact_patch p : c.patches) {
    if (how.parameters & 1) p = transposed(p);
    bicubic_patch<double> q;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        auto const point = detail::as_doubles(place(p(how.parameters & 2 ? 3 - i : i, how.parameters & 4 ? 3 - j : j)));
        if (!point) return {};
        q(i, j) = *point;
        size = std::max({size, std::fabs(point->x), std::fabs(point->y), std::fabs(point->z)});
      }
    }
    out.patches.push_back(q);
  }
  // The reversed ray starts where the given one is at t = far.
  rational const far = 2 + (c.roots.empty() ? rational(4) : rational(abs(c.roots.back().t)));
  exact_point const origin = how.reversed ? c.ray_origin - rational(-far) * c.ray_direction : c.ray_origin;
  auto const from = detail::as_doubles(place(origin));
  auto const along = detail::as_doubles(
      detail::turned(scale * (how.reversed ? rational(-1) * c.ray_direction : c.ray_direction), how.turn));
  if (!from || !along) return {};
  out.r = {*from, *along, c.t_min, c.t_max};
  if (how.reversed) {
    auto const mirrored = [&](double t) { return std::isinf(t) ? -t : static_cast<double>(far - rational(t)); };
    out.r.t_min = mirrored(c.t_max);
    out.r.t_max = mirrored(c.t_min);
  }
  for (exact_root const& r : c.roots) {
    exact_point const at = c.ray_origin - rational(-r.t) * c.ray_direction;
    bool const is_curve = r.kind == contact::curve;
    rational const first = !how.reversed ? r.t : far - (is_curve ? r.t_end : r.t),
                   last = how.reversed ? far - r.t : r.t_end;
    out.roots.push_back({widely(first), widely(last), widely(place(at)), r.kind, r.patch});
  }
  std::stable_sort(out.roots.begin(), out.roots.end(),
                   [](posed_root const& a, posed_root const& b) { return a.t < b.t; });
  out.size = size + std::fabs(from->x) + std::fabs(from->y) + std::fabs(from->z);
  return out;
}

}  // namespace patchrt::test
