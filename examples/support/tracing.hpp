// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/accel/cull_back_faces.hpp>
#include <patchrt/exec/openmp.hpp>
#include <patchrt/shapes/bezier_patch.hpp>
#include <patchrt/trace/fused.hpp>

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace patchrt::examples {

inline constexpr std::array<accuracy, 4> accuracy_levels = {accuracy::fast, accuracy::refined, accuracy::certified,
                                                            accuracy::reference};

/// The level's name on the command line.
std::string_view name_of(accuracy level);

/// \throws std::invalid_argument for what no level is called.
accuracy accuracy_named(std::string_view name);

/// A model that rays can be shot at, with accuracy and threads chosen at run time.
class tracer {
 public:
  /// \param threads 0 leaves the number to OpenMP.
  tracer(std::span<bicubic_patch<double> const> patches, int threads);
  tracer(tracer const&) = delete;
  tracer& operator=(tracer const&) = delete;

  /// From now on rays, which must begin at `eye`, may miss what turns its back to it. Gives the share of sub-patches left out.
  double cull_back_faces(vec3<double> const& eye, patch_front front);

  /// The nearest hit of each ray; some hit where `any`.
  void trace(accuracy level, bool any, std::span<ray<double> const> rays, std::span<patch_hit> hits) const;
  /// The work that `trace` does for these rays, found by doing it again: counting takes time of its own.
  hierarchy_counts count_work(accuracy level, bool any, std::span<ray<double> const> rays) const;

  openmp const& executor() const { return executor_; }
  double build_seconds() const { return build_seconds_; }
  std::size_t hierarchy_bytes() const { return hierarchy_.hierarchy_bytes(); }
  std::size_t patch_bytes() const { return hierarchy_.patch_bytes(); }

 private:
  mixed_hierarchy_view view() const { return visible_ ? visible_->view() : hierarchy_.view(); }

  openmp executor_;
  mixed_hierarchy hierarchy_;
  std::optional<visible_hierarchy> visible_;
  double build_seconds_ = 0;
};

}  // namespace patchrt::examples
