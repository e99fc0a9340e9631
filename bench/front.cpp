// SPDX-License-Identifier: MIT
/// \file
/// Accuracy, time and memory of tracing exact patches against Embree on the tessellated model: one program, one
/// thread, one run, the same rays. See docs/PERFORMANCE.md for what is timed and how.

#include "support/front_report.hpp"
#include "support/workload.hpp"
#if PATCHRT_HAVE_EMBREE
#  include "support/embree_rays.hpp"
#endif

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include "../examples/support/model.hpp"

#include <CLI/CLI.hpp>

#include <memory>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

struct settings {
  std::string model = "data/teapot.bpt";
  std::string csv;
  int size = 1024;
  double coverage = 0.2;
  std::vector<double> direction{0.4, -1, 0.5}, up{0, 0, 1}, eye, look_at;
  double vfov = 40;
  std::vector<int> triangles{8, 16, 32, 64, 128, 256}, grids{8, 16, 32, 64, 128, 256};
  std::string embree_config = "threads=1";
  std::string build_quality = "high";
  double memory_limit = 2;
  int depth = -1;
  int rounds = 7;
  std::uint64_t seed = 1;
};

settings parse(int argc, char** argv) {
  settings s;
  CLI::App app{"Accuracy, time and memory of tracing exact patches against Embree on the tessellated model"};
  app.add_option("--model", s.model, "patches (.bpt)")->capture_default_str();
  app.add_option("--csv", s.csv, "file for all figures");
  app.add_option("--size", s.size, "pixels per side, a multiple of 4")
      ->check(CLI::Range(4, 16384))
      ->capture_default_str();
  app.add_option("--coverage", s.coverage, "share of pixels to hit")
      ->check(CLI::Range(0.001, 0.9))
      ->capture_default_str();
  auto const vector = [&](char const* name, std::vector<double>& to, char const* help) {
    app.add_option(name, to, help)->delimiter(',')->expected(3);
  };
  vector("--direction", s.direction, "from the model's middle to the eye");
  vector("--up", s.up, "the camera's upward direction");
  vector("--eye", s.eye, "the eye, in place of --direction and --coverage");
  vector("--look-at", s.look_at, "what the eye looks at");
  app.add_option("--vfov", s.vfov, "vertical field of view in degrees")
      ->check(CLI::Range(1., 170.))
      ->capture_default_str();
  app.add_option("--triangles", s.triangles, "cells per patch edge, as triangles")
      ->delimiter(',')
      ->check(CLI::Range(1, 4096));
  app.add_option("--grids", s.grids, "cells per patch edge, as grids")->delimiter(',')->check(CLI::Range(1, 4096));
  app.add_option("--embree-config", s.embree_config, "passed to rtcNewDevice")->capture_default_str();
  app.add_option("--embree-quality", s.build_quality, "of Embree's builds: high (spatial splits) or medium")
      ->check(CLI::IsMember({"high", "medium"}))
      ->capture_default_str();
  app.add_option("--memory-limit", s.memory_limit, "GiB; tessellations that would exceed it are left out")
      ->capture_default_str();
  app.add_option("--depth", s.depth, "of every patch's tree of sub-patches; -1: by its shape")
      ->check(CLI::Range(-1, max_subpatch_depth))
      ->capture_default_str();
  app.add_option("--rounds", s.rounds, "timed runs of each")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--seed", s.seed, "of the bounce directions")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (CLI::ParseError const& e) {
    std::exit(app.exit(e));
  }
  if (s.size % 4 != 0) throw std::runtime_error("--size: expected a multiple of 4, got " + std::to_string(s.size));
  if (s.eye.empty() != s.look_at.empty()) throw std::runtime_error("--eye and --look-at go together");
  return s;
}

vec3<double> to_vec3(std::vector<double> const& v) { return {v[0], v[1], v[2]}; }

struct workload {
  std::string name;
  query what = query::nearest;
  std::vector<ray<double>> rays;  // each of its numbers is a float
  std::vector<ray<float>> float_rays;
  std::vector<answer> reference;
};

/// `rays` rounded to float: everyone traces the very same rays.
workload make_workload(std::string name, std::span<bicubic_patch<double> const> patches,
                       std::span<ray<double> const> rays) {
  workload w{std::move(name), query::nearest, {}, {}, {}};
  for (auto const& r : rays) {
    ray<float> const f{vec3<float>(r.origin), vec3<float>(r.direction), float(r.t_min), float(r.t_max)};
    w.float_rays.push_back(f);
    w.rays.push_back({vec3<double>(f.origin), vec3<double>(f.direction), f.t_min, f.t_max});
  }
  w.reference = reference_answers(patches, w.rays);
  return w;
}

