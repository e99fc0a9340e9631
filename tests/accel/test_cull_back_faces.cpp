// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/oracle.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/cull_back_faces.hpp>
#include <patchrt/exec/openmp.hpp>
#include <patchrt/exec/serial.hpp>
#include <patchrt/trace/fused.hpp>

#include <cstring>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using exact = long double;
using exact3 = vec3<exact>;

/// For normals at parameters known to double's and to float's rounding.
constexpr exact exact_rounding = 0x1p-24L, float_rounding = 1e-5L;

exact inner(exact3 const& a, exact3 const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// S and S_u x S_v from the Bernstein polynomials, in long double.
struct oriented_point {
  exact3 at, normal;
  exact tangents;  // |S_u| + |S_v|
};
oriented_point point_of(bicubic_patch<double> const& p, exact u, exact v) {
  auto const weights = [](exact t, exact(&w)[4], exact(&d)[4]) {
    exact const s = 1 - t;
    w[0] = s * s * s, w[1] = 3 * s * s * t, w[2] = 3 * s * t * t, w[3] = t * t * t;
    d[0] = -3 * s * s, d[1] = 3 * s * (s - 2 * t), d[2] = 3 * t * (2 * s - t), d[3] = 3 * t * t;
  };
  exact wu[4], du[4], wv[4], dv[4];
  weights(u, wu, du);
  weights(v, wv, dv);
  exact3 s(0), su(0), sv(0);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      exact3 const c(p(i, j));
      s += wu[i] * wv[j] * c;
      su += du[i] * wv[j] * c;
      sv += wu[i] * dv[j] * c;
    }
  exact3 const n{su.y * sv.z - su.z * sv.y, su.z * sv.x - su.x * sv.z, su.x * sv.y - su.y * sv.x};
  return {s, n, std::sqrt(inner(su, su)) + std::sqrt(inner(sv, sv))};
}

exact size_of(bicubic_patch<double> const& p) {
  auto const b = bounds(p);
  return norm(b.hi - b.lo);
}

exact sign_of(patch_front front) { return front == patch_front::along_normal ? 1 : -1; }

/// n . d for a ray at a place of a patch, n towards the front; 0 where that is below `rounding`, in units of |d|, the
/// patch's size and its tangents there.
exact towards_back(bicubic_patch<double> const& p, double u, double v, ray<double> const& r, patch_front front,
                   exact rounding) {
  auto const s = point_of(p, u, v);
  exact3 const d(r.direction);
  exact const along = sign_of(front) * inner(s.normal, d);
  return std::fabs(along) <= rounding * s.tangents * size_of(p) * std::sqrt(inner(d, d)) ? 0 : along;
}

template <accuracy A> std::vector<patch_hit> trace_all(mixed_hierarchy_view const& h, ray_list const& rays) {
  std::vector<patch_hit> hits(rays.size());
  trace::closest_hits<A>(h, rays, hits, serial{});
  return hits;
}

bool same_bits(patch_hit const& a, patch_hit const& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

/// From `eye` to points of patches, on edges, in corners, and to all sides.
template <class Generator>
ray_list rays_from(vec3<double> const& eye, patch_list const& scene, int count, Generator& g) {
  ray_list rays = rays_at_edges(scene, count / 2, g);
  for (auto& r : rays) r.direction = r.origin + r.direction - eye, r.origin = eye;
  while (int(rays.size()) < count) {
    auto const& p = scene[g() % scene.size()];
    vec3<double> const aim = evaluate(p, uniform(g), uniform(g)).position;
    rays.push_back({eye, rays.size() % 8 ? aim - eye : random_direction(g), 0, no_limit});
  }
  return rays;
}

/// How hits of a culled scene stand to those of the whole.
struct comparison {
  std::size_t front = 0, back = 0, changed_back = 0;
  std::size_t wrong = 0;  // a front that changed, or a hit nearer than the nearest
};
comparison compare(patch_list const& scene, ray_list const& rays, std::vector<patch_hit> const& whole,
                   std::vector<patch_hit> const& culled, patch_front front, exact rounding = exact_rounding) {
  comparison c;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    bool const same = same_bits(whole[i], culled[i]);
    if (!whole[i].valid()) {
      c.wrong += !same;
      continue;
    }
    auto const& patch = scene[std::size_t(whole[i].patch)];
    if (towards_back(patch, whole[i].u, whole[i].v, rays[i], front, rounding) < 0) {
      ++c.front;
      c.wrong += !same;
    } else {
      ++c.back;
      c.changed_back += !same;
      c.wrong += !same && culled[i].valid() && culled[i].t < whole[i].t;
    }
  }
  return c;
}

