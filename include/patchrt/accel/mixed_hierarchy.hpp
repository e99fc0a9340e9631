// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The mixed hierarchy: a BVH over patches, below each patch a tree of sub-patch boxes.

#include <patchrt/accel/subpatch_tree.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/shapes/surface_form.hpp>

#include <cstdint>

namespace patchrt {

/// One patch as the search sees it: moved to its own origin and scaled with the scene, in float.
template <class Surface> struct search_patch {
  typename surface_form<Surface>::template power<float> power;
  vec3<float>
      reach;  ///< bounds the sum of |coefficients|, and any ray's entry into the patch's box, times the weights' sum
  float gap;  ///< the largest of the edges' gaps, in search space
  subpatch_tree tree;
};

/// One patch as its hits are computed from: control points relative to `base`, in the user's units.
template <class Surface> struct exact_patch {
  typename surface_form<Surface>::template power<double> power;  ///< where roots are corrected
  Surface patch;                                                 ///< and where that does not settle them
  vec3<double> base;                                             ///< in the user's space
  vec3<double> search_base;                                      ///< the same point in search space
  double size;                                                   ///< the largest |coordinate| of `patch`
  double rounding;                                               ///< bounds what rounding does to a point of `power`
  double slope, bend;  ///< bound |S_x| + |S_y| and |S_xx| + 2 |S_xy| + |S_yy|, each coordinate, in search space
  edge_gaps gaps;
};

/// The mixed hierarchy as kernels see it, on host or device. `build_mixed_hierarchy` makes one.
///
/// Search space is (x - centre) * inverse_scale: the scene's box has its middle at 0 and reaches to 1 in no coordinate
/// beyond. Boxes of `top` are in search space, padded by `search_margin`. `Surface` is the kind of all its patches: a
/// `bezier_patch<double, M, N>` or a `rational_patch<double, M, N>`, M, N <= 5.
/// \note Nigam & Narayanan 2012, section 3: SAH over patches, fixed-depth binary trees below them, both stackless. Section 6 asks for
///       other parametric surfaces.
template <class Surface> struct basic_mixed_hierarchy_view {
  bvh_view<float> top;
  search_patch<Surface> const* search;
  exact_patch<Surface> const* exact;
  subpatch_node const* nodes;
  subpatch_leaf const* leaves;
  vec3<double> centre;
  double inverse_scale;
  vec3<float> half_extent;  ///< of the scene's box in search space
};
using mixed_hierarchy_view = basic_mixed_hierarchy_view<bicubic_patch<double>>;

/// What covers the rounding to float of everything in search space, in its units.
inline constexpr float search_margin = 0x1p-19f;

}  // namespace patchrt
