// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Host only.

#include <patchrt/accel/bvh.hpp>
#include <patchrt/accel/sah_builder.hpp>
#include <patchrt/exec/serial.hpp>

#include <stdexcept>
#include <string>

namespace patchrt {

/// How finely `build_sah` looks for splits.
struct sah_options {
  int bins = 16;  ///< cells on each axis, 2 to 32
};

namespace detail {

/// Leaves of one primitive, by its index.
template <class T> struct sah_single_leaves {
  static constexpr std::size_t most = 1;
  std::int32_t operator()(sah_primitive<T> const* begin, sah_primitive<T> const*, std::size_t) const {
    return begin->index();
  }
};

}  // namespace detail

/// A tree over boxes by the surface area heuristic, centres binned on all three axes; exact sweeps for a few boxes.
///
/// Cost of a split = area(left) |left| + area(right) |right|. The same tree whatever the executor. Boxes of equal
/// centres are halved in order of index; an empty box becomes a leaf that no ray meets.
/// \param  boxes of primitives 0, 1, ...; at most 2^30.
/// \return 2 n - 1 nodes with a depth of at most 64 + log2 n; no nodes for no boxes.
/// \throws std::invalid_argument naming the primitive whose box has a NaN coordinate.
/// \note   Wald, "On fast construction of SAH-based bounding volume hierarchies", IEEE RT 2007; Guenther, Popov, Seidel &
///         Slusallek, "Realtime ray tracing on GPU with BVH-based packet traversal", IEEE RT 2007.
template <class T, executor E = serial>
bvh<T> build_sah(std::span<box<T> const> boxes, sah_options const& options = {}, E const& exec = {}) {
  if (options.bins < 2 || options.bins > detail::sah_bins<T>::most)
    throw std::invalid_argument("build_sah: " + std::to_string(options.bins) + " bins, expected 2 to 32");
  if (boxes.size() > std::size_t(1) << 30)
    throw std::length_error("build_sah: " + std::to_string(boxes.size()) + " boxes, expected at most 2^30");
  bvh<T> tree;
  if (boxes.empty()) return tree;
  tree.nodes.resize(2 * boxes.size() - 1);
  bvh_node<T>* const nodes = tree.nodes.data();
  detail::sah_single_leaves<T> const leaves;
  detail::sah_parts const made =
      detail::sah_builder(detail::sah_primitives(boxes, exec), options.bins, leaves, nodes, exec).build();
  for (std::size_t i = made.top.size(); i-- > 0;) detail::fit_node(nodes, made.top[i]);
  tree.links.resize(tree.nodes.size());
  octant_links* const links = tree.links.data();
  for (auto& l : links[0].link) l = static_cast<std::uint32_t>(tree.nodes.size()) << 1;
  for (std::size_t i : made.top) detail::link_children(nodes, links, i);
  exec.for_each_chunk(made.parts.size(), 1, [&made, nodes, links](std::size_t i, std::size_t) {
    detail::sah_part const& p = made.parts[i];
    for (std::size_t k = p.node; k < p.node + p.nodes; ++k) detail::link_children(nodes, links, k);
  });
  return tree;
}

/// The same with the default options.
template <class T, executor E> bvh<T> build_sah(std::span<box<T> const> boxes, E const& exec) {
  return build_sah(boxes, sah_options{}, exec);
}

}  // namespace patchrt
