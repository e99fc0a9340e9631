// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Boxes and rays that are hard for a slab test: shared planes, flat boxes, zero components, grazed corners, far origins.

#include <patchrt/core/box.hpp>
#include <patchrt/core/ray.hpp>

#include <cmath>
#include <random>
#include <utility>

namespace patchrt::test {

template <class T> class random_box_rays {
 public:
  explicit random_box_rays(unsigned seed) : random_(seed) {}

  bool chance(double p) { return std::bernoulli_distribution(p)(random_); }
  int pick(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  T uniform(T lo, T hi) { return std::uniform_real_distribution<T>(lo, hi)(random_); }

  /// Small integers (planes meet), numbers near 1, and numbers of any size between 2^-10 and 2^20.
  T coordinate() {
    switch (pick(3)) {
      case 0:
        return T(pick(5) - 2);
      case 1:
        return uniform(-2, 2);
      default:
        return std::ldexp(uniform(-1, 1), pick(30) - 10);
    }
  }
  vec3<T> point() { return {coordinate(), coordinate(), coordinate()}; }

  box<T> any_box() {
    vec3<T> a = point(), b = point();
    for (int k = 0; k < 3; ++k) {
      if (chance(0.1)) b[k] = a[k];
      if (b[k] < a[k]) std::swap(a[k], b[k]);
    }
    return {a, b};
  }
  /// A box that holds b, each plane of it in place, one ulp or any distance out.
  box<T> around(box<T> b) {
    constexpr T inf = std::numeric_limits<T>::infinity();
    for (int k = 0; k < 3; ++k) {
      if (chance(0.3)) b.lo[k] = std::nextafter(b.lo[k], -inf);
      else if (chance(0.5)) b.lo[k] -= abs(coordinate());
      if (chance(0.3)) b.hi[k] = std::nextafter(b.hi[k], inf);
      else if (chance(0.5)) b.hi[k] += abs(coordinate());
    }
    return b;
  }
  /// A ray at, past, along or inside b.
  ray<T> any_ray(box<T> const& b) {
    vec3<T> o = point(), d = point();
    vec3<T> target;
    for (int k = 0; k < 3; ++k) {
      if (chance(0.15)) o[k] = chance(0.5) ? b.lo[k] : b.hi[k];
      target[k] = chance(0.5) ? b.lo[k] : b.hi[k];
      if (chance(0.3)) target[k] = uniform(b.lo[k], b.hi[k]);
    }
    if (chance(0.7)) {
      d = target - o;
      T const scale = std::ldexp(uniform(T(0.5), T(1)), pick(20) - 10);
      d = {d.x * scale, d.y * scale, d.z * scale};
    }
    for (int k = 0; k < 3; ++k)
      if (chance(0.15)) d[k] = chance(0.5) ? T(0) : -T(0);
    if (d == vec3<T>{0, 0, 0}) d[pick(3)] = T(1);
    T const t_min = chance(0.2) ? -std::numeric_limits<T>::infinity() : chance(0.5) ? T(0) : uniform(-4, 4);
    T const t_max =
        chance(0.5) ? std::numeric_limits<T>::infinity() : uniform(0, 4) + (chance(0.5) ? T(0) : max(t_min, T(-8)));
    return {o, d, t_min, t_max};
  }

 private:
  std::mt19937 random_;
};

}  // namespace patchrt::test
