// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/subpatch_bounds.hpp>
#include <patchrt/accel/subpatch_tree.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/shapes/rational_split.hpp>
#include <patchrt/shapes/surface_form.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace patchrt {

/// The order in which a sub-patch tree halves u and v.
struct subpatch_splits {
  int depth;
  std::uint8_t splits_v;  ///< bit l: level l halves v
};

/// u and v in turn, u first: the paper's tree (Nigam & Narayanan 2012, section 3.3).
constexpr subpatch_splits alternating_splits(int depth) { return {depth, 0xaa}; }

namespace detail {

inline constexpr unsigned most_subpatch_leaves = 1u << max_subpatch_depth;

/// Node numbers of the places of all levels.
struct place_numbers {
  std::uint16_t node[2 * most_subpatch_leaves];

  constexpr place_numbers() : node{0, 1} {
    for (unsigned size = 1; size < most_subpatch_leaves; size *= 2)
      for (unsigned k = size; k < 2 * size; ++k) {
        node[size + k] = static_cast<std::uint16_t>(2 * node[k]);
        node[2 * size + k] = static_cast<std::uint16_t>(2 * node[k] + 1);
      }
  }
};
inline constexpr place_numbers places{};

/// How far a polynomial patch leaves its tangent plane in the middle of the square, by coordinate.
template <int M, int N> vec3<double> remainder_of(bezier_patch<double, M, N> const& patch) {
  surface_point<double> const middle = evaluate(patch, 0.5, 0.5);
  vec3<double> farthest(0.0);
  for (int i = 0; i <= M; ++i)
    for (int j = 0; j <= N; ++j) {
      vec3<double> const plane =
          fma(double(i) / M - 0.5, middle.du, fma(double(j) / N - 0.5, middle.dv, middle.position));
      vec3<double> const off = absolute(difference(patch(i, j), plane));
      farthest = {max(farthest.x, off.x), max(farthest.y, off.y), max(farthest.z, off.z)};
    }
  return farthest;
}
template <int M, int N> vec3<double> cell_remainder(bezier_patch<double, M, N> const& part, vec3<double> const&) {
  return remainder_of(part);
}
/// Of a rational patch's functions A - W o with |o| up to `farthest`.
template <int M, int N>
vec3<double> cell_remainder(rational_patch<double, M, N> const& part, vec3<double> const& farthest) {
  bezier_patch<double, M, N> weights;
  for (int k = 0; k < (M + 1) * (N + 1); ++k) weights.control_points[k] = vec3<double>(weight(part, k), 0.0, 0.0);
  return fma(remainder_of(weights).x, farthest, remainder_of(numerator(part)));
}

/// The boxes and leaves of one patch's tree before they are rounded to bytes.
///
/// Bit l of a sub-patch's place says which half of level l it is in, so that the second halves of a level come after
/// all first ones, and every step is a loop over neighbours. Boxes of level l begin at place 2^l, remainders and cones
/// at 0.
struct exact_subpatch_tree {
  static constexpr unsigned most_leaves = most_subpatch_leaves;

  alignas(32) float lo[3][2 * most_leaves], hi[3][2 * most_leaves];
  alignas(32) float apart[3][most_leaves];  // from the first half's box to the second's, doubled
  alignas(32) float remainder[3][most_leaves], axis[3][most_leaves], sine[most_leaves];
  alignas(32) lane_row widest_remainder[3];

