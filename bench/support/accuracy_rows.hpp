// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What bench/accuracy says: errors as quantiles, a table, a CSV file, and what no other choice beats in both time and error.

#include "round_robin.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>

namespace patchrt::bench {

/// Errors of one method on one workload, and what has none.
struct error_list {
  std::vector<double> diagonals;  ///< of the model
  std::vector<double> ulps;       ///< epsilons of double times (the patch's diagonal + distance)
  std::size_t lost = 0, false_hits = 0, not_numbers = 0;
};

/// The least value that a share `q` of all does not exceed; 0 where there is none.
inline double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  auto const at = std::min(values.size() - 1, std::size_t(q * double(values.size())));
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(at), values.end());
  return values[at];
}

struct accuracy_row {
  std::string study;     ///< levels, depth, steps, ...: what is compared with what
  std::string workload;  ///< the rays
  std::string method, number, value;
  std::size_t items;  ///< that are timed together
  error_list errors;
  contender timed;

  double nanoseconds() const { return 1e9 * median_seconds(timed) / double(items); }
};

/// Times all rows of each study and workload against each other.
inline void time_rows(std::span<accuracy_row> rows, int rounds) {
  for (auto& r : rows) r.timed.run();
  for (int k = 0; k < rounds; ++k)
    for (auto& r : rows) r.timed.seconds.push_back(thread_seconds(r.timed.run));
}

inline void print_rows(std::span<accuracy_row const> rows) {
  std::string last;
  for (auto const& r : rows) {
    if (std::string const title = r.study + ", " + r.workload; title != last) {
      std::printf("\n%s: errors as p50, p99.9, max\n%-28s %-16s %-12s %9s %6s %28s %28s %5s %5s %4s\n", title.c_str(),
                  "method", "number", "value", "ns", "n", "model diagonals", "ulps of double", "lost", "false", "NaN");
      last = title;
    }
    auto const& e = r.errors;
    std::printf("%-28s %-16s %-12s %9.1f %6zu %9.2g %9.2g %9.2g %9.2g %9.2g %9.2g %5zu %5zu %4zu\n", r.method.c_str(),
                r.number.c_str(), r.value.c_str(), r.nanoseconds(), e.diagonals.size(), quantile(e.diagonals, 0.5),
                quantile(e.diagonals, 0.999), quantile(e.diagonals, 1), quantile(e.ulps, 0.5), quantile(e.ulps, 0.999),
                quantile(e.ulps, 1), e.lost, e.false_hits, e.not_numbers);
  }
}

/// Of the rows whose study is one of `studies`, by time: those that no other equals or beats in time, p99.9 of errors, and number
/// of lost roots and false hits at once.
inline void print_front(std::span<accuracy_row const> rows, std::string const& workload,
                        std::span<std::string const> studies, char const* unit) {
  struct point {
    accuracy_row const* row;
    double time, error;
    std::size_t wrong;
  };
  std::vector<point> points;
  for (auto const& r : rows)
    if (r.workload == workload && !r.errors.diagonals.empty() &&
        std::find(studies.begin(), studies.end(), r.study) != studies.end())
      points.push_back({&r, r.nanoseconds(), quantile(r.errors.diagonals, 0.999),
                        r.errors.lost + r.errors.false_hits + r.errors.not_numbers});
  std::sort(points.begin(), points.end(), [](auto const& a, auto const& b) { return a.time < b.time; });
  std::printf("\nPareto front, %s: ns %s, p99.9 of errors in diagonals\n", workload.c_str(), unit);
  for (auto p = points.begin(); p != points.end(); ++p) {
    auto const is_better = [p](point const& q) { return q.error <= p->error && q.wrong <= p->wrong; };
    if (std::any_of(points.begin(), p, is_better)) continue;
    auto const& r = *p->row;
    std::printf("  %9.1f %9.2g  %s%s%s%s%s (lost %zu, false %zu)\n", p->time, p->error, r.method.c_str(),
                r.number.empty() ? "" : ", ", r.number.c_str(), r.value.empty() ? "" : ", ", r.value.c_str(),
                r.errors.lost, r.errors.false_hits);
  }
}

inline void write_rows(std::span<accuracy_row const> rows, std::filesystem::path const& file) {
  std::ofstream out(file);
  out << "study,workload,method,number,value,ns,n,p50,p999,max,p50_ulp,p999_ulp,max_ulp,lost,false,nan\n";
  for (auto const& r : rows) {
    auto const& e = r.errors;
    for (auto const& text : {r.study, r.workload, r.method, r.number, r.value}) out << '"' << text << "\",";
    out << r.nanoseconds() << ',' << e.diagonals.size();
    for (auto const* values : {&e.diagonals, &e.ulps})
      for (double q : {0.5, 0.999, 1.}) out << ',' << quantile(*values, q);
    out << ',' << e.lost << ',' << e.false_hits << ',' << e.not_numbers << '\n';
  }
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

}  // namespace patchrt::bench
