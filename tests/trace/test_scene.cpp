// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_scene.hpp>
#include <patchrt/accel/scene_sphere.hpp>
#include <patchrt/accel/scene_triangle.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/scene_hits.hpp>
#ifdef PATCHRT_HAVE_OPENMP
#  include <patchrt/exec/openmp.hpp>
#endif

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>

using namespace patchrt;

namespace user {

/// As a user writes a shape: a disc across an axis, in double, one ray at a time.
struct disc {
  glm::dvec3 centre;
  double radius;
  int axis;
};
box<double> bounds(disc const& d) {
  glm::dvec3 half(d.radius);
  half[d.axis] = 0;
  return {d.centre - half, d.centre + half};
}
struct disc_hit {
  double t;
  bool valid;
};
disc_hit intersect(ray<double> const& r, disc const& d) {
  double const t = (d.centre[d.axis] - r.origin[d.axis]) / r.direction[d.axis];
  glm::dvec3 const p = r.origin + t * r.direction - d.centre;
  double const square = p.x * p.x + p.y * p.y + p.z * p.z - p[d.axis] * p[d.axis];
  return {t, r.t_min < t && t < r.t_max && square <= d.radius * d.radius};
}

/// Whose t is too small by what differs from disc to disc.
struct hasty_disc : disc {};
disc_hit intersect(ray<double> const& r, hasty_disc const& d) {
  disc_hit h = intersect(r, static_cast<disc const&>(d));
  h.t -= 0.1 * (1 + std::sin(1000 * d.centre.x));
  return h;
}

}  // namespace user

namespace {

template <class R> using mixed_scene = scene<scene_triangle<R>, sphere<R>, user::disc>;

/// A few hundred of each kind in [-1, 1]^3 about `at`.
template <class R> struct shapes {
  std::vector<scene_triangle<R>> triangles;
  std::vector<sphere<R>> spheres;
  std::vector<user::disc> discs;

  explicit shapes(unsigned seed, int count, vec3<double> const& at = {0, 0, 0}) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> across(-1, 1);
    auto const point = [&](double size) {
      double const x = across(random), y = across(random), z = across(random);
      return vec3<double>(x, y, z) * size;
    };
    for (int i = 0; i < count; ++i) {
      vec3<double> const p = at + point(1);
      triangles.push_back({{vec3<R>(p), vec3<R>(p + point(0.2)), vec3<R>(p + point(0.2))}});
      spheres.push_back({vec3<R>(at + point(1)), R(0.05 + 0.04 * across(random))});
      discs.push_back({at + point(1), 0.06 + 0.05 * across(random), i % 3});
    }
  }
  mixed_scene<R> build() const { return build_scene(triangles, spheres, discs); }
};

template <class R> std::vector<ray<R>> some_rays(unsigned seed, int count, vec3<double> const& at, double from = 3) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> across(-1, 1);
  auto const point = [&](double size) {
    double const x = across(random), y = across(random), z = across(random);
    return vec3<double>(x, y, z) * size;
  };
  std::vector<ray<R>> rays;
  constexpr R inf = std::numeric_limits<R>::infinity();
  for (int i = 0; i < count; ++i) {
    vec3<double> o = at + point(from), d = at + point(1) - o;
    if (i % 7 == 0) d[i / 7 % 3] = 0;
    rays.push_back({vec3<R>(o), vec3<R>(d), i % 5 == 0 ? R(0.9) : R(0), i % 3 == 0 ? R(1.1) : inf});
  }
  return rays;
}

/// Bundles: 4 x 4 rays of a picture each.
template <class R> std::vector<ray<R>> picture_rays(int side) {
  std::vector<ray<R>> rays;
  for (int i = 0; i < side; i += 4)
    for (int j = 0; j < side; j += 4)
      for (int k = 0; k < 16; ++k)
        rays.push_back({{R(0.3), R(0.2), R(4)},
                        {R(i + k % 4) / R(side) - R(0.5), R(j + k / 4) / R(side) - R(0.5), R(-1.5)},
                        R(0),
                        std::numeric_limits<R>::infinity()});
  return rays;
}

template <class R, class Scene> std::vector<scene_hit<R>> closest(Scene const& s, std::vector<ray<R>> const& rays) {
  std::vector<scene_hit<R>> hits(rays.size());
  trace::closest_hits(s.view(), std::span<ray<R> const>(rays), std::span(hits), serial{});
  return hits;
}
template <class R, class Scene> std::vector<std::uint8_t> any(Scene const& s, std::vector<ray<R>> const& rays) {
  std::vector<std::uint8_t> hits(rays.size());
  trace::any_hits(s.view(), std::span<ray<R> const>(rays), std::span(hits), serial{});
  return hits;
}

