// SPDX-License-Identifier: MIT
#pragma once

#include "cpu_clock.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

namespace patchrt::bench {

/// One of the things that are timed against each other, with the thread seconds of each round.
struct contender {
  std::string name;
  std::function<void()> run;
  std::vector<double> seconds{};
};

inline double median(std::vector<double> values) {
  auto const middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

inline double median_seconds(contender const& c) { return median(c.seconds); }

/// Median over the rounds of how many times faster a is than b: what a machine that slows down and speeds up leaves
/// intact.
inline double speed_ratio(contender const& a, contender const& b) {
  std::vector<double> ratios;
  for (std::size_t k = 0; k < a.seconds.size(); ++k) ratios.push_back(b.seconds[k] / a.seconds[k]);
  return median(ratios);
}

/// Runs all in turn, `rounds` times after one round that is not counted.
inline void run_round_robin(std::vector<contender>& all, int rounds) {
  for (auto& c : all) c.run();
  for (int round = 0; round < rounds; ++round)
    for (auto& c : all) c.seconds.push_back(thread_seconds(c.run));
}

}  // namespace patchrt::bench
