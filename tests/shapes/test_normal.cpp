// SPDX-License-Identifier: MIT
#include "exact.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>
#include <patchrt/shapes/bezier_normal.hpp>

#include <cmath>
#include <optional>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using wide = long double;

/// Unit vector along an exact one; nothing for zero.
std::optional<vec3<wide>> direction_of(exact_point const& n) {
  rational const m = largest(n);
  if (m == 0) return {};
  vec3<wide> const a{static_cast<wide>(rational(n[0] / m)), static_cast<wide>(rational(n[1] / m)),
                     static_cast<wide>(rational(n[2] / m))};
  return a / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z);
}

/// |a - b|: the angle between unit vectors, where small.
template <class T> wide angle(vec3<T> const& a, vec3<wide> const& b) {
  return std::sqrt((wide(a.x) - b.x) * (wide(a.x) - b.x) + (wide(a.y) - b.y) * (wide(a.y) - b.y) +
                   (wide(a.z) - b.z) * (wide(a.z) - b.z));
}

template <class T> bool is_unit(vec3<T> const& n) {
  return std::abs(norm(n) - 1) <= 4 * std::numeric_limits<T>::epsilon();
}

/// The limit of the unit normal on the way from (u, v) along the diagonal into the patch, in rational arithmetic: the first
/// coefficient of Qu x Qv there that is not zero. Nothing where all are.
std::optional<vec3<wide>> exact_limit(exact_patch const& p, rational const& u, rational const& v) {
  rational const half(1, 2);
  bool const up_u = u <= half, up_v = v <= half;
  exact_patch const c = part_v(part_u(p, u, up_u ? 1 : 0), v, up_v ? 1 : 0);
  exact_patch const cu = derivative_u(c), cv = derivative_v(c);
  // Powers of s on the diagonal x = y = s, from the Bernstein form.
  auto const expand = [](exact_patch const& q) {
    std::vector<exact_point> a(std::size_t(q.m + q.n + 1));
    for (int i = 0; i <= q.m; ++i) {
      for (int j = 0; j <= q.n; ++j) {
        std::vector<rational> w{1};  // C(m, i) C(n, j) s^(i + j) (1 - s)^(m - i + n - j)
        for (int k = 0; k < q.m - i + q.n - j; ++k) {
          w.push_back(0);
          for (std::size_t e = w.size() - 1; e > 0; --e) w[e] -= w[e - 1];
        }
        auto const choose = [](int n, int k) {
          int b = 1;
          for (int e = 1; e <= k; ++e) b = b * (n - k + e) / e;
          return b;
        };
        for (std::size_t e = 0; e < w.size(); ++e) {
          for (std::size_t x = 0; x < 3; ++x)
            a[e + std::size_t(i + j)][x] += choose(q.m, i) * choose(q.n, j) * w[e] * q(i, j)[x];
        }
      }
    }
    return a;
  };
  auto const a = expand(cu), b = expand(cv);
  for (std::size_t r = 0; r < a.size() + b.size() - 1; ++r) {
    exact_point n{};
    for (std::size_t i = 0; i <= r; ++i) {
      if (i >= a.size() || r - i >= b.size()) continue;
      exact_point const x = cross(a[i], b[r - i]);
      for (std::size_t k = 0; k < 3; ++k) n[k] += x[k];
    }
    auto d = direction_of(n);
    if (d) return up_u == up_v ? *d : -*d;
  }
  return {};
}

/// An eighth of a sphere but for the 2.7e-4 by which cubic arcs differ; the edge u = 1 is the north pole.
template <class T> bicubic_patch<T> octant() {
  T const k = T(0.5522847498307936);
  T const r[4] = {1, 1, k, 0}, z[4] = {0, k, 1, 1};
  T const x[4] = {1, 1, k, 0}, y[4] = {0, k, 1, 1};
  bicubic_patch<T> p;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) p(i, j) = {r[i] * y[j], r[i] * x[j], z[i]};
  }
  return p;
}

/// Point k of n on edge u = 0, u = 1, v = 0 or v = 1.
template <class T> std::array<T, 2> on_edge(int edge, int k, int n) {
  T const along = T(k) / T(n), across = T(edge % 2);
  return edge < 2 ? std::array<T, 2>{across, along} : std::array<T, 2>{along, across};
}

