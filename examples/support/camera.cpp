// SPDX-License-Identifier: MIT
#include "camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace patchrt::examples {

namespace {

double length(vec3<double> const& v) { return std::hypot(v.x, v.y, v.z); }

vec3<double> unit(vec3<double> const& v, char const* what) {
  double const l = length(v);
  if (!(l > 0 && l < std::numeric_limits<double>::infinity())) throw std::runtime_error(std::string("camera: ") + what);
  return v / l;
}

struct half_extent {
  double x, y;
};

/// Half the image at depth 1.
half_extent view_extent(double vfov, image_size size) {
  double const y = std::tan(vfov / 360 * std::numbers::pi);
  return {y * size.width / size.height, y};
}

}  // namespace

camera look_at(vec3<double> const& eye, vec3<double> const& target, vec3<double> const& up, double vfov,
               image_size size) {
  vec3<double> const forward = unit(target - eye, "the eye is at the point looked at");
  vec3<double> const upwards = unit(up, "the up direction has no length");
  vec3<double> const side = cross(forward, upwards);
  if (!(length(side) > 1e-9)) throw std::runtime_error("camera: the up direction is along the view");
  vec3<double> const right = unit(side, "the up direction is along the view");
  half_extent const half = view_extent(vfov, size);
  return {eye, forward, right * half.x, cross(right, forward) * half.y};
}

camera frame(std::span<bicubic_patch<double> const> patches, vec3<double> const& up, double vfov, image_size size) {
  // The model's front faces -y where z is up, +z where y is.
  vec3<double> const above = unit(up, "the up direction has no length");
  vec3<double> const x_axis{1, 0, 0}, y_axis{0, 1, 0};
  vec3<double> const front =
      unit(cross(std::abs(above.x) < 0.9 ? x_axis : y_axis, above), "the up direction has no length");
  vec3<double> const side = cross(above, front);
  vec3<double> const to_eye = unit(front + side * 0.45 + above * 0.55, "no direction");

  // In the camera's axes, with z towards the eye, a point p is in the image where |p.x - e.x| <= half.x (e.z - p.z), and y
  // alike: each side of the image bounds e by a plane, and the nearest eye that meets all four is known at once.
  camera c = look_at(to_eye, {0, 0, 0}, above, vfov, size);
  half_extent const half = view_extent(vfov, size);
  vec3<double> const ex = unit(c.right, "no direction"), ey = unit(c.up, "no direction");
  constexpr double inf = std::numeric_limits<double>::infinity();
  double left = inf, right = -inf, bottom = inf, top = -inf;
  for (auto const& patch : patches)
    for (auto const& p : patch.control_points) {
      double const x = dot(p, ex), y = dot(p, ey), z = dot(p, to_eye);
      left = std::min(left, x - half.x * z);
      right = std::max(right, x + half.x * z);
      bottom = std::min(bottom, y - half.y * z);
      top = std::max(top, y + half.y * z);
    }
  box<double> const b = bounds(patches);
  double const distance = std::max((right - left) / (2 * half.x), (top - bottom) / (2 * half.y));
  // A margin; a model that is a point still has its eye at a distance.
  double const scale = std::max({length(extent(b)), 1e-3 * length(b.lo), std::numeric_limits<double>::min()});
  c.eye = ex * ((left + right) / 2) + ey * ((bottom + top) / 2) + to_eye * (distance + 0.05 * scale);
  return c;
}

ray<double> primary_ray(camera const& camera, image_size size, std::size_t i) {
  pixel const p = tiled_pixel(size, i);
  double const x = (2 * p.x + 1 - size.width) / double(size.width);
  double const y = (size.height - 2 * p.y - 1) / double(size.height);
  return {camera.eye, camera.forward + x * camera.right + y * camera.up, 0, std::numeric_limits<double>::infinity()};
}

box<double> bounds(std::span<bicubic_patch<double> const> patches) {
  box<double> all = box<double>::empty();
  for (auto const& patch : patches) all = merge(all, patchrt::bounds(patch));
  return all;
}

}  // namespace patchrt::examples
