// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/shapes/bezier_elevate.hpp>

#include <cstddef>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace patchrt {

/// A non-uniform rational B-spline surface as modellers write it, over knots_u[degree_u] <= u <= knots_u[count_u] and
/// the same in v.
///
/// Knot vectors may be clamped, unclamped or periodic; a surface that closes in u has its first degree_u rows once more
/// at its end.
struct nurbs_surface {
  int degree_u = 3;
  int degree_v = 3;
  int count_u = 0;              ///< rows of control points, which follow each other along u
  int count_v = 0;              ///< control points in a row
  std::vector<double> knots_u;  ///< count_u + degree_u + 1, none less than the one before
  std::vector<double> knots_v;
  std::vector<vec3<double>> control_points;  ///< point j of row i at i count_v + j
  std::vector<double> weights;               ///< as many, all greater than 0; or none, for all 1
};

/// What a surface is over one knot span in u and one in v: its point at (u, v) is the patch's at
/// ((u - u0) / (u1 - u0), (v - v0) / (v1 - v0)).
template <int M = 3, int N = 3> struct nurbs_piece {
  rational_patch<double, M, N> patch;
  double u0, u1;
  double v0, v1;
};

namespace detail {

template <class... Part> [[noreturn]] void refuse_nurbs(Part const&... part) {
  std::ostringstream text;
  text.precision(15);
  text << "bezier_pieces: ";
  (text << ... << part);
  throw std::invalid_argument(text.str());
}

/// |x| is at most 1e150, so that products and differences are finite; false for NaN.
inline bool is_usable(double x) { return -1e150 <= x && x <= 1e150; }

inline void check_knots(char axis, int degree, int most, int count, std::vector<double> const& knots) {
  std::string const name = std::string("knots_") + axis;
  if (degree < 1 || degree > most) refuse_nurbs("degree_", axis, " is ", degree, ", expected 1 to ", most);
  if (count <= degree)
    refuse_nurbs("count_", axis, " is ", count, ", expected at least degree_", axis, " + 1 = ", degree + 1);
  std::size_t const p = std::size_t(degree), n = std::size_t(count);
  if (knots.size() != n + p + 1)
    refuse_nurbs(knots.size(), " ", name, ", expected count_", axis, " + degree_", axis, " + 1 = ", n + p + 1);
  for (std::size_t k = 0; k < knots.size(); ++k) {
    if (!is_usable(knots[k])) refuse_nurbs(name, "[", k, "] is ", knots[k], ", expected a number up to 1e150");
    if (k > 0 && knots[k] < knots[k - 1])
      refuse_nurbs(name, "[", k, "] is ", knots[k], ", expected at least ", name, "[", k - 1, "] = ", knots[k - 1]);
  }
  if (!(knots[p] < knots[n]))
    refuse_nurbs("no span: ", name, "[", p, "] = ", name, "[", n, "] = ", knots[p], ", expected an increase");
  for (std::size_t k = 0, times = 1; k < knots.size(); k += times) {
    for (times = 1; k + times < knots.size() && knots[k + times] == knots[k];) ++times;
    bool const inside = knots[p] < knots[k] && knots[k] < knots[n];
    if (times > (inside ? p : p + 1))
      refuse_nurbs(name, "[", k, "] = ", knots[k], " occurs ", times, " times, expected at most ", inside ? p : p + 1,
                   inside ? ": the surface would be torn there" : "");
  }
}

inline void check_points(nurbs_surface const& s) {
  std::size_t const columns = std::size_t(s.count_v), count = std::size_t(s.count_u) * columns;
  if (s.control_points.size() != count)
    refuse_nurbs(s.control_points.size(), " control points, expected count_u count_v = ", count);
  if (!s.weights.empty() && s.weights.size() != count)
    refuse_nurbs(s.weights.size(), " weights, expected count_u count_v = ", count, ", or none");
  for (std::size_t k = 0; k < count; ++k) {
    vec3<double> const& c = s.control_points[k];
    if (!is_usable(c.x) || !is_usable(c.y) || !is_usable(c.z))
      refuse_nurbs("control point (", k / columns, ", ", k % columns, ") is (", c.x, ", ", c.y, ", ", c.z,
                   "), expected coordinates up to 1e150");
    if (!s.weights.empty() && !(1e-100 <= s.weights[k] && s.weights[k] <= 1e100))
      refuse_nurbs("weight (", k / columns, ", ", k % columns, ") is ", s.weights[k], ", expected 1e-100 to 1e100");
  }
}

/// The k for which knots[k] to knots[k + 1] is a span of the surface.
inline std::vector<std::size_t> knot_spans(int degree, int count, std::vector<double> const& knots) {
  std::vector<std::size_t> spans;
  for (std::size_t k = std::size_t(degree); k < std::size_t(count); ++k) {
    if (knots[k] < knots[k + 1]) spans.push_back(k);
  }
  return spans;
}

/// The points of degree `raised` of the span at knots[k] of a curve whose control points are `stride` apart.
///
/// Bezier point j is the curve's blossom at p - j times the span's start and j times its end. At a knot, the steps that
/// take a whole share are exact, and the others are the same from the left and from the right: spans share their ends
/// bit for bit, and so do both ends of a periodic curve whose knots have the same differences at both.
inline void span_to_bezier(std::vector<double> const& knots, int degree, std::size_t k,
                           weighted_point<double> const* points, std::size_t stride, int raised,
                           weighted_point<double>* bezier) {
  std::size_t const p = std::size_t(degree);
  for (std::size_t j = 0; j <= p; ++j) {
    std::vector<weighted_point<double>> d;
    for (std::size_t i = 0; i <= p; ++i) d.push_back(points[(k - p + i) * stride]);
    for (std::size_t r = 1; r <= p; ++r) {
      double const t = knots[r <= p - j ? k : k + 1];
      for (std::size_t i = p; i >= r; --i) {
        double const from = knots[k - p + i], to = knots[k + 1 + i - r];
        d[i] = weighted_segment<double>((to - t) / (to - from), (t - from) / (to - from))(d[i - 1], d[i]);
      }
    }
    bezier[j] = d[p];
  }
  for (int n = degree; n < raised; ++n) raise_curve<weighted_fraction<double>>(bezier, 1, n);
}

}  // namespace detail

