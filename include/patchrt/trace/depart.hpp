// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Where rays start that leave a hit of a hierarchy: clear of its patch and, at a join, of the patches beside it.

#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/accel/patch_search.hpp>
#include <patchrt/intersect/offset_origin.hpp>
#include <patchrt/trace/patch_hit.hpp>

#include <limits>

namespace patchrt {

/// A hit that rays leave from, in the user's space.
struct hit_departure {
  vec3<double> position;  ///< on the hit's patch but for rounding
  vec3<double> normal;    ///< of the patch, of length 1
  double clearance;       ///< how far rays have to start from the patch, and from those that it joins here
  /// Where they start, in clearances, to the normal's side and to the other: the normal, its opposite, but at creases.
  vec3<double> away[2];
};

namespace detail {

/// How far from a patch a ray has to start so that an intersector at level A does not meet it there: `rounding` + 256
/// eps `size`. Of these, 96 eps `size` are for S(u, v); the intersector may be off by `rounding` + 4 eps |origin|, or
/// takes what a ray passes within 32 eps (|origin| + `size`), and |origin| <= 3 `size`.
template <accuracy A, class Surface>
PATCHRT_HD double patch_clearance(basic_mixed_hierarchy_view<Surface> const& h, exact_patch<Surface> const& e) {
  constexpr double eps = std::numeric_limits<double>::epsilon();
  double const clear = fma(256 * eps, e.size, e.rounding);
  if constexpr (A == accuracy::fast) {
    vec3<double> const half = convert_vec<double>(h.half_extent);
    return clear * (double(std::numeric_limits<float>::epsilon()) / eps) +
           double(search_margin) * 2 * sqrt(dot(half, half)) / h.inverse_scale;
  } else {
    return clear;
  }
}

/// `visit(e)` for every patch whose box in the hierarchy comes within `reach` of a point, both in search space.
template <class Surface, class Visit>
PATCHRT_HD void visit_patches_near(basic_mixed_hierarchy_view<Surface> const& h, vec3<double> const& at, double reach,
                                   Visit const& visit) {
  traverse_unordered(
      h.top,
      [&](box<float> const& b) {
        return b.lo.x - reach <= at.x && at.x <= b.hi.x + reach && b.lo.y - reach <= at.y && at.y <= b.hi.y + reach &&
               b.lo.z - reach <= at.z && at.z <= b.hi.z + reach;
      },
      [&](std::int32_t i) {
        visit(h.exact[i]);
        return false;
      });
}

/// `found(inward, u, v)` for points of a patch's edges within `reach` of a point, `inward` the tangent there that leads
/// into the patch: of each edge the nearest, by Gauss and Newton's method, and those at eighths, as a pole, where an
/// edge is one point, has many normals.
template <class Surface, class Found>
PATCHRT_HD void visit_edges_near(Surface const& patch, vec3<double> const& at, double reach, Found const& found) {
  for (int side = 0; side < 4; ++side) {
    bool const is_of_u = side < 2;
    double const end = side % 2;
    auto const offer = [&](double t, double& step) {
      double const u = is_of_u ? end : t, v = is_of_u ? t : end;
      surface_point<double> const p = evaluate(patch, u, v);
      vec3<double> const left = difference(at, p.position), along = is_of_u ? p.dv : p.du;
      step = dot(left, along) / dot(along, along);
      double const distance = sqrt(dot(left, left));
      if (distance <= reach) found(scale(is_of_u ? p.du : p.dv, 1 - 2 * end), u, v);
      return distance;
    };
    double nearest = 0, step = 0, least = std::numeric_limits<double>::infinity();
    for (int k = 0; k <= 8; ++k) {
      double from_here = 0;
      double const distance = offer(k * 0.125, from_here);
      if (distance < least) least = distance, nearest = k * 0.125, step = from_here;
    }
    for (int n = 0; n < 6 && abs(step) < 1; ++n) {
      nearest = min(max(nearest + step, 0.), 1.);
      offer(nearest, step);
    }
  }
}

/// A dozen planes through one point, those within 3 degrees of others left out.
struct plane_list {
  static constexpr int most = 12;
  vec3<double> normal[most];
  int count = 0;

