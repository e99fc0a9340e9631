// SPDX-License-Identifier: MIT
#include "torus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace patchrt::examples {

namespace {

/// c[0] + c[1] t + ... by Horner's rule.
template <int N> double value(double const (&c)[N + 1], double t) {
  double v = c[N];
  for (int k = N - 1; k >= 0; --k) v = std::fma(v, t, c[k]);
  return v;
}

/// Where f changes its sign between lo and hi, which it does; `step(t)` is f(t) / f'(t).
template <class F, class Step> double root_between(double lo, double hi, F const& f, Step const& step) {
  bool const rises = f(lo) < 0;
  double t = 0.5 * (lo + hi);
  for (int n = 0; n < 200 && lo < hi; ++n) {
    double const v = f(t);
    if (v == 0) return t;
    ((v < 0) == rises ? lo : hi) = t;
    double next = t - step(t);
    if (!(lo < next && next < hi)) next = 0.5 * (lo + hi);
    if (next == t || next == lo || next == hi) return next;
    t = next;
  }
  return t;
}

/// Roots with a change of sign in (lo, hi) of a polynomial of degree N, ascending, from those of its derivative.
template <int N> int roots_of(double const (&c)[N + 1], double lo, double hi, double (&roots)[N]) {
  if constexpr (N == 1) {
    roots[0] = -c[0] / c[1];
    return lo < roots[0] && roots[0] < hi;
  } else {
    double derivative[N], turns[N + 1];
    for (int k = 0; k < N; ++k) derivative[k] = (k + 1) * c[k + 1];
    double inner[N - 1];
    int const inner_count = roots_of<N - 1>(derivative, lo, hi, inner);
    turns[0] = lo;
    std::copy_n(inner, inner_count, turns + 1);
    turns[inner_count + 1] = hi;
    int count = 0;
    for (int k = 0; k <= inner_count; ++k) {
      if ((value<N>(c, turns[k]) < 0) == (value<N>(c, turns[k + 1]) < 0)) continue;
      roots[count++] = root_between(
          turns[k], turns[k + 1], [&](double t) { return value<N>(c, t); },
          [&](double t) { return value<N>(c, t) / value<N - 1>(derivative, t); });
    }
    return count;
  }
}

/// A line in units of the major radius from its point nearest the centre on, its direction of length 1.
struct local_line {
  vec3<double> point, direction;
  double height, slope;  ///< above the plane of the torus, and what it changes by
  double middle;         ///< t of the point
  double scale;          ///< of t: t = middle + scale tau
};

/// (rho - 1)^2 + z^2 - minor^2, and half of its derivative.
struct level {
  double value, half_slope;
};
level level_at(local_line const& l, double minor, double tau) {
  vec3<double> const x = fma(tau, l.direction, l.point);
  double const z = std::fma(tau, l.slope, l.height), along = dot(x, l.direction);
  double const rho = std::sqrt(std::max(dot(x, x) - z * z, 0.));
  double const off = rho - 1;
  double const change = rho > 0 ? (along - z * l.slope) / rho : 0;
  return {std::fma(off, off, (z - minor) * (z + minor)), std::fma(off, change, z * l.slope)};
}

vec3<double> normal_at(torus const& s, vec3<double> const& from_centre) {
  double const z = dot(from_centre, s.axis);
  vec3<double> const radial = fma(-z, s.axis, from_centre);
  double const rho = std::sqrt(dot(radial, radial));
  vec3<double> const n = fma(-s.major / rho, radial, from_centre);
  return scale(n, 1 / std::sqrt(dot(n, n)));
}

local_line make_local(ray<double> const& r, torus const& s) {
  double const speed = std::sqrt(dot(r.direction, r.direction));
  vec3<double> const from = difference(r.origin, s.centre);
  double const middle = -dot(from, r.direction) / (speed * speed);
  vec3<double> const point = scale(fma(middle, r.direction, from), 1 / s.major);
  vec3<double> const direction = scale(r.direction, 1 / speed);
  return {point, direction, dot(point, s.axis), dot(direction, s.axis), middle, s.major / speed};
}

}  // namespace

box<double> bounds(torus const& s) {
  box<double> b;
  for (int k = 0; k < 3; ++k) {
    double const reach = std::fma(s.major, std::sqrt(std::max(1 - s.axis[k] * s.axis[k], 0.)), s.minor);
    double const slack = 4e-16 * std::fabs(s.centre[k]) + 1e-15 * (s.major + s.minor);
    b.lo[k] = s.centre[k] - reach - slack;
    b.hi[k] = s.centre[k] + reach + slack;
  }
  return b;
}

torus_crossings crossings(ray<double> const& r, torus const& s) {
  torus_crossings all{{}, 0};
  local_line const l = make_local(r, s);
  double const minor = s.minor / s.major, reach = (1 + minor) * (1 + 1e-9);
  double const square = dot(l.point, l.point);
  if (!(square < reach * reach && l.scale < std::numeric_limits<double>::infinity())) return all;
  // (tau^2 + 2 b tau + k)^2 = 4 (u tau^2 + 2 v tau + w), the right side rho^2 times 4
  double const b = dot(l.point, l.direction), k = square + (1 - minor) * (1 + minor);
  double const u = 1 - l.slope * l.slope, v = b - l.height * l.slope, w = square - l.height * l.height;
  double const quartic[5] = {k * k - 4 * w, 4 * b * k - 8 * v, 4 * b * b + 2 * k - 4 * u, 4 * b, 1};
  double roots[4];
  int const count = roots_of<4>(quartic, -reach, reach, roots);
  for (int i = 0; i < count; ++i) {
    double tau = roots[i];
    for (int n = 0; n < 3; ++n) {
      level const f = level_at(l, minor, tau);
      double const step = f.value / (2 * f.half_slope);
      if (!(std::fabs(step) < 1e-4)) break;  // grazing: what the quartic said
      tau -= step;
    }
    double const t = std::fma(l.scale, tau, l.middle);
    all.t[all.count] = all.count > 0 ? std::max(t, all.t[all.count - 1]) : t;
    ++all.count;
  }
  return all;
}

torus_hit intersect(ray<double> const& r, torus const& s) {
  torus_crossings const all = crossings(r, s);
  for (int i = 0; i < all.count; ++i)
    if (r.t_min < all.t[i] && all.t[i] < r.t_max)
      return {all.t[i], normal_at(s, fma(all.t[i], r.direction, difference(r.origin, s.centre))), true};
  return {0, {0, 0, 0}, false};
}

}  // namespace patchrt::examples
