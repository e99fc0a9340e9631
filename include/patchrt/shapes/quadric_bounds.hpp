// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/clipped_quadric.hpp>

#include <cmath>
#include <limits>

namespace patchrt {

namespace detail {

/// Where coordinates in space, value(x) = along.x, may have their extremes on a quadric in a box: where planes of one
/// value touch the quadric, and its sections by the box's faces and edges; and at corners.
///
/// Planes l.x = w that touch p.Qp + 2 b.p + c = 0 are those with pi.(adj M)pi = 0, pi = (l, -w), where M is the matrix
/// of the form, and they touch at (adj M)pi, both in homogeneous coordinates. This holds for sections as well, for
/// paraboloids, which have no centre, and for the apex of a cone. Where adj M = 0 (cylinders, planes) extremes lie on
/// faces or edges too.
class quadric_extremes {
 public:
  /// Of all candidates: least and greatest value, and the greatest sum of its terms' magnitudes.
  struct range {
    long double lo = std::numeric_limits<long double>::infinity();
    long double hi = -std::numeric_limits<long double>::infinity();
    long double reach = 0;
  };

  quadric_extremes(quadric<double> const& q, box<double> const& clip, bool capped, vec3<double> const (&along)[3])
      : matrix_{{q.squares.x, q.products.z, q.products.y, q.linear.x},
                {q.products.z, q.squares.y, q.products.x, q.linear.y},
                {q.products.y, q.products.x, q.squares.z, q.linear.z},
                {q.linear.x, q.linear.y, q.linear.z, q.constant}},
        clip_(clip) {
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < 3; ++k) along_[a][k] = along[a][k];
    int const all[3] = {0, 1, 2};
    long double at[3] = {};
    touch<3>(all, at);
    for (int k = 0; k < 3; ++k) {
      for (int side = 0; side < 2; ++side) {
        at[k] = plane(k, side);
        int const i = (k + 1) % 3, j = (k + 2) % 3, free[2] = {i, j};
        touch<2>(free, at);
        for (int other = 0; other < 2; ++other) {  // the edges along i; those along j are of another face
          at[j] = plane(j, other);
          cross(i, at);
        }
      }
    }
    for (int corner = 0; corner < 8; ++corner) {
      for (int k = 0; k < 3; ++k) at[k] = plane(k, corner >> k & 1);
      long double terms = 0;
      long double const f = value(at, terms);
      if (f <= tolerance * terms && (capped || f >= -tolerance * terms)) add(at);
    }
  }

  range const& operator[](int a) const { return range_[a]; }
  /// The greatest coordinate of a candidate.
  long double farthest() const { return farthest_; }

 private:
  static constexpr long double tolerance = 1e-12L;
  long double matrix_[4][4];
  box<double> clip_;
  long double along_[3][3];
  range range_[3];
  long double farthest_ = 0;

  long double plane(int k, int side) const { return side ? clip_.hi[k] : clip_.lo[k]; }

