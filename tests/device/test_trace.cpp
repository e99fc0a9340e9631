// SPDX-License-Identifier: MIT
#include <device/kernels/trace.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <support/rays.hpp>

#include <random>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

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

std::vector<bicubic_patch<double>> scene_patches(std::string const& scene, number_source& source) {
  return scene == "teapot" ? load_model(scene) : scattered_patches(source);
}

mixed_hierarchy hierarchy_of(std::vector<bicubic_patch<double>> const& patches, int depth) {
  mixed_hierarchy_options options;
  options.depth = depth;
  return build_mixed_hierarchy(patches, options, serial{});
}

/// What the kernel `name` says of the rays, the same in every build.
template <class Kernel, class T>
std::vector<T> trace(std::string const& name, mixed_hierarchy const& h, std::vector<ray<T>> const& rays) {
  return check_same_in_every_build<T>("trace", name, static_cast<int>(rays.size()),
                                      {readable(h.top.nodes), readable(h.top.links), readable(h.search),
                                       readable(h.exact), readable(h.nodes), readable(h.leaves), readable(rays)},
                                      [&](T* out) {
                                        return Kernel{h.view(), rays.data(), out};
                                      });
}

template <accuracy A, bool AnyHit> void check(std::string const& name, int count) {
  using kernel = trace_kernel<A, AnyHit>;
  using T = typename kernel::T;
  auto const scene = GENERATE(std::string("teapot"), std::string("scattered"));
  auto const depth = GENERATE(-1, 0, 5);
  unsigned const seed = 20 + static_cast<unsigned>(depth);
  CAPTURE(scene, depth, seed);
  number_source source(seed);
  auto const patches = scene_patches(scene, source);
  auto const results = trace<kernel>(name, hierarchy_of(patches, depth), rays_for<T>(patches, source, count));

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

TEST_CASE("certified hits and what is proved of them have the same bits from every compiler and from PTX") {
  using kernel = trace_kernel<accuracy::certified, false>;
  auto const scene = GENERATE(std::string("teapot"), std::string("scattered"));
  auto const depth = GENERATE(-1, 5);
  unsigned const seed = 30 + static_cast<unsigned>(depth);
  CAPTURE(scene, depth, seed);
  number_source source(seed);
  auto const patches = scene_patches(scene, source);
  std::mt19937 generator(seed);
  auto rays = rays_for<double>(patches, source, 60);
  for (auto const& more : {view_rays(patches, 1, 8, generator), rays_at_edges(patches, 80, generator),
                           rays_along_tangents(patches, 30, 0., generator),
                           rays_along_tangents(patches, 30, 1e-3, generator), bounces(patches, 30, generator)}) {
    rays.insert(rays.end(), more.begin(), more.end());
  }
  auto const results = trace<kernel>("closest_certified_f64", hierarchy_of(patches, depth), rays);

  int hits = 0, tangent = 0, degenerate = 0, proved_hits = 0, proved_misses = 0;
  for (std::size_t i = 0; i < results.size(); i += kernel::outputs) {
    bool const is_hit = results[i] == 1, is_proved = results[i + 6] == 0 && results[i + 7] == 0;
    hits += is_hit;
    tangent += results[i + 6] == 1;
    degenerate += results[i + 7] == 1;
    proved_hits += is_hit && is_proved;
    proved_misses += !is_hit && is_proved;
  }
  CAPTURE(rays.size(), hits, tangent, degenerate, proved_hits, proved_misses);
  CHECK(proved_hits > 60);
  CHECK(proved_misses > 40);
  CHECK(tangent > 5);
  if (scene == "scattered") CHECK(degenerate > 0);
}
