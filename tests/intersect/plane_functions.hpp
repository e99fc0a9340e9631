// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Bicubics in powers, evaluated power by power with more digits: what the ray-patch solver is held against.

#include <patchrt/intersect/ray_patch.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>

namespace patchrt::test {

/// sum c[4k + l] x^k y^l.
template <class R> struct bicubic {
  std::array<R, 16> c;

  /// The derivative, `dx` times by x and `dy` times by y.
  R operator()(R const& x, R const& y, int dx = 0, int dy = 0) const { return sum(x, y, dx, dy, false); }
  /// sum |c[4k + l]| and the same of a derivative: the unit of rounding errors on the square.
  R magnitude(int dx = 0, int dy = 0) const { return sum(R(1), R(1), dx, dy, true); }

 private:
  R sum(R const& x, R const& y, int dx, int dy, bool magnitudes) const {
    using std::abs;
    R s = 0;
    for (int k = dx; k < 4; ++k) {
      for (int l = dy; l < 4; ++l) {
        R term = c[std::size_t(4 * k + l)];
        if (magnitudes) term = abs(term);
        for (int i = 0; i < dx; ++i) term *= k - i;
        for (int i = 0; i < dy; ++i) term *= l - i;
        for (int i = dx; i < k; ++i) term *= x;
        for (int i = dy; i < l; ++i) term *= y;
        s += term;
      }
    }
    return s;
  }
};

/// `f` in powers of p = (x - x0) / hx and q = (y - y0) / hy, by Taylor's formula.
template <class R> bicubic<R> over_cell(bicubic<R> const& f, R x0, R y0, R hx, R hy) {
  bicubic<R> b;
  R px = 1;
  for (int k = 0; k < 4; ++k) {
    R py = px;
    for (int l = 0; l < 4; ++l) {
      b.c[std::size_t(4 * k + l)] = py * f(x0, y0, k, l);
      py *= hy / (l + 1);
    }
    px *= hx / (k + 1);
  }
  return b;
}

using real = long double;

/// The two plane functions as they are given to the solver, in long double.
struct plane_functions {
  bicubic<real> f;
  bicubic<real> g;

  template <class T> explicit plane_functions(projected_patch<T> const& p) {
    for (std::size_t k = 0; k < 16; ++k) {
      f.c[k] = p.f[k];
      g.c[k] = p.g[k];
    }
  }
};

struct planar_point {
  real x;
  real y;
};

/// A root near (x, y) to the last bits of long double, and how well it is determined.
struct planar_root {
  real x;
  real y;
  bool found;
  real det;     ///< of the Jacobian
  real sway_x;  ///< what moves the root by x for a change of the functions by an epsilon of their magnitudes
  real sway_y;
};

inline planar_root find_root(plane_functions const& p, real x, real y) {
  planar_root r{x, y, false, 0, 0, 0};
  for (int n = 0; n < 60 && !r.found; ++n) {
    real const f = p.f(r.x, r.y), g = p.g(r.x, r.y);
    real const fx = p.f(r.x, r.y, 1, 0), fy = p.f(r.x, r.y, 0, 1), gx = p.g(r.x, r.y, 1, 0), gy = p.g(r.x, r.y, 0, 1);
    real const det = fx * gy - fy * gx, size_f = p.f.magnitude(), size_g = p.g.magnitude();
    real const dx = (fy * g - gy * f) / det, dy = (gx * f - fx * g) / det;
    r.det = det;
    r.sway_x = (std::abs(gy) * size_f + std::abs(fy) * size_g) / std::abs(det);
    r.sway_y = (std::abs(gx) * size_f + std::abs(fx) * size_g) / std::abs(det);
    if (!(std::abs(dx) < 1 && std::abs(dy) < 1)) return r;
    r.x += dx;
    r.y += dy;
    real const noise = 64 * std::numeric_limits<real>::epsilon();
    r.found = std::abs(dx) <= noise * (1 + r.sway_x) && std::abs(dy) <= noise * (1 + r.sway_y);
  }
  return r;
}

/// A rectangle of the parameter square.
template <class T> struct rectangle {
  T x, y, half_x, half_y;

  /// Whether a root is in it by more than `room` times what rounding in T moves the root.
  bool holds(planar_root const& r, real room = 32) const {
    real const unit = room * std::numeric_limits<T>::epsilon();
    return std::abs(r.x - real(x)) <= real(half_x) - unit * (1 + r.sway_x) &&
           std::abs(r.y - real(y)) <= real(half_y) - unit * (1 + r.sway_y);
  }
};

/// One of the cells that halvings make of the parameter square, `most` of them along either parameter at most.
template <class T, class Generator> rectangle<T> random_cell(Generator& g, int most) {
  int const m = 1 << (g() % unsigned(most + 1)), n = 1 << (g() % unsigned(most + 1));
  int const i = int(g() % unsigned(m)), j = int(g() % unsigned(n));
  return {T(2 * i + 1) / T(m) - 1, T(2 * j + 1) / T(n) - 1, T(1) / T(m), T(1) / T(n)};
}

/// A point of a cell: a third of them on an edge or in a corner.
template <class T, class Generator> planar_point random_point(rectangle<T> const& cell, Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  real p = d(g), q = d(g);
  if (g() % 4 == 0) p = g() % 2 ? 1 : -1;
  if (g() % 4 == 0) q = g() % 2 ? 1 : -1;
  return {real(cell.x) + p * real(cell.half_x), real(cell.y) + q * real(cell.half_y)};
}

}  // namespace patchrt::test
