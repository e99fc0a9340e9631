// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Roots that float cannot tell apart: of one ray in one part of a patch, by subdivision in the precision of the hit.

#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/accel/part_list.hpp>
#include <patchrt/intersect/ray_patch.hpp>

namespace patchrt::detail {

/// Bounds the sum of the patch's |coefficients| and a ray's origin, by coordinate: what `project` asks for.
template <class L, int M, int N>
PATCHRT_HD vec3<L> projection_reach(power_patch<L, M, N> const& power, vec3<L> const& origin) {
  return sum(coefficient_sum(power), absolute(origin));
}
template <class L, int M, int N>
PATCHRT_HD vec3<L> projection_reach(rational_power_patch<L, M, N> const& power, vec3<L> const& origin) {
  weighted_point<L> const sums = coefficient_sum(power);
  return fma(sums.weight, absolute(origin), sums.point);
}

/// A rectangle of the parameter square, where Newton's iteration would begin in it, and along which parameters it is
/// halved.
template <class L> struct undecided_part {
  L x, y, half_x, half_y;
  L start_x, start_y;
  bool in_x, in_y;
};

/// The roots of a ray in a part of a patch, to `sink(patch_root)`; those on borders of its parts come more than once.
///
/// Halves the part along the parameters that the plane functions change with, level by level, until Newton's iteration
/// cannot fail in what is left: beside a contact that takes as many levels as it takes for parts to become smaller than
/// the distance between its two roots, with a few parts in each; beside an edge that is one point, parts stay as long
/// as the edge. Where there are more than `most_parts` of them (the ray has a curve in common with the patch), or a
/// part is as narrow as the square root of rounding, or the functions are within rounding all over it, parts are given
/// to the correction as they are. `origin` is relative to the patch's base; lengths are taken times `to_search`, so
/// that no product of them over- or underflows.
template <class L, class Surface, class Sink>
PATCHRT_HD void separate_roots(exact_patch<Surface> const& exact, vec3<L> const& origin, vec3<L> const& direction,
                               L to_search, patch_part<L> const& part, Sink&& sink) {
  constexpr int most_parts = 16;
  using form = surface_form<Surface>;
  vec3<L> n1, n2;
  plane_normals(direction, n1, n2);
  n1 = scale(n1, to_search);
  n2 = scale(n2, to_search);
  projected_patch<L, form::degree_u, form::degree_v> projected =
      project(exact.power, projection_reach(exact.power, origin), origin, n1, n2);
  L const gap = L(largest_gap(exact.gaps));
  projected.gap_f = gap * sum_of_magnitudes(n1);
  projected.gap_g = gap * sum_of_magnitudes(n2);
  L const floor = L(8) * (projected.rounding_f + projected.rounding_g), narrow = L(0x1p-26);
  auto const correct_from = [&](L x, L y) {
    patch_root<L> root{L(0), fma(x, L(0.5), L(0.5)), fma(y, L(0.5), L(0.5)), L(0), true};
    correct(exact.patch, L(exact.size), exact.gaps, origin, direction, root);
    if (root.valid) sink(root);
  };
  undecided_part<L> lists[2][most_parts] = {{{part.x, part.y, part.half_x, part.half_y, part.x, part.y, true, true}}};
  for (int level = 0, size = 1; size > 0; ++level) {
    undecided_part<L> const* const parents = lists[level % 2];
    undecided_part<L>* const next = lists[(level + 1) % 2];
    int count = 0;
    bool is_crowded = false;
    for (int i = 0; i < size; ++i) {
      undecided_part<L> const& parent = parents[i];
      L const half_x = parent.in_x ? parent.half_x * L(0.5) : parent.half_x;
      L const half_y = parent.in_y ? parent.half_y * L(0.5) : parent.half_y;
      for (int k = 0; k < 4; ++k) {
        if ((!parent.in_x && (k & 1)) || (!parent.in_y && (k & 2))) continue;
        L const x = parent.in_x ? parent.x + (k & 1 ? half_x : -half_x) : parent.x;
        L const y = parent.in_y ? parent.y + (k & 2 ? half_y : -half_y) : parent.y;
        cell_verdict<L> const v = examine_cell(projected, x, y, half_x, half_y);
        if (!v.possible) continue;
        is_crowded = is_crowded || count == most_parts;
        if (v.convergent || min(half_x, half_y) < narrow || v.along_x + v.along_y < floor || count == most_parts)
          correct_from(v.x, v.y);
        else
          next[count++] = {
              x, y, half_x, half_y, v.x, v.y, !(L(4) * v.along_x < v.along_y), !(L(4) * v.along_y < v.along_x)};
      }
    }
    size = count;
    if (!is_crowded) continue;
    for (int i = 0; i < count; ++i) correct_from(next[i].start_x, next[i].start_y);
    return;
  }
}

}  // namespace patchrt::detail
