// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// A scene of shapes of any kinds: one hierarchy over all of them, and for each kind a list of its own, whose kernel runs
/// alone over what it is asked about.

#include <patchrt/accel/bvh.hpp>
#include <patchrt/accel/shape_kind.hpp>
#include <patchrt/accel/wide_bvh.hpp>

#include <cstdint>
#include <limits>

namespace patchrt {

/// The shapes of one kind, in the order of the leaves, which are numbered kind by kind.
template <class Shape> struct shape_list {
  typename shape_kind<Shape>::block const* blocks;
  std::uint32_t first_leaf;
  std::uint32_t end_leaf;
};

/// A scene as kernels see it, on host or device; `build_scene` makes one.
///
/// A leaf holds shapes of one kind. `top` has links, for walks without a stack; `wide` is over the same leaves. Boxes are
/// padded by what covers the rounding to float of rays that start within `reach` of `centre`; those from beyond are
/// first moved there.
template <class... Shapes> struct scene_view : shape_list<Shapes>... {
  bvh_view<float> top;
  wide_bvh_view wide;
  box<float> bounds;
  vec3<double> centre;
  double reach;

  template <class Shape> PATCHRT_INLINE shape_list<Shape> const& list() const { return *this; }
};

/// A ray's hit in a scene: t in units of |direction|; u and v as the kind of the shape has them; `shape` counts through all
/// lists of the scene, `part` is what an instance's object calls what was hit, -1 elsewhere. `shape` is -1 and t infinite
/// for a miss.
template <class R> struct scene_hit {
  R t = std::numeric_limits<R>::infinity();
  R u = 0, v = 0;
  std::int32_t shape = -1;
  std::int32_t part = -1;

  bool valid() const { return shape >= 0; }
};

}  // namespace patchrt
