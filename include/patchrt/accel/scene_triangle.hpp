// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/shape_kind.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>

namespace patchrt {

/// A triangle in a scene, met by `Form` on the sides `F`. The watertight form lets no ray through between neighbours; the others
/// are faster, and do.
template <class T, class Form = watertight_form, faces F = faces::both> struct scene_triangle : triangle<T> {};

template <class T, class Form, faces F> struct shape_kind<scene_triangle<T, Form, F>> {
  static constexpr bool shares_lanes = true;
  static constexpr int capacity = 8;
  static constexpr bool wants_packs = false;

  template <class S> using record = typename Form::template prepared<S>;
  using block = lane_block<record, T>;

  static record<T> prepare(scene_triangle<T, Form, F> const& t) { return Form::prepare(t); }
  template <scalar R> PATCHRT_INLINE static auto make_ray(ray<R> const& r) {
    return Form::make_ray(r.origin, r.direction);
  }
  template <scalar K, class Ray, class Record>
  PATCHRT_INLINE static triangle_crossing<K> meet(Ray const& r, Record const& t, K t_min, K t_max) {
    return Form::template meet<F>(r, t, t_min, t_max);
  }
  template <class Ray, class Record, scalar K>
  PATCHRT_INLINE static triangle_hit<K> complete(Ray const&, Record const&, triangle_crossing<K> const& met) {
    return normalised(met);
  }
  /// All triangles of a block with one ray, whose axes the vertices are loaded in.
  template <scalar P, class Ray>
  requires(requires(Ray const& r) { r.order; }) PATCHRT_INLINE
      static triangle_crossing<P> meet_block(Ray const& r, block const& b, P t_min, P t_max) {
    return Form::template meet_in_own_axes<F>(r, b.template get<P>(r.order.x, r.order.y, r.order.z), t_min, t_max);
  }
};

}  // namespace patchrt
