// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/shapes/make_quadric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

using namespace patchrt;

namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

class generator {
 public:
  explicit generator(unsigned seed) : bits_(seed) {}
  double uniform(double lo, double hi) { return lo + (hi - lo) * (double(bits_() >> 11) * 0x1p-53); }
  vec3<double> vector(double lo, double hi) {
    double const x = uniform(lo, hi), y = uniform(lo, hi), z = uniform(lo, hi);
    return {x, y, z};
  }
  std::size_t below(std::size_t n) { return std::size_t(bits_() >> 20) % n; }
  affine<double> place() {
    auto a = affine<double>::rotation(vector(-1, 1), uniform(0, 6)) * affine<double>::scaling(vector(0.2, 3)) *
             affine<double>::rotation(vector(-1, 1), uniform(0, 6)) * affine<double>::scaling(vector(0.2, 3));
    a.translation = vector(-5, 5);
    return a;
  }

 private:
  std::mt19937_64 bits_;
};

/// Points of a clipped quadric, in object space, on the line through p along d: crossings in the box and, capped,
/// points of its faces inside.
std::vector<vec3<double>> points_on_line(clipped_quadric<double> const& s, vec3<double> const& p,
                                         vec3<double> const& d) {
  std::vector<vec3<double>> all;
  auto const offer = [&](double t, int fixed, double plane) {
    vec3<double> x = fma(t, d, p);
    if (fixed >= 0) x[fixed] = plane;
    else if (!(std::fabs(evaluate(s.form, x)) < 1e-12)) return;
    for (int k = 0; k < 3; ++k)
      if (!(s.clip.lo[k] <= x[k] && x[k] <= s.clip.hi[k])) return;
    all.push_back(x);
  };
  vec3<double> const g = half_gradient(s.form, p);
  double const a = dot(d, multiply(s.form, d)), h = dot(d, g), c = evaluate(s.form, p), root = std::sqrt(h * h - a * c);
  if (std::fabs(a) > 1e-9) {
    offer((-h - root) / a, -1, 0);
    offer((-h + root) / a, -1, 0);
  } else if (h != 0) {
    offer(-c / (2 * h), -1, 0);
  }
  if (s.capped) {
    for (int k = 0; k < 3; ++k)
      for (double const plane : {s.clip.lo[k], s.clip.hi[k]}) {
        if (std::isinf(plane) || d[k] == 0) continue;
        double const t = (plane - p[k]) / d[k];
        if (evaluate(s.form, fma(t, d, p)) <= 0) offer(t, k, plane);
      }
  }
  return all;
}

/// As a call of its own: inlined, g++ 12 at -O3 takes the numbers for those before they were rounded.
PATCHRT_OUTLINE clipped_quadric<float> in_float(clipped_quadric<double> const& s) { return convert_quadric<float>(s); }

clipped_quadric<double> random_surface(generator& g, std::size_t kind, affine<double> const& at) {
  ends const end = g.below(2) ? ends::capped : ends::open;
  double const lo = g.uniform(-2, 0), hi = g.uniform(0.1, 2);
  switch (kind) {
    case 0:
      return make_sphere(at);
    case 1:
      return make_cylinder(at, lo, hi, end);
    case 2:
      return make_cone(at, g.below(2) ? 0 : lo, hi, end);
    case 3:
      return make_paraboloid(at, hi, end);
    case 4:
      return make_hyperboloid_one_sheet(at, lo, hi, end);
    case 5:
      return make_hyperboloid_two_sheets(at, lo - 1, hi + 1, end);
    case 6:
      return make_plane(at, hi, hi + 1);
    case 7:
      return make_quadric(unit_sphere<double>(), at, {{lo, -0.5, -2}, {2, hi, 0.5}}, end);
    case 8:
      return make_quadric(unit_cone<double>(), at, {{-1, lo, -1}, {1, hi, 1}}, end);
    default: {
      quadric<double> q{g.vector(-1, 1), g.vector(-1, 1), g.vector(-1, 1), 0};
      q.constant = -evaluate(q, g.vector(-0.5, 0.5));  // through a point of the box
      try {
        return make_quadric(q, at, {{-1, -1, -1}, {1, 1, 1}}, end);
      } catch (std::invalid_argument const&) {
        return make_sphere(at);
      }
    }
  }
}

}  // namespace

