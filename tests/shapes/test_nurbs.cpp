// SPDX-License-Identifier: MIT
#include "exact_rational.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/shapes/nurbs.hpp>
#include <patchrt/shapes/revolution_patches.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <stdexcept>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// The B-spline basis functions of degree p at t by the recursion of Cox and de Boor, of the span [knots[k], knots[k +
/// 1]].
std::vector<rational> basis(std::vector<double> const& knots, int p, std::size_t k, rational const& t) {
  std::vector<rational> b(knots.size() - 1, rational(0));
  b[k] = 1;
  for (std::size_t d = 1; d <= std::size_t(p); ++d) {
    for (std::size_t i = 0; i + d + 1 < knots.size(); ++i) {
      rational const a0(knots[i]), a1(knots[i + d]), b0(knots[i + 1]), b1(knots[i + d + 1]);
      rational sum = 0;
      if (a0 < a1) sum += (t - a0) / (a1 - a0) * b[i];
      if (b0 < b1) sum += (b1 - t) / (b1 - b0) * b[i + 1];
      b[i] = sum;
    }
  }
  return b;
}

std::size_t span_from(std::vector<double> const& knots, double start) {
  std::size_t k = 0;
  while (!(knots[k] == start && knots[k] < knots[k + 1])) ++k;
  return k;
}

/// The surface's point by its definition.
exact_point value(nurbs_surface const& s, std::size_t ku, std::size_t kv, rational const& u, rational const& v) {
  auto const bu = basis(s.knots_u, s.degree_u, ku, u), bv = basis(s.knots_v, s.degree_v, kv, v);
  exact_point top{0, 0, 0};
  rational bottom = 0;
  for (std::size_t i = 0; i < std::size_t(s.count_u); ++i) {
    for (std::size_t j = 0; j < std::size_t(s.count_v); ++j) {
      std::size_t const k = i * std::size_t(s.count_v) + j;
      rational const w = bu[i] * bv[j] * rational(s.weights.empty() ? 1. : s.weights[k]);
      exact_point const p = exactly(s.control_points[k]);
      for (std::size_t c = 0; c < 3; ++c) top[c] += w * p[c];
      bottom += w;
    }
  }
  return 1 / bottom * top;
}

std::vector<double> random_knots(std::mt19937& g, int degree, int count, bool clamped) {
  std::uniform_int_distribution<int> step(0, 3);
  std::uniform_real_distribution<double> width(0.1, 2);
  std::vector<double> knots{-1.5};
  int times = 1;
  while (knots.size() < std::size_t(count + degree + 1)) {
    bool const repeat = step(g) == 0 && times < degree;
    times = repeat ? times + 1 : 1;
    knots.push_back(repeat ? knots.back() : knots.back() + width(g));
  }
  if (clamped) {
    for (int k = 0; k < degree; ++k) knots[std::size_t(k)] = knots[std::size_t(degree)];
    for (int k = 1; k <= degree; ++k) knots[std::size_t(count + k)] = knots[std::size_t(count)];
    if (knots[std::size_t(degree)] == knots[std::size_t(degree) + 1]) return random_knots(g, degree, count, clamped);
    if (knots[std::size_t(count) - 1] == knots[std::size_t(count)]) return random_knots(g, degree, count, clamped);
  }
  return knots;
}

nurbs_surface random_surface(std::mt19937& g, int p, int q, int rows, int columns, bool clamped, bool with_weights) {
  std::uniform_real_distribution<double> d(-1, 1);
  nurbs_surface s{p, q, rows, columns, random_knots(g, p, rows, clamped), random_knots(g, q, columns, clamped), {}, {}};
  for (int k = 0; k < rows * columns; ++k) {
    s.control_points.push_back({d(g), d(g), d(g)});
    if (with_weights) s.weights.push_back(std::exp2(2 * d(g)));
  }
  return s;
}

using homogeneous = std::array<rational, 4>;

/// A curve's control points with t inserted once into its knots.
/// Boehm, "Inserting new knots into B-spline curves", CAD 12(4), 1980.
std::vector<homogeneous> insert_knot(std::vector<rational>& knots, int degree, std::vector<homogeneous> const& points,
                                     rational const& t) {
  std::size_t const p = std::size_t(degree);
  std::size_t k = p;
  while (!(knots[k] <= t && t < knots[k + 1])) ++k;
  std::vector<homogeneous> refined;
  for (std::size_t i = 0; i <= points.size(); ++i) {
    if (i <= k - p || i > k) {
      refined.push_back(points[i <= k - p ? i : i - 1]);
      continue;
    }
    rational const a = (t - knots[i]) / (knots[i + p] - knots[i]);
    homogeneous h;
    for (std::size_t c = 0; c < 4; ++c) h[c] = (1 - a) * points[i - 1][c] + (a == 0 ? rational(0) : a * points[i][c]);
    refined.push_back(h);
  }
  knots.insert(knots.begin() + std::ptrdiff_t(k) + 1, t);
  return refined;
}

