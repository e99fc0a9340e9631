// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/core/box.hpp>

namespace patchrt {

/// The tensor product Bezier patch Q(u, v) = sum_ij B_i^M(u) B_j^N(v) p_ij over 0 <= u, v <= 1.
///
/// control_points[i (N + 1) + j] = p_ij: i runs along u, j along v. T is float or double for one patch, a pack for one
/// patch a lane.
template <scalar T, int M = 3, int N = 3> struct bezier_patch {
  static_assert(M >= 1 && N >= 1);
  vec3<T> control_points[(M + 1) * (N + 1)];

  PATCHRT_INLINE vec3<T>& operator()(int i, int j) { return control_points[i * (N + 1) + j]; }
  PATCHRT_INLINE vec3<T> const& operator()(int i, int j) const { return control_points[i * (N + 1) + j]; }
};

template <scalar T> using bicubic_patch = bezier_patch<T, 3, 3>;

/// A point of a surface and the two tangents there: Q, dQ/du, dQ/dv.
template <scalar T> struct surface_point {
  vec3<T> position;
  vec3<T> du;
  vec3<T> dv;
};

/// A point of a surface with all derivatives up to the second.
template <scalar T> struct surface_jet {
  vec3<T> position;
  vec3<T> du;
  vec3<T> dv;
  vec3<T> duu;
  vec3<T> duv;
  vec3<T> dvv;
};

namespace detail {

/// Weights of a Bezier curve's control points that give its point, its derivative and its second derivative; and the
/// Bernstein polynomials of one degree less, which weigh the differences of neighbours.
template <scalar T, int N> struct bernstein {
  T value[N + 1];
  T lower[N];
  T first[N + 1];
  T second[N + 1];
};

/// The Bernstein polynomials of degree N at t by B_i^n = t B_{i-1}^{n-1} + (1 - t) B_i^{n-1}, their derivatives from
/// those of one and two degrees less: at most 2 N - 1 roundings each.
/// \note Farin, Curves and Surfaces for CAGD, 5th ed., sections 5.1 and 5.3.
template <int N, scalar T> PATCHRT_INLINE bernstein<T, N> bernstein_weights(T t) {
  using L = lane_t<T>;
  T const s = T(L(1)) - t;
  T const zero = T(L(0));
  bernstein<T, N> w;
  T b[N + 1];
  T lowest[N];  // of degree N - 2
  b[0] = T(L(1));
  PATCHRT_UNROLL
  for (int n = 1; n <= N; ++n) {  // from degree n - 1 to n
    PATCHRT_UNROLL
    for (int i = 0; i < n; ++i) {
      if (n == N) w.lower[i] = b[i];
      if (n == N - 1) lowest[i] = b[i];
    }
    b[n] = t * b[n - 1];
    PATCHRT_UNROLL
    for (int i = n - 1; i > 0; --i) b[i] = fma(s, b[i], t * b[i - 1]);
    b[0] = s * b[0];
  }
  T const scale = T(L(N)), scale2 = T(L(N * (N - 1)));
  PATCHRT_UNROLL
  for (int i = 0; i <= N; ++i) {
    w.value[i] = b[i];
    w.first[i] = scale * (i == 0 ? -w.lower[0] : i == N ? w.lower[N - 1] : w.lower[i - 1] - w.lower[i]);
    T const outer = (i >= 2 ? lowest[i - 2] : zero) + (i <= N - 2 ? lowest[i] : zero);
    w.second[i] = scale2 * (0 < i && i < N && N > 1 ? fma(T(L(-2)), lowest[i - 1], outer) : outer);
  }
  return w;
}

PATCHRT_INLINE constexpr int binomial(int n, int k) {
  int b = 1;
  for (int i = 1; i <= k; ++i) b = b * (n - k + i) / i;
  return b;
}

/// sum_k w_k p_k of a row of control points.
template <int N, scalar T, scalar P> PATCHRT_INLINE vec3<T> blend(T const (&w)[N + 1], vec3<P> const* p) {
  vec3<T> s = scale(convert_vec<T>(p[0]), w[0]);
  PATCHRT_UNROLL
  for (int k = 1; k <= N; ++k) s = fma(w[k], convert_vec<T>(p[k]), s);
  return s;
}

/// acc + w p; w p for the first of a sum.
template <scalar T> PATCHRT_INLINE void accumulate(vec3<T>& acc, bool first, T w, vec3<T> const& p) {
  acc = first ? scale(p, w) : fma(w, p, acc);
}

}  // namespace detail

/// Q, Qu and Qv at (u, v), together: 44 products a coordinate of a bicubic, all but the leading ones of sums fused.
///
/// The control points are rounded to T's lanes, or spread over them: one patch in double serves a pack of parameters.
/// With m the largest |coordinate| of the patch and g(n) = n eps / (2 - n eps), the error of each coordinate is at most
///     g(3 (M + N)) m of the position,   2 M g(3 (M + N)) m of du,   2 N g(3 (M + N)) m of dv
/// for 0 <= u, v <= 1: 2 N - 1 roundings for the weights along v and N + 1 for their sum, as many with M along u (18
/// together for a bicubic); sums of |weights| 1 and twice the degree. At the corners the position is the control point
/// itself.
/// \pre No over- or underflow.
/// \note Nigam & Narayanan 2012, section 3.1: Q, Qu, Qv by one pass over the control points.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE surface_point<T> evaluate(bezier_patch<P, M, N> const& patch, T u, T v) {
  auto const wu = detail::bernstein_weights<M>(u);
  auto const wv = detail::bernstein_weights<N>(v);
  surface_point<T> s;
  PATCHRT_UNROLL
  for (int i = 0; i <= M; ++i) {
    vec3<P> const* const row = patch.control_points + i * (N + 1);
    vec3<T> const q = detail::blend<N>(wv.value, row);
    vec3<T> const dv = detail::blend<N>(wv.first, row);
    detail::accumulate(s.position, i == 0, wu.value[i], q);
    detail::accumulate(s.du, i == 0, wu.first[i], q);
    detail::accumulate(s.dv, i == 0, wu.value[i], dv);
  }
  return s;
}

