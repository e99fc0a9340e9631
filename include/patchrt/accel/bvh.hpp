// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/box.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace patchrt {

/// A node of a binary tree laid out depth-first: node i's first child is i + 1, its second is nodes[i + 1].skip.
///
/// To walk the tree take i + 1 where node i's box is met and nodes[i].skip where not; the walk ends at the node count.
/// \note Nigam & Narayanan 2012, section 3.2: in double these are the paper's 56 bytes.
template <class T> struct bvh_node {
  box<T> bounds;
  std::int32_t primitive;  ///< -1 for an inner node
  std::uint32_t skip;      ///< the first node behind this one and all below it
};
static_assert(sizeof(bvh_node<float>) == 32 && sizeof(bvh_node<double>) == 56);

/// What stands in for a node's `skip` where the near child comes first, one for each octant of ray directions.
///
/// link[o] >> 1 is where to go once the node is missed or done, link[o] & 1 whether its second child comes first. Bit 0
/// of o says that the direction's x is negative, bit 1 y, bit 2 z.
struct octant_links {
  std::uint32_t link[8];
};
static_assert(sizeof(octant_links) == 32);

/// The octant of a direction, for `octant_links`.
template <scalar T> PATCHRT_INLINE unsigned direction_octant(vec3<T> const& d) {
  return unsigned(d.x < T(0)) | unsigned(d.y < T(0)) << 1 | unsigned(d.z < T(0)) << 2;
}

/// What a walk needs of a tree, on host or device.
template <class T> struct bvh_view {
  bvh_node<T> const* nodes;
  octant_links const* links;
  std::uint32_t count;
};

/// A tree with one primitive a leaf: 2 n - 1 nodes for n primitives, none for none.
template <class T> struct bvh {
  std::vector<bvh_node<T>> nodes;
  std::vector<octant_links> links;

  bvh_view<T> view() const { return {nodes.data(), links.data(), static_cast<std::uint32_t>(nodes.size())}; }
  std::size_t bytes() const { return nodes.size() * sizeof(bvh_node<T>) + links.size() * sizeof(octant_links); }
};

namespace detail {

/// The links of node i's children, where it has any, from its own.
template <class T> void link_children(bvh_node<T> const* nodes, octant_links* links, std::size_t i) {
  if (nodes[i].primitive >= 0) return;
  std::size_t const first = i + 1, second = nodes[first].skip;
  box<T> const &a = nodes[first].bounds, &b = nodes[second].bounds;
  vec3<T> const apart = (b.lo - a.lo) + (b.hi - a.hi);
  T const x = abs(apart.x), y = abs(apart.y), z = abs(apart.z);
  int const axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  unsigned const backward = component(apart, axis) < T(0);
  for (unsigned o = 0; o < 8; ++o) {
    std::uint32_t const second_first = (o >> axis & 1u) ^ backward;
    std::uint32_t const done = links[i].link[o] & ~1u;
    links[i].link[o] = done | second_first;
    links[first].link[o] = second_first ? done : static_cast<std::uint32_t>(second) << 1;
    links[second].link[o] = second_first ? static_cast<std::uint32_t>(first) << 1 : done;
  }
}

}  // namespace detail

/// Sets the links of every node: the child comes first that is nearer along the axis on which the children's centres
/// are farthest apart.
template <class T> void link_octants(std::span<bvh_node<T> const> nodes, std::span<octant_links> links) {
  PATCHRT_EXPECTS(nodes.size() == links.size());
  if (nodes.empty()) return;
  for (auto& l : links[0].link) l = static_cast<std::uint32_t>(nodes.size()) << 1;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    detail::link_children(nodes.data(), links.data(), i);  // parents come first
}

}  // namespace patchrt
