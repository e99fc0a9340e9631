// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Where rays that leave a surface start: clear of it, whichever way they go, and no farther off than rounding asks
/// for.

#include <patchrt/shapes/bezier_normal.hpp>
#include <patchrt/shapes/rational_normal.hpp>
#include <patchrt/shapes/surface_form.hpp>

#include <limits>
#include <type_traits>

namespace patchrt {

/// A point that rays leave a surface from.
template <scalar T> struct surface_departure {
  vec3<T> position;  ///< on the surface but for rounding
  vec3<T> normal;    ///< of length 1
  T clearance;       ///< how far from the surface rays have to start so as not to meet it there again
};

namespace detail {

/// `patch` seen from `base`, a rounding of Q a coordinate.
template <scalar Q, scalar P, int M, int N>
PATCHRT_INLINE bezier_patch<Q, M, N> relative_to(bezier_patch<P, M, N> const& patch, vec3<P> const& base) {
  bezier_patch<Q, M, N> r;
  for (int k = 0; k < (M + 1) * (N + 1); ++k)
    r.control_points[k] = difference(convert_vec<Q>(patch.control_points[k]), convert_vec<Q>(base));
  return r;
}
template <scalar Q, scalar P, int M, int N>
PATCHRT_INLINE rational_patch<Q, M, N> relative_to(rational_patch<P, M, N> const& patch, vec3<P> const& base) {
  rational_patch<Q, M, N> r;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    auto const& [point, weight] = patch.control_points[k];
    r.control_points[k] = {difference(convert_vec<Q>(point), convert_vec<Q>(base)), convert<Q>(weight)};
  }
  return r;
}

/// P, or as many lanes in the precision of T where that is higher.
template <scalar P, scalar T>
using wider_t = std::conditional_t<sizeof(lane_t<P>) < sizeof(lane_t<T>), rebind_lane_t<P, lane_t<T>>, P>;

}  // namespace detail

/// How far from `patch` a ray has to start so that an intersector that computes in T's precision does not meet it where
/// it started.
///
/// 64 eps max(|h| + max h, |s|): h the half extents of the control points, s the sums of the magnitudes of the
/// coefficients of its power form about the middle of their box, |.| sums of coordinates. Of these, 19 eps |h| are for
/// S(u, v) as `depart_from` computes it, and what an intersector may be off by gets the rest: S by the power form is
/// within 20 eps |s| (see `exact_patch`), `correct` takes what a ray passes within 32 eps (|origin| + max h), and an
/// origin relative to the middle has |origin| <= |h|, and a rounding of it of eps |h| / 2.
/// \note Near an edge the neighbours are to be cleared too: take the largest clearance of all, and add how far their edges are
///       apart; `trace/depart.hpp` does so for hits of a hierarchy. A fold or crease that turns towards the ray is met all the
///       same. `accuracy::fast` rounds rays in the whole scene's frame: take clearance<float>(patch) and 2^-19 times the
///       scene's diagonal; its rays within a hundredth of the tangent plane may still report the surface they leave, with an
///       `error` that says so.
template <scalar T, scalar P, int M, int N> PATCHRT_HD T clearance(bezier_patch<P, M, N> const& patch) {
  using L = lane_t<P>;
  static_assert(M <= 5 && N <= 5);
  auto const [lo, hi] = bounds(patch);
  P const half(L(0.5));
  vec3<P> const extent = difference(scale(hi, half), scale(lo, half));
  vec3<P> const sums = coefficient_sum(to_power(detail::relative_to<P>(patch, sum(lo, extent))));
  P const reach = max(sum_of_magnitudes(extent) + detail::largest_component(extent), sum_of_magnitudes(sums));
  return convert<T>(reach) * T(64 * std::numeric_limits<lane_t<T>>::epsilon());
}

