// SPDX-License-Identifier: MIT
#include "exact.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>

#include <cmath>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// The largest ratio of error to bound over the coordinates.
template <class T> double error_ratio(vec3<T> const& got, exact_point const& wanted, rational const& bound) {
  return static_cast<double>(rational(largest(exactly(got) - wanted) / bound));
}

/// Evaluation of random patches of degree (M, N) against rational arithmetic: at most 1 where the stated bounds hold.
template <class T, int M, int N> double worst_of_stated_bound(int patches, int points) {
  std::mt19937 g(unsigned(M * 10 + N));
  std::uniform_real_distribution<double> parameter(0, 1);
  double worst = 0;
  for (int k = 0; k < patches; ++k) {
    auto p = random_patch<T, M, N>(g);
    for (auto& c : p.control_points) c = T(std::ldexp(1, k % 7 - 3)) * c + vec3<T>{T(k % 3), T(0), T(-k % 5)};
    exact_patch const q = exactly(p), qu = derivative_u(q), qv = derivative_v(q);
    rational const unit = gamma_of<T>(3 * (M + N)) * rational(largest_coordinate(p));
    for (int n = 0; n < points; ++n) {
      T const u = n == 0 ? T(0) : n == 1 ? T(1) : T(parameter(g)), v = n == 1 ? T(1) : T(parameter(g));
      auto const s = evaluate_curvature(p, u, v);
      auto const at = [&](exact_patch const& x) { return value(x, rational(u), rational(v)); };
      worst = std::max({worst, error_ratio(s.position, at(q), unit), error_ratio(s.du, at(qu), 2 * M * unit),
                        error_ratio(s.dv, at(qv), 2 * N * unit),
                        error_ratio(s.duv, at(derivative_v(qu)), 4 * M * N * unit)});
      if (M > 1) worst = std::max(worst, error_ratio(s.duu, at(derivative_u(qu)), 4 * M * (M - 1) * unit));
      if (N > 1) worst = std::max(worst, error_ratio(s.dvv, at(derivative_v(qv)), 4 * N * (N - 1) * unit));
      auto const first = evaluate(p, u, v);
      REQUIRE(first.position == s.position);
      REQUIRE(first.du == s.du);
      REQUIRE(first.dv == s.dv);
    }
  }
  return worst;
}

}  // namespace

TEMPLATE_TEST_CASE("evaluation is within its stated bounds of rational arithmetic", "", float, double) {
  double const bicubic = worst_of_stated_bound<TestType, 3, 3>(20, 8);
  double const bilinear = worst_of_stated_bound<TestType, 1, 1>(10, 8);
  double const mixed = worst_of_stated_bound<TestType, 2, 4>(10, 8);
  CAPTURE(bicubic, bilinear, mixed);
  CHECK(bicubic <= 1);
  CHECK(bilinear <= 1);
  CHECK(mixed <= 1);
  CHECK(bicubic > 0.01);  // the bound says something
}

TEMPLATE_TEST_CASE("evaluation at the corners gives the control points and the tangents between them", "", float,
                   double) {
  using T = TestType;
  std::mt19937 g(4);
  auto const p = random_patch<T>(g);
  for (int i = 0; i <= 3; i += 3) {
    for (int j = 0; j <= 3; j += 3) {
      auto const s = evaluate(p, T(i) / 3, T(j) / 3);
      int const along_u = i == 0 ? 1 : -1, along_v = j == 0 ? 1 : -1;
      CHECK(s.position == p(i, j));
      vec3<T> const du = T(3 * along_u) * (p(i + along_u, j) - p(i, j));
      vec3<T> const dv = T(3 * along_v) * (p(i, j + along_v) - p(i, j));
      CHECK(norm(s.du - du) <= 16 * std::numeric_limits<T>::epsilon());
      CHECK(norm(s.dv - dv) <= 16 * std::numeric_limits<T>::epsilon());
    }
  }
}

TEMPLATE_TEST_CASE("the weights are a partition of unity", "", float, double) {
  using T = TestType;
  bicubic_patch<T> p;
  for (auto& c : p.control_points) c = vec3<T>{1, -1, T(1) / 3};
  T const bound = 10 * std::numeric_limits<T>::epsilon();  // g(18) = 9 eps and a little
  for (int n = 0; n <= 1000; ++n) {
    auto const s = evaluate(p, T(n) / 1000, T(1000 - n) / 1000);
    CHECK(std::abs(s.position.x - 1) <= bound);
    CHECK(std::abs(s.position.y + 1) <= bound);
    CHECK(std::abs(s.position.z - T(1) / 3) <= bound / 3);
    CHECK(std::abs(s.du.x) <= 6 * bound);
    CHECK(std::abs(s.dv.x) <= 6 * bound);
  }
}