  exact_subpatch_tree(bicubic_patch<float> const& patch, subpatch_splits splits) : splits_(splits) {
    lane_nets nets, second;
    auto const fill = [](lane_row(&row)[3], vec3<float> const& p, float& most) {
      for (int c = 0; c < 3; ++c) {
        most = max(most, std::fabs(p[c]));
        for (float& lane : row[c]) lane = p[c];
      }
    };
    auto const& p = patch.control_points;
    float most = 0, most_along_u = 0, most_along_v = 0;
    for (int q = 0; q < 16; ++q) fill(nets.point[q], p[q], most);
    for (int q = 0; q < 12; ++q) {
      fill(nets.along_u[q], p[q + 4] - p[q], most_along_u);
      fill(nets.along_v[q], p[q % 4 * 4 + q / 4 + 1] - p[q % 4 * 4 + q / 4], most_along_v);
    }
    // The worst, in units of 2^-24: conversion to float moves a coordinate of a point by 1 `most`, that of a vector by
    // 2 of these and 1 of its own; eight halvings move either by 24. In any direction that is sqrt(3) times as much,
    // and five times as much is asked for. A remainder is off by fewer than 150.
    error_ = 0x1p-16f * most;
    error_u_ = 0x1p-19f * most + 0x1p-16f * most_along_u;
    error_v_ = 0x1p-19f * most + 0x1p-16f * most_along_v;
    for (auto& row : widest_remainder)
      for (float& r : row) r = 0;
    int level = 0;
    for (; level < splits.depth && 1 << level < net_lanes; ++level) {
      halve(nets, is_along_v(level), second);
      choose_half(nets, second, level);
    }
    build_leaves(nets, 0u, level);
    for (level = splits.depth - 1; level >= 0; --level) join_boxes(1u << level);
  }

  /// Of any patch, sub-patch by sub-patch in double; without cones.
  template <class Surface> exact_subpatch_tree(Surface const& patch, subpatch_splits splits) : splits_(splits) {
    box<double> const whole = bounds(patch);
    vec3<double> farthest(0.0);
    for (int c = 0; c < 3; ++c) farthest[c] = std::max(std::fabs(whole.lo[c]), std::fabs(whole.hi[c]));
    double const most = std::max({farthest.x, farthest.y, farthest.z});
    farthest = farthest + vec3<double>(0x1p-18 + 0x1p-6 * most);  // where a ray can enter the patch's box
    error_ = 0x1p-20f * static_cast<float>(most);
    for (auto& row : widest_remainder)
      for (float& r : row) r = 0;
    unsigned const leaf_count = 1u << splits.depth;
    subpatch_tree tree{};
    tree.depth = static_cast<std::uint8_t>(splits.depth);
    tree.splits_v = splits.splits_v;
    for (unsigned place = 0; place < leaf_count; ++place) {
      patch_cell<float> const cell = subpatch_cell(tree, places.node[leaf_count + place]);
      auto const from = [](float at, float half) { return 0.5 + 0.5 * (double(at) - double(half)); };
      auto const part = sub_patch(patch, from(cell.x, cell.half_x), from(cell.x, -cell.half_x),
                                  from(cell.y, cell.half_y), from(cell.y, -cell.half_y));
      box<double> const hull = bounds(part);
      vec3<double> const left = cell_remainder(part, farthest);
      for (int c = 0; c < 3; ++c) {
        lo[c][leaf_count + place] = static_cast<float>(hull.lo[c]) - error_;
        hi[c][leaf_count + place] = static_cast<float>(hull.hi[c]) + error_;
        remainder[c][place] = static_cast<float>(left[c]) + error_;
        widest_remainder[c][0] = max(widest_remainder[c][0], remainder[c][place]);
        axis[c][place] = 0;
      }
      sine[place] = 2;
    }
    for (int level = splits.depth - 1; level >= 0; --level) join_boxes(1u << level);
  }

  /// Boxes that reach farther by `gap`.
  void widen(float gap) {
    for (int c = 0; c < 3; ++c)
      for (unsigned k = 1; k < 2u << splits_.depth; ++k) {
        lo[c][k] -= gap;
        hi[c][k] += gap;
      }
  }

 private:
  bool is_along_v(int level) const { return (splits_.splits_v >> level & 1) != 0; }

