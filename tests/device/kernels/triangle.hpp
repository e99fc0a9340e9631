// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/intersect/triangle_departure.hpp>

namespace patchrt::test {

/// What each triangle is by itself, and where a ray that leaves it starts.
template <class T> struct triangle_shape_kernel {
  static constexpr int outputs = 15;
  triangle<T> const* triangles;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    triangle<T> const& t = triangles[i];
    T const u(0.25), v(0.625);
    auto const from = depart_from(t, u, v);
    T* const y = out + outputs * i;
    y[0] = has_area(t) ? T(1) : T(0);
    y[1] = from.clearance;
    store(normal(t), y + 2);
    store(position(t, u, v), y + 5);
    store(from.normal, y + 8);
    store(offset_origin(from, rays[i].direction), y + 11);
    y[14] = half_area(bounds(t));
  }

 private:
  PATCHRT_HD static void store(vec3<T> const& v, T* y) {
    y[0] = v.x;
    y[1] = v.y;
    y[2] = v.z;
  }
};

/// Each ray and triangle by one form, both sides and the front alone, with what t may be wrong by.
template <class Form, class T> struct triangle_form_kernel {
  using prepared = typename Form::template prepared<T>;
  static constexpr int outputs = 9;
  prepared const* triangles;
  ray<T> const* rays;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    prepared const& t = triangles[i];
    auto const constants = Form::make_ray(r.origin, r.direction);
    auto const both = intersect<Form>(constants, t, r.t_min, r.t_max);
    T* const y = out + outputs * i;
    store(both, y);
    store(intersect<Form, faces::front>(constants, t, r.t_min, r.t_max), y + 4);
    y[8] = both.valid ? Form::position_error(constants, t, both.t) : T(0);
  }

 private:
  PATCHRT_HD static void store(triangle_hit<T> const& h, T* y) {
    y[0] = h.valid ? T(1) : T(0);
    y[1] = h.valid ? h.t : T(0);
    y[2] = h.valid ? h.u : T(0);
    y[3] = h.valid ? h.v : T(0);
  }
};

/// What a form keeps of each triangle.
template <class Form, class T> struct triangle_prepare_kernel {
  using prepared = typename Form::template prepared<T>;
  static constexpr int outputs = int(sizeof(prepared) / sizeof(T));
  triangle<T> const* triangles;
  prepared* out;

  PATCHRT_HD void operator()(int i) const { out[i] = Form::prepare(triangles[i]); }
};

}  // namespace patchrt::test