template <class T> bool is_collapsed(bicubic_patch<T> const& p, int edge) {
  int const side = edge % 2 * 3;
  for (int k = 1; k < 4; ++k) {
    if (!(edge < 2 ? p(side, k) == p(side, 0) : p(k, side) == p(0, side))) return false;
  }
  return true;
}

}  // namespace

TEMPLATE_TEST_CASE("the normal is the exact one within its stated bound", "", float, double) {
  using T = TestType;
  std::mt19937 g(40);
  std::uniform_real_distribution<double> parameter(0, 1);
  wide worst = 0;
  for (int n = 0; n < 200; ++n) {
    auto const p = random_patch<T>(g);
    exact_patch const q = exactly(p);
    T const u = T(parameter(g)), v = T(parameter(g));
    exact_point const du = value(derivative_u(q), rational(u), rational(v)),
                      dv = value(derivative_v(q), rational(u), rational(v));
    auto const exact = direction_of(cross(du, dv));
    REQUIRE(exact);
    vec3<T> const normal_here = normal(p, u, v);
    REQUIRE(is_unit(normal_here));
    // Sums over the lengths of differences, as in the documentation of `normal`.
    auto const s = evaluate(p, u, v);
    T const bu[3] = {(1 - u) * (1 - u), 2 * u * (1 - u), u * u}, bv[3] = {(1 - v) * (1 - v), 2 * v * (1 - v), v * v};
    T const cu[4] = {(1 - u) * bu[0], 3 * u * bu[0], 3 * (1 - u) * bu[2], u * bu[2]};
    T const cv[4] = {(1 - v) * bv[0], 3 * v * bv[0], 3 * (1 - v) * bv[2], v * bv[2]};
    T a = 0, b = 0;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        if (i < 3) a += 3 * bu[i] * cv[j] * norm(p(i + 1, j) - p(i, j));
        if (j < 3) b += 3 * cu[i] * bv[j] * norm(p(i, j + 1) - p(i, j));
      }
    }
    T const eps = std::numeric_limits<T>::epsilon();
    T const sine = norm(cross(s.du, s.dv)) / (norm(s.du) * norm(s.dv));
    T const bound = 9 * eps * (a / norm(s.du) + b / norm(s.dv)) / sine + 4 * eps;
    CAPTURE(n, u, v);
    REQUIRE(angle(normal_here, *exact) <= bound);
    worst = std::max(worst, angle(normal_here, *exact) / bound);
  }
  CAPTURE(worst);
  CHECK(worst > 0.01L);
}

TEMPLATE_TEST_CASE("the normal at the collapsed edge of an octant is the pole's axis, and tends to it", "", float,
                   double) {
  using T = TestType;
  T const eps = std::numeric_limits<T>::epsilon();
  auto const p = octant<T>();
  for (int k = 0; k <= 20; ++k) {
    T const v = T(k) / 20;
    CHECK(norm(normal(p, T(1), v) - vec3<T>{0, 0, 1}) <= 4 * eps);
    for (T s = T(0.01); s > eps; s /= 10) {
      CAPTURE(v, s);
      vec3<T> const n = normal(p, 1 - s, v);
      CHECK(is_unit(n));
      CHECK(norm(n - vec3<T>{0, 0, 1}) <= 3 * s);
      CHECK(norm(n - evaluate(p, 1 - s, v).position) <= T(0.05) * s + 10 * eps);
    }
  }
}

TEMPLATE_TEST_CASE("the teapot's poles point along its axis", "", float, double) {
  using T = TestType;
  auto const teapot = read_patches(project_data("teapot.bpt"));
  REQUIRE(teapot.size() == 32);
  int poles = 0;
  for (auto const& numbers : teapot) {
    auto const p = make_patch<T>(numbers);
    for (int edge = 0; edge < 4; ++edge) {
      if (!is_collapsed(p, edge)) continue;
      ++poles;
      for (int k = 0; k <= 10; ++k) {
        auto const [u, v] = on_edge<T>(edge, k, 10);
        vec3<T> const n = normal(p, u, v);
        CAPTURE(edge, u, v, n.x, n.y, n.z);
        CHECK(std::abs(std::abs(n.z) - 1) <= 4 * std::numeric_limits<T>::epsilon());
        CHECK(std::abs(n.x) + std::abs(n.y) <= 4 * std::numeric_limits<T>::epsilon());
        T const s = T(0.001);
        CHECK(dot(n, normal(p, edge < 2 ? abs(u - s) : u, edge < 2 ? v : abs(v - s))) > T(0.9999));
      }
    }
  }
  CHECK(poles == 8);
}

