// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// From a root that the search found in float to one that is right to the rounding of the surface itself, and how wrong
/// it can be.

#include <patchrt/shapes/power_patch.hpp>

#include <limits>

namespace patchrt {

/// A point common to a ray and a patch: t in units of |direction|, (u, v) in [0, 1]^2.
///
/// `error` bounds, to first order, the distance in the patch's space between S(u, v) and the point where the exact ray
/// meets the exact patch: what the last step shows to be left, and what rounding of S(u, v) and of the origin does to a
/// ray at this angle. It is infinite where the ray touches the patch and that point cannot be told. Unspecified where
/// not `valid`.
template <scalar T> struct patch_root {
  T t, u, v;
  T error;
  mask_t<T> valid;
};

/// Rows of the inverse of the matrix (S_x, S_y, -direction) at one point: what is left of origin - S beside the ray,
/// times these rows, is a Newton step in (x, y, t).
template <scalar T> struct chord_rows {
  vec3<T> x, y, t;
  T per_cosine;  ///< one over the cosine between ray and normal, infinite where there is no normal
};

/// The rows at a point with tangents p.du = S_x and p.dv = S_y. \pre |direction| is about 1.
template <scalar T> PATCHRT_INLINE chord_rows<T> make_chord_rows(surface_point<T> const& p, vec3<T> const& direction) {
  vec3<T> const across_y = cross(p.dv, direction), across_x = cross(direction, p.du), normal = cross(p.du, p.dv);
  T const inverse = T(1) / dot(normal, direction);
  vec3<T> const along = scale(normal, -inverse);  // and not the normal's square, which a small patch makes underflow
  return {scale(across_y, inverse), scale(across_x, inverse), along,
          min(sqrt(dot(along, along) * dot(direction, direction)), T(std::numeric_limits<lane_t<T>>::infinity()))};
}

namespace detail {
/// Twice the rate at which steps shrink, and 1 at most: what is left after the second step, in units of it.
template <scalar S> PATCHRT_INLINE S rate(S second, S first) {
  using L = lane_t<S>;
  return min(S(L(2)) * (second / max(first, S(std::numeric_limits<L>::min()))), S(L(1)));
}

/// origin - point, split into what is along the direction and what is beside it.
template <scalar S> struct split_chord {
  S along;  // in units of the direction
  vec3<S> beside;
};
template <scalar S>
PATCHRT_INLINE split_chord<S> split_along(vec3<S> const& chord, vec3<S> const& direction, S per_square) {
  S const along = dot(chord, direction) * per_square;
  return {along, fma(-along, direction, chord)};
}
}  // namespace detail

namespace detail {
/// Bounds what rounding does to a point of the patch beside the ray: `rounding` is that of S.
template <scalar S> PATCHRT_INLINE S rounding_beside(vec3<S> const& origin, lane_t<S> rounding) {
  using L = lane_t<S>;
  return fma(S(L(4) * std::numeric_limits<L>::epsilon()), sum_of_magnitudes(origin), S(rounding));
}

/// What a hit may be wrong by where the ray passes S(u, v) within `beside`, give or take `rounding`: both over the
/// cosine between ray and normal.
template <scalar S> PATCHRT_INLINE S error_of(S beside, S rounding, vec3<S> const& normal, vec3<S> const& direction) {
  vec3<S> const unit = scale(normal, S(lane_t<S>(1)) / max(max(abs(normal.x), abs(normal.y)), abs(normal.z)));
  S const cosine = abs(dot(unit, direction)) / sqrt(dot(unit, unit) * dot(direction, direction));
  S const error = (beside + rounding) / cosine;
  return select(error == error, error, S(std::numeric_limits<lane_t<S>>::infinity()));
}
}  // namespace detail

/// What two steps of the chord method did.
template <scalar S> struct chord_steps {
  mask_t<S> settled;
  S length;    ///< of both together, in x or in y, whichever is more
  S rounding;  ///< bounds what rounding does to a point beside the ray
};

/// Two steps of the chord method (Newton's with the Jacobian of the start) from a root's (x, y), in S's precision, on
/// the power form. Settled are the lanes that converged, within the parameter square.
///
/// `rows` are those at the start, in any precision and in a space where lengths are `to_rows` times those here;
/// `rounding` bounds what rounding does to S; `per_square` is one over the direction's squared length. The ratio of the
/// second step to the first is the rate at which steps shrink: ratio times second step estimates what is left, and
/// where that is under 2^-53, or the second step under 2^-50, nothing is that would count beside `rounding`. What is
/// not settled is left to `correct`.
/// \note Kelley, Iterative Methods for Linear and Nonlinear Equations, SIAM 1995, section 5.4.1: the chord method.
template <scalar S, class Power>
PATCHRT_INLINE chord_steps<S> correct_by_chords(Power const& power, lane_t<S> rounding, chord_rows<S> const& rows,
                                                S to_rows, S x, S y, vec3<S> const& origin, vec3<S> const& direction,
                                                S per_square, patch_root<S>& root) {
  using L = lane_t<S>;
  auto const first = detail::split_along(difference(origin, position(power, x, y)), direction, per_square);
  S const first_x = dot(first.beside, rows.x) * to_rows, first_y = dot(first.beside, rows.y) * to_rows;
  x = x + first_x;
  y = y + first_y;
  auto const second = detail::split_along(difference(origin, position(power, x, y)), direction, per_square);
  S const second_x = dot(second.beside, rows.x) * to_rows, second_y = dot(second.beside, rows.y) * to_rows;
  x = x + second_x;
  y = y + second_y;
  S const one(L(1)), half(L(0.5));
  S const before = max(abs(first_x), abs(first_y)), last = max(abs(second_x), abs(second_y));
  root.t = dot(second.beside, rows.t) - second.along;
  root.u = fma(x, half, half);
  root.v = fma(y, half, half);
  S const floor = detail::rounding_beside(origin, rounding);
  root.error = floor * rows.per_cosine;
  auto const settled = (last * last <= before * S(L(0x1p-53)) || last <= S(L(0x1p-50))) && before < S(L(0x1p-6)) &&
                       abs(x) <= one && abs(y) <= one;
  return {settled, before + last, floor};
}

namespace detail {
/// u + du in [0, 1]; where du is no number, or a leap that no Newton step from beside a root is, u.
template <scalar S> PATCHRT_INLINE S step_within(S u, S du) {
  using L = lane_t<S>;
  S const to = select(abs(du) < S(L(4)), u + du, u);
  return min(max(to, S(L(0))), S(L(1)));
}

/// Newton's iteration in (u, v, t) beside a pole, where a whole edge is one point and u (or v) says little until v (or
/// u) is right: starts inside and never goes more than seven eighths of the way to an edge. Gives the lanes whose ray
/// passes S(u, v) within `rounding`.
template <scalar S, class Patch>
PATCHRT_OUTLINE mask_t<S> correct_beside_pole(Patch const& patch, S rounding, vec3<S> const& origin,
                                              vec3<S> const& direction, S& u, S& v, mask_t<S> active) {
  using L = lane_t<S>;
  S const one(L(1)), half(L(0.5)), edge(L(0x1p-10));
  surface_point<S> p = evaluate(patch, u, v);
  auto const is_u_lost = sum_of_magnitudes(p.du) < sum_of_magnitudes(p.dv);
  u = select(active, select(is_u_lost, half, min(max(u, edge), one - edge)), u);
  v = select(active, select(is_u_lost, min(max(v, edge), one - edge), half), v);
  auto found = active && !active;
  for (int step = 0; step < 64 && any_of(active); ++step) {
    p = evaluate(patch, u, v);
    vec3<S> const r = difference(origin, p.position);
    vec3<S> const across_v = cross(p.dv, direction), across_u = cross(direction, p.du);
    S const det = dot(p.du, across_v);
    S const beside = sum_of_magnitudes(difference(r, scale(direction, dot(r, direction) / dot(direction, direction))));
    found = found || (active && beside <= rounding);
    active = active && !found;
    S const du = dot(r, across_v) / det, dv = dot(r, across_u) / det;
    S const most(L(0.875));
    u = select(active && abs(du) < S(L(1e9)), u + min(max(du, -(most * u)), most * (one - u)), u);
    v = select(active && abs(dv) < S(L(1e9)), v + min(max(dv, -(most * v)), most * (one - v)), v);
  }
  return found;
}
}  // namespace detail

namespace detail {
/// Of points on edges, those next to the ray: Gauss and Newton's method along the edge, three steps, for the lanes in
/// `active`.
template <scalar S, class Patch>
PATCHRT_OUTLINE void slide_along_edges(Patch const& patch, vec3<S> const& origin, vec3<S> const& direction,
                                       S per_square, S& u, S& v, mask_t<S> active) {
  using L = lane_t<S>;
  S const zero(L(0)), one(L(1));
  for (int step = 0; step < 3; ++step) {
    surface_point<S> const p = evaluate(patch, u, v);
    vec3<S> const r = split_along(difference(origin, p.position), direction, per_square).beside;
    vec3<S> const du = split_along(p.du, direction, per_square).beside;
    vec3<S> const dv = split_along(p.dv, direction, per_square).beside;
    auto const on_u = active && (u == zero || u == one);
    auto const on_v = active && (v == zero || v == one);
    S const to_v = select(on_u, step_within(v, dot(r, dv) / dot(dv, dv)), v);
    // From a corner along one of its edges, not both.
    u = select(on_v && to_v == v, step_within(u, dot(r, du) / dot(du, du)), u);
    v = to_v;
  }
}
}  // namespace detail

/// How far beyond each edge of a patch its neighbours' edges may be, in the units of its control points: what a ray may
/// pass an edge by and still count as one through it. 0 where the edges are the same curve.
struct edge_gaps {
  double u0 = 0, u1 = 0, v0 = 0, v1 = 0;  ///< at u = 0, u = 1, v = 0, v = 1
};

/// The largest of a patch's gaps.
PATCHRT_INLINE double largest_gap(edge_gaps const& g) { return max(max(g.u0, g.u1), max(g.v0, g.v1)); }

/// Corrects a root's (u, v) on the control points themselves, in S's precision: a Newton step in (u, v, t), then one
/// with the same Jacobian, again until both together have converged; all within [0, 1]^2.
///
/// Solves S(u, v) = origin + t direction by Cramer's rule. The ratio of the second step to the first is the rate at
/// which steps with this Jacobian shrink, so that ratio times second step estimates what is left: where it is under
/// 2^-53, or the second step is under what rounding makes of steps, nothing is, and roots away from grazing end at the
/// rounding of S, about 4 ulp of (patch size + |origin|) over the cosine between ray and normal. Where a step would
/// leave [0,1]^2, or the Jacobian tells it nothing (at a pole, where an edge is one point), or twelve passes do not
/// suffice (the ray grazes, or just misses), the root counts if the ray passes S(u, v) within 32 epsilon of (size +
/// |origin|), which covers S's own rounding, and on an edge, at the edge's point next to the ray, within its gap
/// besides: so a ray through a common edge of two patches finds one of them, and the error covers the neighbour's point
/// (`size` = the largest |coordinate| of the control points).
/// \pre `root` has (u, v) and which lanes are valid; `origin` is relative to the same point as the control points.
template <scalar S, class Patch>
PATCHRT_OUTLINE void correct(Patch const& patch, lane_t<S> size, edge_gaps const& gaps, vec3<S> const& origin,
                             vec3<S> const& direction, patch_root<S>& root) {
  using L = lane_t<S>;
  S const zero(L(0)), one(L(1));
  S const rounding = S(L(32) * std::numeric_limits<L>::epsilon()) * (sum_of_magnitudes(origin) + S(size));
  S const per_square = one / dot(direction, direction);
  S u = min(max(root.u, zero), one), v = min(max(root.v, zero), one);
  auto moving = root.valid;
  auto unsure = moving && !moving;
  S last = zero;
  vec3<S> normal(zero, zero, zero);
  for (int pass = 0; pass < 12 && any_of(moving); ++pass) {
    surface_point<S> const p = evaluate(patch, u, v);
    vec3<S> const across_v = cross(p.dv, direction);
    vec3<S> const across_u = cross(direction, p.du);
    S const inverse = one / dot(p.du, across_v);
    // Without what is along the ray, or its rounding would come into u and v apart from each other, and grow.
    auto left = detail::split_along(difference(origin, p.position), direction, per_square);
    S const first_u = detail::step_within(u, dot(left.beside, across_v) * inverse);
    S const first_v = detail::step_within(v, dot(left.beside, across_u) * inverse);
    left = detail::split_along(difference(origin, position(patch, first_u, first_v)), direction, per_square);
    S const du = dot(left.beside, across_v) * inverse;
    S const dv = dot(left.beside, across_u) * inverse;
    S const second_u = detail::step_within(first_u, du);
    S const second_v = detail::step_within(first_v, dv);
    S const first = max(abs(first_u - u), abs(first_v - v));
    S const second = max(abs(second_u - first_u), abs(second_v - first_v));
    u = select(moving, second_u, u);
    v = select(moving, second_v, v);
    vec3<S> const step = fma(du, p.du, scale(p.dv, dv));
    root.t = select(moving, fma(dot(step, direction), per_square, -left.along), root.t);  // to the corrected point
    last = select(moving, sum_of_magnitudes(step) * detail::rate(second, first), last);
    normal = select(moving, cross(p.du, p.dv), normal);
    unsure = (unsure && !moving) || (moving && !(first_u + du == second_u && first_v + dv == second_v));
    // Steps drown in rounding once the distance from the ray does. What steps say is right only if they account for
    // that distance: they do not where the Jacobian is nearly singular and the ray just misses.
    S const beside = sum_of_magnitudes(left.beside);
    unsure = unsure || (moving && !(beside <= fma(S(L(2)), sum_of_magnitudes(step), rounding)));
    moving =
        moving && S(L(0.25)) * rounding < beside && first * S(L(0x1p-53)) < second * second && S(L(0x1p-50)) < second;
  }
  root.error = detail::error_of(last, rounding, normal, direction);
  // Where a root can be anywhere along a good part of the patch, steps may seem to converge where there is none.
  auto const is_vague = root.valid && !(root.error < S(L(0x1p-8) * size));
  S const vague_error = select(is_vague && !(unsure || moving), root.error, zero);
  unsure = root.valid && (unsure || moving || is_vague);
  if (any_of(unsure)) {
    detail::slide_along_edges(patch, origin, direction, per_square, u, v, unsure);
    surface_point<S> p = evaluate(patch, u, v);
    auto chord = detail::split_along(difference(p.position, origin), direction, per_square);
    auto const at = [&](S parameter, L side, double gap) {
      return select(parameter == S(side), S(static_cast<L>(gap)), zero);
    };
    S const gap = max(max(at(u, L(0), gaps.u0), at(u, L(1), gaps.u1)), max(at(v, L(0), gaps.v0), at(v, L(1), gaps.v1)));
    S const passed_by = sqrt(dot(chord.beside, chord.beside));
    auto found = unsure && passed_by <= rounding + gap;
    // A ray that passes between the edges meets the neighbour, which may be that much farther off.
    S const to_neighbour = select(found && passed_by > rounding, gap, zero);
    auto const at_pole =
        unsure && !found && min(sum_of_magnitudes(p.du), sum_of_magnitudes(p.dv)) < S(L(0x1p-10) * size);
    if (any_of(at_pole)) {
      found = found || detail::correct_beside_pole(patch, rounding, origin, direction, u, v, at_pole);
      chord = detail::split_along(difference(position(patch, u, v), origin), direction, per_square);
    }
    // The normal from inside: at a pole a tangent vanishes.
    S const edge(L(0x1p-20));
    p = evaluate(patch, min(max(u, edge), one - edge), min(max(v, edge), one - edge));
    normal = select(unsure, cross(p.du, p.dv), normal);
    root.t = select(unsure, chord.along, root.t);
    S const error = detail::error_of(sum_of_magnitudes(chord.beside) + to_neighbour, rounding, normal, direction);
    root.error = select(unsure, max(error, vague_error), root.error);
    root.valid = root.valid && (!unsure || found);
  }
  root.u = u;
  root.v = v;
}

}  // namespace patchrt
