// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/affine.hpp>
#include <patchrt/intersect/quadric_point.hpp>

namespace patchrt::test {

/// Both roots of each equation, with a tangent and without.
template <class T> struct quadratic_kernel {
  static constexpr int outputs = 4;
  T const* coefficients;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    T const* const x = coefficients + 3 * i;
    auto const touching = solve_quadratic(x[0], x[1], x[2]);
    T* const y = out + outputs * i;
    y[0] = touching.real ? touching.t0 : T(0);
    y[1] = touching.real ? touching.t1 : T(0);
    y[2] = touching.real ? T(1) : T(0);
    y[3] = solve_quadratic<tangent::miss>(x[0], x[1], x[2]).real ? T(1) : T(0);
  }
};

/// The nearest hit of each ray with its sphere, and where rays leave it.
template <class T> struct sphere_kernel {
  static constexpr int outputs = 9;
  ray<T> const* rays;
  sphere<T> const* spheres;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    auto const line = make_centred_ray(r.origin, r.direction);
    sphere_hit<T> const hit = intersect(line, spheres[i], r.t_min, r.t_max);
    T* const y = out + outputs * i;
    for (int k = 0; k < outputs; ++k) y[k] = T(0);
    if (!hit.valid) return;
    surface_departure<T> const from = depart_from(line, spheres[i], hit);
    y[0] = T(1);
    y[1] = hit.t;
    for (int k = 0; k < 3; ++k) {
      y[2 + k] = component(from.position, k);
      y[5 + k] = component(from.normal, k);
    }
    y[8] = from.clearance;
  }
};

/// All crossings of each ray with its quadric.
template <class T> struct crossings_kernel {
  static constexpr int outputs = 20;
  ray<T> const* rays;
  clipped_quadric<T> const* surfaces;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    auto const line = make_centred_ray(r.origin, r.direction);
    quadric_crossings<T> const all = crossings(line, surfaces[i]);
    quadric_hit<T> const first = nearest(all, r.t_min, r.t_max);
    T* const y = out + outputs * i;
    for (int k = 0; k < 4; ++k) store(all.hit[k], y + 4 * k);
    store(first, y + 16);
  }

 private:
  PATCHRT_HD static void store(quadric_hit<T> const& hit, T* y) {
    y[0] = hit.valid ? T(1) : T(0);
    y[1] = hit.valid ? hit.t : T(0);
    y[2] = hit.valid ? hit.local : T(0);
    y[3] = hit.valid ? hit.face : T(0);
  }
};

/// The point of each ray's nearest hit: position, normal, error, clearance.
template <class T> struct quadric_point_kernel {
  static constexpr int outputs = 9;
  ray<T> const* rays;
  clipped_quadric<T> const* surfaces;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    ray<T> const& r = rays[i];
    auto const line = make_centred_ray(r.origin, r.direction);
    quadric_hit<T> const hit = intersect(line, surfaces[i], r.t_min, r.t_max);
    T* const y = out + outputs * i;
    for (int k = 0; k < outputs; ++k) y[k] = T(0);
    if (!hit.valid) return;
    quadric_point<T> const p = point_at(line, surfaces[i], hit);
    y[0] = T(1);
    for (int k = 0; k < 3; ++k) {
      y[1 + k] = component(p.position, k);
      y[4 + k] = component(p.normal, k);
    }
    y[7] = p.error;
    y[8] = p.clearance;
  }
};

/// Each ray and a box mapped by its map.
template <class T> struct affine_kernel {
  static constexpr int outputs = 15;
  ray<T> const* rays;
  affine<T> const* maps;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    affine<T> const& m = maps[i];
    ray<T> const r = transform(m, rays[i]);
    vec3<T> const n = transform_normal(m, rays[i].direction);
    box<T> const b = transform(m, merge(box<T>{rays[i].origin, rays[i].origin}, rays[i].direction));
    T* const y = out + outputs * i;
    for (int k = 0; k < 3; ++k) {
      y[k] = component(r.origin, k);
      y[3 + k] = component(r.direction, k);
      y[6 + k] = component(n, k);
      y[9 + k] = component(b.lo, k);
      y[12 + k] = component(b.hi, k);
    }
  }
};

}  // namespace patchrt::test
