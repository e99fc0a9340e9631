// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <algorithm>
#include <iostream>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// A list of hits beside all roots that the oracle finds.
struct comparison {
  std::size_t rays = 0;
  std::size_t certain = 0;  ///< rays with a root that any right answer has
  std::size_t lost = 0;     ///< of these, rays whose hit is farther than such a root, or missing
  double lost_cos = 0;      ///< the largest |cosine| between ray and normal at a lost root
  double apart = 0;         ///< the largest distance between a hit's points on the ray and on the patch
  double apart_singular =
      0;                 ///< the same, in diagonals of the scene, where the patch is grazed or its tangents are short
  double error = 0;      ///< the largest distance along the ray to the root, times |cosine| there
  bool in_range = true;  ///< all t in (t_min, t_max), all u and v in [0, 1]

  void add(comparison const& o) {
    rays += o.rays;
    certain += o.certain;
    lost += o.lost;
    lost_cos = std::max(lost_cos, o.lost_cos);
    apart = std::max(apart, o.apart);
    apart_singular = std::max(apart_singular, o.apart_singular);
    error = std::max(error, o.error);
    in_range = in_range && o.in_range;
  }
};
std::ostream& operator<<(std::ostream& out, comparison const& c) {
  return out << c.certain << " of " << c.rays << " rays hit for certain, " << c.lost << " lost (cosine up to "
             << c.lost_cos << "), apart " << c.apart << " units and " << c.apart_singular
             << " diagonals, along the ray " << c.error << " units";
}

/// What is asked of an accuracy level. The unit of distances is `epsilon` times (half the diagonal of what is hit + the
/// distance of the ray's origin from its middle): of the patch's box, or of the whole scene's.
struct demand {
  double epsilon;
  bool of_scene;
  double least_cos;  ///< roots nearer to grazing may be lost
  double edge;       ///< so may roots nearer to an edge, relative to the scene
};
constexpr demand in_double{0x1p-52, false, 1e-2, 1e-9};
constexpr demand in_float{0x1p-23, true, 2e-2, 1e-5};

comparison compare(patch_list const& scene, ray_list const& rays, std::vector<patch_hit> const& hits,
                   demand const& asked) {
  auto const numbers = numbers_of(scene);
  oracle const truth(numbers);
  auto const whole = ball_of(scene);
  comparison c;
  c.rays = rays.size();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    auto const& r = rays[i];
    auto const& hit = hits[i];
    auto const roots = truth.all_hits(numbers_of(r), 1e-6);
    double const length = norm(r.direction);
    auto const ball = hit.valid() && !asked.of_scene ? ball_of({scene[std::size_t(hit.patch)]}) : whole;
    double const unit = asked.epsilon * (ball.radius + norm(r.origin - ball.middle));
    double const nearby = 1e3 * unit / length;
    bool is_certain = false, is_lost = false;
    for (auto const& root : roots) {
      if (!root.is_certain(asked.least_cos, asked.edge * whole.radius)) continue;
      is_certain = true;
      if (!(root.t < hit.t - nearby)) continue;
      is_lost = true;
      c.lost_cos = std::max(c.lost_cos, root.cos_angle);
    }
    c.certain += is_certain;
    c.lost += is_lost;
    if (!hit.valid()) continue;
    c.in_range =
        c.in_range && r.t_min < hit.t && hit.t < r.t_max && 0 <= hit.u && hit.u <= 1 && 0 <= hit.v && hit.v <= 1;
    double const apart = double(truth.distance(hit.patch, numbers_of(r), hit.t, hit.u, hit.v));
    auto const& patch = scene[std::size_t(hit.patch)];
    double const size = ball_of({patch}).radius;
    auto const tangents = evaluate(patch, hit.u, hit.v);
    if (std::fabs(dot(cross(tangents.du, tangents.dv), r.direction)) > asked.least_cos * size * size * length)
      c.apart = std::max(c.apart, apart / unit);
    else c.apart_singular = std::max(c.apart_singular, apart / whole.radius);
    for (auto const& root : roots) {
      bool const is_same =
          root.patch == hit.patch && std::fabs(root.u - hit.u) < 1e-3 && std::fabs(root.v - hit.v) < 1e-3;
      if (!is_same || root.singular || root.cos_angle < asked.least_cos) continue;
      double const off = std::fabs(double(root.t - hit.t));
      if (off < nearby / root.cos_angle) c.error = std::max(c.error, off * length * root.cos_angle / unit);
    }
  }
  return c;
}

