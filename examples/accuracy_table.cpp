// SPDX-License-Identifier: MIT
// patchrt-accuracy: what each accuracy level costs and how far its hits are from the truth, as a table.
#include <support/camera.hpp>
#include <support/command_line.hpp>
#include <support/model.hpp>
#include <support/polish.hpp>
#include <support/stopwatch.hpp>
#include <support/tracing.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct accuracy_options : trace_options {
  int size = 1024;
};

/// Distances along the ray from hits to the roots they approximate.
struct error_summary {
  std::size_t hits = 0;
  std::size_t unconfirmed = 0;  ///< hits with no root to be found beside them
  double largest = 0;
  double rms = 0;
};

error_summary judge(std::vector<bicubic_patch<double>> const& patches, std::vector<ray<double>> const& rays,
                    std::vector<patch_hit> const& hits, openmp const& exec) {
  constexpr double unconfirmed = -1;
  std::vector<double> errors(rays.size(), 0);
  exec.for_each(rays.size(), [&](std::size_t i) {
    patch_hit const& h = hits[i];
    if (!h.valid()) return;
    polished_root const root = polish(patches[std::size_t(h.patch)], rays[i], h.t, h.u, h.v);
    errors[i] = root.confirmed ? double(root.moved) : unconfirmed;
  });
  error_summary s;
  double sum = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i].valid()) continue;
    ++s.hits;
    if (errors[i] == unconfirmed) {
      ++s.unconfirmed;
      continue;
    }
    s.largest = std::max(s.largest, errors[i]);
    sum += errors[i] * errors[i];
  }
  s.rms = std::sqrt(sum / double(std::max<std::size_t>(s.hits - s.unconfirmed, 1)));
  return s;
}

void print_table(accuracy_options const& o) {
  auto const patches = load_bpt(o.model);
  tracer const model(patches, o.threads);
  image_size const size{o.size, o.size};
  camera const view = frame(patches, {0, 0, 1}, 35, size);
  std::vector<ray<double>> rays(size.pixels());
  model.executor().for_each(rays.size(), [&](std::size_t i) { rays[i] = primary_ray(view, size, i); });
  vec3<double> const diagonal = extent(bounds(patches));
  double const unit = std::sqrt(dot(diagonal, diagonal));

  std::printf(
      "%s: %zu patches, %zu rays, %d threads; errors against roots in long double, in diagonals of the bounding box\n",
      o.model.c_str(), patches.size(), rays.size(), model.executor().concurrency());
  std::printf("%-10s %9s %9s %11s %11s %12s\n", "accuracy", "Mrays/s", "hits", "RMS error", "max error", "unconfirmed");
  std::vector<patch_hit> hits(rays.size());
  for (accuracy const level : accuracy_levels) {
    std::array<double, 5> seconds;
    for (double& run : seconds) {
      stopwatch const watch;
      model.trace(level, false, rays, hits);
      run = watch.seconds();
    }
    std::sort(seconds.begin(), seconds.end());
    error_summary const e = judge(patches, rays, hits, model.executor());
    std::printf("%-10s %9.1f %9zu %11.2e %11.2e %12zu\n", std::string(name_of(level)).c_str(),
                double(rays.size()) / seconds[seconds.size() / 2] * 1e-6, e.hits, e.rms / unit, e.largest / unit,
                e.unconfirmed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  accuracy_options options;
  CLI::App app("Prints time and error of every accuracy level on a model, seen as patchrt-render frames it.",
               "patchrt-accuracy");
  add_model_and_threads(app, options);
  add_parsed(app, "--size", options.size, parse_count<4096>, "a number of pixels from 1 to 4096",
             "Width and height of the picture traced; 1024 by default")
      ->type_name("N");
  return run_program(app, argc, argv, [&] { print_table(options); });
}