bool is_empty_leaf(subpatch_node const& n) { return n.lo[0] > n.hi[0] && n.lo[1] > n.hi[1] && n.lo[2] > n.hi[2]; }

/// f(patch, cell) for every culled sub-patch of the view.
template <class F> void for_each_culled(mixed_hierarchy_view const& v, F&& f) {
  for (std::uint32_t i = 0; i < v.top.count; ++i) {
    auto const& node = v.top.nodes[i];
    if (node.primitive < 0) continue;
    subpatch_tree const& tree = v.search[node.primitive].tree;
    std::uint32_t const leaves = 1u << tree.depth;
    for (std::uint32_t k = leaves; k < 2 * leaves; ++k)
      if (is_empty(node.bounds) || (tree.depth > 0 && is_empty_leaf(v.nodes[tree.first_node + k - 1])))
        f(std::size_t(node.primitive), subpatch_cell(tree, k));
  }
}

/// Points of culled sub-patches whose front the eye sees, and how many were looked at.
struct sampled {
  std::size_t points = 0, seen = 0, leaves = 0;
};
sampled sample_culled(mixed_hierarchy_view const& v, patch_list const& scene, vec3<double> const& eye,
                      patch_front front, int steps) {
  sampled s;
  for_each_culled(v, [&](std::size_t i, patch_cell<float> const& c) {
    ++s.leaves;
    for (int a = 0; a <= steps; ++a)
      for (int b = 0; b <= steps; ++b) {
        exact const x = c.x + c.half_x * (2 * exact(a) / steps - 1), y = c.y + c.half_y * (2 * exact(b) / steps - 1);
        auto const at = point_of(scene[i], (x + 1) / 2, (y + 1) / 2);
        exact3 const w = at.at - exact3(eye);
        exact const rounding = exact_rounding * at.tangents * size_of(scene[i]) * std::sqrt(inner(w, w));
        ++s.points;
        s.seen += sign_of(front) * inner(at.normal, w) < -rounding;
      }
  });
  return s;
}

/// Scenes with all that makes culling hard: folds, slivers that float cannot resolve, specks, far from the origin.
template <class Generator> patch_list random_scene(int kind, Generator& g) {
  patch_list scene;
  double const offset = kind % 3 == 2 ? 1e5 : 0, scale = kind % 4 == 3 ? 1e-3 : 1;
  for (int k = 0; k < 24; ++k) {
    bicubic_patch<double> p = kind % 2 ? random_patch<double>(g) : random_sheet(g, 0.15);
    vec3<double> const x = random_direction(g), z = random_direction(g), side = cross(x, z);
    vec3<double> const y = side / norm(side), centre = random_direction(g) * 2.0, up = cross(x, y);
    double const width = k % 6 == 0 ? std::pow(10, uniform(g, -8, -3)) : 1;
    double const speck = k % 6 == 1 ? std::pow(10, uniform(g, -12, -2)) : 1;
    if (k % 6 == 2)
      for (int j = 1; j < 4; ++j) p(0, j) = p(0, 0);
    for (auto& c : p.control_points) {
      vec3<double> const q = (x * c.x + y * (width * c.y) + up * (width * c.z)) * speck;
      c = (q + centre) * scale + vec3<double>(offset);
    }
    scene.push_back(p);
  }
  return scene;
}

template <class Generator> vec3<double> random_eye(patch_list const& scene, Generator& g) {
  auto const ball = ball_of(scene);
  return ball.middle + random_direction(g) * (ball.radius * std::pow(10, uniform(g, -1, 2)));
}

