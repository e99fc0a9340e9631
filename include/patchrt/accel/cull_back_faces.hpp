// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Back-face culling for the rays of one eye: a mixed hierarchy in which sub-patches that face away are missed.

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/accel/refit.hpp>
#include <patchrt/shapes/bezier_split.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace patchrt {

/// The side of every patch that is its front: where S_u x S_v points, or the other one.
///
/// A model can be culled where its patches agree. The teapot's S_u x S_v point inward: its outside is `against_normal`.
enum class patch_front { along_normal, against_normal };

namespace detail {

/// Which way a leaf's normals go, seen along the axis of its cone: 1 or -1, and 0 where the cone does not hold them.
///
/// The cone comes from a net in float, which may be too coarse for a sliver; here the net is double. The normals must
/// be in a cone whose sine is 2^-8 less, for which `build_subpatch_tree` leaves room.
inline std::int8_t side_of_cone(bicubic_patch<double> const& cell, double per_size, subpatch_leaf const& leaf) {
  if (leaf.sine == 255) return 0;
  double x[3][12], y[3][12];
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 12; ++k) {
      int const i = k / 4, j = k % 4;
      x[c][k] = (cell(i + 1, j)[c] - cell(i, j)[c]) * per_size;
      y[c][k] = (cell(j, i + 1)[c] - cell(j, i)[c]) * per_size;
    }
  vec3<double> const axis = vec3<double>(leaf.axis[0], leaf.axis[1], leaf.axis[2]) / 127.0;
  double const sine = leaf.sine / 255.0 - 0x1p-8;
  double const least = dot(axis, axis) - sine * sine;  // the square of |axis| times the cosine
  bool forward = true, backward = true;
  for (int a = 0; a < 12; ++a)
    for (int b = 0; b < 12; ++b) {
      double const cx = x[1][a] * y[2][b] - x[2][a] * y[1][b];
      double const cy = x[2][a] * y[0][b] - x[0][a] * y[2][b];
      double const cz = x[0][a] * y[1][b] - x[1][a] * y[0][b];
      double const along = axis.x * cx + axis.y * cy + axis.z * cz;
      double const bound = least * (cx * cx + cy * cy + cz * cz);
      forward &= along * std::fabs(along) >= bound;
      backward &= -along * std::fabs(along) >= bound;
    }
  return static_cast<std::int8_t>(int(forward) - int(backward));
}

/// `side_of_cone` of all leaves below node `k`, whose control points are `cell`.
inline void find_sides(subpatch_tree const& tree, subpatch_leaf const* leaves, double per_size,
                       bicubic_patch<double> const& cell, int level, std::uint32_t k, std::int8_t* sides) {
  if (level == tree.depth) {
    std::uint32_t const leaf = k - (1u << level);
    sides[leaf] = side_of_cone(cell, per_size, leaves[leaf]);
    return;
  }
  auto const halves = tree.splits_v >> level & 1 ? split_v(cell) : split_u(cell);
  find_sides(tree, leaves, per_size, halves.first, level + 1, 2 * k, sides);
  find_sides(tree, leaves, per_size, halves.second, level + 1, 2 * k + 1, sides);
}

/// Whether (p - eye) . n >= 0 for all p in `b` and all n in the cone about `side` times the leaf's axis.
///
/// That is (p - eye) . axis >= sine |p - eye|; the difference of the two is concave in p, so that its least value over
/// the box is at a corner.
inline bool faces_away(subpatch_leaf const& leaf, int side, box<double> const& b, vec3<double> const& eye) {
  vec3<double> const axis = vec3<double>(leaf.axis[0], leaf.axis[1], leaf.axis[2]) * (side / 127.0);
  double const sine = leaf.sine / 255.0;
  vec3<double> const lo = b.lo - eye, hi = b.hi - eye;
  for (unsigned corner = 0; corner < 8; ++corner) {
    vec3<double> const w{corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y, corner & 4 ? hi.z : lo.z};
    double const along = dot(w, axis);
    if (!(along >= 0 && along * along >= sine * sine * dot(w, w))) return false;
  }
  return true;
}

}  // namespace detail

