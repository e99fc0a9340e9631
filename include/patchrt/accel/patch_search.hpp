// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays in one patch of a mixed hierarchy: its sub-patch boxes, the cells that may have a root, and the roots.

#include <patchrt/accel/certify_cell.hpp>
#include <patchrt/accel/mixed_hierarchy.hpp>
#include <patchrt/accel/part_list.hpp>
#include <patchrt/accel/separate_roots.hpp>
#include <patchrt/intersect/correct_root.hpp>
#include <patchrt/intersect/ray_box.hpp>
#include <patchrt/intersect/reference_root.hpp>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace patchrt {

/// How exactly a hit is known, and at what price (docs/PERFORMANCE.md has the measured ones).
enum class accuracy {
  fast,       ///< float throughout: rays and scenes within float's range
  refined,    ///< float search, in double where float does not decide, then a correction in double
  certified,  ///< refined, and proved: each root exists, no other was missed; what cannot be proved is said to be so
  reference,  ///< the paper's: float traversal, Newton's iteration in double from the middle of each leaf sub-patch
};

/// The number type of rays and hits that go with search lanes T at accuracy A.
template <accuracy A, scalar T>
using search_scalar_t = std::conditional_t<A == accuracy::fast, T, rebind_lane_t<T, double>>;

/// Work done for a list of rays, in lanes: the figures of the paper's Table 1.
struct hierarchy_counts {
  std::uint64_t patches = 0;     ///< (ray, patch) pairs whose sub-patch tree was entered
  std::uint64_t candidates = 0;  ///< (ray, sub-patch) pairs that Newton's iteration was started for
  std::uint64_t newton_steps =
      0;  ///< evaluations of the two plane functions for one ray, also those that exclude cells
};

/// What is proved of a ray's answer.
enum class certainty : std::uint8_t {
  /// The hit is a root, or a point on an edge that the ray passes within rounding and gap, and no root is nearer; or
  /// there is none.
  certified,
  /// But for a place, at the hit or before it, where the ray touches a patch within rounding: two roots, one or none.
  tangent,
  /// But for a place where ray and patch cannot be told apart, or where the proof was given up.
  degenerate
};

/// The nearest hits so far of one ray, or of one ray a lane.
template <scalar S, scalar T> struct lane_hit {
  S t, u, v, error;
  T patch_bits;  ///< the patch's index, its bits in a float: moved by `select`, never computed with
  mask_t<S> valid;
  mask_t<T> tangent, degenerate;  ///< `certified` alone: see `certainty`
};