template <class R> bool is_same(scene_hit<R> const& a, scene_hit<R> const& b) {
  return a.t == b.t && a.u == b.u && a.v == b.v && a.shape == b.shape && a.part == b.part;
}
template <class R> std::size_t differences(std::vector<scene_hit<R>> const& a, std::vector<scene_hit<R>> const& b) {
  std::size_t n = a.size() == b.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) n += !is_same(a[i], b[i]);
  return n;
}

/// The nearest of all shapes in long double, without a tree and without the kernels; `next` is the runner-up's t.
struct plain_hit {
  long double t = std::numeric_limits<long double>::infinity(), next = t;
  int shape = -1;
  long double doubt = 1;  ///< how near the ray passes an edge or a rim, in parts of its size
};
template <class R> plain_hit meet_all(shapes<R> const& s, ray<R> const& r) {
  using L = long double;
  using v = glm::vec<3, L>;
  plain_hit h;
  v const o(r.origin), d(r.direction);
  auto const dot3 = [](v a, v b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  auto const cross3 = [](v a, v b) { return v(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x); };
  int number = 0;
  auto const offer = [&](L t) {
    if (!(L(r.t_min) < t && t < L(r.t_max))) return;
    if (t < h.t) h.next = h.t, h.t = t, h.shape = number;
    else h.next = std::min(h.next, t);
  };
  for (auto const& q : s.triangles) {
    v const a(q.a), e(v(q.b) - a), f(v(q.c) - a), n = cross3(e, f), ao = o - a, k = cross3(d, ao);
    L const den = dot3(n, d), u = dot3(f, k) / den, w = -dot3(e, k) / den;
    h.doubt = std::min({h.doubt, std::abs(u), std::abs(w), std::abs(1 - u - w)});
    if (u >= 0 && w >= 0 && u + w <= 1) offer(-dot3(n, ao) / den);
    ++number;
  }
  for (auto const& q : s.spheres) {
    v const c = o - v(q.centre);
    L const dd = dot3(d, d), w = -dot3(c, d) / dd;
    v const m = c + w * d;
    L const square = (L(q.radius) * q.radius - dot3(m, m)) / dd;
    h.doubt = std::min(h.doubt, std::abs(square) * dd / (L(q.radius) * q.radius));
    if (square >= 0) offer(w - std::sqrt(square)), offer(w + std::sqrt(square));
    ++number;
  }
  for (auto const& q : s.discs) {
    L const t = (L(q.centre[q.axis]) - o[q.axis]) / d[q.axis];
    v p = o + t * d - v(q.centre);
    p[q.axis] = 0;
    h.doubt = std::min(h.doubt, std::abs(dot3(p, p) / (L(q.radius) * q.radius) - 1));
    if (dot3(p, p) <= L(q.radius) * q.radius) offer(t);
    ++number;
  }
  return h;
}

template <class R> void compare_with_all(unsigned seed, vec3<double> const& at, double from) {
  shapes<R> const s(seed, 120, at);
  mixed_scene<R> const built = s.build();
  auto const rays = some_rays<R>(seed + 1, 2000, at, from);
  auto const hits = closest<R>(built, rays);
  long double const tolerance = std::numeric_limits<R>::epsilon() * 4096 * (1 + std::sqrt(double(dot(at, at))));
  int judged = 0, met = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    plain_hit const want = meet_all(s, rays[i]);
    bool const near_end = std::abs(want.t - rays[i].t_max) < tolerance || std::abs(want.t - rays[i].t_min) < tolerance;
    if (!(want.doubt > tolerance) || near_end || want.next - want.t < tolerance) continue;
    ++judged;
    met += want.shape >= 0;
    INFO("ray " << i << " of seed " << seed);
    REQUIRE(hits[i].shape == want.shape);
    if (want.shape >= 0) REQUIRE(std::abs(hits[i].t - want.t) < tolerance);
  }
  REQUIRE(judged > 1500);
  REQUIRE(met > 300);
}

}  // namespace

TEST_CASE("a scene of three kinds gives the nearest of all shapes") {
  unsigned const seed = GENERATE(1u, 2u, 3u);
  compare_with_all<float>(seed, {0, 0, 0}, 3);
  compare_with_all<double>(seed, {0, 0, 0}, 3);
  compare_with_all<double>(seed, {0, 0, 0}, 1e4);
  compare_with_all<double>(seed, {1e5, -3e5, 2e5}, 3);
}