  long double value(long double const (&x)[3], long double& terms) const {
    long double f = 0;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        long double const term = (i < 3 ? x[i] : 1) * matrix_[i][j] * (j < 3 ? x[j] : 1);
        f += term;
        terms += std::fabs(term);
      }
    }
    return f;
  }

  /// Candidates that rounding may have moved out of the box count.
  void add(long double const (&x)[3]) {
    long double const size = std::fmax(std::fabs(x[0]), std::fmax(std::fabs(x[1]), std::fabs(x[2])));
    if (!std::isfinite(size)) return;
    for (int k = 0; k < 3; ++k)
      if (!(clip_.lo[k] - tolerance * size <= x[k] && x[k] <= clip_.hi[k] + tolerance * size)) return;
    farthest_ = std::fmax(farthest_, size);
    for (int a = 0; a < 3; ++a) {
      long double w = 0, reach = 0;
      for (int k = 0; k < 3; ++k) {
        w += along_[a][k] * x[k];
        reach += std::fabs(along_[a][k] * x[k]);
      }
      range_[a].lo = std::fmin(range_[a].lo, w);
      range_[a].hi = std::fmax(range_[a].hi, w);
      range_[a].reach = std::fmax(range_[a].reach, reach);
    }
  }

  /// The form as one of the N coordinates `free`, the others fixed at `at`; its last row is that of the constant 1.
  template <int N>
  void section(int const (&free)[N], long double const (&at)[3], long double (&m)[N + 1][N + 1]) const {
    long double fixed[4] = {at[0], at[1], at[2], 1}, rest[4] = {};
    for (int const k : free) fixed[k] = 0;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) rest[i] += matrix_[i][j] * fixed[j];
    m[N][N] = 0;
    for (int j = 0; j < 4; ++j) m[N][N] += rest[j] * fixed[j];
    for (int i = 0; i < N; ++i) {
      m[i][N] = m[N][i] = rest[free[i]];
      for (int j = 0; j < N; ++j) m[i][j] = matrix_[free[i]][free[j]];
    }
  }

  template <int N> static long double determinant(long double const (&m)[N][N]) {
    if constexpr (N == 1) {
      return m[0][0];
    } else {
      long double d = 0;
      for (int j = 0; j < N; ++j) d += (j % 2 ? -1 : 1) * m[0][j] * minor_of(m, 0, j);
      return d;
    }
  }
  template <int N> static long double minor_of(long double const (&m)[N][N], int row, int column) {
    long double rest[N - 1][N - 1];
    for (int i = 0; i < N - 1; ++i)
      for (int j = 0; j < N - 1; ++j) rest[i][j] = m[i + (i >= row)][j + (j >= column)];
    return determinant<N - 1>(rest);
  }

  /// Where planes of one value touch the section.
  template <int N> void touch(int const (&free)[N], long double const (&at)[3]) {
    long double m[N + 1][N + 1], adjugate[N + 1][N + 1], largest = 0;
    section<N>(free, at, m);
    for (auto const& row : m)
      for (long double const x : row) largest = std::fmax(largest, std::fabs(x));
    if (!(largest > 0)) return;
    for (auto& row : m)
      for (long double& x : row) x /= largest;
    for (int i = 0; i <= N; ++i)
      for (int j = 0; j <= i; ++j) adjugate[i][j] = adjugate[j][i] = ((i + j) % 2 ? -1 : 1) * minor_of<N + 1>(m, i, j);
    // Of a section that is all of one value, the other two give the points.
    for (auto const& along : along_) {
      long double towards[N];
      for (int i = 0; i < N; ++i) towards[i] = along[free[i]];
      touch_planes<N>(free, at, adjugate, towards);
    }
    long double x[3] = {at[0], at[1], at[2]}, terms = 0;
    for (int i = 0; i < N; ++i) x[free[i]] = adjugate[i][N] / adjugate[N][N];
    if (std::fabs(value(x, terms)) <= tolerance * terms) add(x);  // an apex, or where two lines meet
  }

  /// The points of planes towards.x = w that touch the section with this adjugate.
  template <int N>
  void touch_planes(int const (&free)[N], long double const (&at)[3], long double const (&adjugate)[N + 1][N + 1],
                    long double const (&towards)[N]) {
    long double h = 0, c = 0, roots[2];
    for (int i = 0; i < N; ++i) {
      h -= adjugate[N][i] * towards[i];
      for (int j = 0; j < N; ++j) c += towards[i] * adjugate[i][j] * towards[j];
    }
    int const count = solve(adjugate[N][N], h, c, roots);
    for (int root = 0; root < count; ++root) {
      long double point[N + 1], x[3] = {at[0], at[1], at[2]};
      for (int i = 0; i <= N; ++i) {
        point[i] = -adjugate[i][N] * roots[root];
        for (int j = 0; j < N; ++j) point[i] += adjugate[i][j] * towards[j];
      }
      for (int i = 0; i < N; ++i) x[free[i]] = point[i] / point[N];
      add(x);
    }
  }

  /// Where the quadric crosses an edge along axis k.
  void cross(int k, long double const (&at)[3]) {
    int const free[1] = {k};
    long double m[2][2], roots[2];
    section<1>(free, at, m);
    int const count = solve(m[0][0], m[0][1], m[1][1], roots);
    for (int root = 0; root < count; ++root) {
      long double x[3] = {at[0], at[1], at[2]};
      x[k] = roots[root];
      add(x);
    }
  }

  /// Roots of a t^2 + 2 h t + c, a double one where rounding cannot tell.
  static int solve(long double a, long double h, long double c, long double (&roots)[2]) {
    long double const d = h * h - a * c;
    if (!(d >= -tolerance * (h * h + std::fabs(a * c)))) return 0;
    long double const q = -(h + std::copysign(std::sqrt(std::fmax(d, 0.L)), h));
    int count = 0;
    if (a != 0) roots[count++] = q / a;
    if (q != 0) roots[count++] = c / q;
    return count;
  }
};

}  // namespace detail

