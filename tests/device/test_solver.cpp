// SPDX-License-Identifier: MIT
#include <device/kernels/solver.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

using namespace patchrt;
using namespace patchrt::test;

TEMPLATE_TEST_CASE("the ray-patch solver takes the same steps to the same root from every compiler and from PTX", "",
                   float, double) {
  using T = TestType;
  auto const seed = GENERATE(1u, 2u, 3u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 1500;
  auto const patches = nasty_patches<T>(source, count);
  auto rays = nasty_rays<T>(source, count);
  std::vector<power_patch<T>> powers;
  std::vector<patch_cell<T>> cells;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    powers.push_back(to_power(patches[i]));
    T const half = std::ldexp(T(1), -source.below(4));
    T const reach = T(1) - half;
    cells.push_back({source.uniform(-reach, reach), source.uniform(-reach, reach), half, half,
                     vec3<T>(source.uniform(T(0), half))});
    if (i % 4 != 0) {  // most rays are aimed at a point of their cell
      vec3<T> const target = position(powers[i], cells[i].x, cells[i].y), origin = source.point(T(4));
      rays[i] = {origin, target - origin, T(0), T(10)};
    }
  }
  auto const results = check_same_in_every_build<T>(
      "solver", "solve" + suffix<T>(), count, {readable(powers), readable(patches), readable(cells), readable(rays)},
      [&](T* out) {
        return solve_kernel<T>{powers.data(), patches.data(), cells.data(), rays.data(), out};
      });

  int excluded = 0, unique = 0, converged = 0, valid = 0, reference = 0;
  for (std::size_t i = 0; i < results.size(); i += solve_kernel<T>::outputs) {
    excluded += results[i] == 0;
    unique += results[i + 4] == 1;
    converged += results[i + 8] == 1;
    valid += results[i + 13] == 1;
    reference += results[i + 18] == 1;
  }
  CAPTURE(excluded, unique, converged, valid, reference);
  CHECK(excluded > count / 10);
  CHECK(converged > count / 4);
  CHECK(valid > count / 4);
  CHECK(unique > count / 10);
  if (sizeof(T) == 8) CHECK(reference > count / 20);  // its 1e-15 is out of float's reach
}
