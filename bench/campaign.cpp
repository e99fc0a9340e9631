// SPDX-License-Identifier: MIT
/// \file
/// Counts what each level of accuracy loses, invents and promises too much, over millions of rays of every family on every
/// model, and looks for cracks where patches meet. See docs/ACCURACY.md.

#include "support/level_judge.hpp"
#include "support/ray_families.hpp"
#include "support/shared_edges.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/openmp.hpp>
#include <patchrt/exec/serial.hpp>

#include "../examples/support/model.hpp"

#include <CLI/CLI.hpp>

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

struct settings {
  std::vector<std::string> models{"data/teapot.bpt"};
  std::string csv;
  std::size_t rays = 100000;
  std::size_t oracle_every = 1000;
  std::uint64_t seed = 1;
  int threads = 0;
  double gap = 1e-6;
  std::size_t show = 8;
  std::vector<std::string> families;
};

settings parse(int argc, char** argv) {
  settings s;
  CLI::App app{"Lost roots, false hits, broken error bounds and cracks, by level of accuracy and family of rays"};
  app.add_option("--model", s.models, "patches (.bpt), one or more")->capture_default_str();
  app.add_option("--csv", s.csv, "file for all figures");
  app.add_option("--rays", s.rays, "of each family and model")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--oracle-every", s.oracle_every,
                 "judge one ray in so many in 113 bits, besides all where refined differs from what is certified")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", s.seed, "of all rays")->capture_default_str();
  app.add_option("--threads", s.threads, "0: as many as there are cores")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--gap", s.gap, "how far apart edges that are one may be, in diagonals")->capture_default_str();
  app.add_option("--show", s.show,
                 "rays to print, of those with a wrong certificate and of those where refined loses a root")
      ->capture_default_str();
  std::vector<std::string> names{"cracks"};
  for (ray_family const f : all_families) names.emplace_back(name_of(f));
  app.add_option("--family", s.families, "only these; by default all, and the cracks")->check(CLI::IsMember(names));
  try {
    app.parse(argc, argv);
  } catch (CLI::ParseError const& e) {
    std::exit(app.exit(e));
  }
  return s;
}

constexpr std::array levels{accuracy::fast, accuracy::refined, accuracy::certified, accuracy::reference};
constexpr std::array level_names{"fast", "refined", "certified", "reference"};
constexpr std::size_t refined_index = 1, certified_index = 2;

/// What one level did with a family of rays.
struct level_count {
  // of all rays, against the answers that are certified
  std::size_t hits = 0;
  std::size_t misses_root = 0;  ///< goes by the proved root
  std::size_t invents = 0;      ///< hits where or before it is proved that there is none
  std::size_t not_numbers = 0;
  // of the rays that were judged in 113 bits
  std::size_t lost = 0, lost_grazing = 0, false_hits = 0, touches = 0, joins = 0;
  std::size_t measured = 0;
  std::size_t beyond = 0;  ///< farther from the root than `error` says
  double most_ulps = 0;    ///< of hits whose angle has a cosine above 0.05
  double most_error = 0;   ///< in diagonals, of all

  void add(level_count const& c) {
    hits += c.hits, misses_root += c.misses_root, invents += c.invents, not_numbers += c.not_numbers;
    lost += c.lost, lost_grazing += c.lost_grazing, false_hits += c.false_hits, touches += c.touches, joins += c.joins;
    measured += c.measured;
    beyond += c.beyond;
    most_ulps = std::max(most_ulps, c.most_ulps);
    most_error = std::max(most_error, c.most_error);
  }
};

struct family_count {
  std::size_t rays = 0, certified = 0, tangent = 0, degenerate = 0, judged = 0;
  std::size_t disagree = 0;            ///< refined and certified hit at different places, or one misses
  std::size_t wrong_certificates = 0;  ///< of the judged: certified, and yet a root is lost or a hit is false
  std::array<level_count, 4> levels{};

