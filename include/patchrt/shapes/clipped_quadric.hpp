// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/quadric.hpp>

#include <limits>

namespace patchrt {

/// What there is of a quadric where a box cuts it off.
enum class ends {
  open,   ///< the surface alone, as a tube is
  capped  ///< the boundary of what is inside both quadric (f <= 0) and box, as that of a can
};

/// The part of a quadric in a box. Both are in object space, whose coordinate k of a point p is rows[k].(p - centre).
///
/// 0 of object space lies near the surface, or in its middle: kernels move rays there before anything is squared.
template <class T> struct clipped_quadric {
  quadric<T> form;
  box<T> clip;  ///< sides may be infinite
  vec3<T> rows[3];
  vec3<T> centre;
  mask_t<T> capped;
};

/// The same in another number type.
template <class To, class From> clipped_quadric<To> convert_quadric(clipped_quadric<From> const& s) {
  auto const to = [](vec3<From> const& v) { return convert_vec<To>(v); };
  return {{to(s.form.squares), to(s.form.products), to(s.form.linear), convert<To>(s.form.constant)},
          {to(s.clip.lo), to(s.clip.hi)},
          {to(s.rows[0]), to(s.rows[1]), to(s.rows[2])},
          to(s.centre),
          mask_t<To>(s.capped)};
}

/// The map from object space to where the surface is.
inline affine<double> to_world(clipped_quadric<double> const& s) {
  affine<double> const turn{{s.rows[0].x, s.rows[1].x, s.rows[2].x},
                            {s.rows[0].y, s.rows[1].y, s.rows[2].y},
                            {s.rows[0].z, s.rows[1].z, s.rows[2].z},
                            {0, 0, 0}};
  affine<double> r = inverse(turn);
  r.translation = s.centre;
  return r;
}

/// All of space.
template <class T> PATCHRT_HD box<T> whole_space() {
  constexpr T inf = std::numeric_limits<T>::infinity();
  return {{-inf, -inf, -inf}, {inf, inf, inf}};
}

/// lo <= z <= hi.
template <class T> PATCHRT_HD box<T> between_heights(T lo, T hi) {
  box<T> b = whole_space<T>();
  b.lo.z = lo;
  b.hi.z = hi;
  return b;
}

}  // namespace patchrt
