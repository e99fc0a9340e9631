// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The ray-patch solver: where a ray meets one cell of a Bezier patch.
///
/// A ray is two planes (core/twin_planes.hpp). Their normals turn the patch into two scalar bicubics once a ray; a
/// cell's linear part then either excludes the cell or starts Newton's iteration in it. `correct_root.hpp` takes its
/// result further.

#include <patchrt/core/twin_planes.hpp>
#include <patchrt/roots/newton.hpp>
#include <patchrt/shapes/rational_power.hpp>

#include <cstdint>
#include <limits>

namespace patchrt {

/// The signed distances (scaled by |n1|, |n2|) of S(x, y) from a ray's two planes, in powers of x and y, and what
/// rounding may have changed in either, evaluation included.
template <scalar T, int M = 3, int N = 3> struct projected_patch {
  T f[(M + 1) * (N + 1)];
  T g[(M + 1) * (N + 1)];
  T rounding_f;
  T rounding_g;
  T gap_f = T(0);  ///< as much more may either function have at a point that still counts: see `edge_gaps`
  T gap_g = T(0);
};

/// Projects `patch` on the planes through `origin` with normals n1 and n2: 96 fused operations a lane for a bicubic.
///
/// `reach` bounds, by coordinate, the sum of the patch's |coefficients| and the origin. A coefficient of S comes into f
/// by up to M + N + 6 roundings (its own, 3 of the normal, 3 of the product, M + N - 1 to M + N + 2 of Horner's rule),
/// each half an epsilon; M + N + 10 epsilon of |n|.reach cover twice these, and the origin's.
template <scalar T, scalar P, int M, int N>
PATCHRT_INLINE projected_patch<T, M, N> project(power_patch<P, M, N> const& patch, vec3<P> const& reach,
                                                vec3<T> const& origin, vec3<T> const& n1, vec3<T> const& n2) {
  projected_patch<T, M, N> p;
  T const unit((M + N + 10) * std::numeric_limits<lane_t<T>>::epsilon());
  p.rounding_f = unit * dot(absolute(n1), convert_vec<T>(reach));
  p.rounding_g = unit * dot(absolute(n2), convert_vec<T>(reach));
  PATCHRT_UNROLL
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    vec3<T> const a = convert_vec<T>(patch.coefficients[k]);
    p.f[k] = dot(n1, a);
    p.g[k] = dot(n2, a);
  }
  p.f[0] = p.f[0] - dot(n1, origin);
  p.g[0] = p.g[0] - dot(n2, origin);
  return p;
}

/// The same of a rational patch, times its denominator: polynomials with the same roots. `reach` bounds the sum of the
/// numerator's |coefficients|, and of the weights' times the origin.
template <scalar T, scalar P, int M, int N>
PATCHRT_INLINE projected_patch<T, M, N> project(rational_power_patch<P, M, N> const& patch, vec3<P> const& reach,
                                                vec3<T> const& origin, vec3<T> const& n1, vec3<T> const& n2) {
  projected_patch<T, M, N> p;
  T const unit((M + N + 12) * std::numeric_limits<lane_t<T>>::epsilon());
  p.rounding_f = unit * dot(absolute(n1), convert_vec<T>(reach));
  p.rounding_g = unit * dot(absolute(n2), convert_vec<T>(reach));
  T const at_f = -dot(n1, origin), at_g = -dot(n2, origin);
  PATCHRT_UNROLL
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    vec3<T> const a = convert_vec<T>(patch.coefficients[k].point);
    T const w = convert<T>(patch.coefficients[k].weight);
    p.f[k] = fma(at_f, w, dot(n1, a));
    p.g[k] = fma(at_g, w, dot(n2, a));
  }
  return p;
}

/// Lane i of the result is of lane index[i].
template <scalar T, int M, int N>
PATCHRT_INLINE projected_patch<T, M, N> permute(projected_patch<T, M, N> const& projected, std::int32_t const* index) {
  projected_patch<T, M, N> p;
  PATCHRT_UNROLL
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    p.f[k] = permute(projected.f[k], index);
    p.g[k] = permute(projected.g[k], index);
  }
  p.rounding_f = permute(projected.rounding_f, index);
  p.rounding_g = permute(projected.rounding_g, index);
  p.gap_f = permute(projected.gap_f, index);
  p.gap_g = permute(projected.gap_g, index);
  return p;
}

/// Both plane functions and their derivatives by x and y at (x, y), by Horner's rule: 56 fused operations for a
/// bicubic.
template <scalar T, int M, int N> PATCHRT_INLINE bivariate<T> evaluate(projected_patch<T, M, N> const& p, T x, T y) {
  bivariate<T> b;
  detail::horner<M, N>([&](int k, int l) PATCHRT_INLINE_LAMBDA { return p.f[(N + 1) * k + l]; }, x, y, b.f, b.fx, b.fy);
  detail::horner<M, N>([&](int k, int l) PATCHRT_INLINE_LAMBDA { return p.g[(N + 1) * k + l]; }, x, y, b.g, b.gx, b.gy);
  return b;
}

