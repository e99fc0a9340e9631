// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What a level's answer is worth, given the exact one.

#include "pose.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <bit>

namespace patchrt::test {

enum class outcome {
  right,
  lost,      ///< a root that had to be found was not, or a farther one was reported
  invented,  ///< a hit where ray and patch do not meet
  off,       ///< a hit farther from its root than its error says
  oversure,  ///< certified, but there is a contact that was not reported
  unsure     ///< not certified where nothing is close to touching
};

inline char const* name_of(outcome o) {
  char const* const names[] = {"right", "lost", "invented", "off", "oversure", "unsure"};
  return names[int(o)];
}

inline mixed_hierarchy hierarchy_of(patch_list const& patches) {
  return build_mixed_hierarchy(std::span<bicubic_patch<double> const>(patches), {}, serial{});
}

/// A level's answer to a ray, and for `certified` what is proved of it.
struct answer {
  patch_hit hit;
  certainty proof = certainty::certified;
};

/// The same bits, but for the error, which lists round up.
inline bool is_same(answer const& a, answer const& b) {
  auto const bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return a.proof == b.proof && a.hit.patch == b.hit.patch && bits(a.hit.t) == bits(b.hit.t) &&
         bits(a.hit.u) == bits(b.hit.u) && bits(a.hit.v) == bits(b.hit.v);
}

template <accuracy A> std::vector<answer> answers(mixed_hierarchy_view const& h, ray_list const& rays) {
  std::vector<patch_hit> hits(rays.size());
  std::vector<certainty> proofs(rays.size(), certainty::certified);
  if constexpr (A == accuracy::certified)
    trace::certified_hits(h, std::span<ray<double> const>(rays), hits, proofs, serial{});
  else trace::closest_hits<A>(h, std::span<ray<double> const>(rays), std::span(hits), serial{});
  std::vector<answer> out;
  for (std::size_t i = 0; i < rays.size(); ++i) out.push_back({hits[i], proofs[i]});
  return out;
}

/// The ray by itself, without a pack.
template <accuracy A> answer single_answer(mixed_hierarchy_view const& h, ray<double> const& r) {
  using S = search_scalar_t<A, float>;
  ray<S> const in{vec3<S>(r.origin), vec3<S>(r.direction), S(r.t_min), S(r.t_max)};
  auto const hit = intersect<A, false, float>(h, in, true);
  answer out;
  if (hit.valid)
    out.hit = {hit.t, hit.u, hit.v, static_cast<float>(hit.error), std::bit_cast<std::int32_t>(hit.patch_bits)};
  if constexpr (A == accuracy::certified)
    out.proof = hit.degenerate ? certainty::degenerate : hit.tangent ? certainty::tangent : certainty::certified;
  return out;
}

inline bool has_to_be_found(contact kind) {
  return kind == contact::simple || kind == contact::border || kind == contact::singular;
}

/// \pre `a` is finite where it is a hit
inline outcome judge(posed_case const& c, bool is_close, accuracy level, answer const& a) {
  auto const in_range = [&](posed_root const& r) {
    return wide(c.r.t_min) < r.t && (std::isinf(c.r.t_max) || r.t < wide(c.r.t_max));
  };
  posed_root const* first = nullptr;
  for (posed_root const& r : c.roots)
    if (!first && in_range(r) && has_to_be_found(r.kind)) first = &r;
  bool may_be_unsure = is_close, has_contact = false;
  for (posed_root const& r : c.roots) {
    bool const is_before = !first || r.t <= first->t;
    bool const is_contact = is_before && (in_range(r) || r.kind == contact::curve) && !has_to_be_found(r.kind);
    has_contact = has_contact || (is_contact && r.kind != contact::beyond);
    may_be_unsure = may_be_unsure || is_contact || (is_before && in_range(r) && r.kind != contact::simple);
  }
  bool const is_sure = level == accuracy::certified && a.proof == certainty::certified;
  bool const counts_proofs = level == accuracy::certified;
  if (counts_proofs && !is_sure && !may_be_unsure) return outcome::unsure;
  bool const may_lose = is_close && counts_proofs && !is_sure;
  if (!a.hit.valid()) {
    if (first && !may_lose) return outcome::lost;
    return is_sure && has_contact ? outcome::oversure : outcome::right;
  }

  wide const speed = length(widely(c.r.direction)), t = a.hit.t;
  wide_point const point = wide_position(c.patches[std::size_t(a.hit.patch)], a.hit.u, a.hit.v);
  bool const is_float = level == accuracy::fast;
  double const unit = is_float ? 0x1p-23 : 0x1p-52, noise = 64 * unit * c.size;
  // Of the distance from the ray, and of that from a contact of the sixth order.
  double const near_touch = 4 * std::pow(unit, 1. / 6) * c.size;
  wide_point const from = difference_of(point, widely(c.r.origin)), along = widely(c.r.direction);
  wide const foot = (from[0] * along[0] + from[1] * along[1] + from[2] * along[2]) / (speed * speed);
  wide const beside = length({from[0] - foot * along[0], from[1] - foot * along[1], from[2] - foot * along[2]});
  double const error = double(a.hit.error);
  double const bound = level == accuracy::fast        ? 4 * error + 1e-5 * c.size
                       : level == accuracy::reference ? 4 * error + 1e-9 * c.size
                                                      : error;
  // Where the error is infinite, S(u, v) is a point that the ray passes within rounding.
  double const slack = noise + (std::isfinite(error) ? std::min(error, near_touch) : 0);
  bool const is_on_ray = beside <= slack && abs(t - foot) * speed <= 2 * slack;
  auto const is_at = [&](wide const& at) { return abs(t - at) * speed <= (is_sure ? 2 * error + noise : near_touch); };
  bool const is_bounded = !is_sure || error <= near_touch;
  bool is_off = false;
  for (posed_root const& r : c.roots) {
    if (first && r.t > first->t) break;
    if (r.kind == contact::curve) {
      bool const is_in = r.t <= t && t <= r.t_end && !is_sure;
      if (is_on_ray && is_bounded && (is_in || is_at(r.t) || (!is_sure && is_at(r.t_end)))) return outcome::right;
    } else if (!in_range(r)) {
      continue;
    } else if (r.kind < contact::singular || r.kind == contact::beyond) {
      wide const apart = length(difference_of(point, r.point)), along_ray = abs(t - r.t) * speed;
      if (std::isfinite(error) && apart <= bound && along_ray <= 2 * bound + noise) return outcome::right;
      if (!std::isfinite(error) && is_on_ray && along_ray <= near_touch && !is_sure) return outcome::right;
      is_off = is_off || apart <= near_touch;
    } else {
      if (is_on_ray && is_bounded && is_at(r.t)) return outcome::right;
      is_off = is_off || abs(t - r.t) * speed <= near_touch;
    }
  }
  if (is_close && !is_sure && is_on_ray) return outcome::right;
  if (is_off) return outcome::off;
  return first && wide(t) > first->t ? outcome::lost : outcome::invented;
}

}  // namespace patchrt::test
