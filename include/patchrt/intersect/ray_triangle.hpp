// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// A ray and a triangle, by forms that a scene takes as a template argument.
///
/// A form has `prepared<S>`, what is kept of a triangle, from `prepare(triangle<S>)`; `ray_constants<R>`, what is kept
/// of a ray, from `make_ray(origin, direction)`; `meet`, which decides without a division; and `position_error`. Many
/// rays meet one triangle (R = T, S = lane_t<T>), one ray meets a triangle a lane (R = lane_t<T>, S = T), or each lane
/// has its own of both. `intersect` divides.

#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/triangle.hpp>

#include <concepts>
#include <limits>

namespace patchrt {

/// The sides of a triangle that rays meet: `front` is where a, b, c turn counter-clockwise.
enum class faces { both, front };

/// The point origin + t direction = (1 - u - v) a + u b + v c; t, u and v are unspecified where not `valid`.
template <scalar T> struct triangle_hit {
  T t;
  T u;
  T v;
  mask_t<T> valid;
};

/// The same before any division: t = distance / scale, and u, v, w are in the ratio of the weights of b, c and a. Where
/// the front is met, `scale` is above 0 and no weight below, where the back is, the other way round.
template <scalar T> struct triangle_crossing {
  T distance;
  T scale;
  T u;
  T v;
  T w;
  mask_t<T> valid;
};

namespace detail {

/// One number for all lanes of T, or one for each, as the latter.
template <scalar T, class S> PATCHRT_INLINE vec3<T> in_lanes(vec3<S> const& v) { return {T(v.x), T(v.y), T(v.z)}; }

/// t, or all of it in one vertex, which no ray meets, where it has no area.
template <scalar T> PATCHRT_INLINE triangle<T> with_area(triangle<T> const& t) {
  auto const good = has_area(t);
  return {t.a, select(good, t.b, t.a), select(good, t.c, t.a)};
}

/// Where the line of a ray meets a plane: t = distance / scale.
template <scalar T> struct plane_crossing {
  T distance;
  T scale;
};

/// The lanes whose weights are of one sign and whose t is in its range. With `Early`, `plane()` is asked for only where any
/// weights are: many rays mostly miss a triangle, of many triangles a ray mostly meets one.
///
/// Where the back is met, all signs are the other ones. fma(-t_min, scale, distance) is a single rounding, which keeps the
/// sign. Where scale has another sign than the weights, or is 0, t_min < t < t_max cannot hold: no such lane is valid. Nor
/// is one whose ray goes along the triangle so that all weights are 0.
template <faces F, bool Early, scalar T, class Plane>
PATCHRT_INLINE triangle_crossing<T> cross_in_range(T u, T v, T w, T t_min, T t_max, Plane const& plane) {
  using L = lane_t<T>;
  T const zero(L(0)), total = (u + v) + w, least = min(min(u, v), w), most = max(max(u, v), w);
  auto const in_front = zero <= least && zero < total;
  auto const behind = most <= zero && total < zero;
  auto const inside = F == faces::front ? in_front : in_front || behind;
  if constexpr (Early)
    if (!any_of(inside)) return {zero, zero, zero, zero, zero, inside};
  auto const [distance, scale] = plane();
  T const after = fma(-t_min, scale, distance), before = fma(t_max, scale, -distance);
  auto valid = in_front && zero < after && zero < before;
  if constexpr (F == faces::both) valid = valid || (behind && after < zero && before < zero);
  return {distance, scale, u, v, w, valid};
}

/// `rounding` (m.|ao| + |t| m.|d|) |d| / (|n.d| - `rounding` m.|d|), infinite where n.d may be 0.
template <scalar T>
PATCHRT_INLINE T determinant_error(vec3<T> const& n, vec3<T> const& m, vec3<T> const& ao, vec3<T> const& d, T t,
                                   T rounding) {
  T const zero(lane_t<T>(0)), at_d = dot(m, absolute(d));
  T const scale = fma(-rounding, at_d, abs(dot(n, d)));
  T const off = rounding * fma(abs(t), at_d, dot(m, absolute(ao))) * sqrt(dot(d, d));
  return select(zero < scale, off / scale, T(std::numeric_limits<lane_t<T>>::infinity()));
}

}  // namespace detail

/// t, u and v of a crossing: u and v within [0, 1] but for two roundings.
template <scalar T> PATCHRT_INLINE triangle_hit<T> normalised(triangle_crossing<T> const& c) {
  T const inverse = T(lane_t<T>(1)) / ((c.u + c.v) + c.w);
  return {c.distance / c.scale, c.u * inverse, c.v * inverse, c.valid};
}

/// Where a ray meets a triangle at t_min < t < t_max. Edges and vertices count as inside.
/// \return A triangle without an area, and whatever has a NaN or an infinite vertex, is missed. How wrong t may be is
///         for `Form::position_error` to say.
template <class Form, faces F = faces::both, class Ray, class Triangle, scalar T>
PATCHRT_INLINE triangle_hit<T> intersect(Ray const& ray, Triangle const& prepared, T t_min, T t_max) {
  auto const c = Form::template meet<F>(ray, prepared, t_min, t_max);
  if (!any_of(c.valid)) return {c.distance, c.u, c.v, c.valid};
  auto h = normalised(c);
  h.valid = h.valid && t_min < h.t && h.t < t_max;
  return h;
}

/// The same for one ray and one triangle that are not kept.
template <class Form, faces F = faces::both, scalar T>
PATCHRT_INLINE triangle_hit<T> intersect(ray<T> const& r, triangle<T> const& t) {
  return intersect<Form, F>(Form::make_ray(r.origin, r.direction), Form::prepare(t), r.t_min, r.t_max);
}

/// The ray engine's form: a plane, and three edges that the ray passes on the same side.
///
/// With ao = o - a, bo = o - b: t = -n.ao / n.d, and (1 - u - v, u, v) in the ratio of -bc.(bo x d), ac.(ao x d) and
/// -ab.(ao x d).
/// \note Carr, Hall & Hart, "The Ray Engine", Graphics Hardware 2002, eqs. 1-8. Eq. 8 is printed without its minus
///       sign.
struct engine_form {
  template <scalar S> struct prepared {
    vec3<S> a;
    vec3<S> b;
    vec3<S> n;
    vec3<S> ac;
    vec3<S> ba;
    vec3<S> cb;
  };
  template <scalar R> struct ray_constants {
    vec3<R> origin;
    vec3<R> direction;
  };

