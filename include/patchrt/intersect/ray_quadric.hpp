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

/// All crossings, the valid ones by ascending t. Of an open surface: none, both roots, none. Of a capped one, pairs into
/// the solid and out of it: hit[1] and hit[2], or, where f < 0 outside the roots, hit[0] and hit[1], hit[2] and hit[3].
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

/// Crossings whose faces are not told yet, the span that tells them, and whether the outer two can be valid.
template <scalar T> struct faceless_crossings {
  quadric_crossings<T> all;
  faced_span<T> clip;
  bool with_outer;
};

template <tangent Touch, scalar T, class B>
PATCHRT_INLINE void find_crossings(centred_ray<T> const& r, clipped_quadric<B> const& s, faceless_crossings<T>& found) {
  T const zero(0), inf(std::numeric_limits<lane_t<T>>::infinity());
  auto const o = enter_object_space(r, s);
  auto const root = solve_quadratic<Touch>(o.a, o.h, o.c);
  T const middle = o.middle.t;
  mask_t<T> const capped(s.capped), none(false);
  T t0 = root.t0, t1 = root.t1;
  mask_t<T> valid0 = root.real && !capped, valid1 = valid0, before = none, after = none;
  found.clip = {{zero, zero}, zero, zero};
  found.with_outer = false;
  if (any_of(!s.capped)) {
    clip_roots(o.origin.x, o.direction.x, s.clip.lo.x, s.clip.hi.x, root, valid0, valid1);
    clip_roots(o.origin.y, o.direction.y, s.clip.lo.y, s.clip.hi.y, root, valid0, valid1);
    clip_roots(o.origin.z, o.direction.z, s.clip.lo.z, s.clip.hi.z, root, valid0, valid1);
  }
  if (any_of(s.capped)) {
    found.clip = span_in_clip(o, s.clip);
    found.with_outer = any_of(o.a < zero);
    T const from = found.clip.span.entry, to = found.clip.span.exit;
    auto const in_clip = capped && mask_t<T>(is_ordered(s.clip)) && from <= to;
    // Between the roots is inside, or outside. Where f < 0 has no roots, all of the line is, as between infinite ones.
    auto const outward = in_clip && root.real && o.a < zero;
    auto all_inside = !root.real && o.c < zero;
    if constexpr (Touch == tangent::miss) all_inside = all_inside || (!root.real && o.c <= zero && o.a < zero);
    auto const between = in_clip && !outward && (root.real || all_inside);
    T const r0 = select(root.real, root.t0, -inf), r1 = select(root.real, root.t1, inf);
    auto const inside = between && r0 <= to && from <= r1;
    T first = max(r0, from), last = min(r1, to);
    valid0 = valid0 || inside;
    valid1 = valid1 || inside;
    if (found.with_outer) {
      before = outward && from <= r0;
      after = outward && r1 <= to;
      first = min(first, to);
      last = max(last, from);
      valid0 = valid0 || before;
      valid1 = valid1 || after;
    }
    t0 = select(capped, first, t0);
    t1 = select(capped, last, t1);
  }
  T const from = found.clip.span.entry, to = found.clip.span.exit;
  found.all.hit[0] = {middle + from, from, zero, before};
  found.all.hit[1] = {middle + t0, t0, zero, valid0};
  found.all.hit[2] = {middle + t1, t1, zero, valid1};
  found.all.hit[3] = {middle + to, to, zero, after};
}

/// The face of a pair's first crossing, at t: a cap's where that is where the ray enters or leaves the box.
template <scalar T, class B> PATCHRT_INLINE T face_at(T t, faced_span<T> const& clip, clipped_quadric<B> const& s) {
  T const zero(0);
  if (!any_of(s.capped)) return zero;
  T const within = select(t < clip.span.exit, zero, clip.exit_face);
  return select(mask_t<T>(s.capped), select(clip.span.entry < t, within, clip.entry_face), zero);
}

/// The first of the crossings in t_min < t < t_max, which may be one of the outer two only `with_outer`.
template <scalar T>
PATCHRT_INLINE quadric_hit<T> nearest_of(quadric_crossings<T> const& c, T t_min, T t_max, bool with_outer) {
  quadric_hit<T> r = c.hit[2];
  if (with_outer) r = c.hit[3];
  r.t = select(r.valid && t_min < r.t, r.t, t_max);
  auto const take = [&](quadric_hit<T> const& h) {
    auto const counts = h.valid && t_min < h.t;
    r.t = select(counts, h.t, r.t);
    r.local = select(counts, h.local, r.local);
    r.face = select(counts, h.face, r.face);
  };
  if (with_outer) take(c.hit[2]);
  take(c.hit[1]);
  if (with_outer) take(c.hit[0]);
  r.valid = r.t < t_max;  // by ascending t: where the first is beyond, all are
  return r;
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
/// is no gap, and crossings come in pairs. What is where the ray enters or leaves the box has that cap's face, root or
/// not; where it does both at one t, a pair's first crossing has the face of the entry, its second that of the exit.
/// \tparam Touch whether a tangent, or a ray through a cone's apex, crosses the quadric: twice, at t0 = t1 but for
///               rounding.
/// \pre    d.d, f and its products along the ray neither over- nor underflow.
/// \return Crossings that are not `valid` have any t; NaN anywhere in the input, or d = 0, gives none. A ray in the
///         surface has none with the quadric.
/// \note   Haines, Guenther & Akenine-Moeller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems,
///         2019, chapter 7, whose way to move the origin serves all quadrics here.
template <tangent Touch = tangent::hit, scalar T, lanes_of<T> B>
PATCHRT_INLINE quadric_crossings<T> crossings(centred_ray<T> const& r, clipped_quadric<B> const& s) {
  detail::faceless_crossings<T> found;
  detail::find_crossings<Touch>(r, s, found);
  auto& hit = found.all.hit;
  mask_t<T> const capped(s.capped), second[] = {mask_t<T>(false), hit[0].valid, !hit[3].valid, mask_t<T>(true)};
  for (int k = 0; k < 4; ++k) {
    T const first = detail::face_at(hit[k].local, found.clip, s);
    hit[k].face = select(capped && second[k] && !(hit[k].local < found.clip.span.exit), found.clip.exit_face, first);
  }
  return found.all;
}

/// The first of the crossings in t_min < t < t_max.
template <scalar T> PATCHRT_INLINE quadric_hit<T> nearest(quadric_crossings<T> const& c, T t_min, T t_max) {
  return detail::nearest_of(c, t_min, t_max, any_of(c.hit[0].valid || c.hit[3].valid));
}

/// The nearest crossing of a ray with a clipped quadric in t_min < t < t_max.
template <tangent Touch = tangent::hit, scalar T, lanes_of<T> B>
PATCHRT_INLINE quadric_hit<T> intersect(centred_ray<T> const& r, clipped_quadric<B> const& s, T t_min, T t_max) {
  detail::faceless_crossings<T> found;
  detail::find_crossings<Touch>(r, s, found);
  auto hit = detail::nearest_of(found.all, t_min, t_max, found.with_outer);
  hit.face = detail::face_at(hit.local, found.clip, s);  // at one t, the nearest is a pair's first
  return hit;
}

/// The same, where a ray is used once.
template <tangent Touch = tangent::hit, scalar T, lanes_of<T> B>
PATCHRT_INLINE quadric_hit<T> intersect(ray<T> const& r, clipped_quadric<B> const& s) {
  return intersect<Touch>(make_centred_ray(r.origin, r.direction), s, r.t_min, r.t_max);
}

}  // namespace patchrt
