// SPDX-License-Identifier: MIT
#include "exact_rational.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/numbers/pack.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/shapes/rational_split.hpp>
#include <patchrt/shapes/surface_form.hpp>

#include <algorithm>
#include <limits>
#include <random>
#include <type_traits>
#include <utility>

using namespace patchrt;
using namespace patchrt::test;

namespace {

template <class Surface> using number_of = std::decay_t<decltype(weight(std::declval<Surface>(), 0))>;

/// Control points anywhere in [-1, 1]^3, and of a rational patch weights of 2^-spread to 2^spread.
template <class Surface, class Generator> Surface random_surface(Generator& g, double spread) {
  using form = surface_form<Surface>;
  using T = number_of<Surface>;
  if constexpr (form::is_rational) return random_rational<T, form::degree_u, form::degree_v>(g, spread);
  else return random_patch<T, form::degree_u, form::degree_v>(g);
}

template <class T> bool is_same(vec3<T> const& a, vec3<T> const& b) { return a == b; }
template <class T, int M, int N> bool is_same(bezier_patch<T, M, N> const& a, bezier_patch<T, M, N> const& b) {
  return std::equal(std::begin(a.control_points), std::end(a.control_points), std::begin(b.control_points));
}

/// The largest ratio of a control point's error to `bound`.
template <class T, int M, int N>
double error_ratio(bezier_patch<T, M, N> const& got, exact_patch const& wanted, rational const& bound) {
  rational worst = 0;
  for (int i = 0; i <= M; ++i) {
    for (int j = 0; j <= N; ++j) worst = std::max(worst, largest(exactly(got(i, j)) - wanted(i, j)));
  }
  return static_cast<double>(rational(worst / bound));
}

/// The error of a part over what is stated of `levels` steps, each of them a halving or not, for coordinates up to m.
template <class T, int M, int N>
double stated_ratio(bezier_patch<T, M, N> const& got, exact_patch const& wanted, rational const& m, int levels,
                    bool is_half) {
  rational const eps(std::numeric_limits<T>::epsilon());
  return error_ratio(got, wanted, levels * eps * m / (is_half ? 2 : 1));
}
template <class T, int M, int N>
double stated_ratio(rational_patch<T, M, N> const& got, exact_quotient const& wanted, rational const& m, int levels,
                    bool) {
  rational const eps(std::numeric_limits<T>::epsilon());
  return error_ratio(got, wanted, levels * (levels + 2) * eps * m, 2 * levels * eps);
}

template <class Surface> void hold_stated_bounds(int patches) {
  using T = number_of<Surface>;
  constexpr int M = surface_form<Surface>::degree_u, N = surface_form<Surface>::degree_v;
  unsigned const seed = unsigned(10 * M + N);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  double worst_half = 0, worst_cut = 0, worst_part = 0;
  for (int k = 0; k < patches; ++k) {
    auto p = random_surface<Surface>(g, k % 4);
    rational m = 0;
    for (int i = 0; i < (M + 1) * (N + 1); ++i) {
      control_point(p, i).x += T(k % 5);
      m = std::max(m, largest(exactly(control_point(p, i))));
    }
    auto const q = exactly(p);
    auto const ratio = [&m](auto const& got, auto const& wanted, int levels, bool is_half) {
      return stated_ratio(got, wanted, m, levels, is_half);
    };
    rational const half(1, 2);
    auto const hu = split_u(p), hv = split_v(p);
    worst_half = std::max({worst_half, ratio(hu.first, part_u(q, 0, half), M, true),
                           ratio(hu.second, part_u(q, half, 1), M, true), ratio(hv.first, part_v(q, 0, half), N, true),
                           ratio(hv.second, part_v(q, half, 1), N, true)});
    T const a = T(parameter(g)), b = T(parameter(g)), c = T(parameter(g)), d = T(parameter(g));
    rational const ra(a), rb(b), rc(c), rd(d);
    auto const cu = split_u(p, a), cv = split_v(p, b);
    worst_cut =
        std::max({worst_cut, ratio(cu.first, part_u(q, 0, ra), M, false), ratio(cu.second, part_u(q, ra, 1), M, false),
                  ratio(cv.first, part_v(q, 0, rb), N, false), ratio(cv.second, part_v(q, rb, 1), N, false)});
    worst_part = std::max(worst_part, ratio(sub_patch(p, a, b, c, d), part_v(part_u(q, ra, rb), rc, rd), M + N, false));
  }
  CAPTURE(seed, M, N, worst_half, worst_cut, worst_part);
  CHECK(worst_half <= 1);
  CHECK(worst_cut <= 1);
  CHECK(worst_part <= 1);
  CHECK(std::min({worst_half, worst_cut, worst_part}) > 0.02);  // the bounds say something
}

}  // namespace