template <accuracy A> comparison compare(patch_list const& scene, ray_list const& rays, demand const& asked) {
  mixed_hierarchy_options options;
  options.join_tolerance = 0;  // the patches as they are: gaps of files are no surface
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(scene), options, serial{});
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h.view(), std::span<ray<double> const>(rays), std::span(hits), serial{});
  return compare(scene, rays, hits, asked);
}

/// All kinds of rays, about 4 n of them.
ray_list rays_of_all_kinds(patch_list const& scene, int n, std::mt19937& g) {
  ray_list rays = view_rays(scene, 4, int(std::sqrt(n / 4)), g);
  for (auto const& more : {chords(scene, n, g), rays_at_edges(scene, n, g), bounces(scene, n, g)})
    rays.insert(rays.end(), more.begin(), more.end());
  return rays;
}

void require_refined(comparison const& c) {
  CAPTURE(c);
  CHECK(c.certain > c.rays / 4);
  CHECK(c.lost == 0);
  CHECK(c.in_range);
  CHECK(c.apart < 64);
  CHECK(c.apart_singular < 1e-8);  // a double root moves by the root of the rounding
  CHECK(c.error < 4);
}

void require_fast(comparison const& c) {
  CAPTURE(c);
  CHECK(c.lost <= c.certain / 500);
  CHECK(c.in_range);
  CHECK(c.apart < 16);
  CHECK(c.apart_singular < 2e-5);
  CHECK(c.error < 16);
}

void require_reference(comparison const& c) {
  CAPTURE(c);
  CHECK(c.lost <= c.certain / 20);
  CHECK(c.in_range);
  CHECK(c.apart < 32);
  CHECK(c.error < 32);
}

void check_model(char const* name, int n, unsigned seed) {
  auto const scene = load_model(name);
  if (scene.empty()) PATCHRT_SKIP(std::string("no ") + name + ".bpt in PATCHRT_SHARED_DATA");
  CAPTURE(name, seed);
  std::mt19937 g(seed);
  ray_list const rays = rays_of_all_kinds(scene, n, g);
  auto const refined = compare<accuracy::refined>(scene, rays, in_double);
  auto const fast = compare<accuracy::fast>(scene, rays, in_float);
  auto const reference = compare<accuracy::reference>(scene, rays, in_double);
  std::cout << name << ", refined: " << refined << '\n'
            << name << ", fast: " << fast << '\n'
            << name << ", reference: " << reference << std::endl;
  require_refined(refined);
  require_fast(fast);
  require_reference(reference);
}

/// Random patches of one kind, each a scene of its own.
template <class Make> void check_random(char const* name, unsigned seed, Make make) {
  CAPTURE(name, seed);
  std::mt19937 g(seed);
  comparison refined, fast, reference;
  for (int k = 0; k < 40; ++k) {
    patch_list const scene{make(g)};
    ray_list const rays = rays_of_all_kinds(scene, 32, g);
    refined.add(compare<accuracy::refined>(scene, rays, in_double));
    fast.add(compare<accuracy::fast>(scene, rays, in_float));
    reference.add(compare<accuracy::reference>(scene, rays, in_double));
  }
  std::cout << name << ", refined: " << refined << '\n'
            << name << ", fast: " << fast << '\n'
            << name << ", reference: " << reference << std::endl;
  require_refined(refined);
  require_fast(fast);
  CHECK(reference.in_range);
  CHECK(reference.apart < 32);
}

}  // namespace

TEST_CASE("hits on the teapot are the oracle's, at every accuracy") { check_model("teapot", 2000, 1); }
TEST_CASE("hits on Gumbo are the oracle's, at every accuracy") { check_model("gumbo", 1200, 2); }
TEST_CASE("hits on bigguy are the oracle's, at every accuracy") { check_model("bigguy_osd_L2", 800, 3); }

