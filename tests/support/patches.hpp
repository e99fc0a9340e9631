// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Patches for tests: read from .bpt files by a reader of the tests' own, or at random.

#include "support/oracle.hpp"

#include <patchrt/shapes/bezier_patch.hpp>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <random>
#include <stdexcept>
#include <vector>

namespace patchrt::test {

template <class T> T norm(vec3<T> const& a) { return std::sqrt(dot(a, a)); }

/// Bicubic patches of a well-formed file.
inline std::vector<oracle_patch> read_patches(std::filesystem::path const& path) {
  std::ifstream in(path);
  std::size_t count = 0;
  in >> count;
  std::vector<oracle_patch> patches(in ? count : 0);
  for (oracle_patch& p : patches) {
    int m = 0, n = 0;
    in >> m >> n;
    for (double& x : p) in >> x;
  }
  if (!in || patches.empty()) throw std::runtime_error("no patches in " + path.string());
  return patches;
}

template <class T> bicubic_patch<T> make_patch(oracle_patch const& numbers) {
  bicubic_patch<T> p;
  for (std::size_t k = 0; k < 16; ++k) {
    p.control_points[k] = vec3<T>{T(numbers[3 * k]), T(numbers[3 * k + 1]), T(numbers[3 * k + 2])};
  }
  return p;
}

inline oracle_patch numbers_of(bicubic_patch<double> const& p) {
  oracle_patch n;
  for (std::size_t k = 0; k < 16; ++k) {
    n[3 * k] = p.control_points[k].x;
    n[3 * k + 1] = p.control_points[k].y;
    n[3 * k + 2] = p.control_points[k].z;
  }
  return n;
}

/// Control points anywhere in [-1, 1]^3: folds, self-intersections and all.
template <class T, int M = 3, int N = 3, class Generator> bezier_patch<T, M, N> random_patch(Generator& g) {
  std::uniform_real_distribution<double> d(-1, 1);
  bezier_patch<T, M, N> p;
  for (auto& c : p.control_points) {
    c.x = T(d(g));
    c.y = T(d(g));
    c.z = T(d(g));
  }
  return p;
}

/// A bent sheet over [0, 1]^2, bumps of height `rough` on it: what models are made of.
template <class Generator> bicubic_patch<double> random_sheet(Generator& g, double rough) {
  std::uniform_real_distribution<double> d(-1, 1);
  bicubic_patch<double> p;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      p(i, j).x = i / 3. + 0.2 * rough * d(g);
      p(i, j).y = j / 3. + 0.2 * rough * d(g);
      p(i, j).z = rough * d(g);
    }
  }
  return p;
}

}  // namespace patchrt::test
