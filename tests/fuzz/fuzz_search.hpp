// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What must hold of any finite patches and any ray, by the oracle: for random search, and for what it found before.

#include "support/oracle.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <string>

namespace patchrt::test {

/// Patches, and rays that are traced in one pack.
struct search_input {
  patch_list patches;
  ray_list rays;
};

/// What is wrong: the property, and the ray it is of.
struct search_violation {
  std::string property;  ///< empty where all hold
  std::size_t ray = 0;
};

/// A ray's hit and what is proved of it; the proof is `certified` at the other levels, which give none.
struct search_answer {
  patch_hit hit;
  certainty proof = certainty::certified;
};

template <accuracy A> std::vector<search_answer> search_pack(mixed_hierarchy const& h, ray_list const& rays) {
  std::vector<patch_hit> hits(rays.size());
  std::vector<certainty> proofs(rays.size(), certainty::certified);
  if constexpr (A == accuracy::certified)
    trace::certified_hits(h.view(), std::span<ray<double> const>(rays), hits, proofs, serial{});
  else trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  std::vector<search_answer> out;
  for (std::size_t i = 0; i < rays.size(); ++i) out.push_back({hits[i], proofs[i]});
  return out;
}

inline bool is_same_hit(patch_hit const& a, patch_hit const& b) {
  auto const bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  return a.patch == b.patch && bits(a.t) == bits(b.t) && bits(a.u) == bits(b.u) && bits(a.v) == bits(b.v) &&
         std::bit_cast<std::uint32_t>(a.error) == std::bit_cast<std::uint32_t>(b.error);
}

inline bool is_well_formed(patch_hit const& hit, ray<double> const& r, std::size_t patches) {
  if (!hit.valid()) return hit.patch == -1 && hit.t == no_limit;
  return std::size_t(hit.patch) < patches && std::isfinite(hit.t) && r.t_min < hit.t && hit.t < r.t_max && 0 <= hit.u &&
         hit.u <= 1 && 0 <= hit.v && hit.v <= 1 && 0 <= hit.error;
}

/// S(u, v) in long double.
inline std::array<long double, 3> long_position(bicubic_patch<double> const& p, long double u, long double v) {
  auto const weights = [](long double t) {
    long double const s = 1 - t;
    return std::array<long double, 4>{s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
  };
  auto const in_u = weights(u), in_v = weights(v);
  std::array<long double, 3> sum{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += in_u[i] * in_v[j] * (long double)(p(int(i), int(j))[glm::length_t(c)]);
  return sum;
}

/// What the oracle knows of one ray: the roots of the whole line.
struct search_truth {
  std::vector<oracle_root> roots;
  ray<double> r;
  double length;  ///< of the direction
  double reach;   ///< the largest coordinates of all together: what rounding is relative to
  double size;    ///< of the scene

  double noise() const { return 64 * 0x1p-52 * reach; }
  /// How far a root may be off along the ray, in units of the direction, after rounding.
  double spread(oracle_root const& root, double least_cos) const {
    return noise() / (length * std::max(root.cos_angle, least_cos));
  }
  /// The nearest root that any right answer has, or null.
  oracle_root const* first(double least_cos) const {
    for (oracle_root const& root : roots) {
      double const off = spread(root, least_cos), t = double(root.t);
      if (r.t_min + off < t && t + off < r.t_max && root.is_certain(least_cos, 1e-9 * size + noise() / least_cos))
        return &root;
    }
    return nullptr;
  }
  /// Whether there is more than points in common: everything there is a right answer.
  bool has_curve() const {
    return std::any_of(roots.begin(), roots.end(), [&](oracle_root const& root) {
      return root.singular && double(root.slack) * length > 1e-3 * size;
    });
  }
};

inline search_truth truth_of(search_input const& in, oracle const& all, ray<double> const& r) {
  auto const ball = ball_of(in.patches);
  search_truth truth{{}, r, norm(r.direction), norm(ball.middle) + ball.radius + norm(r.origin), 2 * ball.radius};
  double const margin = std::min(1e-3, 1e-9 + 16 * truth.noise() / std::max(truth.size, 1e-300));
  truth.roots = all.all_hits(numbers_of(ray<double>{r.origin, r.direction, -no_limit, no_limit}), margin);
  return truth;
}

/// Of a valid hit: the root that it is of, or null.
inline oracle_root const* root_of(search_truth const& truth, patch_hit const& hit) {
  oracle_root const* best = nullptr;
  double least = no_limit;
  for (oracle_root const& r : truth.roots) {
    double const apart = (double(std::fabs(r.t - (long double)(hit.t))) - double(r.slack)) * truth.length;
    double const other = r.patch == hit.patch ? 0 : 0.25 * truth.noise();
    if (apart + other < least) least = apart + other, best = &r;
  }
  double const error = std::isfinite(hit.error) ? 2 * double(hit.error) : 0;
  return least <= error + truth.noise() ? best : nullptr;
}

/// Whether the ray passes S(u, v), a point on an edge but for the hit's error, within rounding or by no more than edges
/// that are joined may be apart.
inline bool is_across_edge(search_input const& in, search_truth const& truth, patch_hit const& hit, double widest_gap) {
  double const to_edge = std::min({hit.u, 1 - hit.u, hit.v, 1 - hit.v});
  if (to_edge > 1e-9 && to_edge * truth.size > double(hit.error)) return false;
  auto const at = long_position(in.patches[std::size_t(hit.patch)], hit.u, hit.v);
  long double const d[3] = {truth.r.direction.x, truth.r.direction.y, truth.r.direction.z};
  long double const r[3] = {at[0] - truth.r.origin.x, at[1] - truth.r.origin.y, at[2] - truth.r.origin.z};
  long double const x = r[1] * d[2] - r[2] * d[1], y = r[2] * d[0] - r[0] * d[2], z = r[0] * d[1] - r[1] * d[0];
  long double const square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  return std::sqrt((x * x + y * y + z * z) / square) <= (long double)(truth.noise() + widest_gap);
}

/// Whether S(u, v) is farther than so many times the hit's error from every root at the root's t. A point of an edge
/// that the ray passes within rounding is right of itself.
inline bool is_beyond_error(search_input const& in, search_truth const& truth, patch_hit const& hit,
                            oracle_root const& root, double times) {
  if (is_across_edge(in, truth, hit, 0)) return false;
  auto const at = long_position(in.patches[std::size_t(hit.patch)], hit.u, hit.v);
  long double least = no_limit;
  for (oracle_root const& r : truth.roots) {
    if (std::fabs(double(r.t - root.t)) * truth.length > truth.noise()) continue;
    if (r.singular || r.edge_distance < truth.noise()) return false;
    auto const other = long_position(in.patches[std::size_t(r.patch)], r.u, r.v);
    long double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += (at[c] - other[c]) * (at[c] - other[c]);
    least = std::min(least, std::sqrt(sum));
  }
  return least > times * (long double)(hit.error) + 1e-18L * (long double)(truth.reach);
}

inline char const* wrong_with_certified(search_input const& in, search_truth const& truth, search_answer const& a,
                                        double widest_gap) {
  if (a.proof != certainty::certified) return nullptr;
  patch_hit const& hit = a.hit;
  oracle_root const* const first = truth.first(1e-9);
  if (!hit.valid()) return first ? "certified: no root, where there is one" : nullptr;
  if (first && hit.t > double(first->t) + (2 * double(hit.error) + truth.noise()) / truth.length)
    return "certified: the nearest root, where a nearer one is";
  oracle_root const* const root = root_of(truth, hit);
  if (!root && is_across_edge(in, truth, hit, widest_gap)) return nullptr;
  if (!root) return "certified: a root, where there is none";
  return is_beyond_error(in, truth, hit, *root, 1) ? "certified: a root that is farther off than the hit's error"
                                                   : nullptr;
}

inline char const* wrong_with_refined(search_input const& in, search_truth const& truth, patch_hit const& hit) {
  oracle_root const* const first = truth.first(1e-2);
  if (!first) return nullptr;
  if (!hit.valid() || hit.t > double(first->t) + (2 * double(hit.error) + truth.noise()) / truth.length)
    return "refined: a regular root is lost";
  oracle_root const* const root = root_of(truth, hit);
  bool const is_clear = double(hit.error) < 1e-6 * truth.size;  // else the hit may be of a contact beside the root
  if (is_clear && root == first && is_beyond_error(in, truth, hit, *root, 2))  // it bounds to first order
    return "refined: a regular root that is farther off than twice the hit's error";
  return nullptr;
}

/// The first property that does not hold.
///
/// Left out are certificates of rays that have a whole segment or area in common with a patch.
inline search_violation find_violation(search_input const& in) {
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(in.patches), {}, serial{});
  auto const refined = search_pack<accuracy::refined>(h, in.rays),
             certified = search_pack<accuracy::certified>(h, in.rays), fast = search_pack<accuracy::fast>(h, in.rays),
             reference = search_pack<accuracy::reference>(h, in.rays);
  ray_list const backwards(in.rays.rbegin(), in.rays.rend());
  auto const again = search_pack<accuracy::certified>(h, backwards),
             refined_again = search_pack<accuracy::refined>(h, backwards);
  oracle const truth(numbers_of(in.patches));
  double widest_gap = 0;
  for (std::size_t k = 0; k < in.patches.size(); ++k) {
    widest_gap = std::max(widest_gap, largest_gap(h.view().exact[k].gaps));
  }
  for (std::size_t i = 0; i < in.rays.size(); ++i) {
    ray<double> const& r = in.rays[i];
    std::size_t const other = in.rays.size() - 1 - i, n = in.patches.size();
    for (auto const* level : {&refined, &certified, &fast, &reference})
      if (!is_well_formed((*level)[i].hit, r, n))
        return {"a hit is a point of a patch within the ray's range, or there is none", i};
    auto const alone = search_pack<accuracy::certified>(h, {r});
    if (!is_same_hit(alone[0].hit, certified[i].hit) || alone[0].proof != certified[i].proof ||
        !is_same_hit(again[other].hit, certified[i].hit) || again[other].proof != certified[i].proof)
      return {"certified: the same bits alone and in any pack", i};
    if (!is_same_hit(search_pack<accuracy::refined>(h, {r})[0].hit, refined[i].hit) ||
        !is_same_hit(refined_again[other].hit, refined[i].hit))
      return {"refined: the same bits alone and in any pack", i};
    search_truth const known = truth_of(in, truth, r);
    char const* const refined_is = wrong_with_refined(in, known, refined[i].hit);
    if (refined_is) return {refined_is, i};
    char const* const certified_is =
        known.has_curve() ? nullptr : wrong_with_certified(in, known, certified[i], widest_gap);
    if (certified_is) return {certified_is, i};
  }
  return {};
}

/// What was violated as a row for tests/hard_cases/rows_found.hpp: patches, and the ray or its pack.
inline std::string as_row(search_input const& in, search_violation const& v) {
  std::string text = "{\"" + v.property + "\",\n {";
  char number[40];
  auto const add = [&](double x) {
    bool const is_short = x == std::round(x) && std::fabs(x) < 1e6;
    std::snprintf(number, sizeof number, is_short ? "%.0f, " : "%a, ", x);
    text += std::isinf(x) ? (x < 0 ? "-endless, " : "endless, ") : number;
  };
  for (auto const& p : in.patches) {
    text += "{";
    for (double const x : numbers_of(p)) add(x);
    text += "},\n  ";
  }
  text += "},\n {";
  bool const is_of_pack = v.property.find("pack") != v.property.npos;
  for (std::size_t i = 0; i < in.rays.size(); ++i) {
    if (i != v.ray && !is_of_pack) continue;
    text += "{";
    for (double const x : numbers_of(in.rays[i])) add(x);
    text += "}, ";
  }
  return text + "}},\n";
}

}  // namespace patchrt::test
