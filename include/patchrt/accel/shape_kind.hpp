// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What a scene asks of a kind of shapes, and how the shapes of a leaf are kept.

#include <patchrt/core/box.hpp>
#include <patchrt/core/ray.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace patchrt {

/// What most kinds are like.
struct single_shapes {
  static constexpr bool shares_lanes = false;
  static constexpr int capacity = 1;  ///< shapes in a leaf at the most
  /// Whether single rays cost so much more than packs that rays should stay together however far they part.
  static constexpr bool wants_packs = false;
};

/// How a scene keeps and meets shapes of one kind. As it is here it serves every shape for which there are, in its own
/// namespace,
///
///     box<N> bounds(Shape const&)               N is float or double: the number that rays come in
///     intersect(ray<T> const&, Shape const&)    a struct with `t` and `valid` and, if it likes, `u`, `v` and `part`
///
/// for T = N, or for packs of N as well, then by a template over `scalar T`. `t` is the nearest in (t_min, t_max). Where there
/// is an `intersect_any` too, rays that ask for any hit use that.
///
/// Kinds whose shapes are rows of numbers specialise this, so that the shapes of a leaf share the lanes of a pack. What their
/// `meet` gives has `valid`; `complete` makes a hit of it, with `t`, and is asked only where some lane is valid. A
/// `meet_block`, if there is one, meets a block with one ray where `meet` and the block's rows as they are would not do as
/// well.
template <class Shape> struct shape_kind : single_shapes {
  struct block {
    Shape shape;
    std::int32_t number;
  };
};

/// The number in which a kind's kernel computes: that of its bounds.
template <class Shape> using shape_number_t = std::remove_cvref_t<decltype(bounds(std::declval<Shape const&>()).lo.x)>;

/// Up to `width` shapes, a lane each. `Record<S>` is a struct of nothing but numbers S.
template <template <class> class Record, class number> struct lane_block {
  static constexpr int width = 8;
  static constexpr std::size_t fields = sizeof(Record<number>) / sizeof(number);

  /// Of the shapes; -1 in the lanes behind them. First, so that they come with what kernels load anyhow.
  alignas(fields % 2 == 1 ? 64 : 32) std::int32_t numbers[width];
  number lanes[fields][width];

  /// Shape i.
  PATCHRT_INLINE Record<number> get(int i) const {
    struct row {
      number field[fields];
    } r;
    PATCHRT_UNROLL
    for (std::size_t k = 0; k < fields; ++k) r.field[k] = lanes[k][i];
    return std::bit_cast<Record<number>>(r);
  }
  /// All shapes.
  template <scalar P> PATCHRT_INLINE Record<P> get() const {
    return load<P>([](std::size_t k) PATCHRT_INLINE_LAMBDA { return k; });
  }
  /// All shapes, of vectors alone, whose coordinates come in another order of axes.
  template <scalar P> PATCHRT_INLINE Record<P> get(std::size_t x, std::size_t y, std::size_t z) const {
    return load<P>([=](std::size_t k) PATCHRT_INLINE_LAMBDA {
      return k - k % 3 + (k % 3 == 0 ? x : k % 3 == 1 ? y : z);
    });
  }
  void set(int i, Record<number> const& shape, std::int32_t number_of) {
    struct row {
      number field[fields];
    };
    row const r = std::bit_cast<row>(shape);
    for (std::size_t k = 0; k < fields; ++k) lanes[k][i] = r.field[k];
    numbers[i] = number_of;
  }

 private:
  /// Field k from the row that `row(k)` names.
  template <scalar P, class Row> PATCHRT_INLINE Record<P> load(Row const& row) const {
    struct fields_of {
      P field[fields];
    } r;
    PATCHRT_UNROLL
    for (std::size_t k = 0; k < fields; ++k) load_lanes(lanes[row(k)], r.field[k]);
    return std::bit_cast<Record<P>>(r);
  }
};

}  // namespace patchrt
