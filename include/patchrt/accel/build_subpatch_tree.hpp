// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/subpatch_tree.hpp>

#include <algorithm>
#include <array>
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

/// Control points with x, y, z and a zero, so that a row of four is one vector of sixteen.
struct padded_net {
  alignas(64) float row[4][16];
};

inline padded_net transpose(padded_net const& n) {
  padded_net t;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int c = 0; c < 4; ++c) t.row[j][4 * i + c] = n.row[i][4 * j + c];
  return t;
}

/// De Casteljau at one half across the rows.
inline void split_rows(padded_net const& n, padded_net& first, padded_net& second) {
  for (int k = 0; k < 16; ++k) {
    float const p0 = n.row[0][k], p1 = n.row[1][k], p2 = n.row[2][k], p3 = n.row[3][k];
    float const a = 0.5f * (p0 + p1), b = 0.5f * (p1 + p2), c = 0.5f * (p2 + p3);
    float const d = 0.5f * (a + b), e = 0.5f * (b + c), m = 0.5f * (d + e);
    first.row[0][k] = p0;
    first.row[1][k] = a;
    first.row[2][k] = d;
    first.row[3][k] = m;
    second.row[0][k] = m;
    second.row[1][k] = e;
    second.row[2][k] = c;
    second.row[3][k] = p3;
  }
}

inline box<float> hull_box(padded_net const& n) {
  alignas(64) float lo[16], hi[16];
  for (int k = 0; k < 16; ++k) {
    lo[k] = std::min(std::min(n.row[0][k], n.row[1][k]), std::min(n.row[2][k], n.row[3][k]));
    hi[k] = std::max(std::max(n.row[0][k], n.row[1][k]), std::max(n.row[2][k], n.row[3][k]));
  }
  box<float> b;
  for (int c = 0; c < 3; ++c) {
    b.lo[c] = std::min(std::min(lo[c], lo[4 + c]), std::min(lo[8 + c], lo[12 + c]));
    b.hi[c] = std::max(std::max(hi[c], hi[4 + c]), std::max(hi[8 + c], hi[12 + c]));
  }
  return b;
}

/// The largest difference, by coordinate, between the net and the control net of its tangent plane at the middle: by the
/// hull property a bound on the same difference between the surfaces.
inline vec3<float> tangent_remainder(padded_net const& n) {
  alignas(64) float value[16], slope[16];  // of each column's cubic in the middle
  for (int k = 0; k < 16; ++k) {
    float const mids = n.row[1][k] + n.row[2][k];
    value[k] = 0.125f * (n.row[0][k] + n.row[3][k]) + 0.375f * mids;
    slope[k] = 0.75f * ((n.row[3][k] - n.row[0][k]) + (n.row[2][k] - n.row[1][k]));
  }
  vec3<float> bound(0.0f);
  for (int c = 0; c < 3; ++c) {
    float const s = 0.125f * (value[c] + value[12 + c]) + 0.375f * (value[4 + c] + value[8 + c]);
    float const by_row = 0.125f * (slope[c] + slope[12 + c]) + 0.375f * (slope[4 + c] + slope[8 + c]);
    float const by_column = 0.75f * ((value[12 + c] - value[c]) + (value[8 + c] - value[4 + c]));
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        float const linear = s + (float(i) / 3.0f - 0.5f) * by_row + (float(j) / 3.0f - 0.5f) * by_column;
        bound[c] = std::max(bound[c], std::fabs(n.row[i][4 * j + c] - linear));
      }
  }
  return bound;
}

/// The cone of all products of a tangent along the first index with one along the second: axis and the sine of the half angle,
/// 2 where there is no cone narrower than a half space. The control vectors of both tangents make all such products as positive
/// combinations of their own, so that a cone around those holds all.
struct tangent_cone {
  vec3<float> axis;
  float sine;
};
inline tangent_cone bound_normals(padded_net const& n) {
  alignas(64) float x[3][16], y[3][16], mean[2][3] = {};
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 12; ++k) {
      x[c][k] = n.row[k / 4 + 1][4 * (k % 4) + c] - n.row[k / 4][4 * (k % 4) + c];
      y[c][k] = n.row[k % 4][4 * (k / 4 + 1) + c] - n.row[k % 4][4 * (k / 4) + c];
      mean[0][c] += x[c][k];
      mean[1][c] += y[c][k];
    }
    for (int k = 12; k < 16; ++k) x[c][k] = y[c][k] = 0;
  }
  vec3<float> axis =
      cross(vec3<float>(mean[0][0], mean[0][1], mean[0][2]), vec3<float>(mean[1][0], mean[1][1], mean[1][2]));
  float const length = std::sqrt(dot(axis, axis));
  if (!(length > 0)) return {{0, 0, 1}, 2};
  axis = axis / length;
  float least[16];
  for (int k = 0; k < 16; ++k) least[k] = 1;
  for (int a = 0; a < 12; ++a)
    for (int k = 0; k < 16; ++k) {
      float const cx = x[1][a] * y[2][k] - x[2][a] * y[1][k];
      float const cy = x[2][a] * y[0][k] - x[0][a] * y[2][k];
      float const cz = x[0][a] * y[1][k] - x[1][a] * y[0][k];
      float const along = axis.x * cx + axis.y * cy + axis.z * cz;
      float const squared = cx * cx + cy * cy + cz * cz;
      // the cosine's sign times its square, without a root; a product that vanished says nothing
      float const cosine = squared > 0 ? along * std::fabs(along) / squared : 1.0f;
      least[k] = std::min(least[k], cosine);
    }
  float cosine = 1;
  for (int k = 0; k < 16; ++k) cosine = std::min(cosine, least[k]);
  if (!(cosine > 0)) return {axis, 2};
  return {axis, std::sqrt(std::max(1 - cosine, 0.0f))};
}

