// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_normal.hpp>
#include <patchrt/shapes/bezier_patch.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/shapes/power_patch.hpp>

namespace patchrt::test {

template <class T> PATCHRT_HD T* store(vec3<T> const& v, T* y) {
  y[0] = v.x;
  y[1] = v.y;
  y[2] = v.z;
  return y + 3;
}

template <class T> PATCHRT_HD T* store(bicubic_patch<T> const& patch, T* y) {
  for (int k = 0; k < 16; ++k) y = store(patch.control_points[k], y);
  return y;
}

/// Point and tangents of each patch at its own (u, v): parameters[2 i], parameters[2 i + 1].
template <class T> struct evaluate_kernel {
  static constexpr int outputs = 9;
  bicubic_patch<T> const* patches;
  T const* parameters;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    auto const s = evaluate(patches[i], parameters[2 * i], parameters[2 * i + 1]);
    store(s.dv, store(s.du, store(s.position, out + outputs * i)));
  }
};

/// All derivatives up to the second, and the point by the power form.
template <class T> struct curvature_kernel {
  static constexpr int outputs = 21;
  bicubic_patch<T> const* patches;
  T const* parameters;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    T const u = parameters[2 * i], v = parameters[2 * i + 1];
    auto const s = evaluate_curvature(patches[i], u, v);
    T* y = store(s.dv, store(s.du, store(s.position, out + outputs * i)));
    y = store(s.dvv, store(s.duv, store(s.duu, y)));
    store(position(to_power(patches[i]), fma(T(2), u, T(-1)), fma(T(2), v, T(-1))), y);
  }
};

/// The unit normal, the limit normal where the tangents vanish.
template <class T> struct normal_kernel {
  static constexpr int outputs = 3;
  bicubic_patch<T> const* patches;
  T const* parameters;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    store(normal(patches[i], parameters[2 * i], parameters[2 * i + 1]), out + outputs * i);
  }
};

/// The first half by u, the second half by v of that cut at v: the two steps of any subdivision; and its box.
template <class T> struct split_kernel {
  static constexpr int outputs = 48 + 48 + 6;
  bicubic_patch<T> const* patches;
  T const* parameters;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    auto const half = split_u(patches[i]).first;
    auto const part = split_v(half, parameters[2 * i + 1]).second;
    box<T> const b = bounds(part);
    store(b.hi, store(b.lo, store(part, store(half, out + outputs * i))));
  }
};

/// The part of each patch from its (u, v) up to (1, 1).
template <class T> struct sub_patch_kernel {
  static constexpr int outputs = 48;
  bicubic_patch<T> const* patches;
  T const* parameters;
  T* out;

  PATCHRT_HD void operator()(int i) const {
    store(sub_patch(patches[i], parameters[2 * i], T(1), parameters[2 * i + 1], T(1)), out + outputs * i);
  }
};

}  // namespace patchrt::test
