// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/affine.hpp>

namespace patchrt {

/// The surface f(p) = p.Qp + 2 b.p + c = 0, f < 0 inside: sphere, ellipsoid, cylinder, cone, paraboloid, hyperboloid,
/// plane, pairs of planes. The ten numbers are those of the symmetric 4 x 4 matrix
///
///     A B C D         A x^2 + 2 B x y + 2 C x z + 2 D x
///     B E F G             +  E y^2 + 2 F y z + 2 G y
///     C F H I                      +  H z^2 + 2 I z
///     D G I J                               + J = 0.
template <class T> struct quadric {
  vec3<T> squares;   ///< of x^2, y^2, z^2: A, E, H
  vec3<T> products;  ///< half those of y z, x z, x y: F, C, B
  vec3<T> linear;    ///< half those of x, y, z: D, G, I
  T constant;        ///< J

  friend PATCHRT_HD bool operator==(quadric const& q, quadric const& r) {
    return q.squares == r.squares && q.products == r.products && q.linear == r.linear && q.constant == r.constant;
  }
};

/// Whether f has terms in y z, x z or x y, or NaN there: without, Q is diagonal.
template <scalar T> PATCHRT_INLINE mask_t<T> has_products(quadric<T> const& q) {
  return !(sum_of_magnitudes(q.products) <= T(0));
}

/// Q v, three roundings a term.
template <scalar T> PATCHRT_INLINE vec3<T> multiply(quadric<T> const& q, vec3<T> const& v) {
  vec3<T> const &s = q.squares, &m = q.products;
  return {fma(s.x, v.x, fma(m.z, v.y, m.y * v.z)), fma(m.z, v.x, fma(s.y, v.y, m.x * v.z)),
          fma(m.y, v.x, fma(m.x, v.y, s.z * v.z))};
}

/// Half the gradient of f at p: Q p + b. Where f = 0, it points to where f > 0.
template <scalar T> PATCHRT_INLINE vec3<T> half_gradient(quadric<T> const& q, vec3<T> const& p) {
  vec3<T> const &s = q.squares, &m = q.products, &b = q.linear;
  return {fma(s.x, p.x, fma(m.z, p.y, fma(m.y, p.z, b.x))), fma(m.z, p.x, fma(s.y, p.y, fma(m.x, p.z, b.y))),
          fma(m.y, p.x, fma(m.x, p.y, fma(s.z, p.z, b.z)))};
}

namespace detail {
/// f(p) = p.(g + b) + c from g = `half_gradient`.
template <scalar T> PATCHRT_INLINE T value_from_gradient(quadric<T> const& q, vec3<T> const& p, vec3<T> const& g) {
  vec3<T> const w = sum(g, q.linear);
  return fma(p.x, w.x, fma(p.y, w.y, fma(p.z, w.z, q.constant)));
}
}  // namespace detail

/// f(p) by seven roundings: within 3.5 eps (|p|.|Q||p| + 2 |b|.|p| + |c|), components' magnitudes.
template <scalar T> PATCHRT_INLINE T evaluate(quadric<T> const& q, vec3<T> const& p) {
  return detail::value_from_gradient(q, p, half_gradient(q, p));
}

/// The form of p -> f(m p): what f is in coordinates that `m` maps to f's own.
template <scalar T> PATCHRT_HD quadric<T> compose(quadric<T> const& q, affine<T> const& m) {
  vec3<T> const qx = multiply(q, m.x), qy = multiply(q, m.y), qz = multiply(q, m.z);
  vec3<T> const g = half_gradient(q, m.translation);
  return {{dot(m.x, qx), dot(m.y, qy), dot(m.z, qz)},
          {dot(m.y, qz), dot(m.z, qx), dot(m.x, qy)},
          {dot(m.x, g), dot(m.y, g), dot(m.z, g)},
          detail::value_from_gradient(q, m.translation, g)};
}

/// The form of the surface's image under `m`.
/// \throws std::invalid_argument as `inverse`, where `m` is singular.
template <std::floating_point T> quadric<T> transform(affine<T> const& m, quadric<T> const& q) {
  return compose(q, inverse(m));
}

/// x^2 + y^2 + z^2 = 1.
template <class T> PATCHRT_HD quadric<T> unit_sphere() {
  T const o(0), i(1);
  return {{i, i, i}, {o, o, o}, {o, o, o}, T(-1)};
}
/// x^2 + y^2 = 1.
template <class T> PATCHRT_HD quadric<T> unit_cylinder() {
  T const o(0), i(1);
  return {{i, i, o}, {o, o, o}, {o, o, o}, T(-1)};
}
/// x^2 + y^2 = z^2: both nappes, the apex at 0.
template <class T> PATCHRT_HD quadric<T> unit_cone() {
  T const o(0), i(1);
  return {{i, i, T(-1)}, {o, o, o}, {o, o, o}, o};
}
/// x^2 + y^2 = z.
template <class T> PATCHRT_HD quadric<T> unit_paraboloid() {
  T const o(0), i(1);
  return {{i, i, o}, {o, o, o}, {o, o, T(-0.5)}, o};
}
/// x^2 + y^2 - z^2 = 1.
template <class T> PATCHRT_HD quadric<T> unit_hyperboloid_one_sheet() {
  T const o(0), i(1);
  return {{i, i, T(-1)}, {o, o, o}, {o, o, o}, T(-1)};
}
/// x^2 + y^2 - z^2 = -1: sheets from z = 1 upward and from z = -1 downward.
template <class T> PATCHRT_HD quadric<T> unit_hyperboloid_two_sheets() {
  T const o(0), i(1);
  return {{i, i, T(-1)}, {o, o, o}, {o, o, o}, i};
}
/// z = 0, inside below.
template <class T> PATCHRT_HD quadric<T> unit_plane() {
  T const o(0);
  return {{o, o, o}, {o, o, o}, {o, o, T(0.5)}, o};
}

}  // namespace patchrt
