// SPDX-License-Identifier: MIT
#include <device/kernels/quadric.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

#include <patchrt/shapes/make_quadric.hpp>

using namespace patchrt;
using namespace patchrt::test;

namespace {

affine<double> random_place(number_source& source) {
  auto a = affine<double>::rotation(source.point(1.), source.uniform(0., 6.)) *
           affine<double>::scaling({source.uniform(0.5, 2.), source.uniform(0.5, 2.), source.uniform(0.5, 2.)});
  a.translation = source.point(2.);
  return a;
}

/// Of all kinds, open and capped, and every fourth with a nasty number.
template <class T> std::vector<clipped_quadric<T>> nasty_quadrics(number_source& source, int count) {
  std::vector<clipped_quadric<T>> all;
  for (int i = 0; i < count; ++i) {
    auto const at = random_place(source);
    ends const end = i % 2 ? ends::capped : ends::open;
    auto const make = [&] {
      switch (i % 9) {
        case 0:
          return make_sphere(at);
        case 1:
          return make_cylinder(at, -1, 1, end);
        case 2:
          return make_cone(at, 0, 1, end);
        case 3:
          return make_paraboloid(at, 1, end);
        case 4:
          return make_hyperboloid_one_sheet(at, -1, 1, end);
        case 5:
          return make_hyperboloid_two_sheets(at, -2, 2, end);
        case 6:
          return make_plane(at, 1, 2);
        case 7:
          return make_cone(at, -1, 1, end);
        default:
          return make_quadric(unit_sphere<double>(), at, {{-0.5, -0.75, -2}, {2, 0.25, 0.5}}, end);
      }
    };
    auto s = convert_quadric<T>(make());
    if (i % 4 == 0)
      s.form = {source.nasty_point<T>(8), source.nasty_point<T>(8), source.nasty_point<T>(8), source.nasty<T>(8)};
    if (i % 16 == 0) s.clip = {source.nasty_point<T>(4), source.nasty_point<T>(4)};
    if (i % 16 == 4) s.rows[source.below(3)] = source.nasty_point<T>(4);
    if (i % 16 == 8) s.centre = source.nasty_point<T>(4);
    all.push_back(s);
  }
  return all;
}

/// From anywhere, most of them at the places where surfaces are.
template <class T> std::vector<ray<T>> rays_at_places(number_source& source, int count) {
  auto rays = nasty_rays<T>(source, count);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (i % 3 == 0) continue;
    rays[i].origin = source.point(T(8));
    rays[i].direction = source.point(T(2)) - rays[i].origin;
    rays[i].t_min = T(0);
    rays[i].t_max = T(1000);
  }
  return rays;
}

template <class T> double share_of_ones(std::vector<T> const& results, std::size_t outputs, std::size_t at) {
  std::size_t ones = 0;
  for (std::size_t k = at; k < results.size(); k += outputs) ones += results[k] == T(1);
  return double(ones) * double(outputs) / double(results.size());
}

}  // namespace

TEMPLATE_TEST_CASE("roots of quadratics have the same bits from every compiler and from PTX", "", float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 6000;
  std::vector<T> numbers;
  for (int i = 0; i < count; ++i) {
    T const a = source.nasty<T>(20), h = source.nasty<T>(20);
    numbers.insert(numbers.end(), {a, h, i % 3 ? source.nasty<T>(20) : h * h / a});
  }
  auto const results =
      check_same_in_every_build<T>("quadric", "quadratic" + suffix<T>(), count, {readable(numbers)}, [&](T* out) {
        return quadratic_kernel<T>{numbers.data(), out};
      });
  CHECK(share_of_ones(results, 4, 2) > 0.5);
}

TEMPLATE_TEST_CASE("hits on spheres and starts from them have the same bits from every compiler and from PTX", "",
                   float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 3000;
  auto const rays = rays_at_places<T>(source, count);
  std::vector<sphere<T>> spheres;
  for (int i = 0; i < count; ++i)
    spheres.push_back({i % 5 ? source.point(T(2)) : source.nasty_point<T>(4),
                       i % 7 ? source.uniform(T(0.5), T(2)) : source.nasty<T>(3)});
  auto const results = check_same_in_every_build<T>("quadric", "sphere" + suffix<T>(), count,
                                                    {readable(rays), readable(spheres)}, [&](T* out) {
                                                      return sphere_kernel<T>{rays.data(), spheres.data(), out};
                                                    });
  CHECK(share_of_ones(results, 9, 0) > 0.1);
}

TEMPLATE_TEST_CASE("crossings of quadrics and their points have the same bits from every compiler and from PTX", "",
                   float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 4000;
  auto const rays = rays_at_places<T>(source, count);
  auto const surfaces = nasty_quadrics<T>(source, count);
  auto const all = check_same_in_every_build<T>("quadric", "crossings" + suffix<T>(), count,
                                                {readable(rays), readable(surfaces)}, [&](T* out) {
                                                  return crossings_kernel<T>{rays.data(), surfaces.data(), out};
                                                });
  CHECK(share_of_ones(all, 20, 16) > 0.1);
  CHECK(share_of_ones(all, 20, 0) > 0.01);
  std::size_t through_caps = 0;
  for (std::size_t k = 0; k < all.size(); k += 20) through_caps += all[k + 4] == T(1) && all[k + 7] != T(0);
  CHECK(through_caps > 50);
  auto const points = check_same_in_every_build<T>("quadric", "quadric_point" + suffix<T>(), count,
                                                   {readable(rays), readable(surfaces)}, [&](T* out) {
                                                     return quadric_point_kernel<T>{rays.data(), surfaces.data(), out};
                                                   });
  CHECK(share_of_ones(points, 9, 0) == share_of_ones(all, 20, 16));
}

TEMPLATE_TEST_CASE("mapped rays and boxes have the same bits from every compiler and from PTX", "", float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 3000;
  auto const rays = nasty_rays<T>(source, count);
  std::vector<affine<T>> maps;
  for (int i = 0; i < count; ++i) {
    int const rarity = i % 4 == 0 ? 6 : 1 << 30;
    maps.push_back({source.nasty_point<T>(rarity), source.nasty_point<T>(rarity), source.nasty_point<T>(rarity),
                    source.nasty_point<T>(rarity)});
  }
  auto const results = check_same_in_every_build<T>("quadric", "affine" + suffix<T>(), count,
                                                    {readable(rays), readable(maps)}, [&](T* out) {
                                                      return affine_kernel<T>{rays.data(), maps.data(), out};
                                                    });
  CHECK(finite_share(results) > 0.6);
}
