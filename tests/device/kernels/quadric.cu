// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/quadric.hpp>

PATCHRT_DEVICE_ENTRY(quadratic_f32, patchrt::test::quadratic_kernel<float>)
PATCHRT_DEVICE_ENTRY(quadratic_f64, patchrt::test::quadratic_kernel<double>)
PATCHRT_DEVICE_ENTRY(sphere_f32, patchrt::test::sphere_kernel<float>)
PATCHRT_DEVICE_ENTRY(sphere_f64, patchrt::test::sphere_kernel<double>)
PATCHRT_DEVICE_ENTRY(crossings_f32, patchrt::test::crossings_kernel<float>)
PATCHRT_DEVICE_ENTRY(crossings_f64, patchrt::test::crossings_kernel<double>)
PATCHRT_DEVICE_ENTRY(quadric_point_f32, patchrt::test::quadric_point_kernel<float>)
PATCHRT_DEVICE_ENTRY(quadric_point_f64, patchrt::test::quadric_point_kernel<double>)
PATCHRT_DEVICE_ENTRY(affine_f32, patchrt::test::affine_kernel<float>)
PATCHRT_DEVICE_ENTRY(affine_f64, patchrt::test::affine_kernel<double>)