/// The surface cut at its knots into rational Bezier patches of degree (M, N), to which lower degrees are raised:
/// pieces of the same span in u follow each other along v.
///
/// With m the largest |coordinate| and L = M + N, coordinates of control points are off by at most 3/2 L (L + 2) eps m
/// and weights by 3 L eps of themselves. Neighbours share their common edge bit for bit, control points that are equal
/// make points that are, and weights that are all equal stay so.
/// \pre Degrees from 1 to (M, N).
/// \throws std::invalid_argument in one line what is wrong, where, and what was expected: a degree out of range, counts
///         that do not match, knots that decrease, no span, a knot that occurs more than degree + 1 times, or more than
///         degree times inside, where the surface would be torn; a number that is not finite or is beyond 1e150; a
///         weight that is not within 1e-100 to 1e100.
/// \note Boehm, "Inserting new knots into B-spline curves", CAD 12(4), 1980; as blossoms: Ramshaw, "Blossoms are polar
///       forms", CAGD 6(4), 1989.
template <int M = 3, int N = 3> std::vector<nurbs_piece<M, N>> bezier_pieces(nurbs_surface const& surface) {
  detail::check_knots('u', surface.degree_u, M, surface.count_u, surface.knots_u);
  detail::check_knots('v', surface.degree_v, N, surface.count_v, surface.knots_v);
  detail::check_points(surface);
  using point = weighted_point<double>;
  std::size_t const columns = std::size_t(surface.count_v);
  std::vector<point> net;
  for (std::size_t k = 0; k < surface.control_points.size(); ++k)
    net.push_back({surface.control_points[k], surface.weights.empty() ? 1. : surface.weights[k]});

  auto const spans_u = detail::knot_spans(surface.degree_u, surface.count_u, surface.knots_u);
  auto const spans_v = detail::knot_spans(surface.degree_v, surface.count_v, surface.knots_v);
  std::vector<nurbs_piece<M, N>> pieces;
  pieces.reserve(spans_u.size() * spans_v.size());
  std::vector<point> rows(std::size_t(M + 1) * columns);  // of one span in u
  for (std::size_t const ku : spans_u) {
    for (std::size_t column = 0; column < columns; ++column) {
      point bezier[M + 1];
      detail::span_to_bezier(surface.knots_u, surface.degree_u, ku, net.data() + column, columns, M, bezier);
      for (int i = 0; i <= M; ++i) rows[std::size_t(i) * columns + column] = bezier[i];
    }
    for (std::size_t const kv : spans_v) {
      nurbs_piece<M, N> piece{
          {}, surface.knots_u[ku], surface.knots_u[ku + 1], surface.knots_v[kv], surface.knots_v[kv + 1]};
      for (int i = 0; i <= M; ++i) {
        point bezier[N + 1];
        detail::span_to_bezier(surface.knots_v, surface.degree_v, kv, rows.data() + std::size_t(i) * columns, 1, N,
                               bezier);
        for (int j = 0; j <= N; ++j) piece.patch(i, j) = bezier[j];
      }
      pieces.push_back(piece);
    }
  }
  return pieces;
}

}  // namespace patchrt
