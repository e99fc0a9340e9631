// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/bvh.hpp>

namespace patchrt {

/// The octant of most of the lanes that are on, for `traverse`.
template <scalar T> PATCHRT_INLINE unsigned common_octant(vec3<T> const& direction, mask_t<T> const& lanes) {
  unsigned const on = mask_bits(lanes);
  auto const most = [on](mask_t<T> const& negative) {
    return 2 * std::popcount(mask_bits(negative) & on) > std::popcount(on) ? 1u : 0u;
  };
  return most(direction.x < T(0)) | most(direction.y < T(0)) << 1 | most(direction.z < T(0)) << 2;
}

/// Walks the tree without a stack, near child first for directions in `octant`, for a ray, a pack or anything else.
///
/// `enter(bounds)` says whether to go into a node's box, and so prunes by the nearest hit so far; `leaf(primitive)` is
/// called for every leaf entered and ends the walk by true.
/// \return whether `leaf` ended it.
template <class T, class Enter, class Leaf>
PATCHRT_INLINE bool traverse(bvh_view<T> const& tree, unsigned octant, Enter&& enter, Leaf&& leaf) {
  PATCHRT_EXPECTS(octant < 8);
  std::uint32_t i = 0;
  while (i < tree.count) {
    bvh_node<T> const& node = tree.nodes[i];
    std::uint32_t const link = tree.links[i].link[octant];
    if (!enter(node.bounds)) {
      i = link >> 1;
    } else if (node.primitive < 0) {
      i = (link & 1u) != 0 ? tree.nodes[i + 1].skip : i + 1;
    } else {
      if (leaf(node.primitive)) return true;
      i = link >> 1;
    }
  }
  return false;
}

/// The same in the order of the array, with nothing but `skip`.
template <class T, class Enter, class Leaf>
PATCHRT_HD bool traverse_unordered(bvh_view<T> const& tree, Enter&& enter, Leaf&& leaf) {
  std::uint32_t i = 0;
  while (i < tree.count) {
    bvh_node<T> const& node = tree.nodes[i];
    if (!enter(node.bounds)) {
      i = node.skip;
    } else {
      if (node.primitive >= 0 && leaf(node.primitive)) return true;
      ++i;  // the first child, or behind a leaf its skip
    }
  }
  return false;
}

}  // namespace patchrt
