// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/build_sah.hpp>
#include <patchrt/accel/build_subpatch_tree.hpp>
#include <patchrt/accel/find_joins.hpp>
#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/exec/executor.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace patchrt {

/// How a mixed hierarchy is built.
struct mixed_hierarchy_options {
  /// Levels of every patch's tree, 0 to max_subpatch_depth: the paper's fixed depth, u and v halved in turn. -1 lets
  /// the depth follow each patch's shape: as many halvings along u and along v as bring the turn of its tangents within
  /// a cell under `max_turn`, five together at the most, which keeps a patch's part of the hierarchy under 1 KiB.
  int depth = -1;
  /// Radians, for depth -1.
  float max_turn = 0.7f;
  /// Edges of neighbours that are no farther apart than this, in diagonals of the scene's box, join: a ray between them
  /// hits one of the two. 0 takes every patch as it is.
  double join_tolerance = 1e-6;
};

/// Patches ready for rays: owns what `basic_mixed_hierarchy_view` points to.
template <class Surface> struct basic_mixed_hierarchy {
  bvh<float> top;
  std::vector<search_patch<Surface>> search;
  std::vector<exact_patch<Surface>> exact;
  std::vector<subpatch_node> nodes;
  std::vector<subpatch_leaf> leaves;
  vec3<double> centre{0.0, 0.0, 0.0};
  double inverse_scale = 1;
  vec3<float> half_extent{0.0f, 0.0f, 0.0f};

  basic_mixed_hierarchy_view<Surface> view() const {
    return {top.view(), search.data(), exact.data(), nodes.data(), leaves.data(), centre, inverse_scale, half_extent};
  }
  std::size_t patch_count() const { return search.size(); }
  /// Bytes of the boxes over and in the patches.
  std::size_t hierarchy_bytes() const {
    return top.bytes() + nodes.size() * sizeof(subpatch_node) + leaves.size() * sizeof(subpatch_leaf) +
           search.size() * sizeof(subpatch_tree);
  }
  /// Bytes of the patches themselves, in both forms.
  std::size_t patch_bytes() const {
    return search.size() * (sizeof(search_patch<Surface>) - sizeof(subpatch_tree)) +
           exact.size() * sizeof(exact_patch<Surface>);
  }
};
using mixed_hierarchy = basic_mixed_hierarchy<bicubic_patch<double>>;

namespace detail {

/// Halvings that bring a turn of `turn` radians under `most`.
inline int halvings(float turn, float most) {
  int n = 0;
  for (; n < max_subpatch_depth / 2 && turn > most; turn *= 0.5f) ++n;
  return n;
}

/// How far the tangents along u (or v) turn, in radians, estimated by the largest second difference over the mean first
/// difference of the net.
template <int M, int N> float turn_along(bezier_patch<float, M, N> const& p, bool along_v) {
  int const degree = along_v ? N : M, rows = along_v ? M : N;
  auto const at = [&](int i, int j) { return along_v ? p(j, i) : p(i, j); };
  float second = 0, first = 0;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i < degree; ++i) {
      vec3<float> const a = at(i, j), b = at(i + 1, j);
      first += std::sqrt(dot(b - a, b - a));
      if (i == degree - 1) continue;
      vec3<float> const d = (at(i + 2, j) - b) - (b - a);
      second = std::max(second, std::sqrt(dot(d, d)));
    }
  first /= static_cast<float>(degree * (rows + 1));
  return first > 0 ? static_cast<float>(degree - 1) * second / first : 0;
}

template <int M, int N>
subpatch_splits choose_splits(bezier_patch<float, M, N> const& p, mixed_hierarchy_options const& options) {
  if (options.depth >= 0) return alternating_splits(options.depth);
  int u = halvings(turn_along(p, false), options.max_turn), v = halvings(turn_along(p, true), options.max_turn);
  for (constexpr int most = 5; u + v > most;) --(u > v ? u : v);
  subpatch_splits s{u + v, 0};
  for (int level = 0; level < s.depth; ++level) {
    bool const split_v = v > u;
    s.splits_v = static_cast<std::uint8_t>(s.splits_v | unsigned(split_v) << level);
    --(split_v ? v : u);
  }
  return s;
}

