// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays on their way through a scene: one ray, or a pack of them, by the same source.

#include <patchrt/accel/scene.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/intersect/ray_box.hpp>

#include <bit>
#include <concepts>
#include <limits>

namespace patchrt {

/// Hits of a pack of rays, or of one; `shape_bits` and `part_bits` are `scene_hit`'s numbers, bit for bit. Of any hits only
/// `t` and `valid` are told.
template <scalar R, scalar T> struct lane_scene_hit {
  R t, u, v;
  T shape_bits, part_bits;
  mask_t<T> valid;
};

namespace detail {

/// A ray as the kernels of one kind want it.
template <class Shape, scalar K> struct kind_ray {
  using type = ray<K>;
  PATCHRT_INLINE static type make(ray<K> const& r) { return r; }
};
template <class Shape, scalar K>
requires(shape_kind<Shape>::shares_lanes) struct kind_ray<Shape, K> {
  using type = decltype(shape_kind<Shape>::make_ray(std::declval<ray<K> const&>()));
  PATCHRT_INLINE static type make(ray<K> const& r) { return shape_kind<Shape>::make_ray(r); }
};
template <class Shape, scalar K> struct kind_ray_slot { typename kind_ray<Shape, K>::type ray_of_kind; };

/// What makes hits independent of the order in which leaves are met: a hit is never nearer than where the ray enters its
/// leaf's box (as the shape is in the box, this brings a rounded t nearer to the truth); a box is skipped only where its entry
/// is beyond the nearest hit, in the same arithmetic; and of equal hits the shape with the smaller number counts.
///
/// T is float or a pack of floats, the number of boxes; R is that of rays and hits, with as many lanes. P is a pack whose lanes
/// the shapes of a leaf share with one ray, or void.
template <bool AnyHit, scalar T, scalar R, class P, class... Shapes> class scene_search {
 public:
  using M = mask_t<T>;
  using L = lane_t<R>;
  template <class Shape> using kernel_t = rebind_lane_t<T, shape_number_t<Shape>>;

  PATCHRT_INLINE scene_search(scene_view<Shapes...> const& scene, ray<R> const& r, M active)
      : scene_(scene), ray_(r), rays_(r) {
    R const zero(L(0)), infinity(std::numeric_limits<L>::infinity());
    hit_ = {r.t_max, zero, zero, T(std::bit_cast<float>(-1)), T(std::bit_cast<float>(-1)), active && !active};
    R const squared = dot(r.direction, r.direction);
    active_ = active && convert<M>(zero < squared && squared < infinity && r.t_min < r.t_max);
    shift_ = zero;
    vec3<R> origin = r.origin;
    if constexpr (!std::same_as<R, T>) {
      vec3<R> const from_centre = difference(r.origin, convert_vec<R>(scene.centre));
      R const to_middle = -dot(from_centre, r.direction) / squared;
      shift_ = max(to_middle - R(L(scene.reach)) / sqrt(squared), zero);
      origin = fma(shift_, r.direction, origin);
      T const t_min = convert<T>(r.t_min - shift_);
      t_min_ = fma(T(-0x1p-22f), abs(t_min), t_min);
    } else {
      t_min_ = r.t_min;
    }
    slabs_ = make_watertight_slab_ray(convert_vec<T>(origin), convert_vec<T>(r.direction));
    follow();
  }

  PATCHRT_INLINE M const& active() const { return active_; }
  PATCHRT_INLINE watertight_slab_ray<T> const& slabs() const { return slabs_; }
  PATCHRT_INLINE T const& t_min() const { return t_min_; }
  /// Beyond which boxes hold nothing that counts.
  PATCHRT_INLINE T const& nearest() const { return nearest_; }
  PATCHRT_INLINE lane_scene_hit<R, T> const& hit() const { return hit_; }

  /// Meets the shapes of a leaf with those lanes that are in its box; `entry` is where. Of any hits, which are not compared,
  /// t is as it is found.
  /// \return the lanes that go on.
  PATCHRT_INLINE M meet_leaf(std::uint32_t leaf, M const& lanes, T const& entry) {
    if constexpr (AnyHit) {
      entry_ = ray_.t_min;
    } else {
      entry_ = convert<R>(entry);
      if constexpr (!std::same_as<R, T>) entry_ = entry_ + shift_;
    }
    (void)(meet_kind<Shapes>(leaf, lanes) || ...);  // a leaf beyond those of all kinds so far is of the next
    if constexpr (AnyHit) active_ = active_ && !hit_.valid;
    return active_;
  }

 private:
  /// The number of the lowest bit that is set: nvcc 13 miscompiles std::countr_zero.
  PATCHRT_INLINE static int lowest_bit(unsigned bits) { return std::popcount(~bits & (bits - 1)); }

  PATCHRT_INLINE void follow() {
    if constexpr (std::same_as<R, T>) nearest_ = hit_.t;
    else nearest_ = convert<T>(hit_.t - shift_);
  }

  /// x in the kernel's number, `way` 4 epsilon farther than it is: what comes out is tested once more against x itself.
  template <scalar K> PATCHRT_INLINE static K beyond(R const& x, int way) {
    K const k = convert<K>(x);
    return fma(K(static_cast<lane_t<K>>(4 * way) * std::numeric_limits<lane_t<K>>::epsilon()), abs(k), k);
  }

  template <class Shape> PATCHRT_INLINE bool meet_kind(std::uint32_t leaf, M const& lanes) {
    shape_list<Shape> const& list = scene_.template list<Shape>();
    if constexpr (!std::same_as<Shape, last_shape>)
      if (leaf >= list.end_leaf) return false;
    auto const& block = list.blocks[leaf - list.first_leaf];
    if constexpr (!shape_kind<Shape>::shares_lanes) meet_one<Shape>(block, lanes);
    else if constexpr (std::same_as<P, void>) meet_each<Shape>(block, lanes);
    else meet_together<Shape>(block);
    return true;
  }

  /// A block of one shape, as users make them.
  template <class Shape, class Block> PATCHRT_INLINE void meet_one(Block const& block, M const& lanes) {
    using K = kernel_t<Shape>;
    using N = shape_number_t<Shape>;
    K const low = beyond<K>(ray_.t_min, -1), high = beyond<K>(hit_.t, 1);
    T const number(std::bit_cast<float>(block.number));
    ray<K> r = static_cast<kind_ray_slot<Shape, K> const&>(rays_).ray_of_kind;
    r.t_min = low;
    auto const ask = [&block](auto const& q) PATCHRT_INLINE_LAMBDA {
      if constexpr (AnyHit && requires { intersect_any(q, block.shape); }) return intersect_any(q, block.shape);
      else return intersect(q, block.shape);
    };
    if constexpr (requires { intersect(r, block.shape); }) {
      r.t_max = select(convert<mask_t<K>>(lanes), high, low);  // other lanes have nothing to find
      auto const h = ask(r);
      auto const [u, v] = parameters(h);
      T part(std::bit_cast<float>(-1));
      if constexpr (requires { h.part_bits; }) part = h.part_bits;
      accept(convert<R>(h.t), convert<R>(u), convert<R>(v), lanes && convert<M>(h.valid), number, part);
    } else {
      N o[3][lanes_v<T>], d[3][lanes_v<T>], range[2][lanes_v<T>];
      L out[3][lanes_v<T>] = {};
      float parts[lanes_v<T>];
      for (int a = 0; a < 3; ++a) {
        store_lanes(component(r.origin, a), o[a]);
        store_lanes(component(r.direction, a), d[a]);
      }
      store_lanes(low, range[0]);
      store_lanes(high, range[1]);
      for (float& p : parts) p = std::bit_cast<float>(-1);
      unsigned valid = 0;
      for (unsigned left = mask_bits(lanes); left != 0; left &= left - 1) {
        int const i = lowest_bit(left);
        auto const h = ask(ray<N>{{o[0][i], o[1][i], o[2][i]}, {d[0][i], d[1][i], d[2][i]}, range[0][i], range[1][i]});
        if (!h.valid) continue;
        valid |= 1u << i;
        out[0][i] = static_cast<L>(h.t);
        auto const [u, v] = parameters(h);
        out[1][i] = static_cast<L>(u);
        out[2][i] = static_cast<L>(v);
        if constexpr (requires { h.part; }) parts[i] = std::bit_cast<float>(static_cast<std::int32_t>(h.part));
      }
      if (valid == 0) return;
      R t, u, v;
      T part;
      load_lanes(out[0], t);
      load_lanes(out[1], u);
      load_lanes(out[2], v);
      load_lanes(parts, part);
      accept(t, u, v, convert<M>(valid), number, part);
    }
  }

  /// The parameters of a hit, 0 where its kind has none.
  template <class Hit> PATCHRT_INLINE static auto parameters(Hit const& h) {
    struct pair {
      std::remove_cvref_t<decltype(h.t)> u, v;
    };
    if constexpr (requires { h.u, h.v; }) return pair{h.u, h.v};
    else return pair{h.t - h.t, h.t - h.t};
  }

  /// Each shape of a block with the lanes' rays.
  template <class Shape, class Block> PATCHRT_INLINE void meet_each(Block const& block, M const& lanes) {
    using K = kernel_t<Shape>;
    auto const& r = static_cast<kind_ray_slot<Shape, K> const&>(rays_).ray_of_kind;
    K const low = beyond<K>(ray_.t_min, -1);
    for (int i = 0; i < Block::width && block.numbers[i] >= 0; ++i) {
      auto const shape = block.get(i);
      auto const met = shape_kind<Shape>::template meet<K>(r, shape, low, beyond<K>(hit_.t, 1));
      M const valid = lanes && convert<M>(met.valid);
      if (!any_of(valid)) continue;
      auto const h = shape_kind<Shape>::complete(r, shape, met);
      auto const [u, v] = parameters(h);
      accept(convert<R>(h.t), convert<R>(u), convert<R>(v), valid, T(std::bit_cast<float>(block.numbers[i])),
             T(std::bit_cast<float>(-1)));
    }
  }

  /// All shapes of a block with one ray.
  template <class Shape, class Block> PATCHRT_INLINE void meet_together(Block const& block) {
    using N = shape_number_t<Shape>;
    using K = rebind_lane_t<P, N>;
    auto const& r = static_cast<kind_ray_slot<Shape, N> const&>(rays_).ray_of_kind;
    K const low(beyond<N>(ray_.t_min, -1)), high(beyond<N>(hit_.t, 1));
    using kind = shape_kind<Shape>;
    auto const met = [&]() PATCHRT_INLINE_LAMBDA {
      if constexpr (requires { kind::template meet_block<K>(r, block, low, high); })
        return kind::template meet_block<K>(r, block, low, high);
      else return kind::template meet<K>(r, block.template get<K>(), low, high);
    }();
    unsigned valid = mask_bits(met.valid);
    if (valid == 0) return;
    auto const h = kind::complete(r, block.template get<K>(), met);
    auto const [pack_u, pack_v] = parameters(h);
    N t[lanes_v<P>], u[lanes_v<P>], v[lanes_v<P>];
    store_lanes(h.t, t);
    store_lanes(pack_u, u);
    store_lanes(pack_v, v);
    for (; valid != 0; valid &= valid - 1) {
      int const i = lowest_bit(valid);
      if (block.numbers[i] < 0) return;  // lanes without a shape come last
      accept(R(t[i]), R(u[i]), R(v[i]), true, std::bit_cast<float>(block.numbers[i]), std::bit_cast<float>(-1));
      if (AnyHit && hit_.valid) return;
    }
  }

  PATCHRT_INLINE void accept(R const& found, R const& u, R const& v, M const& lanes, T const& number, T const& part) {
    R const t = max(entry_, found);  // NaN stays
    auto const nearer = t < hit_.t;
    M better = lanes && convert<M>(ray_.t_min < t && nearer);
    if constexpr (AnyHit) {
      hit_.t = select(convert<mask_t<R>>(better), t, hit_.t);
      hit_.valid = hit_.valid || better;
      return;
    }
    M const equal = lanes && convert<M>(t == hit_.t);
    if (any_of(equal)) better = better || (equal && is_smaller(number));
    if (!any_of(better)) return;
    auto const wide = convert<mask_t<R>>(better);
    hit_.t = select(wide, t, hit_.t);
    hit_.u = select(wide, u, hit_.u);
    hit_.v = select(wide, v, hit_.v);
    hit_.shape_bits = select(better, number, hit_.shape_bits);
    hit_.part_bits = select(better, part, hit_.part_bits);
    hit_.valid = hit_.valid || better;
    follow();
  }

  /// Whether a shape's number is less than that of the hit; false for lanes without one, whose t is the end of their range.
  PATCHRT_INLINE M is_smaller(T const& number) const {
    float a[lanes_v<T>], b[lanes_v<T>];
    store_lanes(number, a);
    store_lanes(hit_.shape_bits, b);
    unsigned smaller = 0;
    for (int i = 0; i < lanes_v<T>; ++i)
      smaller |= unsigned(std::bit_cast<std::int32_t>(a[i]) < std::bit_cast<std::int32_t>(b[i])) << i;
    return convert<M>(smaller);
  }

  using last_shape = typename decltype((std::type_identity<Shapes>{}, ...))::type;
  struct kind_rays : kind_ray_slot<Shapes, kernel_t<Shapes>>... {
    /// Makes each where it stays: copies of what has just been written wait for it.
    PATCHRT_INLINE explicit kind_rays(ray<R> const& r)
        : kind_ray_slot<Shapes, kernel_t<Shapes>>{
              kind_ray<Shapes, kernel_t<Shapes>>::make(convert_ray<kernel_t<Shapes>>(r))}... {}

    template <scalar K> PATCHRT_INLINE static ray<K> convert_ray(ray<R> const& r) {
      return {convert_vec<K>(r.origin), convert_vec<K>(r.direction), convert<K>(r.t_min), convert<K>(r.t_max)};
    }
  };

  scene_view<Shapes...> const& scene_;
  ray<R> ray_;
  kind_rays rays_;
  watertight_slab_ray<T> slabs_;
  T t_min_, nearest_;
  R shift_, entry_;
  M active_;
  lane_scene_hit<R, T> hit_;
};

}  // namespace detail

/// Nearest hit of each ray in (t_min, t_max), without a stack; with `AnyHit` the t of some hit, found sooner.
///
/// T = float traces one ray, T = pack<float, N> N rays at once, with the same bits in every lane.
template <bool AnyHit, scalar T, scalar R, class... Shapes>
PATCHRT_INLINE lane_scene_hit<R, T> intersect(scene_view<Shapes...> const& scene, ray<R> const& r, mask_t<T> active) {
  detail::scene_search<AnyHit, T, R, void, Shapes...> search(scene, r, active);
  if (!any_of(search.active())) return search.hit();
  T entry;
  mask_t<T> lanes;
  traverse(
      scene.top, common_octant(search.slabs().inverse, search.active()),
      [&](box<float> const& b) PATCHRT_INLINE_LAMBDA {
        auto const span = intersect(search.slabs(), b, search.t_min(), search.nearest());
        entry = span.entry;
        lanes = search.active() && span.entry <= span.exit;
        return any_of(lanes);
      },
      [&](std::int32_t leaf)
          PATCHRT_INLINE_LAMBDA { return !any_of(search.meet_leaf(static_cast<std::uint32_t>(leaf), lanes, entry)); });
  return search.hit();
}

}  // namespace patchrt