namespace detail {

/// Of all roots, only the nearest are kept.
struct nearest_only {};

/// A ray, or one a lane, on its way through a mixed hierarchy: see `hierarchy_search`. A `Sink` other than
/// `nearest_only` is called with every root instead, `sink(patch, root)`, and none of them ends the search beyond it.
template <accuracy A, class Surface, scalar T, class Sink = nearest_only> struct search_state {
  using S = search_scalar_t<A, T>;

  basic_mixed_hierarchy_view<Surface> const& hierarchy;
  vec3<S> origin;  // as it was given
  S t_min;
  vec3<S> search_origin, search_direction;  // in search space, the origin moved by shift
  S to_search, shift;                       // search-space t = to_search t - shift
  S per_scaled;                             // search_direction over the direction as given: a power of two
  slab_ray<T> slabs;
  vec3<T> direction, n1, n2, abs_n1, abs_n2;  // search_direction and the normals of its planes
  T squared_length, per_squared_length;       // of direction, and one over it
  S per_square;                               // one over the squared length of search_direction, within two epsilon
  T search_t_min;
  mask_t<T> active;
  lane_hit<S, T> hit;
  S nearest;                   // hit.t in search space
  S touches_from, doubt_from;  // `certified` alone: as near in search space are places that are tangent, and degenerate
  hierarchy_counts* counts = nullptr;
  [[no_unique_address]] Sink sink;

  PATCHRT_INLINE explicit search_state(basic_mixed_hierarchy_view<Surface> const& h, Sink const& s = {})
      : hierarchy(h), sink(s) {}

  PATCHRT_INLINE static unsigned lanes_on(mask_t<T> m) { return static_cast<unsigned>(std::popcount(mask_bits(m))); }
};

/// The rays of `state` in one patch.
template <accuracy A, class Surface, scalar T, class Sink = nearest_only> class patch_search {
  using form = surface_form<Surface>;

 public:
  using S = search_scalar_t<A, T>;
  using TM = mask_t<T>;
  using SM = mask_t<S>;
  using L = lane_t<S>;

  /// Whether parts that float cannot decide are searched in the precision of the hits.
  static constexpr bool is_thorough = A == accuracy::refined || A == accuracy::certified;

  /// `lanes` enter the patch's box at `entry`.
  PATCHRT_INLINE patch_search(search_state<A, Surface, T, Sink>& state, std::int32_t patch, TM lanes, T entry,
                              unsigned octant)
      : state_(state),
        patch_(patch),
        search_(state.hierarchy.search[patch]),
        exact_(state.hierarchy.exact[patch]),
        octant_(octant),
        lanes_(lanes),
        entry_(entry),
        start_(convert<S>(entry)) {}

  PATCHRT_OUTLINE void run() {
    // From here on rays start at their entry: what is rounded to float is of the patch's size, wherever the patch is.
    vec3<S> const base = convert_vec<S>(vec3<L>(exact_.search_base));
    origin_ = convert_vec<T>(fma(start_, state_.search_direction, difference(state_.search_origin, base)));
    nearest_ = convert<T>(state_.nearest - start_);
    T const soonest = soonest_ = state_.search_t_min - entry_;
    waiting_.lanes = waiting_.single = waiting_.mirrored = lanes_ && !lanes_;
    if (state_.counts) state_.counts->patches += state_.lanes_on(lanes_);

    // Boxes are met in the grid's own coordinates: bytes become numbers and nothing else.
    subpatch_tree const& tree = search_.tree;
    vec3<float> const &step = tree.grid_step, &corner = tree.grid_origin;
    slab_ray<T> grid;
    grid.origin = {(origin_.x - T(corner.x)) * T(1 / step.x), (origin_.y - T(corner.y)) * T(1 / step.y),
                   (origin_.z - T(corner.z)) * T(1 / step.z)};
    grid.inverse = {state_.slabs.inverse.x * T(step.x), state_.slabs.inverse.y * T(step.y),
                    state_.slabs.inverse.z * T(step.z)};
    cell_entry_ = soonest;
    cell_lanes_ = lanes_;
    bool is_projected = false;
    traverse(
        tree, state_.hierarchy.nodes, octant_,
        [&](subpatch_node const& n) PATCHRT_INLINE_LAMBDA {
          box<float> const b{{float(n.lo[0]), float(n.lo[1]), float(n.lo[2])},
                             {float(n.hi[0]), float(n.hi[1]), float(n.hi[2])}};
          auto const span = intersect(grid, b, soonest, nearest_);
          cell_entry_ = span.entry;
          cell_lanes_ = lanes_ && cell_entry_ <= span.exit;
          return any_of(cell_lanes_);
        },
        [&](std::uint32_t k, std::uint32_t index) PATCHRT_INLINE_LAMBDA {
          if (!is_projected) make_projected();
          is_projected = true;
          visit_leaf(k, state_.hierarchy.leaves[tree.first_leaf + index]);
        });
    if (any_of(waiting_.lanes)) solve_waiting();
  }

 private:
  /// What rounding in float is in proportion to: where the ray is in float from the start, its origin's is of the
  /// scene's size.
  PATCHRT_INLINE vec3<float> reach() const {
    constexpr float ray = A == accuracy::fast ? 0.125f : 0.0f;
    return sum(search_.reach, vec3<float>(ray, ray, ray));
  }

  PATCHRT_INLINE void make_projected() {
    projected_ = project(search_.power, reach(), origin_, state_.n1, state_.n2);
    projected_.gap_f = T(search_.gap) * sum_of_magnitudes(state_.n1);
    projected_.gap_g = T(search_.gap) * sum_of_magnitudes(state_.n2);
    if constexpr (A == accuracy::certified) {  // room for what rounding does to derivatives
      projected_.rounding_f = T(2) * projected_.rounding_f;
      projected_.rounding_g = T(2) * projected_.rounding_g;
    }
  }

  /// Cells that may have a root, one a lane.
  struct cell_batch {
    T x, y;  // where the iteration begins
    T cell_x, cell_y, half_x, half_y;
    T entry;
    TM single;    // the cell is proved to have one root at most
    TM mirrored;  // the Jacobian's determinant is negative there
    TM lanes;
  };

  PATCHRT_OUTLINE void visit_leaf(std::uint32_t k, subpatch_leaf const& leaf) {
    vec3<float> const& step = search_.tree.remainder_step;
    patch_cell<float> const cell = subpatch_cell(search_.tree, k);
    patch_cell<T> const c{T(cell.x),
                          T(cell.y),
                          T(cell.half_x),
                          T(cell.half_y),
                          {T(float(leaf.remainder[0]) * step.x), T(float(leaf.remainder[1]) * step.y),
                           T(float(leaf.remainder[2]) * step.z)}};
    if (state_.counts) state_.counts->newton_steps += state_.lanes_on(cell_lanes_);
    if constexpr (A == accuracy::reference) {
      add(cell_lanes_, cell_lanes_, cell_lanes_, c.x, c.y, {c.x, c.y, c.half_x, c.half_y, cell_lanes_});
    } else {
      cell_start<T> const begin = linear_start(projected_, state_.abs_n1, state_.abs_n2, c);
      TM const possible = cell_lanes_ && begin.possible;
      if (!any_of(possible)) return;
      TM single, folded;
      if constexpr (has_normal_cones<Surface>) {
        vec3<T> const axis{T(float(leaf.axis[0])), T(float(leaf.axis[1])), T(float(leaf.axis[2]))};
        float const sine = leaf.sine == 255 ? 2.0f : float(leaf.sine) / 255.0f;
        T const along = dot(state_.direction, axis);
        single = possible && T(127.0f * 127.0f * sine * sine) * state_.squared_length < along * along;
        folded = possible && !single;
      } else {
        cell_verdict<T> const v = examine_cell(projected_, c.x, c.y, c.half_x, c.half_y);
        single = possible && v.possible && v.at_most_one;
        folded = possible && v.possible && !v.at_most_one;
      }
      if (any_of(single)) add(single, single, begin.mirrored, begin.x, begin.y, {c.x, c.y, c.half_x, c.half_y, single});
      if (any_of(folded)) add_parts(folded, c);
    }
  }

  PATCHRT_OUTLINE void add_parts(TM folded, patch_cell<T> const& c) {
    undecided_parts undecided(folded);
    subdivide<false>({c.x, c.y, c.half_x, c.half_y, folded},
                     [&](TM lanes, TM single, TM mirrored, T x, T y, patch_part<T> const& p) {
                       TM const on = is_thorough ? lanes && single : lanes;
                       if constexpr (is_thorough) undecided.add(lanes && !single, p);
                       if (any_of(on)) add(on, single, mirrored, x, y, p);
                     });
    find_roots(undecided.all(), cell_entry_);
  }

  /// The smallest rectangle around parts that float did not decide: a contact may be common to several of them.
  struct undecided_parts {
    TM lanes;
    T low_x, high_x, low_y, high_y;

    PATCHRT_INLINE explicit undecided_parts(TM any) : lanes(any && !any), low_x(2), high_x(-2), low_y(2), high_y(-2) {}
    PATCHRT_INLINE void add(TM on, patch_part<T> const& p) {
      lanes = lanes || on;
      low_x = select(on, min(low_x, p.x - p.half_x), low_x);
      high_x = select(on, max(high_x, p.x + p.half_x), high_x);
      low_y = select(on, min(low_y, p.y - p.half_y), low_y);
      high_y = select(on, max(high_y, p.y + p.half_y), high_y);
    }
    PATCHRT_INLINE patch_part<T> all() const {
      T const half(0.5f);
      return {half * (low_x + high_x), half * (low_y + high_y), half * (high_x - low_x), half * (high_y - low_y),
              lanes};
    }
  };

  /// Puts cells off until Newton's iteration can run with as many lanes as possible.
  PATCHRT_INLINE void add(TM lanes, TM single, TM mirrored, T x, T y, patch_part<T> const& cell) {
    if (any_of(lanes && waiting_.lanes)) solve_waiting();
    auto& w = waiting_;
    w.x = select(lanes, x, w.x);
    w.y = select(lanes, y, w.y);
    w.cell_x = select(lanes, cell.x, w.cell_x);
    w.cell_y = select(lanes, cell.y, w.cell_y);
    w.half_x = select(lanes, cell.half_x, w.half_x);
    w.half_y = select(lanes, cell.half_y, w.half_y);
    w.entry = select(lanes, cell_entry_, w.entry);
    w.single = (w.single && !lanes) || (single && lanes);
    w.mirrored = (w.mirrored && !lanes) || (mirrored && lanes);
    w.lanes = w.lanes || lanes;
  }

  /// Quarters cells, another in each lane, until their parts are seen to have no root, or one, and gives these to
  /// `sink(lanes, proved, mirrored, x, y, part)`: (x, y) is where Newton's iteration begins. Parts of the sixth level
  /// are given as they are, and so is what is left of a level where a lane has more than `most_parts`: a patch that is
  /// a line or a point has no part that says anything. `Thorough` goes on until Newton's iteration cannot fail: that is
  /// what is `proved` then.
  ///
  /// Goes level by level, as many parts at a time as T has lanes, whosever they are: few rays meet a fold, but each has
  /// several parts.
  template <bool Thorough, class F> PATCHRT_INLINE void subdivide(patch_part<T> const& cells, F&& sink) {
    constexpr int N = lanes_v<T>;
    using list = part_list<N>;
    list lists[2];
    list* level = &lists[0];
    level->clear();
    int half = 32;  // of a part of this level, in the list's units
    for (unsigned rest = mask_bits(cells.lanes); rest != 0; rest &= rest - 1)
      level->add_quarters(lowest_bit(rest), 0, 0, half);
    for (; level->size != 0; half /= 2) {
      list* const next = level == &lists[0] ? &lists[1] : &lists[0];
      level->pad();
      next->clear();
      for (int first = 0; first < level->size; first += N) {
        int const count = std::min(level->size - first, N);
        std::int32_t lane[N];
        for (int i = 0; i < N; ++i) lane[i] = level->lane[first + i];
        T const cell_half_x = permute(cells.half_x, lane), cell_half_y = permute(cells.half_y, lane);
        T const size(float(half) * list::unit);
        patch_part<T> const part{fma(list::template load<T>(level->x + first), cell_half_x, permute(cells.x, lane)),
                                 fma(list::template load<T>(level->y + first), cell_half_y, permute(cells.y, lane)),
                                 cell_half_x * size, cell_half_y * size, convert<TM>((2u << (count - 1)) - 1u)};
        cell_verdict<T> v;
        if constexpr (N == 1) v = examine_cell(projected_, part.x, part.y, part.half_x, part.half_y);
        else v = examine_cell(permute(projected_, lane), part.x, part.y, part.half_x, part.half_y);
        if (state_.counts) state_.counts->newton_steps += unsigned(count);
        unsigned const possible = mask_bits(part.lanes && v.possible);
        unsigned whole = possible & mask_bits(Thorough ? v.convergent : v.at_most_one);
        for (unsigned rest = possible & ~whole; rest != 0; rest &= rest - 1) {
          int const i = lowest_bit(rest);
          if (half == 1 || level->of_lane[lane[i]] > list::most_parts) whole |= 1u << i;
          else next->add_quarters(lane[i], level->x[first + i], level->y[first + i], half / 2);
        }
        if (whole != 0) give_whole(whole, mask_bits(Thorough ? v.convergent : v.at_most_one), lane, v, part, sink);
      }
      level = next;
    }
  }

  /// Gives the parts in `whole` to `sink` in the lanes that they are of, one a lane at a time.
  template <class F>
  PATCHRT_INLINE void give_whole(unsigned whole, unsigned proved, std::int32_t const* lane, cell_verdict<T> const& v,
                                 patch_part<T> const& part, F&& sink) {
    unsigned const mirrored = mask_bits(v.mirrored);
    while (whole != 0) {
      unsigned lanes = 0, proofs = 0, mirrors = 0;
      std::int32_t from[lanes_v<T>] = {};
      for (unsigned rest = whole; rest != 0; rest &= rest - 1) {
        int const i = lowest_bit(rest);
        unsigned const bit = 1u << lane[i];
        if ((lanes & bit) != 0) continue;
        lanes |= bit;
        if ((proved >> i & 1u) != 0) proofs |= bit;
        if ((mirrored >> i & 1u) != 0) mirrors |= bit;
        from[lane[i]] = i;
        whole &= ~(1u << i);
      }
      TM const on = convert<TM>(lanes);
      sink(on, convert<TM>(proofs), convert<TM>(mirrors), permute(v.x, from), permute(v.y, from),
           patch_part<T>{permute(part.x, from), permute(part.y, from), permute(part.half_x, from),
                         permute(part.half_y, from), on});
    }
  }

  PATCHRT_OUTLINE void solve_waiting() {
    TM const astray = solve(waiting_).astray;
    if (any_of(astray)) search_again(astray);
    nearest_ = convert<T>(state_.nearest - start_);
    waiting_.lanes = lanes_ && !lanes_;
  }

  /// Having one root at most does not make Newton's iteration find it: where it went astray, the cell's parts are
  /// searched.
  PATCHRT_OUTLINE void search_again(TM astray) {
    auto const& w = waiting_;
    undecided_parts undecided(astray);
    subdivide<true>({w.cell_x, w.cell_y, w.half_x, w.half_y, astray},
                    [&](TM lanes, TM proved, TM mirrored, T x, T y, patch_part<T> const& p) {
                      cell_batch part{x, y, p.x, p.y, p.half_x, p.half_y, w.entry, proved, mirrored, lanes};
                      if constexpr (is_thorough) {
                        part.lanes = lanes && proved;
                        TM unfinished = lanes && !proved;
                        if (any_of(part.lanes)) unfinished = unfinished || solve(part).unfinished;
                        undecided.add(unfinished, p);
                      } else {
                        (void)solve(part);
                      }
                    });
    find_roots(undecided.all(), w.entry);
  }

  /// Lanes whose roots `solve` has not settled.
  struct solve_outcome {
    TM astray;      ///< the cell has one root at most, but the iteration ended elsewhere, or nowhere
    TM unfinished;  ///< it ended nowhere
  };

  /// Hits from the roots of a batch of cells. For `certified` an iteration has gone astray where it ended outside its
  /// cell, else where it did not even end next to it, on the same side of folds.
  PATCHRT_OUTLINE solve_outcome solve(cell_batch const& w) {
    if (state_.counts) state_.counts->candidates += state_.lanes_on(w.lanes);
    if constexpr (A == accuracy::reference) {
      solve_as_reference(w);
      TM const none = w.lanes && !w.lanes;
      return {none, none};
    } else {
      newton_result<T> const n = newton(projected_, w.x, w.y, T(2) * w.half_x, T(2) * w.half_y, w.lanes, 0x1p-10f, 10);
      if (state_.counts) state_.counts->newton_steps += unsigned(n.steps) * state_.lanes_on(w.lanes);
      T const dx = abs(n.x - w.cell_x) - n.error_x, dy = abs(n.y - w.cell_y) - n.error_y;
      T const spare(0x1p-10f);
      TM inside = n.converged && dx <= w.half_x + spare && dy <= w.half_y + spare;
      TM vague = w.lanes && !w.lanes, nearby = n.converged && dx <= T(2) * w.half_x && dy <= T(2) * w.half_y;
      if constexpr (A == accuracy::refined) {
        // Where rounding alone moves the root across the cell, float has not found it.
        vague = inside && !(n.error_x < w.half_x && n.error_y < w.half_y);
        nearby = vague || (nearby && !((n.mirrored && !w.mirrored) || (w.mirrored && !n.mirrored)));
        find_roots({w.cell_x, w.cell_y, w.half_x, w.half_y, vague}, w.entry);
      } else if constexpr (A == accuracy::certified) {
        nearby = inside;
      }
      inside = inside && !vague;
      if (any_of(inside)) finish(w, n, inside);
      return {w.lanes && w.single && !nearby, w.lanes && !n.converged};
    }
  }

  /// The hits of the lanes in `inside` from their roots in float.
  PATCHRT_INLINE void finish(cell_batch const& w, newton_result<T> const& n, TM inside) {
    T const x = n.x, y = n.y;
    surface_point<T> const p = evaluate(search_.power, x, y);
    vec3<T> const chord = difference(origin_, p.position);
    T const per_square = state_.per_squared_length;
    if constexpr (A == accuracy::fast) {
      chord_rows<T> const rows = make_chord_rows(p, state_.direction);
      auto const left = split_along(chord, state_.direction, per_square);
      patch_root<S> root;
      root.t = (start_ - left.along + state_.shift) / state_.to_search;
      root.u = min(max(fma(x, T(0.5f), T(0.5f)), T(0)), T(1));
      root.v = min(max(fma(y, T(0.5f), T(0.5f)), T(0)), T(1));
      float const rounding = 16 * std::numeric_limits<float>::epsilon() * sum_of_magnitudes(reach());
      T const off = sum_of_magnitudes(left.beside);
      T const far =
          sum_of_magnitudes(state_.search_origin) + T(4) * state_.shift;  // what the ray itself was rounded by
      root.error = fma(far, T(0x1p-21f), off + T(rounding)) * rows.per_cosine /
                   T(static_cast<float>(state_.hierarchy.inverse_scale));
      // Beyond an edge as far as leads no further from the ray than rounding, and S(x, y) is.
      auto const is_within = [&](T const& at, vec3<T> const& tangent) {
        T const across = sum_of_magnitudes(cross(tangent, state_.direction));
        return (abs(at) - T(1)) * across <= T(rounding + search_.gap) + off && abs(at) <= T(1 + 0x1p-10f);
      };
      root.valid = is_within(x, p.du) && is_within(y, p.dv);
      keep(w.entry, root, start_ - left.along, inside && root.valid);
    } else {
      T const along = -(dot(chord, state_.direction) * per_square);
      // Most roots of rays that leave a surface are where they left it: they need no correction.
      T const size(static_cast<float>(exact_.size * state_.hierarchy.inverse_scale));
      T const spare = fma(T(static_cast<float>(exact_.slope)), n.error_x + n.error_y, size * T(0x1p-13f));
      T const entry = max(w.entry, along - spare);
      inside = inside && soonest_ <= along + spare && entry <= nearest_;
      if (!any_of(inside)) return;
      chord_rows<T> const rows = make_chord_rows(p, state_.direction);
      patch_root<S> root;
      SM const proved = correct_parts(x, y, rows, inside, root);
      if constexpr (A == accuracy::certified) {
        root.error = S(2) * root.error;
        // A hit on an edge that is not proved may be two roots, or none.
        S const at = fma(root.t * state_.per_scaled, state_.to_search, -state_.shift);
        state_.touches_from =
            select(root.valid && !proved, min(counts_from(at, entry), state_.touches_from), state_.touches_from);
        find_roots({w.cell_x, w.cell_y, w.half_x, w.half_y, inside && !convert<TM>(proved)}, entry);
      }
      root.t = root.t * state_.per_scaled;
      keep(entry, root, fma(root.t, state_.to_search, -state_.shift), root.valid);
    }
  }

  /// Corrects the roots (x, y) of the lanes in `inside`, a register's lanes at a time. For `certified`, gives the lanes
  /// whose roots are proved to exist and to be alone around (x, y); unspecified otherwise.
  PATCHRT_INLINE SM correct_parts(T x, T y, chord_rows<T> const& rows, TM inside, patch_root<S>& root) {
    using Q = part_t<S>;
    root.t = root.error = S(0);
    root.u = fma(convert<S>(x), S(0.5), S(0.5));
    root.v = fma(convert<S>(y), S(0.5), S(0.5));
    root.valid = convert<SM>(inside);
    SM proved = root.valid && !root.valid;
    vec3<S> const rows_x = convert_vec<S>(rows.x), rows_y = convert_vec<S>(rows.y), rows_t = convert_vec<S>(rows.t);
    S const per_cosine = convert<S>(rows.per_cosine), start_x = convert<S>(x), start_y = convert<S>(y);
    using P = scalar_parts<S>;
    auto const part_of = [](vec3<S> const& v, int i) {
      return vec3<Q>(P::get(v.x, i), P::get(v.y, i), P::get(v.z, i));
    };
    for_each_part(root, [&](int i, patch_root<Q>& r, vec3<Q> const& origin, vec3<Q> const& direction) {
      chord_rows<Q> const own{part_of(rows_x, i), part_of(rows_y, i), part_of(rows_t, i), P::get(per_cosine, i)};
      patch_root<Q> by_chords;
      Q const to_rows(state_.hierarchy.inverse_scale);
      chord_steps<Q> const steps =
          correct_by_chords(exact_.power, exact_.rounding, own, to_rows, P::get(start_x, i), P::get(start_y, i), origin,
                            direction, P::get(state_.per_square, i), by_chords);
      auto take = r.valid && steps.settled;
      r.valid = r.valid && !steps.settled;
      if (any_of(r.valid)) correct(exact_.patch, exact_.size, exact_.gaps, origin, direction, r);
      if constexpr (A == accuracy::certified) {
        // What is not proved is isolated; but for hits on an edge, which may be beyond it by its gap.
        take = take && is_proved(exact_, own, to_rows, steps);
        Q const zero(L(0)), one(L(1));
        r.valid = r.valid && (r.u == zero || r.u == one || r.v == zero || r.v == one);
        auto sure = take;
        if (any_of(r.valid))
          sure = sure || (r.valid && is_proved_on_edge(exact_, origin, direction, r.u, r.v, to_rows));
        scalar_parts<SM>::set(proved, i, sure);
      }
      r.t = select(take, by_chords.t, r.t);
      r.u = select(take, by_chords.u, r.u);
      r.v = select(take, by_chords.v, r.v);
      r.error = select(take, by_chords.error, r.error);
      r.valid = r.valid || take;
    });
    return proved;
  }

  /// Decides what the search in float did not: all roots in a part of a cell, ray by ray.
  PATCHRT_INLINE void find_roots(patch_part<T> const& part, T entry) {
    if constexpr (is_thorough)
      if (any_of(part.lanes)) find_lane_roots(part, entry);
  }

  PATCHRT_OUTLINE void find_lane_roots(patch_part<T> const& part, T entry) {
    constexpr int N = lanes_v<T>;
    float x[N], y[N], half_x[N], half_y[N];
    store_lanes(part.x, x);
    store_lanes(part.y, y);
    store_lanes(part.half_x, half_x);
    store_lanes(part.half_y, half_y);
    L number[6][N];
    vec3<S> const &o = state_.origin, &d = state_.search_direction;
    S const coordinates[6] = {o.x, o.y, o.z, d.x, d.y, d.z};
    for (int k = 0; k < 6; ++k) store_lanes(coordinates[k], number[k]);
    for (unsigned rest = mask_bits(part.lanes); rest != 0; rest &= rest - 1) {
      int const i = lowest_bit(rest);
      TM const on = convert<TM>(1u << i);
      vec3<L> const origin = vec3<L>(number[0][i], number[1][i], number[2][i]) - vec3<L>(exact_.base);
      vec3<L> const direction(number[3][i], number[4][i], number[5][i]);
      if constexpr (A == accuracy::certified)
        certify_cell(exact_, origin, direction, {x[i], y[i], half_x[i], half_y[i], {}},
                     [&](certified_root<L> const& found) { keep_certified(found, on, entry); });
      else
        separate_roots(exact_, origin, direction, L(state_.hierarchy.inverse_scale),
                       {L(x[i]), L(y[i]), L(half_x[i]), L(half_y[i]), true}, [&](patch_root<L> const& found) {
                         patch_root<S> const root{S(found.t) * state_.per_scaled, S(found.u), S(found.v),
                                                  S(found.error), convert<SM>(on)};
                         keep(entry, root, fma(root.t, state_.to_search, -state_.shift), root.valid);
                       });
    }
  }

  /// A root, or a place that may be one, of the ray in lane `on`.
  PATCHRT_INLINE void keep_certified(certified_root<L> const& found, TM on, T entry) {
    bool const is_vague = found.root.valid && !(found.root.error < L(exact_.size));
    patch_root<S> const root{S(found.root.t) * state_.per_scaled, S(found.root.u), S(found.root.v), S(found.root.error),
                             convert<SM>(on)};
    S const along = fma(root.t, state_.to_search, -state_.shift);
    if (found.kind != root_kind::simple || is_vague) {
      S earliest = fma(S(found.earliest) * state_.per_scaled, state_.to_search, -state_.shift);
      if (found.root.valid) earliest = min(earliest, along);
      S const from = counts_from(earliest, entry);
      S& nearest_of_kind = found.kind == root_kind::degenerate ? state_.doubt_from : state_.touches_from;
      nearest_of_kind = select(root.valid, min(from, nearest_of_kind), nearest_of_kind);
    }
    if (found.root.valid) keep(entry, root, along, root.valid);
  }

  PATCHRT_INLINE void solve_as_reference(cell_batch const& w) {
    int steps = 0;
    patch_root<S> root;
    root.t = root.error = S(0);
    root.u = fma(convert<S>(w.x), S(0.5), S(0.5));
    root.v = fma(convert<S>(w.y), S(0.5), S(0.5));
    root.valid = convert<SM>(w.lanes);
    for_each_part(root,
                  [&](int, patch_root<part_t<S>>& r, vec3<part_t<S>> const& origin, vec3<part_t<S>> const& direction) {
                    steps = std::max(steps, solve_on_planes(exact_.patch, exact_.size, origin, direction, r));
                  });
    root.t = root.t * state_.per_scaled;
    if (state_.counts) state_.counts->newton_steps += unsigned(steps) * state_.lanes_on(w.lanes);
    keep(w.entry, root, fma(root.t, state_.to_search, -state_.shift), root.valid);
  }

  /// f(i, root, origin, direction) for every part i of `root` with a valid lane: the rays as given, relative to the
  /// patch's base and with `search_direction`, so that no product of it over- or underflows.
  template <class F> PATCHRT_INLINE void for_each_part(patch_root<S>& root, F&& f) {
    using P = scalar_parts<S>;
    using M = scalar_parts<SM>;
    vec3<S> const &o = state_.origin, &d = state_.search_direction;
    for (int i = 0; i < P::count; ++i) {
      if (!any_of(M::get(root.valid, i))) continue;
      patch_root<part_t<S>> r{P::get(root.t, i), P::get(root.u, i), P::get(root.v, i), P::get(root.error, i),
                              M::get(root.valid, i)};
      vec3<part_t<S>> const origin{P::get(o.x, i), P::get(o.y, i), P::get(o.z, i)};
      vec3<part_t<S>> const direction{P::get(d.x, i), P::get(d.y, i), P::get(d.z, i)};
      f(i, r, difference(origin, convert_vec<part_t<S>>(exact_.base)), direction);
      P::set(root.t, i, r.t);
      P::set(root.u, i, r.u);
      P::set(root.v, i, r.v);
      P::set(root.error, i, r.error);
      M::set(root.valid, i, r.valid);
    }
  }

  /// Whether what is at `along` is not nearer than where it was looked for, so that what was skipped could not have
  /// held it.
  PATCHRT_INLINE TM is_behind(S along, T entry) const {
    return entry <= convert<T>(along - start_) && entry_ <= convert<T>(along);
  }

  /// From which nearest hit on a place at `along` that may be a root is before it: where it is not behind its entry,
  /// from there on.
  PATCHRT_INLINE S counts_from(S along, T entry) const {
    S const begin = start_ + convert<S>(max(entry, T(0)));
    return select(convert<SM>(is_behind(along, entry)), along, max(along, begin));
  }

  /// Keeps roots that are nearer than what is known and not nearer than `entry`; `along` is their t in search space.
  PATCHRT_INLINE void keep(T entry, patch_root<S> const& root, S along, SM found) {
    auto& hit = state_.hit;
    found = found && convert<SM>(is_behind(along, entry)) && state_.t_min < root.t;
    if constexpr (!std::is_same_v<Sink, nearest_only>) {
      static_assert(lanes_v<T> == 1);
      if (found && root.t < hit.t) state_.sink(patch_, root);
      return;
    }
    SM nearer = found && root.t < hit.t;
    SM const same = found && root.t == hit.t && hit.valid;
    if (any_of(same)) nearer = nearer || (same && first_of_tie(root));
    if (!any_of(nearer)) return;
    hit.t = select(nearer, root.t, hit.t);
    hit.u = select(nearer, root.u, hit.u);
    hit.v = select(nearer, root.v, hit.v);
    hit.error = select(nearer, root.error, hit.error);
    hit.patch_bits = select(convert<TM>(nearer), T(std::bit_cast<float>(patch_)), hit.patch_bits);
    hit.valid = hit.valid || nearer;
    state_.nearest = select(nearer, along, state_.nearest);
  }

  /// Of two roots at the same t, whether this patch's comes first.
  PATCHRT_INLINE SM first_of_tie(patch_root<S> const& root) const {
    constexpr int N = lanes_v<T>;
    float bits[N];
    L u[N], v[N], error[N], other_u[N], other_v[N], other_error[N];
    store_lanes(state_.hit.patch_bits, bits);
    store_lanes(state_.hit.u, other_u);
    store_lanes(state_.hit.v, other_v);
    store_lanes(root.u, u);
    store_lanes(root.v, v);
    store_lanes(root.error, error);
    store_lanes(state_.hit.error, other_error);
    unsigned first = 0;
    for (int i = 0; i < N; ++i) {
      std::int32_t const other = std::bit_cast<std::int32_t>(bits[i]);
      bool const wins = patch_ != other      ? patch_ < other
                        : u[i] != other_u[i] ? u[i] < other_u[i]
                        : v[i] != other_v[i] ? v[i] < other_v[i]
                                             : error[i] < other_error[i];
      first |= unsigned(wins) << i;
    }
    return convert<SM>(first);
  }

  search_state<A, Surface, T, Sink>& state_;
  std::int32_t patch_;
  search_patch<Surface> const& search_;
  exact_patch<Surface> const& exact_;
  unsigned octant_;
  TM lanes_;
  T entry_;
  S start_;  // entry_
  vec3<T> origin_;
  T soonest_;
  T nearest_;  // of the hits, from entry_ on
  T cell_entry_;
  TM cell_lanes_;
  cell_batch waiting_;
  projected_patch<T, form::degree_u, form::degree_v> projected_;  // made when the first leaf is reached
};

}  // namespace detail
}  // namespace patchrt