  void add(family_count const& c) {
    rays += c.rays, certified += c.certified, tangent += c.tangent, degenerate += c.degenerate, judged += c.judged;
    disagree += c.disagree, wrong_certificates += c.wrong_certificates;
    for (std::size_t k = 0; k < levels.size(); ++k) levels[k].add(c.levels[k]);
  }
};

struct crack_count {
  std::size_t rays = 0;
  std::array<std::size_t, 4> cracks{};
};

/// A model and everything that is asked of it.
class campaign {
 public:
  campaign(settings const& s, std::string const& file)
      : settings_(s),
        scene_(load_bpt(file)),
        size_(scene_),
        hierarchy_(build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene_), {}, serial{})),
        truth_(test::numbers_of(scene_)),
        seams_(find_seams(scene_, s.gap * size_.diagonal)) {}

  std::size_t patches() const { return scene_.size(); }
  seams const& where() const { return seams_; }

  family_count count(ray_family f) const {
    family_count all;
    std::mutex guard;
    for_batches(std::size_t(f), [&](std::size_t n, std::mt19937_64& g) {
      family_count const c = count_batch(make_rays(scene_, f, n, g), g);
      std::lock_guard const lock(guard);
      all.add(c);
    });
    return all;
  }

  crack_count count_cracks() const {
    crack_count all;
    if (seams_.edges.empty()) return all;
    std::mutex guard;
    for_batches(all_families.size(), [&](std::size_t n, std::mt19937_64& g) {
      auto const aimed = rays_at_seams(scene_, seams_, n, g);
      answers const a = trace(aimed.rays);
      crack_count c;
      c.rays = aimed.rays.size();
      for (std::size_t k = 0; k < levels.size(); ++k)
        for (std::size_t i = 0; i < c.rays; ++i)
          c.cracks[k] += !(a.hits[k][i].t <= aimed.aimed_at[i] + 20 * settings_.gap * size_.diagonal);
      std::lock_guard const lock(guard);
      all.rays += c.rays;
      for (std::size_t k = 0; k < levels.size(); ++k) all.cracks[k] += c.cracks[k];
    });
    return all;
  }

 private:
  static constexpr std::size_t longest_batch = 65536;

  struct answers {
    std::array<std::vector<patch_hit>, 4> hits;
    std::vector<certainty> certainties;
  };

  /// f(number of rays, generator) for batches that make up all rays; the same whatever the threads.
  template <class F> void for_batches(std::size_t family, F&& f) const {
    std::size_t const batches = (settings_.rays + longest_batch - 1) / longest_batch;
    openmp(settings_.threads).for_each_chunk(batches, 1, [&](std::size_t begin, std::size_t) {
      std::seed_seq seed{settings_.seed, std::uint64_t(family), std::uint64_t(begin)};
      std::mt19937_64 g(seed);
      f(std::min(longest_batch, settings_.rays - begin * longest_batch), g);
    });
  }

  answers trace(test::ray_list const& rays) const {
    answers a;
    for (auto& h : a.hits) h.resize(rays.size());
    a.certainties.resize(rays.size());
    auto const view = hierarchy_.view();
    std::span<ray<double> const> const list(rays);
    trace::closest_hits<accuracy::fast>(view, list, a.hits[0], serial{});
    trace::closest_hits<accuracy::refined>(view, list, a.hits[1], serial{});
    trace::certified_hits(view, list, a.hits[2], a.certainties, serial{});
    trace::closest_hits<accuracy::reference>(view, list, a.hits[3], serial{});
    return a;
  }

  family_count count_batch(test::ray_list const& rays, std::mt19937_64& g) const {
    answers const a = trace(rays);
    family_count c;
    c.rays = rays.size();
    std::size_t const first = g() % settings_.oracle_every;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      bool const is_certified = a.certainties[i] == certainty::certified;
      c.certified += is_certified;
      c.tangent += a.certainties[i] == certainty::tangent;
      c.degenerate += a.certainties[i] == certainty::degenerate;
      patch_hit const& proved = a.hits[certified_index][i];
      double const length = test::norm(rays[i].direction);
      bool is_doubtful = false;
      for (std::size_t k = 0; k < levels.size(); ++k) {
        patch_hit const& hit = a.hits[k][i];
        double const same = same_root(levels[k], rays[i], size_);
        bool const is_past = proved.valid() && !((hit.t - proved.t) * length <= same);
        bool const is_before = hit.valid() && !((proved.t - hit.t) * length <= same);
        auto& l = c.levels[k];
        l.hits += hit.valid();
        l.not_numbers += hit.valid() && !(hit.t - hit.t == 0 && hit.u - hit.u == 0 && hit.v - hit.v == 0);
        l.misses_root += is_certified && is_past;
        l.invents += is_certified && is_before;
        if (k == refined_index) is_doubtful = is_past || is_before;
      }
      c.disagree += is_doubtful;
      if ((is_doubtful && is_certified) || i % settings_.oracle_every == first) judge(rays[i], a, i, is_certified, c);
    }
    return c;
  }

  void judge(ray<double> const& r, answers const& a, std::size_t i, bool is_certified, family_count& c) const {
    auto const roots = truth_.all_hits(test::numbers_of(r));
    ++c.judged;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      auto& l = c.levels[k];
      patch_hit const& hit = a.hits[k][i];
      hit_verdict v = judge_hit(scene_, size_, levels[k], r, roots, hit);
      if (v.is_touch && meets_beyond_edge(truth_, size_, r, hit)) v.is_touch = false, v.is_join = true;
      l.lost += v.is_lost;
      l.lost_grazing += v.is_lost_grazing;
      l.false_hits += v.is_false;
      l.touches += v.is_touch;
      l.joins += v.is_join;
      bool const is_wrong = is_certified && (v.is_lost || v.is_lost_grazing || v.is_false || v.is_touch);
      if (k == certified_index) c.wrong_certificates += is_wrong;
      if ((k == certified_index && is_wrong) || (k == refined_index && v.is_lost)) show(r, hit, roots, k);
      if (!v.error) continue;
      ++l.measured;
      l.beyond += *v.error > double(hit.error);
      l.most_error = std::max(l.most_error, *v.error / size_.diagonal);
      if (v.cosine > 0.05) l.most_ulps = std::max(l.most_ulps, v.ulps);
    }
  }

  /// What reproduces a failure.
  void show(ray<double> const& r, patch_hit const& hit, std::span<test::oracle_root const> roots,
            std::size_t level) const {
    std::lock_guard const lock(showing_);
    if (shown_[level]++ >= settings_.show) return;
    std::printf(
        "    %s: ray %.17g %.17g %.17g  %.17g %.17g %.17g  %g %g: hit t %.17g u %.17g v %.17g error %g patch %d\n",
        level_names[level], r.origin.x, r.origin.y, r.origin.z, r.direction.x, r.direction.y, r.direction.z, r.t_min,
        r.t_max, hit.t, hit.u, hit.v, double(hit.error), hit.patch);
    for (auto const& root : roots.first(std::min<std::size_t>(roots.size(), 3)))
      std::printf(
          "      root t %.18Lg u %.18Lg v %.18Lg patch %d cosine %.3g jacobian %.3g edge %.3g end %.3g%s slack "
          "%.3Lg\n",
          root.t, root.u, root.v, root.patch, root.cos_angle, root.jacobian, root.edge_distance, root.end_distance,
          root.singular ? " singular" : "", root.slack);
  }

  settings const& settings_;
  mutable std::mutex showing_;
  mutable std::array<std::size_t, 4> shown_{};
  test::patch_list scene_;
  model_size size_;
  mixed_hierarchy hierarchy_;
  test::oracle truth_;
  seams seams_;
};

