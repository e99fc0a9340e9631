// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Quadrics in their places: unit forms under affine maps, cut off by boxes, open or with caps. Made in double on the
/// host, with what is no surface refused; `convert_quadric` gives them other number types.

#include <patchrt/shapes/quadric_bounds.hpp>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace patchrt {

namespace detail {

/// Eigenvalues of Q and vectors of length 1 to them, by Jacobi's rotations: backward stable, exact where Q is diagonal.
struct quadric_axes {
  long double value[3];
  long double vector[3][3];  ///< [k] belongs to value[k]
};
inline quadric_axes principal_axes(quadric<double> const& q) {
  long double m[3][3] = {{q.squares.x, q.products.z, q.products.y},
                         {q.products.z, q.squares.y, q.products.x},
                         {q.products.y, q.products.x, q.squares.z}};
  quadric_axes a{{}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int sweep = 0; sweep < 32; ++sweep) {
    for (int i = 0; i < 3; ++i) {
      int const j = (i + 1) % 3, k = (i + 2) % 3;
      if (m[i][j] == 0) continue;
      long double const half = (m[j][j] - m[i][i]) / (2 * m[i][j]);
      long double const t = std::copysign(1 / (std::fabs(half) + std::sqrt(half * half + 1)), half);
      long double const c = 1 / std::sqrt(t * t + 1), s = t * c, mij = m[i][j], mik = m[i][k], mjk = m[j][k];
      m[i][i] -= t * mij;
      m[j][j] += t * mij;
      m[i][j] = m[j][i] = 0;
      m[i][k] = m[k][i] = c * mik - s * mjk;
      m[j][k] = m[k][j] = s * mik + c * mjk;
      for (int n = 0; n < 3; ++n) {
        long double const vi = a.vector[i][n], vj = a.vector[j][n];
        a.vector[i][n] = c * vi - s * vj;
        a.vector[j][n] = s * vi + c * vj;
      }
    }
  }
  for (int k = 0; k < 3; ++k) a.value[k] = m[k][k];
  return a;
}

/// A form about another origin, in more digits than double where there are.
struct shifted_form {
  long double linear[3];
  long double constant;
  long double terms;  ///< the sum of the magnitudes that `constant` is made of
};
inline shifted_form shift_origin(quadric<double> const& q, long double const (&to)[3]) {
  long double const m[3][3] = {{q.squares.x, q.products.z, q.products.y},
                               {q.products.z, q.squares.y, q.products.x},
                               {q.products.y, q.products.x, q.squares.z}};
  shifted_form r{{q.linear.x, q.linear.y, q.linear.z}, q.constant, std::fabs(static_cast<long double>(q.constant))};
  for (int i = 0; i < 3; ++i) {
    long double const before = r.linear[i];
    for (int j = 0; j < 3; ++j) {
      r.linear[i] += m[i][j] * to[j];
      r.terms += std::fabs(to[i] * m[i][j] * to[j]);
    }
    r.constant += to[i] * (before + r.linear[i]);
    r.terms += 2 * std::fabs(to[i] * before);
  }
  return r;
}

/// The centre of a quadric; of those that have many, that nearest to 0; a point of a paraboloid or plane. Throws where
/// there is no surface.
inline vec3<double> quadric_centre(quadric<double> const& q) {
  auto const fail = [](char const* why) { throw std::invalid_argument(std::string("make_quadric: the form ") + why); };
  double const entries[10] = {q.squares.x,  q.squares.y, q.squares.z, q.products.x, q.products.y,
                              q.products.z, q.linear.x,  q.linear.y,  q.linear.z,   q.constant};
  bool is_zero = true;
  for (double const x : entries) {
    if (!std::isfinite(x)) fail("has a number that is not finite");
    is_zero = is_zero && x == 0;
  }
  if (is_zero) fail("is 0 everywhere: the whole space, expected a surface");
  constexpr long double eps = std::numeric_limits<double>::epsilon();
  quadric_axes const axes = principal_axes(q);
  long double most = 0;
  for (long double const v : axes.value) most = std::fmax(most, std::fabs(v));
  long double const linear[3] = {q.linear.x, q.linear.y, q.linear.z};
  long double centre[3] = {};
  int positive = 0, negative = 0;
  for (int k = 0; k < 3; ++k) {
    if (std::fabs(axes.value[k]) <= 16 * eps * most) continue;
    ++(axes.value[k] > 0 ? positive : negative);
    long double along = 0;
    for (int n = 0; n < 3; ++n) along += axes.vector[k][n] * linear[n];
    for (int n = 0; n < 3; ++n) centre[n] -= axes.vector[k][n] * along / axes.value[k];
  }
  // What is left of b lies along the axes of eigenvalue 0: there f is linear.
  shifted_form about = shift_origin(q, centre);
  long double rest[3] = {}, square = 0, scale_of_b = 0;
  for (int k = 0; k < 3; ++k) {
    scale_of_b += std::fabs(linear[k]);
    if (std::fabs(axes.value[k]) > 16 * eps * most) continue;
    long double along = 0;
    for (int n = 0; n < 3; ++n) along += axes.vector[k][n] * about.linear[n];
    for (int n = 0; n < 3; ++n) rest[n] += axes.vector[k][n] * along;
    square += along * along;
  }
  if (std::sqrt(square) > 64 * eps * scale_of_b) {
    for (int n = 0; n < 3; ++n) centre[n] -= rest[n] * about.constant / (2 * square);
  } else if (positive == 0 || negative == 0) {
    long double const sign = positive > 0 ? 1 : -1;
    if (positive + negative == 0 || sign * about.constant > 64 * eps * about.terms)
      fail("has no points where it is 0, expected a surface");
    if (!(sign * about.constant < -64 * eps * about.terms))
      fail("is 0 in a point, in a line or in a plane that counts twice, expected a surface");
  }
  return {static_cast<double>(centre[0]), static_cast<double>(centre[1]), static_cast<double>(centre[2])};
}

}  // namespace detail