/// A mixed hierarchy without the sub-patches that face away from an eye, to be traced as any other.
///
/// Boxes of culled sub-patches are empty (lo > hi), and so are those of patches all of whose sub-patches are culled;
/// the boxes above them hold what is left. All else is the hierarchy's own, which must outlive this and stay as it is.
/// A patch of which something is left keeps its box in the top tree: rays enter it where they did, and its hits keep
/// their bits.
///
/// For rays that begin at the eye (t_min >= 0) and no others: what bounces, or looks for a light, meets backs.
///
/// With `accuracy::fast` and `refined` no hit on the front is removed, that is one with n . d < 0 for the ray's
/// direction d and n = S_u x S_v (S_v x S_u for `patch_front::against_normal`), wherever n is more than rounding, as
/// said below. Where the hierarchy's nearest hit is on the front it is found as it was. Where that is on a back it may
/// be found, or a hit beyond it, or none. `reference` starts in a sub-patch and takes whatever root of the patch it
/// ends in: there a root on the front may be lost with a culled start.
///
/// Proof. Let a cell be culled; A = +-axis / 127 and s = sine / 255 of its leaf. S over the cell is in the leaf's box,
/// widened by `search_margin` (in a tree of depth 0: in the patch's box in the top tree, which already is). For w = p -
/// eye, p any point of that box, w . A >= s |w| (`detail::faces_away`). S_u and S_v are positive combinations of the
/// control vectors x_a, y_b of the cell, and so is n of all x_a x y_b. Each of these, in double, is within the cone
/// about A whose half angle has the sine (s - 2^-8) / |A| (`detail::side_of_cone`). So the angles from A to n and from
/// A to w fall short of a right angle by more than 2^-9 together, and w . n > 2^-10 |w| |n|. The eye is farther than
/// half of `search_margin` from the cell, or it would be in the widened box, and w . A < 0 for one of the corners; so
/// the rounding of eye, ray and box in double turns w by 2^-30 at most. There remains the rounding of x_a and y_b: with
/// T the sum of the longest control vectors of S_u and S_v, n is off by 2^-35 `exact_patch::size` T at most. A normal
/// not 2^10 times as long may face either way; of all others it is known. What the cone has to spare also serves roots
/// on the front just beside the cell, which the search, knowing u and v in float, may ascribe to it.
/// \note Nigam & Narayanan 2012 cull a sub-patch by its normals at four corners; a curved one may show its front
///       between them.
class visible_hierarchy {
 public:
  /// All of `hierarchy`, nothing culled. What does not depend on the eye is done here, once a model.
  template <executor E>
  visible_hierarchy(mixed_hierarchy const& hierarchy, E const& exec)
      : hierarchy_(&hierarchy),
        top_(hierarchy.top.nodes),
        nodes_(hierarchy.nodes),
        node_of_patch_(hierarchy.patch_count()),
        boxes_(hierarchy.patch_count()),
        sides_(hierarchy.leaves.size()) {
    for (std::size_t i = 0; i < top_.size(); ++i)
      if (top_[i].primitive >= 0) node_of_patch_[std::size_t(top_[i].primitive)] = static_cast<std::uint32_t>(i);
    exec.for_each(hierarchy.patch_count(), [this](std::size_t i) {
      auto const& e = hierarchy_->exact[i];
      subpatch_tree const& tree = hierarchy_->search[i].tree;
      detail::find_sides(tree, hierarchy_->leaves.data() + tree.first_leaf, 1 / e.size, e.patch, 0, 1,
                         sides_.data() + tree.first_leaf);
    });
  }

  /// Culls for an eye, once a frame; what was culled before comes back. An eye that is not finite, or is 2^500 scenes
  /// away, culls nothing.
  template <executor E>
  void cull(vec3<double> const& eye, E const& exec, patch_front front = patch_front::along_normal) {
    vec3<double> const at = (eye - hierarchy_->centre) * hierarchy_->inverse_scale;
    double const farthest = std::fabs(at.x) + std::fabs(at.y) + std::fabs(at.z);
    int const sign = !(farthest < 0x1p500) ? 0 : front == patch_front::along_normal ? 1 : -1;
    culled_leaves_ = 0;
    exec.for_each_chunk(boxes_.size(), std::size_t(256), [&](std::size_t begin, std::size_t end) {
      std::size_t culled = 0;
      for (std::size_t i = begin; i < end; ++i) culled += cull_patch(i, at, sign);
      std::atomic_ref(culled_leaves_) += culled;
    });
    refit<float>(top_, boxes_);
  }

