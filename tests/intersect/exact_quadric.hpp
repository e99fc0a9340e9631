// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Crossings of rays with clipped quadrics to 90 digits, from the definition: points of the ray where f = 0 in the box,
/// and points of the box's faces where f <= 0. Shares no code with the kernels.

#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/make_quadric.hpp>

#include <boost/multiprecision/mpfr.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace patchrt::test {

using real =
    boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<90>, boost::multiprecision::et_off>;
using real_vector = std::array<real, 3>;

template <class T> real_vector exactly(vec3<T> const& v) { return {real(v.x), real(v.y), real(v.z)}; }
inline real_vector operator-(real_vector const& a, real_vector const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline real_vector along(real_vector const& o, real const& t, real_vector const& d) {
  return {o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]};
}
inline real inner(real_vector const& a, real_vector const& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline double length(real_vector const& a) { return static_cast<double>(sqrt(inner(a, a))); }

struct exact_crossing {
  real t;
  int face;
  double cosine;  ///< between ray and normal, in space
};

/// What there is along a whole line, and whether numbers with errors of `margin` must find the same.
struct exact_answer {
  std::vector<exact_crossing> crossings;
  bool certain = true;
};

template <class T> class exact_quadric {
 public:
  explicit exact_quadric(clipped_quadric<T> const& s) : centre_(exactly(s.centre)), capped_(s.capped) {
    for (std::size_t k = 0; k < 3; ++k) {
      rows_[k] = exactly(s.rows[k]);
      lo_[k] = double(s.clip.lo[int(k)]);
      hi_[k] = double(s.clip.hi[int(k)]);
    }
    auto const& [q, p, b, c] = s.form;
    form_ = {{{real(q.x), real(p.z), real(p.y), real(b.x)},
              {real(p.z), real(q.y), real(p.x), real(b.y)},
              {real(p.y), real(p.x), real(q.z), real(b.z)},
              {real(b.x), real(b.y), real(b.z), real(c)}}};
  }

  real_vector to_object(real_vector const& p, bool is_point) const {
    real_vector const v = is_point ? p - centre_ : p;
    return {inner(rows_[0], v), inner(rows_[1], v), inner(rows_[2], v)};
  }
  /// x^T form y.
  real product(real_vector const& x, int wx, real_vector const& y, int wy) const {
    std::array<real, 4> const a{x[0], x[1], x[2], real(wx)}, b{y[0], y[1], y[2], real(wy)};
    real sum = 0;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j) sum += a[i] * form_[i][j] * b[j];
    return sum;
  }
  real value(real_vector const& object) const { return product(object, 1, object, 1); }
  /// In space.
  real_vector gradient(real_vector const& object) const {
    real_vector g;
    for (std::size_t i = 0; i < 3; ++i)
      g[i] = form_[i][0] * object[0] + form_[i][1] * object[1] + form_[i][2] * object[2] + form_[i][3];
    real_vector r;
    for (std::size_t i = 0; i < 3; ++i) r[i] = rows_[0][i] * g[0] + rows_[1][i] * g[1] + rows_[2][i] * g[2];
    return r;
  }
  real_vector row(std::size_t k) const { return rows_[k]; }

  /// All t where f = 0, in the box or not.
  std::vector<real> roots(real_vector const& origin, real_vector const& direction) const {
    real_vector const o = to_object(origin, true), d = to_object(direction, false);
    real const a = product(d, 0, d, 0), h = product(d, 0, o, 1), c = product(o, 1, o, 1), disc = h * h - a * c;
    if (a == 0) return h == 0 ? std::vector<real>() : std::vector<real>{-c / (2 * h)};
    if (disc < 0) return {};
    real const s = sqrt(disc);
    return {(-h - s) / a, (-h + s) / a};
  }
  /// Where the ray crosses the plane of a face.
  real plane(int face, real_vector const& origin, real_vector const& direction) const {
    std::size_t const k = std::size_t(std::abs(face) - 1);
    return (real(face < 0 ? lo_[k] : hi_[k]) - to_object(origin, true)[k]) / to_object(direction, false)[k];
  }

  exact_answer crossings(real_vector const& origin, real_vector const& direction, double margin) const {
    exact_answer answer;
    real_vector const o = to_object(origin, true), d = to_object(direction, false);
    double const speed = length(direction);
    auto const cosine = [&](real_vector const& normal) {
      double const n = length(normal);
      return n == 0 ? 0. : std::fabs(static_cast<double>(inner(normal, direction))) / (n * speed);
    };
    std::vector<real> const both = roots(origin, direction);
    real const a = product(d, 0, d, 0), middle = a == 0 ? real(0) : real(-product(d, 0, o, 1) / a);
    // Two roots nearly one, or nearly none: f at the middle between them, against its size there.
    if (a != 0 && abs(middle) * speed * rows_scale() < 1e9) {
      real_vector const x = along(o, middle, d);
      if (abs(value(x)) < margin * (1 + inner(x, x))) answer.certain = false;
    }
    for (real const& t : both) {
      real_vector const x = along(o, t, d);
      if (!is_inside(x, 3, margin, answer.certain)) continue;
      answer.crossings.push_back({t, 0, cosine(gradient(x))});
    }
    if (capped_) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (int side = -1; side <= 1; side += 2) {
          double const plane = side < 0 ? lo_[k] : hi_[k];
          if (std::isinf(plane) || d[k] == 0) continue;
          real const t = (real(plane) - o[k]) / d[k];
          real_vector const x = along(o, t, d);
          real const f = value(x);
          if (!is_inside(x, k, margin, answer.certain)) continue;
          if (abs(f) < margin) answer.certain = false;
          if (f <= 0) answer.crossings.push_back({t, side * int(k + 1), cosine(rows_[k])});
        }
      }
    }
    std::sort(answer.crossings.begin(), answer.crossings.end(),
              [](exact_crossing const& x, exact_crossing const& y) { return x.t < y.t; });
    return answer;
  }

 private:
  std::array<real_vector, 3> rows_;
  real_vector centre_;
  std::array<double, 3> lo_, hi_;
  std::array<std::array<real, 4>, 4> form_;
  bool capped_;

  double rows_scale() const { return std::max({length(rows_[0]), length(rows_[1]), length(rows_[2])}); }

  bool is_inside(real_vector const& x, std::size_t except, double margin, bool& certain) const {
    bool inside = true, near = false;
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == except) continue;
      if (!std::isinf(lo_[k])) {
        inside = inside && real(lo_[k]) <= x[k];
        near = near || abs(x[k] - real(lo_[k])) < margin * (1 + std::fabs(lo_[k]));
      }
      if (!std::isinf(hi_[k])) {
        inside = inside && x[k] <= real(hi_[k]);
        near = near || abs(x[k] - real(hi_[k])) < margin * (1 + std::fabs(hi_[k]));
      }
    }
    if (near) certain = false;
    return inside;
  }
};

