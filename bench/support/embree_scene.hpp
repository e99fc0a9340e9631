// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Embree's scenes of a tessellated model, triangles or grids, with their build time and memory.

#include "answer.hpp"
#include "cpu_clock.hpp"
#include "tessellation.hpp"

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace patchrt::bench {

/// Denormals flushed to zero, as Embree asks, for as long as this lives: the setting is one of the calling thread.
class flushed_denormals {
 public:
  flushed_denormals() : saved_(_mm_getcsr()) {
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
  }
  ~flushed_denormals() { _mm_setcsr(saved_); }
  flushed_denormals(flushed_denormals const&) = delete;
  flushed_denormals& operator=(flushed_denormals const&) = delete;

 private:
  unsigned saved_;
};

enum class mesh_kind { triangles, grids };

/// One tessellation in a device of its own, so that the memory it counts is the scene's.
class embree_scene {
 public:
  embree_scene(std::span<bicubic_patch<double> const> patches, mesh_kind kind, int n, RTCBuildQuality quality,
               char const* config)
      : kind_(kind), n_(n), device_(rtcNewDevice(config), rtcReleaseDevice) {
    if (!device_) throw std::runtime_error("Embree: no device for the configuration \"" + std::string(config) + "\"");
    rtcSetDeviceMemoryMonitorFunction(
        device_.get(),
        [](void* self, ssize_t bytes, bool) {
          auto& scene = *static_cast<embree_scene*>(self);
          scene.bytes_ += bytes;
          scene.peak_bytes_ = std::max(scene.peak_bytes_, scene.bytes_);
          return true;
        },
        this);
    flushed_denormals const flushed;
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneBuildQuality(scene_.get(), quality);
    std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> const geometry(
        rtcNewGeometry(device_.get(),
                       kind == mesh_kind::triangles ? RTC_GEOMETRY_TYPE_TRIANGLE : RTC_GEOMETRY_TYPE_GRID),
        rtcReleaseGeometry);
    rtcSetGeometryBuildQuality(geometry.get(), quality);
    fill_vertices(geometry.get(), tessellation(patches, n));
    if (kind == mesh_kind::triangles) fill_triangles(geometry.get(), patches.size());
    else fill_grids(geometry.get(), patches.size());
    rtcCommitGeometry(geometry.get());
    rtcAttachGeometry(scene_.get(), geometry.get());
    build_seconds_ = process_seconds([&] { rtcCommitScene(scene_.get()); });
    if (auto const error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
      throw std::runtime_error("Embree: error " + std::to_string(int(error)) + " while building");
  }
  embree_scene(embree_scene const&) = delete;
  embree_scene& operator=(embree_scene const&) = delete;
  ~embree_scene() {
    scene_.reset();
    rtcSetDeviceMemoryMonitorFunction(device_.get(), nullptr, nullptr);
  }

  RTCScene handle() const { return scene_.get(); }
  mesh_kind kind() const { return kind_; }
  int n() const { return n_; }
  /// What the scene holds: vertices, indices and hierarchy.
  std::size_t bytes() const { return std::size_t(bytes_); }
  /// The most that it held while it was built.
  std::size_t peak_bytes() const { return std::size_t(peak_bytes_); }
  double build_seconds() const { return build_seconds_; }

  /// What Embree's hit means on the exact model.
  answer interpret(double t, unsigned primitive, float u, float v) const {
    unsigned const n = unsigned(n_);
    if (kind_ == mesh_kind::grids) return {t, double(v), double(u), std::int32_t(primitive)};
    unsigned const cell = primitive / 2, i = cell / n % n, j = cell % n;
    double const a = double(u), b = double(v);  // lower: corners (0,0) (1,0) (0,1); upper: (1,1) (0,1) (1,0)
    double const du = primitive % 2 == 0 ? a : 1 - a, dv = primitive % 2 == 0 ? b : 1 - b;
    return {t, (i + du) / n, (j + dv) / n, std::int32_t(cell / (n * n))};
  }

 private:
  static void fill_vertices(RTCGeometry geometry, tessellation const& mesh) {
    auto* const out = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    if (!out) throw std::bad_alloc();
    for (std::size_t k = 0; k < mesh.vertices.size(); ++k)
      for (int axis = 0; axis < 3; ++axis) out[3 * k + std::size_t(axis)] = component(mesh.vertices[k], axis);
  }

  void fill_triangles(RTCGeometry geometry, std::size_t patches) const {
    std::size_t const n = std::size_t(n_);
    auto* out = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                               3 * sizeof(unsigned), 2 * n * n * patches));
    if (!out) throw std::bad_alloc();
    for (std::size_t p = 0; p < patches; ++p)
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j < n; ++j) {
          unsigned const v00 = unsigned(p * (n + 1) * (n + 1) + i * (n + 1) + j), v10 = v00 + unsigned(n) + 1;
          for (unsigned const v : {v00, v10, v00 + 1, v10 + 1, v00 + 1, v10}) *out++ = v;
        }
  }

  void fill_grids(RTCGeometry geometry, std::size_t patches) const {
    auto* const out = static_cast<RTCGrid*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), patches));
    if (!out) throw std::bad_alloc();
    unsigned const edge = unsigned(n_) + 1;
    for (std::size_t p = 0; p < patches; ++p)
      out[p] = {unsigned(p) * edge * edge, edge, static_cast<unsigned short>(edge), static_cast<unsigned short>(edge)};
  }

  mesh_kind kind_;
  int n_;
  ssize_t bytes_ = 0;
  ssize_t peak_bytes_ = 0;
  double build_seconds_ = 0;
  std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device_;
  std::unique_ptr<RTCSceneTy, decltype(&rtcReleaseScene)> scene_{nullptr, rtcReleaseScene};
};

}  // namespace patchrt::bench
