// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/roots/isolation.hpp>
#include <patchrt/roots/krawczyk.hpp>

namespace patchrt::detail {

/// What |f| and |g| may be at a point where they were computed as b, in the given pair's units.
template <scalar T, int M, int N>
PATCHRT_HD void set_residual(scaled_pair<T, M, N> const& pair, bivariate<T> const& b, isolated_root<T>& root) {
  using R = real_t<T>;
  root.residual_f = rounded_up(magnitude(b.f) + R(1.5) * pair.noise_f) * pair.scale_f;
  root.residual_g = rounded_up(magnitude(b.g) + R(1.5) * pair.noise_g) * pair.scale_g;
}

template <scalar T> PATCHRT_INLINE T clamped(T const& x, real_t<T> low, real_t<T> high) {
  return enclosure<T>::centre(max(min(x, T(high)), T(low)));
}

/// Newton's iteration to the one root in `box`, and how far it may be from there.
///
/// With c = a f + b g for either row, the mean value theorem gives 0 = c(p) + c_s (s - s_p) + c_t (t - t_p) with slopes
/// from within the box, hence |s - s_p| least_slope_0 <= |c_0(p)| + error_0 + cross_slope_0 |t - t_p|, likewise for t,
/// and both together bound either. False where the root's box would leave `box`.
template <scalar T, int M, int N>
PATCHRT_OUTLINE bool refine_root(scaled_pair<T, M, N> const& pair, parameter_box<real_t<T>> const& box,
                                 box_facts<real_t<T>> const& facts, isolated_root<T>& root) {
  using R = real_t<T>;
  R const width_u = box.u_high - box.u_low, width_v = box.v_high - box.v_low;
  T u(box.u_low + width_u / R(2)), v(box.v_low + width_v / R(2));
  bivariate<T> at = evaluate(pair, u, v);
  R last = std::numeric_limits<R>::max();
  for (int n = 0; n < 12; ++n) {
    scaled_step<T> const s = newton_step(at);
    T const next_u = clamped(u + s.dx / s.det, box.u_low, box.u_high);
    T const next_v = clamped(v + s.dy / s.det, box.v_low, box.v_high);
    R const step = max(magnitude(next_u - u) / width_u, magnitude(next_v - v) / width_v);
    if (!(step < last / R(2))) break;
    last = step;
    u = next_u;
    v = next_v;
    at = evaluate(pair, u, v);
    if (step <= R(4) * enclosure<T>::unit()) break;
  }
  R off[2];
  for (int k = 0; k < 2; ++k) {
    combination<R> const& c = facts.row[k];
    R const more = (abs(c.a) * pair.noise_f + abs(c.b) * pair.noise_g) / R(2);
    off[k] = rounded_up(magnitude(fma(T(c.a), at.f, T(c.b) * at.g)) + c.error + more);
  }
  R const l0 = facts.row[0].least_slope, l1 = facts.row[1].least_slope;
  R const x0 = facts.row[0].cross_slope, x1 = facts.row[1].cross_slope;
  R const det = l0 * l1 / rounded_up(R(1)) - rounded_up(x0 * x1);
  root.u = u;
  root.v = v;
  root.radius_u = rounded_up((off[0] * l1 + x0 * off[1]) / det * width_u);
  root.radius_v = rounded_up((off[1] * l0 + x1 * off[0]) / det * width_v);
  root.kind = root_kind::simple;
  set_residual(pair, at, root);
  return det > R(0) && box.u_low < enclosure<T>::lower(u - T(root.radius_u)) &&
         enclosure<T>::upper(u + T(root.radius_u)) < box.u_high &&
         box.v_low < enclosure<T>::lower(v - T(root.radius_v)) &&
         enclosure<T>::upper(v + T(root.radius_v)) < box.v_high;
}

/// The point of `box` that comes nearest to being a root, by damped Gauss-Newton steps, as the middle of a box that
/// covers it.
/// \note Levenberg 1944; More 1978 for the damping by the residual's own size.
template <scalar T, int M, int N>
PATCHRT_OUTLINE void approach_root(scaled_pair<T, M, N> const& pair, parameter_box<real_t<T>> const& box,
                                   isolated_root<T>& root) {
  using R = real_t<T>;
  R const width_u = box.u_high - box.u_low, width_v = box.v_high - box.v_low;
  T u(box.u_low + width_u / R(2)), v(box.v_low + width_v / R(2));
  bivariate<T> at = evaluate(pair, u, v);
  for (int n = 0; n < 12; ++n) {
    // Slopes by the place in the box, so that the damping is of one size with either.
    T const fx = at.fx * T(width_u), gx = at.gx * T(width_u), fy = at.fy * T(width_v), gy = at.gy * T(width_v);
    T const damping = T(0x1p-10f) * (fx * fx + gx * gx + fy * fy + gy * gy);
    T const xx = fx * fx + gx * gx + damping, yy = fy * fy + gy * gy + damping, xy = fx * fy + gx * gy;
    T const x = fx * at.f + gx * at.g, y = fy * at.f + gy * at.g;
    T const det = xx * yy - xy * xy;
    if (!(approximately(det) > R(0))) break;
    T const step_u = T(width_u) * ((yy * x - xy * y) / det), step_v = T(width_v) * ((xx * y - xy * x) / det);
    T const next_u(approximately(clamped(u - step_u, box.u_low, box.u_high)));
    T const next_v(approximately(clamped(v - step_v, box.v_low, box.v_high)));
    bivariate<T> const next = evaluate(pair, next_u, next_v);
    if (!(approximately(next.f * next.f + next.g * next.g) < approximately(at.f * at.f + at.g * at.g))) break;
    u = next_u;
    v = next_v;
    at = next;
  }
  root.u = u;
  root.v = v;
  R const at_u = approximately(u), at_v = approximately(v);
  root.radius_u = rounded_up(max(at_u - box.u_low, box.u_high - at_u));
  root.radius_v = rounded_up(max(at_v - box.v_low, box.v_high - at_v));
  set_residual(pair, at, root);
}

}  // namespace patchrt::detail
