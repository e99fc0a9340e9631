// SPDX-License-Identifier: MIT
#include "polish.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace patchrt::examples {

namespace {

using real = long double;
using vec = std::array<real, 3>;

real norm(vec const& a) { return std::hypot(a[0], a[1], a[2]); }
vec mix(vec const& a, vec const& b, real t) {
  vec r;
  for (std::size_t k = 0; k < 3; ++k) r[k] = (1 - t) * a[k] + t * b[k];
  return r;
}

struct curve_point {
  vec position, tangent;
};

/// De Casteljau's algorithm.
curve_point at(std::array<vec, 4> p, real t) {
  for (std::size_t i = 0; i < 3; ++i) p[i] = mix(p[i], p[i + 1], t);
  for (std::size_t i = 0; i < 2; ++i) p[i] = mix(p[i], p[i + 1], t);
  vec tangent;
  for (std::size_t k = 0; k < 3; ++k) tangent[k] = 3 * (p[1][k] - p[0][k]);
  return {mix(p[0], p[1], t), tangent};
}

struct patch_point {
  vec position, du, dv;
};

patch_point at(bicubic_patch<double> const& patch, real u, real v) {
  std::array<vec, 4> points, tangents;
  for (int i = 0; i < 4; ++i) {
    std::array<vec, 4> row;
    for (int j = 0; j < 4; ++j) row[std::size_t(j)] = {patch(i, j).x, patch(i, j).y, patch(i, j).z};
    auto const c = at(row, v);
    points[std::size_t(i)] = c.position;
    tangents[std::size_t(i)] = c.tangent;
  }
  auto const c = at(points, u);
  return {c.position, c.tangent, at(tangents, u).position};
}

/// x of sum_k x_k column_k = b by Gauss' algorithm with full pivoting; unknowns without a pivot are 0.
vec solve(std::array<vec, 3> columns, vec b) {
  std::array<std::size_t, 3> order{0, 1, 2};
  real first_pivot = 0;
  std::size_t rank = 0;
  for (; rank < 3; ++rank) {
    std::size_t row = rank, column = rank;
    for (std::size_t c = rank; c < 3; ++c)
      for (std::size_t r = rank; r < 3; ++r)
        if (std::abs(columns[c][r]) > std::abs(columns[column][row])) column = c, row = r;
    real const pivot = std::abs(columns[column][row]);
    if (rank == 0) first_pivot = pivot;
    if (!(pivot > 1e-15L * first_pivot)) break;
    std::swap(columns[rank], columns[column]);
    std::swap(order[rank], order[column]);
    for (auto& c : columns) std::swap(c[rank], c[row]);
    std::swap(b[rank], b[row]);
    for (std::size_t r = rank + 1; r < 3; ++r) {
      real const factor = columns[rank][r] / columns[rank][rank];
      for (std::size_t c = rank; c < 3; ++c) columns[c][r] -= factor * columns[c][rank];
      b[r] -= factor * b[rank];
    }
  }
  vec y{0, 0, 0}, x;
  for (std::size_t r = rank; r-- > 0;) {
    real sum = b[r];
    for (std::size_t c = r + 1; c < rank; ++c) sum -= columns[c][r] * y[c];
    y[r] = sum / columns[r][r];
  }
  for (std::size_t c = 0; c < 3; ++c) x[order[c]] = y[c];
  return x;
}

}  // namespace

polished_root polish(bicubic_patch<double> const& patch, ray<double> const& r, double t0, double u0, double v0) {
  vec const o{r.origin.x, r.origin.y, r.origin.z}, d{r.direction.x, r.direction.y, r.direction.z};
  real const scale = norm(d);
  real size = norm(o);
  for (auto const& p : patch.control_points)
    size = std::max({size, std::abs(real(p.x)), std::abs(real(p.y)), std::abs(real(p.z))});
  real t = t0 * scale, u = u0, v = v0, best = INFINITY;
  vec const back{-d[0] / scale, -d[1] / scale, -d[2] / scale};
  real best_t = t, best_u = u, best_v = v;
  constexpr int most_steps = 30;
  for (int step = 0; step < most_steps; ++step) {
    patch_point const q = at(patch, u, v);
    vec rest;
    for (std::size_t k = 0; k < 3; ++k) rest[k] = o[k] - t * back[k] - q.position[k];
    real const error = norm(rest);
    if (error < best) best = error, best_t = t, best_u = u, best_v = v;
    else if (step > 3) break;
    vec const move = solve({q.du, q.dv, back}, rest);
    u += move[0];
    v += move[1];
    t += move[2];
  }
  constexpr real slack = 1e-4L;
  bool const in_patch = -slack <= best_u && best_u <= 1 + slack && -slack <= best_v && best_v <= 1 + slack;
  bool const close = std::abs(best_u - u0) < 0.01L && std::abs(best_v - v0) < 0.01L;
  return {best_t / scale, std::abs(best_t - real(t0) * scale), best <= 1e-17L * size && in_patch && close};
}

}  // namespace patchrt::examples
