// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/core/affine.hpp>
#include <patchrt/numbers/pack.hpp>

#include <boost/multiprecision/cpp_int.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

using namespace patchrt;
using patchrt::test::contains_text;

namespace {

using rational = boost::multiprecision::cpp_rational;
struct exact_vector {
  rational at[3];
};

template <class T> exact_vector exactly(vec3<T> const& v) { return {{rational(v.x), rational(v.y), rational(v.z)}}; }

/// The image of p, and of every component the sum of the terms' magnitudes.
template <class T> exact_vector image(affine<T> const& a, exact_vector const& p, bool moved, bool magnitudes = false) {
  exact_vector r;
  for (int k = 0; k < 3; ++k) {
    rational const terms[4] = {rational(a.x[k]) * p.at[0], rational(a.y[k]) * p.at[1], rational(a.z[k]) * p.at[2],
                               moved ? rational(a.translation[k]) : rational(0)};
    for (rational const& t : terms) r.at[k] += magnitudes ? rational(abs(t)) : t;
  }
  return r;
}

template <class T> double errors_in_eps(vec3<T> const& got, exact_vector const& wanted, exact_vector const& scale) {
  double worst = 0;
  for (int k = 0; k < 3; ++k) {
    rational const off = abs(rational(rational(got[k]) - wanted.at[k]));
    if (off == 0) continue;
    REQUIRE(scale.at[k] != 0);
    worst =
        std::max(worst, static_cast<double>(rational(off / scale.at[k])) / double(std::numeric_limits<T>::epsilon()));
  }
  return worst;
}

template <class T, class Generator> vec3<T> random_vector(Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  std::uniform_int_distribution<int> e(-8, 8);
  vec3<T> v;
  for (int k = 0; k < 3; ++k) v[k] = T(std::ldexp(d(g), e(g)));
  return v;
}

template <class T, class Generator> affine<T> random_map(Generator& g) {
  affine<T> a;
  a.x = random_vector<T>(g);
  a.y = random_vector<T>(g);
  a.z = random_vector<T>(g);
  a.translation = random_vector<T>(g);
  return a;
}

template <class T> double largest_entry(affine<T> const& a) {
  double most = 0;
  for (vec3<T> const& v : {a.x, a.y, a.z})
    for (int k = 0; k < 3; ++k) most = std::max(most, std::fabs(double(v[k])));
  return most;
}

/// max |a b - 1|, the linear parts', over |a| |b|.
template <class T> double distance_from_identity(affine<T> const& a, affine<T> const& b) {
  double worst = 0;
  for (int j = 0; j < 3; ++j) {
    vec3<T> const column = j == 0 ? b.x : j == 1 ? b.y : b.z;
    exact_vector const e = image(a, exactly(column), false), size = image(a, exactly(absolute(column)), false, true);
    for (int k = 0; k < 3; ++k)
      worst = std::max(worst, std::fabs(static_cast<double>(rational(e.at[k] - (j == k)))) /
                                  std::max(1., static_cast<double>(size.at[k])));
  }
  return worst;
}

}  // namespace

TEMPLATE_TEST_CASE("points and vectors are mapped within 1.5 eps of the terms' magnitudes", "", float, double) {
  using T = TestType;
  unsigned const seed = 1;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst = 0;
  for (int n = 0; n < 2000; ++n) {
    auto const a = random_map<T>(g);
    auto const p = random_vector<T>(g);
    worst = std::max(
        worst, errors_in_eps(transform_point(a, p), image(a, exactly(p), true), image(a, exactly(p), true, true)));
    worst = std::max(
        worst, errors_in_eps(transform_vector(a, p), image(a, exactly(p), false), image(a, exactly(p), false, true)));
  }
  CAPTURE(worst);
  CHECK(worst <= 1.5 * (1 + 4 * double(std::numeric_limits<T>::epsilon())));
  CHECK(worst > 0.4);
}

