// SPDX-License-Identifier: MIT
#pragma once

#include "exact_surface.hpp"

#include <cstdint>

namespace patchrt::bench {

/// Vertices of a model cut uniformly into n x n cells a patch: (n + 1)^2 a patch, rounded to float, v running fastest.
struct tessellation {
  int n;
  std::vector<vec3<float>> vertices;

  tessellation(std::span<bicubic_patch<double> const> patches, int cells) : n(cells) {
    std::size_t const edge = std::size_t(n) + 1;
    vertices.reserve(patches.size() * edge * edge);
    for (auto const& p : patches)
      for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) vertices.emplace_back(evaluate(p, double(i) / n, double(j) / n).position);
  }
};

}  // namespace patchrt::bench
