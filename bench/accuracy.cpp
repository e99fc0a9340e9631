// SPDX-License-Identifier: MIT
/// \file
/// What accuracy costs: time and error of every level and of every choice inside the ray-patch solver, on easy and on hard rays,
/// against all roots in 113 bits. See docs/ACCURACY.md.

#include "support/accuracy_rows.hpp"
#include "support/box_study.hpp"
#include "support/ray_families.hpp"
#include "support/solver_study.hpp"
#include "support/workload.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>

#include "../examples/support/model.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <deque>
#include <memory>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

struct settings {
  std::string model = "data/teapot.bpt";
  std::string csv, picture;
  std::size_t rays = 16384;
  std::size_t judged = 2048;
  int picture_size = 256;
  int rounds = 7;
  std::uint64_t seed = 1;
};

settings parse(int argc, char** argv) {
  settings s;
  CLI::App app{"What accuracy costs: time and error of every level and of every choice inside the solver"};
  app.add_option("--model", s.model, "patches (.bpt)")->capture_default_str();
  app.add_option("--csv", s.csv, "file for all figures");
  app.add_option("--picture", s.picture, "CSV file for the error in every pixel of a view, by level");
  app.add_option("--picture-size", s.picture_size, "pixels per side, a multiple of 4")
      ->check(CLI::Range(4, 4096))
      ->capture_default_str();
  app.add_option("--rays", s.rays, "timed, of each family")->check(CLI::Range(1, 1 << 24))->capture_default_str();
  app.add_option("--judged", s.judged, "of these, judged in 113 bits")
      ->check(CLI::Range(1, 1 << 24))
      ->capture_default_str();
  app.add_option("--rounds", s.rounds, "timed runs of each")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--seed", s.seed, "of all rays")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (CLI::ParseError const& e) {
    std::exit(app.exit(e));
  }
  if (s.picture_size % 4 != 0)
    throw std::runtime_error("--picture-size: expected a multiple of 4, got " + std::to_string(s.picture_size));
  return s;
}

/// Patches that fold and cross themselves, apart from each other.
template <class Generator> test::patch_list folded_scene(Generator& g) {
  test::patch_list scene;
  for (int k = 0; k < 12; ++k) {
    scene.push_back(k % 2 ? test::random_patch<double>(g) : test::random_sheet(g, 0.4));
    for (auto& c : scene.back().control_points) c += vec3<double>(k % 4, k / 4, 0.);
  }
  return scene;
}

/// Sheets whose edge u = 0 is one point.
template <class Generator> test::patch_list collapsed_scene(Generator& g) {
  test::patch_list scene;
  for (int k = 0; k < 12; ++k) {
    scene.push_back(test::random_sheet(g, 0.2));
    for (auto& c : scene.back().control_points) c += vec3<double>(1.5 * (k % 4), 1.5 * (k / 4), 0.);
    for (int j = 1; j < 4; ++j) scene.back()(0, j) = scene.back()(0, 0);
  }
  return scene;
}

/// Rays at points beside the collapsed edges, as near as 1e-6 of the parameter.
template <class Generator>
test::ray_list rays_at_poles(test::patch_list const& scene, std::size_t count, Generator& g) {
  double const radius = test::ball_of(scene).radius;
  test::ray_list rays;
  for (std::size_t k = 0; k < count; ++k) {
    double const u = std::pow(10, test::uniform(g, -6, -1));
    vec3<double> const aim = evaluate(scene[g() % scene.size()], u, test::uniform(g)).position;
    vec3<double> const d = test::random_direction(g);
    rays.push_back({aim - d * (2 * radius), d, 0, test::no_limit});
  }
  return rays;
}

/// A scene, rays for it, and all roots of some of them.
struct workload {
  std::string name;
  std::shared_ptr<test::patch_list const> scene;
  test::ray_list rays;
  std::vector<std::size_t> judged_rays{};               ///< evenly from all
  std::vector<std::vector<test::oracle_root>> roots{};  ///< of these
  std::vector<patch_hit> hits;