std::vector<workload> make_workloads(settings const& s, std::span<bicubic_patch<double> const> patches,
                                     double diagonal) {
  camera const c = s.eye.empty() ? frame(patches, to_vec3(s.direction), to_vec3(s.up), s.vfov, s.coverage)
                                 : camera{to_vec3(s.eye), to_vec3(s.look_at), to_vec3(s.up), s.vfov};
  std::vector<workload> all;
  all.push_back(make_workload("coherent", patches, primary_rays(c, s.size, s.size)));
  auto const bounced = bounce_rays(patches, all[0].rays, all[0].reference, 1e-4 * diagonal, s.seed);
  if (bounced.empty()) throw std::runtime_error("the camera sees nothing of the model");
  all.push_back(make_workload("bounce", patches, bounced));
  all.push_back(all[1]);
  all[2].name = "any hit";
  all[2].what = query::any;
  std::printf("camera: --eye %.17g,%.17g,%.17g --look-at %.17g,%.17g,%.17g --up %g,%g,%g --vfov %g\n", c.eye.x, c.eye.y,
              c.eye.z, c.look_at.x, c.look_at.y, c.look_at.z, c.up.x, c.up.y, c.up.z, c.vfov_degrees);
  for (auto const& w : all)
    std::printf("%s: %zu rays, %.2f %% hit\n", w.name.c_str(), w.rays.size(),
                100 * double(count_hits(w.reference)) / double(w.rays.size()));
  return all;
}

/// Gathers methods: each is judged when it is added and timed in turn with the others later.
class front {
 public:
  front(settings const& s, std::span<bicubic_patch<double> const> patches, double diagonal,
        std::span<workload const> workloads)
      : settings_(s),
        patches_(patches),
        diagonal_(diagonal),
        workloads_(workloads),
        surface_(patches),
        report_{std::filesystem::path(s.model).stem().string(), patches.size()} {
    for (auto const& w : workloads) {
      report_.workload_names.push_back(w.name);
      report_.workload_rays.push_back(w.rays.size());
    }
    report_.verdicts.resize(workloads.size());
  }

  void add_patches() {
    mixed_hierarchy_options options;
    options.depth = settings_.depth;
    double const seconds = build_seconds(options);
    hierarchy_ = build_mixed_hierarchy(patches_, options, serial{});
    report_.hierarchy_bytes = hierarchy_.hierarchy_bytes();
    add_level<accuracy::fast>("fast", seconds);
    add_level<accuracy::refined>("refined", seconds);
    add_level<accuracy::certified>("certified", seconds);
    add_level<accuracy::reference>("reference", seconds);
    options.depth = 6;
    report_.depth_6_build_seconds = build_seconds(options);
  }

#if PATCHRT_HAVE_EMBREE
  void add_tessellations() {
    for (auto const& w : workloads_) packets_.push_back(std::make_unique<packets>(w));
    for (auto const kind : {mesh_kind::triangles, mesh_kind::grids})
      for (int const n : kind == mesh_kind::triangles ? settings_.triangles : settings_.grids)
        add_tessellation(kind, n);
  }
#endif

  front_report& run() {
    run_round_robin(report_.contenders, settings_.rounds);
    return report_;
  }

 private:
  /// Median of some builds in this thread, which for few patches are short.
  double build_seconds(mixed_hierarchy_options const& options) const {
    std::vector<double> seconds;
    for (int k = 0; k < 9; ++k)
      seconds.push_back(thread_seconds([&] { return build_mixed_hierarchy(patches_, options, serial{}); }));
    return median(seconds);
  }
  std::size_t add_method(method m) {
    report_.methods.push_back(std::move(m));
    return report_.methods.size() - 1;
  }
  void add_verdict(std::size_t w, std::span<answer const> answers) {
    report_.verdicts[w].push_back(
        judge(surface_, diagonal_, workloads_[w].what, workloads_[w].rays, workloads_[w].reference, answers));
  }
  void add_contender(std::size_t m, std::size_t w, std::string variant, std::function<void()> run) {
    report_.measurements.push_back({m, w, variant, report_.contenders.size()});
    report_.contenders.push_back({report_.methods[m].name + ' ' + variant, std::move(run)});
  }

