// SPDX-License-Identifier: MIT
#pragma once

#include "cpu_clock.hpp"

#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace patchrt::bench {

/// Makes the compiler take x for changed, in its register: neighbouring chains then cannot be merged into wider ones.
template <class T> inline void keep_in_register(T& x) {
#if defined(__AVX512F__)
  asm volatile("" : "+v"(x));
#elif defined(__SSE2__)
  asm volatile("" : "+x"(x));
#elif defined(__aarch64__)
  asm volatile("" : "+w"(x));
#else
  asm volatile("" : "+m"(x));
#endif
}

inline float& register_of(float& x) { return x; }
inline double& register_of(double& x) { return x; }
template <class T, int N> auto& register_of(pack<T, N>& x) {
  static_assert(pack<T, N>::parts == 1);
  return x.part[0].data;
}

/// Flops a second of independent chains of `fma` (2 flops each) on T in this thread; the best of some trials.
///
/// T is float, double, or a pack that fills one register.
template <class T> double measure_fma_peak() {
  constexpr int chains = 12, steps = 20000;
  auto const run = []<std::size_t... I>(std::index_sequence<I...>) {
    T x[] = {T(lane_t<T>(1 + 0.01 * double(I)))...};
    T const a(lane_t<T>(0.999)), b(lane_t<T>(0.001));
    for (int k = 0; k < steps; ++k) ((x[I] = fma(a, x[I], b), keep_in_register(register_of(x[I]))), ...);
  };
  double best = 0;
  for (int trial = 0; trial < 20; ++trial)
    best = std::max(
        best, 2.0 * chains * steps * lanes_v<T> / thread_seconds([&] { run(std::make_index_sequence<chains>{}); }));
  return best;
}

}  // namespace patchrt::bench
