// SPDX-License-Identifier: MIT
// patchrt-query: rays from a file to hits in a file.
#include <support/command_line.hpp>
#include <support/model.hpp>
#include <support/ray_file.hpp>
#include <support/statistics.hpp>
#include <support/stopwatch.hpp>
#include <support/tracing.hpp>

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct query_options : trace_options {
  std::string rays;
  std::string hits;
  bool any = false;
  int repeat = 1;
  bool json = false;
};

void add_options(CLI::App& app, query_options& o) {
  add_model_and_threads(app, o);
  add_accuracy(app, o);
  app.add_option("--rays", o.rays, "The rays: 8 little-endian float64 each, ox oy oz dx dy dz t_min t_max")
      ->required()
      ->type_name("FILE");
  app.add_option("--hits", o.hits,
                 "Written, 32 bytes a ray in the same order: t, u, v as float64, patch as int64 counted from 0. "
                 "t is in units of |direction|. A miss is patch -1, t infinite, u = v = 0")
      ->required()
      ->type_name("FILE");
  app.add_flag("--any", o.any, "Some hit between t_min and t_max, not the nearest: faster");
  add_parsed(app, "--repeat", o.repeat, parse_count<1000000>, "a number of runs from 1 to 1000000",
             "Traces K times and takes the median time; 1 by default")
      ->type_name("K");
  app.add_flag("--json", o.json, "Prints the figures as JSON");
  app.footer("Rays with a NaN, a zero direction or t_min > t_max are misses.");
}

void query(query_options const& o) {
  auto const patches = load_bpt(o.model);
  auto const rays = read_rays(o.rays);
  output_file hits_file(o.hits);

  tracer const model(patches, o.threads);
  accuracy const level = accuracy_named(o.accuracy);
  std::vector<patch_hit> hits(rays.size());
  std::vector<double> seconds(std::size_t(o.repeat));
  for (double& run : seconds) {
    stopwatch const watch;
    model.trace(level, o.any, rays, hits);
    run = watch.seconds();
  }
  auto const median = seconds.begin() + std::ptrdiff_t(seconds.size() / 2);
  std::nth_element(seconds.begin(), median, seconds.end());

  trace_statistics s;
  s.rays = rays.size();
  s.seconds = *median;
  s.counts = model.count_work(level, o.any, rays);
  std::vector<hit_record> records(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].valid()) continue;
    records[i] = {hits[i].t, hits[i].u, hits[i].v, hits[i].patch};
    ++s.hits;
  }
  write_hits(hits_file, records);

  auto const figures = to_json(s, model);
  if (o.json) std::cout << figures.dump(2) << '\n';
  else
    for (auto const& [key, value] : figures.items()) std::cout << key << ' ' << value << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  query_options options;
  CLI::App app("Finds where rays from a file meet a model of bicubic Bezier patches.", "patchrt-query");
  add_options(app, options);
  return run_program(app, argc, argv, [&] { query(options); });
}
