// SPDX-License-Identifier: MIT
#include <device/kernels/core.hpp>
#include <device/kernels/entry.hpp>

PATCHRT_DEVICE_ENTRY(arithmetic_f32, patchrt::test::arithmetic_kernel<float>)
PATCHRT_DEVICE_ENTRY(arithmetic_f64, patchrt::test::arithmetic_kernel<double>)
PATCHRT_DEVICE_ENTRY(planes_f32, patchrt::test::planes_kernel<float>)
PATCHRT_DEVICE_ENTRY(planes_f64, patchrt::test::planes_kernel<double>)
PATCHRT_DEVICE_ENTRY(slab_f32, patchrt::test::slab_kernel<float>)
PATCHRT_DEVICE_ENTRY(slab_f64, patchrt::test::slab_kernel<double>)