TEMPLATE_TEST_CASE("a ray's points are mapped to the points of its image at the same t", "", float, double) {
  using T = TestType;
  unsigned const seed = 2;
  CAPTURE(seed);
  std::mt19937 g(seed);
  double worst = 0;
  for (int n = 0; n < 1000; ++n) {
    auto const a = random_map<T>(g);
    ray<T> const r{random_vector<T>(g), random_vector<T>(g), T(0.25), T(7)};
    ray<T> const s = transform(a, r);
    REQUIRE((s.t_min == r.t_min && s.t_max == r.t_max));
    exact_vector at, size, place;
    for (int k = 0; k < 3; ++k) {
      at.at[k] = rational(r.origin[k]) + 3 * rational(r.direction[k]);
      size.at[k] = abs(rational(r.origin[k])) + 3 * abs(rational(r.direction[k]));
      place.at[k] = rational(s.origin[k]) + 3 * rational(s.direction[k]);
    }
    exact_vector const wanted = image(a, at, true), scale = image(a, size, true, true);
    for (int k = 0; k < 3; ++k)
      worst = std::max(worst, static_cast<double>(rational(abs(rational(place.at[k] - wanted.at[k])) / scale.at[k])));
  }
  CHECK(worst <= 1.5001 * double(std::numeric_limits<T>::epsilon()));
}

TEMPLATE_TEST_CASE("a map after its inverse is the identity to a few eps of what was added", "", float, double) {
  using T = TestType;
  unsigned const seed = 3;
  CAPTURE(seed);
  std::mt19937 g(seed);
  T const eps = std::numeric_limits<T>::epsilon();
  for (int n = 0; n < 2000; ++n) {
    auto const turn = affine<T>::rotation(random_vector<T>(g), T(n));
    vec3<T> factors = random_vector<T>(g);
    factors.x = factors.x * std::ldexp(T(1), n % 40 - 20);
    auto const a = affine<T>::shift(random_vector<T>(g)) * turn * affine<T>::scaling(factors);
    auto const b = inverse(a);
    REQUIRE(distance_from_identity(a, b) < 12 * double(eps));
    REQUIRE(distance_from_identity(b, a) < 12 * double(eps));
    auto const p = random_vector<T>(g);
    vec3<T> const back = transform_point(b, transform_point(a, p));
    T const size = T(largest_entry(b)) * (sum_of_magnitudes(transform_point(a, p)) + sum_of_magnitudes(a.translation));
    for (int k = 0; k < 3; ++k) REQUIRE(std::fabs(back[k] - p[k]) <= 16 * eps * (size + sum_of_magnitudes(p)));
  }
}

TEMPLATE_TEST_CASE("the inverse loses no more than the determinant's cancelled digits", "", float, double) {
  using T = TestType;
  unsigned const seed = 4;
  CAPTURE(seed);
  std::mt19937 g(seed);
  T const eps = std::numeric_limits<T>::epsilon();
  int regular = 0;
  for (int n = 0; n < 2000; ++n) {
    auto a = random_map<T>(g);
    T const near = std::ldexp(T(1), -(n % 12));
    a.z = a.x + a.y + scale(a.z, near);  // nearly in one plane
    affine<T> b;
    try {
      b = inverse(a);
    } catch (std::invalid_argument const&) {
      continue;
    }
    ++regular;
    vec3<T> const c = cross(a.y, a.z);
    double const lost = double(dot(absolute(a.x), absolute(c))) / std::fabs(double(dot(a.x, c)));
    REQUIRE(distance_from_identity(a, b) < 12 * double(eps) * lost);
  }
  CHECK(regular > 1900);
}

TEMPLATE_TEST_CASE("inverses of powers of two, of permutations and of tiny and huge maps are exact", "", float,
                   double) {
  using T = TestType;
  affine<T> a{{0, 0, 4}, {-2, 0, 0}, {0, T(0.5), 0}, {3, 5, 7}};
  CHECK((inverse(a) == affine<T>{{0, T(-0.5), 0}, {0, 0, 2}, {T(0.25), 0, 0}, {T(-1.75), T(1.5), -10}}));
  T const huge = std::ldexp(T(1), std::numeric_limits<T>::max_exponent - 3), tiny = 1 / huge;
  for (T const x : {huge, tiny})
    for (T const y : {huge, T(1), tiny}) {
      auto const m = affine<T>::scaling({x, y, x});
      CHECK((inverse(m) == affine<T>::scaling({1 / x, 1 / y, 1 / x})));
    }
}