  PATCHRT_HD void add(vec3<double> const& n) {
    for (int i = 0; i < count; ++i)
      if (dot(n, normal[i]) > 0.9986) return;
    if (count < most) normal[count++] = n;
  }
};

/// The nearest point that is at 1 above all planes of a list or higher: at 1 above one, two or three of them. The first
/// normal where there is none up to 64 away.
PATCHRT_HD inline vec3<double> point_above(plane_list const& planes) {
  vec3<double> nearest = planes.normal[0];
  double least = 64 * 64;
  auto const offer = [&](vec3<double> const& point) {
    double const square = dot(point, point);
    bool is_above = square < least;
    for (int i = 0; i < planes.count && is_above; ++i) is_above = dot(planes.normal[i], point) > 1 - 0x1p-20;
    if (is_above) least = square, nearest = point;
  };
  for (int i = 0; i < planes.count; ++i) {
    vec3<double> const a = planes.normal[i];
    offer(a);
    for (int j = 0; j < i; ++j) {
      vec3<double> const b = planes.normal[j], a_x_b = cross(a, b);
      offer(scale(sum(a, b), 1 / (1 + dot(a, b))));
      for (int k = 0; k < j; ++k) {
        vec3<double> const c = planes.normal[k];
        offer(scale(sum(a_x_b, cross(c, difference(a, b))), 1 / dot(a_x_b, c)));
      }
    }
  }
  return nearest;
}

/// Clears the patches that join the hit's own within `reach` of its position, `at` in search space and `s` relative to
/// its patch's base.
template <class Surface>
PATCHRT_OUTLINE void clear_joined(basic_mixed_hierarchy_view<Surface> const& h, exact_patch<Surface> const& own,
                                  surface_point<double> const& s, vec3<double> const& inside, double clear,
                                  double reach, vec3<double> const& at, hit_departure& d) {
  bool is_at_edge = false;
  plane_list planes[2];
  planes[0].add(d.normal);
  planes[1].add(-d.normal);
  visit_patches_near(h, at, reach * h.inverse_scale, [&](exact_patch<Surface> const& e) {
    vec3<double> const from_base = sum(difference(own.base, e.base), s.position);
    visit_edges_near(e.patch, from_base, reach, [&](vec3<double> const& inward, double u, double v) {
      is_at_edge = true;
      vec3<double> const across = normal(e.patch, u, v);
      double const rise = dot(inward, d.normal);
      if (!(abs(dot(across, d.normal)) < 0.97)) return;                // goes on from the patch, or lies on it
      if (!(abs(rise) > 0x1p-10 * sqrt(dot(inward, inward)))) return;  // an edge that leads away from the join
      planes[rise < 0].add(dot(across, inside) < 0 ? -across : across);
    });
  });
  if (!is_at_edge) return;
  d.clearance = clear;
  for (int side = 0; side < 2; ++side) d.away[side] = point_above(planes[side]);
}

}  // namespace detail

/// The point S(u, v) of a hit, for rays to leave from that are traced at level A in the same hierarchy. What the hit's
/// (u, v) are wrong by, or its ray was beside the patch at a join, does not count: this is a point of the surface all
/// the same.
///
/// Inside a patch, `clearance` is what an intersector may be off by there: `rounding` + 256 eps `size` (see
/// `exact_patch`). Within 8 clearances of an edge it is c + 4 g, with c and g the largest of clearances and gaps of the
/// patches around: the edge of a neighbour is within a gap of this one's, that of the patch across a corner within two
/// or three, and a ray counts as one through an edge that it passes within the edge's gap. There neighbours that stand
/// up from this patch's tangent plane by 15 to 165 degrees are cleared as well: `away` is at 1 or higher above both
/// planes, on the inside of the crease, so that no ray starts behind the neighbour, and none meets it but by its
/// direction.
/// \pre `hit` is of this hierarchy, and valid.
/// \note Not cleared are neighbours at sharper creases, and folds of the patch itself that turn towards the ray. Rays
///       of `accuracy::fast` within a hundredth of the tangent plane may still report the surface that they leave, with
///       an `error` that says so.
template <accuracy A = accuracy::refined, class Surface>
PATCHRT_HD hit_departure depart_from(basic_mixed_hierarchy_view<Surface> const& h, patch_hit const& hit) {
  exact_patch<Surface> const& own = h.exact[hit.patch];
  surface_point<double> const s = evaluate(own.patch, hit.u, hit.v);
  vec3<double> const n = normal(own.patch, hit.u, hit.v);
  hit_departure d{sum(own.base, s.position), n, detail::patch_clearance<A>(h, own), {n, -n}};

  // The largest around; where there are gaps, also of patches that are a few gaps away.
  vec3<double> const at = fma(h.inverse_scale, s.position, own.search_base);
  double clear = d.clearance, gap = 0;
  for (double before = -1; before < gap;) {
    before = gap;
    detail::visit_patches_near(h, at, 4 * gap * h.inverse_scale, [&](exact_patch<Surface> const& e) {
      clear = max(clear, detail::patch_clearance<A>(h, e));
      gap = max(gap, largest_gap(e.gaps));
    });
  }
  clear = fma(4., gap, clear);
  double const rounding = 8 * std::numeric_limits<double>::epsilon() * sqrt(dot(d.position, d.position));
  double const reach = 8 * (clear + rounding);

  // How far edges are by the tangents here, with room for how those change; and where from them the patch is.
  vec3<double> inside(0., 0., 0.);
  bool is_near_edge = false;
  auto const ask_edge = [&](double parameter, vec3<double> const& inward) {
    double const length = sqrt(dot(inward, inward));
    if (!(parameter * length <= 8 * reach)) return;
    is_near_edge = true;
    if (length > 0) inside = fma(1 / length, inward, inside);
  };
  ask_edge(min(hit.u, 1 - hit.u), hit.u < 0.5 ? s.du : -s.du);
  ask_edge(min(hit.v, 1 - hit.v), hit.v < 0.5 ? s.dv : -s.dv);
  if (is_near_edge) detail::clear_joined(h, own, s, inside, clear, reach, at, d);
  return d;
}

/// Where a ray with `direction` starts that leaves a hit: on the side of its patch that `direction` points to, rounded
/// to the direction's number type.
/// \return `position` + (`clearance` + r) `away`, with r = (2 eps + eps_D) |position| for what is rounded (eps_D where
///         D is not double), |.| the sum of coordinates' magnitudes. |`away`| is 1; at a crease that leaves an angle of
///         phi on that side, 1 / sin(phi / 2).
template <scalar D> PATCHRT_HD vec3<D> offset_origin(hit_departure const& from, vec3<D> const& direction) {
  vec3<double> const& away = from.away[dot(from.normal, convert_vec<double>(direction)) < 0];
  return offset_origin(surface_departure<double>{from.position, away, from.clearance}, convert_vec<D>(away));
}

/// The same for one direction; `depart_from` holds what several have in common.
template <accuracy A = accuracy::refined, class Surface, scalar D>
PATCHRT_HD vec3<D> offset_origin(basic_mixed_hierarchy_view<Surface> const& hierarchy, patch_hit const& hit,
                                 vec3<D> const& direction) {
  return offset_origin(depart_from<A>(hierarchy, hit), direction);
}

}  // namespace patchrt
