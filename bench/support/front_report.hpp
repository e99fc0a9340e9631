// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What bench/front says: a table of all methods, a CSV file, and how the targets were met.

#include "judge.hpp"
#include "round_robin.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <span>
#include <stdexcept>

namespace patchrt::bench {

/// A method on its model: `name` is an accuracy level, "triangles" or "grid"; n is 0 for methods without a
/// tessellation.
struct method {
  std::string name;
  int n;
  double build_seconds;
  std::size_t bytes;
  std::size_t peak_bytes;
};

/// One method on one workload by one variant: which structures or calls it uses.
struct measurement {
  std::size_t method;
  std::size_t workload;
  std::string variant;
  std::size_t contender;
};

struct front_report {
  std::string model;
  std::size_t patches;
  std::size_t hierarchy_bytes = 0;
  double depth_6_build_seconds = 0;
  std::vector<std::string> workload_names{};
  std::vector<std::size_t> workload_rays{};
  std::vector<method> methods{};
  std::vector<std::vector<verdict>> verdicts{};  ///< [workload][method]
  std::vector<measurement> measurements{};
  std::vector<contender> contenders{};

  double mrays_per_s(measurement const& m) const {
    return 1e-6 * double(workload_rays[m.workload]) / median_seconds(contenders[m.contender]);
  }

  measurement const* find(std::string const& name, int n, std::size_t workload, std::string const& variant) const {
    for (auto const& m : measurements)
      if (methods[m.method].name == name && methods[m.method].n == n && m.workload == workload && m.variant == variant)
        return &m;
    return nullptr;
  }

  /// The fastest of the given variants.
  measurement const* best(std::string const& name, int n, std::size_t workload,
                          std::span<std::string const> variants) const {
    measurement const* fastest = nullptr;
    for (auto const& v : variants)
      if (auto const* m = find(name, n, workload, v); m && (!fastest || mrays_per_s(*m) > mrays_per_s(*fastest)))
        fastest = m;
    return fastest;
  }
};

inline void print_table(front_report const& r, std::span<std::string const> variants) {
  for (std::size_t w = 0; w < r.workload_names.size(); ++w) {
    std::printf("\n%s: %zu rays. Mrays/s by variant; errors in bounding-box diagonals.\n", r.workload_names[w].c_str(),
                r.workload_rays[w]);
    std::printf("%-10s %4s %9s %9s", "method", "N", "build s", "MiB");
    for (auto const& v : variants) std::printf(" %10s", v.c_str());
    std::printf(" %9s %9s %9s %9s %8s\n", "RMS", "max", "t RMS", "t max", "wrong");
    for (std::size_t k = 0; k < r.methods.size(); ++k) {
      method const& m = r.methods[k];
      verdict const& v = r.verdicts[w][k];
      std::printf("%-10s %4s %9.4f %9.3f", m.name.c_str(), m.n ? std::to_string(m.n).c_str() : "-", m.build_seconds,
                  double(m.bytes) / 1048576);
      for (auto const& variant : variants) {
        auto const* const found = r.find(m.name, m.n, w, variant);
        if (found) std::printf(" %10.2f", r.mrays_per_s(*found));
        else std::printf(" %10s", "-");
      }
      std::printf(" %9.2e %9.2e %9.2e %9.2e %8zu\n", v.surface_rms, v.surface_max, v.along_ray_rms, v.along_ray_max,
                  v.wrong);
    }
  }
}

inline void write_csv(front_report const& r, std::filesystem::path const& file) {
  std::ofstream out(file);
  out << "model,patches,workload,method,n,variant,rays,hits,rounds,seconds,seconds_min,seconds_max,mrays_per_s,"
         "build_seconds,bytes,peak_bytes,surface_rms,surface_max,along_ray_rms,along_ray_max,wrong\n";
  for (auto const& m : r.measurements) {
    method const& how = r.methods[m.method];
    verdict const& v = r.verdicts[m.workload][m.method];
    auto const& seconds = r.contenders[m.contender].seconds;
    auto const [least, most] = std::minmax_element(seconds.begin(), seconds.end());
    out << r.model << ',' << r.patches << ',' << r.workload_names[m.workload] << ',' << how.name << ',' << how.n << ','
        << m.variant << ',' << r.workload_rays[m.workload] << ',' << v.hits << ',' << seconds.size() << ','
        << median(seconds) << ',' << *least << ',' << *most << ',' << r.mrays_per_s(m) << ',' << how.build_seconds
        << ',' << how.bytes << ',' << how.peak_bytes << ',' << v.surface_rms << ',' << v.surface_max << ','
        << v.along_ray_rms << ',' << v.along_ray_max << ',' << v.wrong << '\n';
  }
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

/// A figure to reach: `value` at least (or, with `at_most`, at most) `wanted`. No value: it was not measured in this
/// run.
struct target {
  std::string what;
  std::optional<double> value;
  double wanted;
  bool at_most = false;
};

/// The speed targets hold only where the answers are no worse than those they are compared with.
inline std::vector<target> targets(front_report const& r) {
  std::vector<std::string> const patches{"float"}, prepared{"1", "8", "16"}, single{"1"};
  auto const ratio = [&r](measurement const* a, measurement const* b) {
    return a && b ? std::optional(speed_ratio(r.contenders[a->contender], r.contenders[b->contender])) : std::nullopt;
  };
  std::vector<target> all;
  auto const against = [&](std::size_t w, char const* mesh, int n, std::span<std::string const> variants,
                           double wanted) {
    auto const *const ours = r.best("refined", 0, w, patches), *const theirs = r.best(mesh, n, w, variants);
    std::string const cells = std::string(mesh) + " N=" + std::to_string(n), name = r.workload_names[w] + ": refined ";
    all.push_back({name + "against rtcIntersect" + (theirs ? theirs->variant : "") + " on " + cells + ", times as fast",
                   ratio(ours, theirs), wanted});
    if (!ours || !theirs) return;
    verdict const &v = r.verdicts[w][ours->method], &mesh_v = r.verdicts[w][theirs->method];
    all.push_back({name + "RMS error over that of " + cells, v.surface_rms / mesh_v.surface_rms, 1, true});
    all.push_back({name + "wrong rays, against those of " + cells, double(v.wrong), double(mesh_v.wrong), true});
  };
  if (r.model.starts_with("teapot")) {
    against(0, "triangles", 64, prepared, 1.2);
    against(0, "grid", 256, prepared, 3);
    against(1, "triangles", 64, single, 1.5);
  } else if (r.model.starts_with("bigguy")) {
    against(0, "grid", 32, prepared, 2);
    against(1, "grid", 32, single, 1.2);
  }
  all.push_back({"coherent: time of refined over that of fast",
                 ratio(r.best("fast", 0, 0, patches), r.best("refined", 0, 0, patches)), 1.2, true});
  all.push_back({"KiB of hierarchy per patch", double(r.hierarchy_bytes) / 1024 / double(r.patches), 1, true});
  all.push_back({"build at depth 6, one thread, microseconds per patch",
                 1e6 * r.depth_6_build_seconds / double(r.patches), 10, true});
  return all;
}

inline void print_targets(std::span<target const> targets) {
  std::printf("\ntargets\n");
  for (auto const& t : targets) {
    std::printf("  %-88s ", t.what.c_str());
    if (!t.value) std::printf("not measured\n");
    else
      std::printf("%8.3f  wanted %s %g  %s\n", *t.value, t.at_most ? "<=" : ">=", t.wanted,
                  (t.at_most ? *t.value <= t.wanted : *t.value >= t.wanted) ? "PASS" : "SHORT");
  }
}

}  // namespace patchrt::bench