TEMPLATE_TEST_CASE("tangents that are nearly, but not quite, parallel give their own normal and no limit", "", float,
                   double) {
  using T = TestType;
  std::mt19937 g(45);
  T const eps = std::numeric_limits<T>::epsilon(), sine = 1000 * eps;
  for (int n = 0; n < 100; ++n) {
    auto p = random_patch<T>(g);
    p(0, 0) = {0, 0, 0};
    p(0, 1) = p(1, 0) + sine * p(2, 2);
    auto const exact = direction_of(cross(exactly(p(1, 0)), exactly(p(0, 1))));
    REQUIRE(exact);
    REQUIRE(angle(normal(p, T(0), T(0)), *exact) <= 16 * eps);
  }
}

TEMPLATE_TEST_CASE("the limit normal is the exact limit along the diagonal, however degenerate the corner", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 41;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_int_distribution<int> few(0, 2), any(0, 15), corner(0, 1);
  int limits = 0, without = 0;
  for (int n = 0; n < 400; ++n) {
    // Few different points, some in one plane, some copied: every kind of vanishing and collinear tangent.
    bicubic_patch<T> p;
    T const values[3] = {0, 3, 7};  // which round in every step: the limit must not be taken from rounding errors
    for (auto& c : p.control_points) c = {values[few(g)], values[few(g)], n % 3 == 0 ? T(0) : values[few(g)]};
    for (int k = n % 12; k > 0; --k) p.control_points[std::size_t(any(g))] = p.control_points[std::size_t(any(g))];
    if (n % 4 == 1) {
      for (int j = 1; j < 4; ++j) p(0, j) = p(0, 0);
    }
    if (n % 4 == 2) p(1, 0) = p(0, 1) = p(0, 0);
    if (n % 8 == 2) p(1, 1) = p(0, 0);
    T const u = T(corner(g)), v = n % 5 == 0 ? T(few(g)) / 4 : T(corner(g));
    auto const exact = exact_limit(exactly(p), rational(u), rational(v));
    vec3<T> const found = normal(p, u, v);
    CAPTURE(n, u, v, found.x, found.y, found.z);
    REQUIRE(is_unit(found));
    if (exact) {
      ++limits;
      REQUIRE(angle(found, *exact) <= 1000 * std::numeric_limits<T>::epsilon());
    } else {
      ++without;
    }
  }
  CAPTURE(limits, without);
  CHECK(limits > 250);
}

TEMPLATE_TEST_CASE("normals of patches collapsed to a line, a curve or a point are finite unit vectors across it", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 42;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  auto const across = [](bicubic_patch<T> const& p, T u, T v) {
    vec3<T> const n = normal(p, u, v);
    auto const s = evaluate(p, u, v);
    T const slack = 2000 * std::numeric_limits<T>::epsilon() * largest_coordinate(p);
    return is_unit(n) && std::abs(dot(n, s.du)) <= slack && std::abs(dot(n, s.dv)) <= slack;
  };
  for (int n = 0; n < 200; ++n) {
    vec3<T> const a{T(d(g)), T(d(g)), T(d(g))}, b{T(d(g)), T(d(g)), T(d(g))};
    auto const curve = random_patch<T>(g);
    bicubic_patch<T> point, line, ruled;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        point(i, j) = a;
        line(i, j) = fma(T(d(g)), b, a);
        ruled(i, j) = n % 2 ? curve(0, j) : curve(i, 0);
      }
    }
    for (int k = 0; k < 20; ++k) {
      T const u = T(k % 5) / 4, v = T(k / 5) / 3;
      CAPTURE(n, u, v);
      REQUIRE((normal(point, u, v) == vec3<T>{0, 0, 1}));
      REQUIRE(is_unit(normal(line, u, v)));
      REQUIRE(across(ruled, u, v));
    }
  }
  bicubic_patch<T> x_axis;
  for (int k = 0; k < 16; ++k) x_axis.control_points[k] = {T(k * k % 7), T(3), T(-1)};
  CHECK(across(x_axis, T(0.25), T(1)));
}