/// A rectangle of the parameter square and how far the patch leaves its tangent plane there.
///
/// The rectangle is |x - x0| <= half_x, |y - y0| <= half_y in centred parameters; `remainder` bounds each coordinate of
/// S(x, y) - S(x0, y0) - (x - x0) S_x(x0, y0) - (y - y0) S_y(x0, y0) over it; of a rational patch, of that for its
/// numerator and its denominator times any origin.
template <scalar T> struct patch_cell {
  T x, y;
  T half_x, half_y;
  vec3<T> remainder;
};

/// Where Newton's iteration begins, and whether there is any need to.
template <scalar T> struct cell_start {
  T x, y;
  mask_t<T> possible;
  mask_t<T> mirrored;  ///< the Jacobian's determinant is negative in the cell's middle
};

/// The root of the cell's linear part, and the proof, where it holds, that the cell has no root.
///
/// A root in the cell satisfies F(c) + J (p - c) + R = 0 with |R| <= |n|.remainder and what rounding adds, so that
/// |J^-1 F(c)| exceeds the cell's half width by |J^-1| |R| at most; where it exceeds that, `possible` is false.
/// `abs_n1`, `abs_n2` are the planes' normals' magnitudes by component. The start is in the cell.
/// \note The linear exclusion of Toth, "On ray tracing parametric surfaces", SIGGRAPH 1985, with a precomputed remainder in
///       place of interval Jacobians.
template <scalar T, int M, int N>
PATCHRT_INLINE cell_start<T> linear_start(projected_patch<T, M, N> const& p, vec3<T> const& abs_n1,
                                          vec3<T> const& abs_n2, patch_cell<T> const& c) {
  bivariate<T> const b = evaluate(p, c.x, c.y);
  scaled_step<T> const s = newton_step(b);
  T const rf = dot(abs_n1, c.remainder) + (p.rounding_f + p.gap_f);
  T const rg = dot(abs_n2, c.remainder) + (p.rounding_g + p.gap_g);
  T const det = abs(s.det);
  T const reach_x = fma(det, c.half_x, fma(abs(b.gy), rf, abs(b.fy) * rg));
  T const reach_y = fma(det, c.half_y, fma(abs(b.gx), rf, abs(b.fx) * rg));
  limited_step<T> const step = limit_step(s, c.half_x, c.half_y);
  return {c.x + step.dx, c.y + step.dy, abs(s.dx) <= reach_x && abs(s.dy) <= reach_y, s.det < T(0)};
}

/// What is known of the roots in one cell.
template <scalar T> struct cell_verdict {
  T x, y;                 ///< where Newton's iteration begins
  mask_t<T> possible;     ///< the cell may have a root
  mask_t<T> at_most_one;  ///< it has no second one
  mask_t<T> convergent;   ///< nor can Newton's iteration miss its root, from wherever in the cell
  mask_t<T> mirrored;     ///< the Jacobian's determinant is negative in its middle
  T along_x, along_y;     ///< bounds what both functions together change along half the cell's width, and its height
};

namespace detail {
/// The expansion of a plane function about a cell's middle, in units of the cell: what it is there, its slopes, and
/// bounds on what it leaves of its linear part and on what its slopes together change along p and along q.
template <scalar T> struct cell_expansion { T value, by_x, by_y, remainder, x_change, y_change; };

/// c[0] + c[stride] x + ... + c[N stride] x^N in powers of (x - at) / h, by Horner's scheme.
template <int N, scalar T> PATCHRT_INLINE void shift_powers(T* c, int stride, T at, T h) {
  PATCHRT_UNROLL
  for (int k = 0; k < N; ++k) PATCHRT_UNROLL
  for (int i = N - 1; i >= k; --i) c[i * stride] = fma(c[(i + 1) * stride], at, c[i * stride]);
  T power = h;
  PATCHRT_UNROLL
  for (int k = 1; k <= N; ++k) {
    c[k * stride] = c[k * stride] * power;
    if (k < N) power = power * h;
  }
}

template <int M, int N, scalar T>
PATCHRT_OUTLINE void expand_cell(T const* a, T const& rounding, T const& gap, T const& x, T const& y, T const& half_x,
                                 T const& half_y, cell_expansion<T>& e) {
  T b[(M + 1) * (N + 1)];
  PATCHRT_UNROLL
  for (int k = 0; k < (M + 1) * (N + 1); ++k) b[k] = a[k];
  PATCHRT_UNROLL
  for (int k = 0; k <= M; ++k) shift_powers<N>(b + (N + 1) * k, 1, y, half_y);
  PATCHRT_UNROLL
  for (int l = 0; l <= N; ++l) shift_powers<M>(b + l, N + 1, x, half_x);
  T const slack = T(lane_t<T>(M + N)) * rounding;  // of slopes, a cell being no wider than the square
  e = {b[0], b[N + 1], b[1], rounding + gap, slack, slack};
  PATCHRT_UNROLL
  for (int k = 0; k <= M; ++k) PATCHRT_UNROLL
  for (int l = 0; l <= N; ++l) {
    if (k + l < 2) continue;
    T const m = abs(b[(N + 1) * k + l]);
    e.remainder = e.remainder + m;
    if (k > 0) e.x_change = fma(T(lane_t<T>(k)), m, e.x_change);
    if (l > 0) e.y_change = fma(T(lane_t<T>(l)), m, e.y_change);
  }
}
}  // namespace detail

