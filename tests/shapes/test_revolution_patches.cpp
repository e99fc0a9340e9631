// SPDX-License-Identifier: MIT
#include "exact_rational.hpp"
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/shapes/rational_normal.hpp>
#include <patchrt/shapes/revolution_patches.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Distance from the surface, outside positive, and the unit normal, of a point relative to the surface's centre or
/// base.
struct implicit_value {
  long double distance;
  vec3<double> normal;
};

implicit_value sphere(vec3<long double> const& p, long double radius) {
  long double const length = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
  return {length - radius, {double(p.x / length), double(p.y / length), double(p.z / length)}};
}

implicit_value torus(vec3<long double> const& p, long double major, long double minor) {
  long double const r = std::sqrt(p.x * p.x + p.y * p.y), inward = (r - major) / r;
  return sphere({p.x * inward, p.y * inward, p.z}, minor);
}

implicit_value cylinder(vec3<long double> const& p, long double radius) { return sphere({p.x, p.y, 0}, radius); }

implicit_value cone(vec3<long double> const& p, long double radius, long double height) {
  long double const r = std::sqrt(p.x * p.x + p.y * p.y), side = std::sqrt(radius * radius + height * height);
  return {(height * r + radius * (p.z - height)) / side,
          {double(p.x / r * height / side), double(p.y / r * height / side), double(radius / side)}};
}

/// Holds evaluated points against the implicit equation: patches that are within `own` of the surface, evaluated within
/// what `evaluate` states; and normals where the patches are regular.
template <class T, std::size_t Count, int M, int N, class Implicit>
void hold(std::array<rational_patch<T, M, N>, Count> const& patches, vec3<T> const& centre, double own,
          Implicit const& implicit) {
  double const eps = double(std::numeric_limits<T>::epsilon()), n = 6 * (M + N) + 4;
  long double worst = 0;
  double worst_normal = 0;
  for (auto const& p : patches) {
    double const m = double(largest_coordinate(points_of(p))), bound = own + 1.8 * m * n * eps / (2 - n * eps);
    for (int i = 0; i <= 32; ++i) {
      for (int j = 0; j <= 32; ++j) {
        T const u = T(i) / 32, v = T(j) / 32;
        vec3<T> const q = position(p, u, v);
        vec3<long double> const x{q.x - static_cast<long double>(centre.x), q.y - static_cast<long double>(centre.y),
                                  q.z - static_cast<long double>(centre.z)};
        worst = std::max(worst, std::fabs(implicit(x).distance) / bound);
        vec3<double> const regular = implicit(x).normal, got = convert_vec<double>(normal(p, u, v));
        // At the apex the normal depends on the way there.
        if (regular == regular && (M != 2 || N != 1 || j < 32))
          worst_normal = std::max(worst_normal, norm(got - regular));
      }
    }
  }
  CAPTURE(Count, worst, worst_normal, eps);
  CHECK(worst <= 1);
  CHECK(worst > 0.001L);
  CHECK(worst_normal <= 4000 * eps);
}

/// The largest distance of the exact patches' exact points from the surface, by the equation's value over its slope.
template <class T, std::size_t Count, int M, int N, class Equation>
double exact_distance(std::array<rational_patch<T, M, N>, Count> const& patches, vec3<T> const& centre,
                      Equation const& equation) {
  double worst = 0;
  for (auto const& p : patches) {
    exact_quotient const q = exactly(p);
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; j <= 8; ++j) {
        exact_point const x = value(q, rational(i, 8), rational(j, 8)) - exactly(centre);
        worst = std::max(worst, std::fabs(equation(x)));
      }
    }
  }
  return worst;
}

}  // namespace

