// SPDX-License-Identifier: MIT
/// \file
/// Scenes of triangles and of spheres against Embree: build, memory, nearest hits and any hits of coherent and incoherent
/// rays, wrong hits; one program, one thread, one run, the same rays. See docs/PERFORMANCE.md.

#include "../examples/support/load_mesh.hpp"
#include "../examples/support/procedural_meshes.hpp"
#include "../examples/support/sphereflake.hpp"
#include "support/round_robin.hpp"
#include "support/workload.hpp"
#if PATCHRT_HAVE_EMBREE
#  include "support/embree_rays.hpp"
#  include "support/embree_shapes.hpp"
#endif

#include <patchrt/accel/build_scene.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/accel/scene_triangle.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/scene_hits.hpp>

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>

namespace {

using namespace patchrt;
using namespace patchrt::bench;

struct settings {
  std::vector<std::string> meshes;
  std::string stadium = "data/teapot_mesh.obj";
  int size = 1024;
  int rounds = 5;
  int sphere = 289;
  int flake = 4;
};

/// What is timed on one set of rays, and how its hits stand beside those of doubles.
struct method {
  std::string name;
  double build_seconds;
  double bytes;  // a shape
  std::function<std::vector<answer>(std::vector<ray<double>> const&)> answers;
  std::function<std::function<void()>(std::vector<ray<double>> const&, query)> prepare;
};

std::vector<ray<float>> narrowed(std::vector<ray<double>> const& rays) {
  std::vector<ray<float>> all;
  for (auto const& r : rays)
    all.push_back({vec3<float>(r.origin), vec3<float>(r.direction), float(r.t_min), float(r.t_max)});
  return all;
}

template <class R> std::vector<answer> read(std::vector<scene_hit<R>> const& hits) {
  std::vector<answer> all;
  for (auto const& h : hits) all.push_back(h.valid() ? answer{double(h.t), double(h.u), double(h.v), h.shape} : miss());
  return all;
}

/// How rays are given: all in one list, or one a call.
enum class calls { list, single };

template <class Shape> method our_method(std::string name, std::vector<Shape> const& shapes, calls how) {
  std::shared_ptr<scene<Shape>> built;
  double const seconds = thread_seconds([&] {
    built = std::make_shared<scene<Shape>>(
        build_scene<Shape>({.wide = true, .stackless = false}, serial{}, std::span<Shape const>(shapes)));
  });
  auto const find_nearest = [built, how](std::span<ray<float> const> rays, std::span<scene_hit<float>> hits) {
    auto const view = built->view();
    if (how == calls::single)
      for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = trace::closest_hit(view, rays[i]);
    else trace::closest_hits(view, rays, hits, serial{});
  };
  auto const find_any = [built, how](std::span<ray<float> const> rays, std::span<std::uint8_t> hit) {
    auto const view = built->view();
    if (how == calls::single)
      for (std::size_t i = 0; i < rays.size(); ++i) hit[i] = trace::any_hit(view, rays[i]);
    else trace::any_hits(view, rays, hit, serial{});
  };
  auto const prepare = [=](std::vector<ray<double>> const& rays, query what) -> std::function<void()> {
    auto const in = std::make_shared<std::vector<ray<float>>>(narrowed(rays));
    if (what == query::any) {
      auto const out = std::make_shared<std::vector<std::uint8_t>>(in->size());
      return [find_any, in, out] { find_any(*in, *out); };
    }
    auto const out = std::make_shared<std::vector<scene_hit<float>>>(in->size());
    return [find_nearest, in, out] { find_nearest(*in, *out); };
  };
  auto const answers = [find_nearest](std::vector<ray<double>> const& rays) {
    auto const in = narrowed(rays);
    std::vector<scene_hit<float>> out(in.size());
    find_nearest(in, out);
    return read(out);
  };
  return {std::move(name), seconds, double(built->bytes()) / double(shapes.size()), answers, prepare};
}

#if PATCHRT_HAVE_EMBREE
template <int N>
method embree_method(std::string name, std::shared_ptr<embree_shapes> const& shapes, std::size_t count,
                     RTCIntersectContextFlags flags) {
  auto const prepare = [shapes, flags](std::vector<ray<double>> const& rays, query what) -> std::function<void()> {
    auto const packets = std::make_shared<embree_rays<N>>(rays, what);
    return [shapes, flags, packets] { packets->trace_prepared(*shapes, flags); };
  };
  auto const answers = [shapes, flags](std::vector<ray<double>> const& rays) {
    embree_rays<N> packets(rays, query::nearest);
    packets.trace_prepared(*shapes, flags);
    return packets.answers(*shapes);
  };
  return {std::move(name), shapes->build_seconds(), double(shapes->bytes()) / double(count), answers, prepare};
}

void add_embree(std::vector<method>& methods, std::shared_ptr<embree_shapes> const& shapes, std::size_t count,
                std::string const& of) {
  methods.push_back(embree_method<1>("Embree 1" + of, shapes, count, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT));
  methods.push_back(embree_method<16>("Embree 16 coherent" + of, shapes, count, RTC_INTERSECT_CONTEXT_FLAG_COHERENT));
  methods.push_back(
      embree_method<16>("Embree 16 incoherent" + of, shapes, count, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT));
}
#endif

/// Rays whose hit is missing, invented or farther from the reference's than 1e-4 of its distance, and the error of t
/// otherwise, relative to it.
struct comparison {
  std::size_t wrong = 0, hits = 0;
  double worst = 0, squares = 0;
  double rms() const { return hits > 0 ? std::sqrt(squares / double(hits)) : 0; }
};
comparison compare(std::vector<answer> const& got, std::vector<answer> const& want) {
  comparison c;
  for (std::size_t i = 0; i < got.size(); ++i) {
    double const off = std::abs(got[i].t - want[i].t) / std::max(std::abs(want[i].t), 1e-300);
    bool const bad = is_hit(got[i]) != is_hit(want[i]) || (is_hit(got[i]) && !(off <= 1e-4));
    c.wrong += bad;
    if (bad || !is_hit(got[i])) continue;
    ++c.hits;
    c.worst = std::max(c.worst, off);
    c.squares += off * off;
  }
  return c;
}

template <class Reference, class Normal>
void study(std::string const& name, std::size_t count, std::vector<method> methods,
           std::vector<std::pair<std::string, std::string>> const& pairs, Reference const& reference,
           Normal const& normal_at, camera const& eye, double diagonal, settings const& s) {
  auto const primary = primary_rays(eye, s.size, s.size);
  std::vector<scene_hit<double>> first(primary.size());
  trace::closest_hits(reference.view(), std::span<ray<double> const>(primary), std::span(first), serial{});
  std::mt19937_64 bits(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<ray<double>> diffuse;
  for (std::size_t i = 0; i < primary.size(); ++i) {
    if (!first[i].valid()) continue;
    vec3<double> const at = primary[i].origin + first[i].t * primary[i].direction;
    vec3<double> n = unit(normal_at(first[i].shape, at));
    if (dot(n, primary[i].direction) > 0) n = -n;
    double const z = 1 - 2 * uniform(bits), phi = 2 * std::numbers::pi * uniform(bits), q = std::sqrt(1 - z * z);
    vec3<double> const lobe = n + 0.999 * vec3<double>(q * std::cos(phi), q * std::sin(phi), z);
    // As float sees it: the reference meets the very same rays.
    vec3<float> const o(at + 1e-4 * diagonal * n), d(unit(lobe));
    diffuse.push_back({vec3<double>(o), vec3<double>(d), 0, std::numeric_limits<double>::infinity()});
  }
  std::vector<ray<double>> rounded;
  for (auto const& r : primary)
    rounded.push_back({vec3<double>(vec3<float>(r.origin)), vec3<double>(vec3<float>(r.direction)), 0, r.t_max});
  std::printf("%s: %zu shapes; %zu primary rays, %zu diffuse\n", name.c_str(), count, rounded.size(), diffuse.size());
  std::printf("camera: eye %.9g %.9g %.9g, look at %.9g %.9g %.9g, vfov %g\n", eye.eye.x, eye.eye.y, eye.eye.z,
              eye.look_at.x, eye.look_at.y, eye.look_at.z, eye.vfov_degrees);
  std::printf("%-32s %9s %8s %9s %9s %9s %9s %6s %9s %9s %9s %9s\n", "method", "build ms", "bytes", "primary", "any",
              "diffuse", "any", "wrong", "t RMS", "t max", "t RMS", "t max");
  std::vector<contender> sets[4];
  for (int k = 0; k < 4; ++k) {
    for (method const& m : methods)
      sets[k].push_back({m.name, m.prepare(k < 2 ? rounded : diffuse, k % 2 == 0 ? query::nearest : query::any)});
    run_round_robin(sets[k], s.rounds);
  }
  for (std::size_t i = 0; i < methods.size(); ++i) {
    auto const compared = [&](std::vector<ray<double>> const& rays) {
      std::vector<scene_hit<double>> want(rays.size());
      trace::closest_hits(reference.view(), std::span<ray<double> const>(rays), std::span(want), serial{});
      return compare(methods[i].answers(rays), read(want));
    };
    comparison const of_primary = compared(rounded), of_diffuse = compared(diffuse);
    auto const rate = [&](int k) {
      return 1e-6 * double((k < 2 ? rounded : diffuse).size()) / median_seconds(sets[k][i]);
    };
    std::printf("%-32s %9.1f %8.1f %9.2f %9.2f %9.2f %9.2f %6zu %9.2g %9.2g %9.2g %9.2g\n", methods[i].name.c_str(),
                1e3 * methods[i].build_seconds, methods[i].bytes, rate(0), rate(1), rate(2), rate(3),
                of_primary.wrong + of_diffuse.wrong, of_primary.rms(), of_primary.worst, of_diffuse.rms(),
                of_diffuse.worst);
  }
  auto const seconds = [&](int k, std::string const& of) {
    for (contender const& c : sets[k])
      if (c.name == of) return median_seconds(c);
    return 0.0;
  };
  for (auto const& [ours, theirs] : pairs) {
    std::printf("%s over %s:", ours.c_str(), theirs.c_str());
    for (int k = 0; k < 4; ++k) std::printf(" %.2f", seconds(k, theirs) / seconds(k, ours));
    std::printf("\n");
  }
  std::printf("\n");
}

camera from_afar(box<double> const& b, vec3<double> const& direction) {
  vec3<double> const middle = 0.5 * (b.lo + b.hi), e = extent(b);
  return {middle + 1.1 * std::sqrt(dot(e, e)) * unit(direction), middle, {0, 1, 0}, 50};
}

void study_mesh(std::string const& name, examples::mesh const& m, camera const* eye, settings const& s) {
  std::vector<vec3<float>> vertices;
  box<double> all = box<double>::empty();
  for (auto const& v : m.vertices) {
    vertices.emplace_back(v);
    all = merge(all, vec3<double>(vertices.back()));
  }
  std::vector<scene_triangle<float>> triangles;
  std::vector<scene_triangle<float, moller_trumbore_form>> plain;
  std::vector<scene_triangle<double>> exact;
  for (auto const& t : m.triangles) {
    triangle<float> const f{vertices[t[0]], vertices[t[1]], vertices[t[2]]};
    triangles.push_back({f});
    plain.push_back({f});
    exact.push_back({{vec3<double>(f.a), vec3<double>(f.b), vec3<double>(f.c)}});
  }
  std::vector<method> methods{our_method("list, watertight", triangles, calls::list),
                              our_method("list, Moller-Trumbore", plain, calls::list),
                              our_method("single, watertight", triangles, calls::single),
                              our_method("single, Moller-Trumbore", plain, calls::single)};
#if PATCHRT_HAVE_EMBREE
  std::span<std::array<std::uint32_t, 3> const> const indices(m.triangles);
  add_embree(methods, std::make_shared<embree_shapes>(vertices, indices, false), indices.size(), "");
  add_embree(methods, std::make_shared<embree_shapes>(vertices, indices, true), indices.size(), ", robust");
#endif
  vec3<double> const e = extent(all);
  auto const normal_at = [&](int shape, vec3<double> const&) { return normal(exact[std::size_t(shape)]); };
  std::vector<std::pair<std::string, std::string>> pairs;
#if PATCHRT_HAVE_EMBREE
  for (auto const& [form, mode] : {std::pair{", Moller-Trumbore", ""}, std::pair{", watertight", ", robust"}}) {
    for (char const* theirs : {"Embree 16 coherent", "Embree 16 incoherent"})
      pairs.emplace_back(std::string("list") + form, std::string(theirs) + mode);
    pairs.emplace_back(std::string("single") + form, std::string("Embree 1") + mode);
  }
#endif
  study(name, triangles.size(), std::move(methods), pairs, build_scene(exact), normal_at,
        eye ? *eye : from_afar(all, {0.3, 0.25, 1}), std::sqrt(dot(e, e)), s);
}

void study_spheres(settings const& s) {
  std::vector<sphere<float>> spheres;
  std::vector<sphere<double>> exact;
  box<double> all = box<double>::empty();
  for (auto const& b : examples::sphereflake(s.flake)) {
    spheres.push_back({vec3<float>(b.centre), float(b.radius)});
    exact.push_back({vec3<double>(spheres.back().centre), spheres.back().radius});
    all = merge(all, bounds(exact.back()));
  }
  std::vector<method> methods{our_method("list", spheres, calls::list), our_method("single", spheres, calls::single)};
#if PATCHRT_HAVE_EMBREE
  add_embree(methods, std::make_shared<embree_shapes>(std::span<sphere<float> const>(spheres)), spheres.size(), "");
#endif
  vec3<double> const e = extent(all);
  auto const normal_at = [&](int shape, vec3<double> const& p) { return p - exact[std::size_t(shape)].centre; };
  std::vector<std::pair<std::string, std::string>> pairs;
#if PATCHRT_HAVE_EMBREE
  pairs = {{"list", "Embree 16 coherent"}, {"list", "Embree 16 incoherent"}, {"single", "Embree 1"}};
#endif
  study("sphereflake", spheres.size(), std::move(methods), pairs, build_scene(exact), normal_at,
        from_afar(all, {0.6, -1, 0.7}), std::sqrt(dot(e, e)), s);
}

int run(int argc, char** argv) {
  settings s;
  CLI::App app{"Scenes of triangles and of spheres against Embree"};
  app.add_option("--mesh", s.meshes, "triangles (.obj), repeatable");
  app.add_option("--stadium", s.stadium, "a model (.obj) to stand in a big room of 64000 triangles in all");
  app.add_option("--sphere", s.sphere, "a sphere of 12 N^2 triangles, 0 for none")->capture_default_str();
  app.add_option("--flake", s.flake, "the sphereflake's depth, -1 for none")->capture_default_str();
  app.add_option("--size", s.size, "pixels per side, a multiple of 4")
      ->check(CLI::Range(4, 16384))
      ->capture_default_str();
  app.add_option("--rounds", s.rounds, "times that everything is timed")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (s.size % 4 != 0) throw std::runtime_error("--size: expected a multiple of 4, got " + std::to_string(s.size));
  for (std::string const& file : s.meshes)
    study_mesh(std::filesystem::path(file).filename().string(), examples::load_mesh(file), nullptr, s);
  if (app.count("--stadium") > 0) {
    auto const model = examples::load_mesh(s.stadium);
    auto const room = examples::stadium(model, false);
    box<double> b = box<double>::empty();
    for (auto const& v : model.vertices) b = merge(b, v);
    vec3<double> const middle = 0.5 * (b.lo + b.hi);
    double const size = std::max({extent(b).x, extent(b).y, extent(b).z});
    camera const eye{middle + size * vec3<double>(-18, 8, 20), middle, {0, 1, 0}, 60};
    study_mesh("stadium", room, &eye, s);
  }
  if (s.sphere > 0) study_mesh("sphere", examples::sphere_mesh(s.sphere), nullptr, s);
  if (s.flake >= 0) study_spheres(s);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (std::exception const& e) {
    std::fprintf(stderr, "patchrt-scenes: %s\n", e.what());
    return 1;
  }
}
