// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The rays that are timed: primary rays of a pinhole, and one diffuse bounce from what they hit.

#include "reference_tracer.hpp"

#include <patchrt/shapes/bezier_normal.hpp>

#include <cstdint>
#include <numbers>
#include <random>
#include <stdexcept>

namespace patchrt::bench {

struct camera {
  vec3<double> eye;
  vec3<double> look_at;
  vec3<double> up;
  double vfov_degrees;
};

inline vec3<double> unit(vec3<double> const& v) { return v / std::sqrt(dot(v, v)); }

/// Primary rays through the pixel centres, directions of unit length, ordered in tiles of 4x4 pixels.
/// \pre width and height are multiples of 4.
inline std::vector<ray<double>> primary_rays(camera const& c, int width, int height) {
  vec3<double> const forward = unit(c.look_at - c.eye);
  double const half = std::tan(c.vfov_degrees * std::numbers::pi / 360);
  vec3<double> const right = unit(cross(forward, c.up)), up = cross(right, forward);
  std::vector<ray<double>> rays;
  rays.reserve(std::size_t(width) * std::size_t(height));
  for (int tile_y = 0; tile_y < height; tile_y += 4)
    for (int tile_x = 0; tile_x < width; tile_x += 4)
      for (int y = tile_y; y < tile_y + 4; ++y)
        for (int x = tile_x; x < tile_x + 4; ++x) {
          double const sx = half * (2 * (x + 0.5) - width) / height, sy = half * (height - 2 * (y + 0.5)) / height;
          rays.push_back({c.eye, unit(forward + sx * right + sy * up), 0, std::numeric_limits<double>::infinity()});
        }
  return rays;
}

inline std::vector<answer> reference_answers(std::span<bicubic_patch<double> const> patches,
                                             std::span<ray<double> const> rays) {
  reference_tracer trace(patches);
  std::vector<answer> answers;
  answers.reserve(rays.size());
  for (auto const& r : rays) answers.push_back(trace(r));
  return answers;
}

inline std::size_t count_hits(std::span<answer const> answers) {
  return std::size_t(std::count_if(answers.begin(), answers.end(), is_hit));
}

/// The camera that looks at the middle of the model from `direction`, so far away that the share `coverage` of the
/// pixels of a square image hits.
inline camera frame(std::span<bicubic_patch<double> const> patches, vec3<double> const& direction,
                    vec3<double> const& up, double vfov_degrees, double coverage) {
  auto all = box<double>::empty();
  for (auto const& p : patches) all = merge(all, bounds(p));
  vec3<double> const middle = 0.5 * (all.lo + all.hi);
  double const radius = 0.5 * std::sqrt(dot(extent(all), extent(all)));
  constexpr int size = 256;
  auto const at = [&](double distance) {
    return camera{middle + distance * unit(direction), middle, up, vfov_degrees};
  };
  double near = radius, far = 100 * radius;
  for (int step = 0; step < 14; ++step) {
    double const distance = std::sqrt(near * far);
    auto const rays = primary_rays(at(distance), size, size);
    bool const too_many = double(count_hits(reference_answers(patches, rays))) > coverage * size * size;
    (too_many ? near : far) = distance;
  }
  return at(std::sqrt(near * far));
}

/// One ray for every hit, in the order of the hits: cosine-distributed about the exact normal on the side the ray
/// came from, starting `offset` off the surface.
inline std::vector<ray<double>> bounce_rays(std::span<bicubic_patch<double> const> patches,
                                            std::span<ray<double> const> rays, std::span<answer const> answers,
                                            double offset, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  auto const uniform = [&] { return double(bits() >> 11) * 0x1p-53; };
  std::vector<ray<double>> bounced;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    answer const& a = answers[i];
    if (!is_hit(a)) continue;
    auto const& patch = patches[std::size_t(a.patch)];
    vec3<double> n = normal(patch, a.u, a.v);
    if (dot(n, rays[i].direction) > 0) n = -n;
    double const z = 1 - 2 * uniform(), phi = 2 * std::numbers::pi * uniform(), s = std::sqrt(1 - z * z);
    vec3<double> const lobe = n + vec3<double>(s * std::cos(phi), s * std::sin(phi), z);
    double const size = std::sqrt(dot(lobe, lobe));
    vec3<double> const start(evaluate_exactly(patch, a.u, a.v).s);
    bounced.push_back({start + offset * n, size > 1e-6 ? lobe / size : n, 0, std::numeric_limits<double>::infinity()});
  }
  return bounced;
}

}  // namespace patchrt::bench