TEMPLATE_TEST_CASE("splits and sub-patches are within their stated bounds of rational arithmetic", "", float, double) {
  hold_stated_bounds<bezier_patch<TestType, 3, 3>>(20);
  hold_stated_bounds<bezier_patch<TestType, 1, 1>>(10);
  hold_stated_bounds<bezier_patch<TestType, 2, 4>>(10);
  hold_stated_bounds<rational_patch<TestType, 3, 3>>(12);
  hold_stated_bounds<rational_patch<TestType, 1, 1>>(12);
  hold_stated_bounds<rational_patch<TestType, 2, 4>>(8);
  hold_stated_bounds<rational_patch<TestType, 5, 2>>(8);
}

TEST_CASE("halving patches of small integers rounds nothing") {
  std::mt19937 g(30);
  std::uniform_int_distribution<int> d(-1000, 1000);
  for (int n = 0; n < 20; ++n) {
    bicubic_patch<float> p;
    for (auto& c : p.control_points) c = {float(d(g)), float(d(g)), float(d(g))};
    exact_patch const q = exactly(p);
    rational const half(1, 2), unit(1);
    CHECK(error_ratio(split_u(split_v(p).second).first, part_u(part_v(q, half, 1), 0, half), unit) == 0);
    CHECK(error_ratio(sub_patch(p, 0.25f, 0.5f, 0.75f, 1.f), part_v(part_u(q, rational(1, 4), half), rational(3, 4), 1),
                      unit) == 0);
  }
}

TEMPLATE_TEST_CASE("parts of a patch evaluate to the points of the whole", "", bicubic_patch<float>,
                   bicubic_patch<double>, rational_patch<float>, rational_patch<double>) {
  using T = number_of<TestType>;
  unsigned const seed = 31;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  T const eps = std::numeric_limits<T>::epsilon();
  constexpr bool is_rational = surface_form<TestType>::is_rational;
  for (int n = 0; n < 1000; ++n) {
    auto const p = random_surface<TestType>(g, 1);
    T const a = T(parameter(g)), b = T(parameter(g)), c = T(parameter(g)), d = T(parameter(g));
    T const u = T(parameter(g)), v = T(parameter(g));
    auto const whole = [&p](T x, T y) { return evaluate(p, x, y).position; };
    auto const part = [u, v](TestType const& q) { return evaluate(q, u, v).position; };
    // Of a polynomial patch 9 eps each for two evaluations and 3 or 6 for the split, per coordinate; parameters are
    // rounded where slopes are up to 6.
    T const near = (is_rational ? 100 : 60) * eps;
    REQUIRE(norm(part(split_u(p).first) - whole(u / 2, v)) <= near);
    REQUIRE(norm(part(split_v(p).second) - whole(u, (1 + v) / 2)) <= near);
    REQUIRE(norm(part(split_u(p, a).second) - whole(a + u * (1 - a), v)) <= near);
    REQUIRE(norm(part(split_v(p, b).first) - whole(u, v * b)) <= near);
    REQUIRE(norm(part(sub_patch(p, a, b, c, d)) - whole(a + u * (b - a), c + v * (d - c))) <=
            (is_rational ? 100 : 70) * eps);
  }
}

TEMPLATE_TEST_CASE("the parts' control points stay within the bounds of the patch exactly, its points up to rounding",
                   "", bicubic_patch<float>, bicubic_patch<double>, rational_patch<float>, rational_patch<double>) {
  using T = number_of<TestType>;
  unsigned const seed = 32;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  for (int n = 0; n < 3000; ++n) {
    auto p = random_surface<TestType>(g, 8);
    if (n % 2) {  // almost flat across x: boxes a few ulp thick
      for (int i = 0; i < 16; ++i) {
        T& x = control_point(p, i).x;
        x = 1 + std::numeric_limits<T>::epsilon() * T(int(8 * x));
      }
    }
    auto const b = bounds(p);
    T const a = T(parameter(g)), c = T(parameter(g));
    auto const h = split_u(p), k = split_v(p, a);
    REQUIRE(contains(b, bounds(h.first)));
    REQUIRE(contains(b, bounds(h.second)));
    REQUIRE(contains(b, bounds(k.first)));
    REQUIRE(contains(b, bounds(k.second)));
    REQUIRE(contains(b, bounds(sub_patch(p, a, c, c, a))));
    T const error = 40 * std::numeric_limits<T>::epsilon();
    vec3<T> const q = position(p, a, c);
    REQUIRE(contains(box<T>{b.lo - error, b.hi + error}, box<T>{q, q}));
  }
}

