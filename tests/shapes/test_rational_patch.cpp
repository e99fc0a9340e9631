// SPDX-License-Identifier: MIT
#include "exact_rational.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>
#include <patchrt/shapes/rational_normal.hpp>
#include <patchrt/shapes/rational_split.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class T, int M, int N> T weight_ratio(rational_patch<T, M, N> const& p) {
  return weights_of(p).largest / weights_of(p).least;
}

/// |got - wanted| over `bound`, the largest of the coordinates.
template <class T> double error_ratio(vec3<T> const& got, exact_point const& wanted, rational const& bound) {
  return static_cast<double>(rational(largest(exactly(got) - wanted) / bound));
}

template <class T, int M, int N> void hold_stated_bounds(int patches, int points) {
  unsigned const seed = unsigned(100 * M + N);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  double worst = 0, worst_tangent = 0;
  for (int k = 0; k < patches; ++k) {
    auto p = random_rational<T, M, N>(g, k % 4);
    for (auto& c : p.control_points) c.point.x += T(k % 5);
    exact_quotient const q = exactly(p);
    rational const m(largest_coordinate(points_of(p))), r(weight_ratio(p));
    rational const bound = m * gamma_of<T>(6 * (M + N) + 4), slope = m * r * gamma_of<T>(27 * (M + N) + 24);
    for (int n = 0; n < points; ++n) {
      T const u = n == 0 ? T(0) : n == 1 ? T(1) : T(parameter(g)), v = n == 1 ? T(1) : T(parameter(g));
      rational const ru(u), rv(v);
      auto const s = evaluate(p, u, v);
      worst = std::max(worst, error_ratio(s.position, value(q, ru, rv), bound));
      worst_tangent = std::max({worst_tangent, error_ratio(s.du, slope_u(q, ru, rv), M * slope),
                                error_ratio(s.dv, slope_v(q, ru, rv), N * slope)});
      REQUIRE(position(p, u, v) == s.position);
    }
  }
  CAPTURE(seed, M, N, worst, worst_tangent);
  CHECK(worst <= 1);
  CHECK(worst_tangent <= 1);
  CHECK(worst > 0.01);  // the bounds say something
  CHECK(worst_tangent > 0.001);
}

}  // namespace

TEMPLATE_TEST_CASE("rational patches evaluate within their stated bounds of rational arithmetic", "", float, double) {
  hold_stated_bounds<TestType, 3, 3>(12, 6);
  hold_stated_bounds<TestType, 1, 1>(12, 6);
  hold_stated_bounds<TestType, 2, 4>(8, 6);
  hold_stated_bounds<TestType, 5, 2>(8, 6);
}

TEMPLATE_TEST_CASE("a rational patch whose weights are all 1 is the polynomial patch", "", float, double) {
  using T = TestType;
  unsigned const seed = 41;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  T const eps = std::numeric_limits<T>::epsilon();
  for (int n = 0; n < 500; ++n) {
    auto const p = random_patch<T>(g);
    auto const r = make_rational(p);
    T const u = T(parameter(g)), v = T(parameter(g));
    auto const a = evaluate(p, u, v), b = evaluate(r, u, v);
    REQUIRE(norm(a.position - b.position) <= 40 * eps);
    REQUIRE(norm(a.du - b.du) <= 400 * eps);
    REQUIRE(norm(a.dv - b.dv) <= 400 * eps);
    auto const part = sub_patch(r, u, v, v, u);
    for (auto const& c : part.control_points) REQUIRE(c.weight == 1);
    REQUIRE(numerator(r).control_points[5] == p.control_points[5]);
  }
}