TEST_CASE("between spheres that all but touch t is rounded once") {
  unsigned const seed = 5;
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> across(-1, 1);
  std::vector<sphere<float>> const spheres{{{0, 0, 0}, 1}, {{1.5f, 0, 0}, 0.499999f}, {{0, 3, 0}, 1.99999f}};
  scene<sphere<float>> const built = build_scene(spheres);
  std::vector<ray<float>> rays;
  for (int i = 0; i < 20000; ++i) {
    // Between the first and another, near where they are nearest.
    vec3<double> const axis = i % 2 ? vec3<double>(1, 0, 0) : vec3<double>(0, 1, 0);
    vec3<double> const at = axis + vec3<double>(across(random), across(random), across(random)) * 1e-2;
    vec3<double> const o = at * (1.0000005 / std::sqrt(dot(at, at)));
    vec3<double> const d = axis + vec3<double>(across(random), across(random), across(random)) * 0.5;
    rays.push_back({vec3<float>(o), vec3<float>(d), 0, std::numeric_limits<float>::infinity()});
  }
  auto const hits = closest<float>(built, rays);
  int compared = 0;
  long double worst = 0, least = 1;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (hits[i].shape < 1) continue;
    sphere<float> const& s = spheres[std::size_t(hits[i].shape)];
    long double a = 0, b = 0, c = -static_cast<long double>(s.radius) * s.radius;
    for (int k = 0; k < 3; ++k) {
      long double const d = rays[i].direction[k], from = static_cast<long double>(rays[i].origin[k]) - s.centre[k];
      a += d * d, b += from * d, c += from * from;
    }
    if (!(c > 0 && b * b > 0.04L * a * s.radius * s.radius)) continue;
    long double const t = c / (std::sqrt(b * b - a * c) - b);
    worst = std::max(worst, std::abs(hits[i].t - t) / t);
    least = std::min(least, t);
    ++compared;
  }
  CAPTURE(compared, worst, least);
  CHECK(compared > 10000);
  CHECK(worst <= 0x1.01p-24L);
  CHECK(least < 1e-4L);
}