/// What the kernels need to know of one patch's power form: the coefficients in float, and bounds.
template <int M, int N>
void fill_forms(exact_patch<bezier_patch<double, M, N>>& e, search_patch<bezier_patch<double, M, N>>& s,
                double to_search) {
  e.power = to_power(e.patch);
  vec3<double> const sums = coefficient_sum(e.power);
  e.rounding = 20 * std::numeric_limits<double>::epsilon() * (sums.x + sums.y + sums.z);
  vec3<double> slope(0.0), bend(0.0);
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    double const order = k / (N + 1) + k % (N + 1);
    vec3<double> const& c = e.power.coefficients[k];
    slope = sum(slope, scale(absolute(c), order));
    bend = sum(bend, scale(absolute(c), order * (order - 1)));
    s.power.coefficients[k] = convert_vec<float>(c * to_search);
  }
  e.slope = std::max({slope.x, slope.y, slope.z}) * to_search;
  e.bend = std::max({bend.x, bend.y, bend.z}) * to_search;
  s.reach = convert_vec<float>(sums * to_search + vec3<double>(0x1p-18));
}

/// The same of a rational patch S = A / W: W S_x = A_x - W_x S and W S_xx = A_xx - 2 W_x S_x - W_xx S bound its
/// derivatives.
template <int M, int N>
void fill_forms(exact_patch<rational_patch<double, M, N>>& e, search_patch<rational_patch<double, M, N>>& s,
                double to_search) {
  e.power = to_power(e.patch);
  weighted_point<double> const sums = coefficient_sum(e.power);
  double least = weight(e.patch, 0), slope_w = 0, bend_w = 0;
  vec3<double> slope(0.0), bend(0.0);
  for (int k = 0; k < (M + 1) * (N + 1); ++k) {
    least = std::min(least, weight(e.patch, k));
    double const order = k / (N + 1) + k % (N + 1);
    weighted_point<double> const& c = e.power.coefficients[k];
    slope = sum(slope, scale(absolute(c.point), order));
    bend = sum(bend, scale(absolute(c.point), order * (order - 1)));
    slope_w += std::fabs(c.weight) * order;
    bend_w += std::fabs(c.weight) * order * (order - 1);
    s.power.coefficients[k] = {convert_vec<float>(c.point * to_search), static_cast<float>(c.weight)};
  }
  double const size = e.size;
  e.rounding = 20 * std::numeric_limits<double>::epsilon() *
               (sums.point.x + sums.point.y + sums.point.z + 3 * size * sums.weight) / least;
  double const most_slope = (std::max({slope.x, slope.y, slope.z}) + slope_w * size) / least;
  e.slope = most_slope * to_search;
  e.bend = (std::max({bend.x, bend.y, bend.z}) + 2 * slope_w * most_slope + bend_w * size) / least * to_search;
  s.reach = convert_vec<float>((sums.point + vec3<double>(2 * size * sums.weight)) * to_search + vec3<double>(0x1p-18));
}

/// Weights up to 1: divided by a power of two, which changes no bit of the surface.
template <int M, int N> void normalise_weights(bezier_patch<double, M, N>&) {}
template <int M, int N> void normalise_weights(rational_patch<double, M, N>& patch) {
  double most = 0;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) most = std::max(most, weight(patch, k));
  int exponent = 0;
  std::frexp(most, &exponent);
  for (auto& p : patch.control_points) p.weight = std::ldexp(p.weight, -exponent);
}