TEMPLATE_TEST_CASE("a normal after a map is at right angles to the mapped tangents", "", float, double) {
  using T = TestType;
  unsigned const seed = 5;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int n = 0; n < 1000; ++n) {
    auto const a = random_map<T>(g);
    vec3<T> const u = random_vector<T>(g), v = random_vector<T>(g), normal = cross(u, v);
    affine<T> b;
    try {
      b = inverse(a);
    } catch (std::invalid_argument const&) {
      continue;
    }
    vec3<T> const m = transform_normal(b, normal);
    T const size = T(largest_entry(a) * largest_entry(b)) * sum_of_magnitudes(normal);
    T const det = std::fabs(dot(a.x, cross(a.y, a.z)));
    T const terms = dot(absolute(a.x), absolute(cross(a.y, a.z)));
    T const bound = 64 * std::numeric_limits<T>::epsilon() * size * terms / det;
    REQUIRE(std::fabs(dot(m, transform_vector(a, u))) <= bound * sum_of_magnitudes(u));
    REQUIRE(std::fabs(dot(m, transform_vector(a, v))) <= bound * sum_of_magnitudes(v));
  }
  affine<T> const stretch = affine<T>::scaling({2, 1, 1});
  CHECK((transform_normal(inverse(stretch), vec3<T>{1, 1, 0}) == vec3<T>{T(0.5), 1, 0}));
}

TEMPLATE_TEST_CASE("a rotation turns counterclockwise about its axis", "", float, double) {
  using T = TestType;
  T const quarter = T(1.5707963267948966), eps = std::numeric_limits<T>::epsilon();
  auto const close = [&](vec3<T> const& a, vec3<T> const& b, T size = 1) {
    return sum_of_magnitudes(a - b) < 4 * eps * size;
  };
  CHECK(close(transform_vector(affine<T>::rotation({0, 0, 3}, quarter), vec3<T>{1, 0, 0}), {0, 1, 0}));
  CHECK(close(transform_vector(affine<T>::rotation({2, 0, 0}, quarter), vec3<T>{0, 1, 0}), {0, 0, 1}));
  CHECK(close(transform_vector(affine<T>::rotation({0, 1, 0}, quarter), vec3<T>{0, 0, 1}), {1, 0, 0}));
  auto const third = affine<T>::rotation({1, 1, 1}, 4 * quarter / 3);
  CHECK(close(transform_vector(third, vec3<T>{1, 2, 3}), {3, 1, 2}, 6));
}

TEMPLATE_TEST_CASE("the box of a mapped box holds the images of its points, and each side touches one", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 6;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  T const eps = std::numeric_limits<T>::epsilon();
  for (int n = 0; n < 2000; ++n) {
    auto a = random_map<T>(g);
    if (n % 4 == 0) a.x.y = a.y.x = a.z.x = 0;
    box<T> b = merge(box<T>::empty(), random_vector<T>(g));
    b = merge(b, random_vector<T>(g));
    box<T> const r = transform(a, b);
    exact_vector lo, hi, size;
    for (int corner = 0; corner < 8; ++corner) {
      vec3<T> const p{corner & 1 ? b.hi.x : b.lo.x, corner & 2 ? b.hi.y : b.lo.y, corner & 4 ? b.hi.z : b.lo.z};
      exact_vector const q = image(a, exactly(p), true), m = image(a, exactly(p), true, true);
      vec3<T> const computed = transform_point(a, p);
      for (int k = 0; k < 3; ++k) {
        REQUIRE((rational(r.lo[k]) <= q.at[k] && q.at[k] <= rational(r.hi[k])));
        REQUIRE((r.lo[k] <= computed[k] && computed[k] <= r.hi[k]));
        if (corner == 0 || q.at[k] < lo.at[k]) lo.at[k] = q.at[k];
        if (corner == 0 || q.at[k] > hi.at[k]) hi.at[k] = q.at[k];
        if (corner == 0 || m.at[k] > size.at[k]) size.at[k] = m.at[k];
      }
    }
    for (int k = 0; k < 3; ++k) {
      rational const slack = 8 * rational(eps) * size.at[k];
      REQUIRE((lo.at[k] - rational(r.lo[k]) <= slack && rational(r.hi[k]) - hi.at[k] <= slack));
    }
    vec3<T> const inside{T(std::min(double(b.hi.x), double(b.lo.x) + unit(g) * double(b.hi.x - b.lo.x))), b.lo.y,
                         b.hi.z};
    REQUIRE(contains(r, box<T>{transform_point(a, inside), transform_point(a, inside)}));
  }
}

