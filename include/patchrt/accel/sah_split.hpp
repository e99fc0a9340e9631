// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// One step of `build_sah`: where to split a list of primitives. Host only.

#include <patchrt/core/box.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace patchrt::detail {

/// A box as -lo and hi, so that a union is one maximum of eight lanes; lanes 3 and 7 are free.
template <class T> struct alignas(16) sah_bounds {
  T lane[8];

  static sah_bounds empty() {
    sah_bounds b;
    for (T& x : b.lane) x = -std::numeric_limits<T>::infinity();
    return b;
  }
  /// Makes this hold b too.
  void add(sah_bounds const& b) {
    PATCHRT_VECTORISE
    for (int k = 0; k < 8; ++k) lane[k] = lane[k] < b.lane[k] ? b.lane[k] : lane[k];
  }
  T half_area() const {
    T const x = lane[4] + lane[0], y = lane[5] + lane[1], z = lane[6] + lane[2];
    return x * y + y * z + z * x;
  }
  box<T> bounds() const { return {{-lane[0], -lane[1], -lane[2]}, {lane[4], lane[5], lane[6]}}; }
};

/// A primitive's box and, as bits in the free lanes, its index.
template <class T> struct sah_primitive : sah_bounds<T> {
  using bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;
  using sah_bounds<T>::lane;

  sah_primitive() {}  // so that vectors leave it as it is
  sah_primitive(box<T> const& b, std::uint32_t index)
      : sah_bounds<T>{{-b.lo.x, -b.lo.y, -b.lo.z, std::bit_cast<T>(bits(index)),  //
                       b.hi.x, b.hi.y, b.hi.z, std::bit_cast<T>(bits(index))}} {}

  std::int32_t index() const { return static_cast<std::int32_t>(std::bit_cast<bits>(lane[3])); }
  void widen(T margin) {
    for (int k = 0; k < 3; ++k) {
      lane[k] += margin;
      lane[4 + k] += margin;
    }
  }
  /// Twice the box's centre, and 0 where k is 3; NaN for an empty box.
  T centre(int k) const { return lane[4 + k] - lane[k]; }
};

/// The bounds of the centres of some primitives.
template <class T> sah_bounds<T> centre_bounds(sah_primitive<T> const* begin, sah_primitive<T> const* end) {
  auto const add = [](sah_bounds<T>& b, sah_primitive<T> const& p) {
    PATCHRT_VECTORISE
    for (int k = 0; k < 4; ++k) {
      T const x = p.centre(k);
      b.lane[k] = b.lane[k] < -x ? -x : b.lane[k];
      b.lane[4 + k] = b.lane[4 + k] < x ? x : b.lane[4 + k];
    }
  };
  sah_bounds<T> b = sah_bounds<T>::empty(), of_end = b;  // two, neither of which waits for the other
  for (; end - begin > 1; ++begin) {
    add(b, *begin);
    add(of_end, *--end);
  }
  if (begin != end) add(b, *begin);
  b.add(of_end);
  return b;
}

/// The cells, equally wide, that centres are counted in, on each axis.
template <class T> struct sah_grid {
  T origin[4];
  T scale[4];  // cells per length; 0 where the centres have no extent, or one that is not finite
  T last;

  sah_grid(sah_bounds<T> const& centres, int bins) : last(T(bins - 1)) {
    for (int k = 0; k < 4; ++k) {
      T const length = centres.lane[4 + k] + centres.lane[k];
      bool const some = T(0) < length && length <= std::numeric_limits<T>::max();
      origin[k] = some ? -centres.lane[k] : T(0);
      scale[k] = some ? T(bins) / length : T(0);
    }
  }
  /// The cell of p on the axes x, y, z; 0 for a centre that is NaN.
  void find(sah_primitive<T> const& p, int (&cell)[4]) const {
    PATCHRT_VECTORISE
    for (int k = 0; k < 4; ++k) {
      T const x = (p.centre(k) - origin[k]) * scale[k];
      T const y = x < last ? x : last;
      cell[k] = static_cast<int>(T(0) < x ? y : T(0));
    }
  }
  int find(sah_primitive<T> const& p, int axis) const {
    T const x = (p.centre(axis) - origin[axis]) * scale[axis];
    return static_cast<int>(T(0) < x ? (x < last ? x : last) : T(0));
  }
  /// The axis on which the centres reach farthest, -1 where they are all equal.
  int longest_axis() const {
    int axis = -1;
    for (int k = 0; k < 3; ++k)
      if (scale[k] > T(0) && (axis < 0 || scale[k] < scale[axis])) axis = k;
    return axis;
  }
};

/// Primitives in cells below `cell` go left, or, where axis is -1, the first `left` of them.
struct sah_split {
  int axis = -1;
  int cell = 0;
  std::size_t left = 0;  // 0: no split
};

