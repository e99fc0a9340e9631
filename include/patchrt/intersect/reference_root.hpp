// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The paper's solver, kept as it is so that what it loses can be measured.

#include <patchrt/core/twin_planes.hpp>
#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/roots/newton.hpp>

#include <limits>

namespace patchrt {

/// The paper's solver: Newton's iteration in (u, v) on the ray's two planes, from `root`'s (u, v), on the control
/// points. Gives the number of steps.
///
/// Stops where |R| < eps, on divergence, and after 16 steps; a lane that was stopped by divergence counts where its
/// residual is at the rounding floor all the same. eps is 1e-15 of (patch size + |origin|), and |R| is measured in
/// units of length.
/// \note Nigam & Narayanan 2012, section 3.1, eqs. 2-4. Their eps is an absolute 1e-15, less than an ulp of coordinates above 4.
template <scalar S, class Patch>
PATCHRT_OUTLINE int solve_on_planes(Patch const& patch, lane_t<S> size, vec3<S> const& origin, vec3<S> const& direction,
                                    patch_root<S>& root) {
  using L = lane_t<S>;
  S u = root.u, v = root.v;
  vec3<S> n1, n2;
  S const length = sqrt(dot(direction, direction));
  vec3<S> const unit = scale(direction, S(1) / length);
  plane_normals(unit, n1, n2);
  S const reach = sum_of_magnitudes(origin) + S(size);
  S const eps = S(L(1e-15)) * reach;
  S before(std::numeric_limits<L>::infinity());
  auto moving = root.valid;
  auto converged = moving && !moving;
  vec3<S> chord(S(0), S(0), S(0)), normal = chord;
  int steps = 0;
  for (; steps < 16 && any_of(moving); ++steps) {
    surface_point<S> const p = evaluate(patch, u, v);
    vec3<S> const r = difference(p.position, origin);
    bivariate<S> const b{dot(n1, r), dot(n1, p.du), dot(n1, p.dv), dot(n2, r), dot(n2, p.du), dot(n2, p.dv)};
    S const residual = abs(b.f) + abs(b.g);
    chord = select(moving, r, chord);
    normal = select(moving, cross(p.du, p.dv), normal);
    auto const small = residual < eps;
    converged = converged || (moving && (small || (residual < S(L(64)) * eps && !(residual < before))));
    moving = moving && !small && residual < before;
    scaled_step<S> const s = newton_step(b);
    u = select(moving, u + s.dx / s.det, u);
    v = select(moving, v + s.dy / s.det, v);
    before = residual;
  }
  root.t = dot(chord, direction) / dot(direction, direction);
  root.u = u;
  root.v = v;
  root.error = detail::error_of(before, S(L(32) * std::numeric_limits<L>::epsilon()) * reach, normal, direction);
  root.valid = converged && S(0) <= u && u <= S(1) && S(0) <= v && v <= S(1);
  return steps;
}

}  // namespace patchrt