/// The Bezier points of the curve's span from `start` to `end`: its control points once both are knots of multiplicity
/// p.
std::vector<homogeneous> exact_span(std::vector<double> const& double_knots, int degree,
                                    std::vector<homogeneous> points, double start, double end) {
  std::vector<rational> knots(double_knots.begin(), double_knots.end());
  for (rational const& t : {rational(start), rational(end)}) {
    while (std::count(knots.begin(), knots.end(), t) < degree) points = insert_knot(knots, degree, points, t);
  }
  // The last knot at `start` ends the knots of the first point.
  auto const last = std::upper_bound(knots.begin(), knots.end(), rational(start)) - 1 - degree;
  return {points.begin() + (last - knots.begin()), points.begin() + (last - knots.begin()) + degree + 1};
}

/// A piece's Bezier points, of the degrees of the surface.
template <class Piece> exact_quotient exact_piece(nurbs_surface const& s, Piece const& piece) {
  std::vector<std::vector<homogeneous>> columns;
  for (int j = 0; j < s.count_v; ++j) {
    std::vector<homogeneous> column;
    for (int i = 0; i < s.count_u; ++i) {
      std::size_t const k = std::size_t(i * s.count_v + j);
      rational const w(s.weights.empty() ? 1. : s.weights[k]);
      exact_point const p = w * exactly(s.control_points[k]);
      column.push_back({p[0], p[1], p[2], w});
    }
    columns.push_back(exact_span(s.knots_u, s.degree_u, column, piece.u0, piece.u1));
  }
  exact_quotient q{{s.degree_u, s.degree_v, {}}, {s.degree_u, s.degree_v, {}}};
  for (std::size_t i = 0; i <= std::size_t(s.degree_u); ++i) {
    std::vector<homogeneous> row;
    for (auto const& column : columns) row.push_back(column[i]);
    for (homogeneous const& h : exact_span(s.knots_v, s.degree_v, row, piece.v0, piece.v1)) {
      q.top.points.push_back({h[0], h[1], h[2]});
      q.bottom.points.push_back({h[3], 0, 0});
    }
  }
  return q;
}

/// The largest ratio of a control point's error to the stated one. The exact points are held against the definition.
template <int M, int N> double worst_of_stated_bound(nurbs_surface const& s) {
  rational const eps(std::numeric_limits<double>::epsilon());
  constexpr int l = M + N;
  double m = 0, worst = 0;
  for (auto const& c : s.control_points) m = std::max({m, std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)});
  for (auto const& piece : bezier_pieces<M, N>(s)) {
    exact_quotient const q = exact_piece(s, piece);
    worst = std::max(worst, error_ratio(piece.patch, raised(q, M, N), rational(3, 2) * l * (l + 2) * eps * rational(m),
                                        3 * l * eps));
    std::size_t const ku = span_from(s.knots_u, piece.u0), kv = span_from(s.knots_v, piece.v0);
    for (rational const& a : {rational(0), rational(2, 3)}) {
      for (rational const& b : {rational(2, 5), rational(1)}) {
        rational const u = (1 - a) * rational(piece.u0) + a * rational(piece.u1);
        rational const v = (1 - b) * rational(piece.v0) + b * rational(piece.v1);
        REQUIRE(value(q, a, b) == value(s, ku, kv, u, v));
      }
    }
  }
  return worst;
}

/// Whether neighbours in a grid of pieces share their edges bit for bit.
template <int M, int N> bool are_joined(std::vector<nurbs_piece<M, N>> const& pieces, std::size_t spans_v) {
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    if ((k + 1) % spans_v != 0) {
      for (int i = 0; i <= M; ++i) {
        if (!is_same(pieces[k].patch(i, N), pieces[k + 1].patch(i, 0))) return false;
      }
    }
    if (k + spans_v < pieces.size()) {
      for (int j = 0; j <= N; ++j) {
        if (!is_same(pieces[k].patch(M, j), pieces[k + spans_v].patch(0, j))) return false;
      }
    }
  }
  return true;
}

