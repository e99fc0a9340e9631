// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Objects that are kept once and placed many times: scenes and hierarchies of patches as shapes of a scene.

#include <patchrt/accel/hierarchy_search.hpp>
#include <patchrt/accel/scene_search.hpp>
#include <patchrt/core/affine.hpp>

namespace patchrt {

/// Patches as an object, met at level A.
template <class Surface, accuracy A = accuracy::refined> struct patch_object {
  basic_mixed_hierarchy_view<Surface> hierarchy;
};

/// An object where an affine map puts it; t is the same there and here. Keeps a view: what it is of has to live on.
template <class Object> struct instance {
  Object object;
  affine<double> to_world;
  affine<double> to_object;
};

/// Hits of an object; `part_bits` is the number of what was hit, as bits.
template <scalar R, scalar T> struct object_hit {
  R t, u, v;
  T part_bits;
  mask_t<T> valid;
};

/// \throws std::invalid_argument where the map is singular or not finite.
template <class... Shapes>
instance<scene_view<Shapes...>> place(scene_view<Shapes...> const& o, affine<double> const& to) {
  return {o, to, inverse(to)};
}
template <accuracy A = accuracy::refined, class Surface>
instance<patch_object<Surface, A>> place(basic_mixed_hierarchy_view<Surface> const& o, affine<double> const& to) {
  return {{o}, to, inverse(to)};
}

/// The box that holds an object's shapes, as its own hierarchy pads them.
template <class... Shapes> box<double> object_bounds(scene_view<Shapes...> const& o) {
  if (is_empty(o.bounds)) return box<double>::empty();
  return {vec3<double>(o.bounds.lo), vec3<double>(o.bounds.hi)};
}
template <class Surface, accuracy A> box<double> object_bounds(patch_object<Surface, A> const& o) {
  if (o.hierarchy.top.count == 0) return box<double>::empty();
  box<float> const& b = o.hierarchy.top.nodes[0].bounds;  // padded
  double const scale = 1 / o.hierarchy.inverse_scale;     // a power of two
  vec3<double> const c = o.hierarchy.centre, lo(b.lo), hi(b.hi);
  return {fma(scale, lo, c), fma(scale, hi, c)};
}

template <class Object> box<double> bounds(instance<Object> const& i) {
  return transform(i.to_world, object_bounds(i.object));
}

namespace detail {

template <bool AnyHit, scalar K, class... Shapes>
PATCHRT_INLINE auto meet_object(scene_view<Shapes...> const& o, ray<K> const& r) {
  using T = rebind_lane_t<K, float>;
  auto const h = intersect<AnyHit, T>(o, r, convert<mask_t<T>>(r.t_min < r.t_max));
  return object_hit<K, T>{h.t, h.u, h.v, h.shape_bits, h.valid};
}
template <bool AnyHit, scalar K, class Surface, accuracy A>
PATCHRT_INLINE auto meet_object(patch_object<Surface, A> const& o, ray<K> const& r) {
  using T = rebind_lane_t<K, float>;
  auto const h = intersect<A, AnyHit, T>(o.hierarchy, r, convert<mask_t<T>>(r.t_min < r.t_max));
  return object_hit<K, T>{convert<K>(h.t), convert<K>(h.u), convert<K>(h.v), h.patch_bits, convert<mask_t<T>>(h.valid)};
}

}  // namespace detail

template <scalar K, class Object> PATCHRT_INLINE auto intersect(ray<K> const& r, instance<Object> const& i) {
  return detail::meet_object<false>(i.object, transform(i.to_object, r));
}
template <scalar K, class Object> PATCHRT_INLINE auto intersect_any(ray<K> const& r, instance<Object> const& i) {
  return detail::meet_object<true>(i.object, transform(i.to_object, r));
}

/// Rays stay in packs: the search in a patch serves sixteen at the price of three.
template <class Surface, accuracy A> struct shape_kind<instance<patch_object<Surface, A>>> : single_shapes {
  static constexpr bool wants_packs = true;
  struct block {
    instance<patch_object<Surface, A>> shape;
    std::int32_t number;
  };
};

}  // namespace patchrt