/// The box of a clipped quadric in space: exact but for rounding, of a few eps of its sides and place, for surfaces of
/// any kind under any map; infinite where the surface goes on for ever. Empty where `clip` holds nothing of it.
/// \throws std::invalid_argument where `rows` are singular or not finite.
template <std::floating_point T> box<T> bounds(clipped_quadric<T> const& surface) {
  auto const s = convert_quadric<double>(surface);
  affine<double> const place = to_world(s);
  vec3<double> const normal = cross(place.y, place.z);
  double const lost = dot(absolute(place.x), absolute(normal)) / abs(dot(place.x, normal));

  // Infinite sides are tried at two distances: what changes from one to the other a little has an end, else it has
  // none.
  double size = 0, most = 0;
  bool is_finite = true;
  auto const& q = s.form;
  for (int k = 0; k < 3; ++k) {
    most = max(most, max(abs(q.squares[k]), abs(q.products[k])));
    for (double const side : {s.clip.lo[k], s.clip.hi[k]}) {
      if (std::isinf(side)) is_finite = false;
      else size = max(size, abs(side));
    }
  }
  double const linear = sum_of_magnitudes(q.linear);
  if (most > 0) size = max(size, max(std::sqrt(abs(q.constant) / most), linear / most));
  if (linear > 0) size = max(size, abs(q.constant) / linear);
  if (size == 0) size = 1;
  auto const limited = [&](double far) {
    box<double> b;
    for (int k = 0; k < 3; ++k) b.lo[k] = max(s.clip.lo[k], -far), b.hi[k] = min(s.clip.hi[k], far);
    return b;
  };
  vec3<double> const along[3] = {
      {place.x.x, place.y.x, place.z.x}, {place.x.y, place.y.y, place.z.y}, {place.x.z, place.y.z, place.z.z}};
  detail::quadric_extremes const near(q, limited(0x1p24 * size), s.capped, along);
  is_finite = is_finite || near.farthest() < 0x1p20L * size;  // an ellipsoid, say
  detail::quadric_extremes const far =
      is_finite ? near : detail::quadric_extremes(q, limited(0x1p26 * size), s.capped, along);

  box<T> r;
  for (int k = 0; k < 3; ++k) {
    auto const &n = near[k], &f = far[k];
    if (!(f.lo <= f.hi)) return box<T>::empty();
    long double const below = std::fmax(n.lo - f.lo, 0.L), above = std::fmax(f.hi - n.hi, 0.L);
    long double const scale = size * sum_of_magnitudes(along[k]);
    auto const grows = [&](long double by, long double from) { return by > 1e-3L * std::fmax(std::fabs(from), scale); };
    double const slack = 32 * std::numeric_limits<double>::epsilon() * lost;
    auto const padding = [&](long double by) {
      return 2 * by + slack * (std::fabs(static_cast<long double>(s.centre[k])) + f.reach);
    };
    constexpr T inf = std::numeric_limits<T>::infinity();
    long double const lo = s.centre[k] + f.lo - padding(below), hi = s.centre[k] + f.hi + padding(above);
    auto const rounding = [](long double end) {  // to T
      return std::fabs(end) * std::numeric_limits<T>::epsilon() + std::numeric_limits<T>::denorm_min();
    };
    r.lo[k] = grows(below, n.lo) ? -inf : static_cast<T>(lo - rounding(lo));
    r.hi[k] = grows(above, n.hi) ? inf : static_cast<T>(hi + rounding(hi));
  }
  return r;
}

}  // namespace patchrt
