// SPDX-License-Identifier: MIT
/// \file
/// Rays through edges and vertices of meshes without gaps, every ray against every triangle.
#include <intersect/triangle_rays.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/numbers/pack.hpp>
#include <support/catch.hpp>

#include <algorithm>
#include <cstdlib>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// The nearest t of each ray among all triangles of the mesh, infinite for a miss.
template <class Form, faces F = faces::both, class T>
std::vector<T> nearest_hits(triangle_mesh<T> const& mesh, std::vector<ray<T>> const& rays) {
  constexpr std::size_t lanes = 64 / sizeof(T);
  using P = pack<T, int(lanes)>;
  std::vector<typename Form::template prepared<T>> triangles;
  for (std::size_t k = 0; k < mesh.faces.size(); ++k) triangles.push_back(Form::prepare(mesh[k]));
  std::vector<T> nearest(rays.size());
  for (std::size_t k = 0; k < rays.size(); k += lanes) {
    T lane[6][lanes];
    for (std::size_t i = 0; i < lanes; ++i) {
      ray<T> const& r = rays[std::min(k + i, rays.size() - 1)];
      for (int c = 0; c < 3; ++c) lane[c][i] = r.origin[c], lane[c + 3][i] = r.direction[c];
    }
    auto const load = [&](int c) { return P::load(lane[c]); };
    auto const constants = Form::make_ray(vec3<P>{load(0), load(1), load(2)}, vec3<P>{load(3), load(4), load(5)});
    P t_max(std::numeric_limits<T>::infinity());
    for (auto const& t : triangles) {
      auto const hit = intersect<Form, F>(constants, t, P(T(0)), t_max);
      t_max = select(hit.valid, hit.t, t_max);
    }
    t_max.store(lane[0]);
    std::copy_n(lane[0], std::min(lanes, rays.size() - k), nearest.begin() + std::ptrdiff_t(k));
  }
  return nearest;
}

/// How many rays: ten times as many at night.
std::size_t ray_count() {
  char const* const given = std::getenv("PATCHRT_LEAK_RAYS");
  return given ? std::size_t(std::atol(given)) : 100000;
}

template <class T> bool is_miss(T t) { return t == std::numeric_limits<T>::infinity(); }
template <class T> std::size_t count_misses(std::vector<T> const& nearest) {
  return std::size_t(std::count_if(nearest.begin(), nearest.end(), is_miss<T>));
}
/// Rays that go by their aim, which is at t = 1.
template <class T> std::size_t count_leaks(std::vector<T> const& nearest) {
  return std::size_t(std::count_if(nearest.begin(), nearest.end(), [](T t) { return !(t < T(1.001)); }));
}

template <class T> std::vector<ray<T>> rays_between(std::vector<vec3<T>> const& from, std::vector<vec3<T>> const& to) {
  std::vector<ray<T>> rays;
  for (std::size_t k = 0; k < from.size(); ++k)
    rays.push_back({from[k], to[k] - from[k], T(0), std::numeric_limits<T>::infinity()});
  return rays;
}

}  // namespace

TEMPLATE_TEST_CASE("no ray passes through a sphere far from the origin (A)", "", float, double) {
  using T = TestType;
  // Radius 2: coordinates are rounded to 1/64 in float, to 2^-35 in double.
  vec3<double> const centre{148376, 1234, -223423};
  unsigned const seed = 40401u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  auto const mesh = sphere_mesh<T>(centre, 2, 24);
  std::vector<vec3<T>> from, to;
  for (std::size_t k = 0; k < ray_count(); ++k) {
    vec3<double> const eye = k % 2 ? centre + random.direction() * random.uniform(3, 1000) : random.in_cube() * 100.;
    from.push_back(random_triangle_rays::rounded<T>(eye));
    to.push_back(random_triangle_rays::rounded<T>(centre + random.in_cube()));
  }
  for (std::size_t k = 0; k < from.size(); k += 4)
    to[k] = mesh.vertices[std::size_t(random.pick(int(mesh.vertices.size())))];
  for (std::size_t k = 0; k < from.size(); k += 4)  // through the vertex from inside
    from[k] = random_triangle_rays::rounded<T>(centre + random.in_cube());
  auto const rays = rays_between(from, to);
  auto const watertight = nearest_hits<watertight_form>(mesh, rays);
  auto const one_sided = nearest_hits<watertight_form, faces::front>(mesh, rays);
  CHECK(count_misses(watertight) == 0);
  std::size_t missed = 0;  // those that start inside may see backs alone
  for (std::size_t k = 0; k < rays.size(); ++k) missed += k % 4 != 0 && is_miss(one_sided[k]);
  CHECK(missed == 0);
  CHECK(count_misses(nearest_hits<moller_trumbore_form>(mesh, rays)) > 0);  // that leaks are seen
}

