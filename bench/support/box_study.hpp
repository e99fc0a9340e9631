// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Boxes in float, double and bytes: how long rays take through them, how many cells they enter, and whether they miss the cell
/// that their root is in.

#include "accuracy_rows.hpp"

#include "support/oracle.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/accel/build_sah.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/shapes/bezier_split.hpp>

#include <deque>
#include <memory>

namespace patchrt::bench {

inline constexpr int box_depth = 6;  ///< of the cut of every patch: 8 x 8 cells

inline unsigned octant_of(vec3<double> const& d) {
  return unsigned(d.x < 0) | unsigned(d.y < 0) << 1 | unsigned(d.z < 0) << 2;
}

/// The boxes of the 8 x 8 cells of every patch's control points in one BVH of T's, with no margin.
template <class T> class cell_boxes {
 public:
  explicit cell_boxes(test::patch_list const& scene) {
    std::vector<box<T>> boxes;
    for (auto const& p : scene) cut(p, box_depth, boxes);
    tree_ = build_sah(std::span<box<T> const>(boxes), serial{});
  }

  /// f(patch, cell) for every cell entered: the cell's number has a bit a halving, u first, the second halves 1.
  template <slab S, class F> void walk(ray<double> const& r, F&& f) const {
    auto const slabs = make_slab_ray<T>(vec3<T>(r.origin), vec3<T>(r.direction));
    T const t_min = T(r.t_min), t_max = T(r.t_max);
    traverse(
        tree_.view(), octant_of(r.direction),
        [&](box<T> const& b) {
          auto const s = intersect<S>(slabs, b, t_min, t_max);
          return s.entry <= s.exit;
        },
        [&](std::int32_t k) {
          f(std::size_t(k) >> box_depth, unsigned(k) & ((1u << box_depth) - 1));
          return false;
        });
  }

 private:
  static void cut(bicubic_patch<double> const& p, int depth, std::vector<box<T>>& boxes) {
    if (depth == 0) {
      auto const b = bounds(p);
      boxes.push_back({vec3<T>(b.lo), vec3<T>(b.hi)});
      return;
    }
    auto const halves = depth % 2 == 0 ? split_u(p) : split_v(p);
    cut(halves.first, depth - 1, boxes);
    cut(halves.second, depth - 1, boxes);
  }

  bvh<T> tree_;
};

/// The same cells in the mixed hierarchy: boxes over patches in float, of cells in bytes, all rounded outward.
class mixed_boxes {
 public:
  explicit mixed_boxes(test::patch_list const& scene) {
    mixed_hierarchy_options options;
    options.depth = box_depth;
    hierarchy_ = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, serial{});
  }

  template <slab, class F> void walk(ray<double> const& r, F&& f) const {
    auto const h = hierarchy_.view();
    vec3<double> const moved = (r.origin - h.centre) * h.inverse_scale;
    auto const slabs = make_slab_ray<float>(vec3<float>(moved), vec3<float>(r.direction * h.inverse_scale));
    unsigned const octant = octant_of(r.direction);
    float const t_min = float(r.t_min), t_max = float(r.t_max);
    traverse(
        h.top, octant,
        [&](box<float> const& b) {
          auto const s = intersect(slabs, b, t_min, t_max);
          return s.entry <= s.exit;
        },
        [&](std::int32_t patch) {
          auto const& tree = h.search[patch].tree;
          vec3<double> const base = moved - h.exact[patch].search_base;
          vec3<float> const &step = tree.grid_step, &corner = tree.grid_origin;
          slab_ray<float> const grid{{(float(base.x) - corner.x) / step.x, (float(base.y) - corner.y) / step.y,
                                      (float(base.z) - corner.z) / step.z},
                                     {slabs.inverse.x * step.x, slabs.inverse.y * step.y, slabs.inverse.z * step.z}};
          traverse(
              tree, h.nodes, octant,
              [&](subpatch_node const& n) {
                box<float> const b{{float(n.lo[0]), float(n.lo[1]), float(n.lo[2])},
                                   {float(n.hi[0]), float(n.hi[1]), float(n.hi[2])}};
                auto const s = intersect(grid, b, t_min, t_max);
                return s.entry <= s.exit;
              },
              [&](std::uint32_t, std::uint32_t leaf) { f(std::size_t(patch), leaf); });
          return false;
        });
  }

 private:
  mixed_hierarchy hierarchy_;
};

/// The number of the cell that a root is in: bits of u and v in turn.
inline unsigned cell_of(test::oracle_root const& root) {
  auto const at = [](long double x) { return unsigned(std::clamp(int(8 * x), 0, 7)); };
  unsigned const u = at(root.u), v = at(root.v);
  unsigned cell = 0;
  for (int bit = 2; bit >= 0; --bit) cell = cell << 2 | (u >> bit & 1u) << 1 | (v >> bit & 1u);
  return cell;
}

/// `lost` of these rows counts roots, grazing ones too, whose cell is not entered; `value` is the mean number of cells entered.
template <class Boxes, slab S>
accuracy_row box_row(std::string const& workload, char const* method, char const* number, test::patch_list const& scene,
                     test::ray_list const& rays, std::span<std::size_t const> judged,
                     std::span<std::vector<test::oracle_root> const> roots) {
  auto const boxes = std::make_shared<Boxes>(scene);
  std::size_t entered = 0, lost = 0;
  for (std::size_t k = 0; k < roots.size(); ++k) {
    std::vector<std::pair<std::size_t, unsigned>> cells;
    boxes->template walk<S>(rays[judged[k]], [&](std::size_t p, unsigned c) { cells.emplace_back(p, c); });
    entered += cells.size();
    for (auto const& root : roots[k]) {
      bool const is_inside = root.u >= 0 && root.u <= 1 && root.v >= 0 && root.v <= 1 && root.end_distance > 0;
      std::pair const cell{std::size_t(root.patch), cell_of(root)};
      lost += is_inside && std::find(cells.begin(), cells.end(), cell) == cells.end();
    }
  }
  error_list errors;
  errors.lost = lost;
  char mean[32];
  std::snprintf(mean, sizeof mean, "%.2f cells", double(entered) / double(std::max<std::size_t>(roots.size(), 1)));
  auto const* const list = &rays;
  return {"boxes",
          workload,
          method,
          number,
          mean,
          rays.size(),
          std::move(errors),
          {method, [boxes, list] {
             std::size_t count = 0;
             for (auto const& r : *list) boxes->template walk<S>(r, [&](std::size_t, unsigned) { ++count; });
             [[maybe_unused]] auto volatile const seen = count;
           }}};
}

inline void add_box_rows(std::vector<accuracy_row>& rows, std::string const& workload, test::patch_list const& scene,
                         test::ray_list const& rays, std::span<std::size_t const> judged,
                         std::span<std::vector<test::oracle_root> const> roots) {
  auto const add = [&]<class Boxes, slab S>(char const* method, char const* number) {
    rows.push_back(box_row<Boxes, S>(workload, method, number, scene, rays, judged, roots));
  };
  add.template operator()<cell_boxes<float>, slab::nearest>("BVH over cells", "float");
  add.template operator()<cell_boxes<float>, slab::conservative>("BVH over cells, widened", "float");
  add.template operator()<cell_boxes<double>, slab::nearest>("BVH over cells", "double");
  add.template operator()<cell_boxes<double>, slab::conservative>("BVH over cells, widened", "double");
  add.template operator()<mixed_boxes, slab::nearest>("mixed hierarchy", "float, bytes");
}

}  // namespace patchrt::bench