/// The lowest of the costs seen, ties to the most even split.
template <class T> struct sah_cost {
  T cost = std::numeric_limits<T>::infinity();
  std::size_t uneven = 0;

  bool improve(T area_left, std::size_t left, T area_right, std::size_t right) {
    T const c = area_left * T(left) + area_right * T(right);
    std::size_t const u = left < right ? right - left : left - right;
    if (!(c < cost || (c == cost && u < uneven && c < std::numeric_limits<T>::infinity()))) return false;
    cost = c;
    uneven = u;
    return true;
  }
};

/// The primitives in each cell: how many, and their bounds.
template <class T> struct sah_bins {
  static constexpr int most = 32;
  sah_bounds<T> bounds[3][most];
  std::uint32_t count[3][most];

  void clear(int bins) {
    for (int k = 0; k < 3; ++k) {
      std::fill_n(bounds[k], bins, sah_bounds<T>::empty());
      std::fill_n(count[k], bins, 0u);
    }
  }
  void add(sah_grid<T> const& grid, sah_primitive<T> const& p) {
    int cell[4];
    grid.find(p, cell);
    for (int k = 0; k < 3; ++k) {
      bounds[k][cell[k]].add(p);
      ++count[k][cell[k]];
    }
  }
  /// From both ends in turn: neighbours are often in one cell, and would wait for each other.
  void add(sah_grid<T> const& grid, sah_primitive<T> const* begin, sah_primitive<T> const* end) {
    for (; end - begin > 1; ++begin) {
      add(grid, *begin);
      add(grid, *--end);
    }
    if (begin != end) add(grid, *begin);
  }
  void add(sah_bins const& b, int bins) {
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < bins; ++i) {
        bounds[k][i].add(b.bounds[k][i]);
        count[k][i] += b.count[k][i];
      }
  }
  /// The split of least expected cost, sum over both sides of area times primitives.
  sah_split best(std::size_t n, int bins) const {
    sah_split split;
    sah_cost<T> lowest;
    for (int k = 0; k < 3; ++k) {
      int cell[most + 1], cells = 0;  // those that are not empty
      for (int i = 0; i < bins; ++i) {
        cell[cells] = i;
        cells += count[k][i] != 0;
      }
      T area_right[most];
      sah_bounds<T> b = sah_bounds<T>::empty();
      for (int i = cells - 1; i > 0; --i) {
        b.add(bounds[k][cell[i]]);
        area_right[i] = b.half_area();
      }
      b = sah_bounds<T>::empty();
      std::size_t left = 0;
      for (int i = 1; i < cells; ++i) {
        b.add(bounds[k][cell[i - 1]]);
        left += count[k][cell[i - 1]];
        if (lowest.improve(b.half_area(), left, area_right[i], n - left)) split = {k, cell[i - 1] + 1, left};
      }
    }
    return split;
  }
  /// How many of these go left; 0 where the axis is -1.
  std::size_t left(sah_split const& s) const {
    std::size_t n = 0;
    for (int i = 0; i < s.cell; ++i) n += count[s.axis][i];
    return n;
  }
};

/// Two halves by the order of the centres on the longest axis.
template <class T> sah_split halve(sah_grid<T> const& grid, sah_primitive<T>* begin, std::size_t n) {
  int const axis = grid.longest_axis();
  auto const key = [axis](sah_primitive<T> const& p) {
    return p.centre(axis) == p.centre(axis) ? p.centre(axis) : T(0);
  };
  if (axis >= 0) {
    std::nth_element(begin, begin + n / 2, begin + n, [key](auto const& a, auto const& b) { return key(a) < key(b); });
  }
  return {-1, 0, n / 2};
}

/// The best of all splits of up to `few` primitives in order along an axis; puts those of the left side first.
template <class T> struct sah_sweep {
  static constexpr int few = 8;

  static std::size_t split(sah_primitive<T>* begin, int n) {
    sah_primitive<T> sorted[few], best[few];
    sah_cost<T> lowest;
    std::size_t left = 0;
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < n; ++i) {
        int j = i;
        for (; j > 0 && begin[i].centre(k) < sorted[j - 1].centre(k); --j) sorted[j] = sorted[j - 1];
        sorted[j] = begin[i];
      }
      T area_right[few];
      sah_bounds<T> b = sah_bounds<T>::empty();
      for (int i = n - 1; i > 0; --i) {
        b.add(sorted[i]);
        area_right[i] = b.half_area();
      }
      b = sah_bounds<T>::empty();
      bool improved = false;
      for (int i = 1; i < n; ++i) {
        b.add(sorted[i - 1]);
        if (lowest.improve(b.half_area(), std::size_t(i), area_right[i], std::size_t(n - i))) {
          left = std::size_t(i);
          improved = true;
        }
      }
      if (improved) std::copy_n(sorted, n, best);
    }
    if (left == 0) return std::size_t(n / 2);
    std::copy_n(best, n, begin);
    return left;
  }
};

}  // namespace patchrt::detail
