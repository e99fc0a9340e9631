// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/solver.hpp>

PATCHRT_DEVICE_ENTRY(solve_f32, patchrt::test::solve_kernel<float>)
PATCHRT_DEVICE_ENTRY(solve_f64, patchrt::test::solve_kernel<double>)
