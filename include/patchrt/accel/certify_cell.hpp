// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What the certified level asks of one ray and one cell of a patch: that a root exists, and what roots there are at
/// all.

#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/roots/isolate.hpp>

#include <limits>

namespace patchrt::detail {

/// Whether a root is proved to be where the chord method ended, alone within twice the length of its steps.
///
/// With A the rows and L = exact.bend, the map p -> p - A F(p) has a derivative of at most q = b (L |p - p0| + 2^-18
/// slope) at p, b the larger sum of magnitudes of A's rows x and y: |I - A J(p)| <= |A| |J(p) - J(p0)| + |I - A J(p0)|,
/// the last from rows in float. The steps, and b times rounding, are the residual; where q < 1/8 over twice their
/// length, the map contracts the ball of that radius into itself.
/// \note Kantorovich's theorem in the simplified form: Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 2.1.
template <scalar S, class Surface>
PATCHRT_INLINE mask_t<S> is_proved(exact_patch<Surface> const& exact, chord_rows<S> const& rows, S to_rows,
                                   chord_steps<S> const& steps) {
  using L = lane_t<S>;
  S const inverse = max(sum_of_magnitudes(rows.x), sum_of_magnitudes(rows.y));
  S const radius = S(L(2)) * fma(inverse * to_rows, steps.rounding, steps.length);
  return inverse * fma(S(L(exact.bend)), radius, S(L(0x1p-18 * exact.slope))) < S(L(0.125));
}

/// Whether a ray that passes an edge's point S(u, v) is proved to meet the patch there once, or its continuation just
/// beyond the edge.
///
/// With A the rows in (u, v, t) at the point, the root is within A times the distance beside the ray and what rounding
/// adds; where A bend times twice that is under 1/8, the Jacobian changes by that much of itself on the way, at most,
/// and there is one.
template <scalar S, class Surface>
PATCHRT_HD mask_t<S> is_proved_on_edge(exact_patch<Surface> const& exact, vec3<S> const& origin,
                                       vec3<S> const& direction, S u, S v, S to_rows) {
  using L = lane_t<S>;
  surface_point<S> const p = evaluate(exact.patch, u, v);
  chord_rows<S> const rows = make_chord_rows(p, direction);
  S const inverse = S(L(2)) * max(sum_of_magnitudes(rows.x), sum_of_magnitudes(rows.y));
  S const per_square = S(L(1)) / dot(direction, direction);
  vec3<S> const beside = split_along(difference(origin, p.position), direction, per_square).beside;
  S const radius = S(L(2)) * inverse * (sum_of_magnitudes(beside) + rounding_beside(origin, L(exact.rounding)));
  return inverse * S(L(exact.bend)) * radius < S(L(0.125)) * to_rows && radius < S(L(0x1p-6));
}

/// A place where a ray meets a cell, or may.
template <class L> struct certified_root {
  patch_root<L> root;  ///< valid where it counts as a hit
  root_kind kind;
  L earliest;  ///< no root of this place is at a smaller t
};

/// The plane functions of a ray on the control points, exact up to their errors.
///
/// A coefficient w n.(p - o) has an error of epsilon |n| (|p| + |o|) from the difference, three roundings in the
/// product and one by the weight, and n2 is across the direction up to two: under 8 epsilon |n| (|p| + |o|) together;
/// weights are under 1.
template <class L, class Surface>
PATCHRT_HD auto plane_functions(exact_patch<Surface> const& exact, vec3<L> const& origin, vec3<L> const& direction) {
  using form = surface_form<Surface>;
  vec3<L> n1, n2;
  plane_normals(direction, n1, n2);
  bernstein_pair<L, form::degree_u, form::degree_v> pair;
  for (int k = 0; k < form::points; ++k) {
    vec3<L> const a = difference(control_point(exact.patch, k), origin);
    L const w = weight(exact.patch, k);
    pair.f[k] = w * dot(n1, a);
    pair.g[k] = w * dot(n2, a);
  }
  L const unit = L(8) * std::numeric_limits<L>::epsilon() * (sum_of_magnitudes(origin) + L(3) * L(exact.size));
  pair.error_f = unit * sum_of_magnitudes(n1);
  pair.error_g = unit * sum_of_magnitudes(n2);
  return pair;
}

/// All roots of a ray in a cell, and all places that may be roots, to `sink(certified_root)`, the latter several times;
/// `origin` is relative to the patch's base, t in units of `direction`, whose largest component is in [1, 2).
template <class L, class Surface, class Sink>
PATCHRT_HD void certify_cell(exact_patch<Surface> const& exact, vec3<L> const& origin, vec3<L> const& direction,
                             patch_cell<float> const& cell, Sink&& sink) {
  auto const low = [](float at, float half) { return max(fma(L(at) - L(half), L(0.5), L(0.5)), L(0)); };
  auto const high = [](float at, float half) { return min(fma(L(at) + L(half), L(0.5), L(0.5)), L(1)); };
  isolate_options<L> options;
  options.domain = {low(cell.x, cell.half_x), high(cell.x, cell.half_x), low(cell.y, cell.half_y),
                    high(cell.y, cell.half_y)};
  // Wider than that in a cell, roots are a curve.
  options.widest_multiple = L(0x1p-5) * max(L(cell.half_x), L(cell.half_y));
  auto const all = isolate(plane_functions(exact, origin, direction), options);
  L const per_square = L(1) / dot(direction, direction);
  for (int k = 0; k < all.count; ++k) {
    auto const& place = all.roots[k];
    certified_root<L> found;
    found.kind = place.kind;
    L const u = min(max(place.u, L(0)), L(1)), v = min(max(place.v, L(0)), L(1));
    surface_point<L> const p = evaluate(exact.patch, u, v);
    L const spread = fma(place.radius_u, sum_of_magnitudes(p.du), place.radius_v * sum_of_magnitudes(p.dv));
    found.earliest = fma(dot(difference(p.position, origin), direction), per_square, -(L(2) * spread));
    if (place.kind == root_kind::simple) {
      found.root = {L(0), place.u, place.v, L(0), true};
      correct(exact.patch, L(exact.size), exact.gaps, origin, direction, found.root);
      // The root is in the place's box, whatever the correction made of it; on an edge it decides whether the ray
      // counts as through it.
      bool const is_inside =
          place.radius_u < min(place.u, L(1) - place.u) && place.radius_v < min(place.v, L(1) - place.v);
      L off_u = abs(found.root.u - place.u), off_v = abs(found.root.v - place.v);
      if (is_inside && !(found.root.valid && off_u <= place.radius_u && off_v <= place.radius_v)) {
        found.root = {dot(difference(p.position, origin), direction) * per_square, u, v, L(0), true};
        off_u = off_v = L(0);
      }
      L const off =
          fma(off_u + place.radius_u, sum_of_magnitudes(p.du), (off_v + place.radius_v) * sum_of_magnitudes(p.dv));
      found.root.error = L(2) * (off + L(exact.rounding));
      sink(found);
      continue;
    }
    // Two roots that cannot be told apart are on two sides of the place's middle: what Newton's method makes of it
    // counts.
    for (int start = 0; start < 5; ++start) {
      L const side_u = start == 4 ? L(0) : start & 1 ? place.radius_u : -place.radius_u;
      L const side_v = start == 4 ? L(0) : start & 2 ? place.radius_v : -place.radius_v;
      found.root = {L(0), place.u + side_u, place.v + side_v, L(0), true};
      correct(exact.patch, L(exact.size), exact.gaps, origin, direction, found.root);
      found.root.error = L(2) * found.root.error;
      sink(found);
    }
  }
}

}  // namespace patchrt::detail
