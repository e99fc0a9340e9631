// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// One hit against all roots of its ray in 113 bits.

#include "exact_surface.hpp"

#include "support/oracle.hpp"
#include "support/rays.hpp"

#include <patchrt/trace/fused.hpp>

#include <optional>

namespace patchrt::bench {

/// Where a model's lengths come from.
struct model_size {
  vec3<double> middle;
  double diagonal;
  std::vector<double> patch_diagonals;

  explicit model_size(test::patch_list const& scene) : middle(test::ball_of(scene).middle) {
    diagonal = 2 * test::ball_of(scene).radius;
    for (auto const& p : scene) {
      auto const e = extent(bounds(p));
      patch_diagonals.push_back(test::norm(e));
    }
  }
};

/// How far from a root t may be, in lengths, before it is another one: `fast` knows no more than float does.
inline double same_root(accuracy level, ray<double> const& r, model_size const& size) {
  double const away = test::norm(r.origin - size.middle);
  return level == accuracy::fast ? 1e-3 * size.diagonal + 1e-6 * away : 1e-9 * (size.diagonal + away);
}

/// A hit against the truth.
struct hit_verdict {
  bool is_lost = false;          ///< there is a nearer root, by more than `error`, neither grazing nor at an edge
  bool is_lost_grazing = false;  ///< there is a nearer root, within 1e-2 of grazing but regular and inside
  bool is_false = false;         ///< there is no root here, nor is it any of the next two
  bool is_join =
      false;  ///< there is no root here, but S(u, v) is on an edge, and the ray passes it within the hit's `error`
  bool is_touch = false;  ///< there is no root here, but the ray passes S(u, v) within rounding
  bool is_number = true;
  std::optional<double> error{};  ///< distance of S(u, v) from the true hit, of hits on regular roots
  double ulps = 0;  ///< the same in epsilons of (the patch's diagonal + distance travelled), of roots inside the patch
  double cosine = 0;  ///< of the angle between ray and normal
};

/// How far the edges of patches that are joined may be apart, in diagonals.
inline constexpr double widest_join = 2e-6;

/// How far the ray's line passes S(u, v) of a hit.
inline double distance_beside(bicubic_patch<double> const& patch, ray<double> const& r, patch_hit const& hit) {
  real3 const d = real3(r.direction) / real(test::norm(r.direction));
  real3 const chord = evaluate_exactly(patch, hit.u, hit.v).s - real3(r.origin);
  return double(bench::length(chord - inner(chord, d) * d));
}

inline hit_verdict judge_hit(test::patch_list const& scene, model_size const& size, accuracy level,
                             ray<double> const& r, std::span<test::oracle_root const> roots, patch_hit const& hit) {
  hit_verdict v;
  double const length = test::norm(r.direction), same = same_root(level, r, size);
  double const margin = level == accuracy::fast ? 1e-5 : 1e-12;
  auto const is_steep = [](test::oracle_root const& root) { return root.is_certain(1e-2, 0); };
  // A root of the hit's own patch, as near as the hit's `error` reaches, is that hit.
  auto const is_nearer = [&](test::oracle_root const& root) {
    double const reach = hit.valid() && root.patch == hit.patch ? std::max(same, double(hit.error)) : same;
    return !((real(hit.t) - root.t) * real(length) <= real(reach));
  };
  for (auto const& root : roots) {
    if (!is_nearer(root)) break;
    bool const is_inside = root.edge_distance > margin * size.diagonal && root.end_distance * length > same;
    if (root.singular || !is_inside) continue;
    v.is_lost = v.is_lost || is_steep(root);
    v.is_lost_grazing = v.is_lost_grazing || (root.cos_angle > 1e-9 && !is_steep(root));
  }
  if (!hit.valid()) return v;
  v.is_number = hit.t - hit.t == 0 && hit.u - hit.u == 0 && hit.v - hit.v == 0;
  auto const apart = [&](test::oracle_root const& root) {
    return (std::abs(root.t - real(hit.t)) - root.slack) * real(length);
  };
  test::oracle_root const* nearest = nullptr;
  for (auto const& root : roots)
    if (!nearest || apart(root) < apart(*nearest) || (apart(root) == apart(*nearest) && root.patch == hit.patch))
      nearest = &root;
  // Where the ray touches the patch its roots say little of where the hit is.
  double const grazing = nearest && nearest->cos_angle > 0 ? std::max(1., 1e-3 / nearest->cos_angle) : 1e3;
  v.is_false = !nearest || !(apart(*nearest) <= real(same * std::min(grazing, 1e3)));
  if (v.is_false) {
    double const epsilon = level == accuracy::fast ? double(std::numeric_limits<float>::epsilon())
                                                   : std::numeric_limits<double>::epsilon();
    double const rounding = 32 * epsilon * (size.diagonal + test::norm(r.origin - size.middle));
    double const beside = distance_beside(scene[std::size_t(hit.patch)], r, hit);
    bool const is_on_edge = hit.u == 0 || hit.u == 1 || hit.v == 0 || hit.v == 1;
    v.is_touch = beside <= rounding;
    v.is_join = !v.is_touch && is_on_edge && beside <= std::min(double(hit.error), widest_join * size.diagonal);
    v.is_false = !v.is_touch && !v.is_join;
    return v;
  }
  for (auto const& root : roots)  // of two patches that share an edge, the hit's own
    if (root.patch == hit.patch && !root.singular && apart(root) <= real(same)) nearest = &root;
  if (nearest->singular || nearest->patch != hit.patch) return v;
  auto const& patch = scene[std::size_t(hit.patch)];
  real3 const at = evaluate_exactly(patch, hit.u, hit.v).s, truth = evaluate_exactly(patch, nearest->u, nearest->v).s;
  v.error = double(bench::length(at - truth));
  double const reach = size.patch_diagonals[std::size_t(hit.patch)] + std::fabs(hit.t) * length;
  if (nearest->edge_distance >= 0) v.ulps = *v.error / (std::numeric_limits<double>::epsilon() * reach);
  v.cosine = nearest->cos_angle;
  return v;
}

/// Whether the ray meets the patch of a hit on an edge a little beyond that edge, within the hit's error: no farther out
/// than joined edges may be apart.
inline bool meets_beyond_edge(test::oracle const& truth, model_size const& size, ray<double> const& r,
                              patch_hit const& hit) {
  if (!(hit.u == 0 || hit.u == 1 || hit.v == 0 || hit.v == 1)) return false;
  double const reach = std::min(double(hit.error), widest_join * size.diagonal);
  for (auto const& root : truth.all_hits(test::numbers_of(r), 1e-5))
    if (root.patch == hit.patch && !root.singular && root.edge_distance >= -reach &&
        std::abs(root.t - real(hit.t)) * real(test::norm(r.direction)) <= real(hit.error))
      return true;
  return false;
}

}  // namespace patchrt::bench
