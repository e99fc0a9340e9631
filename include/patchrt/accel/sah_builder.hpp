// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/bvh.hpp>
#include <patchrt/accel/sah_split.hpp>
#include <patchrt/exec/executor.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace patchrt::detail {

/// Some primitives and the nodes over them.
struct sah_part {
  std::size_t begin, size;      // of the primitives
  std::size_t node, nodes = 0;  // where the nodes begin, and how many there are
};

/// A tree in parts. `top` are the places of the nodes above these, parents first, which `fit_node` has yet to finish.
struct sah_parts {
  std::vector<std::size_t> top;
  std::vector<sah_part> parts;
};

/// An inner node's bounds and skip from its children's.
template <class T> void fit_node(bvh_node<T>* nodes, std::size_t i) {
  if (nodes[i].primitive >= 0) return;
  bvh_node<T> const &first = nodes[i + 1], &second = nodes[first.skip];
  nodes[i].bounds = merge(first.bounds, second.bounds);
  nodes[i].skip = second.skip;
}

/// Splits lists of primitives until they become leaves.
///
/// A list of up to `Leaves::most` primitives, at most 2048, becomes leaf number leaves(begin, end, place), `place` where
/// it is among all primitives, or is split where that is negative; for one primitive it never is.
///
/// A list of m primitives has room for 2 m - 1 nodes, so that every node has its place before those above it are done.
/// Long lists are split in pieces, as many lists at once as keep all threads busy, out of one array into another; short
/// ones each by one call, in place, while they are still in cache. How a list is split depends on it alone, never on how
/// many threads there are.
template <class T, executor E, class Leaves> class sah_builder {
 public:
  /// \param nodes room for 2 n - 1 of them, n > 0 the number of primitives.
  sah_builder(std::vector<sah_primitive<T>> primitives, int bins, Leaves const& leaves, bvh_node<T>* nodes,
              E const& exec)
      : bins_(bins), leaves_(leaves), nodes_(nodes), exec_(exec) {
    sides_[0] = std::move(primitives);
  }

  sah_parts build() {
    std::size_t const n = sides_[0].size(), at_once = 8 * longest_short * static_cast<std::size_t>(exec_.concurrency());
    if (n > longest_short) sides_[1].resize(n);
    std::vector<list> waiting, level;
    add({{0, n, 0}, 0, 0}, waiting);
    for (build_short_lists(); !waiting.empty(); build_short_lists()) {
      level.clear();
      for (std::size_t size = 0; size < at_once && !waiting.empty(); waiting.pop_back()) {
        level.push_back(waiting.back());
        size += level.back().size;
      }
      split_long_lists(level, waiting);
    }
    return std::move(made_);
  }

 private:
  using primitive = sah_primitive<T>;
  static constexpr std::size_t longest_short = 2048;  // also the length of a piece
  static_assert(Leaves::most <= longest_short);
  static constexpr int deepest_sah = 64;  // below that lists are halved, so that no input makes a deep tree

  struct list : sah_part {
    int depth;
    int side;
  };
  struct short_list {
    primitive *begin, *end;
    int depth;
    std::size_t size() const { return static_cast<std::size_t>(end - begin); }
  };
  struct piece {
    std::size_t list, begin, end;
    std::size_t left_to, right_to;  // where its primitives go, if the split has an axis
    sah_bounds<T> centres;
    sah_bins<T> bins;
  };

  primitive* begin(list const& l) { return sides_[l.side].data() + l.begin; }

  void add(list const& l, std::vector<list>& long_lists) {
    (l.size > longest_short ? long_lists : short_).push_back(l);
  }

  void build_short_lists() {
    exec_.for_each_chunk(short_.size(), 1, [this](std::size_t i, std::size_t) { build_short(short_[i]); });
    made_.parts.insert(made_.parts.end(), short_.begin(), short_.end());
    short_.clear();
  }

  void build_short(list& all) {
    short_list waiting[deepest_sah + 12];  // second children; once lists are halved, one of 2048 ends in 11 levels
    int count = 0;
    std::size_t end = all.node;
    for (short_list l{begin(all), begin(all) + all.size, all.depth};;) {
      bvh_node<T>& node = nodes_[end++];
      node.primitive = -1;
      if (l.size() <= Leaves::most)
        node.primitive = leaves_(l.begin, l.end, static_cast<std::size_t>(l.begin - sides_[all.side].data()));
      if (node.primitive < 0) {
        primitive* const second = l.begin + split_short(l);
        waiting[count++] = {second, l.end, l.depth + 1};
        l = {l.begin, second, l.depth + 1};
      } else {
        sah_bounds<T> bounds = *l.begin;
        for (primitive const* p = l.begin + 1; p != l.end; ++p) bounds.add(*p);
        node.bounds = bounds.bounds();
        node.skip = static_cast<std::uint32_t>(end);
        if (count == 0) break;
        l = waiting[--count];
      }
    }
    all.nodes = end - all.node;
    for (std::size_t i = end; i-- > all.node;) fit_node(nodes_, i);
  }

  /// Puts primitives for which `is_left` holds, as many as have room there, before `middle`: no branch on each.
  template <class F> static void exchange(primitive* begin, primitive* end, primitive* middle, F const& is_left) {
    std::uint16_t right[longest_short], left[longest_short];
    int n = 0, m = 0;
    for (primitive const* p = begin; p != middle; ++p) {
      right[n] = static_cast<std::uint16_t>(p - begin);
      n += !is_left(*p);
    }
    for (primitive const* p = end; p-- != middle;) {
      left[m] = static_cast<std::uint16_t>(p - begin);
      m += is_left(*p);
    }
    while (n-- > 0) std::swap(begin[right[n]], begin[left[n]]);
  }

  /// Puts the left side of a list first and returns its length.
  std::size_t split_short(short_list const& l) {
    std::size_t const n = l.size();
    if (n == 2) return 1;
    if (n <= std::size_t(sah_sweep<T>::few) && l.depth < deepest_sah) return sah_sweep<T>::split(l.begin, int(n));
    sah_grid<T> const grid(centre_bounds<T>(l.begin, l.end), bins_);
    if (grid.longest_axis() < 0) return n / 2;
    if (l.depth < deepest_sah) {
      sah_bins<T> bins;
      bins.clear(bins_);
      bins.add(grid, l.begin, l.end);
      if (sah_split const s = bins.best(n, bins_); s.left > 0) {
        exchange(l.begin, l.end, l.begin + s.left, [&](primitive const& p) { return grid.find(p, s.axis) < s.cell; });
        return s.left;
      }
    }
    return halve(grid, l.begin, n).left;
  }

  void split_long_lists(std::vector<list> const& level, std::vector<list>& long_lists) {
    std::vector<piece> pieces = cut(level);
    std::vector<sah_grid<T>> const grids = find_grids(level, pieces);
    std::vector<sah_split> const splits = find_splits(level, pieces, grids);
    for_pieces(level, pieces, [&](piece const& p, primitive const* begin, primitive const* end) {
      list const& l = level[p.list];
      scatter(begin, end, grids[p.list], splits[p.list], p, sides_[1 - l.side].data() + l.begin);
    });
    for (std::size_t i = 0; i < level.size(); ++i) {
      list const& l = level[i];
      std::size_t const left = splits[i].left;
      nodes_[l.node].primitive = -1;
      made_.top.push_back(l.node);
      add({{l.begin + left, l.size - left, l.node + 2 * left}, l.depth + 1, 1 - l.side}, long_lists);
      add({{l.begin, left, l.node + 1}, l.depth + 1, 1 - l.side}, long_lists);
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
      f(pieces[i], begin(l) + pieces[i].begin, begin(l) + pieces[i].end);
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
      if (split.left == 0) split = halve(grids[first->list], begin(l), l.size);
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

  int bins_;
  Leaves leaves_;
  bvh_node<T>* nodes_;
  E const& exec_;
  std::vector<primitive> sides_[2];
  std::vector<list> short_;
  sah_parts made_;
};

/// Boxes as the builder wants them.
/// \throws std::invalid_argument naming the primitive whose box has a NaN coordinate.
template <class T, executor E>
std::vector<sah_primitive<T>> sah_primitives(std::span<box<T> const> boxes, E const& exec) {
  std::vector<sah_primitive<T>> primitives(boxes.size());
  exec.for_each_chunk(boxes.size(), 2048, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      box<T> const& b = boxes[i];
      if (b.lo != b.lo || b.hi != b.hi)
        throw std::invalid_argument("build_sah: the box of primitive " + std::to_string(i) + " has a NaN coordinate");
      primitives[i] = {b, static_cast<std::uint32_t>(i)};
    }
  });
  return primitives;
}

}  // namespace patchrt::detail
