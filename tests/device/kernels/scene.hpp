// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/instance.hpp>
#include <patchrt/accel/scene_search.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/accel/scene_triangle.hpp>

namespace patchrt::test {

/// A shape as users write them, for one ray at a time: a disc across the z axis.
struct level_disc {
  vec3<float> centre;
  float radius;
};
PATCHRT_HD inline box<float> bounds(level_disc const& d) {
  vec3<float> const half(d.radius, d.radius, 0);
  return {d.centre - half, d.centre + half};
}
struct level_hit {
  float t, u, v;
  bool valid;
};
PATCHRT_HD inline level_hit intersect(ray<float> const& r, level_disc const& d) {
  float const t = (d.centre.z - r.origin.z) / r.direction.z;
  float const x = fma(t, r.direction.x, r.origin.x - d.centre.x), y = fma(t, r.direction.y, r.origin.y - d.centre.y);
  return {t, x, y, r.t_min < t && t < r.t_max && fma(x, x, y * y) <= d.radius * d.radius};
}

using mixed_view = scene_view<scene_triangle<float>, sphere<float>, level_disc>;
using object_view = scene_view<scene_triangle<double>, sphere<double>>;
using placed_view = scene_view<instance<object_view>, sphere<double>>;

/// One ray a thread through a scene without a stack, closest or any hit.
template <class Scene, class T, bool AnyHit> struct scene_kernel {
  static constexpr int outputs = 6;
  Scene scene;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    auto const hit = intersect<AnyHit, float>(scene, rays[i], true);
    T* const y = out + outputs * i;
    y[0] = T(hit.valid);
    y[1] = hit.valid ? hit.t : T(0);
    y[2] = hit.valid ? hit.u : T(0);
    y[3] = hit.valid ? hit.v : T(0);
    y[4] = T(std::bit_cast<std::int32_t>(hit.shape_bits));
    y[5] = T(std::bit_cast<std::int32_t>(hit.part_bits));
  }
};

}  // namespace patchrt::test