  workload(std::string title, std::shared_ptr<test::patch_list const> patches, test::ray_list list, std::size_t judged)
      : name(std::move(title)), scene(std::move(patches)), rays(std::move(list)), hits(rays.size()) {
    test::oracle const truth(test::numbers_of(*scene));
    std::size_t const step = std::max<std::size_t>(1, rays.size() / judged);
    for (std::size_t i = 0; i < rays.size() && roots.size() < judged; i += step) {
      judged_rays.push_back(i);
      roots.push_back(truth.all_hits(test::numbers_of(rays[i])));
    }
  }
};

class study {
 public:
  explicit study(settings const& s) : settings_(s), model_(std::make_shared<test::patch_list>(load_bpt(s.model))) {
    std::mt19937_64 g(s.seed);
    for (ray_family const f : all_families) add(name_of(f), model_, make_rays(*model_, f, s.rays, g));
    auto const folded = std::make_shared<test::patch_list>(folded_scene(g));
    add("folded patches", folded, test::chords(*folded, int(s.rays), g));
    auto const collapsed = std::make_shared<test::patch_list>(collapsed_scene(g));
    add("collapsed edges", collapsed, rays_at_poles(*collapsed, s.rays, g));
  }

  std::span<accuracy_row const> rows() const { return rows_; }

  void run() {
    for (auto& w : workloads_) {
      mixed_hierarchy_options options;
      auto const& h = hierarchies_.emplace_back(build_mixed_hierarchy(patches(w), options, serial{}));
      begin();
      add_level<accuracy::fast>("levels", "fast", "", w, h);
      add_level<accuracy::refined>("levels", "refined", "", w, h);
      add_level<accuracy::certified>("levels", "certified", "", w, h);
      add_level<accuracy::reference>("levels", "reference", "", w, h);
      finish();
    }
    for (auto& w : workloads_) {
      if (w.name != "view" && w.name != "random chords") continue;
      begin();
      for (int depth = -1; depth <= max_subpatch_depth; ++depth) {
        mixed_hierarchy_options options;
        options.depth = depth;
        auto const& h = hierarchies_.emplace_back(build_mixed_hierarchy(patches(w), options, serial{}));
        auto const value = depth < 0 ? "by shape" : std::to_string(depth);
        add_level<accuracy::refined>("depth", "refined", value, w, h);
        add_level<accuracy::reference>("depth", "reference", value, w, h);
      }
      finish();
      begin();
      add_box_rows(rows_, w.name, *w.scene, w.rays, w.judged_rays, w.roots);
      finish();
    }
    for (auto const& w : workloads_) {
      if (w.name == "bounces") continue;  // where a bounce starts is a root too, and not among the known ones
      auto const& cases = cases_.emplace_back(make_cases(w));
      if (cases.empty()) continue;
      begin();
      add_solver_rows(rows_, w.name, cases);
      finish();
    }
  }

  void print() const {
    print_rows(rows_);
    std::vector<std::string> const traced{"levels", "depth"}, solved{"steps", "tolerance", "numbers", "correction"};
    for (auto const& w : workloads_) print_front(rows_, w.name, traced, "a ray");
    for (auto const& w : workloads_) print_front(rows_, w.name, solved, "a root");
  }

 private:
  static std::span<bicubic_patch<double> const> patches(workload const& w) { return *w.scene; }

  void add(std::string name, std::shared_ptr<test::patch_list const> scene, test::ray_list rays) {
    workloads_.emplace_back(std::move(name), std::move(scene), std::move(rays), settings_.judged);
  }
  void begin() { first_ = rows_.size(); }
  void finish() { time_rows(std::span(rows_).subspan(first_), settings_.rounds); }

