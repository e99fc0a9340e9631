// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/bvh.hpp>

namespace patchrt {

/// Fits the tree's boxes to primitives that moved, in one backward pass; the tree's shape stays.
///
/// Rays find the same as in a new tree, the slower the more the primitives' order in space has changed.
/// \param boxes the box of each primitive, as many as the tree was built from.
/// \note  `link_octants` brings the order of the children up to date as well.
template <class T> void refit(std::span<bvh_node<T>> nodes, std::span<box<T> const> boxes) {
  PATCHRT_EXPECTS(nodes.size() + 1 == 2 * boxes.size() || (nodes.empty() && boxes.empty()));
  for (std::size_t i = nodes.size(); i-- > 0;) {
    bvh_node<T>& node = nodes[i];
    if (node.primitive >= 0) node.bounds = boxes[static_cast<std::size_t>(node.primitive)];
    else node.bounds = merge(nodes[i + 1].bounds, nodes[nodes[i + 1].skip].bounds);
  }
}

}  // namespace patchrt
