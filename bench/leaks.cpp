// SPDX-License-Identifier: MIT
/// \file
/// The leaky teapot: rays that should meet a tessellated model and do not, by the numbers that triangles are met in.
///
/// Every ray is tested against every triangle. Vertices and rays are rounded to the number type; what they should meet
/// is told by the watertight form in double on the same rounded numbers, so that only the kernel's own rounding counts.
/// \note Carr, Hall & Hart, "The Ray Engine", Graphics Hardware 2002, figure 4.

#include "support/tessellation.hpp"

#include <patchrt/intersect/ray_triangle_watertight.hpp>
#include <patchrt/numbers/fixed.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/numbers/pack.hpp>

#include "../examples/support/camera.hpp"
#include "../examples/support/command_line.hpp"
#include "../examples/support/model.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct settings {
  std::string model = "data/teapot.bpt";
  std::vector<int> sizes{64, 128, 256};
  int cells = 4;
  double field_of_view = 40;
  double scale = 0.5;
  std::string csv;
  std::string pictures;
};

constexpr double no_hit = std::numeric_limits<double>::infinity();

/// The nearest hit of one ray.
struct nearest_hit {
  double t = no_hit;
  std::size_t triangle = 0;
};

/// The triangles of a model, and rays at it in the order of `tiled_pixel`.
struct scene {
  std::vector<triangle<double>> triangles;
  std::vector<ray<double>> rays;
  image_size size;
  double diagonal;
};

std::vector<triangle<double>> triangles_of(std::vector<bicubic_patch<double>> const& patches, int cells) {
  bench::tessellation const mesh(patches, cells);
  std::vector<triangle<double>> all;
  std::size_t const side = std::size_t(cells) + 1;
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (std::size_t i = 0; i + 1 < side; ++i)
      for (std::size_t j = 0; j + 1 < side; ++j) {
        auto const vertex = [&](std::size_t di, std::size_t dj) {
          return convert_vec<double>(mesh.vertices[(p * side + i + di) * side + j + dj]);
        };
        all.push_back({vertex(0, 0), vertex(1, 0), vertex(1, 1)});
        all.push_back({vertex(0, 0), vertex(1, 1), vertex(0, 1)});
      }
  return all;
}

/// Out of line: g++ 12's vectoriser drops some of the roundings of double to float and back that it sees together.
template <class T> PATCHRT_OUTLINE vec3<T> rounded(vec3<double> const& v) { return convert_vec<T>(v); }

/// Numbers as T holds them.
template <class T> scene rounded(scene s) {
  auto const round = [](vec3<double>& v) { v = convert_vec<double>(rounded<T>(v)); };
  for (auto& t : s.triangles) round(t.a), round(t.b), round(t.c);
  for (auto& r : s.rays) round(r.origin), round(r.direction);
  return s;
}

/// The engine form with normals of length 1, from double: in coarse numbers the product of two edges of a small
/// triangle has few digits left.
struct unit_normal_form : engine_form {
  template <scalar S> static prepared<S> prepare(triangle<S> const& t) {
    auto const p = engine_form::prepare(
        triangle<double>{convert_vec<double>(t.a), convert_vec<double>(t.b), convert_vec<double>(t.c)});
    double const length = std::sqrt(dot(p.n, p.n));
    return {t.a,
            t.b,
            convert_vec<S>(length > 0 ? p.n / length : p.n),
            convert_vec<S>(p.ac),
            convert_vec<S>(p.ba),
            convert_vec<S>(p.cb)};
  }
};

template <class Form, class T> std::vector<nearest_hit> trace(scene const& s) {
  std::vector<typename Form::template prepared<lane_t<T>>> triangles;
  for (auto const& t : s.triangles) {
    using L = lane_t<T>;
    triangles.push_back(Form::prepare(triangle<L>{convert_vec<L>(t.a), convert_vec<L>(t.b), convert_vec<L>(t.c)}));
  }
  constexpr int lanes = lanes_v<T>;
  std::vector<nearest_hit> hits(s.rays.size());
  for (std::size_t first = 0; first < s.rays.size(); first += std::size_t(lanes)) {
    auto const lane = [&](vec3<double> ray<double>::*of, int axis) {
      lane_t<T> x[std::size_t(lanes)];
      for (int i = 0; i < lanes; ++i) {
        std::size_t const k = std::min(first + std::size_t(i), s.rays.size() - 1);
        x[i] = static_cast<lane_t<T>>(component(s.rays[k].*of, axis));
      }
      T r;
      load_lanes(x, r);
      return r;
    };
    auto const vec = [&](vec3<double> ray<double>::*of) { return vec3<T>{lane(of, 0), lane(of, 1), lane(of, 2)}; };
    auto const constants = Form::make_ray(vec(&ray<double>::origin), vec(&ray<double>::direction));
    T const t_min(lane_t<T>(0));
    T t_max(std::numeric_limits<lane_t<T>>::infinity());
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      auto const hit = intersect<Form>(constants, triangles[k], t_min, t_max);
      if (!any_of(hit.valid)) continue;
      t_max = select(hit.valid, hit.t, t_max);
      lane_t<T> t[std::size_t(lanes)];
      store_lanes(t_max, t);
      for (int i = 0; i < lanes; ++i)
        if ((mask_bits(hit.valid) >> i & 1u) && first + std::size_t(i) < hits.size())
          hits[first + std::size_t(i)] = {static_cast<double>(t[i]), k};
    }
  }
  return hits;
}