TEMPLATE_TEST_CASE("normals do not depend on the size of the patch, down to denormals and up to overflow", "", float,
                   double) {
  using T = TestType;
  using limits = std::numeric_limits<T>;
  auto const p = octant<T>();
  for (int e = limits::min_exponent + 8; e <= limits::max_exponent; ++e) {
    T const scale = e == limits::max_exponent ? limits::max() : std::ldexp(T(1), e);
    auto q = p;
    for (auto& c : q.control_points) c *= scale;
    for (T const u : {T(0), T(0.3), T(0.9999), T(1)}) {
      CAPTURE(scale, u);
      REQUIRE(norm(normal(q, u, T(0.4)) - normal(p, u, T(0.4))) <= 50 * limits::epsilon());
    }
  }
  auto opposite = p;  // differences that overflow
  for (auto& c : opposite.control_points) c = limits::max() * (T(2) * c - vec3<T>{1, 1, 1});
  CHECK(norm(normal(opposite, T(0.3), T(0.4)) - normal(p, T(0.3), T(0.4))) <= 50 * limits::epsilon());
  auto denormal = p;
  for (auto& c : denormal.control_points) c *= 100 * limits::denorm_min();
  CHECK(is_unit(normal(denormal, T(0.3), T(0.4))));
}

TEST_CASE("Gumbo's vanishing corners and collapsed edges have unit normals that their surroundings tend to") {
  auto const file = shared_data("gumbo.bpt");
  if (file.empty()) PATCHRT_SKIP("gumbo.bpt is not in PATCHRT_SHARED_DATA");
  int vanishing = 0, tends = 0;
  for (auto const& numbers : read_patches(file)) {
    auto const p = make_patch<double>(numbers);
    for (int edge = 0; edge < 4; ++edge) {
      for (int k = 0; k <= 16; ++k) {
        auto const [u, v] = on_edge<double>(edge, k, 16);
        vec3<double> const n = normal(p, u, v);
        CAPTURE(vanishing, edge, k, u, v);
        REQUIRE(is_unit(n));
        auto const s = evaluate(p, u, v);
        if (norm(cross(s.du, s.dv)) > 1e-9 * norm(s.du) * norm(s.dv) && norm(s.du) > 1e-9 && norm(s.dv) > 1e-9)
          continue;
        ++vanishing;
        double const step = 1e-6;
        vec3<double> const inside = normal(p, u <= 0.5 ? u + step : u - step, v <= 0.5 ? v + step : v - step);
        tends += norm(inside - n) < 1e-3;
      }
    }
  }
  CAPTURE(vanishing, tends);
  CHECK(vanishing > 300);
  CHECK(tends == vanishing);
}

TEMPLATE_TEST_CASE("every lane of a pack has the normal of the scalar, bit for bit, regular or not", "",
                   (pack<float, 8>), (pack<float, 16>), (pack<double, 8>)) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  std::mt19937 g(44);
  std::uniform_real_distribution<double> d(0, 1);
  auto const p = octant<L>();
  auto folded = random_patch<L>(g);
  folded(1, 0) = folded(0, 1) = folded(0, 0);
  for (int n = 0; n < 50; ++n) {
    L u[lanes], v[lanes];
    for (int k = 0; k < lanes; ++k) {
      u[k] = k % 3 == 0 ? L(k % 2) : L(d(g));
      v[k] = k % 4 == 0 ? L(0) : L(d(g));
    }
    vec3<T> const a = normal(p, T::load(u), T::load(v)), b = normal(folded, T::load(u), T::load(v));
    for (int k = 0; k < lanes; ++k) {
      CAPTURE(k, u[k], v[k]);
      REQUIRE((vec3<L>{a.x[k], a.y[k], a.z[k]} == normal(p, u[k], v[k])));
      REQUIRE((vec3<L>{b.x[k], b.y[k], b.z[k]} == normal(folded, u[k], v[k])));
    }
  }
}