/// The part of f = 0 in `clip`, both in an object space that `to_world` puts in its place.
///
/// Any box, slab or half space may clip: the axes of object space are those of the planes, whose pairs need not be at
/// right angles after the map. The form may be of any sign and size: it is scaled by a power of two. Object space is
/// shifted so that 0 is the quadric's centre, or the point of `clip` nearest to that: 0 in the unit forms.
/// \throws std::invalid_argument where a number of `form` or `to_world` is not finite; where f is 0 everywhere,
///         nowhere, or in no more than a line; where `to_world` is singular; where `clip` is empty, NaN, or holds none
///         of f = 0.
inline clipped_quadric<double> make_quadric(quadric<double> const& form,
                                            affine<double> const& to_world = affine<double>::identity(),
                                            box<double> const& clip = whole_space<double>(), ends end = ends::open) {
  if (is_empty(clip))
    throw std::invalid_argument("make_quadric: the box to clip with is empty or NaN, expected lo <= hi");
  vec3<double> at = detail::quadric_centre(form);
  for (int k = 0; k < 3; ++k) at[k] = min(max(at[k], clip.lo[k]), clip.hi[k]);
  long double const to[3] = {at.x, at.y, at.z};
  detail::shifted_form const about = detail::shift_origin(form, to);
  clipped_quadric<double> s;
  auto const rounded = [](long double x) { return static_cast<double>(x); };
  vec3<double> const linear{rounded(about.linear[0]), rounded(about.linear[1]), rounded(about.linear[2])};
  s.form = quadric<double>{form.squares, form.products, linear, rounded(about.constant)};
  double most = abs(s.form.constant);
  for (vec3<double> const& v : {s.form.squares, s.form.products, s.form.linear})
    most = max(most, max(abs(v.x), max(abs(v.y), abs(v.z))));
  double const factor = std::ldexp(1., -std::ilogb(most));
  s.form = quadric<double>{scale(s.form.squares, factor), scale(s.form.products, factor), scale(s.form.linear, factor),
                           s.form.constant * factor};
  s.clip = {clip.lo - at, clip.hi - at};
  affine<double> const back = inverse(to_world);
  for (int k = 0; k < 3; ++k) s.rows[k] = {back.x[k], back.y[k], back.z[k]};
  s.centre = transform_point(to_world, at);
  s.capped = end == ends::capped;
  if (is_empty(bounds(s)))
    throw std::invalid_argument("make_quadric: the surface has no points in the box to clip with");
  return s;
}

/// The image of the unit sphere: a sphere or ellipsoid.
inline clipped_quadric<double> make_sphere(affine<double> const& to_world) {
  return make_quadric(unit_sphere<double>(), to_world);
}
/// The ellipsoid with half axes `radii` along x, y and z.
inline clipped_quadric<double> make_ellipsoid(vec3<double> const& centre, vec3<double> const& radii) {
  affine<double> a = affine<double>::scaling(radii);
  a.translation = centre;
  return make_sphere(a);
}
/// The image of x^2 + y^2 = 1, lo <= z <= hi.
inline clipped_quadric<double> make_cylinder(affine<double> const& to_world, double lo, double hi,
                                             ends end = ends::open) {
  return make_quadric(unit_cylinder<double>(), to_world, between_heights(lo, hi), end);
}
/// The image of x^2 + y^2 = z^2, lo <= z <= hi: one nappe where lo or hi is 0.
inline clipped_quadric<double> make_cone(affine<double> const& to_world, double lo, double hi, ends end = ends::open) {
  return make_quadric(unit_cone<double>(), to_world, between_heights(lo, hi), end);
}
/// The image of x^2 + y^2 = z, z <= hi.
inline clipped_quadric<double> make_paraboloid(affine<double> const& to_world, double hi, ends end = ends::open) {
  return make_quadric(unit_paraboloid<double>(), to_world,
                      between_heights(-std::numeric_limits<double>::infinity(), hi), end);
}
/// The image of x^2 + y^2 - z^2 = 1, lo <= z <= hi.
inline clipped_quadric<double> make_hyperboloid_one_sheet(affine<double> const& to_world, double lo, double hi,
                                                          ends end = ends::open) {
  return make_quadric(unit_hyperboloid_one_sheet<double>(), to_world, between_heights(lo, hi), end);
}
/// The image of x^2 + y^2 - z^2 = -1, lo <= z <= hi: one sheet where lo or hi is 0.
inline clipped_quadric<double> make_hyperboloid_two_sheets(affine<double> const& to_world, double lo, double hi,
                                                           ends end = ends::open) {
  return make_quadric(unit_hyperboloid_two_sheets<double>(), to_world, between_heights(lo, hi), end);
}
/// The image of z = 0, |x| <= half_x, |y| <= half_y.
inline clipped_quadric<double> make_plane(affine<double> const& to_world,
                                          double half_x = std::numeric_limits<double>::infinity(),
                                          double half_y = std::numeric_limits<double>::infinity()) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  return make_quadric(unit_plane<double>(), to_world, {{-half_x, -half_y, -inf}, {half_x, half_y, inf}});
}

}  // namespace patchrt
