// SPDX-License-Identifier: MIT
#include "shading.hpp"

#include <patchrt/shapes/bezier_normal.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace patchrt::examples {

namespace {

vec3<double> unit(vec3<double> const& v) { return v / std::sqrt(dot(v, v)); }

/// v in [0, 1] to [0, 255].
rgb8 quantised(vec3<double> const& v) {
  auto const level = [](double x) { return std::uint8_t(std::lround(255 * std::clamp(x, 0.0, 1.0))); };
  return {level(v.x), level(v.y), level(v.z)};
}

/// Linear light to the sRGB curve.
rgb8 encoded(vec3<double> const& light) {
  auto const curve = [](double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; };
  return quantised({curve(light.x), curve(light.y), curve(light.z)});
}

/// Hues a golden section apart: neighbouring numbers differ clearly.
vec3<double> patch_colour(std::int32_t patch) {
  double const hue = 6 * std::fmod(0.61803398874989485 * patch, 1.0);
  auto const channel = [hue](double at) {
    return 0.25 + 0.75 * std::clamp(std::abs(std::remainder(hue - at, 6)) - 1, 0.0, 1.0);
  };
  return {channel(3), channel(5), channel(1)};
}

}  // namespace

std::vector<std::string> const& aov_names() {
  static std::vector<std::string> const names = {"shaded", "depth", "normal", "uv", "patch"};
  return names;
}

shader::shader(std::string_view aov, std::span<bicubic_patch<double> const> patches, camera const& view)
    : patches_(patches), view_(view) {
  auto const found = std::find(aov_names().begin(), aov_names().end(), aov);
  if (found == aov_names().end()) throw std::invalid_argument("nothing to show is called " + std::string(aov));
  kind_ = kind(found - aov_names().begin());
  to_light_ = unit(unit(view.up) * 0.9 - unit(view.right) * 0.7 - view.forward);
  nearest_ = std::numeric_limits<double>::infinity();
  for (auto const& patch : patches)
    for (auto const& p : patch.control_points) {
      double const depth = std::max(dot(p - view.eye, view.forward), 0.0);
      nearest_ = std::min(nearest_, depth);
      farthest_ = std::max(farthest_, depth);
    }
}

rgb8 shader::shaded(ray<double> const& r, patch_hit const& hit) const {
  if (!hit.valid()) {
    double const height = 0.5 + 0.5 * dot(r.direction, view_.up) / dot(view_.up, view_.up);
    return encoded(vec3<double>{0.62, 0.68, 0.75} * (0.55 + 0.45 * height));
  }
  vec3<double> n = normal(patches_[std::size_t(hit.patch)], hit.u, hit.v);
  vec3<double> const to_eye = -unit(r.direction);
  if (dot(n, to_eye) < 0) n = -n;
  double const lambert = std::max(dot(n, to_light_), 0.0);
  double const shine = 0.3 * std::pow(std::max(dot(n, unit(to_light_ + to_eye)), 0.0), 60.0);
  double const ambient = 0.04 + 0.08 * dot(n, to_eye);  // so that form shows where the light does not reach
  return encoded(vec3<double>{0.75, 0.33, 0.16} * (ambient + 0.9 * lambert) + vec3<double>{shine, shine, shine});
}

rgb8 shader::operator()(ray<double> const& r, patch_hit const& hit) const {
  if (kind_ == kind::shaded) return shaded(r, hit);
  if (!hit.valid()) return {0, 0, 0};
  switch (kind_) {
    case kind::depth: {
      double const grey =
          1 - 0.9 * (hit.t - nearest_) / std::max(farthest_ - nearest_, std::numeric_limits<double>::min());
      return quantised({grey, grey, grey});
    }
    case kind::normal:
      return quantised((normal(patches_[std::size_t(hit.patch)], hit.u, hit.v) + vec3<double>{1, 1, 1}) * 0.5);
    case kind::uv:
      return quantised({hit.u, hit.v, 0});
    default:
      return quantised(patch_colour(hit.patch));
  }
}

}  // namespace patchrt::examples
