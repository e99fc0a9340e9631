// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Where the patches of a model meet, and rays that cannot pass there: what cracks are looked for with.

#include "support/rays.hpp"

#include <algorithm>
#include <array>
#include <span>

namespace patchrt::bench {

/// An edge of a patch: u = 0, u = 1, v = 0, v = 1 for `side` 0 to 3.
struct patch_edge {
  std::size_t patch;
  int side;
};

/// The point of an edge at s in [0, 1] with the tangents along the edge and into the patch.
struct edge_point {
  vec3<double> position, along, inward;
};
inline edge_point point_of(test::patch_list const& scene, patch_edge const& e, double s) {
  double const end = e.side & 1;
  auto const p = e.side < 2 ? evaluate(scene[e.patch], end, s) : evaluate(scene[e.patch], s, end);
  double const in = e.side & 1 ? -1 : 1;
  return e.side < 2 ? edge_point{p.position, p.dv, p.du * in} : edge_point{p.position, p.du, p.dv * in};
}

/// Two edges that are one curve; in the second it runs the other way where `reversed`.
struct shared_edge {
  patch_edge first, second;
  bool reversed;
};

/// Where patches meet. All edges that meet in a corner listed here are shared: there are patches all around it.
struct seams {
  std::vector<shared_edge> edges;
  std::vector<std::vector<std::pair<std::size_t, int>>> corners;  ///< (patch, 2 u + v)
};

/// Calls f(i, j) for all i < j whose points are within `reach`.
template <class F> void for_neighbours(std::vector<vec3<double>> const& points, double reach, F&& f) {
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](auto a, auto b) { return points[a].x < points[b].x; });
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t k = i + 1; k < order.size() && points[order[k]].x - points[order[i]].x <= reach; ++k)
      if (test::norm(points[order[k]] - points[order[i]]) <= reach)
        f(std::min(order[i], order[k]), std::max(order[i], order[k]));
}

/// Edges whose control points are the same within `gap`, and corners that only such edges meet in.
inline seams find_seams(test::patch_list const& scene, double gap) {
  std::vector<patch_edge> edges;
  std::vector<std::array<vec3<double>, 4>> nets;
  std::vector<vec3<double>> middles, corners;
  for (std::size_t p = 0; p < scene.size(); ++p) {
    for (int side = 0; side < 4; ++side) {
      edges.push_back({p, side});
      auto& net = nets.emplace_back();
      for (int k = 0; k < 4; ++k) net[std::size_t(k)] = side < 2 ? scene[p](3 * side, k) : scene[p](k, 3 * (side - 2));
      middles.push_back(point_of(scene, edges.back(), 0.5).position);
    }
    for (int c = 0; c < 4; ++c) corners.push_back(scene[p](3 * (c / 2), 3 * (c % 2)));
  }
  seams found;
  std::vector<bool> is_shared(edges.size());
  for_neighbours(middles, gap, [&](std::size_t i, std::size_t j) {
    double forward = 0, backward = 0, length = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      forward = std::max(forward, test::norm(nets[i][k] - nets[j][k]));
      backward = std::max(backward, test::norm(nets[i][k] - nets[j][3 - k]));
      length = std::max(length, test::norm(nets[i][k] - nets[i][0]));
    }
    if (std::min(forward, backward) > gap || length < 1e3 * gap) return;
    found.edges.push_back({edges[i], edges[j], backward < forward});
    is_shared[i] = is_shared[j] = true;
  });
  std::vector<std::vector<std::size_t>> near(corners.size());
  for_neighbours(corners, gap, [&](std::size_t i, std::size_t j) {
    near[i].push_back(j);
    near[j].push_back(i);
  });
  for (std::size_t i = 0; i < corners.size(); ++i) {
    auto const is_inside = [&](std::size_t c) {
      return is_shared[c / 4 * 4 + c % 4 / 2] && is_shared[c / 4 * 4 + 2 + c % 2];
    };
    bool is_inner = is_inside(i) && !near[i].empty();
    std::vector<std::pair<std::size_t, int>> around{{i / 4, int(i % 4)}};
    for (std::size_t j : near[i]) {
      is_inner = is_inner && i < j && is_inside(j);
      around.emplace_back(j / 4, int(j % 4));
    }
    if (is_inner) found.corners.push_back(around);
  }
  return found;
}

/// Rays of unit direction that cross the model where patches meet, at t = `aimed_at`: every one has a hit there or nearer.
struct crossing_rays {
  test::ray_list rays;
  std::vector<double> aimed_at;
};

/// Half of the rays at points of shared edges, half at inner corners (where there are any), from all sides, from as near as a
/// hundredth of the model's radius to beyond it. Edges and corners that the ray may pass without meeting a patch, as at a
/// silhouette, are not aimed at.
template <class Generator>
crossing_rays rays_at_seams(test::patch_list const& scene, seams const& where, std::size_t count, Generator& g) {
  double const radius = test::ball_of(scene).radius;
  crossing_rays c;
  auto const add = [&](vec3<double> const& aim, vec3<double> const& d) {
    double const distance = radius * std::pow(10, test::uniform(g, -2, 0.5));
    c.rays.push_back({aim - d * distance, d, 0, test::no_limit});
    c.aimed_at.push_back(distance);
  };
  auto const turned = [](vec3<double> const& a, vec3<double> const& b) {
    double const size = test::norm(a) * test::norm(b);
    return size > 0 ? dot(a, b) / size : 0;
  };
  for (std::size_t tries = 0; c.rays.size() < count && tries < 1000 * count; ++tries) {
    vec3<double> const d = test::random_direction(g);
    if (tries % 2 == 0 && !where.corners.empty()) {
      auto const& around = where.corners[g() % where.corners.size()];
      vec3<double> first(0.0), aim(0.0);
      bool is_smooth = true;
      for (auto const& [patch, corner] : around) {
        auto const p = evaluate(scene[patch], double(corner / 2), double(corner % 2));
        vec3<double> const n = cross(p.du, p.dv);
        if (first == vec3<double>(0.0)) first = n, aim = p.position;
        is_smooth = is_smooth && std::fabs(turned(n, first)) > 0.99 && std::fabs(turned(n, d)) > 0.1;
      }
      if (is_smooth) add(aim, d);
    } else if (!where.edges.empty()) {
      auto const& e = where.edges[g() % where.edges.size()];
      double const s = test::uniform(g);
      edge_point const a = point_of(scene, e.first, s), b = point_of(scene, e.second, e.reversed ? 1 - s : s);
      vec3<double> const across = cross(d, a.along);
      double const to_a = turned(across, a.inward), to_b = turned(across, b.inward);
      bool const is_steep = test::norm(across) > 0.05 * test::norm(a.along);
      if (is_steep && std::min(to_a, to_b) < -0.05 && std::max(to_a, to_b) > 0.05) add(a.position, d);
    }
  }
  return c;
}

}  // namespace patchrt::bench