/// Eyes around a model that is seen from outside: gives the mean share of sub-patches culled.
double look_from_outside(patch_list const& scene, patch_front front, std::size_t most_backs) {
  unsigned const seed = 74;
  CAPTURE(seed);
  std::mt19937 g(seed);
  auto const h = build_mixed_hierarchy(scene, {}, serial{});
  visible_hierarchy visible(h, serial{});
  CHECK(visible.leaf_count() == h.leaves.size());
  double share = 0;
  constexpr int views = 8;
  for (int k = 0; k < views; ++k) {
    auto const rays = view_rays(scene, 1, 200, g);
    vec3<double> const eye = rays[0].origin;
    visible.cull(eye, serial{}, front);
    share += double(visible.culled_leaves()) / double(visible.leaf_count()) / views;
    auto const whole = trace_all<accuracy::refined>(h.view(), rays);
    auto const culled = trace_all<accuracy::refined>(visible.view(), rays);
    auto const c = compare(scene, rays, whole, culled, front);
    CHECK(c.front > 3000);
    CHECK(c.wrong == 0);
    CHECK(c.back <= most_backs);
    CHECK(sample_culled(visible.view(), scene, eye, front, 2).seen == 0);
  }
  std::cout << 100 * share << " % of " << visible.leaf_count() << " sub-patches culled" << std::endl;
  return share;
}

}  // namespace

TEST_CASE("a hit on the front has the same bits in the culled scene, and no ray hits anything nearer") {
  unsigned const seed = 71;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::size_t front_hits = 0, changed_back = 0;
  for (int kind = 0; kind < 24; ++kind) {
    patch_list const scene = random_scene(kind, g);
    mixed_hierarchy_options options;
    options.depth = kind < 12 ? -1 : kind % 5;
    auto const h = build_mixed_hierarchy(scene, options, serial{});
    visible_hierarchy visible(h, serial{});
    for (int k = 0; k < 4; ++k) {
      vec3<double> const eye = random_eye(scene, g);
      auto const front = k % 2 ? patch_front::along_normal : patch_front::against_normal;
      visible.cull(eye, serial{}, front);
      auto const rays = rays_from(eye, scene, 1000, g);
      CAPTURE(kind, k);
      auto const refined = compare(scene, rays, trace_all<accuracy::refined>(h.view(), rays),
                                   trace_all<accuracy::refined>(visible.view(), rays), front);
      auto const fast = compare(scene, rays, trace_all<accuracy::fast>(h.view(), rays),
                                trace_all<accuracy::fast>(visible.view(), rays), front, float_rounding);
      CHECK(refined.wrong == 0);
      CHECK(fast.wrong == 0);
      front_hits += refined.front;
      changed_back += refined.changed_back;
    }
  }
  CHECK(front_hits > 20000);
  CHECK(changed_back > 5000);
}

TEST_CASE("the nearest of all hits on the front is found, whatever backs are before it") {
  unsigned const seed = 72;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::size_t behind_backs = 0;
  for (int kind = 0; kind < 6; ++kind) {
    patch_list const scene = random_scene(kind, g);
    oracle const truth(numbers_of(scene));
    auto const h = build_mixed_hierarchy(scene, {}, serial{});
    vec3<double> const eye = random_eye(scene, g);
    auto const front = kind % 2 ? patch_front::along_normal : patch_front::against_normal;
    auto const visible = cull_back_faces(h, eye, serial{}, front);
    auto const rays = rays_from(eye, scene, 200, g);
    auto const hits = trace_all<accuracy::refined>(visible.view(), rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      bool is_behind = false;
      for (auto const& root : truth.all_hits(numbers_of(rays[i]))) {
        if (root.t < 0) continue;
        auto const& patch = scene[std::size_t(root.patch)];
        bool const is_sliver = root.jacobian < 1e-3;  // float may not resolve it, culled or not
        if (!root.is_certain() || is_sliver ||
            towards_back(patch, double(root.u), double(root.v), rays[i], front, exact_rounding) >= 0) {
          is_behind = true;
          continue;
        }
        CAPTURE(kind, i, double(root.t), hits[i].t);
        CHECK(hits[i].t <= double(root.t) * (1 + 1e-9));
        behind_backs += is_behind;
        break;
      }
    }
  }
  CHECK(behind_backs > 50);
}

TEST_CASE("every point of a culled sub-patch turns its back to the eye") {
  unsigned const seed = 73;
  CAPTURE(seed);
  std::mt19937 g(seed);
  sampled all;
  for (int kind = 0; kind < 48; ++kind) {
    patch_list const scene = random_scene(kind, g);
    mixed_hierarchy_options options;
    options.depth = kind < 24 ? -1 : kind % 6;
    auto const h = build_mixed_hierarchy(scene, options, serial{});
    for (auto const front : {patch_front::along_normal, patch_front::against_normal})
      for (int k = 0; k < 4; ++k) {
        vec3<double> const eye = random_eye(scene, g);
        auto const visible = cull_back_faces(h, eye, serial{}, front);
        sampled const s = sample_culled(visible.view(), scene, eye, front, 8);
        CAPTURE(kind, k);
        CHECK(s.seen == 0);
        CHECK(s.leaves == visible.culled_leaves());
        all.points += s.points;
      }
  }
  CHECK(all.points > 1000000);
}

