// SPDX-License-Identifier: MIT
// patchrt-render: a picture of a model of bicubic patches, each pixel from the exact surface.
#include <support/camera.hpp>
#include <support/command_line.hpp>
#include <support/image.hpp>
#include <support/model.hpp>
#include <support/progress_bar.hpp>
#include <support/shading.hpp>
#include <support/statistics.hpp>
#include <support/stopwatch.hpp>
#include <support/tracing.hpp>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct render_options : trace_options {
  std::string output;
  std::string stats;
  std::string aov = "shaded";
  image_size size{1024, 1024};
  std::optional<vec3<double>> eye, target;
  vec3<double> up{0, 0, 1};
  double vfov = 35;
  bool cull_back_faces = false, flip_normals = false;
  bool quiet = false;
};

void add_options(CLI::App& app, render_options& o) {
  add_model_and_threads(app, o);
  add_accuracy(app, o);
  app.add_option("-o,--output", o.output, "The picture, as PNG")->required()->type_name("FILE.png");
  add_parsed(app, "--size", o.size, parse_size, size_expected, "Pixels; 1024x1024 by default")->type_name("WxH");
  auto const vector = [&](std::string const& name, auto& value, std::string const& description) {
    return add_parsed(app, name, value, parse_vector, "three numbers X,Y,Z", description)->type_name("X,Y,Z");
  };
  auto* const eye = vector("--eye", o.eye, "Where the camera is; by default where all of the model fills the picture");
  vector("--look-at", o.target, "The point in the picture's middle; by default the model's")->needs(eye);
  vector("--up", o.up, "The direction that is upwards; 0,0,1 by default");
  add_parsed(app, "--vfov", o.vfov, parse_field_of_view, "degrees above 0 and below 180",
             "Vertical field of view in degrees; 35 by default")
      ->type_name("DEG");
  app.add_option("--aov", o.aov, "What a pixel shows")
      ->check(CLI::IsMember(aov_names()))
      ->capture_default_str()
      ->type_name("WHAT");
  auto* const cull =
      app.add_flag("--cull-back-faces", o.cull_back_faces, "Leave out sub-patches whose normals Su x Sv face away");
  app.add_flag("--flip-normals", o.flip_normals, "Back faces are those whose normals Sv x Su face away")->needs(cull);
  app.add_option("--stats", o.stats, "Figures of the run, as JSON")->type_name("FILE.json");
  app.add_flag("--quiet", o.quiet, "No progress bar, no summary");
}

camera make_camera(render_options const& o, std::vector<bicubic_patch<double>> const& patches) {
  if (!o.eye) return frame(patches, o.up, o.vfov, o.size);
  box<double> const b = bounds(patches);
  return look_at(*o.eye, o.target.value_or(b.lo + extent(b) * 0.5), o.up, o.vfov, o.size);
}

/// Traces and shades all pixels, a block of them after the other.
trace_statistics draw(tracer const& model, shader const& colour, camera const& view, accuracy level, bool count,
                      progress_bar& progress, image& picture) {
  constexpr std::size_t block = std::size_t(1) << 16;
  std::size_t const total = picture.size.pixels();
  std::vector<ray<double>> rays(std::min(block, total));
  std::vector<patch_hit> hits(rays.size());
  trace_statistics s;
  for (std::size_t first = 0; first < total; first += rays.size()) {
    rays.resize(std::min(block, total - first));
    hits.resize(rays.size());
    model.executor().for_each(rays.size(),
                              [&](std::size_t i) { rays[i] = primary_ray(view, picture.size, first + i); });
    stopwatch const watch;
    model.trace(level, false, rays, hits);
    s.seconds += watch.seconds();
    model.executor().for_each(rays.size(), [&](std::size_t i) {
      pixel const p = tiled_pixel(picture.size, first + i);
      picture(p.x, p.y) = colour(rays[i], hits[i]);
    });
    s.rays += rays.size();
    s.hits += std::size_t(std::count_if(hits.begin(), hits.end(), [](patch_hit const& h) { return h.valid(); }));
    if (count) {
      hierarchy_counts const c = model.count_work(level, false, rays);
      s.counts.candidates += c.candidates;
      s.counts.newton_steps += c.newton_steps;
    }
    progress.update(double(s.rays) / double(total));
  }
  return s;
}

void render(render_options const& o) {
  auto const patches = load_bpt(o.model);
  output_file picture_file(o.output);
  std::optional<output_file> stats_file;
  if (!o.stats.empty()) stats_file.emplace(o.stats);

  camera const view = make_camera(o, patches);
  tracer model(patches, o.threads);
  double culled = 0;
  if (o.cull_back_faces)
    culled = model.cull_back_faces(view.eye, o.flip_normals ? patch_front::against_normal : patch_front::along_normal);
  image picture(o.size);
  trace_statistics s;
  {
    progress_bar progress(!o.quiet);
    s = draw(model, shader(o.aov, patches, view), view, accuracy_named(o.accuracy), stats_file.has_value(), progress,
             picture);
  }
  write_png(picture_file, picture);
  if (stats_file) stats_file->write(to_json(s, model).dump(2) + "\n");
  if (!o.quiet) {
    std::printf("%s: %zu patches, %dx%d pixels, %zu hits, traced in %.3g s (%.3g Mrays/s), built in %.3g s\n",
                o.output.c_str(), patches.size(), o.size.width, o.size.height, s.hits, s.seconds, s.mrays_per_s(),
                model.build_seconds());
    if (o.cull_back_faces) std::printf("%.3g %% of the sub-patches culled\n", 100 * culled);
  }
}

}  // namespace

int main(int argc, char** argv) {
  render_options options;
  CLI::App app("Renders bicubic Bezier patches, exactly: no tessellation.", "patchrt-render");
  add_options(app, options);
  return run_program(app, argc, argv, [&] { render(options); });
}
