// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The binary tree of sub-patch boxes inside one patch: fixed depth, boxes in bytes, no pointers.

#include <patchrt/core/box.hpp>
#include <patchrt/intersect/ray_patch.hpp>

#include <bit>
#include <cstdint>
#include <type_traits>

namespace patchrt {

/// The box of one sub-patch in steps of its patch's grid, rounded outward, and the order of its two children.
///
/// Bit o of `second_first` is set where, for rays of direction octant o (bit 0: x negative, 1: y, 2: z), the second
/// child is the nearer one.
struct subpatch_node {
  std::uint8_t lo[3];
  std::uint8_t hi[3];
  std::uint8_t second_first;
  std::uint8_t unused;
};
static_assert(sizeof(subpatch_node) == 8);

/// How a leaf sub-patch bends.
///
/// `remainder` bounds how far it leaves its tangent plane, by coordinate, in steps of its tree's `remainder_step`. All
/// products S_u x S_v' of its tangents, at one point or at two, are within the cone about `axis` / 127 whose half angle
/// has the sine `sine` / 255, 255 standing for no cone at all; a ray whose direction is farther from the leaf's tangent
/// planes than that meets it once at most: preconditioned by the Jacobian at any point, the two plane functions have a
/// P-matrix for their Jacobian, and so are injective (Gale & Nikaido 1965, theorem 4).
struct subpatch_leaf {
  std::uint8_t remainder[3];
  std::uint8_t sine;
  std::int8_t axis[3];
  std::uint8_t unused;
};
static_assert(sizeof(subpatch_leaf) == 8);

/// Whether the leaves of patches of a kind have cones: only bicubic patches' do; of others a leaf's `sine` is 255.
template <class Surface> inline constexpr bool has_normal_cones = std::is_same_v<Surface, bicubic_patch<double>>;

/// What is the same for all nodes of one patch's tree.
///
/// Nodes are numbered as in a heap: 1 is the whole patch, 2k and 2k + 1 the halves of k; node k's level is the place of
/// its highest bit, and a node of level `depth` is a leaf. Level l splits v where bit l of `splits_v` is set, else u.
/// The whole patch has no box of its own (the hierarchy above holds it), only an order for its children.
struct subpatch_tree {
  vec3<float> grid_origin;
  vec3<float> grid_step;
  vec3<float> remainder_step;
  std::uint32_t first_node;  ///< node k is nodes[first_node + k - 1]
  std::uint32_t first_leaf;  ///< leaf k is leaves[first_leaf + k - 2^depth]
  std::uint8_t depth;
  std::uint8_t splits_v;
};

/// The largest depth a subpatch_tree can have.
inline constexpr int max_subpatch_depth = 8;

/// The cell of the parameter square, in centred parameters, that node `k` of the tree stands for; remainder left zero.
PATCHRT_HD inline patch_cell<float> subpatch_cell(subpatch_tree const& tree, std::uint32_t k) {
  patch_cell<float> c{0, 0, 1, 1, {0, 0, 0}};
  int const level = int(std::bit_width(k)) - 1;
  for (int l = 0; l < level; ++l) {
    float const side = (k >> (level - 1 - l)) & 1u ? 0.5f : -0.5f;
    if (tree.splits_v >> l & 1) {
      c.y = std::fma(side, c.half_y, c.y);
      c.half_y *= 0.5f;
    } else {
      c.x = std::fma(side, c.half_x, c.x);
      c.half_x *= 0.5f;
    }
  }
  return c;
}

/// Walks the tree below the whole patch, near children first for rays of direction octant `octant`, without a stack.
///
/// `enter(node) -> bool` is asked of every box that is reached and says whether to go inside; `leaf(k, index)` gets the
/// leaf's node number and its place among the tree's leaves, and is called without `enter` where the depth is 0.
template <class Enter, class Leaf>
PATCHRT_INLINE void traverse(subpatch_tree const& tree, subpatch_node const* nodes, unsigned octant, Enter&& enter,
                             Leaf&& leaf) {
  nodes += tree.first_node;
  std::uint32_t const leaves = 1u << tree.depth;
  if (leaves == 1) {
    leaf(std::uint32_t(1), std::uint32_t(0));
    return;
  }
  std::uint32_t k = 2u + (nodes[0].second_first >> octant & 1u);
  std::uint32_t trail = 0;  // bit i: the ancestor i levels up is the second of its parent's children to be visited
  for (;;) {
    if (enter(nodes[k - 1])) {
      if (k < leaves) {
        k = 2 * k + (nodes[k - 1].second_first >> octant & 1u);
        trail <<= 1;
        continue;
      }
      leaf(k, k - leaves);
    }
    // ones at the end of the trail; nvcc 13 compiles std::countr_one to a constant
    int const up = std::popcount(trail & ~(trail + 1));
    k = (k >> up) ^ 1u;
    if (k <= 1) return;  // the whole patch was done
    trail = (trail >> up) | 1u;
  }
}

}  // namespace patchrt