TEST_CASE("from outside bigguy, which is closed, culling changes no hit and leaves out a third of the sub-patches") {
  patch_list const scene = load_model("bigguy_osd_L2");
  if (scene.empty()) PATCHRT_SKIP("bigguy is not there");
  CHECK(look_from_outside(scene, patch_front::along_normal, 0) > 0.33);
}

TEST_CASE("from outside the teapot, culling changes only hits on its inside, seen through the gap below its lid") {
  CHECK(look_from_outside(load_model("teapot"), patch_front::against_normal, 300) > 0.33);
}

TEST_CASE(
    "nothing is culled for an eye within a leaf's box, nor where there are no cones, nor for an eye that is none") {
  unsigned const seed = 75;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for (int depth : {0, 3}) {
    patch_list scene{random_sheet(g, 0.02)};
    for (auto& c : scene[0].control_points) c.z += c.x + 0.7 * c.y;  // in a box as high as it is wide
    mixed_hierarchy_options options;
    options.depth = depth;
    auto h = build_mixed_hierarchy(scene, options, serial{});
    subpatch_tree const& tree = h.search[0].tree;
    visible_hierarchy visible(h, serial{});
    auto const is_whole = [&] {
      auto const v = visible.view();
      return visible.culled_leaves() == 0 && v.top.nodes[0].bounds == h.top.nodes[0].bounds &&
             std::memcmp(v.nodes, h.nodes.data(), h.nodes.size() * sizeof h.nodes[0]) == 0;
    };
    CHECK(is_whole());
    std::uint32_t const leaves = 1u << depth;
    for (int k = 0; k < 500; ++k) {
      std::uint32_t const leaf = leaves + unsigned(g()) % leaves;
      subpatch_node const& n = h.nodes[leaf - 1];
      vec3<double> eye;
      for (int c = 0; c < 3; ++c) {
        double const at = tree.grid_origin[c] + tree.grid_step[c] * uniform(g, n.lo[c], n.hi[c]);
        eye[c] = (at + h.exact[0].search_base[c]) / h.inverse_scale + h.centre[c];
      }
      for (auto const front : {patch_front::along_normal, patch_front::against_normal}) {
        visible.cull(eye, serial{}, front);
        CHECK(!is_empty_leaf(visible.view().nodes[leaf - 1]));
        CHECK(!is_empty(visible.view().top.nodes[0].bounds));
      }
    }
    double const inf = no_limit, nan = std::numeric_limits<double>::quiet_NaN();
    for (vec3<double> const eye : {vec3<double>{0, 0, 1e200}, {0, inf, 0}, {-inf, 0, 0}, {0, 0, nan}, {0, inf, -inf}})
      for (auto const front : {patch_front::along_normal, patch_front::against_normal}) {
        visible.cull(eye, serial{}, front);
        CHECK(is_whole());
      }
    visible.cull({0.5, 0.5, -1e9}, serial{});
    CHECK(visible.culled_leaves() == leaves);
    for (auto& l : h.leaves) l.sine = 255;
    visible = cull_back_faces(h, {0.5, 0.5, -1e9}, serial{});
    CHECK(is_whole());
  }
}

TEST_CASE("rays at the back of a patch do not even reach it") {
  unsigned const seed = 76;
  CAPTURE(seed);
  std::mt19937 g(seed);
  std::vector<patch_hit> hits;
  for (int depth : {0, 1, 5}) {
    patch_list const scene{random_sheet(g, 0.1)};
    mixed_hierarchy_options options;
    options.depth = depth;
    auto const h = build_mixed_hierarchy(scene, options, serial{});
    vec3<double> const eye{uniform(g), uniform(g), -30};
    auto const rays = rays_from(eye, scene, 1000, g);
    hits.resize(rays.size());
    for (auto const front : {patch_front::along_normal, patch_front::against_normal}) {
      bool const is_back = front == patch_front::along_normal;  // S_u x S_v points along z
      auto const visible = cull_back_faces(h, eye, serial{}, front);
      hierarchy_counts counts;
      trace::closest_hits(visible.view(), rays, hits, serial{}, &counts);
      CHECK(visible.culled_leaves() == (is_back ? h.leaves.size() : 0));
      CHECK((counts.patches == 0) == is_back);
    }
  }
}