/// A surface that is right, to be spoiled.
nurbs_surface plain_surface() {
  std::mt19937 g(1);
  nurbs_surface s = random_surface(g, 2, 3, 4, 5, true, true);
  s.knots_u = {0, 0, 0, 0.5, 1, 1, 1};
  s.knots_v = {0, 0, 0, 0, 0.25, 1, 1, 1, 1};
  return s;
}

template <class Spoil> void refuses(char const* message, Spoil const& spoil) {
  nurbs_surface s = plain_surface();
  spoil(s);
  CHECK_THROWS_AS(bezier_pieces(s), std::invalid_argument);
  CHECK_THROWS_WITH(bezier_pieces(s), contains_text(message));
}

/// A full circle by four quarters: The NURBS Book, 2nd ed., section 7.5, nine points in a square.
std::vector<double> const circle_knots{0, 0, 0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1, 1, 1};

/// The surface that a profile of n quarters of circles makes when it turns about the z axis.
nurbs_surface revolved(std::vector<vec3<double>> const& profile, std::vector<double> const& knots_v) {
  int const x[] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, y[] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
  nurbs_surface s{2, 2, 9, int(profile.size()), circle_knots, knots_v, {}, {}};
  for (int i = 0; i < 9; ++i) {
    for (std::size_t j = 0; j < profile.size(); ++j) {
      s.control_points.push_back({x[i] * profile[j].x, y[i] * profile[j].x, profile[j].z});
      int const middles = i % 2 + int(j % 2);
      s.weights.push_back(middles == 2 ? 0.5 : middles == 1 ? std::sqrt(0.5) : 1.);
    }
  }
  return s;
}

}  // namespace

TEST_CASE("the pieces of random surfaces of all degrees are the surfaces within the stated bound") {
  unsigned const seed = 71;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst = 0;
  for (int p = 1; p <= 5; ++p) {
    int const q = 6 - p;
    for (bool const clamped : {true, false}) {
      CAPTURE(p, q, clamped);
      worst = std::max(worst, worst_of_stated_bound<5, 5>(random_surface(g, p, q, p + 2, q + 2, clamped, clamped)));
    }
  }
  for (bool const clamped : {true, false}) {
    worst = std::max(worst, worst_of_stated_bound<3, 3>(random_surface(g, 3, 3, 7, 6, clamped, true)));
    worst = std::max(worst, worst_of_stated_bound<2, 3>(random_surface(g, 2, 1, 5, 4, clamped, false)));
    worst = std::max(worst, worst_of_stated_bound<4, 4>(random_surface(g, 4, 4, 6, 6, clamped, true)));
  }
  CAPTURE(worst);
  CHECK(worst <= 1);
  CHECK(worst > 0.005);
}

TEST_CASE("pieces cover the surface's parameters once and share their edges bit for bit") {
  unsigned const seed = 72;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 200; ++n) {
    int const p = 1 + n % 5, q = 1 + n / 5 % 5;
    auto const s = random_surface(g, p, q, p + 6, q + 5, n % 2 == 0, n % 3 != 0);
    auto const pieces = bezier_pieces<5, 5>(s);
    double area = 0;
    std::size_t spans_v = 0;
    for (auto const& piece : pieces) {
      REQUIRE(piece.u0 < piece.u1);
      REQUIRE(piece.v0 < piece.v1);
      area += (piece.u1 - piece.u0) * (piece.v1 - piece.v0);
      spans_v += piece.u0 == pieces[0].u0;
    }
    std::size_t const up = std::size_t(p), uq = std::size_t(q), nu = std::size_t(s.count_u),
                      nv = std::size_t(s.count_v);
    REQUIRE(area == Approx((s.knots_u[nu] - s.knots_u[up]) * (s.knots_v[nv] - s.knots_v[uq])));
    CAPTURE(n, p, q);
    REQUIRE(are_joined(pieces, spans_v));
  }
}

TEST_CASE("a surface without inner knots is its one Bezier patch, bit for bit") {
  std::mt19937 g(73);
  auto s = random_surface(g, 3, 2, 4, 3, true, true);
  s.knots_u = {-2, -2, -2, -2, 5, 5, 5, 5};
  s.knots_v = {0.1, 0.1, 0.1, 0.7, 0.7, 0.7};
  auto const pieces = bezier_pieces<3, 2>(s);
  REQUIRE(pieces.size() == 1);
  CHECK(pieces[0].u0 == -2);
  CHECK(pieces[0].u1 == 5);
  CHECK(pieces[0].v0 == 0.1);
  CHECK(pieces[0].v1 == 0.7);
  for (std::size_t k = 0; k < 12; ++k) {
    CHECK(pieces[0].patch.control_points[k].point == s.control_points[k]);
    CHECK(pieces[0].patch.control_points[k].weight == s.weights[k]);
  }
}

