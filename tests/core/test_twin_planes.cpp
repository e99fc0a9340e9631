// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/core/twin_planes.hpp>
#include <patchrt/numbers/pack.hpp>

#include <cmath>
#include <random>

using namespace patchrt;

namespace {

template <class T, class Generator> vec3<T> random_vector(Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  vec3<T> v;
  v.x = T(d(g));
  v.y = T(d(g));
  v.z = T(d(g));
  return v;
}

template <class T> T norm(vec3<T> const& v) { return std::sqrt(dot(v, v)); }

/// Random directions, and the ones that choices of an axis go wrong at.
template <class T> std::vector<vec3<T>> directions() {
  std::mt19937 g(5);
  std::vector<vec3<T>> all;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x || y || z) all.push_back({T(x), T(y), T(z)});
      }
    }
  }
  for (int n = 0; n < 1000; ++n) all.push_back(random_vector<T>(g));
  for (int n = 0; n < 100; ++n) {
    auto d = random_vector<T>(g);
    d[n % 3] *= T(1e-12);
    all.push_back(T(std::ldexp(1, n % 40 - 20)) * d);
  }
  return all;
}

}  // namespace

TEMPLATE_TEST_CASE("the planes' normals are orthogonal to the direction and to each other, and never short", "", float,
                   double) {
  using T = TestType;
  T const eps = std::numeric_limits<T>::epsilon();
  for (vec3<T> const& d : directions<T>()) {
    vec3<T> n1, n2;
    plane_normals(d, n1, n2);
    CAPTURE(d.x, d.y, d.z);
    REQUIRE(norm(n1) >= std::sqrt(T(2) / 3) * norm(d) * (1 - 4 * eps));
    REQUIRE(norm(n1) <= norm(d) * (1 + 4 * eps));
    REQUIRE(norm(n2) == Approx(norm(n1) * norm(d)).epsilon(8 * eps));
    REQUIRE(std::abs(dot(n1, d)) <= 2 * eps * norm(n1) * norm(d));
    REQUIRE(std::abs(dot(n2, d)) <= 4 * eps * norm(n2) * norm(d));
    REQUIRE(std::abs(dot(n1, n2)) <= 4 * eps * norm(n1) * norm(n2));
  }
}

TEMPLATE_TEST_CASE("a ray lies in its two planes", "", float, double) {
  using T = TestType;
  unsigned const seed = 6;
  CAPTURE(seed);
  std::mt19937 g(seed);
  T const eps = std::numeric_limits<T>::epsilon();
  for (vec3<T> const& d : directions<T>()) {
    auto const o = T(5) * random_vector<T>(g);
    auto const p = make_twin_planes(o, d);
    T const size = norm(o) + 3 * norm(d);
    for (T const t : {T(0), T(1), T(3)}) {
      vec3<T> const x = fma(t, d, o);
      REQUIRE(std::abs(dot(p.n1, x) + p.d1) <= 8 * eps * norm(p.n1) * size);
      REQUIRE(std::abs(dot(p.n2, x) + p.d2) <= 8 * eps * norm(p.n2) * size);
    }
    // A point beside the ray is off at least one plane: together they hold the ray alone.
    vec3<T> const beside = o + p.n1 / norm(p.n1) * norm(d);
    REQUIRE(std::abs(dot(p.n1, beside) + p.d1) > T(0.5) * norm(p.n1) * norm(d) - 16 * eps * norm(p.n1) * size);
  }
}

TEMPLATE_TEST_CASE("a zero direction gives zero normals", "", float, double) {
  using T = TestType;
  auto const p = make_twin_planes(vec3<T>{1, 2, 3}, vec3<T>{0, 0, 0});
  CHECK((p.n1 == vec3<T>{0, 0, 0}));
  CHECK((p.n2 == vec3<T>{0, 0, 0}));
}

TEMPLATE_TEST_CASE("primary planes hold their ray, n1 for the whole column and n2 for the whole row", "", float,
                   double) {
  using T = TestType;
  unsigned const seed = 7;
  CAPTURE(seed);
  std::mt19937 g(seed);
  T const eps = std::numeric_limits<T>::epsilon();
  for (int n = 0; n < 300; ++n) {
    auto const eye = T(5) * random_vector<T>(g), forward = random_vector<T>(g);
    auto const right = T(0.3) * random_vector<T>(g), up = T(0.3) * random_vector<T>(g);
    std::uniform_real_distribution<double> image(-1, 1);
    T const x = T(image(g)), y = T(image(g)), other = T(image(g));
    auto const p = make_primary_planes(eye, forward, right, up, x, y);
    vec3<T> const d = fma(x, right, fma(y, up, forward));
    for (T const t : {T(0), T(1), T(4)}) {
      vec3<T> const q = fma(t, d, eye);
      T const size = 8 + norm(q);
      REQUIRE(std::abs(dot(p.n1, q) + p.d1) <= 8 * eps * size);
      REQUIRE(std::abs(dot(p.n2, q) + p.d2) <= 8 * eps * size);
    }
    auto const column = make_primary_planes(eye, forward, right, up, x, other);
    auto const row = make_primary_planes(eye, forward, right, up, other, y);
    REQUIRE(column.n1 == p.n1);
    REQUIRE(column.d1 == p.d1);
    REQUIRE(row.n2 == p.n2);
    REQUIRE(row.d2 == p.d2);
  }
}

TEMPLATE_TEST_CASE("every lane of a pack has the planes of the scalar", "", (pack<float, 8>), (pack<double, 8>)) {
  using T = TestType;
  using L = lane_t<T>;
  auto const all = directions<L>();
  for (std::size_t n = 0; n + 8 <= all.size(); n += 8) {
    L x[8], y[8], z[8];
    for (std::size_t k = 0; k < 8; ++k) {
      x[k] = all[n + k].x;
      y[k] = all[n + k].y;
      z[k] = all[n + k].z;
    }
    vec3<T> const d{T::load(x), T::load(y), T::load(z)};
    auto const p = make_twin_planes(d, d);
    for (int k = 0; k < 8; ++k) {
      auto const q = make_twin_planes(all[n + std::size_t(k)], all[n + std::size_t(k)]);
      REQUIRE((vec3<L>{p.n1.x[k], p.n1.y[k], p.n1.z[k]} == q.n1));
      REQUIRE((vec3<L>{p.n2.x[k], p.n2.y[k], p.n2.z[k]} == q.n2));
      REQUIRE(p.d1[k] == q.d1);
      REQUIRE(p.d2[k] == q.d2);
    }
  }
}
