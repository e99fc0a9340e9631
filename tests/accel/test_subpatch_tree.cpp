// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/patches.hpp"

#include <patchrt/accel/build_subpatch_tree.hpp>

using namespace patchrt;
using namespace patchrt::test;

TEST_CASE(
    "boxes of sub-patches contain a million of their points, and the walk visits each leaf once, near child first") {
  unsigned const seed = 41;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> d(-1, 1);
  std::size_t outside = 0, misordered = 0;
  for (int k = 0; k < 108; ++k) {
    int const depth = k % (max_subpatch_depth + 1);
    bicubic_patch<double> p = k % 2 ? random_patch<double>(g) : random_sheet(g, 0.2);
    double const flatten = k % 3 == 1 ? 0 : k % 3 == 2 ? 1e-4 : 1, scale = k % 5 == 0 ? 1e-6 : 1;
    bicubic_patch<float> net;
    for (int i = 0; i < 16; ++i) {
      p.control_points[i] *= scale;
      p.control_points[i].z *= flatten;
      net.control_points[i] = vec3<float>(p.control_points[i]);
    }
    std::vector<subpatch_node> nodes(subpatch_node_count(depth));
    std::vector<subpatch_leaf> leaves(subpatch_leaf_count(depth));
    auto const tree = build_subpatch_tree(net, alternating_splits(depth), 0, nodes, leaves);
    for (std::uint32_t node = 1; node <= nodes.size(); ++node) {
      auto const cell = subpatch_cell(tree, node);
      int const points = int(10000 / nodes.size()) + 1;
      for (int n = 0; n < points; ++n) {
        double const x = cell.x + cell.half_x * d(g), y = cell.y + cell.half_y * d(g);
        auto const q = evaluate(p, 0.5 * x + 0.5, 0.5 * y + 0.5).position;
        for (int c = 0; c < 3; ++c) {
          double const at = (q[c] - tree.grid_origin[c]) / tree.grid_step[c];
          outside += !(nodes[node - 1].lo[c] <= at && at <= nodes[node - 1].hi[c]);
        }
      }
    }
    for (unsigned octant = 0; octant < 8; ++octant) {
      std::vector<int> visits(leaves.size()), seen(nodes.size() + 1);
      auto const mark = [&](std::uint32_t node) {
        bool const second_first = nodes[node / 2 - 1].second_first >> octant & 1u;
        if ((node & 1u) == second_first) misordered += seen[node ^ 1u] != 0;
        ++seen[node];
      };
      traverse(
          tree, nodes.data(), octant,
          [&](subpatch_node const& n) {
            mark(static_cast<std::uint32_t>(&n - nodes.data()) + 1);
            return true;
          },
          [&](std::uint32_t node, std::uint32_t index) {
            misordered += node != index + leaves.size();
            ++visits[index];
          });
      for (int n : visits) misordered += n != 1;
    }
  }
  CHECK(outside == 0);
  CHECK(misordered == 0);
}
