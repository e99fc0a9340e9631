// SPDX-License-Identifier: MIT
// patchrt-gallery: scenes of spheres, quadrics, triangles, patches and a torus, each shape by its own kernel.
#include <support/command_line.hpp>
#include <support/gallery.hpp>
#include <support/load_mesh.hpp>
#include <support/model.hpp>
#include <support/procedural_meshes.hpp>
#include <support/stopwatch.hpp>

#include <cstdio>
#include <string>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct gallery_options {
  std::string scene, output, model, mesh;
  image_size size{1024, 768};
  int depth = 4;
  int threads = 0;
};

/// A ball of triangles that stands beside the teapot.
mesh ball_beside() { return sphere_mesh(6, {2.9, 2.6, 0.8}, 0.8); }

void draw(gallery_options const& o) {
  std::vector<bicubic_patch<double>> teapot;
  mesh beside = ball_beside();
  if (o.scene == "table") {
    teapot = load_bpt(o.model);
    if (!o.mesh.empty()) {
      loaded_mesh m = load_mesh(o.mesh);
      if (std::string const skipped = describe_skipped(m); !skipped.empty())
        std::fprintf(stderr, "%s\n", skipped.c_str());
      beside = std::move(m);
    }
  }
  output_file file(o.output);
  gallery const shapes = make_gallery(o.scene, o.depth, teapot, beside);
  gallery_view const view(shapes, o.threads);
  stopwatch const watch;
  image const picture = view.draw(o.size);
  double const seconds = watch.seconds();
  write_png(file, picture);
  std::printf(
      "%s: %zu triangles, %zu spheres, %zu quadrics, %zu tori, %zu models of patches, %dx%d pixels with shadows in "
      "%.3g s\n",
      o.output.c_str(), shapes.triangles.size(), shapes.spheres.size(), shapes.quadrics.size(), shapes.tori.size(),
      shapes.patches.size(), o.size.width, o.size.height, seconds);
}

}  // namespace

int main(int argc, char** argv) {
  gallery_options o;
  CLI::App app("Renders a scene of shapes of many kinds: sphereflake, quadrics, table.", "patchrt-gallery");
  app.add_option("scene", o.scene, "Which scene")
      ->required()
      ->check(CLI::IsMember(gallery_names()))
      ->type_name("SCENE");
  app.add_option("-o,--output", o.output, "The picture, as PNG")->required()->type_name("FILE.png");
  add_parsed(app, "--size", o.size, parse_size, size_expected, "Pixels; 1024x768 by default")->type_name("WxH");
  app.add_option("--depth", o.depth, "Of the sphereflake: 4 has 7381 spheres")
      ->check(CLI::Range(0, 7))
      ->capture_default_str();
  app.add_option("--model", o.model, "What stands on the table (.bpt)")->type_name("FILE.bpt");
  app.add_option("--mesh", o.mesh, "Triangles beside it, where they are (.obj); a ball by default")
      ->type_name("FILE.obj");
  add_parsed(app, "--threads", o.threads, parse_count<1024>, "a number from 1 to 1024",
             "Threads; as many as there are cores by default")
      ->type_name("N");
  return run_program(app, argc, argv, [&] {
    if (o.scene == "table" && o.model.empty())
      throw std::runtime_error("table: expected --model FILE.bpt, the teapot to stand on it");
    draw(o);
  });
}