/// Excludes a cell, or shows that it has one root at most, from the two plane functions' own expansion about its
/// middle.
///
/// With F = sum b_kl p^k q^l, |p|, |q| <= 1 over the cell, what F leaves of its linear part is at most the sum of the
/// other |b_kl| and what rounding adds, and the Jacobian's change at most the sums of k |b_kl| and l |b_kl|. Multiplied
/// by the Jacobian's adjoint in the middle, the first gives exclusion as in `linear_start`, multiplied by its transpose
/// one that works where it is singular; the second gives a P-matrix, hence an injective map, where (|det| - e11) (|det|
/// - e22) > e12 e21 with both factors positive; where both row sums of e are under |det| / 4, no two Jacobians of the
/// cell differ by more than 2/3 of either, relatively, and Newton steps shrink the distance to the root by that. About
/// 280 operations.
/// \note Gale & Nikaido, "The Jacobian matrix and global univalence of mappings", Math. Ann. 159, 1965, theorem 4.
template <scalar T, int M, int N>
PATCHRT_INLINE cell_verdict<T> examine_cell(projected_patch<T, M, N> const& p, T x, T y, T half_x, T half_y) {
  detail::cell_expansion<T> f, g;
  detail::expand_cell<M, N>(p.f, p.rounding_f, p.gap_f, x, y, half_x, half_y, f);
  detail::expand_cell<M, N>(p.g, p.rounding_g, p.gap_g, x, y, half_x, half_y, g);
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
  T const less(lane_t<T>(1 - 0x1p-20));
  v.at_most_one = T(0) < a && T(0) < d && b * c < less * (a * d);
  T const quarter = T(lane_t<T>(0.25)) * det;
  v.convergent = (det - a) + b < quarter && c + (det - d) < quarter;
  v.along_x = (fx + gx) + (f.x_change + g.x_change);
  v.along_y = (fy + gy) + (f.y_change + g.y_change);
  v.mirrored = s.det < T(0);
  limited_step<T> const step = limit_step(s, T(1), T(1));
  v.x = fma(step.dx, half_x, x);
  v.y = fma(step.dy, half_y, y);
  return v;
}

/// Where Newton's iteration ended.
template <scalar T> struct newton_result {
  T x, y;
  T error_x, error_y;  ///< how far rounding may have moved it and the patch's gap may reach, to first order
  mask_t<T> converged;
  mask_t<T> mirrored;  ///< the Jacobian's determinant is negative there
  int steps;
};

/// Newton's iteration on the two plane functions from (x, y), for the lanes in `active`.
///
/// A lane has converged after a step shorter than `tolerance` in both parameters, which leaves an error of the order of
/// tolerance^2, or where both functions are no more than their rounding: there only a short step is taken. It is given
/// up when it has left |x|, |y| < 1.5 or after `max_steps`. Steps are limited to (limit_x, limit_y). Errors are |J^-1|
/// times the functions' rounding, with the last J.
template <scalar T, int M, int N>
PATCHRT_INLINE newton_result<T> newton(projected_patch<T, M, N> const& p, T x, T y, T limit_x, T limit_y,
                                       mask_t<T> active, lane_t<T> tolerance, int max_steps) {
  T const eps(tolerance);
  auto converged = active && !active;
  T error_x(0), error_y(0), det(1);  // errors times |det|
  T const off_f = p.rounding_f + p.gap_f, off_g = p.rounding_g + p.gap_g;
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
    det = select(active, s.det, det);
    error_x = select(active, fma(abs(b.gy), off_f, abs(b.fy) * off_g), error_x);
    error_y = select(active, fma(abs(b.gx), off_f, abs(b.fx) * off_g), error_y);
    converged = converged || (active && (is_short || at_root));
    T const away(lane_t<T>(1.5));
    active = active && !converged && abs(x) < away && abs(y) < away;
    ++steps;
  }
  T const least = max(abs(det), T(std::numeric_limits<lane_t<T>>::min()));
  return {x, y, error_x / least, error_y / least, converged, det < T(0), steps};
}

}  // namespace patchrt