TEMPLATE_TEST_CASE("patches of spheres, tori, cylinders and cones are within their stated distance of them", "", float,
                   double) {
  using T = TestType;
  double const eps = double(std::numeric_limits<T>::epsilon());
  vec3<T> const centre{T(0.3), T(-1.7), T(2.1)};
  double const away = norm(convert_vec<double>(centre));
  T const r = T(0.7), major = T(1.9), height = T(1.3);
  rational const radius(r), big(major), h(height);

  double const of_sphere = exact_distance(sphere_patches(centre, r), centre, [&](exact_point const& x) {
    return static_cast<double>(rational((x[0] * x[0] + x[1] * x[1] + x[2] * x[2] - radius * radius) / (2 * radius)));
  });
  CHECK(of_sphere <= 2 * eps * (away + double(r)));
  double const of_cylinder = exact_distance(cylinder_patches(centre, r, height), centre, [&](exact_point const& x) {
    return static_cast<double>(rational((x[0] * x[0] + x[1] * x[1] - radius * radius) / (2 * radius)));
  });
  CHECK(of_cylinder <= 2 * eps * (away + double(r)));
  // (x^2 + y^2 + z^2 + R^2 - r^2)^2 - 4 R^2 (x^2 + y^2), whose slope on the torus is 8 R r times the distance from the
  // axis.
  double const of_torus = exact_distance(torus_patches(centre, major, r), centre, [&](exact_point const& x) {
    rational const across = x[0] * x[0] + x[1] * x[1], a = across + x[2] * x[2] + big * big - radius * radius;
    return static_cast<double>(rational((a * a - 4 * big * big * across) / (8 * big * radius))) /
           std::sqrt(static_cast<double>(across));
  });
  CHECK(of_torus <= 3 * eps * (away + double(major) + double(r)));
  // Near the apex the equation (h r)^2 = (R (h - z))^2 says less; the base and the middle say it all.
  double worst = 0;
  for (auto const& p : cone_patches(centre, r, height)) {
    exact_quotient const q = exactly(p);
    for (int i = 0; i <= 8; ++i) {
      for (int j = 0; j < 8; ++j) {
        exact_point const x = value(q, rational(i, 8), rational(j, 8)) - exactly(centre);
        rational const down = radius * (h - x[2]);
        rational const e = (h * h * (x[0] * x[0] + x[1] * x[1]) - down * down) / (2 * down);
        worst = std::max(worst, std::fabs(static_cast<double>(e)) / double(std::sqrt(r * r + height * height)));
      }
    }
  }
  CHECK(worst <= 2 * eps * (away + double(r) + double(height)) * double(1 + r / height));
}

TEMPLATE_TEST_CASE("points evaluated on spheres, tori, cylinders and cones satisfy their equations within the bounds",
                   "", float, double) {
  using T = TestType;
  double const eps = double(std::numeric_limits<T>::epsilon());
  for (vec3<T> const& c : {vec3<T>{T(0), T(0), T(0)}, vec3<T>{T(0.3), T(-1.7), T(2.1)}}) {
    double const away = norm(convert_vec<double>(c));
    T const r = T(0.7), major = T(1.9), height = T(1.3);
    hold(sphere_patches(c, r), c, 2 * eps * (away + double(r)), [&](auto const& x) { return sphere(x, r); });
    hold(torus_patches(c, major, r), c, 3 * eps * (away + double(major) + double(r)),
         [&](auto const& x) { return torus(x, major, r); });
    hold(cylinder_patches(c, r, height), c, 2 * eps * (away + double(r)),
         [&](auto const& x) { return cylinder(x, r); });
    hold(cone_patches(c, r, height), c, 2 * eps * (away + double(r) + double(height)) * double(1 + r / height),
         [&](auto const& x) { return cone(x, r, height); });
  }
}

TEST_CASE("the patches of spheres, tori, cylinders and cones cover them once") {
  // The integral of the tangents' cross product over (u, v) is the area.
  auto const area = [](auto const& patches) {
    double sum = 0;
    constexpr int n = 64;
    for (auto const& p : patches) {
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          auto const s = evaluate(p, (i + 0.5) / n, (j + 0.5) / n);
          sum += norm(cross(s.du, s.dv)) / (n * n);
        }
      }
    }
    return sum;
  };
  double const pi = std::acos(-1.);
  vec3<double> const c{1.0, 2.0, 3.0};
  CHECK(area(sphere_patches(c, 2.)) == Approx(16 * pi).epsilon(1e-3));
  CHECK(area(torus_patches(c, 2., 0.5)) == Approx(4 * pi * pi).epsilon(1e-3));
  CHECK(area(cylinder_patches(c, 2., 3.)) == Approx(12 * pi).epsilon(1e-3));
  CHECK(area(cone_patches(c, 3., 4.)) == Approx(15 * pi).epsilon(1e-3));
}

TEMPLATE_TEST_CASE("neighbouring octants of a sphere share edges bit for bit, and each is collapsed at its pole", "",
                   float, double) {
  using T = TestType;
  auto const s = sphere_patches(vec3<T>{T(0.1), T(0.2), T(0.3)}, T(0.7));
  for (std::size_t k = 0; k < 8; ++k) {
    auto const& next = s[(k + 2) % 8];
    for (int j = 0; j <= 2; ++j) CHECK(is_same(s[k](2, j), next(0, j)));
    int const pole = k % 2 == 0 ? 0 : 2;
    for (int i = 0; i <= 2; ++i) {
      CHECK((s[k](i, pole).point == s[k % 2](0, pole).point));
      CHECK(s[k](i, pole).point.x == T(0.1));
      CHECK(s[k](i, pole).point.y == T(0.2));
      if (k % 2 == 0) CHECK(is_same(s[k](i, 2), s[k + 1](i, 0)));
    }
  }
}
