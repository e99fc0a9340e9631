// SPDX-License-Identifier: MIT
#include "support/catch.hpp"
#include "support/rays.hpp"

#include <patchrt/accel/build_mixed_hierarchy.hpp>
#include <patchrt/exec/serial.hpp>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

using point = vec3<double>;

/// S, S_x and S_y in centred parameters.
struct tangent_plane {
  point position, by_x, by_y;
};

/// By the definition, the tangents as sums of differences: what is left of them at a collapsed edge is no rounding.
tangent_plane plain_evaluate(bicubic_patch<double> const& p, double x, double y) {
  double const u = 0.5 + 0.5 * x, v = 0.5 + 0.5 * y, s = 1 - u, t = 1 - v;
  double const wu[] = {s * s * s, 3 * s * s * u, 3 * s * u * u, u * u * u}, du[] = {s * s, 2 * s * u, u * u};
  double const wv[] = {t * t * t, 3 * t * t * v, 3 * t * v * v, v * v * v}, dv[] = {t * t, 2 * t * v, v * v};
  tangent_plane q{point(0), point(0), point(0)};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      q.position += wu[i] * wv[j] * p(i, j);
      if (i < 3) q.by_x += 1.5 * du[i] * wv[j] * (p(i + 1, j) - p(i, j));
      if (j < 3) q.by_y += 1.5 * wu[i] * dv[j] * (p(i, j + 1) - p(i, j));
    }
  return q;
}

/// One leaf of a hierarchy's only patch, as documented.
struct leaf_case {
  bicubic_patch<double> patch;  ///< in search space, about its base
  double size;                  ///< of the patch's box, the longest side
  patch_cell<float> cell;
  point remainder;
  point axis;
  double sine;
  bool has_cone;

  tangent_plane at(double p, double q) const {
    return plain_evaluate(patch, cell.x + p * cell.half_x, cell.y + q * cell.half_y);
  }
};

struct patch_family {
  char const* name;
  std::function<bicubic_patch<double>(std::mt19937&)> make;
};

bicubic_patch<double> turned(bicubic_patch<double> p, std::mt19937& g) {
  point const a = random_direction(g), b = random_direction(g), x = a / norm(a);
  point const across = cross(x, b), y = across / norm(across), z = cross(x, y);
  for (auto& c : p.control_points) c = x * c.x + y * c.y + z * c.z;
  return p;
}

bicubic_patch<double> stretched(bicubic_patch<double> p, point const& by) {
  for (auto& c : p.control_points) c *= by;
  return p;
}

bicubic_patch<double> collapsed_sheet(std::mt19937& g) {
  auto p = random_sheet(g, 0.3);
  bool const along_u = g() % 2;
  for (int k = 1; k < 4; ++k) (along_u ? p(k, 0) : p(0, k)) = p(0, 0);
  if (g() % 2)
    for (int k = 0; k < 3; ++k) (along_u ? p(k, 3) : p(3, k)) = p(3, 3);
  return p;
}

std::vector<patch_family> families() {
  return {
      {"almost flat", [](std::mt19937& g) { return turned(random_sheet(g, 1e-3), g); }},
      {"gentle", [](std::mt19937& g) { return turned(random_sheet(g, 0.05), g); }},
      {"strongly curved", [](std::mt19937& g) { return turned(random_sheet(g, 1), g); }},
      {"folded", [](std::mt19937& g) { return random_patch<double>(g); }},
      {"squeezed",
       [](std::mt19937& g) {
         return turned(stretched(random_sheet(g, 0.3), {0.01, 1, 1}), g);
       }},
      {"ribbon",
       [](std::mt19937& g) {
         return turned(stretched(random_sheet(g, 0.3), {1e-3, 1, 1e-3}), g);
       }},
      {"collapsed", [](std::mt19937& g) { return turned(collapsed_sheet(g), g); }},
      {"planar",
       [](std::mt19937& g) {
         return turned(stretched(random_sheet(g, 0.3), {1, 1, 0}), g);
       }},
      {"in a coordinate plane",
       [](std::mt19937& g) {
         return stretched(random_sheet(g, 0.3), {1, 1, 0});
       }},
      {"line",
       [](std::mt19937& g) {
         return turned(stretched(random_sheet(g, 0.3), {1, 0, 0}), g);
       }},
      {"point",
       [](std::mt19937& g) {
         return stretched(random_sheet(g, 0.3), {0, 0, 0});
       }},
  };
}

/// f(leaf) for every leaf of the patch's tree.
template <class F> void for_each_leaf(bicubic_patch<double> const& user, int depth, F&& f) {
  mixed_hierarchy_options options;
  options.depth = depth;
  auto const h = build_mixed_hierarchy(std::span<bicubic_patch<double> const>(&user, 1), options, serial{});
  leaf_case c;
  for (int k = 0; k < 16; ++k) c.patch.control_points[k] = (user.control_points[k] - h.exact[0].base) * h.inverse_scale;
  auto const b = bounds(c.patch);
  c.size = std::max({b.hi.x - b.lo.x, b.hi.y - b.lo.y, b.hi.z - b.lo.z});
  auto const& tree = h.search[0].tree;
  std::uint32_t const count = 1u << tree.depth;
  REQUIRE(h.leaves.size() == count);
  for (std::uint32_t k = 0; k < count; ++k) {
    subpatch_leaf const& leaf = h.leaves[tree.first_leaf + k];
    c.cell = subpatch_cell(tree, count + k);
    for (int i = 0; i < 3; ++i) {
      c.remainder[i] = double(leaf.remainder[i]) * double(tree.remainder_step[i]);
      c.axis[i] = leaf.axis[i];
    }
    c.sine = leaf.sine / 255.0;
    c.has_cone = leaf.sine != 255;
    f(c);
  }
}

