// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Timing a kernel over a list of inputs with Google Benchmark, and drawing such inputs, for one number or packs.

#include "fma_peak.hpp"

#include <benchmark/benchmark.h>

#include <random>

namespace patchrt::bench {

template <class T> double peak() {
  static double const flops = measure_fma_peak<T>();
  return flops;
}
/// The widest single register among the lanes of T.
template <class T> struct register_type { using type = T; };
template <class T, int N> struct register_type<pack<T, N>> { using type = pack<T, pack<T, N>::width>; };

/// Calls `kernel(k)` for the inputs in turn; it returns what must be computed.
template <class T, class Kernel>
void measure(benchmark::State& state, std::size_t count, double flops_a_lane, Kernel&& kernel) {
  std::size_t k = 0;
  double const seconds = thread_seconds([&] {
    for (auto _ : state) {
      auto result = kernel(k);
      benchmark::DoNotOptimize(result);
      k = k + 1 == count ? 0 : k + 1;
    }
  });
  double const lanes = double(state.iterations()) * lanes_v<T>, flops = flops_a_lane * lanes / seconds;
  state.counters["ns_a_lane"] = 1e9 * seconds / lanes;
  state.counters["flops_a_lane"] = flops_a_lane;
  state.counters["GFLOPS"] = 1e-9 * flops;
  state.counters["of_peak"] = flops / peak<typename register_type<T>::type>();
}

/// One T from lanes that `next` draws.
template <class T, class F> T draw(F&& next) {
  if constexpr (lanes_v<T> == 1) return T(next());
  else {
    lane_t<T> lane[lanes_v<T>];
    for (auto& x : lane) x = static_cast<lane_t<T>>(next());
    return T::load(lane);
  }
}

class random_numbers {
 public:
  double operator()() { return double(bits_() >> 11) * 0x1p-53; }
  double between(double lo, double hi) { return lo + (hi - lo) * (*this)(); }

 private:
  std::mt19937_64 bits_{1};
};

}  // namespace patchrt::bench
