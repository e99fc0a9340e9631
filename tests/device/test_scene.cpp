// SPDX-License-Identifier: MIT
#include <device/kernels/scene.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

#include <patchrt/accel/build_scene.hpp>

#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Shapes all over [-4, 4]^3, some of them degenerate.
template <class T> std::vector<scene_triangle<T>> some_triangles(number_source& source, int count) {
  std::vector<scene_triangle<T>> all;
  for (int i = 0; i < count; ++i) {
    vec3<T> const a = source.point(T(4)), b = a + source.point(T(1)), c = i % 16 == 0 ? b : a + source.point(T(1));
    all.push_back({{a, b, c}});
  }
  return all;
}
template <class T> std::vector<sphere<T>> some_spheres(number_source& source, int count) {
  std::vector<sphere<T>> all;
  for (int i = 0; i < count; ++i) {
    vec3<T> const centre = source.point(T(4));
    all.push_back({centre, i % 16 == 0 ? T(0) : source.uniform(T(0.01), T(0.6))});
  }
  return all;
}

/// Half of the rays through the scene, the others anywhere; some of those nasty.
template <class T> std::vector<ray<T>> rays_through(number_source& source, int count) {
  auto rays = nasty_rays<T>(source, count);
  for (std::size_t i = 0; i < rays.size(); i += 2) {
    vec3<T> const origin = source.point(i % 4 == 0 ? T(8) : T(100)), target = source.point(T(3));
    rays[i] = {origin, target - origin, T(0), std::numeric_limits<T>::infinity()};
  }
  return rays;
}

template <class Kernel, class T>
std::vector<T> trace(std::string const& name, decltype(Kernel::scene) const& view, std::vector<ray<T>> const& rays,
                     std::vector<memory_range> memory) {
  memory.push_back(readable(rays));
  return check_same_in_every_build<T>("scene", name, static_cast<int>(rays.size()), memory, [&](T* out) {
    return Kernel{view, rays.data(), out};
  });
}

template <class T> int hits_of(std::vector<T> const& results) {
  int hits = 0;
  for (std::size_t i = 0; i < results.size(); i += 6) hits += results[i] == 1;
  return hits;
}

}  // namespace

TEST_CASE("hits in a scene of three kinds have the same bits from every compiler and from PTX") {
  unsigned const seed = GENERATE(41u, 42u);
  CAPTURE(seed);
  number_source source(seed);
  std::vector<level_disc> discs;
  for (int i = 0; i < 60; ++i) {
    vec3<float> const centre = source.point(4.0f);
    discs.push_back({centre, source.uniform(0.1f, 0.8f)});
  }
  auto const built = build_scene(some_triangles<float>(source, 120), some_spheres<float>(source, 80), discs);
  auto const rays = rays_through<float>(source, 1000);
  std::vector<memory_range> const memory{readable(built.top.nodes), readable(built.top.links),
                                         readable(std::get<0>(built.blocks)), readable(std::get<1>(built.blocks)),
                                         readable(std::get<2>(built.blocks))};
  auto const closest = trace<scene_kernel<mixed_view, float, false>>("closest_mixed_f32", built.view(), rays, memory);
  auto const any = trace<scene_kernel<mixed_view, float, true>>("any_mixed_f32", built.view(), rays, memory);
  CHECK(hits_of(closest) > 300);
  CHECK(hits_of(closest) == hits_of(any));
}

TEST_CASE("hits of placed scenes have the same bits from every compiler and from PTX") {
  unsigned const seed = 43;
  number_source source(seed);
  auto const object = build_scene(some_triangles<double>(source, 60), some_spheres<double>(source, 40));
  std::vector<instance<object_view>> places;
  for (int i = 0; i < 12; ++i) {
    auto to =
        affine<double>::rotation(source.point(1.), source.uniform(0., 6.)) * affine<double>::scaling({0.3, 0.5, -0.4});
    to.translation = source.point(4.);
    places.push_back(place(object.view(), to));
  }
  auto const built = build_scene(places, some_spheres<double>(source, 20));
  auto const rays = rays_through<double>(source, 600);
  std::vector<memory_range> const memory{
      readable(object.top.nodes),           readable(object.top.links),         readable(std::get<0>(object.blocks)),
      readable(std::get<1>(object.blocks)), readable(built.top.nodes),          readable(built.top.links),
      readable(std::get<0>(built.blocks)),  readable(std::get<1>(built.blocks))};
  auto const closest =
      trace<scene_kernel<placed_view, double, false>>("closest_placed_f64", built.view(), rays, memory);
  CHECK(hits_of(closest) > 120);
}
