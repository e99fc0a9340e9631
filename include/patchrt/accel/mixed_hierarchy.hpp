// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// The mixed hierarchy: a BVH over patches, below each patch a tree of sub-patch boxes, and rays through both to hits.

#include <patchrt/accel/subpatch_tree.hpp>
#include <patchrt/accel/traverse.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/intersect/ray_patch.hpp>

#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

/// How exactly a hit is known, and at what price (docs/PERFORMANCE.md has the measured ones).
enum class accuracy {
  fast,       ///< float throughout
  refined,    ///< float search, then `correct` in double on the control points
  reference,  ///< the paper's: float traversal, Newton's iteration in double from the middle of each leaf sub-patch
};

/// One patch as the search sees it: moved to its own origin and scaled with the scene, in float.
struct search_patch {
  power_patch<float> power;
  subpatch_tree tree;
};

/// One patch as its hits are computed from: control points relative to `base`, in the user's units.
struct exact_patch {
  bicubic_patch<double> patch;
  vec3<double> base;         ///< in the user's space
  vec3<double> search_base;  ///< the same point in search space
  double size;               ///< the largest |coordinate| of `patch`
};

/// The mixed hierarchy as kernels see it, on host or device. `build_mixed_hierarchy` makes one.
///
/// Search space is (x - centre) * inverse_scale: the scene's box has its middle at 0 and reaches to 1 in no coordinate beyond.
struct mixed_hierarchy_view {
  bvh_view<float> top;
  search_patch const* search;
  exact_patch const* exact;
  subpatch_node const* nodes;
  subpatch_leaf const* leaves;
  vec3<double> centre;
  double inverse_scale;
};

/// Work done for a list of rays, in lanes: the figures of the paper's Table 1.
struct hierarchy_counts {
  std::uint64_t candidates = 0;    ///< (ray, sub-patch) pairs that Newton's iteration was started for
  std::uint64_t newton_steps = 0;  ///< evaluations of the two plane functions, the linear start's among them
  std::uint64_t patches = 0;       ///< (ray, patch) pairs whose sub-patch tree was entered
};

/// The nearest hits so far of one ray, or of one ray a lane.
template <scalar S, scalar T> struct lane_hit {
  S t, u, v, residual;
  T patch_bits;  ///< the patch's index, its bits in a float: moved by `select`, never computed with
  mask_t<S> valid;
};