TEMPLATE_TEST_CASE("a mapped box stays empty, and is infinite where the map takes its infinite sides", "", float,
                   double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity();
  auto const turn = affine<T>{{0, 1, 0}, {-1, 0, 0}, {0, 0, 2}, {1, 2, 3}};
  CHECK(is_empty(transform(turn, box<T>::empty())));
  box<T> const r = transform(turn, box<T>{{-1, -1, -inf}, {1, 1, inf}});
  CHECK((r.lo.z == -inf && r.hi.z == inf));
  CHECK((r.lo.x <= 0 && r.lo.x > -64 * std::numeric_limits<T>::epsilon()));
  CHECK((r.hi.y >= 3 && r.hi.y < 3 + 64 * std::numeric_limits<T>::epsilon()));
  box<T> const half = transform(turn, box<T>{{0, -1, -1}, {inf, 1, 1}});
  CHECK((half.hi.y == inf && half.lo.y > T(1.99) && half.lo.x > T(-0.01) && half.hi.x < T(2.01)));
}

TEMPLATE_TEST_CASE("a map that cannot be undone is refused with the reason", "", float, double) {
  using T = TestType;
  constexpr T inf = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
  using a = affine<T>;
  CHECK_THROWS_AS(inverse(a::scaling({1, 0, 1})), std::invalid_argument);
  CHECK_THROWS_WITH(inverse(a::scaling({1, 0, 1})), contains_text("column 1 is 0"));
  CHECK_THROWS_WITH(inverse(a{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {}}), contains_text("determinant is 0"));
  CHECK_THROWS_WITH(inverse(a{{T(0.1), T(0.2), T(0.3)}, {T(0.3), T(0.6), T(0.9)}, {1, 0, 0}, {}}),
                    contains_text("singular"));
  CHECK_THROWS_WITH(inverse(a::scaling({nan, 1, 1})), contains_text("not finite"));
  CHECK_THROWS_WITH(inverse(a::shift({0, inf, 0})), contains_text("not finite"));
  CHECK_THROWS_WITH(inverse(a::scaling(vec3<T>(std::numeric_limits<T>::denorm_min()))), contains_text("overflows"));
}

TEMPLATE_TEST_CASE("a lane of a pack is mapped as one number is, bit for bit, by one map or one a lane", "",
                   (pack<float, 16>), (pack<double, 8>)) {
  using P = TestType;
  using T = lane_t<P>;
  constexpr int n = lanes_v<P>;
  unsigned const seed = 7;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const load = [&](vec3<T> const(&v)[n]) {
    T at[3][n];
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 3; ++k) at[k][i] = v[i][k];
    return vec3<P>{P::load(at[0]), P::load(at[1]), P::load(at[2])};
  };
  int differ = 0;
  for (int round = 0; round < 500; ++round) {
    affine<T> maps[n];
    vec3<T> p[n], x[n], y[n], z[n], t[n];
    for (int i = 0; i < n; ++i) {
      maps[i] = random_map<T>(g);
      p[i] = random_vector<T>(g);
      x[i] = maps[i].x, y[i] = maps[i].y, z[i] = maps[i].z, t[i] = maps[i].translation;
    }
    affine<P> const each{load(x), load(y), load(z), load(t)};
    vec3<P> const q = load(p);
    vec3<P> const got[6] = {transform_point(maps[0], q), transform_vector(maps[0], q), transform_normal(maps[0], q),
                            transform_point(each, q),    transform_vector(each, q),    transform_normal(each, q)};
    for (int i = 0; i < n; ++i) {
      vec3<T> const wanted[6] = {transform_point(maps[0], p[i]),  transform_vector(maps[0], p[i]),
                                 transform_normal(maps[0], p[i]), transform_point(maps[i], p[i]),
                                 transform_vector(maps[i], p[i]), transform_normal(maps[i], p[i])};
      for (int f = 0; f < 6; ++f) {
        vec3<T> const lane{got[f].x[i], got[f].y[i], got[f].z[i]};
        differ += std::memcmp(&lane, &wanted[f], sizeof lane) != 0;
      }
    }
  }
  CHECK(differ == 0);
}