  template <accuracy A>
  void add_level(std::string name, std::string method, std::string value, workload& w, mixed_hierarchy const& h) {
    auto const trace = [&w, &h] {
      trace::closest_hits<A>(h.view(), std::span<ray<double> const>(w.rays), w.hits, serial{});
    };
    trace();
    model_size const size(*w.scene);
    error_list errors;
    for (std::size_t k = 0; k < w.roots.size(); ++k) {
      std::size_t const i = w.judged_rays[k];
      hit_verdict const v = judge_hit(*w.scene, size, A, w.rays[i], w.roots[k], w.hits[i]);
      errors.lost += v.is_lost || v.is_lost_grazing;
      errors.false_hits += v.is_false;
      errors.not_numbers += !v.is_number;
      if (!v.error) continue;
      errors.diagonals.push_back(*v.error / size.diagonal);
      errors.ulps.push_back(v.ulps);
    }
    rows_.push_back(
        {std::move(name), w.name, method, "", std::move(value), w.rays.size(), std::move(errors), {method, trace}});
  }

  /// The first regular root of every judged ray.
  static std::vector<solver_case> make_cases(workload const& w) {
    model_size const size(*w.scene);
    std::vector<solver_case> cases;
    for (std::size_t k = 0; k < w.roots.size(); ++k)
      for (auto const& root : w.roots[k]) {
        if (!root.is_certain(1e-6, 0)) continue;
        if (auto const c = make_case(*w.scene, size, w.rays[w.judged_rays[k]], w.roots[k], root)) cases.push_back(*c);
        break;
      }
    return cases;
  }

  settings const& settings_;
  std::shared_ptr<test::patch_list const> model_;
  std::deque<workload> workloads_;
  std::deque<mixed_hierarchy> hierarchies_;
  std::deque<std::vector<solver_case>> cases_;
  std::vector<accuracy_row> rows_;
  std::size_t first_ = 0;
};

/// The error in every pixel of a view, in diagonals; -1 where there is nothing, inf where a hit is missing, false or elsewhere.
void write_picture(settings const& s) {
  auto const patches = load_bpt(s.model);
  model_size const size(patches);
  camera const c = frame(patches, {0.4, -1, 0.5}, {0, 0, 1}, 40, 0.25);
  auto const rays = primary_rays(c, s.picture_size, s.picture_size);
  auto const truth = reference_answers(patches, rays);
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(patches), {}, serial{});
  std::array<std::vector<patch_hit>, 4> hits;
  for (auto& list : hits) list.resize(rays.size());
  std::span<ray<double> const> const list(rays);
  trace::closest_hits<accuracy::fast>(h.view(), list, hits[0], serial{});
  trace::closest_hits<accuracy::refined>(h.view(), list, hits[1], serial{});
  trace::closest_hits<accuracy::certified>(h.view(), list, hits[2], serial{});
  trace::closest_hits<accuracy::reference>(h.view(), list, hits[3], serial{});
  std::ofstream out(s.picture);
  out << "x,y,fast,refined,certified,reference\n";
  std::size_t const tiles = std::size_t(s.picture_size) / 4;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    std::size_t const tile = i / 16, in_tile = i % 16;
    out << tile % tiles * 4 + in_tile % 4 << ',' << tile / tiles * 4 + in_tile / 4;
    for (auto const& level : hits) {
      double error = -1;
      if (level[i].valid() != is_hit(truth[i])) error = std::numeric_limits<double>::infinity();
      else if (level[i].valid()) {
        auto const at = [&](std::int32_t patch, double u, double v) {
          return evaluate_exactly(patches[std::size_t(patch)], u, v).s;
        };
        error =
            double(length(at(level[i].patch, level[i].u, level[i].v) - at(truth[i].patch, truth[i].u, truth[i].v))) /
            size.diagonal;
        if (error > 0.01) error = std::numeric_limits<double>::infinity();
      }
      out << ',' << error;
    }
    out << '\n';
  }
  if (!out.flush()) throw std::runtime_error(s.picture + ": cannot be written");
}

void run(settings const& s) {
  if (!s.picture.empty()) return write_picture(s);
  study all(s);
  all.run();
  all.print();
  if (!s.csv.empty()) write_rows(all.rows(), s.csv);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(parse(argc, argv));
  } catch (std::exception const& e) {
    std::fprintf(stderr, "patchrt-accuracy: %s\n", e.what());
    return 1;
  }
}