TEST_CASE("a speck whose boxes a ray's origin in float cannot tell apart is culled as a whole or not at all") {
  for (double const size : {1.0, 1e-6, 1e-8}) {
    patch_list scene(2);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        double const x = i / 3., y = j / 3.;
        scene[0](i, j) = vec3<double>{2 * x - 1, 2 * y - 1, -1};
        scene[1](i, j) = vec3<double>{x, y, x * (1 - x)} * size;  // an arch
      }
    mixed_hierarchy_options options;
    options.depth = 4;
    auto const h = build_mixed_hierarchy(scene, options, serial{});
    visible_hierarchy visible(h, serial{});
    subpatch_tree const& tree = h.search[1].tree;
    auto const emptied = [&] {
      auto const* const leaf = visible.view().nodes + tree.first_node + 15;
      return std::count_if(leaf, leaf + 16, is_empty_leaf);
    };
    visible.cull({5, 0, 0}, serial{});  // sees one side of the arch
    CAPTURE(size);
    if (size > 1e-7) CHECK((emptied() >= 4 && emptied() <= 8));
    else CHECK((emptied() == 0 && visible.culled_leaves() == 0));
    visible.cull({0.5 * size, 0.5 * size, -0.9}, serial{});  // sees its back, and the front of the floor
    CHECK(visible.culled_leaves() == 16);
  }
}

TEST_CASE("empty boxes are missed by every ray, along axes and from their own planes too") {
  unsigned const seed = 77;
  CAPTURE(seed);
  std::mt19937 g(seed);
  box<float> const top = box<float>::empty();
  box<float> const bytes{{255, 255, 255}, {0, 0, 0}};
  constexpr float inf = std::numeric_limits<float>::infinity();
  std::array<float, 9> const origins{-1e8f, -3, -0.f, 0, 128, 254.9f, 255, 256, 1e8f};
  std::size_t met = 0;
  for (int k = 0; k < 300000; ++k) {
    auto const pick = [&] { return origins[g() % origins.size()]; };
    vec3<float> direction(random_direction(g));
    for (int c = 0; c < 3; ++c)
      if (g() % 3 == 0) direction[c] = g() % 2 ? 0.f : -0.f;
    if (g() % 8 == 0) direction[int(g() % 3)] = 1e-42f;
    if (std::fabs(direction.x) + std::fabs(direction.y) + std::fabs(direction.z) < 1e-6f) continue;
    auto const ray = make_slab_ray(vec3<float>{pick(), pick(), pick()}, direction);
    for (auto const& b : {top, bytes})
      for (float const t_min : {-inf, -1.f, 0.f}) {
        auto const s = intersect(ray, b, t_min, g() % 2 ? inf : 1e9f);
        met += s.entry <= s.exit;
      }
  }
  CHECK(met == 0);
}

TEST_CASE("the next eye undoes what the last one culled, on any number of threads") {
  unsigned const seed = 78;
  CAPTURE(seed);
  std::mt19937 g(seed);
  patch_list scene;
  for (int kind = 0; kind < 24; ++kind)
    for (auto const& p : random_scene(kind % 2, g)) scene.push_back(p);
  auto const h = build_mixed_hierarchy(scene, {}, serial{});
  visible_hierarchy reused(h, openmp(3));
  for (int k = 0; k < 10; ++k) {
    vec3<double> const eye = random_eye(scene, g);
    auto const front = k % 2 ? patch_front::along_normal : patch_front::against_normal;
    reused.cull(eye, openmp(3), front);
    auto const fresh = cull_back_faces(h, eye, serial{}, front);
    CHECK(reused.culled_leaves() == fresh.culled_leaves());
    CHECK(fresh.culled_leaves() > 0);
    auto const a = reused.view(), b = fresh.view();
    CHECK(std::memcmp(a.nodes, b.nodes, h.nodes.size() * sizeof h.nodes[0]) == 0);
    CHECK(std::memcmp(a.top.nodes, b.top.nodes, h.top.nodes.size() * sizeof h.top.nodes[0]) == 0);
  }
}