/// The same for a rational patch: 128 eps (|h| + max h).
///
/// S(u, v) as `depart_from` computes it is within g(6 (M + N) + 4) 2 |h|, which for degrees up to 5 is 64 eps |h|.
template <scalar T, scalar P, int M, int N> PATCHRT_HD T clearance(rational_patch<P, M, N> const& patch) {
  using L = lane_t<P>;
  static_assert(M <= 5 && N <= 5);
  auto const [lo, hi] = bounds(patch);
  P const half(L(0.5));
  vec3<P> const extent = difference(scale(hi, half), scale(lo, half));
  P const reach = sum_of_magnitudes(extent) + detail::largest_component(extent);
  return convert<T>(reach) * T(128 * std::numeric_limits<lane_t<T>>::epsilon());
}

/// The point S(u, v) of a Bezier patch, polynomial or rational, for rays to leave from. What a hit's (u, v) are wrong
/// by does not count: this is a point of the surface all the same.
///
/// `clear` is `clearance` of the patch, or more. S is evaluated relative to a corner, so that its error is in
/// proportion to the patch's size: g(3 (M + N) + 1) times the differences of coordinates, and half an ulp of
/// `position`.
/// \pre 0 <= u, v <= 1; no over- or underflow.
template <class Patch, scalar T> PATCHRT_HD surface_departure<T> depart_from(Patch const& patch, T u, T v, T clear) {
  auto const base = control_point(patch, 0);
  using Q = detail::wider_t<std::decay_t<decltype(base.x)>, T>;
  vec3<T> const here = position(detail::relative_to<Q>(patch, base), u, v);
  return {sum(convert_vec<T>(base), here), normal(patch, u, v), clear};
}

/// The same, just clear of the patch: twice to four times the work, as `clearance` is not kept.
template <class Patch, scalar T> PATCHRT_HD surface_departure<T> depart_from(Patch const& patch, T u, T v) {
  return depart_from(patch, u, v, clearance<T>(patch));
}

/// Where a ray with `direction` starts that leaves a surface at `from`: along the normal, to the side that `direction`
/// points to, rounded to the direction's number type.
///
/// The distance is the clearance plus twice what rounding of position, start and, where D is another type, of its
/// conversion may amount to in all directions: rounding along the surface then takes the start no nearer to it where
/// the surface bends by less than a radian in an ulp of the start. Directions within rounding of the tangent plane may
/// get either side, both clear of the surface.
/// \pre Neither `direction`'s squared length nor anything else over- or underflows.
/// \return Between `clearance` and `clearance` + 4 r of the surface, with r = (eps_T + eps_D / 2) |position|, |.| the
///         sum of coordinates' magnitudes (r = eps_T |position| where D is T), where the surface is as good as flat
///         over such distances.
/// \note Pharr, Jakob & Humphreys, Physically Based Rendering, 4th ed., section 6.8.6: there the offset covers the box
///       of the point's error, and each coordinate is rounded away from the surface; here what the intersector may be
///       off by too.
template <scalar D, scalar T>
PATCHRT_INLINE vec3<D> offset_origin(surface_departure<T> const& from, vec3<D> const& direction) {
  using L = lane_t<T>;
  constexpr L unit = L(2) * std::numeric_limits<L>::epsilon() +
                     (std::is_same_v<D, T> ? L(0) : static_cast<L>(std::numeric_limits<lane_t<D>>::epsilon()));
  vec3<T> const& p = from.position;
  T const distance = fma(T(unit), sum_of_magnitudes(p), from.clearance);
  auto const behind = dot(from.normal, convert_vec<T>(direction)) < T(L(0));
  return convert_vec<D>(fma(select(behind, -distance, distance), from.normal, p));
}

/// The same for a ray that leaves a Bezier patch, polynomial or rational, at (u, v).
template <class Patch, scalar D, scalar T>
PATCHRT_HD vec3<D> offset_origin(Patch const& patch, T u, T v, vec3<D> const& direction) {
  return offset_origin(depart_from(patch, u, v), direction);
}

}  // namespace patchrt
