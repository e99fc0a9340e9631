// SPDX-License-Identifier: MIT
// host only
#pragma once

#include <patchrt/accel/build_grouped_sah.hpp>
#include <patchrt/accel/build_wide_bvh.hpp>
#include <patchrt/accel/scene.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace patchrt {

/// Which walks a scene is built for.
struct scene_options {
  bool wide = true;       ///< the wide tree, which `trace::closest_hits` and `trace::any_hits` walk
  bool stackless = true;  ///< the binary tree with links, which `intersect` walks, on devices too
};

/// A scene ready for rays: owns what `scene_view` points to.
template <class... Shapes> struct scene {
  std::tuple<std::vector<typename shape_kind<Shapes>::block>...> blocks;
  std::array<std::uint32_t, sizeof...(Shapes)> first_leaf{}, end_leaf{}, first_shape{};
  bvh<float> top;
  wide_bvh wide;
  box<float> bounds = box<float>::empty();  ///< of the trees' boxes
  vec3<double> centre{0.0, 0.0, 0.0};
  double reach = 0;

  scene_view<Shapes...> view() const {
    std::size_t k = 0;
    return {make_list<Shapes>(k++)..., top.view(), wide.view(), bounds, centre, reach};
  }
  /// Bytes of both trees and of the shapes as kernels read them.
  std::size_t bytes() const {
    std::size_t sum = top.bytes() + wide.bytes();
    std::apply([&](auto const&... b) { ((sum += b.size() * sizeof(b[0])), ...); }, blocks);
    return sum;
  }

 private:
  template <class Shape> shape_list<Shape> make_list(std::size_t k) const {
    return {std::get<std::vector<typename shape_kind<Shape>::block>>(blocks).data(), first_leaf[k], end_leaf[k]};
  }
};

namespace detail {

/// The box of a shape in float, rounded outward.
template <class Shape> box<float> float_bounds(Shape const& shape) {
  auto const b = bounds(shape);
  constexpr float inf = std::numeric_limits<float>::infinity();
  auto const down = [](auto x) {
    float const f = static_cast<float>(x);
    return f > x ? std::nextafter(f, -inf) : f;
  };
  auto const up = [](auto x) {
    float const f = static_cast<float>(x);
    return f < x ? std::nextafter(f, inf) : f;
  };
  return {{down(b.lo.x), down(b.lo.y), down(b.lo.z)}, {up(b.hi.x), up(b.hi.y), up(b.hi.z)}};
}

template <class... Shapes> class scene_builder {
 public:
  explicit scene_builder(std::span<Shapes const>... lists) : lists_(lists...) {
    std::size_t n = 0, k = 0;
    ((scene_.first_shape[k++] = static_cast<std::uint32_t>(n), n += lists.size()), ...);
    if (n > std::size_t(1) << 30)
      throw std::length_error("build_scene: " + std::to_string(n) + " shapes, expected at most 2^30");
    primitives_.reserve(n);
    k = 0;
    (add_boxes(lists, k++), ...);
  }

  template <executor E> scene<Shapes...> build(scene_options const& options, E const& exec) {
    pad();
    grouped_bvh<float> grouped = build_grouped_sah<most_>(
        std::move(primitives_), [this](std::span<std::uint32_t const> shapes) { return fits(shapes); }, exec);
    number_leaves(grouped);
    std::size_t k = 0;
    (fill<Shapes>(k++, grouped, exec), ...);
    if (options.wide) scene_.wide = build_wide_bvh(grouped.tree);
    if (options.stackless) {
      scene_.top = std::move(grouped.tree);
      scene_.top.links.resize(scene_.top.nodes.size());
      link_octants(std::span<bvh_node<float> const>(scene_.top.nodes), std::span<octant_links>(scene_.top.links));
    }
    return std::move(scene_);
  }

 private:
  static constexpr std::size_t kinds = sizeof...(Shapes);
  static constexpr std::size_t capacities[kinds] = {shape_kind<Shapes>::capacity...};
  static constexpr std::size_t most_ = std::max({std::size_t(shape_kind<Shapes>::capacity)...});

  template <class Shape> void add_boxes(std::span<Shape const> shapes, std::size_t kind) {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      box<float> const b = float_bounds(shapes[i]);
      auto const is_finite = [](vec3<float> const& p) {
        return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
      };
      if (b != box<float>::empty() && !(is_finite(b.lo) && is_finite(b.hi)))
        throw std::invalid_argument("build_scene: the bounds of shape " + std::to_string(i) + " of list " +
                                    std::to_string(kind) + " are not finite, expected numbers that float holds");
      primitives_.emplace_back(b, static_cast<std::uint32_t>(primitives_.size()));
    }
  }

