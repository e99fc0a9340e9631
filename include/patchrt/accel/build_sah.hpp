// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Host only.

#include <patchrt/accel/bvh.hpp>
#include <patchrt/accel/sah_split.hpp>
#include <patchrt/exec/serial.hpp>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace patchrt {

/// How finely `build_sah` looks for splits.
struct sah_options {
  int bins = 16;      ///< cells on each axis, 2 to 32
  bool links = true;  ///< whether to make `bvh::links`
  int whole = 1;  ///< lists of no more boxes are cut one by one, at no cost, 1 to 8: for leaves that will hold several
  static constexpr int most_whole = 8;
};

namespace detail {

/// Builds one tree: see `build_sah`.
///
/// A subtree of m primitives has 2 m - 1 nodes, so that every node has its place before those above it are done. Long
/// lists are split level by level, all lists of a level at once in pieces, out of one array into another; short ones
/// each by one call, in place. What is done depends on lengths alone, never on how many threads there are.
template <class T, executor E> class sah_builder {
 public:
  sah_builder(std::span<box<T> const> boxes, sah_options const& options, E const& exec)
      : boxes_(boxes), bins_(options.bins), whole_(options.whole), links_(options.links), exec_(exec) {}

  bvh<T> build() {
    load();
    split_long_lists();
    exec_.for_each_chunk(short_.size(), 1, [this](std::size_t i, std::size_t) { build_short(short_[i]); });
    for (std::size_t i = top_.size(); i-- > 0;) fit_node(top_[i]);
    if (!links_) return std::move(tree_);
    for (auto& l : tree_.links[0].link) l = static_cast<std::uint32_t>(tree_.nodes.size()) << 1;
    for (std::size_t i : top_) link_children(tree_.nodes.data(), tree_.links.data(), i);
    exec_.for_each_chunk(short_.size(), 1, [this](std::size_t i, std::size_t) {
      for (std::size_t k = short_[i].node; k < end_node(short_[i]); ++k)
        link_children(tree_.nodes.data(), tree_.links.data(), k);
    });
    return std::move(tree_);
  }

 private:
  using primitive = sah_primitive<T>;
  static constexpr std::size_t longest_short = 2048;  // also the length of a piece
  static constexpr int deepest_sah = 64;              // below that lists are halved, so that no input makes a deep tree

  struct list {
    primitive* begin;
    std::size_t size;
    std::size_t node;
    int depth;
  };
  struct piece {
    std::size_t list, begin, end;
    std::size_t left_to, right_to;  // where its primitives go, if the split has an axis
    sah_bounds<T> centres;
    sah_bins<T> bins;
  };

  void load() {
    std::size_t const n = boxes_.size();
    tree_.nodes.resize(2 * n - 1);
    if (links_) tree_.links.resize(2 * n - 1);
    front_ = std::make_unique_for_overwrite<primitive[]>(n);
    exec_.for_each_chunk(n, longest_short, [this](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        box<T> const& b = boxes_[i];
        if (b.lo != b.lo || b.hi != b.hi)
          throw std::invalid_argument("build_sah: the box of primitive " + std::to_string(i) + " has a NaN coordinate");
        front_[i] = primitive(b, static_cast<std::uint32_t>(i));
      }
    });
  }

  static std::size_t end_node(list const& l) { return l.node + 2 * l.size - 1; }

  /// Writes the inner node of a list that is split, its left side now at `begin` and the right one behind.
  void split_node(list const& l, std::size_t left, primitive* begin, list& first, list& second) {
    tree_.nodes[l.node].primitive = -1;
    tree_.nodes[l.node].skip = static_cast<std::uint32_t>(end_node(l));
    first = {begin, left, l.node + 1, l.depth + 1};
    second = {begin + left, l.size - left, l.node + 2 * left, l.depth + 1};
  }

  void fit_node(std::size_t i) {
    bvh_node<T>& node = tree_.nodes[i];
    if (node.primitive < 0) node.bounds = merge(tree_.nodes[i + 1].bounds, tree_.nodes[tree_.nodes[i + 1].skip].bounds);
  }

