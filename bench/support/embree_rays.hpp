// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays in Embree's own layouts, and its calls over lists of them.

#include "embree_scene.hpp"

#include <limits>

namespace patchrt::bench {

/// Embree's structure for N rays, and its calls.
template <int N> struct embree_packet;
template <> struct embree_packet<1> {
  using type = RTCRayHit;
  static void intersect(RTCScene scene, RTCIntersectContext* context, type& p, int const*) {
    rtcIntersect1(scene, context, &p);
  }
  static void occluded(RTCScene scene, RTCIntersectContext* context, type& p, int const*) {
    rtcOccluded1(scene, context, &p.ray);
  }
};
template <> struct embree_packet<8> {
  using type = RTCRayHit8;
  static void intersect(RTCScene scene, RTCIntersectContext* context, type& p, int const* valid) {
    rtcIntersect8(valid, scene, context, &p);
  }
  static void occluded(RTCScene scene, RTCIntersectContext* context, type& p, int const* valid) {
    rtcOccluded8(valid, scene, context, &p.ray);
  }
};
template <> struct embree_packet<16> {
  using type = RTCRayHit16;
  static void intersect(RTCScene scene, RTCIntersectContext* context, type& p, int const* valid) {
    rtcIntersect16(valid, scene, context, &p);
  }
  static void occluded(RTCScene scene, RTCIntersectContext* context, type& p, int const* valid) {
    rtcOccluded16(valid, scene, context, &p.ray);
  }
};

namespace detail {
template <class F> F& lane(F& field, int) { return field; }
template <class F, std::size_t K> F& lane(F (&field)[K], int i) { return field[i]; }
template <class F> F const& lane(F const& field, int) { return field; }
template <class F, std::size_t K> F const& lane(F const (&field)[K], int i) { return field[i]; }
}  // namespace detail

/// A list of rays in packets of N, as Embree reads them, for nearest hits or for any. A `Scene` has `handle()` and
/// `interpret()`, as `embree_scene` has.
/// \pre t_max of every ray is infinite.
template <int N> class embree_rays {
 public:
  using packet = typename embree_packet<N>::type;

  embree_rays(std::span<ray<double> const> rays, query what)
      : rays_(rays), what_(what), packets_((rays.size() + N - 1) / N) {
    for (std::size_t k = 0; k < packets_.size(); ++k) fill(packets_[k], k);
  }

  /// Hits into the packets, which are as they were built but for t_max and the hits of the last call, set here anew.
  template <class Scene> void trace_prepared(Scene const& scene, RTCIntersectContextFlags flags) {
    flushed_denormals const flushed;
    RTCIntersectContext context = make_context(flags);
    alignas(64) int valid[16];
    for (std::size_t k = 0; k < packets_.size(); ++k) {
      packet& p = packets_[k];
      int const count = lanes_of(k);
      for (int i = 0; i < N; ++i) {
        detail::lane(p.ray.tfar, i) = std::numeric_limits<float>::infinity();
        detail::lane(p.hit.geomID, i) = RTC_INVALID_GEOMETRY_ID;
        valid[i] = i < count ? -1 : 0;
      }
      call(scene, context, p, valid);
    }
  }

  /// The same from the list of double rays and to a list of answers: packets are filled and read out as they are
  /// traced.
  template <class Scene>
  void trace_filled(Scene const& scene, RTCIntersectContextFlags flags, std::span<answer> answers) const {
    flushed_denormals const flushed;
    RTCIntersectContext context = make_context(flags);
    alignas(64) int valid[16];
    packet p;
    for (std::size_t k = 0; k < packets_.size(); ++k) {
      int const count = lanes_of(k);
      for (int i = 0; i < N; ++i) valid[i] = i < count ? -1 : 0;
      fill(p, k);
      call(scene, context, p, valid);
      for (int i = 0; i < count; ++i) answers[k * N + std::size_t(i)] = read(scene, p, i);
    }
  }

  /// The hits that the last `trace_prepared` left.
  template <class Scene> std::vector<answer> answers(Scene const& scene) const {
    std::vector<answer> all;
    all.reserve(rays_.size());
    for (std::size_t k = 0; k < packets_.size(); ++k)
      for (int i = 0; i < lanes_of(k); ++i) all.push_back(read(scene, packets_[k], i));
    return all;
  }

 private:
  static RTCIntersectContext make_context(RTCIntersectContextFlags flags) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = flags;
    return context;
  }

  template <class Scene>
  void call(Scene const& scene, RTCIntersectContext& context, packet& p, int const* valid) const {
    if (what_ == query::nearest) embree_packet<N>::intersect(scene.handle(), &context, p, valid);
    else embree_packet<N>::occluded(scene.handle(), &context, p, valid);
  }

  int lanes_of(std::size_t k) const { return int(std::min(std::size_t(N), rays_.size() - k * N)); }

  /// Lanes past the end of the list repeat its last ray.
  void fill(packet& p, std::size_t k) const {
    using detail::lane;
    for (int i = 0; i < N; ++i) {
      ray<double> const& r = rays_[std::min(k * N + std::size_t(i), rays_.size() - 1)];
      lane(p.ray.org_x, i) = float(r.origin.x);
      lane(p.ray.org_y, i) = float(r.origin.y);
      lane(p.ray.org_z, i) = float(r.origin.z);
      lane(p.ray.dir_x, i) = float(r.direction.x);
      lane(p.ray.dir_y, i) = float(r.direction.y);
      lane(p.ray.dir_z, i) = float(r.direction.z);
      lane(p.ray.tnear, i) = float(r.t_min);
      lane(p.ray.tfar, i) = float(r.t_max);
      lane(p.ray.time, i) = 0;
      lane(p.ray.mask, i) = ~0u;
      lane(p.ray.id, i) = 0;
      lane(p.ray.flags, i) = 0;
      lane(p.hit.geomID, i) = RTC_INVALID_GEOMETRY_ID;
      lane(p.hit.instID[0], i) = RTC_INVALID_GEOMETRY_ID;
    }
  }

  template <class Scene> answer read(Scene const& scene, packet const& p, int i) const {
    using detail::lane;
    if (what_ == query::any) return lane(p.ray.tfar, i) < 0 ? answer{0, 0, 0, 0} : miss();
    if (lane(p.hit.geomID, i) == RTC_INVALID_GEOMETRY_ID) return miss();
    return scene.interpret(double(lane(p.ray.tfar, i)), lane(p.hit.primID, i), lane(p.hit.u, i), lane(p.hit.v, i));
  }

  std::span<ray<double> const> rays_;
  query what_;
  std::vector<packet> packets_;
};

}  // namespace patchrt::bench
