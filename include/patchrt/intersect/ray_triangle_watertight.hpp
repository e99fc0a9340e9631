// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/intersect/ray_triangle.hpp>

#include <concepts>
#include <cstdint>

namespace patchrt {

/// The watertight form: a ray through the common edge or vertex of triangles hits one of them, whatever rounding does.
///
/// The vertices, seen from the origin, are sheared so that the ray is the axis of depth; what is left of them are two
/// coordinates x, y, each by one fused operation. These depend on the vertex and the ray alone, so that triangles that
/// share a vertex agree about it, and the three edge functions x y' - y x' have the exact signs of what the rounded
/// coordinates are: Kahan's difference of two products is within 2 u of it, so that it is 0 where it should be and
/// nowhere else. The neighbours of an edge have opposite signs there, or 0 both, and 0 counts as inside.
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
  /// Which axes of space are a single ray's own x, y and z.
  struct axis_order {
    std::uint32_t x;
    std::uint32_t y;
    std::uint32_t z;
  };
  struct no_order {};
  /// A ray's own axes are those of space in turn, so that the direction's greatest component is its z. Seen from the
  /// origin and in these axes, a point p is at x = p.x + shear_x p.z, y = p.y + shear_y p.z and a depth of p.z inverse.
  template <scalar R> struct ray_constants {
    vec3<R> origin;
    vec3<R> own_origin;
    R shear_x;
    R shear_y;
    R inverse;
    mask_t<R> x_deepest;
    mask_t<R> y_deepest;  ///< the deepest is z where neither is
    vec3<R> direction;
    [[no_unique_address]] std::conditional_t<std::floating_point<R>, axis_order, no_order> order;
  };

  template <scalar S> PATCHRT_HD static prepared<S> prepare(triangle<S> const& t) {
    auto const [a, b, c] = detail::with_area(t);
    return {a, b, c};
  }

  /// A direction of 0 or an infinite one gives NaN, and so no hit.
  template <scalar R> PATCHRT_HD static ray_constants<R> make_ray(vec3<R> const& origin, vec3<R> const& d) {
    R const zero(lane_t<R>(0)), x = abs(d.x), y = abs(d.y), z = abs(d.z);
    auto const x_deepest = z <= x && y <= x;
    ray_constants<R> r{origin, origin, zero, zero, zero, x_deepest, !x_deepest && z <= y, d, {}};
    if constexpr (std::floating_point<R>) {
      std::uint32_t const first = std::uint32_t(x_deepest) + 2 * std::uint32_t(r.y_deepest);
      std::uint32_t const second = (1u << first) & 3u;  // branches on what rays differ in would be mispredicted
      r.order = {first, second, 3u - first - second};
    }
    r.own_origin = in_own_axes<R>(r, origin);
    vec3<R> const own = in_own_axes<R>(r, d);
    r.inverse = (R(lane_t<R>(1)) + (own.z - own.z)) / own.z;
    r.shear_x = -own.x / own.z;
    r.shear_y = -own.y / own.z;
    return r;
  }

  template <faces F = faces::both, scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_INLINE static triangle_crossing<T> meet(ray_constants<R> const& r, prepared<S> const& p, T t_min, T t_max) {
    return meet_in_own_axes<F>(r, prepared<T>{in_own_axes<T>(r, p.a), in_own_axes<T>(r, p.b), in_own_axes<T>(r, p.c)},
                               t_min, t_max);
  }

  /// The same of vertices whose coordinates come in the ray's order.
  template <faces F = faces::both, scalar T, lanes_of<T> R>
  PATCHRT_INLINE static triangle_crossing<T> meet_in_own_axes(ray_constants<R> const& r, prepared<T> const& p, T t_min,
                                                              T t_max) {
    vec3<T> const o = detail::in_lanes<T>(r.own_origin);
    T const shear_x(r.shear_x), shear_y(r.shear_y);
    vec3<T> const a = difference(p.a, o), b = difference(p.b, o), c = difference(p.c, o);
    T const ax = fma(shear_x, a.z, a.x), ay = fma(shear_y, a.z, a.y);
    T const bx = fma(shear_x, b.z, b.x), by = fma(shear_y, b.z, b.y);
    T const cx = fma(shear_x, c.z, c.x), cy = fma(shear_y, c.z, c.y);
    T w = difference_of_products(cx, by, cy, bx);
    T u = difference_of_products(ax, cy, ay, cx);
    T v = difference_of_products(bx, ay, by, ax);
    if constexpr (F == faces::front) {  // own axes seen from behind turn the other way
      T const facing = copysign(T(lane_t<T>(1)), T(r.inverse));
      u = facing * u;
      v = facing * v;
      w = facing * w;
    }
    return detail::cross_in_range<F, std::same_as<R, T>>(u, v, w, t_min, t_max, [&] {
      T const distance = T(r.inverse) * fma(u, b.z, fma(v, c.z, w * a.z));
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
    T const zero(L(0)), inverse = abs(T(r.inverse));
    vec3<T> const along{pick<T>(r, inverse, zero, zero), pick<T>(r, zero, inverse, zero),
                        pick<T>(r, zero, zero, inverse)};
    auto const [first, second] = detail::shorter_edges(triangle<S>{p.a, p.b, p.c});
    vec3<T> const n = detail::in_lanes<T>(patchrt::cross(first, second));
    vec3<T> const products = detail::in_lanes<T>(detail::cross_of_magnitudes(first, second));
    vec3<T> const a = absolute(difference(detail::in_lanes<T>(p.a), o));
    vec3<T> const b = absolute(difference(detail::in_lanes<T>(p.b), o));
    vec3<T> const c = absolute(difference(detail::in_lanes<T>(p.c), o));
    vec3<T> const m{max(a.x, max(b.x, c.x)), max(a.y, max(b.y, c.y)), max(a.z, max(b.z, c.z))};
    T const eps(std::numeric_limits<L>::epsilon()), reach = dot(along, m);
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

 private:
  /// x, y or z, by the axis that is deepest.
  template <scalar T, lanes_of<T> R> PATCHRT_INLINE static T pick(ray_constants<R> const& r, T x, T y, T z) {
    if constexpr (std::same_as<R, T>) return select(r.x_deepest, x, select(r.y_deepest, y, z));
    else return r.x_deepest ? x : r.y_deepest ? y : z;
  }
  template <scalar T, lanes_of<T> R, lanes_of<T> S>
  PATCHRT_INLINE static vec3<T> in_own_axes(ray_constants<R> const& r, vec3<S> const& v) {
    if constexpr (std::same_as<R, T>) {
      vec3<T> const p = detail::in_lanes<T>(v);
      return {pick(r, p.y, p.z, p.x), pick(r, p.z, p.x, p.y), pick(r, p.x, p.y, p.z)};
    } else {
      return {v[int(r.order.x)], v[int(r.order.y)], v[int(r.order.z)]};
    }
  }
};

}  // namespace patchrt
