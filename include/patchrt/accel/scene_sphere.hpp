// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/shape_kind.hpp>
#include <patchrt/intersect/ray_sphere.hpp>

namespace patchrt {

/// Spheres in a scene: eight share the lanes of a pack.
template <class T> struct shape_kind<sphere<T>> {
  static constexpr bool shares_lanes = true;
  static constexpr int capacity = 8;
  static constexpr bool wants_packs = false;

  template <class S> using record = sphere<S>;
  using block = lane_block<record, T>;

  static sphere<T> prepare(sphere<T> const& s) { return s; }
  template <scalar R> PATCHRT_INLINE static auto make_ray(ray<R> const& r) {
    return make_centred_ray(r.origin, r.direction);
  }
  template <scalar K, lanes_of<K> R, lanes_of<K> S>
  PATCHRT_INLINE static sphere_hit<K> meet(centred_ray<R> const& r, sphere<S> const& s, K t_min, K t_max) {
    return intersect(lanes<K>(r), s, t_min, t_max);
  }
  template <scalar K, lanes_of<K> R, lanes_of<K> S>
  PATCHRT_INLINE static sphere_hit<K> complete(centred_ray<R> const& r, sphere<S> const& s, sphere_hit<K> const& met) {
    return {correct_crossing(lanes<K>(r), s, met.t), met.valid};
  }

 private:
  template <scalar K, lanes_of<K> R> PATCHRT_INLINE static centred_ray<K> lanes(centred_ray<R> const& r) {
    return {{K(r.origin.x), K(r.origin.y), K(r.origin.z)},
            {K(r.direction.x), K(r.direction.y), K(r.direction.z)},
            K(r.inverse_square)};
  }
};

}  // namespace patchrt