  void build_short(list const& all) {
    list waiting[32];  // the longer side waits, so that half the primitives of one are in the next
    int count = 0;
    for (list l = all;;) {
      if (l.size == 1) {
        tree_.nodes[l.node] = {l.begin->bounds(), l.begin->index(), static_cast<std::uint32_t>(l.node + 1)};
        if (count == 0) break;
        l = waiting[--count];
      } else {
        list first, second;
        split_node(l, split_short(l), l.begin, first, second);
        if (first.size < second.size) std::swap(first, second);
        waiting[count++] = first;
        l = second;
      }
    }
    for (std::size_t i = end_node(all); i-- > all.node;) fit_node(i);
  }

  /// Puts the left side of a list first and returns its length.
  std::size_t split_short(list const& l) {
    if (l.size == 2 || l.size <= std::size_t(whole_)) return 1;
    if (l.size <= std::size_t(sah_sweep<T>::few) && l.depth < deepest_sah)
      return sah_sweep<T>::split(l.begin, int(l.size));
    sah_grid<T> const grid(centre_bounds<T>(l.begin, l.begin + l.size), bins_);
    if (grid.longest_axis() < 0) return l.size / 2;
    if (l.depth < deepest_sah) {
      sah_bins<T> bins;
      bins.clear(bins_);
      bins.add(grid, l.begin, l.begin + l.size);
      if (sah_split const s = bins.best(l.size, bins_); s.left > 0) {
        std::partition(l.begin, l.begin + l.size, [&](primitive const& p) { return grid.find(p, s.axis) < s.cell; });
        return s.left;
      }
    }
    return halve(grid, l.begin, l.size).left;
  }

  void split_long_lists() {
    std::size_t const n = boxes_.size();
    list const all{front_.get(), n, 0, 0};
    if (n <= longest_short) {
      short_.push_back(all);
      return;
    }
    back_ = std::make_unique_for_overwrite<primitive[]>(n);
    primitive *from = front_.get(), *to = back_.get();
    for (std::vector<list> level{all}, next; !level.empty(); next.clear()) {
      std::vector<piece> pieces = cut(level);
      std::vector<sah_grid<T>> const grids = find_grids(level, pieces);
      std::vector<sah_split> const splits = find_splits(level, pieces, grids);
      for_pieces(level, pieces, [&](piece const& p, primitive const* begin, primitive const* end) {
        scatter(begin, end, grids[p.list], splits[p.list], p, to + (level[p.list].begin - from));
      });
      for (std::size_t i = 0; i < level.size(); ++i) {
        list child[2];
        split_node(level[i], splits[i].left, to + (level[i].begin - from), child[0], child[1]);
        top_.push_back(level[i].node);
        for (list const& c : child) (c.size > longest_short ? next : short_).push_back(c);
      }
      std::swap(level, next);
      std::swap(from, to);
    }
  }

  static std::vector<piece> cut(std::vector<list> const& level) {
    std::vector<piece> pieces;
    for (std::size_t i = 0; i < level.size(); ++i)
      for (std::size_t b = 0; b < level[i].size; b += longest_short) {
        piece& p = pieces.emplace_back();
        p.list = i;
        p.begin = b;
        p.end = std::min(b + longest_short, level[i].size);
      }
    return pieces;
  }

  template <class Pieces, class F> void for_pieces(std::vector<list> const& level, Pieces& pieces, F&& f) {
    exec_.for_each_chunk(pieces.size(), 1, [&](std::size_t i, std::size_t) {
      list const& l = level[pieces[i].list];
      f(pieces[i], l.begin + pieces[i].begin, l.begin + pieces[i].end);
    });
  }

  std::vector<sah_grid<T>> find_grids(std::vector<list> const& level, std::vector<piece>& pieces) {
    for_pieces(level, pieces, [](piece& p, primitive const* begin, primitive const* end) {
      p.centres = centre_bounds<T>(begin, end);
    });
    std::vector<sah_bounds<T>> centres(level.size(), sah_bounds<T>::empty());
    for (piece const& p : pieces) centres[p.list].add(p.centres);
    std::vector<sah_grid<T>> grids;
    for (sah_bounds<T> const& c : centres) grids.emplace_back(c, bins_);
    return grids;
  }

