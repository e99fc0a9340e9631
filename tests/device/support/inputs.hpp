// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Inputs of kernels, ordinary and nasty, from a seed.

#include <patchrt/core/box.hpp>
#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/bezier_patch.hpp>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

namespace patchrt::test {

/// A source of numbers; the same on every machine for one seed (std's distributions are not).
class number_source {
 public:
  explicit number_source(std::uint64_t seed) : engine_(seed) {}

  std::uint64_t bits() { return engine_(); }
  int below(int n) { return static_cast<int>(bits() % static_cast<std::uint64_t>(n)); }
  template <class T> T uniform(T lo, T hi) {
    return lo + (hi - lo) * static_cast<T>(std::ldexp(static_cast<double>(bits() >> 11), -53));
  }

  /// Mostly in [-4, 4]; one in `rarity` is zero, subnormal, huge, infinite, NaN or has random bits.
  template <class T> T nasty(int rarity) {
    if (below(rarity) != 0) return uniform(T(-4), T(4));
    using limits = std::numeric_limits<T>;
    using uint = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
    T const special[] = {T(0),
                         T(1),
                         T(0.5),
                         limits::denorm_min(),
                         limits::min(),
                         limits::max(),
                         limits::infinity(),
                         limits::quiet_NaN(),
                         limits::epsilon(),
                         std::bit_cast<T>(static_cast<uint>(bits() >> 1))};
    T const x = special[below(10)];
    return bits() & 1u ? x : -x;
  }

  template <class T> vec3<T> point(T size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  template <class T> vec3<T> nasty_point(int rarity) { return {nasty<T>(rarity), nasty<T>(rarity), nasty<T>(rarity)}; }

 private:
  std::mt19937_64 engine_;
};

/// Rays with nasty numbers in every third.
template <class T> std::vector<ray<T>> nasty_rays(number_source& source, int count) {
  std::vector<ray<T>> rays;
  for (int i = 0; i < count; ++i) {
    int const rarity = i % 3 == 0 ? 4 : 1 << 30;
    rays.push_back({source.nasty_point<T>(rarity), source.nasty_point<T>(rarity), source.nasty<T>(rarity),
                    source.nasty<T>(rarity)});
  }
  return rays;
}

/// Bicubic patches: random ones, near-flat ones, ones with a collapsed edge or all in one point, and ones of nasty
/// numbers.
template <class T> std::vector<bicubic_patch<T>> nasty_patches(number_source& source, int count) {
  std::vector<bicubic_patch<T>> patches(static_cast<std::size_t>(count));
  for (std::size_t n = 0; n < patches.size(); ++n) {
    auto& patch = patches[n];
    int const kind = static_cast<int>(n % 6);
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        vec3<T> const flat{T(i) / 3, T(j) / 3, T(0)};
        patch(i, j) = kind == 5   ? source.nasty_point<T>(12)
                      : kind == 4 ? patch(0, 0) = flat
                                  : flat + source.point(T(kind == 0 ? 2 : 0.1));
        if (kind == 2 && i == 0) patch(i, j) = patch(0, 0);
        if (kind == 3 && j == 3) patch(i, j) = patch(0, 3);
      }
    }
  }
  return patches;
}

/// Two parameters for each of `count` patches: inside, on edges and corners, outside, nasty.
template <class T> std::vector<T> nasty_parameters(number_source& source, int count) {
  std::vector<T> parameters;
  for (int i = 0; i < 2 * count; ++i) {
    int const kind = source.below(8);
    parameters.push_back(kind == 0   ? T(0)
                         : kind == 1 ? T(1)
                         : kind == 2 ? source.nasty<T>(2)
                                     : source.uniform(T(0), T(1)));
  }
  return parameters;
}

/// How many of `values` are finite: that a comparison was not one of NaN with NaN.
template <class T> double finite_share(std::vector<T> const& values) {
  std::size_t finite = 0;
  for (T x : values) finite += x - x == T(0);
  return static_cast<double>(finite) / static_cast<double>(values.size());
}

}  // namespace patchrt::test
