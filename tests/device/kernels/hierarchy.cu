// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/hierarchy.hpp>

PATCHRT_DEVICE_ENTRY(traverse_f32, patchrt::test::traverse_kernel<float>)
PATCHRT_DEVICE_ENTRY(traverse_f64, patchrt::test::traverse_kernel<double>)