TEST_CASE("boxes of clipped quadrics hold all their points, and each side has points within 1 %") {
  unsigned const seed = 11;
  CAPTURE(seed);
  generator g(seed);
  int outside = 0, loose = 0;
  double loosest = 0;
  for (int n = 0; n < 400; ++n) {
    std::size_t const kind = std::size_t(n) % 10;
    CAPTURE(n, kind);
    affine<double> const at = g.place();
    auto const s = random_surface(g, kind, at);
    box<double> const b = bounds(s);
    REQUIRE_FALSE(is_empty(b));
    affine<double> const place = to_world(s);
    // Points from lines all over, the farthest in each direction, then from lines ever nearer to those.
    vec3<double> best[6];
    double value[6];
    std::fill(value, value + 6, -inf);
    auto const look = [&](vec3<double> const& p, vec3<double> const& d) {
      for (vec3<double> const& x : points_on_line(s, p, d)) {
        vec3<double> const y = transform_point(place, x);
        for (int k = 0; k < 3; ++k) {
          // the points themselves are right to 1e-12
          outside += !(b.lo[k] - 1e-11 <= y[k] && y[k] <= b.hi[k] + 1e-11);
          for (int side = 0; side < 2; ++side) {
            double const v = side ? y[k] : -y[k];
            if (v > value[2 * k + side]) value[2 * k + side] = v, best[2 * k + side] = x;
          }
        }
      }
    };
    // In faces and along edges too, where open surfaces may end in a corner.
    auto const look_near = [&](vec3<double> p, double radius) {
      vec3<double> d = g.vector(-1, 1);
      p = sum(p, scale(g.vector(-1, 1), radius));
      for (std::size_t flat = g.below(3); flat > 0; --flat) {
        int const k = int(g.below(3));
        double const side = g.below(2) ? s.clip.lo[k] : s.clip.hi[k];
        if (std::isfinite(side)) p[k] = side, d[k] = 0;
      }
      look(p, d);
    };
    for (int k = 0; k < 3000; ++k) look_near({0, 0, 0}, 2);
    for (int end = 0; end < 6; ++end) {
      if (value[end] == -inf) continue;
      for (double radius = 0.3; radius > 1e-3; radius *= 0.6) {
        for (int k = 0; k < 60; ++k) look_near(best[end], radius);
      }
    }
    for (int k = 0; k < 3; ++k) {
      double const size = b.hi[k] - b.lo[k];
      double const gap = std::max(b.hi[k] - value[2 * k + 1], -value[2 * k] - b.lo[k]) / size;
      loosest = std::max(loosest, gap);
      loose += gap > 0.01;
    }
  }
  CAPTURE(loosest);
  CHECK(outside == 0);
  CHECK(loose == 0);
}

TEST_CASE("boxes of ellipsoids and of segments of cylinders and cones are exact under any map") {
  unsigned const seed = 12;
  CAPTURE(seed);
  generator g(seed);
  double worst = 0;
  for (int n = 0; n < 3000; ++n) {
    CAPTURE(n);
    affine<double> const at = g.place();
    double const lo = g.uniform(-2, 0), hi = g.uniform(0, 2);
    ends const end = g.below(2) ? ends::capped : ends::open;
    box<double> const ball = bounds(make_sphere(at)), tube = bounds(make_cylinder(at, lo, hi, end)),
                      cone = bounds(make_cone(at, lo, hi, end));
    double const size = sum_of_magnitudes(at.x) + sum_of_magnitudes(at.y) + sum_of_magnitudes(at.z) + 15;
    for (int k = 0; k < 3; ++k) {
      long double const x = at.x[k], y = at.y[k], z = at.z[k], c = at.translation[k], disc = std::sqrt(x * x + y * y);
      long double const half = std::sqrt(x * x + y * y + z * z);
      auto const check = [&](box<double> const& b, long double low, long double high) {
        long double const slack = 512 * std::numeric_limits<double>::epsilon() * size;
        REQUIRE((b.lo[k] <= low && high <= b.hi[k]));
        REQUIRE((low - b.lo[k] <= slack && b.hi[k] - high <= slack));
        worst = std::max(worst, static_cast<double>((b.hi[k] - high) / size));
      };
      check(ball, c - half, c + half);
      check(tube, c - disc + std::min(lo * z, hi * z), c + disc + std::max(lo * z, hi * z));
      check(cone, c + std::min(lo * z - std::fabs(lo) * disc, hi * z - hi * disc),
            c + std::max(lo * z + std::fabs(lo) * disc, hi * z + hi * disc));
    }
  }
  CAPTURE(worst);
  CHECK(worst > 0);
}

