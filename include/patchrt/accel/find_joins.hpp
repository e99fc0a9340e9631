// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Where patches of a model are meant to join, and how far their edges are apart there.

#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/shapes/surface_form.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace patchrt {

namespace detail {

/// One edge of one patch: a curve through `evaluate`, and its control points.
template <class Surface> struct patch_edge {
  using form = surface_form<Surface>;
  static constexpr int most_points = std::max(form::degree_u, form::degree_v) + 1;

  Surface const* patch;
  int side;  // 0: u = 0, 1: u = 1, 2: v = 0, 3: v = 1

  int degree() const { return side < 2 ? form::degree_v : form::degree_u; }
  /// Control point k of the curve, in the direction of growing parameters.
  int index(int k) const {
    int const last_u = form::degree_u, last_v = form::degree_v;
    int const i = side == 0 ? 0 : side == 1 ? last_u : k, j = side == 2 ? 0 : side == 3 ? last_v : k;
    return i * (last_v + 1) + j;
  }
  vec3<double> control(int k) const { return control_point(*patch, index(k)); }
  double weight_of(int k) const { return weight(*patch, index(k)) / weight(*patch, index(0)); }
  vec3<double> at(double t) const {
    return side < 2 ? position(*patch, double(side), t) : position(*patch, t, double(side - 2));
  }
  vec3<double> at(double t, vec3<double>& tangent) const {
    surface_point<double> const p =
        side < 2 ? evaluate(*patch, double(side), t) : evaluate(*patch, t, double(side - 2));
    tangent = side < 2 ? p.dv : p.du;
    return p.position;
  }
  box<double> hull() const {
    box<double> b = box<double>::empty();
    for (int k = 0; k <= degree(); ++k) b = merge(b, control(k));
    return b;
  }
};

inline double distance_of(vec3<double> const& a, vec3<double> const& b) {
  vec3<double> const d = a - b;
  return std::sqrt(dot(d, d));
}

/// How far two edges are apart at the most by their control points, in one direction or the other: the difference of
/// two curves is a curve of the differences. Infinite where weights differ by more than rounding.
template <class Surface> double edge_distance(patch_edge<Surface> const& a, patch_edge<Surface> const& b) {
  int const n = a.degree();
  if (b.degree() != n) return std::numeric_limits<double>::infinity();
  double best = std::numeric_limits<double>::infinity();
  for (bool const reversed : {false, true}) {
    double most = 0;
    double const unit = reversed ? b.weight_of(n) : 1;
    for (int k = 0; k <= n; ++k) {
      int const other = reversed ? n - k : k;
      most = std::max(most, distance_of(a.control(k), b.control(other)));
      if (std::fabs(a.weight_of(k) - b.weight_of(other) / unit) > 1e-12 * a.weight_of(k))
        most = std::numeric_limits<double>::infinity();
    }
    best = std::min(best, most);
  }
  return best;
}

/// Points of an edge at eighths of its parameter, and how far a point of the edge may be from the nearest of them.
struct sampled_edge {
  static constexpr int count = 9;
  vec3<double> point[count];
  double reach;

  template <class Surface> explicit sampled_edge(patch_edge<Surface> const& edge) {
    for (int k = 0; k < count; ++k) point[k] = edge.at(k / double(count - 1));
    // |C'| is at most the degree times the longest leg, times the square of the ratio of weights (Floater, CAGD 9,
    // 1992).
    double leg = 0, lightest = 1, heaviest = 1;
    for (int k = 0; k < edge.degree(); ++k) {
      leg = std::max(leg, distance_of(edge.control(k), edge.control(k + 1)));
      lightest = std::min(lightest, edge.weight_of(k + 1));
      heaviest = std::max(heaviest, edge.weight_of(k + 1));
    }
    double const ratio = heaviest / lightest;
    reach = edge.degree() * leg * ratio * ratio / (2 * (count - 1));
  }
  int nearest(vec3<double> const& p, double& distance) const {
    int best = 0;
    distance = std::numeric_limits<double>::infinity();
    for (int k = 0; k < count; ++k) {
      double const d = distance_of(point[k], p);
      if (d < distance) distance = d, best = k;
    }
    return best;
  }
};

/// The distance of a point from a curve, or more than `most` if it is that, by Gauss and Newton's method from the
/// nearest sample.
template <class Surface>
double distance_from(patch_edge<Surface> const& curve, sampled_edge const& samples, vec3<double> const& p,
                     double most) {
  double best = 0;
  double t = samples.nearest(p, best) / double(sampled_edge::count - 1);
  if (best > most + samples.reach) return best;
  for (int step = 0; step < 6; ++step) {
    vec3<double> tangent;
    vec3<double> const left = p - curve.at(t, tangent);
    best = std::min(best, std::sqrt(dot(left, left)));
    double const squared = dot(tangent, tangent);
    if (!(squared > 0)) break;
    t = std::clamp(t + dot(left, tangent) / squared, 0., 1.);
  }
  return best;
}

/// How far an edge is from another one all along, measured at nine points; more than `most` as soon as that is seen.
template <class Surface>
double distance_along(sampled_edge const& edge, patch_edge<Surface> const& other, sampled_edge const& samples,
                      double most) {
  for (int k = 0; k < sampled_edge::count; ++k) {  // most pairs are told apart by this
    double d = 0;
    samples.nearest(edge.point[k], d);
    if (d > most + samples.reach) return d;
  }
  double farthest = 0;
  for (int const k : {4, 0, 8, 2, 6, 1, 3, 5, 7}) {
    farthest = std::max(farthest, distance_from(other, samples, edge.point[k], most));
    if (farthest > most) break;
  }
  return farthest;
}

/// Numbers for points, the same for those within `tolerance` of each other.
inline std::vector<std::uint32_t> number_points(std::vector<vec3<double>> const& points, double tolerance) {
  std::vector<std::uint32_t> order(points.size()), number(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return points[a].x != points[b].x ? points[a].x < points[b].x : a < b;
  });
  std::iota(number.begin(), number.end(), 0u);
  for (std::size_t i = 0; i < order.size(); ++i) {
    vec3<double> const& p = points[order[i]];
    for (std::size_t j = i; j-- > 0 && p.x - points[order[j]].x <= tolerance;) {
      if (!(distance_of(p, points[order[j]]) <= tolerance)) continue;
      number[order[i]] = number[order[j]];
      break;
    }
  }
  return number;
}

}  // namespace detail

