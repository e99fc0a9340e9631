// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/box.hpp>

#include <limits>

namespace patchrt {

/// The points (1 - u - v) a + u b + v c with u, v and 1 - u - v not negative.
template <class T> struct triangle {
  vec3<T> a;
  vec3<T> b;
  vec3<T> c;
  friend PATCHRT_HD bool operator==(triangle const& x, triangle const& y) {
    return x.a == y.a && x.b == y.b && x.c == y.c;
  }
};

/// The smallest box that holds t.
template <class T> PATCHRT_INLINE box<T> bounds(triangle<T> const& t) {
  return merge(merge(box<T>{t.a, t.a}, t.b), t.c);
}

/// (1 - u - v) a + u b + v c, from a: within 3 u (|a b| + |a c|) in every coordinate, and a last rounding.
template <scalar P, scalar T> PATCHRT_INLINE vec3<T> position(triangle<P> const& t, T u, T v) {
  vec3<T> const a = convert_vec<T>(t.a);
  vec3<T> const ab = difference(convert_vec<T>(t.b), a), ac = difference(convert_vec<T>(t.c), a);
  return sum(a, fma(u, ab, scale(ac, v)));
}

namespace detail {

/// Two edges of a triangle that follow each other.
template <scalar T> struct edge_pair {
  vec3<T> first;
  vec3<T> second;
};

/// Of the edges ab, bc and ca the two that are not the longest, which enclose an angle of 60 degrees or more: of
/// needles, their product loses least. All three products are the same but for rounding.
template <scalar T> PATCHRT_INLINE edge_pair<T> shorter_edges(vec3<T> const& ab, vec3<T> const& bc, vec3<T> const& ca) {
  T const at_ab = sum_of_magnitudes(ab), at_bc = sum_of_magnitudes(bc), at_ca = sum_of_magnitudes(ca);
  auto const without_bc = at_ab <= at_bc && at_ca <= at_bc;
  auto const without_ca = !without_bc && at_ab <= at_ca;
  return {select(without_bc, ca, select(without_ca, ab, bc)), select(without_bc, ab, select(without_ca, bc, ca))};
}
template <scalar T> PATCHRT_INLINE edge_pair<T> shorter_edges(triangle<T> const& t) {
  return shorter_edges(difference(t.b, t.a), difference(t.c, t.b), difference(t.a, t.c));
}

/// (|a.y b.z| + |a.z b.y|, ...): what the rounding of a cross product and of its operands is in proportion to.
template <scalar T> PATCHRT_INLINE vec3<T> cross_of_magnitudes(vec3<T> const& a, vec3<T> const& b) {
  vec3<T> const x = absolute(a), y = absolute(b);
  return {fma(x.y, y.z, x.z * y.y), fma(x.z, y.x, x.x * y.z), fma(x.x, y.y, x.y * y.x)};
}

/// Whether (a, b), (c, d) and (e, f) of a plane are not on a line: an exact sum of products and their roundings, unless
/// these underflow.
/// \note Shewchuk, "Adaptive precision floating-point arithmetic and fast robust geometric predicates", Discrete &
///       Computational Geometry 18, 1997, theorem 10 (GROW-EXPANSION).
template <scalar T> PATCHRT_HD mask_t<T> is_off_line(T a, T b, T c, T d, T e, T f) {
  constexpr int products = 6;
  T const left[products] = {a, -b, c, -d, e, -f}, right[products] = {d, c, f, e, b, a};
  T word[2 * products];
  auto const grow = [&word](int size, T x) {
    PATCHRT_UNROLL
    for (int i = 0; i < size; ++i) {
      T const s = x + word[i], t = s - x;
      word[i] = (x - (s - t)) + (word[i] - t);
      x = s;
    }
    word[size] = x;
  };
  PATCHRT_UNROLL
  for (int k = 0; k < products; ++k) {
    T const p = left[k] * right[k];
    grow(2 * k, fma(left[k], right[k], -p));
    grow(2 * k + 1, p);
  }
  T largest = abs(word[0]);
  PATCHRT_UNROLL
  for (int i = 1; i < 2 * products; ++i) largest = max(abs(word[i]), largest);
  return T(lane_t<T>(0)) < largest;
}

}  // namespace detail

/// (b - a) x (c - a), twice as long as t's area is large: the side from which a, b, c turn counter-clockwise.
///
/// By the two shorter edges, which needles lose least with: within 3 epsilon of the products that it is made of
/// (`detail::cross_of_magnitudes`), component by component.
template <scalar T> PATCHRT_INLINE vec3<T> normal(triangle<T> const& t) {
  auto const [first, second] = detail::shorter_edges(t);
  return cross(first, second);
}

/// Whether t has an area, however small: false where two vertices are equal or all three are on a line; unspecified
/// where a coordinate is NaN or infinite.
///
/// Exact unless products of coordinates over- or underflow. Where the normal stands out of its rounding errors, that
/// says it; the exact sums are for the rest.
template <scalar T> PATCHRT_HD mask_t<T> has_area(triangle<T> const& t) {
  using L = lane_t<T>;
  auto const [first, second] = detail::shorter_edges(t);
  vec3<T> const n = absolute(cross(first, second)), m = detail::cross_of_magnitudes(first, second);
  T const rounding(L(4) * std::numeric_limits<L>::epsilon());
  auto const is_plain = rounding * m.x < n.x || rounding * m.y < n.y || rounding * m.z < n.z;
  if (all_of(is_plain)) return is_plain;
  return is_plain || detail::is_off_line(t.a.x, t.a.y, t.b.x, t.b.y, t.c.x, t.c.y) ||
         detail::is_off_line(t.a.y, t.a.z, t.b.y, t.b.z, t.c.y, t.c.z) ||
         detail::is_off_line(t.a.z, t.a.x, t.b.z, t.b.x, t.c.z, t.c.x);
}

}  // namespace patchrt
