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
  vec3<T> const p = to_object(s, m.point), d = to_object(s, r.direction), g = half_gradient(q, p);
  return {m, p, d, dot(d, multiply(q, d)), dot(d, g), value_from_gradient(q, p, g)};
}

/// A span of t in a box, and the faces through which it is entered and left.
template <scalar T> struct faced_span {
  slab_span<T> span;
  T entry_face, exit_face;
};

/// Whether a box ends along an axis, or has a NaN there.
template <scalar T, class B> PATCHRT_INLINE mask_t<T> is_bounded(B lo, B hi) {
  T const most(std::numeric_limits<lane_t<T>>::max());
  return !(T(lo) < -most && most < T(hi));
}

/// Clips by the two planes of one axis, `code` that of the upper one's face. Where the direction is zero and the ray
/// lies in a plane, that is at 0 * inf = NaN, and not heeded: the ray meets the box.
template <scalar T, class B>
PATCHRT_INLINE void clip_face(faced_span<T>& f, T origin, T direction, B lo, B hi, lane_t<T> code) {
  if (!any_of(is_bounded<T>(lo, hi))) return;
  T const inverse = T(1) / direction, lo_face(-code), hi_face(code);
  auto const backward = inverse < T(0);
  T const near = (select(backward, T(hi), T(lo)) - origin) * inverse;
  T const far = (select(backward, T(lo), T(hi)) - origin) * inverse;
  auto const later = f.span.entry < near, sooner = far < f.span.exit;
  f.span = {select(later, near, f.span.entry), select(sooner, far, f.span.exit)};
  f.entry_face = select(later, select(backward, hi_face, lo_face), f.entry_face);
  f.exit_face = select(sooner, select(backward, lo_face, hi_face), f.exit_face);
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
template <scalar T, class B> PATCHRT_INLINE mask_t<T> is_ordered(box<B> const& b) {
  return T(b.lo.x) <= T(b.hi.x) && T(b.lo.y) <= T(b.hi.y) && T(b.lo.z) <= T(b.hi.z);
}

/// Leaves of `valid0` and `valid1` those whose points at t0 and t1 are between two planes.
template <scalar T, class B>
PATCHRT_INLINE void clip_roots(T origin, T direction, B lo, B hi, quadratic_roots<T> const& root, mask_t<T>& valid0,
                               mask_t<T>& valid1) {
  if (!any_of(is_bounded<T>(lo, hi))) return;
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
  mask_t<T> const capped(s.capped), open = !capped;
  mask_t<T> valid0 = root.real && open, valid1 = valid0, entry = capped, exit = capped;
  detail::faced_span<T> f{{zero, zero}, zero, zero};
  if (any_of(open)) {
    detail::clip_roots(o.origin.x, o.direction.x, s.clip.lo.x, s.clip.hi.x, root, valid0, valid1);
    detail::clip_roots(o.origin.y, o.direction.y, s.clip.lo.y, s.clip.hi.y, root, valid0, valid1);
    detail::clip_roots(o.origin.z, o.direction.z, s.clip.lo.z, s.clip.hi.z, root, valid0, valid1);
  }
  if (any_of(capped)) {
    f = detail::span_in_clip(o, s.clip);
    T const from = f.span.entry, to = f.span.exit;
    auto const in_clip = capped && detail::is_ordered<T>(s.clip) && from <= to;
    auto const without_roots = !root.real && (o.c < zero || (o.c <= zero && o.a < zero));
    auto const is_inside = [&](T t) {
      auto const between = zero <= o.a && root.t0 < t && t < root.t1;
      auto const beyond = o.a < zero && (t < root.t0 || root.t1 < t);
      return without_roots || (root.real && (between || beyond));
    };
    valid0 = valid0 || (in_clip && root.real && from <= root.t0 && root.t0 <= to);
    valid1 = valid1 || (in_clip && root.real && from <= root.t1 && root.t1 <= to);
    entry = in_clip && is_inside(from);
    exit = in_clip && is_inside(to);
  }
  T const middle = o.middle.t;
  return {{{middle + f.span.entry, f.span.entry, f.entry_face, entry},
           {middle + root.t0, root.t0, zero, valid0},
           {middle + root.t1, root.t1, zero, valid1},
           {middle + f.span.exit, f.span.exit, f.exit_face, exit}}};
}

/// The first of the crossings in t_min < t < t_max.
template <scalar T> PATCHRT_INLINE quadric_hit<T> nearest(quadric_crossings<T> const& c, T t_min, T t_max) {
  quadric_hit<T> r = c.hit[3];
  r.valid = c.hit[3].valid && t_min < r.t && r.t < t_max;
  for (int k = 2; k >= 0; --k) {
    quadric_hit<T> const& h = c.hit[k];
    if (k == 0 && !any_of(h.valid)) continue;  // open surfaces
    auto const counts = h.valid && t_min < h.t && h.t < t_max;
    r.t = select(counts, h.t, r.t);
    r.local = select(counts, h.local, r.local);
    r.face = select(counts, h.face, r.face);
    r.valid = counts || r.valid;
  }
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
