// SPDX-License-Identifier: MIT
#include "gallery.hpp"

#include "sphereflake.hpp"

#include <patchrt/intersect/quadric_point.hpp>
#include <patchrt/intersect/triangle_departure.hpp>
#include <patchrt/trace/depart.hpp>
#include <patchrt/trace/scene_hits.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace patchrt::examples {

namespace {

affine<double> placed(vec3<double> const& at, vec3<double> const& sizes, vec3<double> const& axis = {0, 0, 1},
                      double degrees = 0) {
  affine<double> a = affine<double>::rotation(axis, degrees * std::numbers::pi / 180) * affine<double>::scaling(sizes);
  a.translation = at;
  return a;
}

/// A plane z = `height` to walk on, square.
clipped_quadric<double> floor_at(double height, double half) {
  return make_plane(placed({0, 0, height}, {1, 1, 1}), half, half);
}

void add_sphereflake(gallery& g, int depth) {
  for (flake_sphere const& s : sphereflake(depth)) g.spheres.push_back({s.centre, s.radius});
  g.quadrics.push_back(floor_at(-0.55, 40));
  g.eye = {2.1, -3.0, 2.2};
  g.target = {0, 0, 0.1};
  g.to_light = {-0.5, -1, 1.6};
}

/// Each unit form once, in two rows, some of them turned, squeezed, capped or cut.
void add_quadrics(gallery& g) {
  auto const column = [](int i) { return 2.4 * (i % 4 - 1.5); };
  auto const row = [](int i) { return i < 4 ? 1.5 : -1.5; };
  auto const at = [&](int i, double height) { return vec3<double>(column(i), row(i), height); };
  g.quadrics = {
      make_sphere(placed(at(0, 0), {1, 1, 1})),
      make_ellipsoid(at(1, 0), {1.1, 0.6, 0.9}),
      make_cylinder(placed(at(2, 0), {0.7, 0.7, 1}), -1, 1, ends::capped),
      make_cone(placed(at(3, 1), {0.5, 0.5, 1}), -2, 0, ends::capped),
      make_paraboloid(placed(at(4, 1), {0.7, 0.7, -2}), 1),
      make_hyperboloid_one_sheet(placed(at(5, 0), {0.45, 0.45, 0.5}), -2, 2),
      make_hyperboloid_two_sheets(placed(at(6, 0), {0.35, 0.35, 0.3}), -10.0 / 3, 10.0 / 3, ends::capped),
      // A slanted tube with a window: a box of object space clips it.
      make_quadric(unit_cylinder<double>(), placed(at(7, 0), {0.6, 0.6, 1}, {1, 0, 0}, 20),
                   {{-2, -0.5, -1}, {2, 2, 1}}),
      floor_at(-1.2, 30),
  };
  g.eye = {1.5, -11, 6.5};
  g.target = {0, -0.2, -0.2};
  g.to_light = {-0.6, -0.8, 1.7};
}

void add_table(gallery& g, std::span<bicubic_patch<double> const> teapot, mesh const& beside) {
  g.quadrics = {
      make_cylinder(placed({0, 0, -0.15}, {5.2, 5.2, 0.15}), -1, 1, ends::capped),  // the top
      make_hyperboloid_one_sheet(placed({0, 0, -3.3}, {0.5, 0.5, 1}), -3, 3),       // the leg
      make_cylinder(placed({0, 0, -6.4}, {2.2, 2.2, 0.1}), -1, 1, ends::capped),    // the foot
      make_paraboloid(placed({-3.1, -2.2, 0}, {0.75, 0.75, 1.4}), 1),               // a cup
      make_cone(placed({3.4, -2.4, 1.3}, {0.5, 0.5, 1}), -1.3, 0, ends::capped),    // a cone
      floor_at(-6.5, 300),
  };
  g.spheres = {{{1.1, -3.4, 0.45}, 0.45}, {{-3.1, -2.2, 0.9}, 0.3}};
  g.tori = {{{3.4, -2.4, 0.16}, {0, 0, 1}, 0.75, 0.16}, {{-1.2, -3.5, 0.14}, {0, 0, 1}, 0.45, 0.14}};
  g.model = build_mixed_hierarchy(teapot, {}, serial{});
  g.patches.push_back(place(g.model.view(), affine<double>::rotation({0, 0, 1}, 0.35)));
  for (auto const& t : beside.triangles)
    g.triangles.push_back({{beside.vertices[t[0]], beside.vertices[t[1]], beside.vertices[t[2]]}});
  g.eye = {5, -14, 7.5};
  g.target = {0, -0.3, -0.4};
  g.to_light = {-0.7, -0.7, 1.5};
}

/// A colour that a number stands for, not too dark.
vec3<double> colour_of(std::int32_t number) {
  auto const wave = [number](double phase) { return 0.62 + 0.3 * std::cos(2.4 * number + phase); };
  return {wave(0.3), wave(2.4), wave(4.5)};
}

std::uint8_t to_byte(double linear) {
  return static_cast<std::uint8_t>(std::lround(255 * std::pow(std::clamp(linear, 0., 1.), 1 / 2.2)));
}

vec3<double> normalise(vec3<double> const& v) { return v / std::sqrt(dot(v, v)); }

}  // namespace

std::vector<std::string> const& gallery_names() {
  static std::vector<std::string> const names{"sphereflake", "quadrics", "table"};
  return names;
}

