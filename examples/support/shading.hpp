// SPDX-License-Identifier: MIT
#pragma once

#include "camera.hpp"

#include <patchrt/trace/fused.hpp>

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace patchrt::examples {

/// The names of what a pixel can show: shaded, depth, normal, uv, patch.
std::vector<std::string> const& aov_names();

/// Turns hits into colours.
class shader {
 public:
  /// \param aov One of `aov_names`.
  /// \throws std::invalid_argument for any other.
  shader(std::string_view aov, std::span<bicubic_patch<double> const> patches, camera const& view);

  /// The colour of a primary ray's hit or miss.
  ///
  /// shaded: one light over the viewer's left shoulder, both sides of the surface alike; depth: white at the model's nearest
  /// depth to dark at its farthest; normal: (n + 1) / 2 of the unit normal along Qu x Qv; uv: red u, green v; patch: a colour
  /// each. All but `shaded` show misses black.
  rgb8 operator()(ray<double> const& r, patch_hit const& hit) const;

 private:
  rgb8 shaded(ray<double> const& r, patch_hit const& hit) const;

  enum class kind { shaded, depth, normal, uv, patch } kind_;
  std::span<bicubic_patch<double> const> patches_;
  camera view_;
  vec3<double> to_light_;
  double nearest_ = 0;
  double farthest_ = 0;
};

}  // namespace patchrt::examples