  template <scalar S> PATCHRT_HD static prepared<S> prepare(triangle<S> const& t) {
    auto const [a, b, c] = detail::with_area(t);
    return {a, b, normal(triangle<S>{a, b, c}), difference(c, a), difference(a, b), difference(b, c)};
  }
  template <scalar R> PATCHRT_INLINE static ray_constants<R> make_ray(vec3<R> const& origin, vec3<R> const& direction) {
    return {origin, direction};
  }

  template <faces F = faces::both, scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_INLINE static triangle_crossing<T> meet(ray_constants<R> const& r, prepared<S> const& p, T t_min, T t_max) {
    vec3<T> const o = detail::in_lanes<T>(r.origin), d = detail::in_lanes<T>(r.direction);
    vec3<T> const ao = difference(o, detail::in_lanes<T>(p.a)), bo = difference(o, detail::in_lanes<T>(p.b));
    vec3<T> const aod = patchrt::cross(ao, d), bod = patchrt::cross(bo, d);
    T const u = dot(detail::in_lanes<T>(p.ac), aod);
    T const v = dot(detail::in_lanes<T>(p.ba), aod);
    T const w = dot(detail::in_lanes<T>(p.cb), bod);
    return detail::cross_in_range<F, std::same_as<R, T>>(u, v, w, t_min, t_max, [&] {
      vec3<T> const n = detail::in_lanes<T>(p.n);
      return detail::plane_crossing<T>{dot(n, ao), -dot(n, d)};
    });
  }