/// The boxes and remainders of one patch's tree before they are rounded to bytes; heap numbering, entry k - 1 for node k.
struct exact_subpatch_tree {
  std::array<box<float>, (2u << max_subpatch_depth)> boxes;
  std::array<std::uint8_t, (1u << max_subpatch_depth)> second_first;
  std::array<vec3<float>, (1u << max_subpatch_depth)> remainders;
  std::array<tangent_cone, (1u << max_subpatch_depth)> cones;

  void build(padded_net const& net, bool rows_are_u, std::uint32_t k, int level, subpatch_splits splits) {
    if (level == splits.depth) {
      boxes[k - 1] = hull_box(net);
      remainders[k - (1u << level)] = tangent_remainder(net);
      cones[k - (1u << level)] = bound_normals(net);
      return;
    }
    bool const split_u = !(splits.splits_v >> level & 1);
    padded_net first, second;
    split_rows(split_u == rows_are_u ? net : transpose(net), first, second);
    build(first, split_u, 2 * k, level + 1, splits);
    build(second, split_u, 2 * k + 1, level + 1, splits);
    box<float> const &a = boxes[2 * k - 1], &b = boxes[2 * k];
    boxes[k - 1] = merge(a, b);
    vec3<float> const from_first_to_second = (b.lo + b.hi) - (a.lo + a.hi);
    unsigned order = 0;
    for (unsigned octant = 0; octant < 8; ++octant) {
      float along = 0;
      for (int c = 0; c < 3; ++c) along += (octant >> c & 1 ? -1.0f : 1.0f) * from_first_to_second[c];
      order |= unsigned(along < 0) << octant;
    }
    second_first[k - 1] = static_cast<std::uint8_t>(order);
  }
};

}  // namespace detail

/// The number of nodes and of leaves of a tree of depth `depth`.
constexpr std::uint32_t subpatch_node_count(int depth) { return (2u << depth) - 1u; }
constexpr std::uint32_t subpatch_leaf_count(int depth) { return 1u << depth; }

/// Builds the tree of `patch` into `nodes` and `leaves`, which hold as many as the two functions above say.
///
/// The grid has 250 steps across the patch's box a coordinate, and never steps below 2^-8 of those of the widest one; boxes are
/// rounded outward with an eighth of a step to spare, hundreds of times what float's rounding does to rays and nets of this size.
/// Offsets in the result are left zero.
inline subpatch_tree build_subpatch_tree(bicubic_patch<float> const& patch, subpatch_splits splits,
                                         std::span<subpatch_node> nodes, std::span<subpatch_leaf> leaves) {
  detail::padded_net net;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      vec3<float> const& p = patch.control_points[4 * i + j];
      net.row[i][4 * j] = p.x;
      net.row[i][4 * j + 1] = p.y;
      net.row[i][4 * j + 2] = p.z;
      net.row[i][4 * j + 3] = 0;
    }
  detail::exact_subpatch_tree exact;
  exact.build(net, true, 1, 0, splits);

  subpatch_tree tree{};
  tree.depth = static_cast<std::uint8_t>(splits.depth);
  tree.splits_v = splits.splits_v;
  box<float> const whole = exact.boxes[0];
  vec3<float> const size = extent(whole);
  float const widest = std::max({size.x, size.y, size.z, 1e-30f});
  vec3<float> widest_remainder(0.0f);
  std::uint32_t const leaf_count = subpatch_leaf_count(splits.depth);
  for (std::uint32_t k = 0; k < leaf_count; ++k)
    for (int c = 0; c < 3; ++c) widest_remainder[c] = std::max(widest_remainder[c], exact.remainders[k][c]);
  vec3<float> per_step, per_remainder;
  for (int c = 0; c < 3; ++c) {
    tree.grid_step[c] = std::max(size[c], widest / 256.0f) / 250.0f;
    tree.grid_origin[c] = whole.lo[c] - 2.0f * tree.grid_step[c];
    tree.remainder_step[c] = std::max(widest_remainder[c] / 250.0f, widest * 1e-7f);
    per_step[c] = 1.0f / tree.grid_step[c];
    per_remainder[c] = 1.0f / tree.remainder_step[c];
  }
  std::uint32_t const node_count = subpatch_node_count(splits.depth);
  for (std::uint32_t k = 0; k < node_count; ++k) {
    box<float> const& b = exact.boxes[k];
    for (int c = 0; c < 3; ++c) {
      nodes[k].lo[c] = static_cast<std::uint8_t>((b.lo[c] - tree.grid_origin[c]) * per_step[c] - 0.125f);
      nodes[k].hi[c] = static_cast<std::uint8_t>((b.hi[c] - tree.grid_origin[c]) * per_step[c] + 1.125f);
    }
    nodes[k].second_first = k + 1 < leaf_count ? exact.second_first[k] : std::uint8_t(0);
    nodes[k].unused = 0;
  }
  for (std::uint32_t k = 0; k < leaf_count; ++k) {
    for (int c = 0; c < 3; ++c)
      leaves[k].remainder[c] = static_cast<std::uint8_t>(exact.remainders[k][c] * per_remainder[c] + 1.5f);
    for (int c = 0; c < 3; ++c) leaves[k].axis[c] = static_cast<std::int8_t>(std::lround(127 * exact.cones[k].axis[c]));
    // Rounding the axis turns it, and changes its length, by up to sqrt(3) / 254 < 0.0069.
    float const sine = (exact.cones[k].sine + 0.015f) * 255.0f + 1.0f;
    leaves[k].sine = static_cast<std::uint8_t>(std::min(sine, 255.0f));
    leaves[k].unused = 0;
  }
  return tree;
}

}  // namespace patchrt