TEST_CASE("a surface without weights gives patches whose weights are all 1, and equal points stay equal") {
  unsigned const seed = 74;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 20; ++n) {
    auto s = random_surface(g, 3, 3, 8, 7, n % 2 == 0, n % 4 < 2);
    for (std::size_t j = 0; j < 7; ++j) s.control_points[j] = {0.1, 0.2, 0.3};
    for (auto& c : s.control_points) c.y = 1. / 3;
    for (auto const& piece : bezier_pieces<4, 5>(s)) {
      for (auto const& c : piece.patch.control_points) {
        REQUIRE(c.point.y == 1. / 3);
        if (s.weights.empty()) REQUIRE(c.weight == 1);
      }
      if (n % 2 == 0 && piece.u0 == s.knots_u[3]) {
        for (int j = 0; j <= 5; ++j) REQUIRE(piece.patch(0, j).point == piece.patch(0, 0).point);
      }
    }
  }
}

TEST_CASE("a uniform periodic surface closes bit for bit") {
  unsigned const seed = 75;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  constexpr int around = 6, degree = 3;
  nurbs_surface s{degree, 2, around + degree, 3, {}, {0, 0, 0, 1, 1, 1}, {}, {}};
  for (int k = -degree; k <= around + degree; ++k) s.knots_u.push_back(k);
  for (int k = 0; k < around * 3; ++k) {
    s.control_points.push_back({d(g), d(g), d(g)});
    s.weights.push_back(std::exp2(d(g)));
  }
  for (std::size_t k = 0; k < degree * 3; ++k) {  // push_back of an element of the same vector may move it
    auto const c = s.control_points[k];
    auto const w = s.weights[k];
    s.control_points.push_back(c);
    s.weights.push_back(w);
  }
  auto const pieces = bezier_pieces<3, 2>(s);
  REQUIRE(pieces.size() == around);
  CHECK(are_joined(pieces, 1));
  for (int j = 0; j <= 2; ++j) CHECK(is_same(pieces.back().patch(3, j), pieces.front().patch(0, j)));
}

TEST_CASE("the full circle's knots give a sphere and a torus the patches of their quarters") {
  double const h = 0.7, r = 0.25, big = 2;
  auto const ball = bezier_pieces<2, 2>(revolved(
      {{0.0, 0.0, -h}, {h, 0.0, -h}, {h, 0.0, 0.0}, {h, 0.0, h}, {0.0, 0.0, h}}, {0, 0, 0, 0.5, 0.5, 1, 1, 1}));
  auto const octants = sphere_patches(vec3<double>{0.0, 0.0, 0.0}, h);
  REQUIRE(ball.size() == 8);
  for (std::size_t k = 0; k < 8; ++k) {
    CHECK(is_same(ball[k].patch, octants[k]));
    CHECK(ball[k].u0 == double(k / 2) / 4);
    CHECK(ball[k].v1 == (k % 2 == 0 ? 0.5 : 1));
  }
  int const x[] = {1, 1, 0, -1, -1, -1, 0, 1, 1}, z[] = {0, 1, 1, 1, 0, -1, -1, -1, 0};
  std::vector<vec3<double>> tube;
  for (std::size_t k = 0; k < 9; ++k) tube.push_back({big + x[k] * r, 0.0, z[k] * r});
  auto const ring = bezier_pieces<2, 2>(revolved(tube, circle_knots));
  auto const quarters = torus_patches(vec3<double>{0.0, 0.0, 0.0}, big, r);
  REQUIRE(ring.size() == 16);
  for (std::size_t k = 0; k < 16; ++k) CHECK(is_same(ring[k].patch, quarters[k]));
}

TEST_CASE("a cylinder of raised degrees is the cylinder") {
  auto const whole = revolved({{1.0, 0.0, 0.0}, {1.0, 0.0, 0.5}, {1.0, 0.0, 1.0}}, {0, 0, 0, 1, 1, 1});
  for (auto const& piece : bezier_pieces<3, 4>(whole)) {
    for (int i = 0; i <= 16; ++i) {
      for (int j = 0; j <= 4; ++j) {
        vec3<double> const p = position(piece.patch, i / 16., j / 4.);
        REQUIRE(std::fabs(std::hypot(p.x, p.y) - 1) <= 30 * std::numeric_limits<double>::epsilon());
      }
    }
  }
}

