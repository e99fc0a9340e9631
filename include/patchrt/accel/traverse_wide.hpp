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
/// 64 + log2 n + 8.
inline constexpr int wide_stack = 8 * 96;

/// How rays of one octant walk: where the rows of `wide_node::bounds` of those planes begin that they pass first, and last, by
/// axis; the children's slots from far to near; and of each set of slots, a bit each, those bits in that order and, below
/// them, the nearest slot.
struct wide_octant {
  std::int32_t far_to_near[wide_node::width];
  std::uint32_t near[3];
  std::uint32_t far[3];
  std::uint16_t met[256];
};

inline constexpr auto wide_octants = [] {
  std::array<wide_octant, 8> octants{};
  constexpr std::uint32_t width = wide_node::width;
  for (std::uint32_t o = 0; o < 8; ++o) {
    for (std::uint32_t k = 0; k < width; ++k) octants[o].far_to_near[k] = static_cast<std::int32_t>((7 - k) ^ o);
    for (std::uint32_t m = 1; m < 256; ++m) {
      std::uint32_t in_order = 0, nearest = 0;
      for (std::uint32_t k = 0; k < width; ++k)
        if (std::uint32_t const slot = (7 - k) ^ o; (m >> slot & 1u) != 0) {
          in_order |= 1u << k;
          nearest = slot;
        }
      octants[o].met[m] = static_cast<std::uint16_t>(in_order << 8 | nearest);
    }
    for (std::uint32_t a = 0; a < 3; ++a) {
      std::uint32_t const backward = o >> a & 1u;
      octants[o].near[a] = width * (2 * a + backward);
      octants[o].far[a] = width * (2 * a + 1 - backward);
    }
  }
  return octants;
}();

/// A plane of all children of a node, by axis, a lane each.
template <class P> PATCHRT_INLINE vec3<P> load_planes(wide_node const& n, std::uint32_t const (&rows)[3]) {
  float const* const b = n.bounds[0];
  return {P::load(b + rows[0]), P::load(b + rows[1]), P::load(b + rows[2])};
}
/// Of one.
PATCHRT_INLINE vec3<float> load_planes(wide_node const& n, std::uint32_t const (&rows)[3], unsigned slot) {
  float const* const b = n.bounds[0] + slot;
  return {b[rows[0]], b[rows[1]], b[rows[2]]};
}

}  // namespace detail

/// A ray on its way through a wide tree. `step` takes it on by a node or a leaf, so that several rays can take turns: each
/// waits for its own boxes' data and comparisons only. `P` is a pack of eight floats.
///
/// `nearest()` is the t beyond which boxes are skipped; `leaf(number, entry)` is called for leaves that the ray meets, with
/// the t at which it enters their box or, with `AnyHit`, t_min. The order of leaves is about from near to far, with `AnyHit` no
/// particular one.
template <bool AnyHit, class P> class wide_walk {
 public:
  /// \pre The tree has a node.
  PATCHRT_INLINE wide_walk(wide_bvh_view const& tree, watertight_slab_ray<float> const& ray, float t_min)
      : nodes_(tree.nodes),
        planes_(&detail::wide_octants[unsigned(ray.inverse.x < 0) | unsigned(ray.inverse.y < 0) << 1 |
                                      unsigned(ray.inverse.z < 0) << 2]),
        slabs_{{P(ray.origin.x), P(ray.origin.y), P(ray.origin.z)},
               {P(ray.inverse.x), P(ray.inverse.y), P(ray.inverse.z)},
               {P(ray.exit_inverse.x), P(ray.exit_inverse.y), P(ray.exit_inverse.z)}},
        t_min_(t_min) {
    entries_[0] = t_min;
  }

  /// \return whether there is more to do: neither did `leaf` return true nor are all boxes done.
  template <class Nearest, class Leaf> PATCHRT_INLINE bool step(Nearest const& nearest, Leaf const& leaf) {
    int const count = count_;
    std::uint32_t const current = current_;
    if ((current & wide_node::leaf) != 0) {
      if (leaf(current & ~wide_node::leaf, entries_[AnyHit ? 0 : count])) return false;
      return take_next(count, nearest);
    }
    wide_node const& n = nodes_[current];
    auto const span = intersect(slabs_, detail::load_planes<P>(n, planes_->near),
                                detail::load_planes<P>(n, planes_->far), t_min_, P(nearest()));
    unsigned const met = at_most_bits(span.entry, span.exit);
    if (met == 0) return take_next(count, nearest);
    count_ = count + std::popcount(met) - 1;
    P const children = P::load(reinterpret_cast<float const*>(n.child));
    if constexpr (AnyHit) {
      current_ = n.child[std::bit_width(met) - 1];
      store_some(met, children, waiting_ + count);
    } else {
      unsigned const found = planes_->met[met];
      current_ = n.child[found & 7u];
      auto const order = load_order(t_min_, planes_->far_to_near);
      store_some(found >> 8, permute(span.entry, order), entries_ + count);
      store_some(found >> 8, permute(children, order), waiting_ + count);
    }
    return true;
  }

 private:
  template <class Nearest> PATCHRT_INLINE bool take_next(int count, Nearest const& nearest) {
    do {
      if (count == 0) return false;
      --count;
    } while (!AnyHit && !(entries_[count] <= nearest()));
    current_ = std::bit_cast<std::uint32_t>(waiting_[count]);
    count_ = count;
    return true;
  }

  wide_node const* nodes_;
  detail::wide_octant const* planes_;
  watertight_slab_ray<P> slabs_;
  P t_min_;
  int count_ = 0;  // of those that wait, behind which is the current one's entry
  std::uint32_t current_ = 0;
  float entries_[detail::wide_stack];
  float waiting_[detail::wide_stack];  // bits of children
};

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
  detail::wide_octant const& planes = detail::wide_octants[octant];
  P const slots = P::load(reinterpret_cast<float const*>(planes.far_to_near));
  auto const order = load_order(slots, planes.far_to_near);
  float farthest = most(nearest());
  float entries[detail::wide_stack];
  float waiting[detail::wide_stack];  // bits of slots
  float parents[detail::wide_stack];  // bits of nodes
  int count = 0;
  std::uint32_t current = 0;
  for (;;) {
    wide_node const* parent = tree.nodes + current;
    auto const span = bundle.intersect(detail::load_planes<P>(*parent, planes.near),
                                       detail::load_planes<P>(*parent, planes.far), P(farthest));
    unsigned const met = at_most_bits(span.entry, span.exit);
    unsigned const found = planes.met[met];
    unsigned slot = found & 7u;
    if (met != 0) {  // the nearest child is next, the others wait
      store_some(found >> 8, permute(span.entry, order), entries + count);
      store_some(found >> 8, slots, waiting + count);
      store_lanes(P(std::bit_cast<float>(current)), parents + count);
      count += std::popcount(met) - 1;
    }
    for (bool is_next = met != 0;; is_next = false) {
      if (!is_next) {
        do {
          if (count == 0) return;
          --count;
        } while (!(entries[count] <= farthest));
        parent = tree.nodes + std::bit_cast<std::uint32_t>(parents[count]);
        slot = std::bit_cast<std::uint32_t>(waiting[count]);
      }
      auto const met_by = intersect(rays, detail::load_planes(*parent, planes.near, slot),
                                    detail::load_planes(*parent, planes.far, slot), t_min, nearest());
      auto const in = lanes && met_by.entry <= met_by.exit;
      if (!any_of(in)) continue;
      std::uint32_t const child = parent->child[slot];
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