  /// How far origin + t direction may be from where the exact ray meets the exact triangle's plane, to first order in
  /// epsilon; infinite where rounding hides whether it does.
  ///
  /// A component of n is within 4 u of the sum m of its products: u for either edge, 2 u by Kahan's form. ao takes u,
  /// a dot product 3 u: 8 u m.|ao| for the distance, 7 u m.|d| for the scale, u |t| for the quotient.
  template <scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_HD static T position_error(ray_constants<R> const& r, prepared<S> const& p, T t) {
    auto const [first, second] = detail::shorter_edges(p.ba, p.cb, p.ac);
    vec3<T> const d = detail::in_lanes<T>(r.direction);
    vec3<T> const ao = difference(detail::in_lanes<T>(r.origin), detail::in_lanes<T>(p.a));
    T const rounding(lane_t<T>(4) * std::numeric_limits<lane_t<T>>::epsilon());
    return detail::determinant_error(
        detail::in_lanes<T>(p.n), detail::in_lanes<T>(detail::cross_of_magnitudes(first, second)), ao, d, t, rounding);
  }
};

/// Moller and Trumbore's form: a vertex and two edges, no normal. The least to keep of a triangle and the fewest
/// operations where nothing is prepared.
/// \note Moller & Trumbore, "Fast, minimum storage ray-triangle intersection", Journal of Graphics Tools 2(1), 1997.
struct moller_trumbore_form {
  template <scalar S> struct prepared {
    vec3<S> a;
    vec3<S> ab;
    vec3<S> ac;
  };
  template <scalar R> using ray_constants = engine_form::ray_constants<R>;

  template <scalar S> PATCHRT_HD static prepared<S> prepare(triangle<S> const& t) {
    auto const [a, b, c] = detail::with_area(t);
    return {a, difference(b, a), difference(c, a)};
  }
  template <scalar R> PATCHRT_INLINE static ray_constants<R> make_ray(vec3<R> const& origin, vec3<R> const& direction) {
    return {origin, direction};
  }

  template <faces F = faces::both, scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_INLINE static triangle_crossing<T> meet(ray_constants<R> const& r, prepared<S> const& p, T t_min, T t_max) {
    vec3<T> const d = detail::in_lanes<T>(r.direction);
    vec3<T> const ab = detail::in_lanes<T>(p.ab), ac = detail::in_lanes<T>(p.ac);
    vec3<T> const ao = difference(detail::in_lanes<T>(r.origin), detail::in_lanes<T>(p.a));
    vec3<T> const across = fused_cross(d, ac), along = fused_cross(ao, ab);
    T const determinant = dot(ab, across), u = dot(ao, across), v = dot(d, along);
    return detail::cross_in_range<F, std::same_as<R, T>>(u, v, determinant - (u + v), t_min, t_max, [&] {
      return detail::plane_crossing<T>{dot(ac, along), determinant};
    });
  }

  /// How far origin + t direction may be from where the exact ray meets the exact triangle's plane, to first order in
  /// epsilon; infinite where rounding hides whether it does.
  ///
  /// Both determinants take u for each rounded edge and for ao, 2 u for the cross product and 3 u for the dot product,
  /// of the sums of their products: 8 u m.|ao| and 7 u m.|d|, m those of ab x ac.
  template <scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_HD static T position_error(ray_constants<R> const& r, prepared<S> const& p, T t) {
    vec3<T> const d = detail::in_lanes<T>(r.direction);
    vec3<T> const ao = difference(detail::in_lanes<T>(r.origin), detail::in_lanes<T>(p.a));
    T const rounding(lane_t<T>(4) * std::numeric_limits<lane_t<T>>::epsilon());
    return detail::determinant_error(detail::in_lanes<T>(patchrt::cross(p.ab, p.ac)),
                                     detail::in_lanes<T>(detail::cross_of_magnitudes(p.ab, p.ac)), ao, d, t, rounding);
  }
};

}  // namespace patchrt
