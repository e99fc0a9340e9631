// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The hits that others are judged by: subdivision until Newton's method is certain to find the cell's only root.

#include "answer.hpp"
#include "exact_surface.hpp"

#include <limits>

namespace patchrt::bench {

/// Nearest hits of rays with bicubic patches, slow and sure.
///
/// Both of a ray's planes make a patch a map of the plane, whose root is sought. Cells that the hull excludes are
/// dropped; where the mean Jacobian's inverse brings every difference of control points within half of the unit
/// matrix, the map is one-to-one and Newton's method in long double decides; other cells are split. Tangential roots,
/// which no depth isolates, are taken where Newton reaches a residual of 1e-15 of the patch's distance.
class reference_tracer {
 public:
  explicit reference_tracer(std::span<bicubic_patch<double> const> patches) : patches_(patches) {
    std::size_t const n = patches.size();
    for (auto& side : sides_) side.resize(n);
    entered_.resize(n);
    for (std::size_t k = 0; k < n; ++k) {
      box<double> const b = bounds(patches[k]);
      double const margin = 1e-9 * (b.hi.x - b.lo.x + b.hi.y - b.lo.y + b.hi.z - b.lo.z);
      for (int axis = 0; axis < 3; ++axis) {
        sides_[std::size_t(axis)][k] = component(b.lo, axis) - margin;
        sides_[std::size_t(axis + 3)][k] = component(b.hi, axis) + margin;
      }
    }
  }

  answer operator()(ray<double> const& r) {
    answer nearest = miss();
    real t_nearest = r.t_max;
    enter_boxes(r);
    for (std::size_t k = 0; k < patches_.size(); ++k)
      if (entered_[k] < double(t_nearest)) search(r, std::int32_t(k), t_nearest, nearest);
    return nearest;
  }

 private:
  struct cell {
    double a[16], b[16];
    double u0, u1, v0, v1;
    int depth;
  };
  static constexpr int max_depth = 64;
  static constexpr int max_cells = 20000;