void print(char const* family, family_count const& c) {
  std::printf(
      "  %s: %zu rays; %zu certified, %zu tangent, %zu degenerate; refined and certified differ for %zu; "
      "%zu judged in 113 bits; wrong certificates: %zu\n",
      family, c.rays, c.certified, c.tangent, c.degenerate, c.disagree, c.judged, c.wrong_certificates);
  for (std::size_t k = 0; k < levels.size(); ++k) {
    auto const& l = c.levels[k];
    std::printf("    %-10s %9zu hits %9zu %8zu %5zu | %6zu %6zu %6zu %6zu %6zu %8zu %7zu %10.3g %10.3g\n",
                level_names[k], l.hits, l.misses_root, l.invents, l.not_numbers, l.lost, l.lost_grazing, l.false_hits,
                l.touches, l.joins, l.measured, l.beyond, l.most_ulps, l.most_error);
  }
  std::fflush(stdout);
}

void write(std::ofstream& out, std::string const& model, char const* family, family_count const& c) {
  for (std::size_t k = 0; k < levels.size(); ++k) {
    auto const& l = c.levels[k];
    out << model << ',' << family << ',' << level_names[k] << ',' << c.rays << ',' << c.certified << ',' << c.tangent
        << ',' << c.degenerate << ',' << c.disagree << ',' << c.judged << ',' << c.wrong_certificates << ',' << l.hits
        << ',' << l.misses_root << ',' << l.invents << ',' << l.not_numbers << ',' << l.lost << ',' << l.lost_grazing
        << ',' << l.false_hits << ',' << l.touches << ',' << l.joins << ',' << l.measured << ',' << l.beyond << ','
        << l.most_ulps << ',' << l.most_error << ",\n";
  }
}