/// Ulps of T between a computed number and an exact one.
template <class T> double ulps_between(T got, real const& wanted) {
  if (wanted == 0) return got == 0 ? 0 : std::numeric_limits<double>::infinity();
  int const exponent = std::max(std::ilogb(static_cast<double>(wanted)), std::numeric_limits<T>::min_exponent - 1);
  return static_cast<double>(abs(real(got) - wanted) / ldexp(real(1), exponent + 1 - std::numeric_limits<T>::digits));
}

/// Surfaces of every kind, in any place, under any map, cut off in all ways.
class random_quadrics {
 public:
  explicit random_quadrics(unsigned seed) : bits_(seed) {}

  double uniform(double lo, double hi) { return lo + (hi - lo) * (double(bits_() >> 11) * 0x1p-53); }
  std::size_t below(std::size_t n) { return std::size_t(bits_() >> 20) % n; }
  vec3<double> direction() {
    double const z = uniform(-1, 1), turn = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(turn), r * std::sin(turn), z};
  }
  vec3<double> vector(double lo, double hi) {
    double const x = uniform(lo, hi), y = uniform(lo, hi), z = uniform(lo, hi);
    return {x, y, z};
  }

  /// Turned, stretched by up to `stretch`, of any size, up to `far` sizes away from 0.
  affine<double> place(double stretch, double far) {
    double const size = std::pow(10., uniform(-3, 3));
    vec3<double> factors;
    for (int k = 0; k < 3; ++k) factors[k] = size * std::pow(stretch, uniform(-0.5, 0.5));
    vec3<double> const axis = direction();
    auto a = affine<double>::rotation(axis, uniform(0, 6)) * affine<double>::scaling(factors);
    if (below(3) == 0) {
      vec3<double> const other = direction();
      a = a * affine<double>::rotation(other, uniform(0, 6)) * affine<double>::scaling({1, 1, uniform(0.5, 2)});
    }
    a.translation = scale(direction(), size * far * uniform(0, 1));
    return a;
  }

  static constexpr std::size_t kinds = 10;
  clipped_quadric<double> surface(std::size_t kind, affine<double> const& at) {
    ends const end = below(2) ? ends::capped : ends::open;
    double const lo = uniform(-2, 0), hi = uniform(0.1, 2);
    switch (kind) {
      case 0:
        return make_sphere(at);
      case 1:
        return make_cylinder(at, lo, hi, end);
      case 2:
        return make_cone(at, below(2) ? 0 : lo, hi, end);
      case 3:
        return make_paraboloid(at, hi, end);
      case 4:
        return make_hyperboloid_one_sheet(at, lo, hi, end);
      case 5:
        return make_hyperboloid_two_sheets(at, below(2) ? 0 : lo - 1, hi + 1, end);
      case 6:
        return make_plane(at, hi, hi + 1);
      case 7:
        return make_quadric(unit_sphere<double>(), at, {{lo, -0.5, -2}, {2, hi, 0.5}}, end);
      case 8:
        return make_quadric(unit_cone<double>(), at, {{-1, lo, -1}, {1, hi, 1}}, end);
      default: {
        quadric<double> q{vector(-1, 1), vector(-1, 1), vector(-1, 1), uniform(-1, 1)};
        if (evaluate(q, vec3<double>{0.1, 0.2, 0.3}) > 0) q.constant -= evaluate(q, vec3<double>{0.1, 0.2, 0.3}) + 0.1;
        box<double> const all{{-20, -20, -20}, {20, 20, 20}};
        try {
          return make_quadric(q, at, all, end);
        } catch (std::invalid_argument const&) {
          return make_sphere(at);
        }
      }
    }
  }

  std::mt19937_64& bits() { return bits_; }

 private:
  std::mt19937_64 bits_;
};

}  // namespace patchrt::test