TEST_CASE("boxes of surfaces in float are in float, and hold those in double of the same numbers") {
  unsigned const seed = 13;
  CAPTURE(seed);
  generator g(seed);
  for (int n = 0; n < 1000; ++n) {
    auto const s = in_float(random_surface(g, std::size_t(n) % 10, g.place()));
    box<float> const b = bounds(s);
    box<double> const wanted = bounds(convert_quadric<double>(s));
    for (int k = 0; k < 3; ++k) {
      REQUIRE((double(b.lo[k]) <= wanted.lo[k] && wanted.hi[k] <= double(b.hi[k])));
      double const slack = 1e-6 * (std::fabs(wanted.lo[k]) + std::fabs(wanted.hi[k]));
      REQUIRE((wanted.lo[k] - double(b.lo[k]) <= slack && double(b.hi[k]) - wanted.hi[k] <= slack));
    }
  }
  auto const tube = convert_quadric<float>(make_quadric(unit_cylinder<double>()));
  CHECK(bounds(tube).hi.z == std::numeric_limits<float>::infinity());
}

TEST_CASE("boxes are infinite where surfaces are, and only there") {
  auto const here = affine<double>::identity();
  auto const is_about = [](double got, double wanted) {
    return std::isinf(wanted) ? got == wanted : std::fabs(got - wanted) < 1e-5;
  };
  struct row {
    char const* what;
    clipped_quadric<double> surface;
    box<double> wanted;
  };
  row const rows[] = {
      {"a cylinder without ends", make_quadric(unit_cylinder<double>()), {{-1, -1, -inf}, {1, 1, inf}}},
      {"with one", make_quadric(unit_cylinder<double>(), here, between_heights(2., inf)), {{-1, -1, 2}, {1, 1, inf}}},
      {"a cone", make_cone(here, 0, inf), {{-inf, -inf, 0}, {inf, inf, inf}}},
      {"a paraboloid", make_paraboloid(here, inf), {{-inf, -inf, 0}, {inf, inf, inf}}},
      {"a plane", make_plane(here), {{-inf, -inf, 0}, {inf, inf, 0}}},
      {"a strip", make_plane(here, 2), {{-2, -inf, 0}, {2, inf, 0}}},
      {"one sheet of two", make_hyperboloid_two_sheets(here, 0, inf), {{-inf, -inf, 1}, {inf, inf, inf}}},
      {"a ball in a box without ends", make_sphere(here), {{-1, -1, -1}, {1, 1, 1}}},
      {"half of the space below a plane",
       make_quadric(unit_plane<double>(), here, {{-1, -1, -inf}, {1, 1, 5}}, ends::capped),
       {{-1, -1, -inf}, {1, 1, 0}}},
      {"a box within a ball",
       make_quadric(unit_sphere<double>(), here, {vec3<double>(-0.25), vec3<double>(0.5)}, ends::capped),
       {vec3<double>(-0.25), vec3<double>(0.5)}},
      {"a hyperbola's branch along its asymptotes",
       make_quadric({{0, 0, 0}, {0, 0, 0.5}, {0, 0, 0}, -1}, here, {{0, 0, -1}, {inf, inf, 1}}),
       {{0, 0, -1}, {inf, inf, 1}}},
      {"the same far away", make_sphere(affine<double>::shift({1e6, 0, 0})), {{1e6 - 1, -1, -1}, {1e6 + 1, 1, 1}}},
  };
  for (row const& r : rows) {
    INFO(r.what);
    box<double> const b = bounds(r.surface);
    for (int k = 0; k < 3; ++k) {
      CAPTURE(k, b.lo[k], b.hi[k]);
      CHECK(is_about(b.lo[k], r.wanted.lo[k]));
      CHECK(is_about(b.hi[k], r.wanted.hi[k]));
      CHECK((b.lo[k] <= r.wanted.lo[k] && r.wanted.hi[k] <= b.hi[k]));
    }
  }
}
