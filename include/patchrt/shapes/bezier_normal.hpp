// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/twin_planes.hpp>
#include <patchrt/shapes/bezier_split.hpp>

#include <limits>

namespace patchrt {

namespace detail {

/// Qu / M and Qv / N at a point.
template <scalar T> struct tangents {
  vec3<T> du;
  vec3<T> dv;
};

/// The tangents by sums over differences of neighbouring control points: exactly zero where those are equal and
/// relatively exact beside such places, where `evaluate` has but absolute accuracy.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE tangents<T> tangents_by_differences(bezier_patch<P, M, N> const& patch, T u, T v) {
  auto const wu = bernstein_weights<M>(u);
  auto const wv = bernstein_weights<N>(v);
  auto const point = [&patch](int i, int j) { return convert_vec<T>(patch(i, j)); };
  tangents<T> s;
  for (int i = 0; i <= M; ++i) {
    vec3<T> dv;
    for (int j = 0; j < N; ++j) accumulate(dv, j == 0, wv.lower[j], point(i, j + 1) - point(i, j));
    accumulate(s.dv, i == 0, wu.value[i], dv);
  }
  for (int i = 0; i < M; ++i) {
    vec3<T> du;
    for (int j = 0; j <= N; ++j) accumulate(du, j == 0, wv.value[j], point(i + 1, j) - point(i, j));
    accumulate(s.du, i == 0, wu.lower[i], du);
  }
  return s;
}

template <scalar T> PATCHRT_INLINE T largest_component(vec3<T> const& a) {
  return max(abs(a.x), max(abs(a.y), abs(a.z)));
}

/// Where a x b says something of the plane of a and b: its length stands out of its rounding errors.
template <scalar T> PATCHRT_INLINE mask_t<T> is_cross_significant(vec3<T> const& a, vec3<T> const& b, T cross_squared) {
  using L = lane_t<T>;
  constexpr L sine = L(64) * std::numeric_limits<L>::epsilon();
  constexpr L least = std::numeric_limits<L>::min() / (sine * sine);
  return T(sine * sine) * dot(a, a) * dot(b, b) < cross_squared && T(least) < cross_squared &&
         cross_squared <= T(std::numeric_limits<L>::max());
}

/// The patch seen from one of its points: Q(u, v) over x, y in [0, 1] with that point at x = y = 0 and both x and y
/// growing towards the farther sides of the patch, moved to the origin and scaled to size 1.
template <scalar T, int M, int N> struct corner_view {
  bezier_patch<T, M, N> net;
  mask_t<T> mirrored;
};

template <scalar T, scalar P, int M, int N>
PATCHRT_HD corner_view<T, M, N> view_from(bezier_patch<P, M, N> const& patch, T u, T v) {
  using L = lane_t<T>;
  constexpr int count = (M + 1) * (N + 1);
  T const zero(L(0)), half(L(0.5)), quarter(L(0.25));
  bezier_patch<T, M, N> net;
  T size = zero;
  for (int k = 0; k < count; ++k) {  // quarters, so that no difference overflows
    net.control_points[k] =
        quarter * convert_vec<T>(patch.control_points[k]) - quarter * convert_vec<T>(patch.control_points[0]);
    size = max(largest_component(net.control_points[k]), size);
  }
  size = select(zero < size, size, T(L(1)));
  for (int k = 0; k < count; ++k) net.control_points[k] = net.control_points[k] / vec3<T>{size, size, size};

  corner_view<T, M, N> c;
  auto const low_u = u <= half, low_v = v <= half;
  auto const along_u = split_u(net, u);
  for (int i = 0; i <= M; ++i) {
    for (int j = 0; j <= N; ++j) net(i, j) = select(low_u, along_u.second(i, j), along_u.first(M - i, j));
  }
  auto const along_v = split_v(net, v);
  for (int i = 0; i <= M; ++i) {
    for (int j = 0; j <= N; ++j) c.net(i, j) = select(low_v, along_v.second(i, j), along_v.first(i, N - j));
  }
  c.mirrored = (low_u && !low_v) || (low_v && !low_u);
  return c;
}

/// The unit vector that Qu x Qv / |Qu x Qv| tends to on the way along x = y of `view_from`: the direction of the first
/// coefficient of (Qu x Qv)(s, s) that stands out of its rounding errors; else a unit vector across the tangent; else
/// z.
template <scalar P, int M, int N, scalar T>
PATCHRT_HD vec3<T> limit_normal(bezier_patch<P, M, N> const& patch, T u, T v) {
  using L = lane_t<T>;
  constexpr int orders = M + N;
  T const zero(L(0)), one(L(1));
  auto const [net, mirrored] = view_from<T>(patch, u, v);

  bezier_patch<T, M, N> d = net;  // forward differences: p_ij becomes that of order i in u and j in v at the corner
  for (int n = 1; n <= M; ++n) {
    for (int i = M; i >= n; --i) {
      for (int j = 0; j <= N; ++j) d(i, j) = d(i, j) - d(i - 1, j);
    }
  }
  for (int n = 1; n <= N; ++n) {
    for (int j = N; j >= n; --j) {
      for (int i = 0; i <= M; ++i) d(i, j) = d(i, j) - d(i, j - 1);
    }
  }
  // Q(x, y) = sum_kl a_kl x^k y^l, so Qx(s, s) = sum_m s^m sum_{k + l = m + 1} k a_kl, and Qy with l for k. A
  // difference of order k + l adds 2^(k + l) coordinates up to 1, each with up to M + N + 3 roundings of its own, in k
  // + l steps.
  vec3<T> du[orders], dv[orders];
  L du_error[orders], dv_error[orders];
  for (int m = 0; m < orders; ++m) {
    du[m] = dv[m] = vec3<T>{zero, zero, zero};
    du_error[m] = dv_error[m] = L(0);
    for (int k = 0; k <= M; ++k) {
      int const l = m + 1 - k;
      if (l < 0 || l > N) continue;
      L const times = L(binomial(M, k) * binomial(N, l));
      L const error = times * L(1 << (k + l)) * L(2 * (M + N + 3)) * std::numeric_limits<L>::epsilon();
      du[m] = fma(T(times * L(k)), d(k, l), du[m]);
      dv[m] = fma(T(times * L(l)), d(k, l), dv[m]);
      du_error[m] += error * L(k);
      dv_error[m] += error * L(l);
    }
  }

  vec3<T> normal = cross(du[0], dv[0]);
  auto found = is_cross_significant(du[0], dv[0], dot(normal, normal));
  for (int r = 1; r < 2 * orders - 1 && !all_of(found); ++r) {
    vec3<T> n{zero, zero, zero};
    T error = zero;
    for (int i = r < orders ? 0 : r - orders + 1; i <= r && i < orders; ++i) {
      int const j = r - i;
      n = n + cross(du[i], dv[j]);
      error = error + fma(largest_component(du[i]), T(L(2) * dv_error[j]),
                          fma(largest_component(dv[j]), T(L(2) * du_error[i]), T(L(2) * du_error[i] * dv_error[j])));
    }
    auto const significant = error < largest_component(n);
    normal = select(found, normal, n);
    found = found || significant;
  }
  normal = select(mirrored, -normal, normal);

  auto curve = found;
  for (int m = 0; m < orders && !all_of(curve); ++m) {
    T const a = largest_component(du[m]), b = largest_component(dv[m]);
    vec3<T> across, unused;
    plane_normals(select(b < a, du[m], dv[m]), across, unused);
    normal = select(curve, normal, across);
    curve = curve || T(du_error[m]) < a || T(dv_error[m]) < b;
  }
  normal = select(curve, normal, vec3<T>{zero, zero, one});
  T const scale = one / largest_component(normal);
  normal = scale * normal;
  return (one / sqrt(dot(normal, normal))) * normal;
}

}  // namespace detail

