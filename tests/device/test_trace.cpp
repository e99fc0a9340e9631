// SPDX-License-Identifier: MIT
#include <device/kernels/trace.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <support/data.hpp>

#include <fstream>

using namespace patchrt;
using namespace patchrt::test;

namespace {

std::vector<bicubic_patch<double>> teapot() {
  std::ifstream file(project_data("teapot.bpt"));
  std::size_t count = 0;
  file >> count;
  std::vector<bicubic_patch<double>> patches(count);
  for (auto& patch : patches) {
    int degree_u = 0, degree_v = 0;
    file >> degree_u >> degree_v;
    for (auto& p : patch.control_points) file >> p.x >> p.y >> p.z;
  }
  REQUIRE(file);
  REQUIRE(count == 32);
  return patches;
}

/// Patches all over [-4, 4]^3: bent, nearly flat, collapsed to a point; some thousand times smaller than others.
std::vector<bicubic_patch<double>> scattered_patches(number_source& source) {
  auto patches = nasty_patches<double>(source, 60);
  for (std::size_t n = 0; n < patches.size(); ++n) {
    vec3<double> const place = source.point(4.);
    double const size = n % 3 == 0 ? 1e-3 : 1;
    for (auto& p : patches[n].control_points) p = n % 6 == 5 ? place + size * source.point(1.) : place + size * p;
  }
  return patches;
}

/// Half of the rays aimed at the patches from outside, the others anywhere; some of those nasty.
template <class T>
std::vector<ray<T>> rays_for(std::vector<bicubic_patch<double>> const& patches, number_source& source, int count) {
  auto rays = nasty_rays<T>(source, count);
  for (std::size_t i = 0; i < rays.size(); i += 2) {
    auto const& patch = patches[static_cast<std::size_t>(source.below(static_cast<int>(patches.size())))];
    vec3<double> const target = evaluate(patch, source.uniform(0., 1.), source.uniform(0., 1.)).position;
    vec3<double> const origin = source.point(i % 4 == 0 ? 8. : 100.);
    rays[i] = {convert_vec<T>(origin), convert_vec<T>(target - origin), T(0), std::numeric_limits<T>::infinity()};
  }
  return rays;
}

template <accuracy A, bool AnyHit> void check(std::string const& name, int count) {
  using kernel = trace_kernel<A, AnyHit>;
  using T = typename kernel::T;
  auto const scene = GENERATE(std::string("teapot"), std::string("scattered"));
  auto const depth = GENERATE(-1, 0, 5);
  unsigned const seed = 20 + static_cast<unsigned>(depth);
  CAPTURE(scene, depth, seed);
  number_source source(seed);
  auto const patches = scene == "teapot" ? teapot() : scattered_patches(source);
  mixed_hierarchy_options options;
  options.depth = depth;
  mixed_hierarchy const h = build_mixed_hierarchy(patches, options, serial{});
  auto const rays = rays_for<T>(patches, source, count);
  auto const results =
      check_same_in_every_build<T>("trace", name, count,
                                   {readable(h.top.nodes), readable(h.top.links), readable(h.search), readable(h.exact),
                                    readable(h.nodes), readable(h.leaves), readable(rays)},
                                   [&](T* out) {
                                     return kernel{h.view(), rays.data(), out};
                                   });

  int hits = 0;
  for (std::size_t i = 0; i < results.size(); i += kernel::outputs) hits += results[i] == 1;
  CAPTURE(hits);
  CHECK(hits > count / 3);
}

}  // namespace

TEST_CASE("closest hits at accuracy fast have the same bits from every compiler and from PTX") {
  check<accuracy::fast, false>("closest_fast_f32", 400);
}

TEST_CASE("closest hits at accuracy reference have the same bits from every compiler and from PTX") {
  check<accuracy::reference, false>("closest_reference_f64", 400);
}

TEST_CASE("closest hits at accuracy refined have the same bits from every compiler and from PTX") {
  check<accuracy::refined, false>("closest_refined_f64", 400);
}

TEST_CASE("any hits at accuracy refined have the same bits from every compiler and from PTX") {
  check<accuracy::refined, true>("any_refined_f64", 400);
}
