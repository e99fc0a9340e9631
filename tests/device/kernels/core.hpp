// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/ray.hpp>
#include <patchrt/core/twin_planes.hpp>
#include <patchrt/intersect/ray_box.hpp>

namespace patchrt::test {

/// Products, roots, order and signs of the three vectors (a, b, c) of each item.
template <class T> struct arithmetic_kernel {
  static constexpr int inputs = 9, outputs = 16;
  T const* in;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    T const* const x = in + inputs * i;
    T* const y = out + outputs * i;
    vec3<T> const a{x[0], x[1], x[2]}, b{x[3], x[4], x[5]}, c{x[6], x[7], x[8]};
    vec3<T> const p = cross(a, b);
    vec3<T> const q = fma(a.x, b, c);
    y[0] = p.x;
    y[1] = p.y;
    y[2] = p.z;
    y[3] = dot(a, b);
    y[4] = difference_of_products(a.x, b.y, a.y, b.x);
    y[5] = lerp(a.x, b.x, c.x);
    y[6] = q.x;
    y[7] = q.y;
    y[8] = q.z;
    y[9] = sqrt(dot(a, a));
    y[10] = a.x / b.x;
    y[11] = T(1) / c.x;
    y[12] = min(a.x, b.x);
    y[13] = max(a.y, b.y);
    y[14] = copysign(a.z, b.z);
    y[15] = select(a.x < b.x && !(c.x <= a.x), abs(c.z), -c.z);
  }
};

/// The twin planes of each ray, by `make_twin_planes` and as the planes of a pinhole's pixel.
template <class T> struct planes_kernel {
  static constexpr int outputs = 16;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    vec3<T> const up{T(0), T(1), T(0)};
    store(make_twin_planes(r.origin, r.direction), out + outputs * i);
    store(make_primary_planes(r.origin, r.direction, cross(r.direction, up), up, r.t_min, r.t_max),
          out + outputs * i + 8);
  }

 private:
  PATCHRT_HD static void store(twin_planes<T> const& p, T* y) {
    y[0] = p.n1.x;
    y[1] = p.n1.y;
    y[2] = p.n1.z;
    y[3] = p.d1;
    y[4] = p.n2.x;
    y[5] = p.n2.y;
    y[6] = p.n2.z;
    y[7] = p.d2;
  }
};

/// Where each ray enters and leaves its box, nearest and conservative.
template <class T> struct slab_kernel {
  static constexpr int outputs = 4;
  ray<T> const* rays;
  box<T> const* boxes;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    slab_ray<T> const s = make_slab_ray(r.origin, r.direction);
    slab_span<T> const nearest = intersect(s, boxes[i], r.t_min, r.t_max);
    slab_span<T> const conservative = intersect<slab::conservative>(s, boxes[i], r.t_min, r.t_max);
    T* const y = out + outputs * i;
    y[0] = nearest.entry;
    y[1] = nearest.exit;
    y[2] = conservative.entry;
    y[3] = conservative.exit;
  }
};

}  // namespace patchrt::test