/// f(leaf) for every leaf of every depth of every family, and of the teapot; shows family and depth where f fails.
template <class F> void for_all_leaves(std::mt19937& g, F&& f) {
  for (auto const& family : families()) {
    for (int depth = -1; depth <= max_subpatch_depth; ++depth) {
      CAPTURE(family.name, depth);
      f(family.name, depth, [&](auto&& each) {
        int const patches = depth > 5 ? 8 : 40;
        for (int k = 0; k < patches; ++k) for_each_leaf(family.make(g), depth, each);
      });
    }
  }
  auto const teapot = load_model("teapot");
  for (int depth = -1; depth <= max_subpatch_depth; ++depth) {
    CAPTURE(depth);
    f("teapot", depth, [&](auto&& each) {
      for (std::size_t k = depth > 5 ? g() % 4 : 0; k<teapot.size(); k += depth> 5 ? 4 : 1)
        for_each_leaf(teapot[k], depth, each);
    });
  }
}

/// Corners, edges and the inside of a leaf.
std::vector<tangent_plane> samples(leaf_case const& c, int count, std::mt19937& g) {
  std::vector<tangent_plane> s;
  for (int k = 0; k < 4; ++k) s.push_back(c.at(k & 1 ? 1 : -1, k & 2 ? 1 : -1));
  while (int(s.size()) < count) {
    double p = uniform(g, -1, 1), q = uniform(g, -1, 1);
    if (s.size() % 3 == 0) p = g() % 2 ? 1 : -1;
    if (s.size() % 3 == 1) q = g() % 2 ? 1 : -1;
    s.push_back(c.at(p, q));
  }
  return s;
}

bool is_smooth(std::string const& family) {
  return family == "almost flat" || family == "gentle" || family == "planar" || family == "in a coordinate plane";
}

}  // namespace

TEST_CASE("a leaf's remainder bounds how far its sub-patch leaves the plane that touches it in the middle") {
  unsigned const seed = 51;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for_all_leaves(g, [&g](char const*, int, auto&& leaves) {
    std::size_t beyond = 0;
    leaves([&](leaf_case const& c) {
      // Nets and their halves are rounded to float; what is almost flat shows it.
      double const net_rounding = 0x1p-24 * c.size;
      tangent_plane const m = c.at(0, 0);
      for (int k = 0; k < 16; ++k) {
        double p = uniform(g, -1, 1), q = uniform(g, -1, 1);
        if (k < 4) p = k & 1 ? 1 : -1, q = k & 2 ? 1 : -1;
        point const off =
            c.at(p, q).position - m.position - p * double(c.cell.half_x) * m.by_x - q * double(c.cell.half_y) * m.by_y;
        for (int i = 0; i < 3; ++i) beyond += !(std::fabs(off[i]) <= c.remainder[i] + net_rounding);
      }
    });
    CHECK(beyond == 0);
  });
}

TEST_CASE("all products of a leaf's tangents along u and along v, at one point or two, lie in its cone") {
  unsigned const seed = 52;
  CAPTURE(seed);
  std::mt19937 g(seed);
  for_all_leaves(g, [&g](std::string const& family, int depth, auto&& leaves) {
    std::size_t count = 0, cones = 0, outside = 0;
    leaves([&](leaf_case const& c) {
      ++count;
      if (!c.has_cone) return;
      ++cones;
      auto const s = samples(c, 12, g);
      for (auto const& a : s)
        for (auto const& b : s) {
          point const product = cross(a.by_x, b.by_y);
          double const length = norm(product) * norm(c.axis), along = dot(product, c.axis);
          if (!(length > 1e-12 * c.size * c.size)) continue;
          outside += !(along > 0 && norm(cross(product, c.axis)) <= c.sine * length);
        }
    });
    CAPTURE(count, cones);
    CHECK(outside == 0);
    if (is_smooth(family)) CHECK(cones == count);
    else if (depth >= 5 && family != "line" && family != "point") CHECK(2 * cones > count);
  });
}

TEST_CASE("a ray that meets a leaf in two points is not taken for one that meets it once") {
  unsigned const seed = 53;
  CAPTURE(seed);
  std::mt19937 g(seed);
  // The test that the search makes of a ray's direction, here of length 1.
  auto const is_single = [](leaf_case const& c, point const& d) {
    return c.has_cone && 127 * c.sine < std::fabs(dot(d, c.axis));
  };
  for_all_leaves(g, [&](std::string const& family, int depth, auto&& leaves) {
    std::size_t chords = 0, wrong = 0, directions = 0, singles = 0;
    leaves([&](leaf_case const& c) {
      if (!c.has_cone) return;
      auto const s = samples(c, 12, g);
      for (std::size_t a = 0; a < s.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
          point const apart = s[b].position - s[a].position;
          double const length = norm(apart);
          if (!(length > 1e-9 * c.size)) continue;
          ++chords;
          wrong += is_single(c, apart / length);
        }
        for (double turn : {0.0, 1.0, 2.0}) {  // tangents are chords of no length
          point const tangent = std::cos(turn) * s[a].by_x + std::sin(turn) * s[a].by_y;
          double const length = norm(tangent);
          if (length > 1e-9 * c.size) wrong += is_single(c, tangent / length);
        }
      }
      for (int k = 0; k < 8; ++k) ++directions, singles += is_single(c, random_direction(g));
    });
    CAPTURE(chords, directions, singles);
    CHECK(wrong == 0);
    if (family == "point") return;
    CHECK((depth < 5 || family == "line" || chords > 1000));
    if (is_smooth(family)) CHECK(2 * singles > directions);
    else if (depth >= 5 && family != "line") CHECK(5 * singles > directions);
  });
}
