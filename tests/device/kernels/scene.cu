// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/scene.hpp>

PATCHRT_DEVICE_ENTRY(closest_mixed_f32, patchrt::test::scene_kernel<patchrt::test::mixed_view, float, false>)
PATCHRT_DEVICE_ENTRY(any_mixed_f32, patchrt::test::scene_kernel<patchrt::test::mixed_view, float, true>)
PATCHRT_DEVICE_ENTRY(closest_placed_f64, patchrt::test::scene_kernel<patchrt::test::placed_view, double, false>)