/// Q alone at (u, v): the same bits as `evaluate` gives, for 20 products a coordinate of a bicubic.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE vec3<T> position(bezier_patch<P, M, N> const& patch, T u, T v) {
  auto const wu = detail::bernstein_weights<M>(u);
  auto const wv = detail::bernstein_weights<N>(v);
  vec3<T> q;
  PATCHRT_UNROLL
  for (int i = 0; i <= M; ++i)
    detail::accumulate(q, i == 0, wu.value[i], detail::blend<N>(wv.value, patch.control_points + i * (N + 1)));
  return q;
}

/// Q and all derivatives up to the second at (u, v).
///
/// Errors as those of `evaluate`, with 4 M (M - 1) for duu, 4 M N for duv and 4 N (N - 1) for dvv in the place of 2 M.
template <scalar P, int M, int N, scalar T>
PATCHRT_INLINE surface_jet<T> evaluate_curvature(bezier_patch<P, M, N> const& patch, T u, T v) {
  auto const wu = detail::bernstein_weights<M>(u);
  auto const wv = detail::bernstein_weights<N>(v);
  surface_jet<T> s;
  PATCHRT_UNROLL
  for (int i = 0; i <= M; ++i) {
    vec3<P> const* const row = patch.control_points + i * (N + 1);
    vec3<T> const q = detail::blend<N>(wv.value, row);
    vec3<T> const dv = detail::blend<N>(wv.first, row);
    vec3<T> const dvv = detail::blend<N>(wv.second, row);
    detail::accumulate(s.position, i == 0, wu.value[i], q);
    detail::accumulate(s.du, i == 0, wu.first[i], q);
    detail::accumulate(s.duu, i == 0, wu.second[i], q);
    detail::accumulate(s.dv, i == 0, wu.value[i], dv);
    detail::accumulate(s.duv, i == 0, wu.first[i], dv);
    detail::accumulate(s.dvv, i == 0, wu.value[i], dvv);
  }
  return s;
}

/// The box of the control points, which holds the patch by the convex hull property. No rounding.
///
/// NaN is never hidden: a component in which any control point is NaN is NaN in `lo` and `hi`, and such a box is empty
/// to `is_empty`. Infinite control points give infinite sides (NaN where both signs occur).
template <scalar T, int M, int N> PATCHRT_INLINE box<T> bounds(bezier_patch<T, M, N> const& patch) {
  vec3<T> const& first = patch.control_points[0];
  box<T> b{first, first};
  vec3<T> sum = first;
  for (int k = 1; k < (M + 1) * (N + 1); ++k) {
    b = merge(b, patch.control_points[k]);
    sum = sum + patch.control_points[k];
  }
  // `min` and `max` may drop a NaN; the sum keeps it, and is otherwise ordered even where it overflows.
  auto const keep = [&sum](vec3<T> const& side) {
    return vec3<T>{select(sum.x <= sum.x, side.x, sum.x), select(sum.y <= sum.y, side.y, sum.y),
                   select(sum.z <= sum.z, side.z, sum.z)};
  };
  return {keep(b.lo), keep(b.hi)};
}

}  // namespace patchrt
