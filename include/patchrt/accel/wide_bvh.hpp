// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/box.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace patchrt {

/// Up to eight children of a node, a lane each: what single rays and coherent packs walk on the CPU.
///
/// Where child k is, seen from the node's middle, bits 0, 1 and 2 of k say as well as they can: set for the positive side
/// of x, y and z. For a direction of octant o the children are then met from near to far about in the order o, o ^ 1,
/// ..., o ^ 7, so that nothing is sorted while rays are traced.
/// \note Ylitie, Karras & Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", HPG 2017,
///       section 3.3.
struct alignas(64) wide_node {
  static constexpr int width = 8;
  static constexpr std::uint32_t leaf = 1u << 31;

  float bounds[6][width];      ///< lo.x, hi.x, lo.y, hi.y, lo.z, hi.z; lo = inf, hi = -inf where there is no child
  std::uint32_t child[width];  ///< the number of a node, or `leaf` and that of a leaf
};
static_assert(sizeof(wide_node) == 256);

/// What a walk needs of a wide tree. Node 0 is the root.
struct wide_bvh_view {
  wide_node const* nodes;
  std::uint32_t count;
};

/// A tree with up to eight children a node over the leaves of a binary one; no nodes for none.
struct wide_bvh {
  std::vector<wide_node> nodes;

  wide_bvh_view view() const { return {nodes.data(), static_cast<std::uint32_t>(nodes.size())}; }
  std::size_t bytes() const { return nodes.size() * sizeof(wide_node); }
};

}  // namespace patchrt
