// SPDX-License-Identifier: MIT
/// \file
/// What a hit is kept as, and what that costs its position, normal and shadow: point and normal in halves beside an
/// identifier, or t and the identifier.
/// \note Wood, McCane & King, "Ray tracing arbitrary objects on the GPU", IVCNZ 2004, figure 5.

#include "../examples/support/camera.hpp"
#include "../examples/support/command_line.hpp"
#include "../examples/support/sphereflake.hpp"

#include <patchrt/accel/build_scene.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/intersect/quadric_point.hpp>
#include <patchrt/numbers/half.hpp>
#include <patchrt/trace/scene_hits.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

namespace {

using namespace patchrt;
using namespace patchrt::examples;

struct settings {
  int size = 512;
  int depth = 3;
  std::vector<double> offsets{0, 1, 16, 256};
};

/// A hit as it is read back from its record.
struct read_back {
  vec3<double> position, normal;
};
struct record_kind {
  char const* name;
  int bytes;
  std::function<read_back(ray<double> const&, scene_hit<double> const&, sphere<double> const&)> keep;
};

vec3<double> unit(vec3<double> const& v) { return v / std::sqrt(dot(v, v)); }

vec3<double> in_halves(vec3<double> const& v) { return {double(half(v.x)), double(half(v.y)), double(half(v.z))}; }

read_back from_t(ray<double> const& r, double t, sphere<double> const& s) {
  vec3<double> const p = fma(t, r.direction, r.origin);
  return {p, unit(p - s.centre)};
}

std::vector<record_kind> record_kinds() {
  return {
      {"(x, nx) (y, ny) (z, nz) in halves, id", 16,
       [](ray<double> const& r, scene_hit<double> const& h, sphere<double> const& s) {
         auto const exact = from_t(r, h.t, s);
         return read_back{in_halves(exact.position), in_halves(exact.normal)};
       }},
      {"t in half, id", 6, [](auto const& r, auto const& h, auto const& s) { return from_t(r, double(half(h.t)), s); }},
      {"t in float, id", 8,
       [](auto const& r, auto const& h, auto const& s) { return from_t(r, double(float(h.t)), s); }},
      {"t in double, id", 12, [](auto const& r, auto const& h, auto const& s) { return from_t(r, h.t, s); }},
  };
}

void study(double offset, settings const& s) {
  std::vector<sphere<double>> spheres;
  box<double> all = box<double>::empty();
  for (auto const& f : sphereflake(s.depth)) {
    spheres.push_back({f.centre + vec3<double>(offset, 0, 0), f.radius});
    all = merge(all, bounds(spheres.back()));
  }
  auto const built = build_scene(spheres);
  vec3<double> const middle = 0.5 * (all.lo + all.hi), e = extent(all);
  double const diagonal = std::sqrt(dot(e, e));
  image_size const size{s.size, s.size};
  camera const view = look_at(middle + diagonal * vec3<double>(0.5, -0.9, 0.6), middle, {0, 0, 1}, 40, size);
  std::vector<ray<double>> rays;
  for (std::size_t i = 0; i < size.pixels(); ++i) rays.push_back(primary_ray(view, size, i));
  std::vector<scene_hit<double>> hits(rays.size());
  trace::closest_hits(built.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});

  vec3<double> const to_light = unit(vec3<double>(-0.6, -1, 1.3));
  constexpr double inf = std::numeric_limits<double>::infinity();
  auto const shadows = [&](std::vector<ray<double>> const& to) {
    std::vector<std::uint8_t> blocked(to.size());
    trace::any_hits(built.view(), std::span<ray<double> const>(to), std::span(blocked), serial{});
    return blocked;
  };
  // The truth: rays that start by the hit's own error bound.
  std::vector<std::size_t> seen;
  std::vector<ray<double>> exact;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].valid()) continue;
    seen.push_back(i);
    auto const r = make_centred_ray(rays[i].origin, rays[i].direction);
    auto const from = depart_from(r, spheres[std::size_t(hits[i].shape)], sphere_hit<double>{hits[i].t, true});
    exact.push_back({offset_origin(from, to_light), to_light, 0, inf});
  }
  auto const want = shadows(exact);
  for (record_kind const& kind : record_kinds()) {
    double squares = 0, worst = 0, turned = 0;
    std::vector<ray<double>> from;
    double const lift = 1e-4 * diagonal;
    for (std::size_t i : seen) {
      sphere<double> const& ball = spheres[std::size_t(hits[i].shape)];
      read_back const kept = kind.keep(rays[i], hits[i], ball), truth = from_t(rays[i], hits[i].t, ball);
      vec3<double> const off = kept.position - truth.position;
      squares += dot(off, off);
      worst = std::max(worst, std::sqrt(dot(off, off)));
      double const cosine = std::clamp(dot(unit(kept.normal), truth.normal), -1., 1.);
      turned = std::max(turned, std::acos(cosine) * 180 / std::numbers::pi);
      double const side = dot(kept.normal, to_light) < 0 ? -lift : lift;
      from.push_back({kept.position + side * kept.normal, to_light, 0, inf});
    }
    auto const got = shadows(from);
    std::size_t wrong = 0;
    for (std::size_t k = 0; k < got.size(); ++k) wrong += got[k] != want[k];
    std::printf("| %g | %s | %d | %.1e | %.1e | %.2g | %.2f %% |\n", offset, kind.name, kind.bytes,
                std::sqrt(squares / double(seen.size())) / diagonal, worst / diagonal, turned,
                100 * double(wrong) / double(got.size()));
  }
}

}  // namespace

int main(int argc, char** argv) {
  settings s;
  CLI::App app("What a hit is kept as, and what that costs: a sphereflake, 2 across, at some distances from 0.",
               "patchrt-hit-record");
  app.add_option("--size", s.size, "Pixels a side")->check(CLI::Range(4, 8192))->capture_default_str();
  app.add_option("--depth", s.depth, "Of the sphereflake")->check(CLI::Range(0, 6))->capture_default_str();
  app.add_option("--offsets", s.offsets, "Distances of its middle from 0")->delimiter(',');
  return run_program(app, argc, argv, [&] {
    std::printf(
        "| offset | record | bytes | position, RMS | worst | normal, degrees | wrong shadows "
        "|\n|---|---|---|---|---|---|---|\n");
    for (double offset : s.offsets) study(offset, s);
  });
}
