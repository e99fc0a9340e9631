// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Sets of boxes that builders find hard, and easy ones.

#include <patchrt/core/box.hpp>

#include <cmath>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

namespace patchrt::test {

template <class T> struct box_set {
  std::string name;
  std::vector<box<T>> boxes;
};

/// n boxes around points that `centre(i)` gives, of half extents up to `size`.
template <class T, class F> std::vector<box<T>> boxes_around(std::size_t n, T size, F centre, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<T> half(0, size);
  std::vector<box<T>> boxes;
  for (std::size_t i = 0; i < n; ++i) {
    vec3<T> const c = centre(i), e{half(random), half(random), half(random)};
    boxes.push_back({c - e, c + e});
  }
  return boxes;
}

/// n boxes scattered in a cube.
template <class T> std::vector<box<T>> scattered_boxes(std::size_t n, unsigned seed) {
  std::mt19937 random(seed + 1);
  std::uniform_real_distribution<T> u(-1, 1);
  T const size = T(1) / std::cbrt(T(n + 1));
  return boxes_around<T>(
      n, size,
      [&](std::size_t) {
        return vec3<T>{u(random), u(random), u(random)};
      },
      seed);
}

/// n boxes of a bumpy surface, in rows.
template <class T> std::vector<box<T>> surface_boxes(std::size_t n, unsigned seed) {
  T const side = std::ceil(std::sqrt(T(n)));
  auto const centre = [&](std::size_t i) {
    T const x = std::fmod(T(i), side) / side, y = std::floor(T(i) / side) / side;
    return vec3<T>{x, y, std::sin(7 * x) * std::cos(5 * y) / 2};
  };
  return boxes_around<T>(n, T(1) / side, centre, seed);
}

/// n boxes of each kind; every kind has its own way to defeat binning.
template <class T> std::vector<box_set<T>> box_sets(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<T> u(-1, 1);
  auto const nothing = box<T>::empty();
  constexpr T inf = std::numeric_limits<T>::infinity();
  std::vector<box_set<T>> sets{
      {"scattered", scattered_boxes<T>(n, seed)},
      {"surface", surface_boxes<T>(n, seed)},
      {"equal", std::vector<box<T>>(n, box<T>{{T(.5), -1, 2}, {1, 1, 3}})},
      {"equal centres", boxes_around<T>(
                            n, 1,
                            [](std::size_t) {
                              return vec3<T>{1, 1, 1};
                            },
                            seed)},
      {"one point", std::vector<box<T>>(n, box<T>{{1, 2, 3}, {1, 2, 3}})},
      {"points on a line", boxes_around<T>(
                               n, 0,
                               [&](std::size_t) {
                                 return vec3<T>{u(random), 0, 0};
                               },
                               seed)},
      {"ever smaller",
       boxes_around<T>(
           n, 0,
           [](std::size_t i) {
             return vec3<T>{std::ldexp(T(1), -int(i % std::size_t(std::numeric_limits<T>::max_exponent - 24))), 0, 0};
           },
           seed)},
      {"ever greater", boxes_around<T>(
                           n, 1,
                           [](std::size_t i) {
                             return vec3<T>{0, std::pow(T(1.5), T(i % 100)), 0};
                           },
                           seed)},
      {"on a grid", boxes_around<T>(
                        n, T(.5),
                        [](std::size_t i) {
                          return vec3<T>{T(i % 3), T(i % 5), T(i % 7)};
                        },
                        seed)},
      {"areas overflow", boxes_around<T>(
                             n, std::sqrt(std::numeric_limits<T>::max()) * 4,
                             [&](std::size_t) {
                               return vec3<T>{u(random), u(random), u(random)};
                             },
                             seed)},
      {"some empty", scattered_boxes<T>(n, seed)},
      {"all empty", std::vector<box<T>>(n, nothing)},
      {"some infinite", scattered_boxes<T>(n, seed)},
  };
  for (std::size_t i = 0; i < n; i += 3) sets[10].boxes[i] = nothing;
  for (std::size_t i = 0; i < n; i += 5) sets[12].boxes[i].hi[int(i % 3)] = inf;
  for (std::size_t i = 0; i < n; i += 7) sets[12].boxes[i] = {{-inf, -inf, -inf}, {inf, inf, inf}};
  return sets;
}

}  // namespace patchrt::test
