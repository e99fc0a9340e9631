// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// All of patchrt that needs no optional package.

#include <patchrt/accel/bvh.hpp>
#include <patchrt/accel/certify_cell.hpp>
#include <patchrt/accel/hierarchy_search.hpp>
#include <patchrt/accel/instance.hpp>
#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/accel/part_list.hpp>
#include <patchrt/accel/patch_search.hpp>
#include <patchrt/accel/refit.hpp>
#include <patchrt/accel/sah_split.hpp>
#include <patchrt/accel/scene.hpp>
#include <patchrt/accel/scene_search.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/accel/scene_triangle.hpp>
#include <patchrt/accel/separate_roots.hpp>
#include <patchrt/accel/shape_kind.hpp>
#include <patchrt/accel/subpatch_tree.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/accel/wide_bvh.hpp>
#include <patchrt/core/affine.hpp>
#include <patchrt/core/box.hpp>
#include <patchrt/core/config.hpp>
#include <patchrt/core/error_free.hpp>
#include <patchrt/core/ray.hpp>
#include <patchrt/core/scalar.hpp>
#include <patchrt/core/twin_planes.hpp>
#include <patchrt/core/vec.hpp>
#include <patchrt/exec/executor.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/intersect/centred_ray.hpp>
#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/intersect/offset_origin.hpp>
#include <patchrt/intersect/quadric_point.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/intersect/ray_patch.hpp>
#include <patchrt/intersect/ray_quadric.hpp>
#include <patchrt/intersect/ray_sphere.hpp>
#include <patchrt/intersect/ray_triangle.hpp>
#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/intersect/reference_root.hpp>
#include <patchrt/intersect/triangle_departure.hpp>
#include <patchrt/numbers/directed.hpp>
#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/interval.hpp>
#include <patchrt/numbers/two_float.hpp>
#include <patchrt/roots/bernstein_pair.hpp>
#include <patchrt/roots/bernstein_part.hpp>
#include <patchrt/roots/enclosure.hpp>
#include <patchrt/roots/isolate.hpp>
#include <patchrt/roots/isolation.hpp>
#include <patchrt/roots/krawczyk.hpp>
#include <patchrt/roots/newton.hpp>
#include <patchrt/roots/parameter_box.hpp>
#include <patchrt/roots/quadratic.hpp>
#include <patchrt/roots/refine_root.hpp>
#include <patchrt/roots/root_clusters.hpp>
#include <patchrt/shapes/bezier_elevate.hpp>
#include <patchrt/shapes/bezier_normal.hpp>
#include <patchrt/shapes/bezier_patch.hpp>
#include <patchrt/shapes/bezier_split.hpp>
#include <patchrt/shapes/clipped_quadric.hpp>
#include <patchrt/shapes/make_quadric.hpp>
#include <patchrt/shapes/power_patch.hpp>
#include <patchrt/shapes/quadric.hpp>
#include <patchrt/shapes/quadric_bounds.hpp>
#include <patchrt/shapes/rational_normal.hpp>
#include <patchrt/shapes/rational_patch.hpp>
#include <patchrt/shapes/rational_power.hpp>
#include <patchrt/shapes/rational_split.hpp>
#include <patchrt/shapes/revolution_patches.hpp>
#include <patchrt/shapes/sphere.hpp>
#include <patchrt/shapes/surface_form.hpp>
#include <patchrt/shapes/triangle.hpp>
#include <patchrt/trace/depart.hpp>
#include <patchrt/trace/patch_hit.hpp>

#if !defined(__CUDACC__)
#  include <patchrt/accel/build_grouped_sah.hpp>
#  include <patchrt/accel/build_mixed_hierarchy.hpp>
#  include <patchrt/accel/build_sah.hpp>
#  include <patchrt/accel/build_scene.hpp>
#  include <patchrt/accel/build_subpatch_tree.hpp>
#  include <patchrt/accel/build_wide_bvh.hpp>
#  include <patchrt/accel/cull_back_faces.hpp>
#  include <patchrt/accel/find_joins.hpp>
#  include <patchrt/accel/sah_builder.hpp>
#  include <patchrt/accel/subpatch_bounds.hpp>
#  include <patchrt/accel/traverse_wide.hpp>
#  include <patchrt/shapes/nurbs.hpp>
#  include <patchrt/trace/all_hits.hpp>
#endif
