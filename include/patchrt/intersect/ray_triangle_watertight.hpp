// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/intersect/ray_triangle.hpp>

namespace patchrt {

/// The watertight form: a ray through the common edge or vertex of triangles hits one of them, whatever rounding does.
///
/// The vertices, seen from the origin, are sheared so that the ray is the axis of depth; what is left of them are two
/// coordinates x, y. These depend on the vertex and the ray alone, so that triangles that share a vertex agree about
/// it, and the three edge functions x y' - y x' have the exact signs of what the rounded coordinates are: Kahan's
/// difference of two products is within 2 u of it, so that it is 0 where it should be and nowhere else. The neighbours
/// of an edge have opposite signs there, or 0 both, and 0 counts as inside.
/// \pre No product of two coordinates, seen from the origin, underflows, nor does the product's rounding error:
///      coordinates there are 0 or, in float, above 1e-15.
/// \note Woop, Benthin & Wald, "Watertight ray/triangle intersection", JCGT 2(1), 2013. There the two products are
///       rounded, which for a difference of 0 may hide its sign: those are computed again in double. On Kahan's form:
///       Jeannerod, Louvet & Muller, Math. Comp. 82, 2013.
struct watertight_form {
  template <scalar S> struct prepared {
    vec3<S> a;
    vec3<S> b;
    vec3<S> c;
  };
  /// x = across.p, y = up.p and depth = along.p of a point p seen from the origin; across and up have a 1 and a 0.
  template <scalar R> struct ray_constants {
    vec3<R> origin;
    vec3<R> across;
    vec3<R> up;
    vec3<R> along;
    vec3<R> direction;
  };

  template <scalar S> PATCHRT_HD static prepared<S> prepare(triangle<S> const& t) {
    auto const [a, b, c] = detail::with_area(t);
    return {a, b, c};
  }

  /// The axis of the direction's greatest component is divided by; x and y are the others, in the order that leaves
  /// front faces positive. A direction of 0 or an infinite one gives NaN, and so no hit.
  template <scalar R> PATCHRT_HD static ray_constants<R> make_ray(vec3<R> const& origin, vec3<R> const& d) {
    R const zero(lane_t<R>(0)), x = abs(d.x), y = abs(d.y), z = abs(d.z);
    auto const x_most = z <= x && y <= x;
    auto const y_most = !x_most && z <= y;
    R const deepest = select(x_most, d.x, select(y_most, d.y, d.z));
    R const one = R(lane_t<R>(1)) + (deepest - deepest), inverse = one / deepest;
    R const sx = -d.x / deepest, sy = -d.y / deepest, sz = -d.z / deepest;
    vec3<R> const first =
        select(x_most, vec3<R>{sy, one, zero}, select(y_most, vec3<R>{zero, sz, one}, vec3<R>{one, zero, sx}));
    vec3<R> const second =
        select(x_most, vec3<R>{sz, zero, one}, select(y_most, vec3<R>{one, sx, zero}, vec3<R>{zero, one, sy}));
    vec3<R> const along = select(x_most, vec3<R>{inverse, zero, zero},
                                 select(y_most, vec3<R>{zero, inverse, zero}, vec3<R>{zero, zero, inverse}));
    auto const forward = zero < deepest;
    return {origin, select(forward, first, second), select(forward, second, first), along, d};
  }

  template <faces F = faces::both, scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_INLINE static triangle_crossing<T> meet(ray_constants<R> const& r, prepared<S> const& p, T t_min, T t_max) {
    vec3<T> const o = detail::in_lanes<T>(r.origin);
    vec3<T> const across = detail::in_lanes<T>(r.across), up = detail::in_lanes<T>(r.up);
    vec3<T> const a = difference(detail::in_lanes<T>(p.a), o);
    vec3<T> const b = difference(detail::in_lanes<T>(p.b), o);
    vec3<T> const c = difference(detail::in_lanes<T>(p.c), o);
    T const ax = dot(across, a), ay = dot(up, a);
    T const bx = dot(across, b), by = dot(up, b);
    T const cx = dot(across, c), cy = dot(up, c);
    T const w = difference_of_products(cx, by, cy, bx);
    T const u = difference_of_products(ax, cy, ay, cx);
    T const v = difference_of_products(bx, ay, by, ax);
    return detail::cross_in_range<F, std::same_as<R, T>>(u, v, w, t_min, t_max, [&] {
      vec3<T> const along = detail::in_lanes<T>(r.along);
      T const distance = fma(u, dot(along, b), fma(v, dot(along, c), w * dot(along, a)));
      return detail::plane_crossing<T>{distance, (u + v) + w};
    });
  }

  /// How far origin + t direction may be from where the exact ray meets the exact triangle, to first order in epsilon;
  /// infinite where rounding hides whether it does.
  ///
  /// The hit is that of a triangle whose vertices are moved. With m the largest components of the vertices seen from
  /// the origin, s = m_z / |d_z| along the axis z that is divided by: by 2 u m_x + 4 u |d_x| s along each other axis x,
  /// of which the plane makes (n_x / n.d) of t; by 3 u s along the ray. The weights take 4 u, the weighted sum 5 u, the
  /// quotient u.
  template <scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_HD static T position_error(ray_constants<R> const& r, prepared<S> const& p, T) {
    using L = lane_t<T>;
    vec3<T> const o = detail::in_lanes<T>(r.origin), d = detail::in_lanes<T>(r.direction);
    vec3<T> const along = absolute(detail::in_lanes<T>(r.along));
    auto const [first, second] = detail::shorter_edges(triangle<S>{p.a, p.b, p.c});
    vec3<T> const n = detail::in_lanes<T>(patchrt::cross(first, second));
    vec3<T> const products = detail::in_lanes<T>(detail::cross_of_magnitudes(first, second));
    vec3<T> const a = absolute(difference(detail::in_lanes<T>(p.a), o));
    vec3<T> const b = absolute(difference(detail::in_lanes<T>(p.b), o));
    vec3<T> const c = absolute(difference(detail::in_lanes<T>(p.c), o));
    vec3<T> const m{max(a.x, max(b.x, c.x)), max(a.y, max(b.y, c.y)), max(a.z, max(b.z, c.z))};
    T const zero(L(0)), eps(std::numeric_limits<L>::epsilon()), reach = dot(along, m);
    auto const lateral = [&](T n_k, T products_k, T along_k, T m_k, T d_k) {
      T const slope = fma(T(L(2)) * eps, products_k, abs(n_k));
      return select(zero < along_k, zero, slope * fma(T(L(2)) * abs(d_k), reach, m_k));
    };
    T const off = lateral(n.x, products.x, along.x, m.x, d.x) + lateral(n.y, products.y, along.y, m.y, d.y) +
                  lateral(n.z, products.z, along.z, m.z, d.z);
    T const scale = fma(-(T(L(4)) * eps), dot(products, absolute(d)), abs(dot(n, d)));
    T const error = eps * fma(T(L(7)), reach, off / scale) * sqrt(dot(d, d));
    return select(zero < scale, error, T(std::numeric_limits<L>::infinity()));
  }
};

}  // namespace patchrt