/// What the tree of a patch is built from: bicubics in float, all else in double.
inline bicubic_patch<float> const& net_of(bicubic_patch<double> const&, double, bicubic_patch<float> const& points) {
  return points;
}
template <class Surface, class Points> Surface net_of(Surface const& patch, double to_search, Points const&) {
  Surface scaled = patch;
  for (int k = 0; k < surface_form<Surface>::points; ++k) control_point(scaled, k) *= to_search;
  return scaled;
}

}  // namespace detail

/// Builds the mixed hierarchy of `patches`: each patch moved to its own origin, its sub-patch tree, and a BVH over all.
///
/// All patches are of one kind: Bezier patches of degrees up to 5, polynomial or rational; `elevate` makes degrees
/// equal.
/// \throws std::invalid_argument naming the patch and control point where there is no patch, a coordinate is not finite, a
///         weight is not within [2^-40, 1] times the patch's largest, the scene's extent overflows, or `options` are out of range.
/// \note Nigam & Narayanan 2012, section 3.
template <class Surface, executor E>
basic_mixed_hierarchy<Surface> build_mixed_hierarchy(std::span<Surface const> patches,
                                                     mixed_hierarchy_options const& options, E const& exec) {
  using form = surface_form<Surface>;
  static_assert(form::degree_u <= 5 && form::degree_v <= 5);
  if (patches.empty()) throw std::invalid_argument("build_mixed_hierarchy: expected at least one patch, got none");
  if (patches.size() > std::size_t(std::numeric_limits<std::int32_t>::max() / 2))
    throw std::invalid_argument("build_mixed_hierarchy: expected fewer than 2^30 patches");
  if (options.depth < -1 || options.depth > max_subpatch_depth)
    throw std::invalid_argument("build_mixed_hierarchy: expected a depth of -1 to " +
                                std::to_string(max_subpatch_depth) + ", got " + std::to_string(options.depth));
  if (!(options.max_turn > 0)) throw std::invalid_argument("build_mixed_hierarchy: expected max_turn > 0");

  std::size_t const n = patches.size();
  basic_mixed_hierarchy<Surface> h;
  std::vector<box<double>> hulls(n);
  exec.for_each(n, [&](std::size_t i) {
    double heaviest = 0;
    for (int k = 0; k < form::points; ++k)
      if (std::isfinite(weight(patches[i], k))) heaviest = std::max(heaviest, weight(patches[i], k));
    for (int k = 0; k < form::points; ++k) {
      double const w = weight(patches[i], k);
      if (!(0 < w && std::isfinite(w) && heaviest * 0x1p-40 <= w))
        throw std::invalid_argument(
            "build_mixed_hierarchy: patch " + std::to_string(i) + ", control point " + std::to_string(k) +
            ": expected a weight above 0 and not 2^40 times less than another, got " + std::to_string(w));
      vec3<double> const& p = control_point(patches[i], k);
      if (!(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)))
        throw std::invalid_argument("build_mixed_hierarchy: patch " + std::to_string(i) + ", control point " +
                                    std::to_string(k) + ": expected finite coordinates");
    }
    hulls[i] = bounds(patches[i]);
  });
  box<double> scene = box<double>::empty();
  for (auto const& b : hulls) scene = merge(scene, b);
  vec3<double> const half = (scene.hi - scene.lo) * 0.5;
  double const widest = std::max({half.x, half.y, half.z});
  if (!std::isfinite(widest) || !(widest < 1e150))
    throw std::invalid_argument("build_mixed_hierarchy: expected a scene smaller than 1e150 across");
  h.centre = scene.lo + half;
  // A power of two, so that scaling is exact; a scene that is one point gets any scale.
  int exponent = 0;
  std::frexp(std::max(widest, 1e-150), &exponent);
  h.inverse_scale = std::ldexp(1.0, -exponent);
  h.half_extent = vec3<float>(half * h.inverse_scale) + vec3<float>(0x1p-19f);

  if (!(options.join_tolerance >= 0 && options.join_tolerance <= 1e-3))
    throw std::invalid_argument("build_mixed_hierarchy: expected a join_tolerance of 0 to 1e-3");
  vec3<double> const across = scene.hi - scene.lo;
  std::vector<edge_gaps> const gaps = find_joins(patches, options.join_tolerance * std::sqrt(dot(across, across)));

  h.search.resize(n);
  h.exact.resize(n);
  std::vector<bezier_patch<float, form::degree_u, form::degree_v>> nets(n);
  std::vector<subpatch_splits> splits(n);
  exec.for_each(n, [&](std::size_t i) {
    exact_patch<Surface>& e = h.exact[i];
    e.base = hulls[i].lo + (hulls[i].hi - hulls[i].lo) * 0.5;
    e.search_base = (e.base - h.centre) * h.inverse_scale;
    e.size = 0;
    e.patch = patches[i];
    for (int k = 0; k < form::points; ++k) {
      vec3<double> const p = control_point(patches[i], k) - e.base;
      control_point(e.patch, k) = p;
      e.size = std::max({e.size, std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
      nets[i].control_points[k] = convert_vec<float>(p * h.inverse_scale);
    }
    e.gaps = gaps[i];
    h.search[i].gap = static_cast<float>(largest_gap(gaps[i]) * h.inverse_scale * (1 + 0x1p-20));
    detail::normalise_weights(e.patch);
    detail::fill_forms(e, h.search[i], h.inverse_scale);
    splits[i] = detail::choose_splits(nets[i], options);
  });

  std::vector<std::size_t> first_node(n + 1, 0), first_leaf(n + 1, 0);
  for (std::size_t i = 0; i < n; ++i) {
    first_node[i + 1] = first_node[i] + subpatch_node_count(splits[i].depth);
    first_leaf[i + 1] = first_leaf[i] + subpatch_leaf_count(splits[i].depth);
  }
  if (first_node[n] > std::numeric_limits<std::uint32_t>::max())
    throw std::invalid_argument("build_mixed_hierarchy: expected fewer than 2^32 sub-patches: choose a smaller depth");
  h.nodes.resize(first_node[n]);
  h.leaves.resize(first_leaf[n]);
  std::vector<box<float>> boxes(n);
  exec.for_each(n, [&](std::size_t i) {
    subpatch_tree& tree = h.search[i].tree;
    tree = build_subpatch_tree(detail::net_of(h.exact[i].patch, h.inverse_scale, nets[i]), splits[i], h.search[i].gap,
                               std::span(h.nodes).subspan(first_node[i], first_node[i + 1] - first_node[i]),
                               std::span(h.leaves).subspan(first_leaf[i], first_leaf[i + 1] - first_leaf[i]));
    tree.first_node = static_cast<std::uint32_t>(first_node[i]);
    tree.first_leaf = static_cast<std::uint32_t>(first_leaf[i]);
    // What the leaves' boxes leave of the control points' hull, and room for the rounding of nets and rays to float.
    constexpr double pad = 0x1p-19;
    subpatch_node const& whole = h.nodes[first_node[i]];
    for (int c = 0; c < 3; ++c) {
      double const origin = h.exact[i].search_base[c] + tree.grid_origin[c], step = tree.grid_step[c];
      boxes[i].lo[c] = static_cast<float>(origin + step * whole.lo[c] - pad);
      boxes[i].hi[c] = static_cast<float>(origin + step * whole.hi[c] + pad);
    }
  });
  h.top = build_sah(std::span<box<float> const>(boxes), exec);
  return h;
}

/// Bicubic patches, from whatever converts to a span of them.
template <executor E>
mixed_hierarchy build_mixed_hierarchy(std::span<bicubic_patch<double> const> patches,
                                      mixed_hierarchy_options const& options, E const& exec) {
  return build_mixed_hierarchy<bicubic_patch<double>, E>(patches, options, exec);
}

}  // namespace patchrt
