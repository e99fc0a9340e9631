// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What is only asked of the crossings that are kept: position with its error, normal, and where rays start that leave.

#include <patchrt/intersect/offset_origin.hpp>
#include <patchrt/intersect/ray_quadric.hpp>
#include <patchrt/intersect/ray_sphere.hpp>

#include <limits>

namespace patchrt {

/// A point of a clipped quadric.
template <scalar T> struct quadric_point {
  vec3<T> position;
  vec3<T> normal;  ///< of length 1, outward: to where f > 0, or out of the box; against the ray at the apex of a cone
  T error;  ///< bound on the distance of `position` from where the exact ray crosses the exact surface; infinite where
            ///< rounding could have made the crossing
  T clearance;  ///< how far from the surface rays have to start so as not to meet it there again
};

namespace detail {

/// Bounds on what rounding does to f along a ray where the coordinates' terms in object space add up to at most
/// `reach`: with G = |Q| reach + |b| and M = reach.(G + |b|) + |c|,
///     |computed f - f| <= value = 8 eps M + 5/4 eps from.G.
template <scalar T> struct form_error {
  vec3<T> gradient;  ///< G
  T value;
};
template <scalar T, class B>
PATCHRT_INLINE form_error<T> error_of_form(clipped_quadric<B> const& s, vec3<T> const& reach, vec3<T> const& from) {
  using L = lane_t<T>;
  constexpr L eps = std::numeric_limits<L>::epsilon();
  quadric<T> const q{absolute(convert_vec<T>(s.form.squares)), absolute(convert_vec<T>(s.form.products)),
                     absolute(convert_vec<T>(s.form.linear)), abs(T(s.form.constant))};
  vec3<T> const g = half_gradient(q, reach);
  return {g, fma(T(8 * eps), value_from_gradient(q, reach, g), T(L(1.25) * eps) * dot(from, g))};
}

/// |rows| v.
template <scalar T, class B>
PATCHRT_INLINE vec3<T> magnitudes_in_object(clipped_quadric<B> const& s, vec3<T> const& v) {
  return {dot(absolute(convert_vec<T>(s.rows[0])), v), dot(absolute(convert_vec<T>(s.rows[1])), v),
          dot(absolute(convert_vec<T>(s.rows[2])), v)};
}

/// Of three values, that of a face's axis.
template <scalar T> PATCHRT_INLINE T of_axis(T face, vec3<T> const& v) {
  using L = lane_t<T>;
  return select(abs(face) < T(L(1.5)), v.x, select(abs(face) < T(L(2.5)), v.y, v.z));
}

}  // namespace detail

/// The point of a crossing that `crossings` or `intersect` gave for this ray and surface.
///
/// Running error analysis, u = eps / 2, rows R, all magnitudes component by component. The computed middle point p is
/// off by u (|o - c| + |p|), its image R p by 3 u |R||p| more, R d by 3 u |R||d|; with m = |R|(|p| + |tau||d|) a point
/// at tau from the middle is off by w = u |R||o - c| + 4 u m in object space, which changes f by 2 w.G (G = |Q| m +
/// |b|). The coefficients a, h, c are sums of up to seven roundings: 7 u M, M = m.(G + |b|) + |c|. Since m.G <= M, f as
/// the root solver sees it is within
///     E = 8 eps M + 5/4 eps |R||o - c|.G
/// of the exact one. So the exact root is within E / |a tau + h| of the solver's wherever 2 |a| E <= (a tau + h)^2 and
/// the slope is not itself of rounding's size, 64 eps G.|R||d|: f changes its sign between. The root solver adds 4 u
/// |tau|, and the roundings of p and `position` u each of the terms they are made of. A cap's plane is treated alike:
/// its coordinate is off by 4 eps (m + |plane|) + 5/8 eps |R||o - c|, over the direction's.
///
/// `clearance` is 3 E / |gradient / 2| + 4 eps |p - c|, with m for any ray from here as far as the finite sides of
/// `clip` reach: what the next ray's f may be off by is then less than f at its start.
/// \pre  `hit` is valid.
/// \note Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., section 3.3; Pharr, Jakob & Humphreys,
///       Physically Based Rendering, 4th ed., section 6.8. At rims, only the face that was hit is cleared. Rays that
///       leave flat or straight surfaces without end at angles below rounding may meet them far away.
template <scalar T, lanes_of<T> B>
PATCHRT_HD quadric_point<T> point_at(centred_ray<T> const& r, clipped_quadric<B> const& s, quadric_hit<T> const& hit) {
  using L = lane_t<T>;
  constexpr L eps = std::numeric_limits<L>::epsilon();
  constexpr L most = std::numeric_limits<L>::max();
  T const zero(0), infinite(std::numeric_limits<L>::infinity());
  auto const o = detail::enter_object_space(r, s);
  quadric<T> const q{convert_vec<T>(s.form.squares), convert_vec<T>(s.form.products), convert_vec<T>(s.form.linear),
                     T(s.form.constant)};
  vec3<T> const rows[3] = {convert_vec<T>(s.rows[0]), convert_vec<T>(s.rows[1]), convert_vec<T>(s.rows[2])};
  vec3<T> const lo = convert_vec<T>(s.clip.lo), hi = convert_vec<T>(s.clip.hi);
  auto const on_cap = hit.face < zero || zero < hit.face;
  auto const at_lo = hit.face < zero;
  T const plane = select(at_lo, detail::of_axis(hit.face, lo), detail::of_axis(hit.face, hi));

  quadric_point<T> point;
  T const tau = hit.local;
  vec3<T> const from_centre = fma(tau, r.direction, o.middle.point);
  point.position = sum(convert_vec<T>(s.centre), from_centre);

  vec3<T> const g = half_gradient(q, fma(tau, o.direction, o.origin));
  vec3<T> const uphill = fma(g.x, rows[0], fma(g.y, rows[1], scale(rows[2], g.z)));
  vec3<T> const row{detail::of_axis(hit.face, {rows[0].x, rows[1].x, rows[2].x}),
                    detail::of_axis(hit.face, {rows[0].y, rows[1].y, rows[2].y}),
                    detail::of_axis(hit.face, {rows[0].z, rows[1].z, rows[2].z})};
  vec3<T> const gradient = select(on_cap, select(at_lo, -row, row), uphill);
  T const steepness = sqrt(dot(gradient, gradient)), speed = sqrt(dot(r.direction, r.direction));
  point.normal = select(zero < steepness, scale(gradient, T(1) / steepness), scale(r.direction, T(-1) / speed));

  vec3<T> const d = absolute(r.direction), terms = fma(abs(tau), d, absolute(o.middle.point));
  vec3<T> const reach = detail::magnitudes_in_object(s, terms);
  vec3<T> const from = detail::magnitudes_in_object(s, absolute(o.middle.from_origin));
  vec3<T> const turn = detail::magnitudes_in_object(s, d);
  auto const f = detail::error_of_form(s, reach, from);
  T const slope = abs(fma(o.a, tau, o.h)), cap_slope = abs(detail::of_axis(hit.face, o.direction));
  T const cap_error = fma(T(4 * eps), detail::of_axis(hit.face, reach) + abs(plane),
                          T(L(0.625) * eps) * detail::of_axis(hit.face, from));
  auto const regular = (T(2) * abs(o.a)) * f.value <= slope * slope && T(64 * eps) * dot(f.gradient, turn) <= slope;
  auto const cap_regular = T(32 * eps) * detail::of_axis(hit.face, turn) <= cap_slope;
  T const along = select(on_cap, select(cap_regular, T(L(1.125)) * cap_error / cap_slope, infinite),
                         select(regular, f.value / slope, infinite));
  T const rounded = sum_of_magnitudes(o.middle.from_origin) + sum_of_magnitudes(o.middle.point) +
                    sum_of_magnitudes(from_centre) + sum_of_magnitudes(point.position);
  point.error = fma(speed, fma(T(L(2.5) * eps), abs(tau), along), T(L(0.625) * eps) * rounded);

  T const distance = T(L(1.5)) * sqrt(dot(from_centre, from_centre));
  vec3<T> next = detail::magnitudes_in_object(s, vec3<T>(distance, distance, distance));
  for (int k = 0; k < 3; ++k) {
    T const side = max(abs(lo[k]), abs(hi[k]));
    next[k] = max(next[k], select(side <= T(most), side, zero));
  }
  auto const leaving = detail::error_of_form(s, next, next);
  T const apex = sqrt(leaving.value * sum_of_magnitudes(multiply(q, vec3<T>(T(1), T(1), T(1)))) * dot(row, row));
  T const cap_clear = T(16 * eps) * (detail::of_axis(hit.face, next) + abs(plane));
  T const off = select(on_cap, cap_clear, T(3) * leaving.value) / max(steepness, select(on_cap, zero, apex));
  point.clearance = fma(T(4 * eps), sum_of_magnitudes(from_centre), off);
  return point;
}

/// A crossing for rays to leave from: `offset_origin(depart_from(ray, surface, hit), direction)` is where they start.
template <scalar T, lanes_of<T> B>
PATCHRT_HD surface_departure<T> depart_from(centred_ray<T> const& r, clipped_quadric<B> const& s,
                                            quadric_hit<T> const& hit) {
  quadric_point<T> const p = point_at(r, s, hit);
  return {p.position, p.normal, p.clearance};
}

/// The same for a crossing with a sphere: `position` is put on the sphere along its normal, to a few eps of the radius.
template <scalar T, lanes_of<T> B>
PATCHRT_HD surface_departure<T> depart_from(centred_ray<T> const& r, sphere<B> const& ball, sphere_hit<T> const& hit) {
  vec3<T> const centre = convert_vec<T>(ball.centre);
  ray_middle<T> const m = middle_of(r, centre);
  vec3<T> const from_centre = fma(hit.t - m.t, r.direction, m.point);
  vec3<T> const normal = scale(from_centre, T(1) / sqrt(dot(from_centre, from_centre)));
  T const radius = abs(T(ball.radius));
  return {fma(radius, normal, centre), normal, radius * T(16 * std::numeric_limits<lane_t<T>>::epsilon())};
}

}  // namespace patchrt