TEMPLATE_TEST_CASE("scaling all weights by a power of two changes no bit", "", float, double) {
  using T = TestType;
  unsigned const seed = 42;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  for (int n = 0; n < 300; ++n) {
    auto const p = random_rational<T, 3, 2>(g, 2);
    auto q = p;
    for (auto& c : q.control_points) c.weight *= T(1024);
    T const u = T(parameter(g)), v = T(parameter(g));
    auto const a = evaluate(p, u, v), b = evaluate(q, u, v);
    REQUIRE(a.position == b.position);
    REQUIRE(a.du == b.du);
    REQUIRE(a.dv == b.dv);
    REQUIRE(normal(p, u, v) == normal(q, u, v));
    auto const x = sub_patch(p, u, v, v, u), y = sub_patch(q, u, v, v, u);
    for (std::size_t k = 0; k < 12; ++k) REQUIRE(x.control_points[k].point == y.control_points[k].point);
  }
}

TEMPLATE_TEST_CASE("the numerator is the control points times their weights", "", float, double) {
  using T = TestType;
  std::mt19937 g(43);
  auto const p = random_rational<T, 2, 3>(g, 3);
  T weights[12];
  for (std::size_t k = 0; k < 12; ++k) weights[k] = p.control_points[k].weight;
  CHECK(is_same(p, make_rational(points_of(p), weights)));
  auto const a = numerator(p);
  for (int i = 0; i <= 2; ++i) {
    for (int j = 0; j <= 3; ++j) CHECK(a(i, j) == p(i, j).weight * p(i, j).point);
  }
}

TEMPLATE_TEST_CASE("the weights of a rational patch's parts stay within those of the whole, exactly", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 44;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  for (int n = 0; n < 2000; ++n) {
    auto const p = random_rational<T, 3, 3>(g, 8);
    T const a = T(parameter(g)), b = T(parameter(g));
    auto const whole = weights_of(p);
    for (auto const& part : {split_u(p).second, split_v(p, a).first, sub_patch(p, a, b, b, a)}) {
      REQUIRE(weights_of(part).least >= whole.least);
      REQUIRE(weights_of(part).largest <= whole.largest);
    }
  }
}

TEMPLATE_TEST_CASE("normals of rational patches are within their stated bound of rational arithmetic", "", float,
                   double) {
  using T = TestType;
  constexpr int M = 3, N = 2;
  unsigned const seed = 48;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  auto const as_double = [](exact_point const& p) {
    return vec3<double>{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  };
  double worst = 0;
  for (int n = 0; n < 200; ++n) {
    auto p = random_rational<T, M, N>(g, n % 3);
    for (auto& c : p.control_points) c.point.x += T(n % 4) * 100;  // far away: differences alone count
    exact_quotient const q = exactly(p);
    T const u = T(parameter(g)), v = n % 5 == 0 ? T(1) : T(parameter(g));
    auto const du = slope_u(q, rational(u), rational(v)), dv = slope_v(q, rational(u), rational(v));
    vec3<double> const exact_normal = as_double(cross(du, dv));
    double const lu = norm(as_double(du)), lv = norm(as_double(dv)), sine = norm(exact_normal) / (lu * lv);
    double const eps = double(std::numeric_limits<T>::epsilon());
    double const size = 2, ratio = double(weight_ratio(p));
    double const roundings = 24 * (M + N) + 32, gamma = roundings * eps / (2 - roundings * eps);
    double const bound = 2 * ratio * size * gamma * (M / lu + N / lv) / sine + 4 * eps;
    vec3<T> const got = normal(p, u, v);
    worst = std::max(worst, norm(convert_vec<double>(got) - exact_normal / norm(exact_normal)) / bound);
  }
  CAPTURE(worst);
  CHECK(worst <= 1);
  CHECK(worst > 0.0005);
}

TEMPLATE_TEST_CASE("the normal at a collapsed edge of a rational patch is the limit of those beside it", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 49;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0.1, 0.9);
  for (int n = 0; n < 300; ++n) {
    auto p = random_rational<T, 2, 3>(g, 1);
    int const edge = n % 2 * 3;
    for (int i = 1; i <= 2; ++i) p(i, edge).point = p(0, edge).point;
    T const u = T(parameter(g)), end = T(edge / 3), beside = end == 0 ? T(0x1p-20) : 1 - T(0x1p-20);
    rational_patch<double, 2, 3> wide;
    for (std::size_t k = 0; k < 12; ++k) {
      auto const& [c, w] = p.control_points[k];
      wide.control_points[k] = {convert_vec<double>(c), double(w)};
    }
    auto const near = evaluate(wide, double(u), double(beside));
    double const sine = norm(cross(near.du, near.dv)) / (norm(near.du) * norm(near.dv));
    if (sine < 0.1) continue;  // the limit is approached slowly
    vec3<double> const limit = normal(wide, double(u), double(beside));
    CAPTURE(n);
    REQUIRE(norm(convert_vec<double>(normal(p, u, end)) - limit) < 2e-3);
  }
}