  void pad() {
    box<float> all = box<float>::empty();
    for (sah_primitive<float> const& p : primitives_)
      if (!is_empty(p.bounds())) all = merge(all, p.bounds());
    if (is_empty(all)) return;
    vec3<double> const lo(all.lo), hi(all.hi), half = scale(difference(hi, lo), 0.5);
    scene_.centre = sum(lo, half);
    double const radius = std::sqrt(dot(half, half));
    scene_.reach = 2 * radius;
    // An origin within reach is rounded by half an ulp of |centre| + 2 radius, and a direction's rounding moves the
    // ray by as much of 4 radius before it leaves the scene; four times that.
    vec3<double> const c = absolute(scene_.centre);
    float const margin = static_cast<float>(0x1p-22 * (std::max({c.x, c.y, c.z}) + 6 * radius));
    vec3<float> const m(margin, margin, margin);
    for (sah_primitive<float>& p : primitives_)
      if (!is_empty(p.bounds())) p.widen(margin);
    scene_.bounds = {all.lo - m, all.hi + m};
  }

  std::size_t kind_of(std::uint32_t shape) const {
    std::size_t k = kinds - 1;
    while (scene_.first_shape[k] > shape) --k;
    return k;
  }

  bool fits(std::span<std::uint32_t const> shapes) const {
    std::size_t const kind = kind_of(shapes[0]);
    if (shapes.size() > capacities[kind]) return false;
    if constexpr (kinds > 1)
      for (std::uint32_t s : shapes)
        if (kind_of(s) != kind) return false;
    return true;
  }

  /// Numbers leaves kind by kind, in the tree's order.
  void number_leaves(grouped_bvh<float>& grouped) {
    std::size_t const n = grouped.first.size() - 1;
    std::vector<unsigned char> kind(n);
    std::array<std::uint32_t, kinds> next{};
    for (std::size_t leaf = 0; leaf < n; ++leaf) {
      kind[leaf] = static_cast<unsigned char>(kind_of(grouped.order[grouped.first[leaf]]));
      ++scene_.end_leaf[kind[leaf]];
    }
    for (std::size_t k = 1; k < kinds; ++k) {
      next[k] = scene_.first_leaf[k] = scene_.end_leaf[k - 1];
      scene_.end_leaf[k] += scene_.first_leaf[k];
    }
    places_.resize(n);
    std::uint32_t leaf = 0;
    for (bvh_node<float>& node : grouped.tree.nodes) {
      if (node.primitive < 0) continue;
      std::uint32_t const number = next[kind[leaf]]++;
      places_[number] = leaf++;
      node.primitive = static_cast<std::int32_t>(number);
    }
  }

  template <class Shape, class E> void fill(std::size_t kind, grouped_bvh<float> const& grouped, E const& exec) {
    auto& blocks = std::get<std::vector<typename shape_kind<Shape>::block>>(scene_.blocks);
    std::span<Shape const> const shapes = std::get<std::span<Shape const>>(lists_);
    std::uint32_t const first_leaf = scene_.first_leaf[kind], count = scene_.end_leaf[kind] - first_leaf;
    std::uint32_t const first_shape = scene_.first_shape[kind];
    auto const shape = [&](std::uint32_t at) -> Shape const& { return shapes[grouped.order[at] - first_shape]; };
    if constexpr (shape_kind<Shape>::shares_lanes) {
      blocks.resize(count);
      exec.for_each_chunk(count, std::size_t(1024), [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          std::uint32_t at = grouped.first[places_[first_leaf + i]];
          std::uint32_t const last = grouped.first[places_[first_leaf + i] + 1];
          for (int lane = 0; lane < blocks[i].width; ++lane, ++at)
            if (at < last) blocks[i].set(lane, shape_kind<Shape>::prepare(shape(at)), shape_number(grouped, at));
            else blocks[i].set(lane, {}, -1);
        }
      });
    } else {
      blocks.reserve(count);
      for (std::uint32_t i = 0; i < count; ++i) {
        std::uint32_t const at = grouped.first[places_[first_leaf + i]];
        blocks.push_back({shape(at), shape_number(grouped, at)});
      }
    }
  }

  static std::int32_t shape_number(grouped_bvh<float> const& grouped, std::uint32_t at) {
    return static_cast<std::int32_t>(grouped.order[at]);
  }

  std::tuple<std::span<Shapes const>...> lists_;
  scene<Shapes...> scene_;
  std::vector<sah_primitive<float>> primitives_;
  std::vector<std::uint32_t> places_;  // of a leaf's number, where it is in the tree's order
};

}  // namespace detail

/// A scene of lists of shapes, each of another kind; any may be empty.
///
/// Shapes are numbered through all lists. A shape whose box is empty is in the scene, and no ray meets it.
/// \throws std::invalid_argument naming the list and the shape whose bounds are not finite.
template <class... Shapes, executor E>
scene<Shapes...> build_scene(scene_options const& options, E const& exec, std::span<Shapes const>... lists) {
  return detail::scene_builder<Shapes...>(lists...).build(options, exec);
}
/// The same for all walks, in this thread.
template <class... Shapes> scene<Shapes...> build_scene(std::vector<Shapes> const&... lists) {
  return build_scene<Shapes...>(scene_options{}, serial{}, std::span<Shapes const>(lists)...);
}

}  // namespace patchrt