enum class verdict { background, right, misplaced, leak, through, invented };

struct counts {
  std::size_t hits = 0;       ///< rays that should hit
  std::size_t leaks = 0;      ///< of these, those that hit nothing
  std::size_t through = 0;    ///< those that hit a tenth of a diagonal away or more: what is behind
  std::size_t misplaced = 0;  ///< those that hit a hundredth of a diagonal away or more
  std::size_t invented = 0;   ///< rays that should hit nothing and do
  double t_error = 0;         ///< the largest of hits that are right, in diagonals
};

verdict judge(scene const& s, std::size_t i, nearest_hit const& found, nearest_hit const& wanted, counts& n) {
  if (wanted.t == no_hit) {
    n.invented += found.t != no_hit;
    return found.t == no_hit ? verdict::background : verdict::invented;
  }
  ++n.hits;
  if (found.t == no_hit) return ++n.leaks, verdict::leak;
  vec3<double> const& d = s.rays[i].direction;
  double const off = std::abs(found.t - wanted.t) * std::sqrt(dot(d, d)) / s.diagonal;
  if (!(off < 0.1)) return ++n.through, verdict::through;
  if (!(off < 0.01)) return ++n.misplaced, verdict::misplaced;
  n.t_error = std::max(n.t_error, off);
  return verdict::right;
}

rgb8 colour(scene const& s, std::size_t i, nearest_hit const& found, verdict v) {
  if (v == verdict::background) return {255, 255, 255};
  if (v == verdict::leak || v == verdict::through) return {220, 0, 0};
  if (v == verdict::misplaced) return {255, 170, 60};
  if (v == verdict::invented) return {0, 60, 220};
  vec3<double> const n = normal(s.triangles[found.triangle]), d = s.rays[i].direction;
  double const cosine = std::abs(dot(n, d)) / std::sqrt(dot(n, n) * dot(d, d));
  auto const grey = static_cast<std::uint8_t>(90 + 140 * (cosine < 1 ? cosine : 1));
  return {grey, grey, grey};
}

/// One number type and form.
struct contender {
  char const* number;
  char const* form;
  std::vector<nearest_hit> (*trace)(scene const&);
  scene (*round)(scene);
};