/// The unit normal Qu x Qv / |Qu x Qv| at (u, v): exact up to rounding, and never NaN where the control points are
/// finite.
///
/// Where Qu x Qv vanishes (its sine against Qu and Qv is below 64 eps: collapsed edges, doubled control points at
/// corners, collinear tangents) it is the limit of the unit normal on the way from (u, v) into the patch along the
/// diagonal of the parameters, towards the farther sides; at a collapsed edge that is Quv x Qv, whatever the way. A
/// patch collapsed to a curve gives a unit vector across its tangent, one collapsed to a point gives z.
/// \return Within g(3 (M + N)) (a/|Qu| + b/|Qv|) / sin(Qu, Qv) + 4 eps of the exact normal, with g as in `evaluate` and a, b
///         the same sums as Qu, Qv over the lengths of the differences of control points: a/|Qu| = b/|Qv| = 1 up to
///         curvature.
/// \note Farin, Curves and Surfaces for CAGD, 5th ed., chapter 14 (p. 262, degenerate patches) tells when the normal
///       exists; the coefficients of Qu x Qv along a line give it in every one of those cases, and a value elsewhere.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE vec3<T> normal(bezier_patch<P, M, N> const& patch, T u, T v) {
  auto const [du, dv] = detail::tangents_by_differences(patch, u, v);
  vec3<T> const n = cross(du, dv);
  T const squared = dot(n, n);
  auto const plain = detail::is_cross_significant(du, dv, squared);
  vec3<T> const unit = (T(lane_t<T>(1)) / sqrt(squared)) * n;
  if (all_of(plain)) return unit;
  return select(plain, unit, detail::limit_normal(patch, u, v));
}

}  // namespace patchrt