TEST_CASE("hits on random sheets are the oracle's") {
  check_random("sheet", 4, [](std::mt19937& g) { return random_sheet(g, 0.3); });
}

TEST_CASE("hits on patches that fold and cross themselves are the oracle's") {
  check_random("wild", 5, [](std::mt19937& g) { return random_patch<double>(g); });
}

TEST_CASE("hits on patches with collapsed edges are the oracle's") {
  check_random("collapsed", 6, [](std::mt19937& g) {
    auto p = random_sheet(g, 0.3);
    bool const along_u = g() % 2;
    for (int k = 1; k < 4; ++k) (along_u ? p(k, 0) : p(0, k)) = p(0, 0);
    if (g() % 2)
      for (int k = 0; k < 3; ++k) (along_u ? p(k, 3) : p(3, k)) = p(3, 3);
    return p;
  });
}

TEST_CASE("patches up to a thousand times as long as wide and thick lose no hit away from grazing") {
  unsigned const seed = 7;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (double width : {1.0, 0.1, 1e-2, 1e-3}) {
    std::size_t aimed = 0, lost_refined = 0, lost_fast = 0;
    for (int k = 0; k < 40; ++k) {
      auto p = random_sheet(g, 0.3);
      auto const x = random_direction(g), across = cross(x, random_direction(g)), y = across / norm(across);
      for (auto& c : p.control_points) c = x * (width * c.x) + cross(x, y) * c.y + y * (width * c.z);
      ray_list rays;
      std::vector<double> t;
      while (rays.size() < 200) {
        auto const q = evaluate(p, uniform(g, 0.05, 0.95), uniform(g, 0.05, 0.95));
        auto const normal = cross(q.du, q.dv), d = random_direction(g);
        if (!(std::fabs(dot(d, normal)) > 0.1 * norm(normal))) continue;
        t.push_back(uniform(g, 0.5, 4));
        rays.push_back({q.position - d * t.back(), d, 0, no_limit});
      }
      auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(&p, 1), {}, serial{});
      std::vector<patch_hit> refined(rays.size()), fast(rays.size());
      trace::closest_hits<accuracy::refined>(h.view(), std::span<ray<double> const>(rays), std::span(refined),
                                             serial{});
      trace::closest_hits<accuracy::fast>(h.view(), std::span<ray<double> const>(rays), std::span(fast), serial{});
      for (std::size_t i = 0; i < rays.size(); ++i) {
        ++aimed;
        lost_refined += !(refined[i].t < t[i] + 1e-13);
        lost_fast += !(fast[i].t < t[i] + 1e-4);
      }
    }
    CAPTURE(width, aimed);
    CHECK(lost_refined == 0);
    CHECK(lost_fast <= aimed / 500);
  }
}

// Rays whose nearest root was lost once, and what showed it.
TEST_CASE("roots that Newton's iteration once ran away from are found") {
  auto const scene = load_model("teapot");
  struct row {
    char const* origin;
    ray<double> r;
  };
  row const rows[] = {
      {"a bounce: another root outside the cell is nearer to where the iteration begins",
       {{0.96373671015888918, -0.99629751316537707, 2.474151352471146},
        {0.14295428548722836, -0.61314530679500157, 0.77692786345715481},
        0.00041381797024778904,
        no_limit}},
      {"a picture: a notch in the rim, at the end of a cell that is proved single but bends too much for one start",
       {{0.0, -3.0, 9.0}, {0.00089032133335235637, 0.55518016076683518, -0.83173150462999901}, 0, no_limit}},
      {"a line through the lid: the iteration leaves a cell next to the pole, whose parts have to be searched",
       {{-0.013453581072418563, -0.031054467856007524, 2.7566768033279563},
        {-0.1258056893563001, -0.16430640351966702, -2.0069585693390009},
        -no_limit,
        no_limit}},
  };
  for (auto const& [origin, r] : rows) {
    CAPTURE(origin);
    CHECK(compare<accuracy::refined>(scene, {r}, in_double).lost == 0);
    CHECK(compare<accuracy::fast>(scene, {r}, in_float).lost == 0);
  }
}
