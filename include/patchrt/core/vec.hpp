// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Fused products over glm's vector storage. glm supplies the type, patchrt the arithmetic: glm::dot asks for an IEC
/// 559 scalar and does not fuse.

#include <patchrt/core/scalar.hpp>

#if defined(__CUDACC__)
#  pragma nv_diagnostic push
#  pragma nv_diag_suppress 20012  // glm marks defaulted members __host__ __device__
#endif
#include <glm/vec3.hpp>
#if defined(__CUDACC__)
#  pragma nv_diagnostic pop
#endif

namespace patchrt {

template <class T> using vec3 = glm::vec<3, T, glm::defaultp>;

/// s v, a + b and a - b, inlined whatever T is: compilers leave glm's operators out of line where T is a pack.
template <class T> PATCHRT_INLINE vec3<T> scale(vec3<T> const& v, T s) { return {v.x * s, v.y * s, v.z * s}; }
template <class T> PATCHRT_INLINE vec3<T> sum(vec3<T> const& a, vec3<T> const& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class T> PATCHRT_INLINE vec3<T> difference(vec3<T> const& a, vec3<T> const& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

/// Component-wise |v|.
template <scalar T> PATCHRT_INLINE vec3<T> absolute(vec3<T> const& v) { return {abs(v.x), abs(v.y), abs(v.z)}; }

/// |v.x| + |v.y| + |v.z|.
template <scalar T> PATCHRT_INLINE T sum_of_magnitudes(vec3<T> const& v) { return abs(v.x) + abs(v.y) + abs(v.z); }

/// a . b with three roundings.
template <scalar T> PATCHRT_INLINE T dot(vec3<T> const& a, vec3<T> const& b) {
  return fma(a.x, b.x, fma(a.y, b.y, a.z * b.z));
}

/// a x b, each component within 1.5 ulp.
template <scalar T> PATCHRT_INLINE vec3<T> cross(vec3<T> const& a, vec3<T> const& b) {
  return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
          difference_of_products(a.x, b.y, a.y, b.x)};
}

/// a x b by the fewest operations: each component within u (p + |a x b|), p the second of its two products.
template <scalar T> PATCHRT_INLINE vec3<T> fused_cross(vec3<T> const& a, vec3<T> const& b) {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}

/// s a + b, fused.
template <scalar T> PATCHRT_INLINE vec3<T> fma(T s, vec3<T> const& a, vec3<T> const& b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}

/// Component-wise `select`.
template <scalar T> PATCHRT_INLINE vec3<T> select(mask_t<T> m, vec3<T> const& a, vec3<T> const& b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

/// v with every component converted; one value a lane becomes the same value in every lane.
template <class To, class From> PATCHRT_INLINE vec3<To> convert_vec(vec3<From> const& v) {
  return {convert<To>(v.x), convert<To>(v.y), convert<To>(v.z)};
}

/// Component a (0, 1, 2) without a run-time index into memory.
template <class T> PATCHRT_INLINE T component(vec3<T> const& v, int a) { return a == 0 ? v.x : a == 1 ? v.y : v.z; }

}  // namespace patchrt