namespace detail {

template <int Lanes> PATCHRT_INLINE unsigned lane_bits(bool m) { return m ? 1u : 0u; }
template <int Lanes, class M>
  requires(!std::is_same_v<M, bool>)
PATCHRT_INLINE unsigned lane_bits(M const& m) {
  return m.bits();
}

/// Rays on their way through a mixed hierarchy. T is float or a pack of floats: the search's number; the ray itself and its
/// hits are kept in S, which is T for `accuracy::fast` and T's lanes in double otherwise.
///
/// What makes hits independent of the order in which boxes and lanes are visited: a root of a sub-patch counts only where
/// it is not nearer than the computed entry into the sub-patch's box (and that of its patch), and a box is skipped only where
/// its entry is beyond the nearest root, all in the same arithmetic; so a skipped box never held the answer. Ties go
/// to the smaller patch number, then u, then v.
template <accuracy A, scalar T> class hierarchy_search {
 public:
  using S = std::conditional_t<A == accuracy::fast, T, rebind_lane_t<T, double>>;
  using TM = mask_t<T>;
  using SM = mask_t<S>;
  using L = lane_t<S>;

  PATCHRT_INLINE hierarchy_search(mixed_hierarchy_view const& hierarchy, ray<S> const& r, TM active)
      : h_(hierarchy), origin_(r.origin), direction_(r.direction), t_min_(r.t_min) {
    S const scale(static_cast<L>(h_.inverse_scale));
    vec3<S> const centre = convert_vec<S>(vec3<L>(h_.centre));
    vec3<S> const o = (r.origin - centre) * scale;
    S const length = sqrt(dot(r.direction, r.direction));
    to_search_ = length * scale;
    search_direction_ = r.direction * (S(1) / length);
    // Rays from afar start where they enter the ball of radius 2 around the scene, before anything is rounded to float.
    shift_ = max(-dot(o, search_direction_) - S(L(2)), S(0));
    search_origin_ = fma(shift_, search_direction_, o);
    vec3<T> const d = convert_vec<T>(search_direction_);
    slabs_ = make_slab_ray(convert_vec<T>(search_origin_), d);
    plane_normals(d, n1_, n2_);
    abs_n1_ = {abs(n1_.x), abs(n1_.y), abs(n1_.z)};
    abs_n2_ = {abs(n2_.x), abs(n2_.y), abs(n2_.z)};
    d_ = d;
    hit_.t = r.t_max;
    hit_.u = hit_.v = hit_.residual = S(0);
    hit_.patch_bits = T(0);
    hit_.valid = r.t_min < r.t_min;
    nearest_ = fma(r.t_max, to_search_, -shift_);
    search_t_min_ = convert<T>(fma(r.t_min, to_search_, -shift_)) - T(margin);
    // A NaN or a zero direction makes `length` or an origin NaN or 0: such a lane never takes part.
    S const finite = o.x + o.y + o.z;
    active_ = active && convert<TM>(S(0) < length && length < S(std::numeric_limits<L>::infinity()) &&
                                    finite - finite <= S(0) && r.t_min < r.t_max);
    // The order in which boxes are visited is the first active lane's; results do not depend on it.
    octant_ = 0;
  }

  /// The nearest hits, or any where `AnyHit`.
  template <bool AnyHit> PATCHRT_INLINE lane_hit<S, T> run(hierarchy_counts* counts) {
    choose_octant();
    counts_ = counts;
    T nearest = convert<T>(nearest_);
    T entry;
    TM lanes;
    traverse(
        h_.top, octant_,
        [&](box<float> const& b) {
          auto const span = intersect(slabs_, b, search_t_min_, nearest);
          entry = span.entry;
          lanes = active_ && entry <= span.exit;
          return any_of(lanes);
        },
        [&](std::int32_t patch) {
          search_in_patch(patch, lanes, entry);
          nearest = convert<T>(nearest_);
          if constexpr (AnyHit) {
            active_ = active_ && !convert<TM>(hit_.valid);
            return !any_of(active_);
          } else {
            return false;
          }
        });
    return hit_;
  }

 private:
  /// Boxes of the top level are padded by 2^-19 of search space when they are built; t_min is widened alike.
  static constexpr float margin = 0x1p-19f;

  PATCHRT_INLINE void choose_octant() {
    constexpr int lanes = lanes_v<T>;
    unsigned const x = lane_bits<lanes>(d_.x < T(0)), y = lane_bits<lanes>(d_.y < T(0)), z = lane_bits<lanes>(d_.z < T(0));
    unsigned const on = lane_bits<lanes>(active_);
    auto const most = [on](unsigned m) { return 2 * std::popcount(m & on) > std::popcount(on) ? 1u : 0u; };
    octant_ = most(x) | most(y) << 1 | most(z) << 2;
  }

  PATCHRT_INLINE void search_in_patch(std::int32_t patch, TM lanes, T entry) {
    search_patch const& s = h_.search[patch];
    exact_patch const& e = h_.exact[patch];
    S const start = convert<S>(entry);
    vec3<S> const base = convert_vec<S>(vec3<L>(e.search_base));
    vec3<T> const o = convert_vec<T>(fma(start, search_direction_, search_origin_ - base));
    projected_patch<T> const projected = project(s.power, o, n1_, n2_);
    T nearest = convert<T>(nearest_ - start);
    T const soonest = search_t_min_ - entry;
    if (counts_) counts_->patches += unsigned(std::popcount(lane_bits<lanes_v<T>>(lanes)));

    // Boxes in the grid's own coordinates: bytes become numbers and nothing else.
    vec3<float> const& step = s.tree.grid_step;
    vec3<float> const& corner = s.tree.grid_origin;
    slab_ray<T> grid;
    grid.origin = {(o.x - T(corner.x)) * T(1 / step.x), (o.y - T(corner.y)) * T(1 / step.y),
                   (o.z - T(corner.z)) * T(1 / step.z)};
    grid.inverse = {slabs_.inverse.x * T(step.x), slabs_.inverse.y * T(step.y), slabs_.inverse.z * T(step.z)};

    // Cells that may have a root wait here, one a lane, so that Newton's iteration runs with as many lanes as it can.
    struct {
      T x, y, cell_x, cell_y, half_x, half_y, entry;
      TM lanes;
    } waiting;
    waiting.x = waiting.y = waiting.cell_x = waiting.cell_y = waiting.half_x = waiting.half_y = waiting.entry = T(0);
    waiting.lanes = lanes && !lanes;
    patch_cell<float> cell = subpatch_cell(s.tree, 1u << s.tree.depth);
    T const half_x(cell.half_x), half_y(cell.half_y);
    auto const solve_waiting = [&] {
      solve(patch, projected, o, start, entry, waiting);
      nearest = convert<T>(nearest_ - start);
      waiting.lanes = lanes && !lanes;
    };

    T cell_entry(soonest);
    TM cell_lanes = lanes;
    auto const add = [&](TM m, T x, T y, T cx, T cy, T hx, T hy) {
      if (!any_of(m)) return;
      if (any_of(m && waiting.lanes)) solve_waiting();
      waiting.x = select(m, x, waiting.x);
      waiting.y = select(m, y, waiting.y);
      waiting.cell_x = select(m, cx, waiting.cell_x);
      waiting.cell_y = select(m, cy, waiting.cell_y);
      waiting.half_x = select(m, hx, waiting.half_x);
      waiting.half_y = select(m, hy, waiting.half_y);
      waiting.entry = select(m, cell_entry, waiting.entry);
      waiting.lanes = waiting.lanes || m;
    };
    constexpr int most_levels = 10;
    auto const subdivide = [&](TM folded, patch_cell<T> const& c) {
      TM inside[most_levels + 1];
      inside[0] = folded;
      std::uint32_t k = 2, trail = 0;
      int level = 1;
      for (;;) {
        T hx = c.half_x, hy = c.half_y, x = c.x, y = c.y;
        for (int l = 0; l < level; ++l) {
          T const side((k >> (level - 1 - l)) & 1u ? 1.0f : -1.0f);
          if (l & 1) { hy = hy * T(0.5f); y = fma(side, hy, y); } else { hx = hx * T(0.5f); x = fma(side, hx, x); }
        }
        cell_verdict<T> const v = examine_cell(projected, x, y, hx, hy);
        if (counts_) counts_->newton_steps += unsigned(std::popcount(lane_bits<lanes_v<T>>(inside[level-1])));
        TM const possible = inside[level - 1] && v.possible;
        TM const more = level == most_levels ? (possible && !possible) : possible && !v.at_most_one;
        add(possible && !more, v.x, v.y, x, y, hx, hy);
        if (any_of(more)) {
          inside[level] = more;
          ++level;
          k = 2 * k;
          trail <<= 1;
          continue;
        }
        int const up = std::countr_one(trail);
        k = (k >> up) ^ 1u;
        level -= up;
        if (k <= 1) return;
        trail = (trail >> up) | 1u;
      }
    };
    traverse(
        s.tree, h_.nodes, octant_,
        [&](subpatch_node const& n) {
          box<float> const b{{float(n.lo[0]), float(n.lo[1]), float(n.lo[2])},
                             {float(n.hi[0]), float(n.hi[1]), float(n.hi[2])}};
          auto const span = intersect(grid, b, soonest, nearest);
          cell_entry = span.entry;
          cell_lanes = lanes && cell_entry <= span.exit;
          return any_of(cell_lanes);
        },
        [&](std::uint32_t k, std::uint32_t index) {
          cell = subpatch_cell(s.tree, k);
          subpatch_leaf const& leaf = h_.leaves[s.tree.first_leaf + index];
          patch_cell<T> c;
          c.x = T(cell.x);
          c.y = T(cell.y);
          c.half_x = half_x;
          c.half_y = half_y;
          c.remainder = {T(float(leaf.remainder[0]) * s.tree.remainder_step.x),
                         T(float(leaf.remainder[1]) * s.tree.remainder_step.y),
                         T(float(leaf.remainder[2]) * s.tree.remainder_step.z)};
          cell_start<T> const begin = linear_start(projected, abs_n1_, abs_n2_, c);
          TM const possible = cell_lanes && begin.possible;
          if (counts_) counts_->newton_steps += unsigned(std::popcount(lane_bits<lanes_v<T>>(cell_lanes)));
          if (!any_of(possible)) return;
          T const across = abs(dot(d_, vec3<T>(T(float(leaf.axis[0]) / 127), T(float(leaf.axis[1]) / 127),
                                               T(float(leaf.axis[2]) / 127))));
          TM const single = T(float(leaf.sine) / 255) < across;
          add(possible && single, begin.x, begin.y, c.x, c.y, half_x, half_y);
          TM folded = possible && !single;
          if (any_of(folded)) {
            subdivide(folded, c);
          }
        });
    if (any_of(waiting.lanes)) solve_waiting();
  }

  template <class Waiting>
  PATCHRT_INLINE void solve(std::int32_t patch, projected_patch<T> const& projected, vec3<T> const& o, S const& start,
                            T const& patch_entry, Waiting const& w) {
    exact_patch const& e = h_.exact[patch];
    patch_root<S> root;
    SM found;
    constexpr float tolerance = A == accuracy::fast ? 0x1p-12f : 0x1p-7f;
    newton_result<T> const n = newton(projected, w.x, w.y, w.lanes, tolerance, 0.5f, 8);
    if (counts_) {
      counts_->candidates += unsigned(std::popcount(lane_bits<lanes_v<T>>(w.lanes)));
      counts_->newton_steps += unsigned(n.steps) * unsigned(std::popcount(lane_bits<lanes_v<T>>(w.lanes)));
    }
    T const spare(0x1p-10f);
    TM const inside = n.converged && abs(n.x - w.cell_x) <= w.half_x + spare && abs(n.y - w.cell_y) <= w.half_y + spare;
    if (!any_of(inside)) return;
    S along;  // the root's distance in search space
    if constexpr (A == accuracy::fast) {
      vec3<T> const p = position(h_.search[patch].power, n.x, n.y) - o;
      along = start + dot(p, d_);
      root.t = (along + shift_) / to_search_;
      root.u = min(max(fma(n.x, T(0.5f), T(0.5f)), T(0)), T(1));
      root.v = min(max(fma(n.y, T(0.5f), T(0.5f)), T(0)), T(1));
      root.residual = T(0);
      T const edge(1 + 0x1p-20f);
      found = inside && abs(n.x) <= edge && abs(n.y) <= edge;
    } else {
      vec3<S> const base = convert_vec<S>(e.base);
      S const u = fma(convert<S>(n.x), S(0.5), S(0.5));
      S const v = fma(convert<S>(n.y), S(0.5), S(0.5));
      root = correct<S>(e.patch, e.size, origin_ - base, direction_, u, v);
      along = fma(root.t, to_search_, -shift_);
      found = convert<SM>(inside) && root.valid;
    }
    // Not nearer than the boxes it was found in, so that skipping those could not have lost it.
    T const from_entry = convert<T>(along - start);
    found = found && convert<SM>(w.entry <= from_entry && patch_entry <= convert<T>(along)) && t_min_ < root.t;
    keep(patch, root, along, found);
  }

  PATCHRT_INLINE void keep(std::int32_t patch, patch_root<S> const& root, S const& along, SM found) {
    SM nearer = found && root.t < hit_.t;
    SM const same = found && root.t == hit_.t && hit_.valid;
    if (any_of(same)) nearer = nearer || (same && first_of_tie(patch, root));
    if (!any_of(nearer)) return;
    hit_.t = select(nearer, root.t, hit_.t);
    hit_.u = select(nearer, root.u, hit_.u);
    hit_.v = select(nearer, root.v, hit_.v);
    hit_.residual = select(nearer, root.residual, hit_.residual);
    hit_.patch_bits = select(convert<TM>(nearer), T(std::bit_cast<float>(patch)), hit_.patch_bits);
    hit_.valid = hit_.valid || nearer;
    nearest_ = select(nearer, along, nearest_);
  }

  PATCHRT_INLINE SM first_of_tie(std::int32_t patch, patch_root<S> const& root) const {
    if constexpr (lanes_v<T> == 1) {
      std::int32_t const other = std::bit_cast<std::int32_t>(hit_.patch_bits);
      if (patch != other) return patch < other;
      return root.u != hit_.u ? root.u < hit_.u : root.v < hit_.v;
    } else {
      constexpr int N = lanes_v<T>;
      float bits[N];
      L u[N], v[N], hu[N], hv[N];
      hit_.patch_bits.store(bits);
      hit_.u.store(hu);
      hit_.v.store(hv);
      root.u.store(u);
      root.v.store(v);
      std::uint32_t first = 0;
      for (int i = 0; i < N; ++i) {
        std::int32_t const other = std::bit_cast<std::int32_t>(bits[i]);
        bool const wins = patch != other ? patch < other : u[i] != hu[i] ? u[i] < hu[i] : v[i] < hv[i];
        first |= std::uint32_t(wins) << i;
      }
      return SM::from_bits(first);
    }
  }

  mixed_hierarchy_view const& h_;
  vec3<S> origin_, direction_;  // the user's ray
  S t_min_;
  vec3<S> search_origin_, search_direction_;  // the ray in search space, its origin moved by shift_
  S to_search_, shift_;                       // search-space t = to_search t - shift
  slab_ray<T> slabs_;
  vec3<T> d_, n1_, n2_, abs_n1_, abs_n2_;
  T search_t_min_;
  TM active_;
  unsigned octant_;
  lane_hit<S, T> hit_;
  S nearest_;  // hit_.t in search space
  hierarchy_counts* counts_ = nullptr;
};

}  // namespace detail

/// The number type of rays and hits that go with search lanes T at accuracy A.
template <accuracy A, scalar T> using hit_scalar_t = typename detail::hierarchy_search<A, T>::S;

/// Nearest hit of each ray in (t_min, t_max); with `AnyHit` some hit, found sooner: for shadow rays.
///
/// T = float traces one ray, T = pack<float, N> N rays at once, with the same bits in every lane. `counts`, where not null, is
/// added to.
template <accuracy A, bool AnyHit, scalar T>
PATCHRT_INLINE lane_hit<hit_scalar_t<A, T>, T> intersect(mixed_hierarchy_view const& hierarchy,
                                                         ray<hit_scalar_t<A, T>> const& r, mask_t<T> active,
                                                         hierarchy_counts* counts = nullptr) {
  return detail::hierarchy_search<A, T>(hierarchy, r, active).template run<AnyHit>(counts);
}

}  // namespace patchrt
