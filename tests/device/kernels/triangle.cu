// SPDX-License-Identifier: MIT
#include <device/kernels/entry.hpp>
#include <device/kernels/triangle.hpp>

PATCHRT_DEVICE_ENTRY(triangle_shape_f32, patchrt::test::triangle_shape_kernel<float>)
PATCHRT_DEVICE_ENTRY(triangle_shape_f64, patchrt::test::triangle_shape_kernel<double>)
PATCHRT_DEVICE_ENTRY(prepare_engine_f32, patchrt::test::triangle_prepare_kernel<patchrt::engine_form, float>)
PATCHRT_DEVICE_ENTRY(prepare_engine_f64, patchrt::test::triangle_prepare_kernel<patchrt::engine_form, double>)
PATCHRT_DEVICE_ENTRY(engine_f32, patchrt::test::triangle_form_kernel<patchrt::engine_form, float>)
PATCHRT_DEVICE_ENTRY(engine_f64, patchrt::test::triangle_form_kernel<patchrt::engine_form, double>)
PATCHRT_DEVICE_ENTRY(moller_trumbore_f32, patchrt::test::triangle_form_kernel<patchrt::moller_trumbore_form, float>)
PATCHRT_DEVICE_ENTRY(moller_trumbore_f64, patchrt::test::triangle_form_kernel<patchrt::moller_trumbore_form, double>)
PATCHRT_DEVICE_ENTRY(watertight_f32, patchrt::test::triangle_form_kernel<patchrt::watertight_form, float>)
PATCHRT_DEVICE_ENTRY(watertight_f64, patchrt::test::triangle_form_kernel<patchrt::watertight_form, double>)
