// SPDX-License-Identifier: MIT
#pragma once

#include "resultant_oracle.hpp"
#include "support/catch.hpp"

#include <patchrt/roots/isolate.hpp>

#include <random>

namespace patchrt::test {

/// A float, a point interval, or a sum of two words.
template <class T> precise as_precise(T const& x) {
  if constexpr (std::floating_point<T>) return precise(x);
  else if constexpr (enclosure<T>::is_interval) return precise(x.lo);
  else return precise(x.hi) + precise(x.lo);
}

template <class T> bool holds(isolated_root<T> const& box, precise const& u, precise const& v) {
  return abs(u - as_precise(box.u)) <= precise(box.radius_u) && abs(v - as_precise(box.v)) <= precise(box.radius_v);
}

/// Coefficients uniform in [-1, 1].
template <class T, int M, int N> bernstein_pair<T, M, N> random_pair(std::mt19937& generator, T error) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  bernstein_pair<T, M, N> p;
  for (T& x : p.f) x = T(uniform(generator));
  for (T& x : p.g) x = T(uniform(generator));
  p.error_f = p.error_g = error;
  return p;
}

/// What became of the roots of one pair.
struct tally {
  int inside = 0;   ///< roots in the domain
  int simple = 0;   ///< of these, in a box that says so
  int covered = 0;  ///< in another box
  int lost = 0;
  int twice = 0;    ///< in two simple boxes
  int wrong = 0;    ///< simple boxes without a root or with two
  int claimed = 0;  ///< simple boxes
  bool is_right() const { return lost == 0 && twice == 0 && wrong == 0; }
  tally& operator+=(tally const& o) {
    inside += o.inside, simple += o.simple, covered += o.covered, lost += o.lost, twice += o.twice, wrong += o.wrong;
    claimed += o.claimed;
    return *this;
  }
};

/// Holds boxes against all roots in and around the domain.
template <class T, int C>
tally compare(isolation<T, C> const& found, std::vector<precise_root> const& roots,
              parameter_box<real_t<T>> const& domain) {
  tally t;
  for (precise_root const& r : roots) {
    bool const is_inside = domain.u_low <= r.u && r.u <= domain.u_high && domain.v_low <= r.v && r.v <= domain.v_high;
    int simple = 0, other = 0;
    for (int k = 0; k < found.count; ++k) {
      if (holds(found.roots[k], r.u, r.v)) ++(found.roots[k].kind == root_kind::simple ? simple : other);
    }
    t.twice += simple > 1;
    if (!is_inside) continue;
    ++t.inside;
    t.simple += simple == 1;
    t.covered += simple == 0 && other > 0;
    t.lost += simple + other == 0;
  }
  for (int k = 0; k < found.count; ++k) {
    isolated_root<T> const& box = found.roots[k];
    if (box.kind != root_kind::simple) continue;
    ++t.claimed;
    int held = 0;
    for (precise_root const& r : roots) {
      if (!holds(box, r.u, r.v)) continue;
      ++held;
      bool const is_outside =
          !(domain.u_low <= r.u && r.u <= domain.u_high && domain.v_low <= r.v && r.v <= domain.v_high);
      t.wrong += is_outside && !box.on_border;
    }
    t.wrong += held != 1;
  }
  return t;
}

}  // namespace patchrt::test
