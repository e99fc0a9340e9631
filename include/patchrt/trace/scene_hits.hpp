// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Lists of rays to lists of hits in a scene, on the CPU. Packs of rays that keep together walk the wide tree as one,
/// others take turns. Needs the component `patchrt::pack`.

#include <patchrt/accel/scene_search.hpp>
#include <patchrt/accel/traverse_wide.hpp>
#include <patchrt/exec/executor.hpp>
#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>

namespace patchrt::trace {

namespace detail {

/// Rays that are traced together: the lanes of a pack.
inline constexpr int scene_width = 16;
using box_lanes = pack<float, wide_node::width>;

template <class... Shapes> inline constexpr bool wants_packs = (shape_kind<Shapes>::wants_packs || ...);

/// Whether the rays of a pack are near enough to each other to walk as a bundle: origins within a sixteenth of the scene,
/// directions within about 15 degrees of the first.
template <class R> PATCHRT_OUTLINE bool keep_together(ray<R> const* rays, double reach) {
  using record = pack<R, 8>;
  static_assert(sizeof(ray<R>) == 8 * sizeof(R));
  record const first = record::load(&rays->origin.x);
  record spread(R(0));
  for (int i = 1; i < scene_width; ++i) spread = max(abs(record::load(&rays[i].origin.x) - first), spread);
  R const of_origins = static_cast<R>(reach / 16), of_directions = sum_of_magnitudes(rays->direction) / 8;
  R by[8];
  spread.store(by);
  return by[0] <= of_origins && by[1] <= of_origins && by[2] <= of_origins && by[3] <= of_directions &&
         by[4] <= of_directions && by[5] <= of_directions;
}

template <bool AnyHit, class R, class... Shapes>
using search_of_one = patchrt::detail::scene_search<AnyHit, float, R, box_lanes, Shapes...>;

/// By a node or a leaf.
template <class Search, class Walk> PATCHRT_INLINE bool step(Search& search, Walk& walk) {
  return walk.step([&]() PATCHRT_INLINE_LAMBDA { return search.nearest(); },
                   [&](std::uint32_t leaf, float entry)
                       PATCHRT_INLINE_LAMBDA { return !search.meet_leaf(leaf, true, entry); });
}

/// What a ray is told: its nearest hit, or whether it has any.
template <bool AnyHit, class R> using answer = std::conditional_t<AnyHit, std::uint8_t, scene_hit<R>>;

template <bool AnyHit, class R, class Hit> PATCHRT_INLINE answer<AnyHit, R> answer_of(Hit const& h) {
  if constexpr (AnyHit) return h.valid;
  else if (!h.valid) return {};
  else return {h.t, h.u, h.v, std::bit_cast<std::int32_t>(h.shape_bits), std::bit_cast<std::int32_t>(h.part_bits)};
}

template <bool AnyHit, class R, class... Shapes>
PATCHRT_OUTLINE answer<AnyHit, R> trace_one(scene_view<Shapes...> const& scene, ray<R> const& r) {
  search_of_one<AnyHit, R, Shapes...> search(scene, r, true);
  if (!search.active() || scene.wide.count == 0) return {};
  wide_walk<AnyHit, box_lanes> walk(scene.wide, search.slabs(), search.t_min());
  while (step(search, walk)) {
  }
  return answer_of<AnyHit, R>(search.hit());
}

/// Rays that take turns, each a step at a time. A step is a chain of operations that wait for each other, or for memory: alone
/// it leaves most of the machine idle.
inline constexpr std::size_t rays_in_turn = 4;

template <bool AnyHit, class R, class... Shapes>
void trace_in_turn(scene_view<Shapes...> const& scene, std::span<ray<R> const> rays,
                   std::span<answer<AnyHit, R>> answers) {
  struct turn {
    std::optional<search_of_one<AnyHit, R, Shapes...>> search;
    std::optional<wide_walk<AnyHit, box_lanes>> walk;
    std::size_t number;
  };
  std::array<turn, rays_in_turn> turns;
  std::array<turn*, rays_in_turn> under_way;
  std::size_t count = 0, next = 0;
  auto const begin = [&](turn& t) PATCHRT_INLINE_LAMBDA {
    while (next < rays.size()) {
      t.number = next++;
      t.search.emplace(scene, rays[t.number], true);
      if (!t.search->active() || scene.wide.count == 0) {
        answers[t.number] = {};
        continue;
      }
      t.walk.emplace(scene.wide, t.search->slabs(), t.search->t_min());
      return true;
    }
    return false;
  };
  for (turn& t : turns)
    if (begin(t)) under_way[count++] = &t;
  while (count > 0)
    for (std::size_t i = 0; i < count; ++i) {
      turn& t = *under_way[i];
      if (step(*t.search, *t.walk)) continue;
      answers[t.number] = answer_of<AnyHit, R>(t.search->hit());
      if (!begin(t)) under_way[i--] = under_way[--count];
    }
}

/// Which lanes have a hit, to a list.
template <class Hit> PATCHRT_INLINE void store_answers(Hit const& h, std::uint8_t* answers) {
  std::uint32_t const valid = h.valid.bits();
  for (int i = 0; i < scene_width; ++i) answers[i] = static_cast<std::uint8_t>(valid >> i & 1u);
}
/// Hits of a pack to a list.
template <class R, class Hit> PATCHRT_INLINE void store_answers(Hit const& h, scene_hit<R>* hits) {
  constexpr int N = scene_width;
  using numbers = pack<R, N>;
  numbers const t = select(convert<mask_t<numbers>>(h.valid), h.t, numbers(std::numeric_limits<R>::infinity()));
  if constexpr (sizeof(scene_hit<R>) == 5 * sizeof(float)) {
    pack<float, N> const fields[5] = {t, h.u, h.v, h.shape_bits, h.part_bits};
    float records[5 * N];
    store_records(fields, records);
    std::memcpy(hits, records, sizeof records);
  } else {
    R lanes[3][N];
    float bits[2][N];
    t.store(lanes[0]);
    h.u.store(lanes[1]);
    h.v.store(lanes[2]);
    h.shape_bits.store(bits[0]);
    h.part_bits.store(bits[1]);
    for (int i = 0; i < N; ++i)
      hits[i] = {lanes[0][i], lanes[1][i], lanes[2][i], std::bit_cast<std::int32_t>(bits[0][i]),
                 std::bit_cast<std::int32_t>(bits[1][i])};
  }
}

/// A pack of rays that keep together; those of lanes that are not in `on` are not traced.
template <bool AnyHit, class R, class... Shapes>
void trace_pack(scene_view<Shapes...> const& scene, ray<R> const* rays, answer<AnyHit, R>* answers, std::uint32_t on) {
  constexpr int N = scene_width;
  using T = pack<float, N>;
  using M = mask_t<T>;
  pack<R, N> r[8];
  load_records(&rays->origin.x, r);
  ray<pack<R, N>> const pack_of_rays{{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6], r[7]};
  patchrt::detail::scene_search<AnyHit, T, pack<R, N>, void, Shapes...> search(scene, pack_of_rays, M::from_bits(on));
  auto const span = patchrt::intersect(search.slabs(), scene.bounds, search.t_min(), search.nearest());
  on = (search.active() && span.entry <= span.exit).bits();
  if (on == 0) {
    static constexpr std::array<answer<AnyHit, R>, N> misses{};
    std::memcpy(answers, misses.data(), sizeof misses);  // std::copy copies five numbers at a time
    return;
  }
  auto const& inverse = search.slabs().inverse;
  std::uint32_t const negative[3] = {(inverse.x < T(0)).bits(), (inverse.y < T(0)).bits(), (inverse.z < T(0)).bits()};
  for (std::uint32_t left = on; left != 0;) {
    int const i = std::countr_zero(left);
    std::uint32_t group = left;  // the octant of the first lane that is left
    for (std::uint32_t n : negative) group &= (n >> i & 1u) != 0 ? n : ~n;
    left &= ~group;
    traverse_wide_bundle<box_lanes>(
        scene.wide, search.slabs(), search.t_min(), M::from_bits(group),
        [&]() PATCHRT_INLINE_LAMBDA { return search.nearest(); },
        [&](std::uint32_t leaf, M const& in, T const& entry)
            PATCHRT_INLINE_LAMBDA { return search.meet_leaf(leaf, in, entry); });
  }
  store_answers(search.hit(), answers);
}

template <bool AnyHit, class R, class... Shapes, executor E>
void scene_list(scene_view<Shapes...> const& scene, std::span<ray<R> const> rays, std::span<answer<AnyHit, R>> answers,
                E const& exec) {
  PATCHRT_EXPECTS(answers.size() == rays.size());
  constexpr std::size_t N = scene_width;
  exec.for_each_chunk(rays.size(), std::size_t(1024), [&](std::size_t begin, std::size_t end) {
    std::size_t waiting = begin;  // those before i that do not keep together
    auto const trace_waiting = [&](std::size_t to) {
      if (waiting < to)
        trace_in_turn<AnyHit>(scene, rays.subspan(waiting, to - waiting), answers.subspan(waiting, to - waiting));
    };
    for (std::size_t i = begin; i < end; i += N) {
      std::size_t const n = std::min(N, end - i);
      if (!wants_packs<Shapes...> && (n < N || !keep_together(rays.data() + i, scene.reach))) continue;
      trace_waiting(i);
      waiting = i + n;
      if (n == N) {
        trace_pack<AnyHit>(scene, rays.data() + i, answers.data() + i, (1u << N) - 1u);
        continue;
      }
      ray<R> last_rays[N];
      answer<AnyHit, R> last[N];
      std::fill(std::copy(rays.begin() + std::ptrdiff_t(i), rays.begin() + std::ptrdiff_t(end), last_rays),
                last_rays + N, rays[i]);
      trace_pack<AnyHit>(scene, last_rays, last, (1u << n) - 1u);
      for (std::size_t k = 0; k < n; ++k) answers[i + k] = last[k];
    }
    trace_waiting(end);
  });
}

}  // namespace detail

/// The nearest hit of every ray in (t_min, t_max) in a scene that was built for wide walks.
///
/// A NaN anywhere in a ray, a direction of length 0 or whose squared length over- or underflows, or t_min >= t_max is a miss.
/// The hits are the same bits for every executor and number of threads, for every order of the rays, and those of `intersect`
/// without a stack.
/// \pre hits.size() == rays.size()
template <class... Shapes, executor E>
void closest_hits(scene_view<Shapes...> const& scene, std::span<ray<float> const> rays,
                  std::span<scene_hit<float>> hits, E const& exec) {
  detail::scene_list<false>(scene, rays, hits, exec);
}
template <class... Shapes, executor E>
void closest_hits(scene_view<Shapes...> const& scene, std::span<ray<double> const> rays,
                  std::span<scene_hit<double>> hits, E const& exec) {
  detail::scene_list<false>(scene, rays, hits, exec);
}

/// The same of one ray.
template <class... Shapes, class R> scene_hit<R> closest_hit(scene_view<Shapes...> const& scene, ray<R> const& r) {
  return detail::trace_one<false>(scene, r);
}
/// Whether one ray has a hit.
template <class... Shapes, class R> bool any_hit(scene_view<Shapes...> const& scene, ray<R> const& r) {
  return detail::trace_one<true>(scene, r);
}

/// Which rays have a hit in (t_min, t_max), 1 for those, 0 for others: what shadow rays ask. The same rays that
/// `closest_hits` finds hits of, found sooner.
/// \pre hit.size() == rays.size()
template <class... Shapes, executor E>
void any_hits(scene_view<Shapes...> const& scene, std::span<ray<float> const> rays, std::span<std::uint8_t> hit,
              E const& exec) {
  detail::scene_list<true>(scene, rays, hit, exec);
}
template <class... Shapes, executor E>
void any_hits(scene_view<Shapes...> const& scene, std::span<ray<double> const> rays, std::span<std::uint8_t> hit,
              E const& exec) {
  detail::scene_list<true>(scene, rays, hit, exec);
}

}  // namespace patchrt::trace