TEST_CASE("surfaces of large and small numbers are cut as others are") {
  std::mt19937 g(76);
  auto const s = random_surface(g, 3, 2, 6, 5, false, true);
  auto scaled = s;
  double const by = std::ldexp(1., 490), weight_by = std::ldexp(1., -300);
  for (auto& c : scaled.control_points) c = by * c;
  for (double& w : scaled.weights) w *= weight_by;
  for (auto* knots : {&scaled.knots_u, &scaled.knots_v}) {
    for (double& k : *knots) k *= std::ldexp(1., -400);
  }
  auto const a = bezier_pieces(s), b = bezier_pieces(scaled);
  REQUIRE(a.size() == b.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    for (std::size_t n = 0; n < 16; ++n) {
      REQUIRE(b[k].patch.control_points[n].point == by * a[k].patch.control_points[n].point);
      REQUIRE(b[k].patch.control_points[n].weight == weight_by * a[k].patch.control_points[n].weight);
    }
  }
}

TEST_CASE("a bad surface is refused with what is wrong, where, and what was expected") {
  double const nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  REQUIRE_NOTHROW(bezier_pieces(plain_surface()));
  refuses("degree_u is 0, expected 1 to 3", [](auto& s) { s.degree_u = 0; });
  refuses("degree_v is 4, expected 1 to 3", [](auto& s) { s.degree_v = 4; });
  refuses("count_u is 2, expected at least degree_u + 1 = 3", [](auto& s) { s.count_u = 2; });
  refuses("count_v is -7, expected at least degree_v + 1 = 4", [](auto& s) { s.count_v = -7; });
  refuses("6 knots_u, expected count_u + degree_u + 1 = 7", [](auto& s) { s.knots_u.pop_back(); });
  refuses("0 knots_v, expected", [](auto& s) { s.knots_v.clear(); });
  refuses("knots_u[4] is nan, expected", [&](auto& s) { s.knots_u[4] = nan; });
  refuses("knots_v[8] is inf, expected", [&](auto& s) { s.knots_v[8] = inf; });
  refuses("knots_v[0] is -1e+200, expected", [](auto& s) { s.knots_v[0] = -1e200; });
  refuses("knots_v[4] is -0.25, expected at least knots_v[3] = 0", [](auto& s) { s.knots_v[4] = -0.25; });
  refuses("no span: knots_u[2] = knots_u[4] = 0", [](auto& s) { s.knots_u = {0, 0, 0, 0, 0, 0, 0}; });
  refuses("no span: knots_u[2] = knots_u[4] = 0", [](auto& s) { s.knots_u = {-2, -1, 0, 0, 0, 1, 2}; });
  refuses("knots_u[0] = 0 occurs 4 times, expected at most 3", [](auto& s) { s.knots_u[3] = 0; });
  refuses("knots_v[4] = 0.5 occurs 4 times, expected at most 3: the surface would be torn there", [](auto& s) {
    s.count_v = 8;
    s.knots_v = {0, 0, 0, 0, 0.5, 0.5, 0.5, 0.5, 1, 1, 1, 1};
  });
  refuses("19 control points, expected count_u count_v = 20", [](auto& s) { s.control_points.pop_back(); });
  refuses("21 weights, expected count_u count_v = 20, or none", [](auto& s) { s.weights.push_back(1); });
  refuses("control point (1, 2) is (", [&](auto& s) { s.control_points[7].y = nan; });
  refuses("control point (3, 4) is (", [&](auto& s) { s.control_points[19].z = -inf; });
  refuses("control point (0, 0) is (1e+300", [](auto& s) { s.control_points[0].x = 1e300; });
  refuses("weight (1, 2) is 0, expected 1e-100 to 1e100", [](auto& s) { s.weights[7] = 0; });
  refuses("weight (2, 0) is -1, expected", [](auto& s) { s.weights[10] = -1; });
  refuses("weight (0, 1) is nan, expected", [&](auto& s) { s.weights[1] = nan; });
  refuses("weight (0, 1) is inf, expected", [&](auto& s) { s.weights[1] = inf; });
  refuses("expected 1e-100 to 1e100", [](auto& s) { s.weights[1] = 1e-310; });
}

TEST_CASE("a knot may be degree + 1 fold at an end of the domain and degree fold inside") {
  std::mt19937 g(77);
  auto s = random_surface(g, 2, 2, 5, 3, true, false);
  s.knots_v = {0, 0, 0, 1, 1, 1};
  s.knots_u = {0, 0, 0, 1, 1, 2, 2, 2};
  CHECK(bezier_pieces<2, 2>(s).size() == 2);
  s.knots_u = {-1, 0, 0, 0, 1, 1, 1, 2};  // the domain starts after the knots at 0
  CHECK(bezier_pieces<2, 2>(s).size() == 1);
}
