// SPDX-License-Identifier: MIT
// Occupancy without a GPU: for lines "kernel registers shared_bytes" on standard input, the share of an SM's threads
// that can be resident at several block sizes, by NVIDIA's calculator (cuda_occupancy.h, host code).

#include <cuda_occupancy.h>

#include <climits>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>

namespace {

/// One row of the table of technical specifications, CUDA C++ Programming Guide 13.0, appendix on compute capabilities.
struct device_limits {
  int compute_capability, threads_per_sm, shared_kilobytes_per_sm;
};
constexpr device_limits devices[] = {{75, 1024, 64},  {80, 2048, 164},  {86, 1536, 100}, {89, 1536, 100},
                                     {90, 2048, 228}, {100, 2048, 228}, {120, 1536, 100}};

cudaOccDeviceProp properties(device_limits const& d) {
  cudaOccDeviceProp p;
  p.computeMajor = d.compute_capability / 10;
  p.computeMinor = d.compute_capability % 10;
  p.maxThreadsPerBlock = 1024;
  p.maxThreadsPerMultiprocessor = d.threads_per_sm;
  p.regsPerBlock = p.regsPerMultiprocessor = 65536;
  p.warpSize = 32;
  p.sharedMemPerBlock = 48 * 1024;
  p.sharedMemPerMultiprocessor = static_cast<std::size_t>(d.shared_kilobytes_per_sm) * 1024;
  p.reservedSharedMemPerBlock = d.compute_capability >= 80 ? 1024 : 0;
  p.sharedMemPerBlockOptin = p.sharedMemPerMultiprocessor - p.reservedSharedMemPerBlock;
  p.numSms = 1;
  return p;
}

}  // namespace

int main(int argc, char** argv) {
  int const capability = argc == 2 ? std::atoi(argv[1]) : 0;
  for (device_limits const& d : devices) {
    if (d.compute_capability != capability) continue;
    cudaOccDeviceProp const p = properties(d);
    cudaOccDeviceState const state;
    std::string kernel;
    int registers = 0;
    std::size_t shared = 0;
    while (std::cin >> kernel >> registers >> shared) {
      cudaOccFuncAttributes a;
      a.maxThreadsPerBlock = INT_MAX;
      a.numRegs = registers;
      a.sharedSizeBytes = shared;
      std::printf("%s", kernel.c_str());
      for (int threads : {64, 128, 256}) {
        cudaOccResult r;
        bool const known = cudaOccMaxActiveBlocksPerMultiprocessor(&r, &p, &a, &state, threads, 0) == CUDA_OCC_SUCCESS;
        std::printf(" %d: %3d %% ", threads,
                    known ? 100 * r.activeBlocksPerMultiprocessor * threads / d.threads_per_sm : 0);
      }
      std::printf("\n");
    }
    return 0;
  }
  std::fprintf(stderr, "usage: occupancy COMPUTE_CAPABILITY (75, 80, 86, 89, 90, 100 or 120) < lines\n");
  return 1;
}