  mixed_hierarchy_view view() const {
    mixed_hierarchy_view v = hierarchy_->view();
    v.top.nodes = top_.data();
    v.nodes = nodes_.data();
    return v;
  }
  std::size_t leaf_count() const { return sides_.size(); }
  std::size_t culled_leaves() const { return culled_leaves_; }

 private:
  /// Gives the number of leaves culled. `eye` is in search space.
  std::size_t cull_patch(std::size_t i, vec3<double> const& eye, int sign) {
    subpatch_tree const& tree = hierarchy_->search[i].tree;
    std::uint32_t const leaves = 1u << tree.depth;
    subpatch_node const* const all = hierarchy_->nodes.data() + tree.first_node;
    subpatch_leaf const* const leaf = hierarchy_->leaves.data() + tree.first_leaf;
    std::int8_t const* const side = sides_.data() + tree.first_leaf;
    box<float> const& whole = hierarchy_->top.nodes[node_of_patch_[i]].bounds;
    vec3<double> const& base = hierarchy_->exact[i].search_base;
    vec3<double> const step(tree.grid_step), corner = vec3<double>(tree.grid_origin) + base;
    vec3<double> const margin{search_margin};
    std::array<bool, (1u << max_subpatch_depth)> culled;
    std::size_t count = 0;
    for (std::uint32_t k = 0; k < leaves; ++k) {
      subpatch_node const& n = all[leaves + k - 1];
      box<double> const b = tree.depth == 0
                                ? box<double>{vec3<double>(whole.lo), vec3<double>(whole.hi)}
                                : box<double>{corner + step * vec3<double>(n.lo[0], n.lo[1], n.lo[2]) - margin,
                                              corner + step * vec3<double>(n.hi[0], n.hi[1], n.hi[2]) + margin};
      culled[k] = sign * side[k] != 0 && detail::faces_away(leaf[k], sign * side[k], b, eye);
      count += culled[k];
    }
    // Patches' boxes are padded by a fixed margin: a ray enters a speck's so many grid steps away from it that to float
    // bytes 0 and 255 may be one.
    bool const divisible = std::min({step.x, step.y, step.z}) > 0x1p-36;
    if (count != leaves && !divisible) count = 0;
    boxes_[i] = count == leaves ? box<float>::empty() : whole;
    subpatch_node* const nodes = nodes_.data() + tree.first_node;
    std::copy_n(all, 2 * leaves - 1, nodes);
    if (count > 0) empty_leaves(nodes, leaves, culled.data());
    return count;
  }

  static void empty_leaves(subpatch_node* nodes, std::uint32_t leaves, bool const* culled) {
    for (std::uint32_t k = 0; k < leaves; ++k)
      if (culled[k])
        for (int c = 0; c < 3; ++c) nodes[leaves + k - 1].lo[c] = 255, nodes[leaves + k - 1].hi[c] = 0;
    for (std::uint32_t k = leaves - 1; k > 0; --k)
      for (int c = 0; c < 3; ++c) {
        nodes[k - 1].lo[c] = std::min(nodes[2 * k - 1].lo[c], nodes[2 * k].lo[c]);
        nodes[k - 1].hi[c] = std::max(nodes[2 * k - 1].hi[c], nodes[2 * k].hi[c]);
      }
  }

  mixed_hierarchy const* hierarchy_;
  std::vector<bvh_node<float>> top_;
  std::vector<subpatch_node> nodes_;
  std::vector<std::uint32_t> node_of_patch_;
  std::vector<box<float>> boxes_;
  std::vector<std::int8_t> sides_;
  std::size_t culled_leaves_ = 0;
};

/// What `eye` sees of `hierarchy`: a `visible_hierarchy` culled once. For more frames of a model keep it, call `cull`.
template <executor E>
visible_hierarchy cull_back_faces(mixed_hierarchy const& hierarchy, vec3<double> const& eye, E const& exec,
                                  patch_front front = patch_front::along_normal) {
  visible_hierarchy visible(hierarchy, exec);
  visible.cull(eye, exec, front);
  return visible;
}

}  // namespace patchrt
