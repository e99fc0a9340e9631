// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/trace.hpp>

PATCHRT_DEVICE_ENTRY(closest_fast_f32, patchrt::test::trace_kernel<patchrt::accuracy::fast, false>)
PATCHRT_DEVICE_ENTRY(closest_refined_f64, patchrt::test::trace_kernel<patchrt::accuracy::refined, false>)
PATCHRT_DEVICE_ENTRY(closest_certified_f64, patchrt::test::trace_kernel<patchrt::accuracy::certified, false>)
PATCHRT_DEVICE_ENTRY(closest_reference_f64, patchrt::test::trace_kernel<patchrt::accuracy::reference, false>)
PATCHRT_DEVICE_ENTRY(any_refined_f64, patchrt::test::trace_kernel<patchrt::accuracy::refined, true>)