TEMPLATE_TEST_CASE("parts share their common edges and corners bit for bit", "", bicubic_patch<float>,
                   bicubic_patch<double>, rational_patch<float>, rational_patch<double>) {
  using T = number_of<TestType>;
  unsigned const seed = 33;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  for (int n = 0; n < 200; ++n) {
    auto const p = random_surface<TestType>(g, 3);
    T const a = T(parameter(g)), b = T(parameter(g)), c = T(parameter(g)), d = T(parameter(g)), e = T(parameter(g));
    auto const h = split_u(p, a), k = split_v(p);
    auto const left = sub_patch(p, a, b, d, e), right = sub_patch(p, b, c, d, e);
    for (int i = 0; i < 4; ++i) {
      REQUIRE(is_same(h.first(3, i), h.second(0, i)));
      REQUIRE(is_same(k.first(i, 3), k.second(i, 0)));
      REQUIRE(is_same(left(3, i), right(0, i)));
    }
    auto const across = sub_patch(p, b, a, e, c);
    REQUIRE(is_same(across(0, 0), left(3, 3)));
  }
}

TEMPLATE_TEST_CASE("a cut at an end of the parameters leaves the patch as it is", "", bicubic_patch<float>,
                   bicubic_patch<double>, rational_patch<float>, rational_patch<double>) {
  using T = number_of<TestType>;
  unsigned const seed = 34;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 200; ++n) {
    auto const p = random_surface<TestType>(g, 3);
    REQUIRE(is_same(split_u(p, T(0)).second, p));
    REQUIRE(is_same(split_u(p, T(1)).first, p));
    REQUIRE(is_same(split_v(p, T(0)).second, p));
    REQUIRE(is_same(split_v(p, T(1)).first, p));
    REQUIRE(is_same(sub_patch(p, T(0), T(1), T(0), T(1)), p));
    auto const turned = sub_patch(p, T(1), T(0), T(0), T(1));
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) REQUIRE(is_same(turned(i, j), p(3 - i, j)));
    }
  }
}

TEMPLATE_TEST_CASE("points that are equal stay equal in every part, whatever their weights", "", bicubic_patch<float>,
                   bicubic_patch<double>, rational_patch<float>, rational_patch<double>) {
  using T = number_of<TestType>;
  unsigned const seed = 35;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> parameter(0, 1);
  for (int n = 0; n < 200; ++n) {
    auto p = random_surface<TestType>(g, 3);
    vec3<T> const pole = control_point(p, 0);
    for (int j = 1; j < 4; ++j) control_point(p, j) = pole;
    T const a = T(parameter(g)), b = T(parameter(g));
    auto const part = split_v(split_u(p).first, a).second, cut = sub_patch(p, T(0), a, a, b);
    for (int j = 0; j < 4; ++j) {
      REQUIRE(control_point(part, j) == pole);
      REQUIRE(control_point(cut, j) == pole);
    }
  }
}

TEMPLATE_TEST_CASE("every lane of a pack splits to the bits of the scalar", "", (pack<float, 8>), (pack<float, 16>),
                   (pack<double, 8>)) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  std::mt19937 g(36);
  std::uniform_real_distribution<double> d(0, 1);
  L u[lanes], w[lanes];
  bicubic_patch<L> patches[lanes];
  bicubic_patch<T> packed;
  for (int k = 0; k < lanes; ++k) {
    u[k] = k == 0 ? L(0) : k == 1 ? L(1) : L(d(g));
    w[k] = L(d(g));
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
  auto const same = [](bicubic_patch<T> const& a, int k, bicubic_patch<L> const& b) {
    for (std::size_t c = 0; c < 16; ++c) {
      vec3<T> const& p = a.control_points[c];
      if (!(vec3<L>{p.x[k], p.y[k], p.z[k]} == b.control_points[c])) return false;
    }
    return true;
  };
  auto const halves = split_u(packed);
  auto const parts = split_v(packed, T::load(u));
  auto const sub = sub_patch(packed, T::load(u), T::load(w), T::load(w), T::load(u));
  for (int k = 0; k < lanes; ++k) {
    CHECK(same(halves.first, k, split_u(patches[k]).first));
    CHECK(same(halves.second, k, split_u(patches[k]).second));
    CHECK(same(parts.first, k, split_v(patches[k], u[k]).first));
    CHECK(same(parts.second, k, split_v(patches[k], u[k]).second));
    CHECK(same(sub, k, sub_patch(patches[k], u[k], w[k], w[k], u[k])));
  }
}
