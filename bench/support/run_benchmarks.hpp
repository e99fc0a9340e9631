// SPDX-License-Identifier: MIT
#pragma once

#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>

namespace patchrt::bench {

/// All of a Google Benchmark program's main. `prepare()` loads what the benchmarks need; where it throws, what it says is all there
/// is to see.
template <class F> int run_benchmarks(int argc, char** argv, F&& prepare) {
  try {
    prepare();
  } catch (std::exception const& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace patchrt::bench
