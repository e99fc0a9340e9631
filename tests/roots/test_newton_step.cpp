// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/numbers/pack.hpp>
#include <patchrt/roots/newton.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

using namespace patchrt;
using rational = boost::multiprecision::cpp_rational;

namespace {

/// Numbers of a few bits or of all, of exponents -20 to 20; a tenth of them 0.
template <class T> class number_source {
 public:
  explicit number_source(unsigned seed) : generator_(seed) {}
  int pick(int n) { return int(generator_() % unsigned(n)); }
  T any() {
    if (pick(10) == 0) return T(0);
    double const x = pick(3) == 0 ? pick(31) - 15 : uniform_(generator_);
    return std::ldexp(T(x), pick(41) - 20);
  }
  /// Often a Jacobian that is singular up to rounding, and values that its columns span.
  bivariate<T> functions() {
    bivariate<T> b{any(), any(), any(), any(), any(), any()};
    int const kind = pick(4);
    if (kind > 0 && b.fx != 0) b.gy = b.gx * b.fy / b.fx;
    if (kind > 1 && b.fx != 0) b.g = b.gx * b.f / b.fx;
    return b;
  }
  std::mt19937& generator() { return generator_; }

 private:
  std::mt19937 generator_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

/// |got - wanted| in units in the last place of `wanted`; 0 where both are 0.
template <class T> double ulps(T got, rational const& wanted) {
  if (wanted == 0) return got == 0 ? 0 : std::numeric_limits<double>::infinity();
  int exponent = 0;
  (void)std::frexp(static_cast<double>(wanted), &exponent);
  rational const ulp(std::ldexp(1., exponent - std::numeric_limits<T>::digits));
  return static_cast<double>(rational(abs(rational(got) - wanted) / ulp));
}

template <class T> bool is_same(T a, T b) { return std::memcmp(&a, &b, sizeof a) == 0 || (a != a && b != b); }

}  // namespace

TEMPLATE_TEST_CASE("Newton's scaled step and determinant are within 1.5 ulp, however singular the Jacobian", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 310;
  CAPTURE(seed);
  number_source<T> source(seed);
  double worst = 0;
  int cancelled = 0;
  for (int n = 0; n < 20000; ++n) {
    bivariate<T> const b = source.functions();
    scaled_step<T> const s = newton_step(b);
    rational const f(b.f), fx(b.fx), fy(b.fy), g(b.g), gx(b.gx), gy(b.gy);
    rational const det = fx * gy - fy * gx;
    worst = std::max({worst, ulps(s.det, det), ulps(s.dx, g * fy - f * gy), ulps(s.dy, f * gx - g * fx)});
    cancelled += det != 0 && abs(det) < abs(fx * gy) * rational(4 * std::numeric_limits<T>::epsilon());
  }
  CAPTURE(worst, cancelled);
  CHECK(worst <= 1.5);
  CHECK(worst > 0.5);
  CHECK(cancelled > 1000);
}

TEMPLATE_TEST_CASE("a step over its determinant solves the linear equations exactly where nothing is rounded", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 311;
  CAPTURE(seed);
  number_source<T> source(seed);
  for (int n = 0; n < 2000; ++n) {
    T c[6];
    for (T& x : c) x = T(source.pick(2001) - 1000);
    bivariate<T> const b{c[0], c[1], c[2], c[3], c[4], c[5]};
    scaled_step<T> const s = newton_step(b);
    rational const dx(s.dx), dy(s.dy), det(s.det);
    REQUIRE(rational(b.fx) * dx + rational(b.fy) * dy == -det * rational(b.f));
    REQUIRE(rational(b.gx) * dx + rational(b.gy) * dy == -det * rational(b.g));
    REQUIRE(det == rational(b.fx) * rational(b.gy) - rational(b.fy) * rational(b.gx));
  }
}

TEMPLATE_TEST_CASE("a limited step is the step where it is shorter than the limit, else the limit in its direction", "",
                   float, double) {
  using T = TestType;
  unsigned const seed = 312;
  CAPTURE(seed);
  number_source<T> source(seed);
  rational const eps(std::numeric_limits<T>::epsilon());
  int whole = 0, cut = 0;
  for (int n = 0; n < 20000; ++n) {
    // det of any size whose inverse is a number, numerators of as many: the product of both may underflow
    int const most = -std::numeric_limits<T>::min_exponent;
    int const exponent = source.pick(2 * most - 40) - most + 20;
    T const numerators[2] = {source.any(), source.any()};
    scaled_step<T> s{0, 0, std::ldexp(T(0.5) + T(source.pick(1000)) / 2000, exponent)};
    if (source.pick(2) == 0) s.det = -s.det;
    s.dx = std::ldexp(numerators[0], std::max(exponent, -most + 60 + std::numeric_limits<T>::digits));
    s.dy = std::ldexp(numerators[1], std::max(exponent, -most + 60 + std::numeric_limits<T>::digits));
    if (!std::isfinite(s.dx) || !std::isfinite(s.dy)) continue;
    T const limits[2] = {std::ldexp(T(1), -source.pick(9)), T(source.pick(1000) + 1) / 500};
    limited_step<T> const step = limit_step(s, limits[0], limits[1]);
    T const got[2] = {step.dx, step.dy}, undivided[2] = {s.dx, s.dy};
    for (int a = 0; a < 2; ++a) {
      rational const wanted = rational(undivided[a]) / rational(s.det), limit(limits[a]);
      CAPTURE(undivided[a], s.det, limits[a], got[a]);
      REQUIRE(std::fabs(got[a]) <= limits[a]);
      if (abs(wanted) < limit) {
        REQUIRE(abs(rational(got[a]) - wanted) <=
                abs(wanted) * eps * rational(1001, 1000) + rational(std::numeric_limits<T>::denorm_min()));
        ++whole;
      } else if (abs(wanted) > limit * (1 + eps)) {
        REQUIRE(got[a] == (wanted < 0 ? -limits[a] : limits[a]));
        ++cut;
      }
    }
  }
  CAPTURE(whole, cut);
  CHECK(whole > 10000);
  CHECK(cut > 5000);
}

TEMPLATE_TEST_CASE("a limited step is a number for all finite numerators and determinants, at most the limit", "",
                   float, double) {
  using T = TestType;
  using limits = std::numeric_limits<T>;
  std::vector<T> numbers;
  for (T const x : {T(0), limits::denorm_min(), limits::min() / 4, limits::min(), limits::epsilon(), T(0.3), T(1), T(3),
                    limits::max() / 4, limits::max()}) {
    numbers.push_back(x);
    numbers.push_back(-x);
  }
  for (T const dx : numbers) {
    for (T const det : numbers) {
      for (T const limit : {limits::min(), T(0x1p-10), T(0.5), T(2)}) {
        CAPTURE(dx, det, limit);
        limited_step<T> const step = limit_step({dx, T(0), det}, limit, T(1));
        REQUIRE(std::fabs(step.dx) <= limit);
        REQUIRE(std::fabs(step.dy) <= 1);
        if (det == 0) {
          REQUIRE(std::fabs(step.dx) == limit);  // no direction to trust, but away from here
          REQUIRE(std::fabs(step.dy) == 1);
        } else if (std::fabs(det) <= T(1) / limits::max()) {
          REQUIRE(step.dy == 1);  // 0 times an inverse that overflows
        } else if (std::fabs(det) >= limits::min()) {
          REQUIRE(step.dy == 0);
          REQUIRE((step.dx == 0 || (step.dx < 0) == ((dx < 0) != (det < 0))));
        }
      }
    }
  }
}

TEMPLATE_TEST_CASE("every lane of a pack takes the limited step of the scalar", "", (pack<float, 8>), (pack<float, 16>),
                   (pack<double, 8>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr std::size_t lanes = lanes_v<P>;
  unsigned const seed = 313;
  CAPTURE(seed);
  number_source<T> source(seed);
  for (int n = 0; n < 2000; ++n) {
    bivariate<T> one[lanes];
    T c[6][lanes], limit[lanes];
    for (std::size_t i = 0; i < lanes; ++i) {
      bivariate<T> const& b = one[i] = source.functions();
      T const numbers[6] = {b.f, b.fx, b.fy, b.g, b.gx, b.gy};
      for (std::size_t k = 0; k < 6; ++k) c[k][i] = numbers[k];
      limit[i] = std::ldexp(T(1), -source.pick(9));
    }
    bivariate<P> const all{P::load(c[0]), P::load(c[1]), P::load(c[2]), P::load(c[3]), P::load(c[4]), P::load(c[5])};
    scaled_step<P> const s = newton_step(all);
    limited_step<P> const step = limit_step(s, P::load(limit), P(T(2)));
    for (std::size_t i = 0; i < lanes; ++i) {
      scaled_step<T> const alone = newton_step(one[i]);
      limited_step<T> const wanted = limit_step(alone, limit[i], T(2));
      int const k = int(i);
      REQUIRE((is_same(s.dx[k], alone.dx) && is_same(s.dy[k], alone.dy) && is_same(s.det[k], alone.det)));
      REQUIRE((is_same(step.dx[k], wanted.dx) && is_same(step.dy[k], wanted.dy)));
    }
  }
}