  /// The leaves below `nets`, which begin at place `place` of level `level`.
  void build_leaves(lane_nets& nets, unsigned place, int level) {
    if (level < splits_.depth) {
      lane_nets second;
      halve(nets, is_along_v(level), second);
      build_leaves(nets, place, level + 1);
      build_leaves(second, place + (1u << level), level + 1);
      return;
    }
    lane_bounds b;
    bound_hulls(nets, b);
    bound_remainders(nets, error_, b);
    bound_normals(nets, error_u_, error_v_, b);
    unsigned const box = (1u << level) + place;
    for (int c = 0; c < 3; ++c)
      for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
        lo[c][box + unsigned(k)] = b.lo[c][k];
        hi[c][box + unsigned(k)] = b.hi[c][k];
        remainder[c][place + unsigned(k)] = b.remainder[c][k];
        widest_remainder[c][k] = max(widest_remainder[c][k], b.remainder[c][k]);
        axis[c][place + unsigned(k)] = b.axis[c][k];
      });
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA { sine[place + unsigned(k)] = b.sine[k]; });
  }

  /// The boxes of the level of `size` sub-patches from those of the next one.
  void join_boxes(unsigned size) {
    for (int c = 0; c < 3; ++c)
      for (unsigned k = size; k < 2 * size; ++k) {
        float const lo1 = lo[c][size + k], lo2 = lo[c][2 * size + k];
        float const hi1 = hi[c][size + k], hi2 = hi[c][2 * size + k];
        lo[c][k] = min(lo1, lo2);
        hi[c][k] = max(hi1, hi2);
        apart[c][k] = (lo2 + hi2) - (lo1 + hi1);
      }
  }

  subpatch_splits splits_;
  float error_, error_u_, error_v_;  // of remainders and of vectors
};

/// x without its fraction, for 0 <= x < 256.
inline std::uint32_t to_byte(float x) { return static_cast<std::uint32_t>(static_cast<std::int32_t>(x)); }
inline std::uint8_t byte_of(std::uint32_t word, int k) { return static_cast<std::uint8_t>(word >> 8 * k); }

/// Boxes go outward by an eighth of a step at the least.
inline void write_nodes(exact_subpatch_tree const& exact, subpatch_tree const& tree, subpatch_node* nodes) {
  constexpr unsigned most = exact_subpatch_tree::most_leaves;
  alignas(32) std::uint32_t low[2 * most], high[2 * most];
  unsigned const leaf_count = 1u << tree.depth;
  float per_step[3];
  for (int c = 0; c < 3; ++c) per_step[c] = 1.0f / tree.grid_step[c];
  vec3<float> const origin = tree.grid_origin;
  for (unsigned k = 1; k < 2 * leaf_count; ++k) {
    std::uint32_t lo[3], hi[3];
    for (int c = 0; c < 3; ++c) {
      lo[c] = to_byte((exact.lo[c][k] - origin[c]) * per_step[c] - 0.125f);
      hi[c] = to_byte((exact.hi[c][k] - origin[c]) * per_step[c] + 1.125f);
    }
    low[k] = lo[0] | lo[1] << 8 | lo[2] << 16 | hi[0] << 24;
    high[k] = hi[1] | hi[2] << 8;
  }
  for (unsigned k = 1; k < leaf_count; ++k) {
    float const x = exact.apart[0][k], y = exact.apart[1][k], z = exact.apart[2][k];
    std::uint32_t order = 0;  // the opposite octant has the opposite sign
    for (unsigned octant = 0; octant < 4; ++octant) {
      float const along = (octant & 1u ? -x : x) + (octant & 2u ? -y : y) + z;
      order |= std::uint32_t(along < 0) << octant | std::uint32_t(along > 0) << (7 - octant);
    }
    high[k] |= order << 16;
  }
  for (unsigned k = 1; k < 2 * leaf_count; ++k) {
    std::uint32_t const l = low[k], h = high[k];
    nodes[places.node[k] - 1] = {
        {byte_of(l, 0), byte_of(l, 1), byte_of(l, 2)}, {byte_of(l, 3), byte_of(h, 0), byte_of(h, 1)}, byte_of(h, 2), 0};
  }
}

