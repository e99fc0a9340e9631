// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/intersect/ray_patch.hpp>
#include <patchrt/intersect/reference_root.hpp>

namespace patchrt::test {

/// The ray-patch solver, all of its steps: projection, both ways of excluding a cell or starting in it, Newton's
/// iteration, both corrections, and the paper's solver.
///
/// Ray i meets cell i of patch i; `powers` are the patches in power form. What a step leaves unspecified is written
/// as 0.
template <class T> struct solve_kernel {
  static constexpr int outputs = 28;
  power_patch<T> const* powers;
  bicubic_patch<T> const* patches;
  patch_cell<T> const* cells;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    patch_cell<T> const& cell = cells[i];
    vec3<T> n1, n2;
    plane_normals(r.direction, n1, n2);
    vec3<T> const reach = sum(coefficient_sum(powers[i]), absolute(r.origin));
    projected_patch<T> const projected = project(powers[i], reach, r.origin, n1, n2);
    cell_start<T> const start = linear_start(projected, absolute(n1), absolute(n2), cell);
    cell_verdict<T> const verdict = examine_cell(projected, cell.x, cell.y, cell.half_x, cell.half_y);
    newton_result<T> const n = newton(projected, start.x, start.y, T(0.5), T(0.5), start.possible, T(0x1p-12), 8);
    patch_root<T> root{T(0), fma(n.x, T(0.5), T(0.5)), fma(n.y, T(0.5), T(0.5)), T(0), n.converged};
    correct(patches[i], T(2), edge_gaps(), r.origin, r.direction, root);
    surface_point<T> const p = evaluate(powers[i], n.x, n.y);
    patch_root<T> by_chords;
    auto const steps_taken = correct_by_chords(powers[i], T(0), make_chord_rows(p, r.direction), T(1), n.x, n.y,
                                               r.origin, r.direction, T(1) / dot(r.direction, r.direction), by_chords);
    by_chords.valid = n.converged && steps_taken.settled;
    patch_root<T> reference{T(0), T(0.5), T(0.5), T(0), start.possible};
    int const steps = solve_on_planes(patches[i], T(2), r.origin, r.direction, reference);
    T const zero(0);
    T* y = out + outputs * i;
    *y++ = T(start.possible);
    *y++ = start.possible ? start.x : zero;
    *y++ = start.possible ? start.y : zero;
    *y++ = T(verdict.possible);
    *y++ = T(verdict.at_most_one);
    *y++ = T(verdict.convergent);
    *y++ = verdict.at_most_one ? verdict.x : zero;
    *y++ = verdict.at_most_one ? verdict.y : zero;
    *y++ = T(n.converged);
    *y++ = n.converged ? n.x : zero;
    *y++ = n.converged ? n.y : zero;
    *y++ = T(n.steps);
    *y++ = T(steps);
    store(by_chords, store(reference, store(root, y)));
  }

 private:
  PATCHRT_HD static T* store(patch_root<T> const& root, T* y) {
    T const zero(0);
    *y++ = T(root.valid);
    *y++ = root.valid ? root.t : zero;
    *y++ = root.valid ? root.u : zero;
    *y++ = root.valid ? root.v : zero;
    *y++ = root.valid ? root.error : zero;
    return y;
  }
};

}  // namespace patchrt::test
