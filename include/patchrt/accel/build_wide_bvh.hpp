// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/bvh.hpp>
#include <patchrt/accel/wide_bvh.hpp>

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace patchrt {

namespace detail {

/// Chooses which nodes of a binary tree become wide ones, at the least expected cost: the sum of the areas of all boxes
/// that stay nodes.
class wide_builder {
 public:
  explicit wide_builder(bvh<float> const& tree) : nodes_(tree.nodes), plans_(tree.nodes.size()) {}

  wide_bvh build() {
    make_plans();
    wide_bvh wide;
    wide.nodes.reserve(nodes_.size() / 8 + 1);
    wide.nodes.emplace_back();
    std::vector<std::pair<std::size_t, std::uint32_t>> waiting{{0, 0}};
    while (!waiting.empty()) {
      auto const [binary, number] = waiting.back();
      waiting.pop_back();
      std::size_t child[width];
      int count = 0;
      if (is_leaf(binary)) {
        child[count++] = binary;  // a tree of one leaf
      } else {
        int const left = plans_[binary].left_of_node, right = width - left;
        add_children(binary + 1, left, child, count);
        add_children(nodes_[binary + 1].skip, right, child, count);
      }
      int slot[width];
      place(binary, child, count, slot);
      wide_node node = empty_node();
      for (int i = 0; i < count; ++i) {
        bvh_node<float> const& c = nodes_[child[i]];
        float const planes[6] = {c.bounds.lo.x, c.bounds.hi.x, c.bounds.lo.y,
                                 c.bounds.hi.y, c.bounds.lo.z, c.bounds.hi.z};
        for (int p = 0; p < 6; ++p) node.bounds[p][slot[i]] = planes[p];
        if (c.primitive >= 0) {
          node.child[slot[i]] = wide_node::leaf | static_cast<std::uint32_t>(c.primitive);
        } else {
          node.child[slot[i]] = static_cast<std::uint32_t>(wide.nodes.size());
          waiting.emplace_back(child[i], node.child[slot[i]]);
          wide.nodes.emplace_back();
        }
      }
      wide.nodes[number] = node;
    }
    return wide;
  }

 private:
  static constexpr int width = wide_node::width;

  /// Of making what is below a node up to k + 1 children of some wide node.
  struct costs {
    float least[width];
  };
  struct plan {
    // Of k children, how many go to the first child; 0: all are one, this node.
    unsigned char left[width + 1];
    unsigned char left_of_node;  // the same for the eight children that it has where it becomes a node
  };

  bool is_leaf(std::size_t i) const { return nodes_[i].primitive >= 0; }

  void make_plans() {
    std::vector<costs> waiting;  // of nodes whose parents come later, the next one's first child last
    for (std::size_t i = nodes_.size(); i-- > 0;) {
      float const area = max(half_area(nodes_[i].bounds), 0.0f);
      if (is_leaf(i)) {
        std::fill_n(waiting.emplace_back().least, width, area);
      } else {
        costs const first = waiting.back();
        waiting.pop_back();
        waiting.back() = plan_node(plans_[i], area, first, waiting.back());
      }
    }
  }

  static costs plan_node(plan& p, float area, costs const& first, costs const& second) {
    // least of a child falls with k, so that all k are given away.
    float of_second[2 * width];
    std::fill_n(of_second, width, std::numeric_limits<float>::infinity());
    std::copy_n(second.least, width, of_second + width);
    costs c;
    int left[width];
    std::fill_n(c.least, width, std::numeric_limits<float>::infinity());
    std::fill_n(left, width, 1);
    for (int l = 1; l < width; ++l) {
      PATCHRT_VECTORISE
      for (int k = 0; k < width; ++k) {
        float const cost = first.least[l - 1] + of_second[width + k - l];
        left[k] = cost < c.least[k] ? l : left[k];
        c.least[k] = cost < c.least[k] ? cost : c.least[k];
      }
    }
    p.left_of_node = static_cast<unsigned char>(left[width - 1]);
    float const as_node = area + c.least[width - 1];
    for (int k = 0; k < width; ++k) {
      bool const is_node = k == 0 || as_node <= c.least[k];
      p.left[k + 1] = is_node ? 0 : static_cast<unsigned char>(left[k]);
      c.least[k] = is_node ? as_node : c.least[k];
    }
    return c;
  }

  void add_children(std::size_t i, int most, std::size_t (&child)[width], int& count) const {
    std::pair<std::size_t, int> waiting[width];
    int n = 0;
    waiting[n++] = {i, most};
    while (n > 0) {
      auto const [node, k] = waiting[--n];
      int const left = plans_[node].left[k];
      if (left == 0) {
        child[count++] = node;
      } else {
        waiting[n++] = {nodes_[node + 1].skip, k - left};
        waiting[n++] = {node + 1, left};
      }
    }
  }

  /// A slot for each child, greedily: the child and the free corner that it is farthest out in.
  void place(std::size_t parent, std::size_t const (&child)[width], int count, int (&slot)[width]) const {
    vec3<float> const middle = sum(nodes_[parent].bounds.lo, nodes_[parent].bounds.hi);
    vec3<float> from_middle[width];
    for (int i = 0; i < count; ++i)
      from_middle[i] = difference(sum(nodes_[child[i]].bounds.lo, nodes_[child[i]].bounds.hi), middle);
    unsigned left = (1u << count) - 1u, free = (1u << width) - 1u;
    while (left != 0) {
      int best = std::countr_zero(left), corner = std::countr_zero(free);
      float farthest = -std::numeric_limits<float>::infinity();
      for (unsigned l = left; l != 0; l &= l - 1)
        for (unsigned f = free; f != 0; f &= f - 1) {
          int const i = std::countr_zero(l), s = std::countr_zero(f);
          vec3<float> const& c = from_middle[i];
          float const out = (s & 1 ? c.x : -c.x) + (s & 2 ? c.y : -c.y) + (s & 4 ? c.z : -c.z);
          if (farthest < out) farthest = out, best = i, corner = s;
        }
      slot[best] = corner;
      left &= ~(1u << best);
      free &= ~(1u << corner);
    }
  }

  static wide_node empty_node() {
    constexpr float inf = std::numeric_limits<float>::infinity();
    wide_node n;
    for (int p = 0; p < 6; ++p)
      for (int k = 0; k < width; ++k) n.bounds[p][k] = p % 2 == 0 ? inf : -inf;
    for (std::uint32_t& c : n.child) c = wide_node::leaf;
    return n;
  }

  std::vector<bvh_node<float>> const& nodes_;
  std::vector<plan> plans_;
};

}  // namespace detail

/// A wide tree over the leaves of `tree`, its leaves' numbers their primitives': of all that the binary tree's nodes
/// allow, one that a random ray is expected to visit the fewest nodes of.
/// \note Ylitie, Karras & Laine, HPG 2017, section 3.1, with leaves as they are.
inline wide_bvh build_wide_bvh(bvh<float> const& tree) {
  if (tree.nodes.empty()) return {};
  return detail::wide_builder(tree).build();
}

}  // namespace patchrt
