// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Embree's scenes of triangles or of spheres, with their build time and memory.

#include "answer.hpp"
#include "cpu_clock.hpp"
#include "embree_scene.hpp"

#include <patchrt/shapes/sphere.hpp>
#include <patchrt/shapes/triangle.hpp>

#include <memory>
#include <new>
#include <span>

namespace patchrt::bench {

/// Shapes in a device of its own, so that the memory it counts is theirs.
class embree_shapes {
 public:
  /// Vertices are shared as they are in an indexed mesh.
  embree_shapes(std::span<vec3<float> const> vertices, std::span<std::array<std::uint32_t, 3> const> triangles,
                bool robust)
      : embree_shapes(RTC_GEOMETRY_TYPE_TRIANGLE, robust) {
    auto* const points = buffer<vec3<float>>(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, vertices.size());
    std::copy(vertices.begin(), vertices.end(), points);
    auto* const indices =
        buffer<std::array<std::uint32_t, 3>>(RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, triangles.size());
    std::copy(triangles.begin(), triangles.end(), indices);
    build();
  }
  explicit embree_shapes(std::span<sphere<float> const> spheres)
      : embree_shapes(RTC_GEOMETRY_TYPE_SPHERE_POINT, false) {
    auto* const points = buffer<sphere<float>>(RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, spheres.size());
    std::copy(spheres.begin(), spheres.end(), points);
    build();
  }
  embree_shapes(embree_shapes const&) = delete;
  embree_shapes& operator=(embree_shapes const&) = delete;
  ~embree_shapes() {
    geometry_.reset();
    scene_.reset();
    rtcSetDeviceMemoryMonitorFunction(device_.get(), nullptr, nullptr);
  }

  RTCScene handle() const { return scene_.get(); }
  std::size_t bytes() const { return std::size_t(bytes_); }
  double build_seconds() const { return build_seconds_; }
  answer interpret(double t, unsigned primitive, float u, float v) const {
    return {t, double(u), double(v), std::int32_t(primitive)};
  }

 private:
  embree_shapes(RTCGeometryType type, bool robust) : device_(rtcNewDevice("threads=1"), rtcReleaseDevice) {
    if (!device_) throw std::runtime_error("Embree: no device");
    rtcSetDeviceMemoryMonitorFunction(
        device_.get(),
        [](void* self, ssize_t bytes, bool) {
          static_cast<embree_shapes*>(self)->bytes_ += bytes;
          return true;
        },
        this);
    scene_.reset(rtcNewScene(device_.get()));
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_MEDIUM);
    rtcSetSceneFlags(scene_.get(), robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    geometry_.reset(rtcNewGeometry(device_.get(), type));
  }

  template <class Record> Record* buffer(RTCBufferType type, RTCFormat format, std::size_t count) {
    void* const to = rtcSetNewGeometryBuffer(geometry_.get(), type, 0, format, sizeof(Record), count);
    if (!to) throw std::bad_alloc();
    return static_cast<Record*>(to);
  }

  void build() {
    flushed_denormals const flushed;
    rtcCommitGeometry(geometry_.get());
    rtcAttachGeometry(scene_.get(), geometry_.get());
    build_seconds_ = process_seconds([&] { rtcCommitScene(scene_.get()); });
    if (auto const error = rtcGetDeviceError(device_.get()); error != RTC_ERROR_NONE)
      throw std::runtime_error("Embree: error " + std::to_string(int(error)) + " while building");
  }

  ssize_t bytes_ = 0;
  double build_seconds_ = 0;
  std::unique_ptr<RTCDeviceTy, decltype(&rtcReleaseDevice)> device_;
  std::unique_ptr<RTCSceneTy, decltype(&rtcReleaseScene)> scene_{nullptr, rtcReleaseScene};
  std::unique_ptr<RTCGeometryTy, decltype(&rtcReleaseGeometry)> geometry_{nullptr, rtcReleaseGeometry};
};

}  // namespace patchrt::bench