  /// Where the ray enters each patch's box; infinite where it does not.
  void enter_boxes(ray<double> const& r) {
    double const ix = 1 / r.direction.x, iy = 1 / r.direction.y, iz = 1 / r.direction.z;
    auto const [lx, ly, lz, hx, hy, hz] = std::array{sides_[0].data(), sides_[1].data(), sides_[2].data(),
                                                     sides_[3].data(), sides_[4].data(), sides_[5].data()};
    double* const entered = entered_.data();
    std::size_t const n = entered_.size();
    double const t_min = r.t_min, t_max = r.t_max, ox = r.origin.x, oy = r.origin.y, oz = r.origin.z;
    for (std::size_t k = 0; k < n; ++k) {
      double const x0 = (lx[k] - ox) * ix, x1 = (hx[k] - ox) * ix, y0 = (ly[k] - oy) * iy, y1 = (hy[k] - oy) * iy,
                   z0 = (lz[k] - oz) * iz, z1 = (hz[k] - oz) * iz;
      double const in = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), t_min));
      double const out = min(min(max(x0, x1), max(y0, y1)), min(max(z0, z1), t_max));
      entered[k] = in > out ? std::numeric_limits<double>::infinity() : in;
    }
  }

  void search(ray<double> const& r, std::int32_t index, real& t_nearest, answer& nearest) {
    auto const& patch = patches_[std::size_t(index)];
    real3 const d(r.direction);
    real3 const e = std::abs(d.x) <= std::abs(d.y) && std::abs(d.x) <= std::abs(d.z) ? real3(1, 0, 0)
                    : std::abs(d.y) <= std::abs(d.z)                                 ? real3(0, 1, 0)
                                                                                     : real3(0, 0, 1);
    real3 n1 = outer(d, e);
    n1 /= length(n1);
    real3 n2 = outer(d, n1);
    n2 /= length(n2);

    stack_.clear();
    cell& root = stack_.emplace_back();
    double scale = 0;
    for (std::size_t i = 0; i < 16; ++i) {
      real3 const q = real3(patch.control_points[i]) - real3(r.origin);
      root.a[i] = double(inner(n1, q));
      root.b[i] = double(inner(n2, q));
      scale = std::max(scale, double(length(q)));
    }
    root.u0 = root.v0 = 0;
    root.u1 = root.v1 = 1;
    root.depth = 0;

    for (int visited = 0; !stack_.empty() && visited < max_cells; ++visited) {
      cell const c = stack_.back();
      stack_.pop_back();
      if (excluded(c, 1e-15 * scale)) continue;
      bool const one_to_one = is_one_to_one(c);
      if (!one_to_one && c.depth < max_depth) {
        split(c);
        continue;
      }
      real u = (real(c.u0) + c.u1) / 2, v = (real(c.v0) + c.v1) / 2;
      exact_point at{};
      real residual = 0;
      for (int step = 0; step < 12; ++step) {
        at = evaluate_exactly(patch, u, v);
        real3 const q = at.s - real3(r.origin);
        real const f = inner(n1, q), g = inner(n2, q);
        real const fu = inner(n1, at.su), fv = inner(n1, at.sv), gu = inner(n2, at.su), gv = inner(n2, at.sv);
        real const det = fu * gv - fv * gu;
        residual = std::max(std::abs(f), std::abs(g));
        if (residual < 1e-18L * scale || det == 0) break;
        u -= (f * gv - g * fv) / det;
        v -= (g * fu - f * gu) / det;
      }
      real const slack = 1e-12L + (one_to_one ? 0 : 1e-6L);
      bool const within = u >= c.u0 - slack && u <= c.u1 + slack && v >= c.v0 - slack && v <= c.v1 + slack;
      if (!within || !(residual < 1e-15L * scale)) continue;
      real const t = inner(at.s - real3(r.origin), d) / inner(d, d);
      if (r.t_min < t && t < t_nearest) {
        t_nearest = t;
        nearest = {double(t), std::clamp(double(u), 0.0, 1.0), std::clamp(double(v), 0.0, 1.0), index};
      }
    }
  }

  static real3 outer(real3 const& a, real3 const& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  }

  /// Whether one of four lines through the origin has every control point on one side.
  static bool excluded(cell const& c, double slack) {
    double lo[4], hi[4];
    std::fill_n(lo, 4, std::numeric_limits<double>::infinity());
    std::fill_n(hi, 4, -std::numeric_limits<double>::infinity());
    for (int i = 0; i < 16; ++i) {
      double const x[4] = {c.a[i], c.b[i], c.a[i] + c.b[i], c.a[i] - c.b[i]};
      for (int k = 0; k < 4; ++k) lo[k] = std::min(lo[k], x[k]), hi[k] = std::max(hi[k], x[k]);
    }
    for (int k = 0; k < 4; ++k)
      if (lo[k] > slack || hi[k] < -slack) return true;
    return false;
  }

  static bool is_one_to_one(cell const& c) {
    double const fu = c.a[12] + c.a[15] - c.a[0] - c.a[3], fv = c.a[3] + c.a[15] - c.a[0] - c.a[12];
    double const gu = c.b[12] + c.b[15] - c.b[0] - c.b[3], gv = c.b[3] + c.b[15] - c.b[0] - c.b[12];
    double const det = fu * gv - fv * gu;
    if (!(std::abs(det) > 0)) return false;
    double const s = 6 / det;  // the mean of two differences of corners is three differences of control points
    double worst_u = 0, worst_v = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) {
        int const p = i * 4 + j, q = p + 4, m = j * 4 + i, n = m + 1;
        double const au = c.a[q] - c.a[p], bu = c.b[q] - c.b[p], av = c.a[n] - c.a[m], bv = c.b[n] - c.b[m];
        worst_u = std::max(worst_u, std::abs(s * (gv * au - fv * bu) - 1) + std::abs(s * (fu * bu - gu * au)));
        worst_v = std::max(worst_v, std::abs(s * (gv * av - fv * bv)) + std::abs(s * (fu * bv - gu * av) - 1));
      }
    return worst_u < 0.5 && worst_v < 0.5;
  }

  /// Halves c across its longer side and stacks the halves.
  void split(cell const& c) {
    auto const span_of = [&](int far, int near) {
      return std::abs(c.a[far] - c.a[near]) + std::abs(c.b[far] - c.b[near]);
    };
    double long_u = 0, long_v = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) {
        long_u = std::max(long_u, span_of(i * 4 + j + 4, i * 4 + j));
        long_v = std::max(long_v, span_of(j * 4 + i + 1, j * 4 + i));
      }
    bool const along_u = long_u >= long_v;
    int const across = along_u ? 1 : 4, along = along_u ? 4 : 1;
    cell first = c, second = c;
    for (int k = 0; k < 4; ++k) {
      halve(c.a + k * across, first.a + k * across, second.a + k * across, along);
      halve(c.b + k * across, first.b + k * across, second.b + k * across, along);
    }
    (along_u ? first.u1 : first.v1) = (along_u ? second.u0 : second.v0) =
        along_u ? (c.u0 + c.u1) / 2 : (c.v0 + c.v1) / 2;
    first.depth = second.depth = c.depth + 1;
    stack_.push_back(first);
    stack_.push_back(second);
  }

  static void halve(double const* p, double* first, double* second, int step) {
    double const a = (p[0] + p[step]) / 2, b = (p[step] + p[2 * step]) / 2, c = (p[2 * step] + p[3 * step]) / 2;
    double const ab = (a + b) / 2, bc = (b + c) / 2;
    first[0] = p[0], first[step] = a, first[2 * step] = ab, first[3 * step] = (ab + bc) / 2;
    second[0] = (ab + bc) / 2, second[step] = bc, second[2 * step] = c, second[3 * step] = p[3 * step];
  }

  std::span<bicubic_patch<double> const> patches_;
  std::array<std::vector<double>, 6> sides_;
  std::vector<double> entered_;
  std::vector<cell> stack_;
};

}  // namespace patchrt::bench