gallery make_gallery(std::string const& name, int depth, std::span<bicubic_patch<double> const> teapot,
                     mesh const& beside) {
  gallery g;
  if (name == "sphereflake") add_sphereflake(g, depth);
  else if (name == "quadrics") add_quadrics(g);
  else if (name == "table") add_table(g, teapot, beside);
  else throw std::invalid_argument("no scene is called '" + name + "'");
  return g;
}

gallery_view::gallery_view(gallery const& g, int threads)
    : shapes_(g), executor_(threads), scene_(build_scene(g.triangles, g.spheres, g.quadrics, g.tori, g.patches)) {}

gallery_view::surface gallery_view::surface_at(ray<double> const& r, scene_hit<double> const& hit) const {
  vec3<double> const point = fma(hit.t, r.direction, r.origin);
  auto const centred = make_centred_ray(r.origin, r.direction);
  surface_departure<double> from{point, {0, 0, 1}, 0};
  std::size_t k = std::size_t(hit.shape);
  // The lists in the order that the scene has them in.
  if (k < shapes_.triangles.size()) {
    from = depart_from(static_cast<triangle<double> const&>(shapes_.triangles[k]), hit.u, hit.v);
  } else if (k -= shapes_.triangles.size(); k < shapes_.spheres.size()) {
    from = depart_from(centred, shapes_.spheres[k], sphere_hit<double>{hit.t, true});
  } else if (k -= shapes_.spheres.size(); k < shapes_.quadrics.size()) {
    auto const& q = shapes_.quadrics[k];
    from = depart_from(centred, q, nearest(crossings(centred, q), r.t_min, r.t_max));
  } else if (k -= shapes_.quadrics.size(); k < shapes_.tori.size()) {
    torus const& s = shapes_.tori[k];
    from.normal = intersect(r, s).normal;
    from.clearance = 1e-9 * (s.major + s.minor);
  } else {
    auto const& placed = shapes_.patches[k - shapes_.tori.size()];
    patch_hit const inside{hit.t, hit.u, hit.v, 0, hit.part};
    auto const d = depart_from(placed.object.hierarchy, inside);
    vec3<double> const n = transform_normal(placed.to_object, d.normal);
    from = {transform_point(placed.to_world, d.position), normalise(n), 4 * d.clearance};
  }
  vec3<double> const n = dot(from.normal, r.direction) < 0 ? from.normal : -from.normal;
  return {offset_origin(from, n), n};
}

std::vector<scene_hit<double>> gallery_view::trace(std::span<ray<double> const> rays) const {
  std::vector<scene_hit<double>> hits(rays.size());
  patchrt::trace::closest_hits(scene_.view(), rays, std::span(hits), executor_);
  return hits;
}

image gallery_view::draw(image_size size) const {
  camera const view = look_at(shapes_.eye, shapes_.target, {0, 0, 1}, shapes_.vfov, size);
  vec3<double> const to_light = normalise(shapes_.to_light);
  constexpr double inf = std::numeric_limits<double>::infinity();
  image picture(size);
  std::vector<ray<double>> rays(size.pixels());
  executor_.for_each(rays.size(), [&](std::size_t i) { rays[i] = primary_ray(view, size, i); });
  std::vector<scene_hit<double>> const hits = trace(rays);

  // Only what is seen casts rays to the light.
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < hits.size(); ++i)
    if (hits[i].valid()) seen.push_back(i);
  std::vector<surface> surfaces(seen.size());
  std::vector<ray<double>> shadow(seen.size());
  std::vector<std::uint8_t> blocked(seen.size());
  executor_.for_each(seen.size(), [&](std::size_t k) {
    surfaces[k] = surface_at(rays[seen[k]], hits[seen[k]]);
    shadow[k] = {surfaces[k].start, to_light, 0, inf};
  });
  patchrt::trace::any_hits(scene_.view(), std::span<ray<double> const>(shadow), std::span(blocked), executor_);

  for (std::size_t i = 0; i < rays.size(); ++i) {
    pixel const p = tiled_pixel(size, i);
    double const height = 0.5 + 0.5 * normalise(rays[i].direction).z;
    picture(p.x, p.y) = {to_byte(0.75 * height), to_byte(0.85 * height), to_byte(height)};
  }
  for (std::size_t k = 0; k < seen.size(); ++k) {
    ray<double> const& r = rays[seen[k]];
    vec3<double> const n = surfaces[k].normal, away = normalise(r.direction);
    double const lit = blocked[k] != 0 ? 0 : std::max(0., dot(n, to_light));
    double const facing = -dot(n, away);
    vec3<double> const mirrored = away + 2 * facing * n;
    double const shine = blocked[k] != 0 ? 0 : std::pow(std::max(0., dot(mirrored, to_light)), 60);
    std::int32_t const shape = hits[seen[k]].shape;
    bool const is_of_mesh = std::size_t(shape) < shapes_.triangles.size();  // one colour for all of it
    vec3<double> const c =
        colour_of(is_of_mesh ? -1 : shape) * (0.1 + 0.12 * facing + 0.75 * lit) + vec3<double>(0.35 * shine);
    pixel const p = tiled_pixel(size, seen[k]);
    picture(p.x, p.y) = {to_byte(c.x), to_byte(c.y), to_byte(c.z)};
  }
  return picture;
}

}  // namespace patchrt::examples
