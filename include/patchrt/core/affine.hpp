// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Affine maps of space: where shapes and instances are. A ray is mapped without making its direction of length 1
/// again, so that t is the same on both sides.

#include <patchrt/core/box.hpp>
#include <patchrt/core/ray.hpp>

#include <cmath>
#include <concepts>
#include <limits>
#include <stdexcept>
#include <string>

namespace patchrt {

/// The map p -> x p.x + y p.y + z p.z + translation.
template <class T> struct affine {
  vec3<T> x;  ///< where the first axis goes: the first column of the matrix
  vec3<T> y;
  vec3<T> z;
  vec3<T> translation;  ///< where the origin goes

  PATCHRT_HD static affine identity() { return scaling({T(1), T(1), T(1)}); }
  PATCHRT_HD static affine scaling(vec3<T> const& factors) {
    T const o(0);
    return {{factors.x, o, o}, {o, factors.y, o}, {o, o, factors.z}, {o, o, o}};
  }
  PATCHRT_HD static affine shift(vec3<T> const& by) {
    affine a = identity();
    a.translation = by;
    return a;
  }
  /// By `angle` radians about an axis through the origin, counterclockwise seen from its tip.
  /// \pre `axis` is not 0.
  static affine rotation(vec3<T> const& axis, T angle) {
    T const length = std::sqrt(dot(axis, axis)), c = std::cos(angle), s = std::sin(angle);
    vec3<T> const n = scale(axis, T(1) / length), m = scale(n, T(1) - c), k = scale(n, s);
    return {{fma(n.x, m.x, c), fma(n.y, m.x, k.z), fma(n.z, m.x, -k.y)},
            {fma(n.x, m.y, -k.z), fma(n.y, m.y, c), fma(n.z, m.y, k.x)},
            {fma(n.x, m.z, k.y), fma(n.y, m.z, -k.x), fma(n.z, m.z, c)},
            {T(0), T(0), T(0)}};
  }

  friend PATCHRT_HD bool operator==(affine const& a, affine const& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z && a.translation == b.translation;
  }
};

/// The linear part of `a` times v. One map for all lanes of v, or one for each.
///
/// Three roundings: a component is within 1.5 eps of the sum of its terms' magnitudes.
template <scalar T, std::convertible_to<T> B>
PATCHRT_INLINE vec3<T> transform_vector(affine<B> const& a, vec3<T> const& v) {
  return {fma(T(a.x.x), v.x, fma(T(a.y.x), v.y, T(a.z.x) * v.z)),
          fma(T(a.x.y), v.x, fma(T(a.y.y), v.y, T(a.z.y) * v.z)),
          fma(T(a.x.z), v.x, fma(T(a.y.z), v.y, T(a.z.z) * v.z))};
}

/// The place of the point p, by three roundings as well.
template <scalar T, std::convertible_to<T> B>
PATCHRT_INLINE vec3<T> transform_point(affine<B> const& a, vec3<T> const& p) {
  return {fma(T(a.x.x), p.x, fma(T(a.y.x), p.y, fma(T(a.z.x), p.z, T(a.translation.x)))),
          fma(T(a.x.y), p.x, fma(T(a.y.y), p.y, fma(T(a.z.y), p.z, T(a.translation.y)))),
          fma(T(a.x.z), p.x, fma(T(a.y.z), p.y, fma(T(a.z.z), p.z, T(a.translation.z))))};
}

/// The normal of a surface after a map, of another length, from that before it: n times the inverse.
/// \param inverse the inverse of the map.
template <scalar T, std::convertible_to<T> B>
PATCHRT_INLINE vec3<T> transform_normal(affine<B> const& inverse, vec3<T> const& n) {
  return {dot(convert_vec<T>(inverse.x), n), dot(convert_vec<T>(inverse.y), n), dot(convert_vec<T>(inverse.z), n)};
}

/// The ray through the images of r's points, each at the same t.
template <scalar T, std::convertible_to<T> B> PATCHRT_INLINE ray<T> transform(affine<B> const& a, ray<T> const& r) {
  return {transform_point(a, r.origin), transform_vector(a, r.direction), r.t_min, r.t_max};
}

/// The map that does b first, then a.
template <scalar T> PATCHRT_HD affine<T> operator*(affine<T> const& a, affine<T> const& b) {
  return {transform_vector(a, b.x), transform_vector(a, b.y), transform_vector(a, b.z),
          transform_point(a, b.translation)};
}

namespace detail {

/// One coordinate of the box of a box's image: of the row m of a map, and its translation.
template <class T> PATCHRT_HD void transform_extent(vec3<T> const& m, T translation, box<T> const& b, T& lo, T& hi) {
  lo = translation, hi = translation;
  T reach = abs(translation);
  for (int k = 0; k < 3; ++k) {
    T const factor = component(m, k);
    if (factor == T(0)) continue;  // times infinity too
    T const u = factor * component(b.lo, k), v = factor * component(b.hi, k);
    lo = lo + min(u, v);
    hi = hi + max(u, v);
    reach = reach + max(abs(u), abs(v));
  }
  T const widening = reach * T(4 * std::numeric_limits<lane_t<T>>::epsilon());
  if (widening <= std::numeric_limits<T>::max()) lo = lo - widening, hi = hi + widening;
}

}  // namespace detail

/// The box of the images of all points of b.
///
/// On each side wider than the tightest by at most 8 eps (|translation| + the sum of |factor coordinate|), so that no
/// image is outside, as `transform_point` computes it either. Infinite sides stay so where the map does not forget
/// them; an empty box stays empty.
/// \note Arvo, "Transforming axis-aligned bounding boxes", Graphics Gems, 1990.
template <class T> PATCHRT_HD box<T> transform(affine<T> const& a, box<T> const& b) {
  if (is_empty(b)) return box<T>::empty();
  box<T> r;
  detail::transform_extent<T>({a.x.x, a.y.x, a.z.x}, a.translation.x, b, r.lo.x, r.hi.x);
  detail::transform_extent<T>({a.x.y, a.y.y, a.z.y}, a.translation.y, b, r.lo.y, r.hi.y);
  detail::transform_extent<T>({a.x.z, a.y.z, a.z.z}, a.translation.z, b, r.lo.z, r.hi.z);
  return r;
}

/// The map that undoes `a`.
///
/// Columns are scaled by powers of two to the size of 1; the rows of the inverse are their cross products (each
/// component within 1.5 eps) over the determinant. Entries are within a few eps of the inverse where the columns are
/// near right angles, and lose a digit for each digit that the determinant cancels.
/// \return A map with finite numbers.
/// \throws std::invalid_argument where a number is not finite, where rounding cannot tell the determinant from 0, and
///         where the inverse overflows.
template <std::floating_point T> affine<T> inverse(affine<T> const& a) {
  auto const fail = [](std::string const& why) {
    throw std::invalid_argument("inverse: the map " + why + ", expected one that can be undone");
  };
  constexpr T largest = std::numeric_limits<T>::max(), eps = std::numeric_limits<T>::epsilon();
  auto const size_of = [](vec3<T> const& v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); };
  vec3<T> column[3] = {a.x, a.y, a.z};
  T factor[3];
  auto const is_finite = [&](vec3<T> const& v) {
    return abs(v.x) <= largest && abs(v.y) <= largest && abs(v.z) <= largest;
  };
  if (!(is_finite(a.x) && is_finite(a.y) && is_finite(a.z) && is_finite(a.translation)))
    fail("has a number that is not finite");
  for (int k = 0; k < 3; ++k) {
    if (size_of(column[k]) == T(0)) fail("is singular: column " + std::to_string(k) + " is 0");
    factor[k] = std::ldexp(T(1), -std::ilogb(size_of(column[k])));
    if (!(factor[k] <= largest)) fail("is too small: its inverse overflows");
    column[k] = scale(column[k], factor[k]);
  }
  vec3<T> row[3] = {cross(column[1], column[2]), cross(column[2], column[0]), cross(column[0], column[1])};
  T const determinant = dot(column[0], row[0]);
  T const terms = dot(absolute(column[0]), absolute(row[0]));
  if (!(abs(determinant) > 8 * eps * terms)) fail("is singular: its determinant is 0 but for rounding");
  for (int k = 0; k < 3; ++k) {
    row[k] = scale({row[k].x / determinant, row[k].y / determinant, row[k].z / determinant}, factor[k]);
    if (!(size_of(row[k]) <= largest)) fail("is too small: its inverse overflows");
  }
  affine<T> r{{row[0].x, row[1].x, row[2].x}, {row[0].y, row[1].y, row[2].y}, {row[0].z, row[1].z, row[2].z}, {}};
  r.translation = -transform_vector(r, a.translation);
  if (!(size_of(r.translation) <= largest)) fail("is too small: its inverse overflows");
  return r;
}

}  // namespace patchrt
