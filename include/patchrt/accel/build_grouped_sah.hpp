// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/build_sah.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace patchrt {

/// A tree whose leaves hold several primitives: of leaf i those of numbers order[first[i]] to order[first[i + 1] - 1].
template <class T> struct grouped_bvh {
  bvh<T> tree;
  std::vector<std::uint32_t> order;
  std::vector<std::uint32_t> first;  ///< one more than there are leaves
};

namespace detail {

/// Leaves of as many primitives as fit, by the place of their first one in `order`.
template <std::size_t Most, class Fits> struct sah_grouped_leaves {
  static constexpr std::size_t most = Most;
  Fits const& fits;
  std::uint32_t* order;

  template <class T>
  std::int32_t operator()(sah_primitive<T> const* begin, sah_primitive<T> const* end, std::size_t place) const {
    std::uint32_t* const to = order + place;
    std::size_t const n = static_cast<std::size_t>(end - begin);
    for (std::size_t i = 0; i < n; ++i) to[i] = static_cast<std::uint32_t>(begin[i].index());
    return n == 1 || fits(std::span<std::uint32_t const>(to, n)) ? static_cast<std::int32_t>(place) : -1;
  }
};

/// Puts the parts of a tree together, without the room between them, and numbers its leaves.
template <class T, executor E>
void join_parts(bvh_node<T> const* nodes, sah_parts made, grouped_bvh<T>& grouped, E const& exec) {
  std::vector<std::size_t>& top = made.top;
  std::vector<sah_part>& parts = made.parts;
  std::sort(top.begin(), top.end());
  std::sort(parts.begin(), parts.end(), [](sah_part const& a, sah_part const& b) { return a.node < b.node; });
  std::vector<std::pair<std::size_t, std::size_t>> to;  // the first node and the first leaf of each part
  std::size_t node = 0, leaf = 0;
  auto above = top.begin();
  for (sah_part const& p : parts) {
    for (; above != top.end() && *above < p.node; ++above) *above = node++;
    to.emplace_back(node, leaf);
    node += p.nodes;
    leaf += (p.nodes + 1) / 2;
  }
  std::vector<bvh_node<T>>& dense = grouped.tree.nodes;
  dense.resize(node);
  grouped.first.resize(leaf + 1);
  grouped.first[leaf] = static_cast<std::uint32_t>(grouped.order.size());
  exec.for_each_chunk(parts.size(), 1, [&](std::size_t i, std::size_t) {
    auto [next, number] = to[i];
    std::size_t const back = parts[i].node - next;
    for (std::size_t k = parts[i].node; k < parts[i].node + parts[i].nodes; ++k, ++next) {
      dense[next] = nodes[k];
      dense[next].skip -= static_cast<std::uint32_t>(back);
      if (nodes[k].primitive < 0) continue;
      grouped.first[number] = static_cast<std::uint32_t>(nodes[k].primitive);
      dense[next].primitive = static_cast<std::int32_t>(number++);
    }
  });
  for (std::size_t i = top.size(); i-- > 0;) {
    dense[top[i]].primitive = -1;
    fit_node(dense.data(), top[i]);
  }
}

/// The tree of `build_sah`, its leaves the largest subtrees of at most `Most` primitives for which `fits(primitives)`
/// holds, which is asked for two or more. The same leaves whatever the executor, numbered as they stand in the tree,
/// which has no links yet.
template <std::size_t Most, class T, class Fits, executor E>
grouped_bvh<T> build_grouped_sah(std::vector<sah_primitive<T>> primitives, Fits const& fits, E const& exec) {
  std::size_t const n = primitives.size();
  grouped_bvh<T> grouped;
  grouped.order.resize(n);
  if (n == 0) {
    grouped.first.push_back(0);
    return grouped;
  }
  auto const nodes = std::make_unique_for_overwrite<bvh_node<T>[]>(2 * n - 1);  // little of it is written
  sah_grouped_leaves<Most, Fits> const leaves{fits, grouped.order.data()};
  sah_parts made = sah_builder(std::move(primitives), sah_options{}.bins, leaves, nodes.get(), exec).build();
  join_parts(nodes.get(), std::move(made), grouped, exec);
  return grouped;
}

}  // namespace detail

}  // namespace patchrt
