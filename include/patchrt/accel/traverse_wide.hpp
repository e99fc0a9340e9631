// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Walks of a wide tree: by one ray that meets eight boxes at once, and by a bundle of rays of one octant that meets
/// eight boxes as a whole before each ray does.

#include <patchrt/accel/wide_bvh.hpp>
#include <patchrt/intersect/ray_box.hpp>

#include <array>
#include <bit>

namespace patchrt {

namespace detail {

/// Where children wait for their turn. A node leaves at most seven behind, and no tree that `build_sah` makes is deeper than
/// 64 + log2 n.
inline constexpr int wide_stack = 8 * 96;

/// slots[o]: the children's slots from far to near for a direction of octant o.
inline constexpr auto far_to_near = [] {
  std::array<std::array<std::int32_t, wide_node::width>, 8> slots{};
  for (std::size_t o = 0; o < 8; ++o)
    for (std::size_t k = 0; k < 8; ++k) slots[o][k] = static_cast<std::int32_t>((7 - k) ^ o);
  return slots;
}();

/// Which planes of boxes rays of one octant pass first, and last: where the rows of `wide_node::bounds` begin, by axis.
struct wide_planes {
  std::size_t near[3], far[3];

  PATCHRT_INLINE explicit wide_planes(unsigned octant) {
    for (unsigned a = 0; a < 3; ++a) {
      unsigned const backward = octant >> a & 1u;
      near[a] = wide_node::width * (2 * a + backward);
      far[a] = wide_node::width * (2 * a + 1 - backward);
    }
  }
  /// Of all children of a node, a lane each.
  template <class P> PATCHRT_INLINE static vec3<P> load(wide_node const& n, std::size_t const (&rows)[3]) {
    float const* const b = n.bounds[0];
    return {P::load(b + rows[0]), P::load(b + rows[1]), P::load(b + rows[2])};
  }
  /// Of one.
  PATCHRT_INLINE static vec3<float> load(wide_node const& n, std::size_t const (&rows)[3], unsigned slot) {
    float const* const b = n.bounds[0] + slot;
    return {b[rows[0]], b[rows[1]], b[rows[2]]};
  }
};

}  // namespace detail

/// Walks the tree for one ray. `P` is a pack of eight floats.
///
/// `nearest()` is the t beyond which boxes are skipped; `leaf(number, entry)` is called for leaves that the ray meets, with the
/// t at which it enters, and ends the walk by true. With `AnyHit` in no particular order, else from near to far, about.
/// \return whether `leaf` ended it.
template <bool AnyHit, class P, class Nearest, class Leaf>
PATCHRT_INLINE bool traverse_wide(wide_bvh_view const& tree, watertight_slab_ray<float> const& ray, float t_min,
                                  Nearest const& nearest, Leaf const& leaf) {
  if (tree.count == 0) return false;
  unsigned const octant =
      unsigned(ray.inverse.x < 0) | unsigned(ray.inverse.y < 0) << 1 | unsigned(ray.inverse.z < 0) << 2;
  detail::wide_planes const planes(octant);
  auto const in_lanes = [](vec3<float> const& v) { return vec3<P>{P(v.x), P(v.y), P(v.z)}; };
  watertight_slab_ray<P> const wide{in_lanes(ray.origin), in_lanes(ray.inverse), in_lanes(ray.exit_inverse)};
  std::int32_t const* const order = detail::far_to_near[octant].data();
  P const start(t_min);
  float entries[detail::wide_stack];
  float waiting[detail::wide_stack];  // bits of children
  int count = 0;
  std::uint32_t current = 0;
  float entry = t_min;
  for (;;) {
    if ((current & wide_node::leaf) == 0) {
      wide_node const& n = tree.nodes[current];
      auto const span =
          intersect(wide, planes.load<P>(n, planes.near), planes.load<P>(n, planes.far), start, P(nearest()));
      auto const in_order = [&](P const& x) PATCHRT_INLINE_LAMBDA {
        if constexpr (AnyHit) return x;
        else return permute(x, order);
      };
      P const from = in_order(span.entry);
      unsigned const met = at_most_bits(from, in_order(span.exit));
      if (met != 0) {
        int const last = std::bit_width(met) - 1;
        current = n.child[AnyHit ? unsigned(last) : unsigned(7 - last) ^ octant];
        store_some(met, from, entries + count);
        store_some(met, in_order(P::load(reinterpret_cast<float const*>(n.child))), waiting + count);
        count += std::popcount(met) - 1;
        entry = entries[count];
        continue;
      }
    } else if (leaf(current & ~wide_node::leaf, entry)) {
      return true;
    }
    do {
      if (count == 0) return false;
      --count;
    } while (!(entries[count] <= nearest()));
    current = std::bit_cast<std::uint32_t>(waiting[count]);
    entry = entries[count];
  }
}

namespace detail {

/// What all rays of a bundle have in common: bounds of their origins and of the inverses of their directions, by axis.
/// For every ray `near - origin` is at least `near - first`, `far - origin` at most `far - last`.
template <class P> struct ray_bundle {
  P first[3], last[3], least_inverse[3], most_inverse[3], least_exit[3], most_exit[3];
  P t_min;

  /// The greatest t at which some ray may be outside the planes `far`, and the least at which some may be inside `near`.
  PATCHRT_INLINE slab_span<P> intersect(vec3<P> const& near, vec3<P> const& far, P t_max) const {
    slab_span<P> s{t_min, t_max};
    PATCHRT_UNROLL
    for (int a = 0; a < 3; ++a) {
      P const in = component(near, a) - first[a], out = component(far, a) - last[a];
      s.entry = max(min(in * least_inverse[a], in * most_inverse[a]), s.entry);
      s.exit = min(max(out * least_exit[a], out * most_exit[a]), s.exit);
    }
    return s;
  }
};

}  // namespace detail

/// Walks the tree for those lanes of a pack of rays that `lanes` names: some, all of one octant. `P` is a pack of eight
/// floats.
///
/// `nearest()` is each lane's t beyond which boxes are skipped; `leaf(number, lanes, entry)` is called for leaves that the
/// lanes meet, and gives those that go on; the walk ends where none do.
/// \note Every operation on a bundle is monotone in what it takes the bounds of, rounding included: no box is skipped for
///       all that one lane would not skip. Boulos, Wald & Shirley, "Geometric and arithmetic culling methods for entire
///       ray packets", University of Utah UUCS-06-010, 2006.
template <class P, scalar T, class Nearest, class Leaf>
PATCHRT_INLINE void traverse_wide_bundle(wide_bvh_view const& tree, watertight_slab_ray<T> const& rays, T const& t_min,
                                         mask_t<T> lanes, Nearest const& nearest, Leaf const& leaf) {
  if (tree.count == 0) return;
  constexpr float inf = std::numeric_limits<float>::infinity();
  auto const least = [&](T const& x) { return least_lane(select(lanes, x, T(inf))); };
  auto const most = [&](T const& x) { return -least_lane(select(lanes, -x, T(inf))); };
  unsigned octant = 0;
  detail::ray_bundle<P> bundle;
  for (int a = 0; a < 3; ++a) {
    T const origin = component(rays.origin, a), inverse = component(rays.inverse, a);
    float const low = least(inverse), high = most(inverse), lo = least(origin), hi = most(origin);
    bool const backward = low < 0;
    octant |= unsigned(backward) << a;
    bundle.first[a] = P(backward ? lo : hi);
    bundle.last[a] = P(backward ? hi : lo);
    bundle.least_inverse[a] = P(low);
    bundle.most_inverse[a] = P(high);
    // As `make_watertight_slab_ray` makes them of each lane's.
    bundle.least_exit[a] = P(low * detail::exit_widening<float>());
    bundle.most_exit[a] = P(high * detail::exit_widening<float>());
  }
  bundle.t_min = P(least(t_min));
  detail::wide_planes const planes(octant);
  std::int32_t const* const order = detail::far_to_near[octant].data();
  P const slots = P::load(reinterpret_cast<float const*>(order));
  float farthest = most(nearest());
  float entries[detail::wide_stack];
  float waiting[detail::wide_stack];  // bits of slots
  std::uint32_t parents[detail::wide_stack];
  int count = 0;
  std::uint32_t current = 0;
  for (;;) {
    wide_node const& n = tree.nodes[current];
    auto const span = bundle.intersect(planes.load<P>(n, planes.near), planes.load<P>(n, planes.far), P(farthest));
    P const from = permute(span.entry, order);
    unsigned const met = at_most_bits(from, permute(span.exit, order));
    store_some(met, from, entries + count);
    store_some(met, slots, waiting + count);
    for (int end = count + std::popcount(met); count < end; ++count) parents[count] = current;
    for (;;) {
      if (count == 0) return;
      --count;
      if (!(entries[count] <= farthest)) continue;
      wide_node const& parent = tree.nodes[parents[count]];
      unsigned const slot = std::bit_cast<std::uint32_t>(waiting[count]);
      auto const met_by = intersect(rays, planes.load(parent, planes.near, slot), planes.load(parent, planes.far, slot),
                                    t_min, nearest());
      auto const in = lanes && met_by.entry <= met_by.exit;
      if (!any_of(in)) continue;
      std::uint32_t const child = parent.child[slot];
      if ((child & wide_node::leaf) == 0) {
        current = child;
        break;
      }
      lanes = lanes && leaf(child & ~wide_node::leaf, in, met_by.entry);
      if (!any_of(lanes)) return;
      farthest = most(nearest());
    }
  }
}

}  // namespace patchrt