/// \return whether every certificate and every seam held.
bool run(settings const& s) {
  std::ofstream out;
  if (!s.csv.empty()) {
    out.open(s.csv);
    out << "model,family,level,rays,certified,tangent,degenerate,disagree,judged,wrong_certificates,hits,misses_root,"
           "invents,not_numbers,lost,lost_grazing,false_hits,touches,joins,measured,beyond,most_ulps,most_error,"
           "cracks\n";
  }
  std::printf(
      "against certified answers: level, hits, goes by a proved root, hits where there is none, NaN | in 113 "
      "bits: lost, lost within 1e-2 of grazing, false, touching within rounding, across a join, measured, beyond "
      "`error`, most ulps, "
      "most diagonals\n");
  bool holds = true;
  auto const is_asked = [&](std::string const& family) {
    return s.families.empty() || std::find(s.families.begin(), s.families.end(), family) != s.families.end();
  };
  for (auto const& file : s.models) {
    auto const start = std::chrono::steady_clock::now();
    campaign const model(s, file);
    std::string const name = std::filesystem::path(file).stem().string();
    std::printf("%s: %zu patches, %zu shared edges, %zu corners with patches all around\n", file.c_str(),
                model.patches(), model.where().edges.size(), model.where().corners.size());
    for (ray_family const f : all_families) {
      if (!is_asked(name_of(f))) continue;
      family_count const c = model.count(f);
      holds = holds && c.wrong_certificates == 0;
      print(name_of(f), c);
      if (out.is_open()) write(out, name, name_of(f), c);
    }
    if (!is_asked("cracks")) continue;
    crack_count const c = model.count_cracks();
    std::printf("  cracks, of %zu rays across shared edges and corners:", c.rays);
    for (std::size_t k = 0; k < levels.size(); ++k) {
      std::printf(" %s %zu", level_names[k], c.cracks[k]);
      if (out.is_open())
        out << name << ",cracks," << level_names[k] << ',' << c.rays << ",,,,,,,,,,,,,,,,,,,," << c.cracks[k] << '\n';
    }
    holds = holds && c.cracks[refined_index] == 0 && c.cracks[certified_index] == 0;
    std::printf("\n  %.1f s\n", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  if (out.is_open() && !out.flush()) throw std::runtime_error(s.csv + ": cannot be written");
  return holds;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (run(parse(argc, argv))) return 0;
    std::fprintf(stderr, "patchrt-campaign: a certificate was wrong, or refined or certified has a crack\n");
    return 2;
  } catch (std::exception const& e) {
    std::fprintf(stderr, "patchrt-campaign: %s\n", e.what());
    return 1;
  }
}
