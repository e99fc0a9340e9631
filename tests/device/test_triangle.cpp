// SPDX-License-Identifier: MIT
#include <device/kernels/triangle.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Triangles of all kinds: in a cube, thin, flat, with equal vertices, and of nasty numbers.
template <class T> std::vector<triangle<T>> nasty_triangles(number_source& source, int count) {
  std::vector<triangle<T>> triangles;
  for (int i = 0; i < count; ++i) {
    triangle<T> t{source.point(T(4)), source.point(T(4)), source.point(T(4))};
    switch (i % 8) {
      case 1:
        t.c = t.b + source.point(T(1e-5));
        break;
      case 2:
        t.c = fma(T(0.5), t.b - t.a, t.a);
        break;
      case 3:
        (source.below(2) ? t.a : t.c) = t.b;
        break;
      case 4:
        t.a.z = t.b.z = t.c.z;
        break;
      case 5:
        t = {source.nasty_point<T>(8), source.nasty_point<T>(8), source.nasty_point<T>(8)};
        break;
      default:
        break;
    }
    triangles.push_back(t);
  }
  return triangles;
}

/// Rays at the triangles: inside, at edges and vertices, along them, beside them, and nasty ones.
template <class T> std::vector<ray<T>> rays_at(number_source& source, std::vector<triangle<T>> const& triangles) {
  auto rays = nasty_rays<T>(source, int(triangles.size()));
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (i % 7 == 0) continue;
    auto const& t = triangles[i];
    T u = source.uniform(T(0), T(1)), v = source.uniform(T(0), T(1));
    if (i % 3 == 0) u = T(source.below(2)), v = T(0);
    if (i % 3 == 1 && u + v > 1) u = 1 - u, v = 1 - v;
    vec3<T> const aim = position(t, u, v), origin = source.point(T(8));
    rays[i] = {origin, aim - origin, T(0), source.below(2) ? T(10) : std::numeric_limits<T>::infinity()};
    if (i % 11 == 0) rays[i].direction[source.below(3)] = 0;
    if (i % 13 == 0) rays[i].direction = t.b - t.a;
  }
  return rays;
}

template <class Form, class T> void check_form(std::string const& name) {
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 3000;
  auto const triangles = nasty_triangles<T>(source, count);
  auto const rays = rays_at(source, triangles);
  std::vector<typename Form::template prepared<T>> prepared;
  for (auto const& t : triangles) prepared.push_back(Form::prepare(t));
  auto const results = check_same_in_every_build<T>(
      "triangle", name + suffix<T>(), count, {readable(prepared), readable(rays)}, [&](T* out) {
        return triangle_form_kernel<Form, T>{prepared.data(), rays.data(), out};
      });
  T hits = 0, fronts = 0;
  for (std::size_t i = 0; i < results.size(); i += triangle_form_kernel<Form, T>::outputs) {
    hits += results[i];
    fronts += results[i + 4];
  }
  CHECK(hits > count / 4);
  CHECK(fronts > hits / 4);
  CHECK(fronts < hits * T(0.75));
}

}  // namespace

TEMPLATE_TEST_CASE("triangles have the same normals, areas and departures from every compiler and from PTX", "", float,
                   double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 2000;
  auto const triangles = nasty_triangles<T>(source, count);
  auto const rays = rays_at(source, triangles);
  auto const results = check_same_in_every_build<T>(
      "triangle", "triangle_shape" + suffix<T>(), count, {readable(triangles), readable(rays)}, [&](T* out) {
        return triangle_shape_kernel<T>{triangles.data(), rays.data(), out};
      });
  CHECK(finite_share(results) > 0.7);
  T with_area = 0;
  for (std::size_t i = 0; i < results.size(); i += triangle_shape_kernel<T>::outputs) with_area += results[i];
  CHECK(with_area > count / 2);
  CHECK(with_area < count * T(0.95));
}

TEMPLATE_TEST_CASE("the engine form's records have the same bits from every compiler and from PTX", "", float, double) {
  using T = TestType;
  using kernel = triangle_prepare_kernel<engine_form, T>;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 2000;
  auto const triangles = nasty_triangles<T>(source, count);
  auto const results = check_same_in_every_build<T>(
      "triangle", "prepare_engine" + suffix<T>(), count, {readable(triangles)}, [&](T* out) {
        return kernel{triangles.data(), reinterpret_cast<typename kernel::prepared*>(out)};
      });
  CHECK(finite_share(results) > 0.7);
}

TEMPLATE_TEST_CASE("the engine form gives the same bits from every compiler and from PTX", "", float, double) {
  check_form<engine_form, TestType>("engine");
}

TEMPLATE_TEST_CASE("Moller and Trumbore's form gives the same bits from every compiler and from PTX", "", float,
                   double) {
  check_form<moller_trumbore_form, TestType>("moller_trumbore");
}

TEMPLATE_TEST_CASE("the watertight form gives the same bits from every compiler and from PTX", "", float, double) {
  check_form<watertight_form, TestType>("watertight");
}
