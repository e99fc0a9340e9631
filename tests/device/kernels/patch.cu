// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/patch.hpp>

PATCHRT_DEVICE_ENTRY(evaluate_f32, patchrt::test::evaluate_kernel<float>)
PATCHRT_DEVICE_ENTRY(evaluate_f64, patchrt::test::evaluate_kernel<double>)
PATCHRT_DEVICE_ENTRY(curvature_f32, patchrt::test::curvature_kernel<float>)
PATCHRT_DEVICE_ENTRY(curvature_f64, patchrt::test::curvature_kernel<double>)
PATCHRT_DEVICE_ENTRY(normal_f32, patchrt::test::normal_kernel<float>)
PATCHRT_DEVICE_ENTRY(normal_f64, patchrt::test::normal_kernel<double>)
PATCHRT_DEVICE_ENTRY(split_f32, patchrt::test::split_kernel<float>)
PATCHRT_DEVICE_ENTRY(split_f64, patchrt::test::split_kernel<double>)
PATCHRT_DEVICE_ENTRY(sub_patch_f32, patchrt::test::sub_patch_kernel<float>)
PATCHRT_DEVICE_ENTRY(sub_patch_f64, patchrt::test::sub_patch_kernel<double>)
