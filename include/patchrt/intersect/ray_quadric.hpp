// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/intersect/centred_ray.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/roots/quadratic.hpp>
#include <patchrt/shapes/clipped_quadric.hpp>

#include <limits>

namespace patchrt {

/// A crossing of a ray with a clipped quadric; unspecified where not `valid`.
template <scalar T> struct quadric_hit {
  T t;
  T local;  ///< t from the ray's point nearest the centre, `middle_of`: more digits where the origin is far away
  T face;   ///< 0 on the quadric; on caps -1, -2, -3 for clip.lo.x, .y, .z and 1, 2, 3 for clip.hi
  mask_t<T> valid;
};

/// All crossings by ascending t: into the box through a cap, both roots, out of the box through a cap.
template <scalar T> struct quadric_crossings { quadric_hit<T> hit[4]; };

namespace detail {

/// A ray in a quadric's object space, from `middle_of` on, and f along it: a t^2 + 2 h t + c.
template <scalar T> struct object_ray {
  ray_middle<T> middle;
  vec3<T> origin;
  vec3<T> direction;
  T a, h, c;
};

template <scalar T, class B> PATCHRT_INLINE vec3<T> to_object(clipped_quadric<B> const& s, vec3<T> const& v) {
  return {dot(convert_vec<T>(s.rows[0]), v), dot(convert_vec<T>(s.rows[1]), v), dot(convert_vec<T>(s.rows[2]), v)};
}

template <scalar T, class B>
PATCHRT_INLINE object_ray<T> enter_object_space(centred_ray<T> const& r, clipped_quadric<B> const& s) {
  quadric<T> const q{convert_vec<T>(s.form.squares), convert_vec<T>(s.form.products), convert_vec<T>(s.form.linear),
                     T(s.form.constant)};
  ray_middle<T> const m = middle_of(r, convert_vec<T>(s.centre));
  vec3<T> const p = to_object(s, m.point), d = to_object(s, r.direction);
  vec3<T> q_d, g;
  if (any_of(has_products(s.form))) {
    q_d = multiply(q, d);
    g = half_gradient(q, p);
  } else {
    vec3<T> const &a = q.squares, &b = q.linear;
    q_d = {a.x * d.x, a.y * d.y, a.z * d.z};
    g = {fma(a.x, p.x, b.x), fma(a.y, p.y, b.y), fma(a.z, p.z, b.z)};
  }
  return {m, p, d, dot(d, q_d), dot(d, g), value_from_gradient(q, p, g)};
}

/// A span of t in a box, and the faces through which it is entered and left.
template <scalar T> struct faced_span {
  slab_span<T> span;
  T entry_face, exit_face;
};

/// Whether a box ends along an axis, or has a NaN there.
template <scalar T> PATCHRT_INLINE mask_t<T> is_bounded(T lo, T hi) {
  T const most(std::numeric_limits<lane_t<T>>::max());
  return !(lo < -most && most < hi);
}

/// Clips by the two planes of one axis, `code` that of the upper one's face. Where the direction is zero and the ray
/// lies in a plane, that is at 0 * inf = NaN, and not heeded: the ray meets the box.
template <scalar T, class B>
PATCHRT_INLINE void clip_face(faced_span<T>& f, T origin, T direction, B lo, B hi, lane_t<T> code) {
  if (!any_of(is_bounded(lo, hi))) return;
  T const inverse = T(1) / direction, out_of = copysign(T(code), inverse);
  auto const backward = inverse < T(0);
  T const near = (select(backward, T(hi), T(lo)) - origin) * inverse;
  T const far = (select(backward, T(lo), T(hi)) - origin) * inverse;
  auto const later = f.span.entry < near, sooner = far < f.span.exit;
  f.span = {select(later, near, f.span.entry), select(sooner, far, f.span.exit)};
  f.entry_face = select(later, -out_of, f.entry_face);
  f.exit_face = select(sooner, out_of, f.exit_face);
}

template <scalar T, class B> PATCHRT_INLINE faced_span<T> span_in_clip(object_ray<T> const& o, box<B> const& b) {
  using L = lane_t<T>;
  T const inf(std::numeric_limits<L>::infinity());
  faced_span<T> f{{-inf, inf}, T(0), T(0)};
  clip_face(f, o.origin.x, o.direction.x, b.lo.x, b.hi.x, L(1));
  clip_face(f, o.origin.y, o.direction.y, b.lo.y, b.hi.y, L(2));
  clip_face(f, o.origin.z, o.direction.z, b.lo.z, b.hi.z, L(3));
  return f;
}

/// Whether no side of a box is NaN.
template <scalar T> PATCHRT_INLINE mask_t<T> is_ordered(box<T> const& b) {
  return b.lo.x <= b.hi.x && b.lo.y <= b.hi.y && b.lo.z <= b.hi.z;
}

/// Leaves of `valid0` and `valid1` those whose points at t0 and t1 are between two planes.
template <scalar T, class B>
PATCHRT_INLINE void clip_roots(T origin, T direction, B lo, B hi, quadratic_roots<T> const& root, mask_t<T>& valid0,
                               mask_t<T>& valid1) {
  if (!any_of(is_bounded(lo, hi))) return;
  T const x0 = fma(root.t0, direction, origin), x1 = fma(root.t1, direction, origin);
  valid0 = valid0 && T(lo) <= x0 && x0 <= T(hi);
  valid1 = valid1 && T(lo) <= x1 && x1 <= T(hi);
}

}  // namespace detail

/// All crossings of a line with a clipped quadric, one for all lanes or one for each.
///
/// The ray is moved to its point nearest the centre first, then mapped to object space, so that everything that is
/// squared is of the surface's size; t = t of that point + root. On unit surfaces t is within 4 ulp from 2 to 10^6
/// radii away, for rays that meet them at more than 30 degrees; `point_at` bounds the error of any hit.
///
/// A root of an open surface counts where its point is in the box. With caps, the inside is where both f < 0 and the
/// ray is in the box: roots, entry and exit are compared with each other, so that between a quadric and its cap there
/// is no gap.
/// \tparam Touch whether a tangent, or a ray through a cone's apex, crosses the quadric: twice, at t0 = t1 but for
///               rounding.
/// \pre    d.d, f and its products along the ray neither over- nor underflow.
/// \return Crossings that are not `valid` have any t; NaN anywhere in the input, or d = 0, gives none. A ray in the
///         surface has none with the quadric.
/// \note   Haines, Guenther & Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems,
///         2019, chapter 7, whose way to move the origin serves all quadrics here.
template <tangent Touch = tangent::hit, scalar T, lanes_of<T> B>
PATCHRT_INLINE quadric_crossings<T> crossings(centred_ray<T> const& r, clipped_quadric<B> const& s) {
  T const zero(0);
  auto const o = detail::enter_object_space(r, s);
  quadratic_roots<T> const root = solve_quadratic<Touch>(o.a, o.h, o.c);
  mask_t<T> const capped(s.capped);
  mask_t<T> valid0 = root.real && !capped, valid1 = valid0, entry = capped, exit = capped;
  detail::faced_span<T> f{{zero, zero}, zero, zero};
  if (any_of(!s.capped)) {
    detail::clip_roots(o.origin.x, o.direction.x, s.clip.lo.x, s.clip.hi.x, root, valid0, valid1);
    detail::clip_roots(o.origin.y, o.direction.y, s.clip.lo.y, s.clip.hi.y, root, valid0, valid1);
    detail::clip_roots(o.origin.z, o.direction.z, s.clip.lo.z, s.clip.hi.z, root, valid0, valid1);
  }
  if (any_of(s.capped)) {
    f = detail::span_in_clip(o, s.clip);
    T const from = f.span.entry, to = f.span.exit;
    auto const in_clip = capped && mask_t<T>(detail::is_ordered(s.clip)) && from <= to;
    auto const with_roots = in_clip && root.real;
    auto const from_after0 = root.t0 < from, from_after1 = root.t1 < from;
    auto const to_before0 = to < root.t0, to_before1 = to < root.t1;
    // Between the roots is inside, or outside: what is counted at ends and roots comes in pairs either way.
    auto const outward = o.a < zero;
    auto const is_inside = [&](mask_t<T> between) { return (between && !outward) || (outward && !between); };
    auto all_inside = in_clip && !root.real && o.c < zero;
    if constexpr (Touch == tangent::miss) all_inside = all_inside || (in_clip && !root.real && o.c <= zero && outward);
    valid0 = valid0 || (with_roots && !from_after0 && !to_before0);
    valid1 = valid1 || (with_roots && !from_after1 && !to_before1);
    entry = (with_roots && is_inside(from_after0 && !from_after1)) || all_inside;
    exit = (with_roots && is_inside(to_before1 && !to_before0)) || all_inside;
  }
  T const middle = o.middle.t;
  return {{{middle + f.span.entry, f.span.entry, f.entry_face, entry},
           {middle + root.t0, root.t0, zero, valid0},
           {middle + root.t1, root.t1, zero, valid1},
           {middle + f.span.exit, f.span.exit, f.exit_face, exit}}};
}

/// The first of the crossings in t_min < t < t_max.
template <scalar T> PATCHRT_INLINE quadric_hit<T> nearest(quadric_crossings<T> const& c, T t_min, T t_max) {
  bool const with_caps = any_of(c.hit[0].valid || c.hit[3].valid);
  quadric_hit<T> r = c.hit[2];
  r.valid = r.valid && t_min < r.t;
  auto const take = [&](quadric_hit<T> const& h, mask_t<T> counts) {
    r.t = select(counts, h.t, r.t);
    r.local = select(counts, h.local, r.local);
    r.face = select(counts, h.face, r.face);
    r.valid = counts || r.valid;
  };
  if (with_caps) take(c.hit[3], c.hit[3].valid && t_min < c.hit[3].t && !r.valid);
  take(c.hit[1], c.hit[1].valid && t_min < c.hit[1].t);
  if (with_caps) take(c.hit[0], c.hit[0].valid && t_min < c.hit[0].t);
  r.valid = r.valid && r.t < t_max;  // by ascending t: where the first is beyond, all are
  return r;
}

/// The nearest crossing of a ray with a clipped quadric in t_min < t < t_max.
template <tangent Touch = tangent::hit, scalar T, lanes_of<T> B>
PATCHRT_INLINE quadric_hit<T> intersect(centred_ray<T> const& r, clipped_quadric<B> const& s, T t_min, T t_max) {
  return nearest(crossings<Touch>(r, s), t_min, t_max);
}

/// The same, where a ray is used once.
template <tangent Touch = tangent::hit, scalar T, lanes_of<T> B>
PATCHRT_INLINE quadric_hit<T> intersect(ray<T> const& r, clipped_quadric<B> const& s) {
  return intersect<Touch>(make_centred_ray(r.origin, r.direction), s, r.t_min, r.t_max);
}

}  // namespace patchrt