TEMPLATE_TEST_CASE("no ray at a vertex of a sphere passes through it (Av)", "", float, double) {
  using T = TestType;
  unsigned const seed = 40402u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  auto const mesh = sphere_mesh<T>({0, 0, 0}, 1, 24);
  std::vector<vec3<T>> from, to;
  while (from.size() < ray_count()) {
    auto const& vertex = mesh.vertices[std::size_t(random.pick(int(mesh.vertices.size())))];
    vec3<double> const eye = random.direction() * random.uniform(1.5, 10), at(vertex), way = eye - at;
    if (dot(at, way) < 0.3 * std::sqrt(dot(way, way))) continue;  // behind, or all but grazed
    from.push_back(random_triangle_rays::rounded<T>(eye));
    to.push_back(vertex);
  }
  auto const rays = rays_between(from, to);
  CHECK(count_leaks(nearest_hits<watertight_form>(mesh, rays)) == 0);
  CHECK(count_leaks(nearest_hits<watertight_form, faces::front>(mesh, rays)) == 0);
  CHECK(count_leaks(nearest_hits<engine_form>(mesh, rays)) < rays.size() / 500);
  CHECK(count_leaks(nearest_hits<moller_trumbore_form>(mesh, rays)) > rays.size() / 10);  // that leaks are seen
}

TEMPLATE_TEST_CASE("no ray at a vertex or an edge of a bumpy sheet passes through it (B2)", "", float, double) {
  using T = TestType;
  unsigned const seed = 40403u;
  CAPTURE(seed);
  random_triangle_rays random(seed);
  int const n = 16;
  auto const mesh = bumpy_sheet<T>(random, n);
  std::vector<vec3<T>> from, to, to_edges;
  for (std::size_t k = 0; k < ray_count(); ++k) {
    vec3<double> const eye = random.in_cube() + vec3<double>{0.5, 0.5, random.uniform(4, 9)};
    from.push_back(random_triangle_rays::rounded<T>(eye));
    std::size_t const inner = std::size_t((1 + random.pick(n - 1)) * (n + 1) + 1 + random.pick(n - 1));
    std::size_t const next = inner + std::size_t(random.pick(2) ? 1 : n + 1);
    to.push_back(mesh.vertices[inner]);
    double const share = random.uniform();
    to_edges.push_back(random_triangle_rays::rounded<T>(vec3<double>(mesh.vertices[inner]) * (1 - share) +
                                                        vec3<double>(mesh.vertices[next]) * share));
  }
  auto const at_vertices = rays_between(from, to), at_edges = rays_between(from, to_edges);
  CHECK(count_misses(nearest_hits<watertight_form>(mesh, at_vertices)) == 0);
  CHECK(count_misses(nearest_hits<watertight_form>(mesh, at_edges)) == 0);
  CHECK(count_misses(nearest_hits<watertight_form, faces::front>(mesh, at_edges)) == 0);
  CHECK(count_misses(nearest_hits<engine_form>(mesh, at_vertices)) < ray_count() / 5000);
  CHECK(count_misses(nearest_hits<engine_form>(mesh, at_edges)) > ray_count() / 1000);  // that leaks are seen
}
