// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// A ray and a triangle in integers: floating-point numbers times a power of two, so that nothing is rounded.

#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/triangle.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace patchrt::test {

using integer = boost::multiprecision::cpp_int;
using integer_point = std::array<integer, 3>;

/// The least s for which x 2^s is an integer whatever the last bits of x are.
inline int integer_shift(double x) {
  int exponent = 0;
  std::frexp(x, &exponent);
  return x == 0 ? -10000 : 53 - exponent;
}
/// x 2^shift. \pre shift >= integer_shift(x).
inline integer to_integer(double x, int shift) {
  if (x == 0) return 0;
  int exponent = 0;
  integer const digits(static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53)));
  return digits << (exponent - 53 + shift);
}
template <class T> int integer_shift(vec3<T> const& p) {
  return std::max({integer_shift(double(p.x)), integer_shift(double(p.y)), integer_shift(double(p.z))});
}
template <class T> integer_point to_integers(vec3<T> const& p, int shift) {
  return {to_integer(double(p.x), shift), to_integer(double(p.y), shift), to_integer(double(p.z), shift)};
}
inline integer_point minus(integer_point const& a, integer_point const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline integer_point turned(integer_point const& a, integer_point const& b) {  // a x b
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline integer along(integer_point const& a, integer_point const& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// What a ray's line and a triangle have in common, exactly; lengths in powers of two.
class exact_crossing {
 public:
  template <class T> exact_crossing(vec3<T> const& origin, vec3<T> const& direction, triangle<T> const& t) {
    int const shift = std::max({integer_shift(origin), integer_shift(t.a), integer_shift(t.b), integer_shift(t.c)});
    int const direction_shift = integer_shift(direction);
    integer_point const o = to_integers(origin, shift), d = to_integers(direction, direction_shift);
    integer_point const a = to_integers(t.a, shift), b = to_integers(t.b, shift), c = to_integers(t.c, shift);
    normal_ = turned(minus(b, a), minus(c, a));
    distance_ = along(normal_, minus(a, o));
    scale_ = along(normal_, d);
    unit_of_t_ = direction_shift - shift;
    // Six times the volumes of d with the edges, seen from the origin: weights of a, b and c.
    auto const volume = [&](integer_point const& p, integer_point const& q) {
      return along(d, turned(minus(p, o), minus(q, o)));
    };
    weights_ = {volume(b, c), volume(c, a), volume(a, b)};
    length_ = std::sqrt(double(direction.x) * double(direction.x) + double(direction.y) * double(direction.y) +
                        double(direction.z) * double(direction.z));
  }

  bool has_area() const { return normal_ != integer_point{0, 0, 0}; }
  /// 1 where the ray's line meets the front, -1 for the back, 0 where it is parallel to the plane.
  int side() const { return -scale_.sign(); }
  /// Whether the line meets the triangle, edges and vertices included.
  bool is_met() const {
    if (scale_ == 0) return false;
    auto const least = *std::min_element(weights_.begin(), weights_.end());
    auto const most = *std::max_element(weights_.begin(), weights_.end());
    return least >= 0 || most <= 0;
  }
  bool is_on_edge() const {
    return is_met() && std::any_of(weights_.begin(), weights_.end(), [](integer const& w) { return w == 0; });
  }
  /// The least weight as a share of their sum: how far inside, or, where below 0, outside.
  double depth() const {
    integer const sum = weights_[0] + weights_[1] + weights_[2];
    integer least = weights_[0];
    for (integer const& w : weights_) least = (sum < 0 ? w > least : w < least) ? w : least;
    return ratio(least, sum);
  }
  double t() const { return std::ldexp(ratio(distance_, scale_), unit_of_t_); }
  double u() const { return ratio(weights_[1], weights_[0] + weights_[1] + weights_[2]); }
  double v() const { return ratio(weights_[2], weights_[0] + weights_[1] + weights_[2]); }

  /// How far the ray's point at t is from the triangle's plane along the ray, to a few ulp.
  double position_error(double t) const {
    int const shift = integer_shift(t);
    if (t == 0) return std::fabs(this->t()) * length_;
    // t - distance 2^unit / scale = (T scale - distance 2^(unit + shift)) / (scale 2^shift)
    int const raised = unit_of_t_ + shift;
    integer left = to_integer(t, shift) * scale_, right = distance_;
    raised < 0 ? left <<= -raised : right <<= raised;
    integer const off = left - right;
    return std::fabs(std::ldexp(ratio(off, scale_), -shift + std::min(raised, 0))) * length_;
  }

 private:
  /// p / q, rounded a few times.
  static double ratio(integer const& p, integer const& q) {
    if (p == 0) return 0;
    int const top_p = int(msb(abs(p))), top_q = int(msb(abs(q)));
    auto const leading = [](integer const& x, int top) {
      integer const head = top > 62 ? integer(abs(x) >> (top - 62)) : integer(abs(x) << (62 - top));
      return static_cast<double>(head) * (x < 0 ? -1 : 1);
    };
    return std::ldexp(leading(p, top_p) / leading(q, top_q), top_p - top_q);
  }

  integer_point normal_;
  integer distance_;
  integer scale_;
  std::array<integer, 3> weights_;
  int unit_of_t_;
  double length_;
};

}  // namespace patchrt::test
