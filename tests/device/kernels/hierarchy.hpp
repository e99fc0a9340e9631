// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/traverse.hpp>
#include <patchrt/core/ray.hpp>
#include <patchrt/intersect/ray_box.hpp>

namespace patchrt::test {

/// The nearest leaf box of each ray by the ordered walk, and how many boxes that took; the same by the walk in array
/// order.
template <class T> struct traverse_kernel {
  static constexpr int outputs = 8;
  bvh_view<T> tree;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    slab_ray<T> const s = make_slab_ray(r.origin, r.direction);
    search found{s, r.t_min, r.t_max};
    traverse(
        tree, direction_octant(r.direction), [&found](box<T> const& b) { return found.enter(b); },
        [&found](std::int32_t primitive) { return found.leaf(primitive); });
    found.store(out + outputs * i);
    search unordered{s, r.t_min, r.t_max};
    traverse_unordered(
        tree, [&unordered](box<T> const& b) { return unordered.enter(b); },
        [&unordered](std::int32_t primitive) { return unordered.leaf(primitive); });
    unordered.store(out + outputs * i + 4);
  }

 private:
  struct search {
    slab_ray<T> ray;
    T t_min, nearest;
    T entry = T(0);
    int primitive = -1, boxes = 0, leaves = 0;

    PATCHRT_HD bool enter(box<T> const& b) {
      ++boxes;
      slab_span<T> const span = intersect(ray, b, t_min, nearest);
      entry = span.entry;
      return span.entry <= span.exit;
    }
    PATCHRT_HD bool leaf(int p) {
      ++leaves;
      if (entry < nearest) {
        nearest = entry;
        primitive = p;
      }
      return false;
    }
    PATCHRT_HD void store(T* y) const {
      y[0] = nearest;
      y[1] = T(primitive);
      y[2] = T(boxes);
      y[3] = T(leaves);
    }
  };
};

}  // namespace patchrt::test