std::string file_name(contender const& c) {
  std::string name = std::string("leaks_") + c.number + '_' + c.form + ".png";
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

std::vector<contender> contenders() {
  using fixed16 = fixed<std::int16_t, 8>;
  return {{"fixed16", "engine", trace<engine_form, fixed16>, rounded<fixed16>},
          {"fixed16", "unit normal", trace<unit_normal_form, fixed16>, rounded<fixed16>},
          {"half", "engine", trace<engine_form, half>, rounded<half>},
          {"float", "engine", trace<engine_form, pack<float, 16>>, rounded<float>},
          {"double", "engine", trace<engine_form, pack<double, 8>>, rounded<double>},
          {"float", "watertight", trace<watertight_form, pack<float, 16>>, rounded<float>}};
}

/// What all rays found. Rays that are lost or invented are 3 x 3 pixels, so that one alone is seen.
image draw(scene const& s, std::vector<nearest_hit> const& found, std::vector<nearest_hit> const& wanted, counts& n) {
  image picture(s.size);
  std::vector<std::size_t> marked;
  for (std::size_t i = 0; i < s.rays.size(); ++i) {
    pixel const p = tiled_pixel(s.size, i);
    verdict const v = judge(s, i, found[i], wanted[i], n);
    picture(p.x, p.y) = colour(s, i, found[i], v);
    if (v == verdict::leak || v == verdict::through || v == verdict::invented) marked.push_back(i);
  }
  for (std::size_t const i : marked) {
    pixel const p = tiled_pixel(s.size, i);
    rgb8 const mark = picture(p.x, p.y);
    for (int y = std::max(p.y - 1, 0); y < std::min(p.y + 2, s.size.height); ++y)
      for (int x = std::max(p.x - 1, 0); x < std::min(p.x + 2, s.size.width); ++x) picture(x, y) = mark;
  }
  return picture;
}

/// Pictures of one size in rows of three.
image side_by_side(std::vector<image> pictures) {
  image_size const one = pictures.front().size;
  int const columns = 3, rows = (int(pictures.size()) + columns - 1) / columns;
  image all({columns * one.width, rows * one.height});
  for (std::size_t k = 0; k < pictures.size(); ++k)
    for (int y = 0; y < one.height; ++y)
      for (int x = 0; x < one.width; ++x)
        all(int(k) % columns * one.width + x, int(k) / columns * one.height + y) = pictures[k](x, y);
  return all;
}

void run(settings const& s) {
  auto patches = load_bpt(s.model);
  for (auto& p : patches)
    for (auto& c : p.control_points) c = c * s.scale;
  vec3<double> const extents = extent(bounds(patches));
  std::optional<output_file> csv;
  if (!s.csv.empty()) csv.emplace(s.csv);
  std::string table = "numbers,form,size,rays_that_hit,leaks,through,misplaced,invented,largest_error\n";
  std::printf("%s: %zu patches, %d x %d cells each\n", s.model.c_str(), patches.size(), s.cells, s.cells);
  std::printf("%-8s %-11s %5s %8s %8s %8s %9s %8s %10s\n", "numbers", "form", "size", "hits", "leaks", "through",
              "misplaced", "invented", "error");
  for (int const size : s.sizes) {
    scene exact{triangles_of(patches, s.cells), {}, {size, size}, std::sqrt(dot(extents, extents))};
    camera const view = frame(patches, {0, 0, 1}, s.field_of_view, exact.size);
    for (std::size_t i = 0; i < exact.size.pixels(); ++i) exact.rays.push_back(primary_ray(view, exact.size, i));
    std::vector<image> pictures;
    for (contender const& c : contenders()) {
      scene const here = c.round(exact);
      auto const wanted = trace<watertight_form, pack<double, 8>>(here);
      auto const found = c.trace(here);
      counts n;
      pictures.push_back(draw(here, found, wanted, n));
      std::printf("%-8s %-11s %5d %8zu %8zu %8zu %9zu %8zu %10.2g\n", c.number, c.form, size, n.hits, n.leaks,
                  n.through, n.misplaced, n.invented, n.t_error);
      std::fflush(stdout);
      char line[200];
      std::snprintf(line, sizeof line, "%s,%s,%d,%zu,%zu,%zu,%zu,%zu,%.3g\n", c.number, c.form, size, n.hits, n.leaks,
                    n.through, n.misplaced, n.invented, n.t_error);
      table += line;
      if (!s.pictures.empty() && size == s.sizes.back()) {
        output_file file(std::filesystem::path(s.pictures) / file_name(c));
        write_png(file, pictures.back());
      }
    }
    if (!s.pictures.empty() && size == s.sizes.back()) {
      output_file file(std::filesystem::path(s.pictures) / "leaks.png");
      write_png(file, side_by_side(pictures));
    }
  }
  if (csv) csv->write(table);
}

}  // namespace

int main(int argc, char** argv) {
  settings s;
  CLI::App app{"Rays that leak through a tessellated model, by the numbers that its triangles are met in",
               "patchrt-leaks"};
  app.add_option("--model", s.model, "patches (.bpt)")->capture_default_str();
  app.add_option("--size", s.sizes, "width and height of the pictures, one or more")
      ->delimiter(',')
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  app.add_option("--cells", s.cells, "a patch is cut into N x N cells of two triangles")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  app.add_option("--fov", s.field_of_view, "vertical field of view in degrees")
      ->check(CLI::Range(1., 150.))
      ->capture_default_str();
  app.add_option("--scale", s.scale,
                 "of the model: what is to fit into the range of fixed16, -8 to 8, is all distances from the eye")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--csv", s.csv, "file for all figures");
  app.add_option("--pictures", s.pictures, "folder for pictures of the last size")->check(CLI::ExistingDirectory);
  return run_program(app, argc, argv, [&] { run(s); });
}
