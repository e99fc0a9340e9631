// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The ray-patch solver: where a ray meets one cell of a bicubic patch.
///
/// A ray is two planes (core/twin_planes.hpp). Their normals turn the patch into two scalar bicubics once a ray; a cell's
/// linear part then either excludes the cell or starts Newton's iteration in it; the root is corrected on the control points.

#include <patchrt/core/twin_planes.hpp>
#include <patchrt/roots/newton.hpp>
#include <patchrt/shapes/power_patch.hpp>

#include <cstdint>
#include <limits>

namespace patchrt {

/// The signed distances (scaled by |n1|, |n2|) of S(x, y) from a ray's two planes, in powers of x and y, and what rounding may
/// have changed in either, evaluation included.
template <scalar T> struct projected_patch {
  T f[16];
  T g[16];
  T rounding_f;
  T rounding_g;
};

/// Projects `patch` on the planes through `origin` with normals n1 and n2: 96 fused operations a lane.
///
/// `reach` bounds, by coordinate, the sum of the patch's |coefficients| and the origin. A coefficient of S comes into f by up to
/// 12 roundings (its own, 3 of the normal, 3 of the product, 5 to 8 of Horner's rule), 24 half epsilons; 16 epsilon
/// of |n|.reach cover these and the origin's.
template <scalar T, scalar P>
PATCHRT_INLINE projected_patch<T> project(power_patch<P> const& patch, vec3<P> const& reach, vec3<T> const& origin,
                                          vec3<T> const& n1, vec3<T> const& n2) {
  projected_patch<T> p;
  T const unit(16 * std::numeric_limits<lane_t<T>>::epsilon());
  p.rounding_f = unit * dot(absolute(n1), convert_vec<T>(reach));
  p.rounding_g = unit * dot(absolute(n2), convert_vec<T>(reach));
  PATCHRT_UNROLL
  for (int k = 0; k < 16; ++k) {
    vec3<T> const a = convert_vec<T>(patch.coefficients[k]);
    p.f[k] = dot(n1, a);
    p.g[k] = dot(n2, a);
  }
  p.f[0] = p.f[0] - dot(n1, origin);
  p.g[0] = p.g[0] - dot(n2, origin);
  return p;
}

/// Lane i of the result is of lane index[i].
template <scalar T>
PATCHRT_INLINE projected_patch<T> permute(projected_patch<T> const& projected, std::int32_t const* index) {
  projected_patch<T> p;
  PATCHRT_UNROLL
  for (int k = 0; k < 16; ++k) {
    p.f[k] = permute(projected.f[k], index);
    p.g[k] = permute(projected.g[k], index);
  }
  p.rounding_f = permute(projected.rounding_f, index);
  p.rounding_g = permute(projected.rounding_g, index);
  return p;
}

namespace detail {
/// sum a[4k + l] x^k y^l and its derivatives.
template <scalar T> PATCHRT_INLINE void horner(T const (&a)[16], T x, T y, T& value, T& by_x, T& by_y) {
  PATCHRT_UNROLL
  for (int k = 3; k >= 0; --k) {
    T const* const row = a + 4 * k;
    T r = fma(row[3], y, row[2]);
    T d = fma(row[3], y, r);
    r = fma(r, y, row[1]);
    d = fma(d, y, r);
    r = fma(r, y, row[0]);
    by_x = k == 3 ? T(0) : k == 2 ? value : fma(by_x, x, value);
    value = k == 3 ? r : fma(value, x, r);
    by_y = k == 3 ? d : fma(by_y, x, d);
  }
}
}  // namespace detail

/// Both plane functions and their derivatives by x and y at (x, y), by Horner's rule: 56 fused operations.
template <scalar T> PATCHRT_INLINE bivariate<T> evaluate(projected_patch<T> const& p, T x, T y) {
  bivariate<T> b;
  detail::horner(p.f, x, y, b.f, b.fx, b.fy);
  detail::horner(p.g, x, y, b.g, b.gx, b.gy);
  return b;
}

/// A rectangle of the parameter square and how far the patch leaves its tangent plane there.
///
/// The rectangle is |x - x0| <= half_x, |y - y0| <= half_y in centred parameters; `remainder` bounds each coordinate of
/// S(x, y) - S(x0, y0) - (x - x0) S_x(x0, y0) - (y - y0) S_y(x0, y0) over it.
template <scalar T> struct patch_cell {
  T x, y;
  T half_x, half_y;
  vec3<T> remainder;
};

/// Where Newton's iteration begins, and whether there is any need to.
template <scalar T> struct cell_start {
  T x, y;
  mask_t<T> possible;
};

/// The root of the cell's linear part, and the proof, where it holds, that the cell has no root.
///
/// A root in the cell satisfies F(c) + J (p - c) + R = 0 with |R| <= |n|.remainder and what rounding adds, so that |J^-1 F(c)| exceeds the cell's
/// half width by |J^-1| |R| at most; where it exceeds that, `possible` is false. `abs_n1`, `abs_n2` are the planes' normals'
/// magnitudes by component. The start is in the cell.
/// \note The linear exclusion of Toth, "On ray tracing parametric surfaces", SIGGRAPH 1985, with a precomputed remainder in
///       place of interval Jacobians.
template <scalar T>
PATCHRT_INLINE cell_start<T> linear_start(projected_patch<T> const& p, vec3<T> const& abs_n1, vec3<T> const& abs_n2,
                                          patch_cell<T> const& c) {
  bivariate<T> const b = evaluate(p, c.x, c.y);
  scaled_step<T> const s = newton_step(b);
  T const rf = dot(abs_n1, c.remainder) + p.rounding_f;
  T const rg = dot(abs_n2, c.remainder) + p.rounding_g;
  T const det = abs(s.det);
  T const reach_x = fma(det, c.half_x, fma(abs(b.gy), rf, abs(b.fy) * rg));
  T const reach_y = fma(det, c.half_y, fma(abs(b.gx), rf, abs(b.fx) * rg));
  limited_step<T> const step = limit_step(s, c.half_x, c.half_y);
  return {c.x + step.dx, c.y + step.dy, abs(s.dx) <= reach_x && abs(s.dy) <= reach_y};
}

/// What is known of the roots in one cell.
template <scalar T> struct cell_verdict {
  T x, y;                 ///< where Newton's iteration begins
  mask_t<T> possible;     ///< the cell may have a root
  mask_t<T> at_most_one;  ///< it has no second one
  mask_t<T> convergent;   ///< nor can Newton's iteration miss its root, from wherever in the cell
};

namespace detail {
/// The expansion of a plane function about a cell's middle, in units of the cell: what it is there, its slopes, and bounds on
/// what it leaves of its linear part and on what its slopes together change along p and along q.
template <scalar T> struct cell_expansion { T value, by_x, by_y, remainder, x_change, y_change; };

/// c[0] + c[stride] x + ... about `at`, in powers of (x - at) / h.
template <scalar T> PATCHRT_INLINE void shift_cubic(T const* c, int stride, T at, T h, T* out) {
  T const c3 = c[3 * stride];
  T t = fma(c3, at, c[2 * stride]);
  T u = fma(t, at, c[stride]);
  out[0] = fma(u, at, c[0]);
  t = fma(c3, at, t);
  u = fma(t, at, u);
  t = fma(c3, at, t);
  T const h2 = h * h;
  out[stride] = u * h;
  out[2 * stride] = t * h2;
  out[3 * stride] = c3 * (h2 * h);
}

template <scalar T>
PATCHRT_OUTLINE void expand_cell(T const (&a)[16], T const& rounding, T const& x, T const& y, T const& half_x,
                                 T const& half_y, cell_expansion<T>& e) {
  T rows[16], b[16];
  PATCHRT_UNROLL
  for (int k = 0; k < 4; ++k) shift_cubic(a + 4 * k, 1, y, half_y, rows + 4 * k);
  PATCHRT_UNROLL
  for (int l = 0; l < 4; ++l) shift_cubic(rows + l, 4, x, half_x, b + l);
  e = {b[0], b[4], b[1], rounding, T(0), T(0)};
  PATCHRT_UNROLL
  for (int k = 0; k < 4; ++k) PATCHRT_UNROLL
  for (int l = 0; l < 4; ++l) {
    if (k + l < 2) continue;
    T const m = abs(b[4 * k + l]);
    e.remainder = e.remainder + m;
    if (k > 0) e.x_change = fma(T(lane_t<T>(k)), m, e.x_change);
    if (l > 0) e.y_change = fma(T(lane_t<T>(l)), m, e.y_change);
  }
}
}  // namespace detail

/// Excludes a cell, or shows that it has one root at most, from the two plane functions' own expansion about its middle.
///
/// With F = sum b_kl p^k q^l, |p|, |q| <= 1 over the cell, what F leaves of its linear part is at most the sum of the other
/// |b_kl| and what rounding adds, and the Jacobian's change at most the sums of k |b_kl| and l |b_kl|. Multiplied by the Jacobian's adjoint in the middle,
/// the first gives exclusion as in `linear_start`, multiplied by its transpose one that works where it is singular; the second
/// gives a P-matrix, hence an injective map, where (|det| - e11) (|det| - e22) > e12 e21 with both factors positive; where
/// both row sums of e are under |det| / 4, no two Jacobians of the cell differ by more than 2/3 of either, relatively, and Newton
/// steps shrink the distance to the root by that. About 280 operations.
/// \note Gale & Nikaido, "The Jacobian matrix and global univalence of mappings", Math. Ann. 159, 1965, theorem 4.
template <scalar T>
PATCHRT_INLINE cell_verdict<T> examine_cell(projected_patch<T> const& p, T x, T y, T half_x, T half_y) {
  detail::cell_expansion<T> f, g;
  detail::expand_cell(p.f, p.rounding_f, x, y, half_x, half_y, f);
  detail::expand_cell(p.g, p.rounding_g, x, y, half_x, half_y, g);
  scaled_step<T> const s = newton_step(bivariate<T>{f.value, f.by_x, f.by_y, g.value, g.by_x, g.by_y});
  T const det = abs(s.det);
  T const fx = abs(f.by_x), fy = abs(f.by_y), gx = abs(g.by_x), gy = abs(g.by_y);
  auto const outside_x = abs(s.dx) > det + fma(gy, f.remainder, fy * g.remainder);
  auto const outside_y = abs(s.dy) > det + fma(gx, f.remainder, fx * g.remainder);
  // J^T F: what is left to be said where both rows of the adjoint point the same way.
  T const mixed = abs(fma(f.by_x, f.by_y, g.by_x * g.by_y));
  auto const beyond_x =
      abs(fma(f.by_x, f.value, g.by_x * g.value)) > mixed + fma(fx, fx + f.remainder, gx * (gx + g.remainder));
  auto const beyond_y =
      abs(fma(f.by_y, f.value, g.by_y * g.value)) > mixed + fma(fy, fy + f.remainder, gy * (gy + g.remainder));
  T const a = det - fma(gy, f.x_change, fy * g.x_change);
  T const b = fma(gy, f.y_change, fy * g.y_change);
  T const c = fma(gx, f.x_change, fx * g.x_change);
  T const d = det - fma(gx, f.y_change, fx * g.y_change);
  cell_verdict<T> v;
  v.possible = !(outside_x || outside_y || beyond_x || beyond_y);
  v.at_most_one = T(0) < a && T(0) < d && b * c < a * d;
  T const quarter = T(lane_t<T>(0.25)) * det;
  v.convergent = (det - a) + b < quarter && c + (det - d) < quarter;
  limited_step<T> const step = limit_step(s, T(1), T(1));
  v.x = fma(step.dx, half_x, x);
  v.y = fma(step.dy, half_y, y);
  return v;
}

/// Newton's iterate, how far rounding may have moved it (to first order), the lanes that converged, and the steps that were taken.
template <scalar T> struct newton_result {
  T x, y;
  T error_x, error_y;
  mask_t<T> converged;
  int steps;
};

/// Newton's iteration on the two plane functions from (x, y), for the lanes in `active`.
///
/// A lane has converged after a step shorter than `tolerance` in both parameters, which leaves an error of the order of
/// tolerance^2, or where both functions are no more than their rounding: there only a short step is taken. It is given up when it has left |x|, |y| < 1.5
/// or after `max_steps`. Steps are limited to (limit_x, limit_y). Errors are |J^-1| times the functions' rounding, with the last J.
template <scalar T>
PATCHRT_INLINE newton_result<T> newton(projected_patch<T> const& p, T x, T y, T limit_x, T limit_y, mask_t<T> active,
                                       lane_t<T> tolerance, int max_steps) {
  T const eps(tolerance);
  auto converged = active && !active;
  T error_x(0), error_y(0), det(1);  // errors times |det|
  int steps = 0;
  while (steps < max_steps && any_of(active)) {
    bivariate<T> const b = evaluate(p, x, y);
    scaled_step<T> const s = newton_step(b);
    limited_step<T> const step = limit_step(s, limit_x, limit_y);
    auto const at_root = abs(b.f) <= p.rounding_f && abs(b.g) <= p.rounding_g;
    auto const is_short = abs(step.dx) < eps && abs(step.dy) < eps;
    auto const moving = active && (is_short || !at_root);
    x = select(moving, x + step.dx, x);
    y = select(moving, y + step.dy, y);
    det = select(active, abs(s.det), det);
    error_x = select(active, fma(abs(b.gy), p.rounding_f, abs(b.fy) * p.rounding_g), error_x);
    error_y = select(active, fma(abs(b.gx), p.rounding_f, abs(b.fx) * p.rounding_g), error_y);
    converged = converged || (active && (is_short || at_root));
    T const away(lane_t<T>(1.5));
    active = active && !converged && abs(x) < away && abs(y) < away;
    ++steps;
  }
  T const least = max(det, T(std::numeric_limits<lane_t<T>>::min()));
  return {x, y, error_x / least, error_y / least, converged, steps};
}

/// A point common to a ray and a patch: t in units of |direction|, (u, v) in [0, 1]^2, `residual` the last correction's length
/// in units of the patch's space: about the error before it, and so more than the error after it unless the ray grazes. Unspecified
/// where not `valid`.
template <scalar T> struct patch_root {
  T t, u, v;
  T residual;
  mask_t<T> valid;
};

namespace detail {
/// u + du in [0, 1]; where du is no number, or a leap that no Newton step from beside a root is, u.
template <scalar S> PATCHRT_INLINE S step_within(S u, S du) {
  using L = lane_t<S>;
  S const to = select(abs(du) < S(L(4)), u + du, u);
  return min(max(to, S(L(0))), S(L(1)));
}
template <scalar S> PATCHRT_INLINE S sum_of_magnitudes(vec3<S> const& a) { return abs(a.x) + abs(a.y) + abs(a.z); }
}  // namespace detail

namespace detail {
/// Newton's iteration in (u, v, t) beside a pole, where a whole edge is one point and u (or v) says little until v (or u) is
/// right: starts inside and never goes more than seven eighths of the way to an edge. Gives the lanes whose ray passes S(u, v)
/// within `rounding`.
template <scalar S, scalar P>
PATCHRT_OUTLINE mask_t<S> correct_beside_pole(bicubic_patch<P> const& patch, S rounding, vec3<S> const& origin,
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

/// Corrects a root's (u, v) on the control points themselves, in S's precision: a Newton step in (u, v, t), then one with the same
/// Jacobian, again until both together have converged; all within [0, 1]^2.
///
/// Solves S(u, v) = origin + t direction by Cramer's rule. The ratio of the second step to the first is the rate at which
/// steps with this Jacobian shrink, so that ratio times second step estimates what is left: where it is under 2^-53, or the
/// second step is under what rounding makes of steps, nothing is, and roots away from grazing end at the rounding of S,
/// about 4 ulp of (patch size + |origin|) over the cosine between ray and normal. Where a step would leave [0,1]^2, or the
/// Jacobian tells it nothing (at a pole, where an edge is one point), or twelve passes do not suffice (the ray grazes, or
/// just misses), the root counts if the ray passes S(u, v) within 32 epsilon of (size + |origin|), which covers S's own
/// rounding: so a ray through a common edge of two patches finds one of them (`size` = the largest |coordinate| of the
/// control points).
/// \pre `root` has (u, v) and which lanes are valid; `origin` is relative to the same point as the control points.
template <scalar S, scalar P>
PATCHRT_OUTLINE void correct(bicubic_patch<P> const& patch, lane_t<S> size, vec3<S> const& origin,
                             vec3<S> const& direction, patch_root<S>& root) {
  using L = lane_t<S>;
  S const rounding = S(L(32) * std::numeric_limits<L>::epsilon()) * (detail::sum_of_magnitudes(origin) + S(size));
  S u = min(max(root.u, S(L(0))), S(L(1))), v = min(max(root.v, S(L(0))), S(L(1)));
  auto moving = root.valid;
  auto unsure = moving && !moving, blind = unsure;
  for (int pass = 0; pass < 12 && any_of(moving); ++pass) {
    surface_point<S> const p = evaluate(patch, u, v);
    vec3<S> const across_v = cross(p.dv, direction);
    vec3<S> const across_u = cross(direction, p.du);
    S const inverse = S(1) / dot(p.du, across_v);
    vec3<S> r = difference(origin, p.position);
    S const first_u = detail::step_within(u, dot(r, across_v) * inverse);
    S const first_v = detail::step_within(v, dot(r, across_u) * inverse);
    r = difference(origin, position(patch, first_u, first_v));
    S const du = dot(r, across_v) * inverse;
    S const dv = dot(r, across_u) * inverse;
    S const second_u = detail::step_within(first_u, du);
    S const second_v = detail::step_within(first_v, dv);
    S const first = max(abs(first_u - u), abs(first_v - v));
    S const second = max(abs(second_u - first_u), abs(second_v - first_v));
    u = select(moving, second_u, u);
    v = select(moving, second_v, v);
    vec3<S> const step = fma(du, p.du, scale(p.dv, dv));
    root.t = select(moving, dot(difference(step, r), direction), root.t);  // to the corrected point
    root.residual = select(moving, detail::sum_of_magnitudes(step), root.residual);
    unsure = (unsure && !moving) || (moving && !(first_u + du == second_u && first_v + dv == second_v));
    S const leap(L(4));
    blind = (blind && !moving) || (moving && !(abs(du) < leap && abs(dv) < leap));
    S const noise = rounding * abs(inverse) * S(L(0.125));  // of a step, over |across_v| or |across_u|
    auto const is_noise = abs(du) <= noise * detail::sum_of_magnitudes(across_v) &&
                          abs(dv) <= noise * detail::sum_of_magnitudes(across_u);
    moving = moving && !is_noise && first * S(L(0x1p-53)) < second * second && S(L(0x1p-50)) < second;
  }
  S const squared = dot(direction, direction);
  unsure = (unsure || moving) && root.valid;
  if (any_of(unsure)) {
    auto const beside = [&](vec3<S> const& chord) {
      return detail::sum_of_magnitudes(difference(chord, scale(direction, dot(chord, direction) / squared)));
    };
    surface_point<S> const p = evaluate(patch, u, v);
    vec3<S> chord = difference(p.position, origin);
    auto at_root = unsure && beside(chord) <= rounding;
    auto const at_pole = unsure && !at_root &&
                         min(detail::sum_of_magnitudes(p.du), detail::sum_of_magnitudes(p.dv)) < S(L(0x1p-10) * size);
    if (any_of(at_pole)) {
      at_root = at_root || detail::correct_beside_pole(patch, rounding, origin, direction, u, v, at_pole);
      chord = difference(position(patch, u, v), origin);
    }
    root.t = select((unsure && blind) || at_pole, dot(chord, direction), root.t);
    root.residual = select(unsure, beside(chord), root.residual);
    root.valid = root.valid && (!unsure || at_root);
  }
  root.t = root.t / squared;
  root.u = u;
  root.v = v;
}

/// The paper's solver: Newton's iteration in (u, v) on the ray's two planes, from `root`'s (u, v), on the control points.
/// Gives the number of steps.
///
/// Stops where |R| < eps, on divergence, and after 16 steps; a lane that was stopped by divergence counts where its residual is
/// at the rounding floor all the same. eps is 1e-15 of (patch size + |origin|), and |R| is measured in units of length.
/// \note Nigam & Narayanan 2012, section 3.1, eqs. 2-4. Their eps is an absolute 1e-15, less than an ulp of coordinates above 4.
template <scalar S, scalar P>
PATCHRT_OUTLINE int solve_on_planes(bicubic_patch<P> const& patch, lane_t<S> size, vec3<S> const& origin,
                                    vec3<S> const& direction, patch_root<S>& root) {
  using L = lane_t<S>;
  S u = root.u, v = root.v;
  vec3<S> n1, n2;
  S const length = sqrt(dot(direction, direction));
  vec3<S> const unit = scale(direction, S(1) / length);
  plane_normals(unit, n1, n2);
  S const eps = S(L(1e-15)) * (abs(origin.x) + abs(origin.y) + abs(origin.z) + S(size));
  S before(std::numeric_limits<L>::infinity());
  auto moving = root.valid;
  auto converged = moving && !moving;
  vec3<S> chord(S(0), S(0), S(0));
  int steps = 0;
  for (; steps < 16 && any_of(moving); ++steps) {
    surface_point<S> const p = evaluate(patch, u, v);
    vec3<S> const r = difference(p.position, origin);
    bivariate<S> const b{dot(n1, r), dot(n1, p.du), dot(n1, p.dv), dot(n2, r), dot(n2, p.du), dot(n2, p.dv)};
    S const residual = abs(b.f) + abs(b.g);
    chord = select(moving, r, chord);
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
  root.residual = before;
  root.valid = converged && S(0) <= u && u <= S(1) && S(0) <= v && v <= S(1);
  return steps;
}

}  // namespace patchrt