TEMPLATE_TEST_CASE("hits are the same bits in every order of rays, in packs and alone, with a stack and without", "",
                   float, double) {
  using R = TestType;
  unsigned const seed = GENERATE(11u, 12u);
  CAPTURE(seed);
  auto const built = shapes<R>(seed, 150).build();
  auto const view = built.view();
  std::vector<ray<R>> rays = picture_rays<R>(64);
  for (ray<R> const& r : some_rays<R>(seed + 1, 1000, {0, 0, 0})) rays.push_back(r);
  auto const hits = closest<R>(built, rays);
  REQUIRE(std::count_if(hits.begin(), hits.end(), [](auto const& h) { return h.valid(); }) > 1000);

  std::vector<std::size_t> order(rays.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::shuffle(order.begin(), order.end(), std::mt19937(seed));
  std::vector<ray<R>> shuffled;
  for (std::size_t i : order) shuffled.push_back(rays[i]);
  auto const other = closest<R>(built, shuffled);
  std::vector<scene_hit<R>> back(hits.size()), alone(hits.size()), one(hits.size()), packs(hits.size());
  for (std::size_t i = 0; i < order.size(); ++i) back[order[i]] = other[i];
  CHECK(differences(hits, back) == 0);

  for (std::size_t i = 0; i < rays.size(); ++i) {
    alone[i] = trace::closest_hit(view, rays[i]);
    auto const h = intersect<false, float>(view, rays[i], true);
    if (h.valid)
      one[i] = {h.t, h.u, h.v, std::bit_cast<std::int32_t>(h.shape_bits), std::bit_cast<std::int32_t>(h.part_bits)};
  }
  CHECK(differences(hits, alone) == 0);
  CHECK(differences(hits, one) == 0);

  using T = pack<float, 16>;
  using RP = pack<R, 16>;
  for (std::size_t i = 0; i + 16 <= rays.size(); i += 16) {
    RP r[8];
    load_records(&rays[i].origin.x, r);
    auto const h =
        intersect<false, T>(view, ray<RP>{{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6], r[7]}, mask_t<T>(true));
    for (int k = 0; k < 16; ++k)
      if (h.valid[k])
        packs[i + std::size_t(k)] = {h.t[k], h.u[k], h.v[k], std::bit_cast<std::int32_t>(h.shape_bits[k]),
                                     std::bit_cast<std::int32_t>(h.part_bits[k])};
  }
  for (std::size_t i = rays.size() / 16 * 16; i < rays.size(); ++i) packs[i] = hits[i];
  CHECK(differences(hits, packs) == 0);
#ifdef PATCHRT_HAVE_OPENMP
  std::vector<scene_hit<R>> threads(hits.size());
  trace::closest_hits(view, std::span<ray<R> const>(rays), std::span(threads), openmp(3));
  CHECK(differences(hits, threads) == 0);
#endif
}

TEST_CASE("hits are the same bits where shapes say that they are nearer than their boxes") {
  unsigned const seed = GENERATE(14u, 15u);
  CAPTURE(seed);
  std::vector<user::hasty_disc> discs;
  for (auto const& d : shapes<float>(seed, 400).discs) discs.push_back({{d.centre, 3 * d.radius, d.axis}});
  auto const built = build_scene(discs);
  std::vector<ray<float>> const rays = some_rays<float>(seed, 2000, {0, 0, 0});
  auto const hits = closest<float>(built, rays);
  std::vector<scene_hit<float>> one(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    auto const h = intersect<false, float>(built.view(), rays[i], true);
    if (h.valid) one[i] = {h.t, h.u, h.v, std::bit_cast<std::int32_t>(h.shape_bits), -1};
  }
  REQUIRE(std::count_if(hits.begin(), hits.end(), [](auto const& h) { return h.valid(); }) > 1000);
  REQUIRE(differences(hits, one) == 0);
}

TEMPLATE_TEST_CASE("any hit is found for just the rays that have a closest one", "", float, double) {
  using R = TestType;
  auto const built = shapes<R>(21, 150).build();
  std::vector<ray<R>> rays = picture_rays<R>(64);
  for (ray<R> const& r : some_rays<R>(22, 1000, {0, 0, 0})) rays.push_back(r);
  auto const near = closest<R>(built, rays), some = any<R>(built, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    INFO("ray " << i);
    REQUIRE(some[i] == near[i].valid());
    REQUIRE(trace::any_hit(built.view(), rays[i]) == near[i].valid());
    auto const found = intersect<true, float>(built.view(), rays[i], true);
    REQUIRE(found.valid == near[i].valid());
    REQUIRE((!found.valid || (near[i].t <= found.t && found.t < rays[i].t_max)));
  }
}

TEST_CASE("of equal hits the shape with the smaller number counts") {
  scene_triangle<float> const t{{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}};
  std::vector<scene_triangle<float>> const triangles(40, t);
  auto const built = build_scene(triangles);
  std::vector<ray<float>> const rays(21, ray<float>{{0, 0, 3}, {0, 0.01f, -1}, 0, 10});
  for (auto const& h : closest<float>(built, rays)) REQUIRE(h.shape == 0);
}

TEST_CASE("scenes without shapes, and rays that are none, have no hits") {
  auto const empty = build_scene(std::vector<scene_triangle<float>>{}, std::vector<sphere<float>>{});
  auto const built = build_scene(std::vector<sphere<float>>{{{0, 0, 0}, 1}});
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  ray<float> const good{{0, 0, 3}, {0, 0, -1}, 0, inf};
  REQUIRE(!closest<float>(empty, {good})[0].valid());
  for (auto const& h : closest<float>(empty, std::vector<ray<float>>(40, good))) REQUIRE(!h.valid());
  for (auto const h : any<float>(empty, std::vector<ray<float>>(40, good))) REQUIRE(h == 0);
  REQUIRE(!trace::closest_hit(empty.view(), good).valid());
  REQUIRE(!trace::any_hit(empty.view(), good));
  REQUIRE(closest<float>(built, {good})[0].t == 2);
  std::vector<ray<float>> bad(8, good);
  bad[0].direction = {0, 0, 0};
  bad[1].direction = {nan, 0, -1};
  bad[2].origin.x = nan;
  bad[3].t_min = nan;
  bad[4].t_max = nan;
  bad[5].t_max = 2;
  bad[6].t_min = 4;
  bad[7].direction = {0, 0, -1e30f};
  for (auto const& h : closest<float>(built, bad)) REQUIRE(!h.valid());
  for (auto const h : any<float>(built, bad)) REQUIRE(h == 0);
}

TEST_CASE("bounds that are not finite are refused with the list and the shape") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<scene_triangle<float>> triangles(3, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}});
  std::vector<sphere<float>> spheres(2, {{0, 0, 0}, 1});
  auto const message = [&] {
    try {
      build_scene(triangles, spheres);
    } catch (std::invalid_argument const& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  REQUIRE(message().empty());
  spheres[1].radius = nan;
  CHECK(message() == "build_scene: the bounds of shape 1 of list 1 are not finite, expected numbers that float holds");
  spheres[1].radius = 1;
  triangles[2].b.y = std::numeric_limits<float>::infinity();
  CHECK(message() == "build_scene: the bounds of shape 2 of list 0 are not finite, expected numbers that float holds");
}