  template <accuracy A> void add_level(char const* name, double seconds) {
    std::size_t const bytes = hierarchy_.hierarchy_bytes() + hierarchy_.patch_bytes();
    std::size_t const m = add_method({name, 0, seconds, bytes, bytes});
    for (std::size_t w = 0; w < workloads_.size(); ++w) {
      hits_.resize(std::max(hits_.size(), workloads_[w].rays.size()));
      auto const trace = [this, w](auto const& rays) {
        auto const hits = std::span(hits_).first(rays.size());
        if (workloads_[w].what == query::nearest) trace::closest_hits<A>(hierarchy_.view(), rays, hits, serial{});
        else trace::any_hits<A>(hierarchy_.view(), rays, hits, serial{});
      };
      trace(workloads_[w].rays);
      std::vector<answer> answers;
      for (std::size_t i = 0; i < workloads_[w].rays.size(); ++i)
        answers.push_back({hits_[i].t, hits_[i].u, hits_[i].v, hits_[i].patch});
      add_verdict(w, answers);
      add_contender(m, w, "float", [this, w, trace] { trace(workloads_[w].float_rays); });
      add_contender(m, w, "double", [this, w, trace] { trace(workloads_[w].rays); });
    }
  }

#if PATCHRT_HAVE_EMBREE
  struct packets {
    embree_rays<1> one;
    embree_rays<8> eight;
    embree_rays<16> sixteen;
    std::vector<answer> answers;
    explicit packets(workload const& w)
        : one(w.rays, w.what), eight(w.rays, w.what), sixteen(w.rays, w.what), answers(w.rays.size()) {}
  };

  void add_tessellation(mesh_kind kind, int n) {
    char const* const name = kind == mesh_kind::triangles ? "triangles" : "grid";
    double const cells = double(n) * n * double(patches_.size());
    if (cells * (kind == mesh_kind::triangles ? 200 : 16) > settings_.memory_limit * 0x1p30) {
      std::printf("left out: %s N=%d, more than --memory-limit\n", name, n);
      return;
    }
    auto const quality = settings_.build_quality == "high" ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM;
    auto const& scene = *scenes_.emplace_back(
        std::make_unique<embree_scene>(patches_, kind, n, quality, settings_.embree_config.c_str()));
    std::size_t const m = add_method({name, n, scene.build_seconds(), scene.bytes(), scene.peak_bytes()});
    for (std::size_t w = 0; w < workloads_.size(); ++w) {
      auto const flags = w == 0 ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
      packets& p = *packets_[w];
      p.one.trace_prepared(scene, flags);
      add_verdict(w, p.one.answers(scene));
      add_contender(m, w, "1", [&, flags] { p.one.trace_prepared(scene, flags); });
      add_contender(m, w, "8", [&, flags] { p.eight.trace_prepared(scene, flags); });
      add_contender(m, w, "16", [&, flags] { p.sixteen.trace_prepared(scene, flags); });
      add_contender(m, w, "1 filled", [&, flags] { p.one.trace_filled(scene, flags, p.answers); });
      add_contender(m, w, "16 filled", [&, flags] { p.sixteen.trace_filled(scene, flags, p.answers); });
    }
  }

  std::vector<std::unique_ptr<packets>> packets_;
  std::vector<std::unique_ptr<embree_scene>> scenes_;
#endif
  settings const& settings_;
  std::span<bicubic_patch<double> const> patches_;
  double diagonal_;
  std::span<workload const> workloads_;
  exact_surface surface_;
  mixed_hierarchy hierarchy_;
  std::vector<patch_hit> hits_;
  front_report report_;
};

void run(settings const& s) {
  auto const patches = load_bpt(s.model);
  auto whole = box<double>::empty();
  for (auto const& p : patches) whole = merge(whole, bounds(p));
  double const diagonal = std::sqrt(dot(extent(whole), extent(whole)));
  std::printf("%s: %zu patches, diagonal %.6g\n", s.model.c_str(), patches.size(), diagonal);
  auto const workloads = make_workloads(s, patches, diagonal);
  front f(s, patches, diagonal, workloads);
  f.add_patches();
#if PATCHRT_HAVE_EMBREE
  f.add_tessellations();
#else
  std::printf("built without Embree: patches alone\n");
#endif
  auto const& report = f.run();
  print_table(report, std::vector<std::string>{"float", "double", "1", "8", "16", "1 filled", "16 filled"});
  print_targets(targets(report));
  if (!s.csv.empty()) write_csv(report, s.csv);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(parse(argc, argv));
  } catch (std::exception const& e) {
    std::fprintf(stderr, "patchrt-front: %s\n", e.what());
    return 1;
  }
}
