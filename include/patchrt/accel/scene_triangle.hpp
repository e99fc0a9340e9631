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
};

}  // namespace patchrt
