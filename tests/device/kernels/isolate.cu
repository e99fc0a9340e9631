// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/isolate.hpp>

PATCHRT_DEVICE_ENTRY(isolate_f32, patchrt::test::isolate_kernel<float>)
PATCHRT_DEVICE_ENTRY(isolate_f64, patchrt::test::isolate_kernel<double>)