TEMPLATE_TEST_CASE("evaluation commutes with affine maps: bit for bit where they round nothing", "", float, double) {
  using T = TestType;
  unsigned const seed = 9;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  T const eps = std::numeric_limits<T>::epsilon();
  for (int n = 0; n < 300; ++n) {
    auto const p = random_patch<T>(g);
    auto turned = p, mapped = p;
    vec3<T> const rows[3] = {{T(d(g)), T(d(g)), T(d(g))}, {T(d(g)), T(d(g)), T(d(g))}, {T(d(g)), T(d(g)), T(d(g))}};
    vec3<T> const shift{T(d(g)), T(d(g)), T(d(g))};
    auto const turn = [](vec3<T> const& x) { return vec3<T>{-4 * x.z, x.x / 2, 1024 * x.y}; };
    auto const map = [&](vec3<T> const& x) { return vec3<T>{dot(rows[0], x), dot(rows[1], x), dot(rows[2], x)}; };
    for (auto& c : turned.control_points) c = turn(c);
    for (auto& c : mapped.control_points) c = map(c) + shift;
    T const u = T(0.5) + T(0.5) * T(d(g)), v = T(0.5) + T(0.5) * T(d(g));
    auto const s = evaluate(p, u, v), t = evaluate(turned, u, v), m = evaluate(mapped, u, v);
    REQUIRE(t.position == turn(s.position));
    REQUIRE(t.du == turn(s.du));
    REQUIRE(t.dv == turn(s.dv));
    // 9 eps times the largest coordinate, 3 before the map and 4 after it, and the map's own rounding.
    REQUIRE(norm(m.position - (map(s.position) + shift)) <= 80 * eps);
    REQUIRE(norm(m.du - map(s.du)) <= 480 * eps);
  }
}

TEMPLATE_TEST_CASE("a patch of raised degree is the same surface", "", float, double) {
  using T = TestType;
  std::mt19937 g(12);
  auto const p = random_patch<T, 2, 3>(g);
  bezier_patch<T, 3, 3> raised;
  for (int i = 0; i <= 3; ++i) {
    for (int j = 0; j <= 3; ++j) {
      raised(i, j) = (T(i) * (i > 0 ? p(i - 1, j) : p(0, j)) + T(3 - i) * (i < 3 ? p(i, j) : p(2, j))) / T(3);
    }
  }
  for (int n = 0; n <= 100; ++n) {
    T const u = T(n) / 100, v = T(n * 37 % 101) / 100;
    auto const a = evaluate_curvature(p, u, v), b = evaluate_curvature(raised, u, v);
    T const eps = std::numeric_limits<T>::epsilon();
    CHECK(norm(a.position - b.position) <= 40 * eps);
    CHECK(norm(a.du - b.du) <= 200 * eps);
    CHECK(norm(a.dvv - b.dvv) <= 800 * eps);
    CHECK(norm(a.duv - b.duv) <= 800 * eps);
  }
}

TEMPLATE_TEST_CASE("every lane of a pack evaluates to the bits of the scalar", "", (pack<float, 8>), (pack<float, 16>),
                   (pack<double, 8>), (pack<double, 16>)) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  std::mt19937 g(21);
  std::uniform_real_distribution<double> d(0, 1);
  for (int n = 0; n < 100; ++n) {
    L u[lanes], v[lanes];
    bicubic_patch<L> patches[lanes];
    bicubic_patch<T> packed;
    for (int k = 0; k < lanes; ++k) {
      u[k] = k == 0 ? L(0) : k == 1 ? L(1) : L(d(g));
      v[k] = k == 2 ? L(0) : k == 3 ? L(1) : L(d(g));
      patches[k] = random_patch<L>(g);
    }
    for (std::size_t c = 0; c < 16; ++c) {
      L x[lanes], y[lanes], z[lanes];
      for (int k = 0; k < lanes; ++k) {
        x[k] = patches[k].control_points[c].x;
        y[k] = patches[k].control_points[c].y;
        z[k] = patches[k].control_points[c].z;
      }
      packed.control_points[c] = {T::load(x), T::load(y), T::load(z)};
    }
    auto const same = [](vec3<T> const& a, int k, vec3<L> const& b) {
      return a.x[k] == b.x && a.y[k] == b.y && a.z[k] == b.z;
    };
    auto const shared = evaluate_curvature(patches[0], T::load(u), T::load(v));
    auto const own = evaluate_curvature(packed, T::load(u), T::load(v));
    auto const box_of_packed = bounds(packed);
    for (int k = 0; k < lanes; ++k) {
      auto const s = evaluate_curvature(patches[0], u[k], v[k]), o = evaluate_curvature(patches[k], u[k], v[k]);
      REQUIRE((same(shared.position, k, s.position) && same(shared.du, k, s.du) && same(shared.dv, k, s.dv)));
      REQUIRE((same(shared.duu, k, s.duu) && same(shared.duv, k, s.duv) && same(shared.dvv, k, s.dvv)));
      REQUIRE((same(own.position, k, o.position) && same(own.du, k, o.du) && same(own.dvv, k, o.dvv)));
      auto const b = bounds(patches[k]);
      REQUIRE((same(box_of_packed.lo, k, b.lo) && same(box_of_packed.hi, k, b.hi)));
    }
  }
}

TEST_CASE("a patch in one precision evaluates at parameters of another") {
  std::mt19937 g(6);
  auto const p = random_patch<float>(g);
  bicubic_patch<double> widened;
  for (std::size_t c = 0; c < 16; ++c) widened.control_points[c] = convert_vec<double>(p.control_points[c]);
  auto const a = evaluate(p, 0.3, 0.7), b = evaluate(widened, 0.3, 0.7);
  CHECK(a.position == b.position);
  auto const c = evaluate(p, pack<double, 8>(0.3), pack<double, 8>(0.7));
  CHECK(c.du.x[5] == b.du.x);
  CHECK(norm(evaluate(widened, 0.3f, 0.7f).position - convert_vec<float>(b.position)) < 1e-6f);
}
