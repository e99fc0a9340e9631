// SPDX-License-Identifier: MIT
#pragma once

#include "image.hpp"

#include <patchrt/core/ray.hpp>
#include <patchrt/shapes/bezier_patch.hpp>

#include <cstddef>
#include <span>

namespace patchrt::examples {

/// A pinhole: the ray through image position (x, y) in [-1, 1]^2, y upwards, has direction forward + x right + y up.
///
/// `forward` has length 1, so that t is the depth; `right` and `up` are as long as half the image at depth 1.
struct camera {
  vec3<double> eye;
  vec3<double> forward;
  vec3<double> right;
  vec3<double> up;
};

/// \param up Any direction that is upwards in the image.
/// \param vfov Vertical field of view in degrees.
/// \throws std::runtime_error where the three directions leave no camera.
camera look_at(vec3<double> const& eye, vec3<double> const& target, vec3<double> const& up, double vfov,
               image_size size);

/// The camera that looks at the model three-quarters from the front and from above, all control points just in the image.
camera frame(std::span<bicubic_patch<double> const> patches, vec3<double> const& up, double vfov, image_size size);

/// Rays through the middles of the pixels first, first + 1, ... in the order of `tiled_pixel`; t from 0 to infinity.
ray<double> primary_ray(camera const& camera, image_size size, std::size_t i);

/// The box of all control points.
box<double> bounds(std::span<bicubic_patch<double> const> patches);

}  // namespace patchrt::examples