TEMPLATE_TEST_CASE("the normal of a rational patch is a unit vector even where tangents vanish", "", float, double) {
  using T = TestType;
  std::mt19937 g(50);
  for (int n = 0; n < 40; ++n) {
    auto p = random_rational<T, 2, 2>(g, 2);
    if (n % 4 == 0) {
      for (auto& c : p.control_points) c.point = p(0, 0).point;
    } else if (n % 4 == 1) {
      for (auto& [c, w] : p.control_points) c = vec3<T>{c.x, c.x, c.x};  // a line
    } else if (n % 4 == 2) {
      p(0, 1).point = p(1, 0).point = p(0, 0).point;
    }
    for (T const u : {T(0), T(0.3), T(1)}) {
      for (T const v : {T(0), T(0.7), T(1)})
        REQUIRE(std::abs(norm(normal(p, u, v)) - 1) <= 8 * std::numeric_limits<T>::epsilon());
    }
  }
}

TEMPLATE_TEST_CASE("every lane of a pack treats rational patches to the bits of the scalar", "", (pack<float, 8>),
                   (pack<float, 16>), (pack<double, 8>)) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  unsigned const seed = 51;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(0, 1);
  auto const same = [](vec3<T> const& a, int k, vec3<L> const& b) {
    return a.x[k] == b.x && a.y[k] == b.y && a.z[k] == b.z;
  };
  for (int n = 0; n < 50; ++n) {
    L u[lanes], v[lanes];
    rational_patch<L, 3, 2> patches[lanes];
    rational_patch<T, 3, 2> packed;
    for (int k = 0; k < lanes; ++k) {
      u[k] = k == 0 ? L(0) : k == 1 ? L(1) : L(d(g));
      v[k] = k == 2 ? L(0) : k == 3 ? L(1) : L(d(g));
      patches[k] = random_rational<L, 3, 2>(g, 2);
    }
    for (std::size_t c = 0; c < 12; ++c) {
      L x[lanes], y[lanes], z[lanes], w[lanes];
      for (int k = 0; k < lanes; ++k) {
        x[k] = patches[k].control_points[c].point.x;
        y[k] = patches[k].control_points[c].point.y;
        z[k] = patches[k].control_points[c].point.z;
        w[k] = patches[k].control_points[c].weight;
      }
      packed.control_points[c] = {{T::load(x), T::load(y), T::load(z)}, T::load(w)};
    }
    auto const shared = evaluate(patches[0], T::load(u), T::load(v)), own = evaluate(packed, T::load(u), T::load(v));
    auto const part = sub_patch(packed, T::load(u), T::load(v), T::load(v), T::load(u));
    auto const across = normal(packed, T::load(u), T::load(v));
    for (int k = 0; k < lanes; ++k) {
      auto const s = evaluate(patches[0], u[k], v[k]), o = evaluate(patches[k], u[k], v[k]);
      REQUIRE((same(shared.position, k, s.position) && same(shared.du, k, s.du) && same(shared.dv, k, s.dv)));
      REQUIRE((same(own.position, k, o.position) && same(own.du, k, o.du) && same(own.dv, k, o.dv)));
      REQUIRE(same(across, k, normal(patches[k], u[k], v[k])));
      auto const alone = sub_patch(patches[k], u[k], v[k], v[k], u[k]);
      for (std::size_t c = 0; c < 12; ++c) {
        REQUIRE(same(part.control_points[c].point, k, alone.control_points[c].point));
        REQUIRE(part.control_points[c].weight[k] == alone.control_points[c].weight);
      }
    }
  }
}
