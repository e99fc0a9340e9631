// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Every hit of a ray with bicubic Bezier patches, by a way of its own: no code of patchrt, no Newton from guesses, and
/// more digits than the answers it judges.
///
/// The patch is projected along the ray to the plane in 113 bits (where the compiler has them) and cut into cells. A cell is
/// dropped when a line separates its control points from the ray, or when Krawczyk's operator, whose slopes come from the
/// hull of the derivatives' control points, maps it off itself. A cell on which the operator contracts holds one root at
/// most; Newton's method finds it, to the last of the 113 bits. What is left at the rounding level is reported as singular.
/// \note Krawczyk's operator: Neumaier, Interval Methods for Systems of Equations, 1990, section 5.2; Hansen & Walster,
///       Global Optimization Using Interval Analysis, 2nd ed., 2004, section 11.

#include <array>
#include <span>
#include <vector>

namespace patchrt::test {

/// Control point (i, j), i along u and j along v, has its x, y, z at 3 (4 i + j).
using oracle_patch = std::array<double, 48>;
/// Origin, direction, t_min, t_max.
using oracle_ray = std::array<double, 8>;

/// A point where the ray meets a patch.
struct oracle_root {
  long double t;
  long double u;  ///< u and v may lie outside [0, 1] by up to the margin that was asked for
  long double v;
  int patch;
  double cos_angle;      ///< |cosine| between direction and normal: how far from grazing
  double jacobian;       ///< |det(Qu, Qv, d)| / (|Qu| |Qv| |d|): how far from singular in the parameters too
  double edge_distance;  ///< distance in space to the nearest edge of the patch along its tangents, negative outside
  double end_distance;   ///< t to the nearer of t_min and t_max, negative outside
  bool singular;         ///< no single regular root: one point, within `slack`, of a tangency or a degenerate edge
  long double slack;     ///< half the range of t; 0 unless singular

  /// Whether any right answer has this root: regular, not grazing, well inside the patch and the range of t.
  bool is_certain(double least_cos = 1e-4, double margin = 1e-9) const {
    return !singular && cos_angle > least_cos && jacobian > 1e-2 * least_cos && edge_distance > margin &&
           end_distance > margin;
  }
};

/// Patches and their boxes, ready for rays.
class oracle {
 public:
  explicit oracle(std::span<oracle_patch const> patches);

  /// All roots, those near each other on neighbouring patches included, by ascending t. Roots up to `margin` outside the
  /// parameters [0, 1] and, relative to their t, outside the range (t_min, t_max) are reported too: what a right answer may
  /// have. Nothing for a ray that is not finite or has no direction.
  std::vector<oracle_root> all_hits(oracle_ray const& ray, double margin = 1e-9) const;

  /// Distance of the surface point at (u, v) from the ray's point at t.
  long double distance(int patch, oracle_ray const& ray, long double t, long double u, long double v) const;

 private:
  struct bounds {
    std::array<double, 3> lo;
    std::array<double, 3> hi;
  };
  std::vector<oracle_patch> patches_;
  std::vector<bounds> bounds_;
};

/// As `oracle(patches).all_hits(ray)`.
std::vector<oracle_root> oracle_all_hits(std::span<oracle_patch const> patches, oracle_ray const& ray);

}  // namespace patchrt::test