/// Remainders go up by a quarter of a step at the least, sines by two steps, 2^-7: many times what rounding makes of
/// their formulas, and enough to tell by a second look at a cone, narrower by 2^-8, on which side of its axis the
/// normals are.
inline void write_leaves(exact_subpatch_tree const& exact, subpatch_tree const& tree, subpatch_leaf* leaves) {
  alignas(32) std::uint32_t low[exact_subpatch_tree::most_leaves], high[exact_subpatch_tree::most_leaves];
  unsigned const leaf_count = 1u << tree.depth;
  float per_step[3];
  for (int c = 0; c < 3; ++c) per_step[c] = 1.0f / tree.remainder_step[c];
  for (unsigned k = 0; k < leaf_count; ++k) {
    std::uint32_t r[3], a[3];
    for (int c = 0; c < 3; ++c) {
      r[c] = to_byte(exact.remainder[c][k] * per_step[c] + 1.25f);
      a[c] = static_cast<std::uint32_t>(static_cast<std::int32_t>(exact.axis[c][k])) & 0xffu;
    }
    low[k] = r[0] | r[1] << 8 | r[2] << 16 | to_byte(min(exact.sine[k] * 255.0f + 3.0f, 255.0f)) << 24;
    high[k] = a[0] | a[1] << 8 | a[2] << 16;
  }
  for (unsigned k = 0; k < leaf_count; ++k) {
    std::uint32_t const l = low[k], h = high[k];
    leaves[places.node[leaf_count + k] - leaf_count] = {
        {byte_of(l, 0), byte_of(l, 1), byte_of(l, 2)},
        byte_of(l, 3),
        {static_cast<std::int8_t>(byte_of(h, 0)), static_cast<std::int8_t>(byte_of(h, 1)),
         static_cast<std::int8_t>(byte_of(h, 2))},
        0};
  }
}

}  // namespace detail

/// The number of nodes and of leaves of a tree of depth `depth`.
constexpr std::uint32_t subpatch_node_count(int depth) { return (2u << depth) - 1u; }
constexpr std::uint32_t subpatch_leaf_count(int depth) { return 1u << depth; }

/// Builds the tree of `patch` into `nodes` and `leaves`, which hold as many as the two functions above say.
///
/// The grid has 250 steps across the patch's box a coordinate, and never steps below 2^-8 of those of the widest one;
/// boxes are rounded outward with an eighth of a step to spare, hundreds of times what float's rounding does to rays
/// and nets of this size. Offsets in the result are left zero.
///
/// Boxes reach `gap` farther than the patch. `Net` is a bicubic patch in float, or any kind of patch in double.
template <class Net>
subpatch_tree build_subpatch_tree(Net const& patch, subpatch_splits splits, float gap, std::span<subpatch_node> nodes,
                                  std::span<subpatch_leaf> leaves) {
  PATCHRT_EXPECTS(nodes.size() == subpatch_node_count(splits.depth));
  PATCHRT_EXPECTS(leaves.size() == subpatch_leaf_count(splits.depth));
  detail::exact_subpatch_tree exact(patch, splits);
  if (gap > 0) exact.widen(gap);

  subpatch_tree tree{};
  tree.depth = static_cast<std::uint8_t>(splits.depth);
  tree.splits_v = splits.splits_v;
  vec3<float> const lowest(exact.lo[0][1], exact.lo[1][1], exact.lo[2][1]);
  vec3<float> const size = vec3<float>(exact.hi[0][1], exact.hi[1][1], exact.hi[2][1]) - lowest;
  float const widest = std::max({size.x, size.y, size.z, 1e-30f});
  for (int c = 0; c < 3; ++c) {
    tree.grid_step[c] = std::max(size[c], widest / 256.0f) / 250.0f;
    tree.grid_origin[c] = lowest[c] - 2.0f * tree.grid_step[c];
    float const remainder = *std::max_element(exact.widest_remainder[c], exact.widest_remainder[c] + detail::net_lanes);
    tree.remainder_step[c] = std::max(remainder / 250.0f, widest * 1e-7f);
  }
  detail::write_nodes(exact, tree, nodes.data());
  detail::write_leaves(exact, tree, leaves.data());
  return tree;
}

}  // namespace patchrt
