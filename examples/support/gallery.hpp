// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Scenes of all kinds of shapes at once, and what a viewer sees of them.

#include "camera.hpp"
#include "mesh.hpp"
#include "torus.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/accel/build_scene.hpp>
#include <patchrt/accel/instance.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/accel/scene_triangle.hpp>
#include <patchrt/exec/openmp.hpp>
#include <patchrt/intersect/ray_quadric.hpp>
#include <patchrt/shapes/make_quadric.hpp>

#include <span>
#include <string>
#include <vector>

namespace patchrt::examples {

/// Shapes by kind, and from where they are seen.
struct gallery {
  using patches_at = instance<patch_object<bicubic_patch<double>>>;

  std::vector<scene_triangle<double>> triangles;
  std::vector<sphere<double>> spheres;
  std::vector<clipped_quadric<double>> quadrics;
  std::vector<torus> tori;
  std::vector<patches_at> patches;
  mixed_hierarchy model;  ///< what `patches` places
  vec3<double> eye, target, to_light;
  double vfov = 35;

  std::size_t size() const {
    return triangles.size() + spheres.size() + quadrics.size() + tori.size() + patches.size();
  }
};

/// The names of the scenes: sphereflake, quadrics, table.
std::vector<std::string> const& gallery_names();

/// \param name  One of `gallery_names`.
/// \param depth Of the sphereflake, 0 to 8.
/// \param teapot What stands on the table; z is up.
/// \param beside Triangles beside it.
/// \throws std::invalid_argument for any other name.
gallery make_gallery(std::string const& name, int depth, std::span<bicubic_patch<double> const> teapot,
                     mesh const& beside);

/// Renders with one light, its shadows, and a little light from the eye; normals are those of the surfaces themselves.
class gallery_view {
 public:
  gallery_view(gallery const& shapes, int threads);

  image draw(image_size size) const;
  /// The nearest hit of each ray; shapes are counted in the order of `gallery`'s lists.
  std::vector<scene_hit<double>> trace(std::span<ray<double> const> rays) const;
  /// The normal of length 1 of the surface that a hit is on, on the side that the ray comes from, and a point just off it.
  struct surface {
    vec3<double> start, normal;
  };
  surface surface_at(ray<double> const& r, scene_hit<double> const& hit) const;
  std::size_t bytes() const { return scene_.bytes(); }

 private:
  gallery const& shapes_;
  openmp executor_;
  scene<scene_triangle<double>, sphere<double>, clipped_quadric<double>, torus, gallery::patches_at> scene_;
};

}  // namespace patchrt::examples
