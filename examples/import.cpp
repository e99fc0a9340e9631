// SPDX-License-Identifier: MIT
// patchrt-import: bicubic patches of the Catmull-Clark surfaces of control meshes, with how far they are from those.
#include <support/command_line.hpp>
#include <support/file.hpp>
#include <support/model.hpp>
#include <support/obj.hpp>
#include <support/subdivision.hpp>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct import_options {
  std::vector<std::string> meshes;
  std::string output;
  int level = 8;
  std::string cap = "bspline";
  std::string creases = "cut";
  int samples = 5;
  bool quiet = false;
};

std::optional<int> parse_level(std::string_view text) {
  auto const level = to_number<int>(text);
  return level && 0 <= *level && *level <= subdivision_surface::deepest_level ? level : std::nullopt;
}

std::optional<int> parse_samples(std::string_view text) {
  auto const n = to_number<int>(text);
  return n && (*n == 0 || (2 <= *n && *n <= 64)) ? n : std::nullopt;
}

void add_options(CLI::App& app, import_options& o) {
  app.add_option("MESH", o.meshes, "Control meshes as OBJ, with OpenSubdiv's tags for creases, corners and holes")
      ->required();
  app.add_option("-o,--output", o.output, "The patches as .bpt; or a folder, where MESH.obj becomes MESH.bpt")
      ->required()
      ->type_name("FILE.bpt");
  add_parsed(app, "--level", o.level, parse_level, "a level from 0 to 10",
             "How often faces are divided at most until they are regular; 8 by default")
      ->type_name("N");
  app.add_option("--end-cap", o.cap, "What irregular faces become: B-spline patches, or Gregory patches made bicubic")
      ->check(CLI::IsMember({"bspline", "gregory"}))
      ->capture_default_str()
      ->type_name("CAP");
  app.add_option(
         "--creases", o.creases,
         "What semi-sharp creases of regular faces become: cut = the two or three patches a face that they are; "
         "isolate = divided as often as the level allows")
      ->check(CLI::IsMember({"cut", "isolate"}))
      ->capture_default_str()
      ->type_name("HOW");
  add_parsed(app, "--samples", o.samples, parse_samples, "0 or a number from 2 to 64",
             "Points along each side of a patch at which its distance from the limit surface is measured, 0 for no "
             "measurement; 5 by default")
      ->type_name("N");
  app.add_flag("--quiet", o.quiet, "Nothing is measured or printed");
}

void import_mesh(import_options const& o, std::filesystem::path const& mesh, std::filesystem::path const& output) {
  obj_model const control = load_obj(mesh);
  subdivision_surface const surface(control);
  output_file file(output);
  subdivided_model const model = surface.to_bezier(o.level, o.cap == "bspline" ? end_cap::bspline : end_cap::gregory,
                                                   o.creases == "cut" ? semi_sharp::cut : semi_sharp::isolate);
  file.write(to_bpt(model.patches));
  if (o.quiet) return;
  std::printf("%s: %zu patches of %zu faces, level %d, end caps %s\n", output.string().c_str(), model.patches.size(),
              control.faces.size(), o.level, o.cap.c_str());
  if (std::string const ignored = describe_ignored(control); !ignored.empty())
    std::printf("%s: %s\n", mesh.string().c_str(), ignored.c_str());
  if (o.samples == 0) return;
  limit_distances const d = surface.distances(model, o.samples);
  std::printf(
      "distance from the limit surface, in diagonals, at %zu points: largest %.2g, rms %.2g; %zu patches exact\n",
      d.samples, d.largest, d.rms, d.exact_patches);
  if (!d.complaints.empty())
    std::printf("%s: the distance may be wrong, OpenSubdiv says of its limit surface: %s\n", mesh.string().c_str(),
                d.complaints.c_str());
}

void import_all(import_options const& o) {
  bool const is_folder = std::filesystem::is_directory(o.output);
  if (o.meshes.size() > 1 && !is_folder)
    throw std::runtime_error(o.output + ": expected a folder for " + std::to_string(o.meshes.size()) +
                             " meshes, got none");
  for (std::filesystem::path const mesh : o.meshes) {
    std::filesystem::path const output = o.output;
    import_mesh(o, mesh, is_folder ? (output / mesh.filename()).replace_extension(".bpt") : output);
  }
}

}  // namespace

int main(int argc, char** argv) {
  import_options options;
  CLI::App app("Makes bicubic Bezier patches of Catmull-Clark control meshes, by OpenSubdiv.", "patchrt-import");
  add_options(app, options);
  return run_program(app, argc, argv, [&] { import_all(options); });
}
