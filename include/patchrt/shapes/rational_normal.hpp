// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_normal.hpp>
#include <patchrt/shapes/rational_patch.hpp>

namespace patchrt {

/// The unit normal Qu x Qv / |Qu x Qv| of a rational patch at (u, v): never NaN where control points are finite.
///
/// It is that of the polynomial patch D = W (Q - Q(u, v)), of control points w_ij (p_ij - Q(u, v)), whose tangents
/// there are W Qu and W Qv. At a collapsed edge both have the limit Quv x Qv, since D adds but terms of second order;
/// where that vanishes too, the vector is a unit vector still, of D's limit.
/// \return With s the largest difference of a coordinate between control points and r the ratio of the largest to the
///         least weight, within 2 r s g(24 (M + N) + 32) (M/|Qu| + N/|Qv|) / sin(Qu, Qv) + 4 eps of the exact normal
///         where Qu x Qv does not vanish, with g as in `evaluate`.
template <scalar P, int M, int N, scalar T> PATCHRT_HD vec3<T> normal(rational_patch<P, M, N> const& patch, T u, T v) {
  T const middle(lane_t<T>(0.5));
  auto const low_u = u <= middle, low_v = v <= middle;
  auto const corner = [&patch](int i, int j) { return convert_vec<T>(patch(i, j).point); };
  // Relative to the nearest corner: on a collapsed edge Q(u, v) is then exactly 0, and so are its tangents.
  vec3<T> const base =
      select(low_u, select(low_v, corner(0, 0), corner(0, N)), select(low_v, corner(M, 0), corner(M, N)));
  rational_patch<T, M, N> near;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    auto const& [point, weight] = patch.control_points[k];
    near.control_points[k] = {difference(convert_vec<T>(point), base), convert<T>(weight)};
  }
  vec3<T> const here = position(near, u, v);
  for (weighted_point<T>& c : near.control_points) c.point = difference(c.point, here);
  return normal(numerator(near), u, v);
}

}  // namespace patchrt
