// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/bvh.hpp>

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace patchrt {

/// A tree whose leaves hold several primitives: of leaf i those of numbers order[first[i]] to order[first[i + 1] - 1].
template <class T> struct grouped_bvh {
  bvh<T> tree;
  std::vector<std::uint32_t> order;
  std::vector<std::uint32_t> first;  ///< one more than there are leaves
};

/// Makes leaves of the largest subtrees of `fine` for which `fits(primitives)` holds: a span of one primitive always does.
///
/// `fits` gets no more than `most` primitives, in the tree's order. The tree has no links yet.
template <class T, class Fits> grouped_bvh<T> group_leaves(bvh<T> const& fine, std::size_t most, Fits const& fits) {
  grouped_bvh<T> grouped;
  std::size_t const n = fine.nodes.size();
  if (n == 0) {
    grouped.first.push_back(0);
    return grouped;
  }
  grouped.order.reserve((n + 1) / 2);
  std::vector<bvh_node<T>>& nodes = grouped.tree.nodes;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open;  // inner nodes, new number and old end, outermost first
  for (std::size_t i = 0; i < n;) {
    for (; !open.empty() && open.back().second == i; open.pop_back())
      nodes[open.back().first].skip = static_cast<std::uint32_t>(nodes.size());
    bvh_node<T> const& node = fine.nodes[i];
    std::size_t const count = (node.skip - i + 1) / 2, begin = grouped.order.size();
    bool is_leaf = false;
    if (count <= most) {
      for (std::size_t k = i; k < node.skip; ++k)
        if (fine.nodes[k].primitive >= 0) grouped.order.push_back(static_cast<std::uint32_t>(fine.nodes[k].primitive));
      is_leaf = count == 1 || fits(std::span<std::uint32_t const>(grouped.order).subspan(begin));
    }
    nodes.push_back(node);
    if (is_leaf) {
      nodes.back().primitive = static_cast<std::int32_t>(grouped.first.size());
      nodes.back().skip = static_cast<std::uint32_t>(nodes.size());
      grouped.first.push_back(static_cast<std::uint32_t>(begin));
      i = node.skip;
    } else {
      grouped.order.resize(begin);
      open.emplace_back(static_cast<std::uint32_t>(nodes.size() - 1), node.skip);
      ++i;
    }
  }
  for (auto const& [number, end] : open) nodes[number].skip = static_cast<std::uint32_t>(nodes.size());
  grouped.first.push_back(static_cast<std::uint32_t>(grouped.order.size()));
  return grouped;
}

}  // namespace patchrt