  /// The split of each list and the places of each piece's two sides.
  std::vector<sah_split> find_splits(std::vector<list> const& level, std::vector<piece>& pieces,
                                     std::vector<sah_grid<T>> const& grids) {
    for_pieces(level, pieces, [&](piece& p, primitive const* begin, primitive const* end) {
      p.bins.clear(bins_);
      p.bins.add(grids[p.list], begin, end);
    });
    std::vector<sah_split> splits(level.size());
    for (auto first = pieces.begin(); first != pieces.end();) {
      list const& l = level[first->list];
      sah_split& split = splits[first->list];
      auto const last = std::find_if(first, pieces.end(), [&](piece const& p) { return p.list != first->list; });
      if (l.depth < deepest_sah) {
        sah_bins<T> sum = first->bins;
        for (auto p = first + 1; p != last; ++p) sum.add(p->bins, bins_);
        split = sum.best(l.size, bins_);
      }
      if (split.left == 0) split = halve(grids[first->list], l.begin, l.size);
      std::size_t left_to = 0, right_to = split.left;
      for (; first != last; ++first) {
        std::size_t const left = first->bins.left(split);
        first->left_to = left_to;
        first->right_to = right_to;
        left_to += left;
        right_to += first->end - first->begin - left;
      }
    }
    return splits;
  }

  static void scatter(primitive const* begin, primitive const* end, sah_grid<T> const& grid, sah_split const& split,
                      piece const& p, primitive* to) {
    if (split.axis < 0) {
      std::copy(begin, end, to + p.begin);
      return;
    }
    primitive* out[2] = {to + p.right_to, to + p.left_to};
    for (; begin != end; ++begin) *out[grid.find(*begin, split.axis) < split.cell]++ = *begin;
  }

  std::span<box<T> const> boxes_;
  int bins_, whole_;
  bool links_;
  E const& exec_;
  bvh<T> tree_;
  std::unique_ptr<primitive[]> front_, back_;
  std::vector<list> short_;
  std::vector<std::size_t> top_;  // nodes of long lists, parents first
};

}  // namespace detail

/// A tree over boxes by the surface area heuristic, centres binned on all three axes; exact sweeps for a few boxes.
///
/// Cost of a split = area(left) |left| + area(right) |right|. The same tree whatever the executor. Boxes of equal
/// centres are halved in order of index; an empty box becomes a leaf that no ray meets.
/// \param  boxes of primitives 0, 1, ...; at most 2^30.
/// \return 2 n - 1 nodes with a depth of at most 64 + log2 n + `whole`; no nodes for no boxes.
/// \throws std::invalid_argument naming the primitive whose box has a NaN coordinate.
/// \note   Wald, "On fast construction of SAH-based bounding volume hierarchies", IEEE RT 2007; Guenther, Popov, Seidel &
///         Slusallek, "Realtime ray tracing on GPU with BVH-based packet traversal", IEEE RT 2007.
template <class T, executor E = serial>
bvh<T> build_sah(std::span<box<T> const> boxes, sah_options const& options = {}, E const& exec = {}) {
  if (options.bins < 2 || options.bins > detail::sah_bins<T>::most)
    throw std::invalid_argument("build_sah: " + std::to_string(options.bins) + " bins, expected 2 to 32");
  if (options.whole < 1 || options.whole > sah_options::most_whole)
    throw std::invalid_argument("build_sah: lists of " + std::to_string(options.whole) +
                                " left whole, expected 1 to 8");
  if (boxes.size() > std::size_t(1) << 30)
    throw std::length_error("build_sah: " + std::to_string(boxes.size()) + " boxes, expected at most 2^30");
  if (boxes.empty()) return {};
  return detail::sah_builder<T, E>(boxes, options, exec).build();
}

/// The same with the default options.
template <class T, executor E> bvh<T> build_sah(std::span<box<T> const> boxes, E const& exec) {
  return build_sah(boxes, sah_options{}, exec);
}

}  // namespace patchrt