/// For every patch, how far its edges are from those that they join: edges of other patches (or, of a tube, its own)
/// within `tolerance` all along, whole edges or, at T-junctions, parts of longer ones. 0 for edges that are alone.
///
/// Edges with the same ends are compared by their control points, which bounds their distance; edges that are part of
/// another, or of other degree or parameters, at nine points, and twice that distance is given.
template <class Surface> std::vector<edge_gaps> find_joins(std::span<Surface const> patches, double tolerance) {
  using edge = detail::patch_edge<Surface>;
  std::vector<edge_gaps> gaps(patches.size());
  if (!(tolerance > 0)) return gaps;
  std::size_t const count = 4 * patches.size();
  std::vector<vec3<double>> ends(2 * count);
  auto const edge_at = [&](std::size_t e) { return edge{&patches[e / 4], int(e % 4)}; };
  for (std::size_t e = 0; e < count; ++e) {
    ends[2 * e] = edge_at(e).control(0);
    ends[2 * e + 1] = edge_at(e).control(edge_at(e).degree());
  }
  auto const number = detail::number_points(ends, tolerance);
  std::vector<double> gap(count, 0);
  std::vector<char> is_joined(count, 0);
  auto const join = [&](std::size_t a, std::size_t b, double distance) {
    for (std::size_t const e : {a, b}) {
      gap[e] = std::max(gap[e], distance);
      is_joined[e] = 1;
    }
  };

  struct keyed_edge {
    std::uint64_t key;
    std::size_t edge;
  };
  std::vector<keyed_edge> keyed(count);
  for (std::size_t e = 0; e < count; ++e) {
    std::uint64_t const a = number[2 * e], b = number[2 * e + 1];
    keyed[e] = {std::min(a, b) << 32 | std::max(a, b), e};
  }
  std::sort(keyed.begin(), keyed.end(),
            [](keyed_edge const& a, keyed_edge const& b) { return a.key != b.key ? a.key < b.key : a.edge < b.edge; });
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = i + 1; j < count && keyed[j].key == keyed[i].key; ++j) {
      std::size_t const a = keyed[i].edge, b = keyed[j].edge;
      double distance = detail::edge_distance(edge_at(a), edge_at(b));
      if (!(distance <= tolerance)) {
        detail::sampled_edge const along_a(edge_at(a)), along_b(edge_at(b));
        distance = 2 * std::max(detail::distance_along(along_a, edge_at(b), along_b, tolerance),
                                detail::distance_along(along_b, edge_at(a), along_a, tolerance));
        if (!(distance <= 2 * tolerance)) continue;
      }
      // Two edges of one patch join where it is a tube, not where it is a sliver.
      if (a / 4 == b / 4 &&
          !(detail::distance_of(position(patches[a / 4], 0.5, 0.5), edge_at(a).at(0.5)) > 8 * distance))
        continue;
      join(a, b, distance);
    }

  // T-junctions: what is left, by boxes along x.
  struct boxed_edge {
    box<double> hull;
    std::size_t edge;
    detail::sampled_edge samples;
  };
  std::vector<boxed_edge> left;
  for (std::size_t e = 0; e < count; ++e)
    if (!is_joined[e]) left.push_back({edge_at(e).hull(), e, detail::sampled_edge(edge_at(e))});
  std::sort(left.begin(), left.end(), [](boxed_edge const& a, boxed_edge const& b) {
    return a.hull.lo.x != b.hull.lo.x ? a.hull.lo.x < b.hull.lo.x : a.edge < b.edge;
  });
  for (std::size_t i = 0; i < left.size(); ++i)
    for (std::size_t j = i + 1; j < left.size() && left[j].hull.lo.x <= left[i].hull.hi.x + tolerance; ++j) {
      auto const apart = [&](int c) {
        return left[j].hull.lo[c] > left[i].hull.hi[c] + tolerance ||
               left[i].hull.lo[c] > left[j].hull.hi[c] + tolerance;
      };
      if (apart(1) || apart(2)) continue;
      std::size_t const a = left[i].edge, b = left[j].edge;
      double const distance = std::min(detail::distance_along(left[i].samples, edge_at(b), left[j].samples, tolerance),
                                       detail::distance_along(left[j].samples, edge_at(a), left[i].samples, tolerance));
      if (a / 4 != b / 4 && distance <= tolerance) join(a, b, 2 * distance);
    }

  auto const up = [](double x) { return x * (1 + 0x1p-20); };
  for (std::size_t i = 0; i < patches.size(); ++i)
    gaps[i] = {up(gap[4 * i]), up(gap[4 * i + 1]), up(gap[4 * i + 2]), up(gap[4 * i + 3])};
  return gaps;
}

}  // namespace patchrt
