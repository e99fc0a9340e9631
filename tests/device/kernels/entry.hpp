// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// One source of kernels for every build: a kernel is a struct of inputs and outputs whose operator()(i)
/// computes item i.
///
/// PATCHRT_DEVICE_ENTRY(name, kernel type) makes of it a CUDA entry under nvcc, one thread an item, and an exported
/// loop over the items under a host compiler. Names end in _f64 where double is used, else in _f32; results go to
/// arrays of one number type, so that tests can compare them number by number.

#include <patchrt/core/config.hpp>

#if defined(__CUDACC__)

#  define PATCHRT_DEVICE_ENTRY(name, ...)                                                    \
    extern "C" __global__ void name(__VA_ARGS__ const __grid_constant__ kernel, int count) { \
      int const i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);                 \
      if (i < count) kernel(i);                                                              \
    }

#else

#  include <device/support/launch_request.hpp>

#  define PATCHRT_DEVICE_ENTRY(name, ...)                                                                       \
    extern "C" __attribute__((visibility("default"))) void name(patchrt::test::launch_request const& request) { \
      auto const& kernel = *static_cast<__VA_ARGS__ const*>(request.arguments[0]);                              \
      int const count = *static_cast<int const*>(request.arguments[1]);                                         \
      for (int i = 0; i < count; ++i) kernel(i);                                                                \
    }

#endif
