// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/scalar.hpp>

#include <bit>
#include <cstdint>
#include <type_traits>

namespace patchrt::detail {

/// A rectangle of the parameter square, another for each lane.
template <scalar T> struct patch_part {
  T x, y, half_x, half_y;
  mask_t<T> lanes;
};

/// The place of the lowest bit that is set.
PATCHRT_INLINE int lowest_bit(unsigned bits) { return std::popcount((bits & (0u - bits)) - 1u); }

/// Parts of cells, all of one size, of N lanes' rays.
template <int N> struct part_list {
  static constexpr int most_parts = 16;  // that a lane may have and still get quarters of them
  static constexpr int capacity = 4 * most_parts * N + N;
  static constexpr float unit = 0x1p-6f;
  using coordinate = std::conditional_t<N == 1, std::int8_t, float>;  // a lone ray is frugal, a pack loads vectors
  using lane_number = std::conditional_t<N == 1, std::int8_t, std::int32_t>;

  int size;
  int of_lane[N];  // how many
  lane_number lane[capacity];
  coordinate x[capacity], y[capacity];  // the middles: units of the cell's half widths about its own middle

  PATCHRT_INLINE void clear() {
    size = 0;
    for (int l = 0; l < N; ++l) of_lane[l] = 0;
  }
  /// The quarters, `half` units in half width, of the part in the middle of which they meet.
  PATCHRT_INLINE void add_quarters(int l, coordinate middle_x, coordinate middle_y, int half) {
    for (int k = 0; k < 4; ++k) {
      lane[size + k] = static_cast<lane_number>(l);
      x[size + k] = static_cast<coordinate>(middle_x + static_cast<coordinate>(k & 1 ? half : -half));
      y[size + k] = static_cast<coordinate>(middle_y + static_cast<coordinate>(k & 2 ? half : -half));
    }
    size += 4;
    of_lane[l] += 4;
  }
  /// Makes what is behind the last part harmless to load.
  PATCHRT_INLINE void pad() {
    for (int i = 0; i < N; ++i) {
      lane[size + i] = 0;
      x[size + i] = y[size + i] = 0;
    }
  }
  /// N numbers at `from` as a T, in units of 1.
  template <scalar T> PATCHRT_INLINE static T load(coordinate const* from) {
    if constexpr (N == 1) {
      return T(float(*from) * unit);
    } else {
      T at;
      load_lanes(from, at);
      return at * T(unit);
    }
  }
};

}  // namespace patchrt::detail
