// SPDX-License-Identifier: MIT
#include "subdivision.hpp"

#include "text.hpp"

#include <patchrt/core/box.hpp>

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/bfr/surface.h>
#include <opensubdiv/far/error.h>
#include <opensubdiv/far/patchTable.h>
#include <opensubdiv/far/patchTableFactory.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/ptexIndices.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace patchrt::examples {

namespace {

namespace far = OpenSubdiv::Far;
namespace bfr = OpenSubdiv::Bfr;
using sdc_options = OpenSubdiv::Sdc::Options;

[[noreturn]] void fail(std::string const& where, std::string const& expected, std::string const& got) {
  throw std::runtime_error(where + ": expected " + expected + ", got " + got);
}

/// What OpenSubdiv is told of a control mesh beside its vertices.
struct topology {
  std::vector<int> face_sizes, corners;
  std::vector<int> creases, sharp_vertices, holes;
  std::vector<float> crease_sharpness, corner_sharpness;
  sdc_options options;

  explicit topology(obj_model const& control) : control_(control) {
    options.SetVtxBoundaryInterpolation(sdc_options::VTX_BOUNDARY_EDGE_ONLY);
    for (auto const& face : control.faces) add_face(face);
    std::sort(edges_.begin(), edges_.end());
    for (auto const& tag : control.tags) add_tag(tag);
  }

  far::TopologyDescriptor descriptor() const {
    far::TopologyDescriptor d;
    d.numVertices = int(control_.vertices.size());
    d.numFaces = int(face_sizes.size());
    d.numVertsPerFace = face_sizes.data();
    d.vertIndicesPerFace = corners.data();
    d.numCreases = int(crease_sharpness.size());
    d.creaseVertexIndexPairs = creases.data();
    d.creaseWeights = crease_sharpness.data();
    d.numCorners = int(corner_sharpness.size());
    d.cornerVertexIndices = sharp_vertices.data();
    d.cornerWeights = corner_sharpness.data();
    d.numHoles = int(holes.size());
    d.holeIndices = holes.data();
    return d;
  }

 private:
  std::string at(std::size_t line) const { return control_.name + ":" + std::to_string(line); }

  void add_face(obj_face const& face) {
    auto const vertices = control_.corners_of(face);
    std::vector<std::uint32_t> sorted(vertices.begin(), vertices.end());
    std::sort(sorted.begin(), sorted.end());
    bool const repeats = std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
    constexpr std::size_t most_corners = 255;
    if (face.size < 3 || face.size > most_corners || repeats)
      fail(at(face.line), "a face of 3 to 255 different vertices",
           repeats ? "one of them twice" : std::to_string(face.size));
    face_sizes.push_back(int(face.size));
    for (std::size_t k = 0; k < face.size; ++k) {
      corners.push_back(int(vertices[k]));
      edges_.push_back(std::minmax({vertices[k], vertices[(k + 1) % face.size]}));
    }
  }

  void add_tag(obj_tag const& tag) {
    if (tag.name == "crease") {
      add_sharpness(tag, 2, crease_sharpness);
      for (std::size_t k = 0; k < tag.integers.size(); k += 2) {
        int const a = index(tag, k, control_.vertices.size(), "vertex"),
                  b = index(tag, k + 1, control_.vertices.size(), "vertex");
        auto const edge = std::minmax({std::uint32_t(a), std::uint32_t(b)});
        if (!std::binary_search(edges_.begin(), edges_.end(), edge))
          fail(at(tag.line), "an edge of a face", "vertices " + std::to_string(a) + " and " + std::to_string(b));
        creases.insert(creases.end(), {a, b});
      }
    } else if (tag.name == "corner") {
      add_sharpness(tag, 1, corner_sharpness);
      for (std::size_t k = 0; k < tag.integers.size(); ++k)
        sharp_vertices.push_back(index(tag, k, control_.vertices.size(), "vertex"));
    } else if (tag.name == "hole") {
      for (std::size_t k = 0; k < tag.integers.size(); ++k)
        holes.push_back(index(tag, k, control_.faces.size(), "face"));
    } else if (tag.name == "interpolateboundary") {
      constexpr std::array<sdc_options::VtxBoundaryInterpolation, 3> rules = {sdc_options::VTX_BOUNDARY_NONE,
                                                                              sdc_options::VTX_BOUNDARY_EDGE_AND_CORNER,
                                                                              sdc_options::VTX_BOUNDARY_EDGE_ONLY};
      auto const rule = tag.integers.size() == 1 ? tag.integers[0] : -1;
      if (rule < 0 || rule > 2)
        fail(at(tag.line), "one integer from 0 to 2 for 'interpolateboundary'",
             tag.integers.size() == 1 ? std::to_string(rule) : std::to_string(tag.integers.size()) + " integers");
      options.SetVtxBoundaryInterpolation(rules[std::size_t(rule)]);
    } else if (tag.name == "creasemethod") {
      options.SetCreasingMethod(second_of(tag, "normal", "chaikin") ? sdc_options::CREASE_CHAIKIN
                                                                    : sdc_options::CREASE_UNIFORM);
    } else if (tag.name == "smoothtriangles") {
      options.SetTriangleSubdivision(second_of(tag, "catmark", "smooth") ? sdc_options::TRI_SUB_SMOOTH
                                                                         : sdc_options::TRI_SUB_CATMARK);
    } else if (!tag.name.starts_with("facevarying")) {
      fail(at(tag.line), "the tag crease, corner, hole, interpolateboundary, creasemethod or smoothtriangles",
           in_quotes(tag.name));
    }
  }

  /// Adds a sharpness for each of the tag's groups of `group` integers.
  void add_sharpness(obj_tag const& tag, std::size_t group, std::vector<float>& sharpness) const {
    std::size_t const groups = tag.integers.size() / group;
    if (groups * group != tag.integers.size() || (tag.reals.size() != 1 && tag.reals.size() != groups))
      fail(at(tag.line),
           std::string(group == 2 ? "pairs of vertices" : "vertices") + " and one sharpness or one for each",
           std::to_string(tag.integers.size()) + " integers and " + std::to_string(tag.reals.size()) + " reals");
    for (std::size_t k = 0; k < groups; ++k) {
      double const s = tag.reals.size() == 1 ? tag.reals[0] : tag.reals[k];
      if (s < 0) fail(at(tag.line), "a sharpness of 0 or more", std::to_string(s));
      sharpness.push_back(float(std::min(s, double(OpenSubdiv::Sdc::Crease::SHARPNESS_INFINITE))));
    }
  }

  int index(obj_tag const& tag, std::size_t k, std::size_t count, std::string const& what) const {
    std::int64_t const i = tag.integers[k];
    if (i < 0 || std::uint64_t(i) >= count)
      fail(at(tag.line), "a " + what + " from 0 to " + std::to_string(count - 1), std::to_string(i));
    return int(i);
  }

  bool second_of(obj_tag const& tag, std::string const& first, std::string const& second) const {
    if (tag.words.size() != 1 || (tag.words[0] != first && tag.words[0] != second))
      fail(at(tag.line), "'" + first + "' or '" + second + "' for '" + tag.name + "'",
           tag.words.size() == 1 ? in_quotes(tag.words[0]) : std::to_string(tag.words.size()) + " words");
    return tag.words[0] == second;
  }

  obj_model const& control_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_;
};

/// Keeps what OpenSubdiv complains of while it lives, in the place of prints.
class complaints {
 public:
  complaints() {
    text().clear();
    far::SetErrorCallback([](far::ErrorType, char const* message) { add(message); });
    far::SetWarningCallback(add);
  }
  complaints(complaints const&) = delete;
  complaints& operator=(complaints const&) = delete;
  ~complaints() {
    far::SetErrorCallback(nullptr);
    far::SetWarningCallback(nullptr);
  }

  static std::string& text() {
    thread_local std::string said;
    return said;
  }

 private:
  static void add(char const* message) { (text() += message) += ' '; }
};

using refiner_factory = far::TopologyRefinerFactory<far::TopologyDescriptor>;

/// A point as OpenSubdiv's interpolation handles it.
struct weighted_point {
  vec3<double> position;

  void Clear() { position = vec3<double>(0.0); }
  void AddWithWeight(weighted_point const& p, double weight) { position = fma(weight, p.position, position); }
};

using points_4x4 = std::array<vec3<double>, 16>;

/// Four points of a row, `step` apart: uniform cubic B-spline to Bezier.
void to_bezier(points_4x4& points, std::size_t first, std::size_t step) {
  vec3<double>&a = points[first], &b = points[first + step], &c = points[first + 2 * step],
  &d = points[first + 3 * step];
  vec3<double> const start = ((a + c) + b * 4.0) / 6.0, end = ((b + d) + c * 4.0) / 6.0;
  vec3<double> const inner_b = (b * 2.0 + c) / 3.0, inner_c = (b + c * 2.0) / 3.0;
  a = start;
  b = inner_b;
  c = inner_c;
  d = end;
}

/// \param points Of a B-spline patch, u running fastest.
/// \param boundary The sides v = 0, u = 1, v = 1, u = 0 for bits 0 to 3 that are boundaries: OpenSubdiv leaves the points
///        beyond them out, they continue the curves that end there.
bicubic_patch<double> from_bspline(points_4x4 points, int boundary) {
  auto const continue_beyond = [&](std::size_t outer, int to_inner, std::size_t along) {
    for (std::size_t k = 0; k < 4; ++k, outer += along) {
      auto const at = [&](int steps) { return points[std::size_t(std::ptrdiff_t(outer) + steps * to_inner)]; };
      points[outer] = at(1) * 2.0 - at(2);
    }
  };
  if (boundary & 1) continue_beyond(0, 4, 1);
  if (boundary & 2) continue_beyond(3, -1, 4);
  if (boundary & 4) continue_beyond(12, -4, 1);
  if (boundary & 8) continue_beyond(0, 1, 4);
  for (std::size_t row = 0; row < 4; ++row) to_bezier(points, 4 * row, 1);
  for (std::size_t column = 0; column < 4; ++column) to_bezier(points, column, 4);
  bicubic_patch<double> patch;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) patch(i, j) = points[std::size_t(4 * j + i)];
  return patch;
}

/// A part of a patch: the rectangle of size (du, dv) from (u, v).
struct patch_part {
  bicubic_patch<double> patch;
  double u = 0, v = 0, du = 1, dv = 1;
};

/// The rows of points along a side of a patch: row 1 is the side itself, row 0 lies beyond it.
class rows_along {
 public:
  /// \param side v = 0, u = 1, v = 1, u = 0 for 0 to 3.
  explicit rows_along(int side) : side_(side) {}

  /// Of point m of row q, u running fastest.
  std::size_t operator()(int q, int m) const {
    int const across = side_ == 1 || side_ == 2 ? 3 - q : q;
    return std::size_t(side_ % 2 == 0 ? 4 * across + m : 4 * m + across);
  }

  /// The part of the patch whose distance from the side is from `start` to `end`.
  patch_part part(bicubic_patch<double> const& patch, double start, double end) const {
    double const from = side_ == 1 || side_ == 2 ? 1 - end : start;
    if (side_ % 2 == 0) return {patch, 0, from, 1, end - start};
    return {patch, from, 0, end - start, 1};
  }

 private:
  int side_;
};

/// A patch with a crease of finite sharpness along a side, the same beyond both ends, and regular but for that.
///
/// Across the crease its rows are divided as a curve's points, floor(s) times with the crease's point kept, once with the
/// mean of kept and smooth point that the fraction of s weighs, smoothly from there on: as many parts are polynomial.
/// \note Niessner, Loop & Greiner, "Efficient Evaluation of Semi-Smooth Creases in Catmull-Clark Subdivision Surfaces",
///       Eurographics 2012 (short papers).
std::vector<patch_part> from_semi_sharp(points_4x4 const& points, int side, double sharpness) {
  rows_along const at(side);
  using row = std::array<vec3<double>, 4>;
  std::array<row, 4> rows;
  for (int q = 0; q < 4; ++q)
    for (int m = 0; m < 4; ++m) rows[std::size_t(q)][std::size_t(m)] = points[at(q, m)];
  auto const combine = [](double wa, row const& a, double wb, row const& b, double wc, row const& c) {
    row r;
    for (std::size_t m = 0; m < 4; ++m) r[m] = a[m] * wa + b[m] * wb + c[m] * wc;
    return r;
  };
  auto const middle = [&](row const& a, row const& b) { return combine(0.5, a, 0.5, b, 0, b); };
  auto const smooth = [&](row const& a, row const& b, row const& c) { return combine(0.125, a, 0.75, b, 0.125, c); };
  auto const patch_of = [&](row const& a, row const& b, row const& c, row const& d) {
    points_4x4 net;
    for (int m = 0; m < 4; ++m) {
      net[at(0, m)] = a[std::size_t(m)];
      net[at(1, m)] = b[std::size_t(m)];
      net[at(2, m)] = c[std::size_t(m)];
      net[at(3, m)] = d[std::size_t(m)];
    }
    return from_bspline(net, 0);
  };

  std::vector<patch_part> parts;
  int const kept = int(sharpness);
  double const fraction = sharpness - kept;
  double width = 1;  // of what is not yet a part, at the crease
  auto& [beyond, crease, first, second] = rows;
  if (kept > 0) {
    width = std::ldexp(1.0, -kept);
    auto patch = patch_of(combine(2, crease, -1, first, 0, first), crease, first, second);
    for (int m = 0; m < 4; ++m) {
      auto const point = [&](int q) -> vec3<double>& {
        std::size_t const k = at(q, m);
        return patch(int(k % 4), int(k / 4));
      };
      for (int last = 3; last > 0; --last)
        for (int q = 0; q < last; ++q) point(q) = point(q) * (1 - width) + point(q + 1) * width;
    }
    parts.push_back(at.part(patch, width, 1));
  }
  for (int k = 0; k < kept; ++k) {
    beyond = middle(beyond, crease);
    second = smooth(crease, first, second);
    first = middle(crease, first);
  }
  if (fraction > 0) {
    row const third = middle(first, second);
    second = smooth(crease, first, second);
    row const smooth_crease = smooth(beyond, crease, first);
    beyond = middle(beyond, crease);
    first = middle(crease, first);
    crease = combine(fraction, crease, 1 - fraction, smooth_crease, 0, crease);
    parts.push_back(at.part(patch_of(crease, first, second, third), width / 2, width));
    width /= 2;
  }
  parts.push_back(at.part(patch_of(beyond, crease, first, second), 0, width));
  return parts;
}

/// \param p Of a Gregory patch: at each corner the corner, the points beside it on the edges that leave and reach it, and the
///        inner points that belong to those.
/// \note Loop, Schaefer, Ni & Castano, "Approximating Subdivision Surfaces with Gregory Patches for Hardware
///       Tessellation", SIGGRAPH Asia 2009, for the points; their rational blend is what the mean replaces.
bicubic_patch<double> from_gregory(std::array<vec3<double>, 20> const& p) {
  bicubic_patch<double> patch;
  constexpr int at[4][2] = {{0, 0}, {3, 0}, {3, 3}, {0, 3}}, along[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  for (std::size_t c = 0; c < 4; ++c) {
    auto const [u, v] = at[c];
    auto const [du, dv] = along[c];
    vec3<double> const* const corner = &p[5 * c];
    patch(u, v) = corner[0];
    patch(u + du, v + dv) = corner[1];
    patch(u - dv, v + du) = corner[2];
    patch(u + du - dv, v + dv + du) = (corner[3] + corner[4]) * 0.5;
  }
  return patch;
}

/// The limit surface of a refiner's base mesh, face by face.
class limit_surface {
 public:
  limit_surface(far::TopologyRefiner const& mesh, std::vector<vec3<double>> const& vertices)
      : vertices_(vertices), factory_(mesh, options()) {}

  /// The distance of `point` from the surface of the domain's face, searched from (u, v) of the domain.
  double distance(vec3<double> const& point, patch_domain const& domain, double u, double v) {
    if (domain.face != face_) select(domain.face);
    corner_ = domain.corner;
    u = domain.u + domain.du * u;
    v = domain.v + domain.dv * v;
    auto at = evaluate(u, v);
    vec3<double> away = point - at.position;
    double squared = dot(away, away);
    constexpr int most_steps = 20;
    for (int step = 0; step < most_steps; ++step) {
      double const uu = dot(at.du, at.du), uv = dot(at.du, at.dv), vv = dot(at.dv, at.dv);
      double const to_u = dot(at.du, away), to_v = dot(at.dv, away);
      double const determinant = difference_of_products(uu, vv, uv, uv);
      if (!(determinant > 0)) break;
      double const step_u = difference_of_products(to_u, vv, to_v, uv) / determinant;
      double const step_v = difference_of_products(to_v, uu, to_u, uv) / determinant;
      bool is_nearer = false;
      for (double share = 1; share > 0.01 && !is_nearer; share /= 2) {
        double const next_u = std::clamp(u + share * step_u, 0.0, 1.0),
                     next_v = std::clamp(v + share * step_v, 0.0, 1.0);
        auto const next = evaluate(next_u, next_v);
        vec3<double> const next_away = point - next.position;
        is_nearer = dot(next_away, next_away) < squared;
        if (!is_nearer) continue;
        u = next_u;
        v = next_v;
        at = next;
        away = next_away;
        squared = dot(away, away);
      }
      if (!is_nearer) break;
    }
    return std::sqrt(squared);
  }

 private:
  static bfr::SurfaceFactory::Options options() {
    return bfr::SurfaceFactory::Options()
        .SetApproxLevelSmooth(subdivision_surface::deepest_level)
        .SetApproxLevelSharp(subdivision_surface::deepest_level);
  }

  void select(int face) {
    if (!factory_.InitVertexSurface(face, &surface_))
      throw std::runtime_error("face " + std::to_string(face) + " has no limit surface");
    points_.resize(3 * std::size_t(surface_.GetNumPatchPoints()));
    surface_.PreparePatchPoints(&vertices_[0].x, 3, points_.data(), 3);
    face_ = face;
  }

  /// The surface at (u, v) of the face or of its quarter at the corner; derivatives but for a positive factor.
  surface_point<double> evaluate(double u, double v) const {
    double const in_quarter[2] = {u, v};
    double uv[2] = {u, v};
    if (corner_ >= 0) surface_.GetParameterization().ConvertNormalizedSubFaceToCoord(corner_, in_quarter, uv);
    surface_point<double> at;
    surface_.Evaluate(uv, points_.data(), 3, &at.position.x, &at.du.x, &at.dv.x);
    return at;
  }

  std::vector<vec3<double>> const& vertices_;
  bfr::RefinerSurfaceFactory<> factory_;
  bfr::Surface<double> surface_;
  std::vector<double> points_;
  int face_ = -1;
  int corner_ = -1;
};

}  // namespace

subdivision_surface::subdivision_surface(obj_model const& control) : name_(control.name), vertices_(control.vertices) {
  auto const is_quad = [](obj_face const& face) { return face.size == 4; };
  least_level_ = std::all_of(control.faces.begin(), control.faces.end(), is_quad) ? 0 : 1;
  topology const mesh(control);
  complaints const said;
  refiner_factory::Options options(OpenSubdiv::Sdc::SCHEME_CATMARK, mesh.options);
  options.validateFullTopology = true;
  base_.reset(refiner_factory::Create(mesh.descriptor(), options));
  if (!base_) fail(name_, "a mesh that OpenSubdiv takes", complaints::text());
  auto const level = base_->GetLevel(0);
  auto const line_of = [&](int face) { return name_ + ":" + std::to_string(control.faces[std::size_t(face)].line); };
  auto const number = [](int vertex) { return std::to_string(vertex + 1); };
  for (int e = 0; e < level.GetNumEdges(); ++e)
    if (level.IsEdgeNonManifold(e)) {
      auto const ends = level.GetEdgeVertices(e);
      fail(line_of(level.GetEdgeFaces(e)[0]), "edges of one face, or of two that run them in opposite directions",
           std::to_string(level.GetEdgeFaces(e).size()) + " faces at the edge of vertices " + number(ends[0]) +
               " and " + number(ends[1]));
    }
  for (int v = 0; v < level.GetNumVertices(); ++v)
    if (level.IsVertexNonManifold(v) && level.GetVertexFaces(v).size() > 0)
      fail(line_of(level.GetVertexFaces(v)[0]), "vertices whose faces are joined by edges", "vertex " + number(v));
}

subdivision_surface::~subdivision_surface() = default;

void subdivision_surface::refine(far::TopologyRefiner& refiner, far::TopologyRefiner::AdaptiveOptions options) const {
  // From the second level on a level has at most twice the faces of all before it: first a look at what would take too much.
  constexpr int most_faces = 1 << 23;
  int const level = int(options.isolationLevel);
  for (int look = std::min(level, 2); look <= level; ++look) {
    refiner.Unrefine();
    options.SetIsolationLevel(look);
    refiner.RefineAdaptive(options);
    double const faces = refiner.GetNumFacesTotal();
    if (faces > most_faces)
      fail(name_, "at most " + std::to_string(most_faces) + " faces in all levels",
           std::to_string(refiner.GetNumFacesTotal()) + " at level " + std::to_string(look));
    if (faces * std::pow(2.0, level - look) <= most_faces) look = std::max(look, level - 1);
  }
}

subdivided_model subdivision_surface::to_bezier(int level, end_cap cap, semi_sharp creases) const {
  if (level < least_level_ || level > deepest_level)
    fail(name_, "a level from " + std::to_string(least_level_) + " to " + std::to_string(deepest_level),
         std::to_string(level));
  far::PatchTableFactory::Options options{unsigned(level)};
  options.useInfSharpPatch = true;
  options.useSingleCreasePatch = creases == semi_sharp::cut;
  options.generateLegacySharpCornerPatches = false;
  options.generateVaryingTables = false;
  options.SetPatchPrecision<double>();
  options.SetEndCapType(cap == end_cap::bspline ? far::PatchTableFactory::Options::ENDCAP_BSPLINE_BASIS
                                                : far::PatchTableFactory::Options::ENDCAP_GREGORY_BASIS);
  complaints const said;
  std::unique_ptr<far::TopologyRefiner> const refiner(refiner_factory::Create(*base_));
  refine(*refiner, options.GetRefineAdaptiveOptions());
  std::unique_ptr<far::PatchTable const> const table(far::PatchTableFactory::Create(*refiner, options));

  std::vector<weighted_point> points(std::size_t(refiner->GetNumVerticesTotal() + table->GetNumLocalPoints()));
  for (std::size_t k = 0; k < vertices_.size(); ++k) points[k].position = vertices_[k];
  far::PrimvarRefinerReal<double> const interpolation(*refiner);
  weighted_point* from = points.data();
  for (int l = 1; l < refiner->GetNumLevels(); ++l) {
    weighted_point* to = from + refiner->GetLevel(l - 1).GetNumVertices();
    interpolation.Interpolate(l, from, to);
    from = to;
  }
  if (table->GetNumLocalPoints() > 0)
    table->GetLocalPointStencilTable<double>()->UpdateValues(points.data(),
                                                             points.data() + refiner->GetNumVerticesTotal());

  std::vector<std::pair<int, int>>
      places;  // the face and the corner of each face that is divided once where not of four
  for (int face = 0; face < base_->GetLevel(0).GetNumFaces(); ++face) {
    int const size = base_->GetLevel(0).GetFaceVertices(face).size();
    if (size == 4) places.emplace_back(face, -1);
    for (int corner = 0; size != 4 && corner < size; ++corner) places.emplace_back(face, corner);
  }

  subdivided_model model;
  model.patches.reserve(std::size_t(table->GetNumPatchesTotal()));
  model.domains.reserve(model.patches.capacity());
  for (int array = 0; array < table->GetNumPatchArrays(); ++array) {
    bool const is_gregory = table->GetPatchArrayDescriptor(array).GetType() == far::PatchDescriptor::GREGORY_BASIS;
    for (int k = 0; k < table->GetNumPatches(array); ++k) {
      auto const vertices = table->GetPatchVertices(array, k);
      far::PatchParam const param = table->GetPatchParam(array, k);
      std::array<vec3<double>, 20> net;
      for (int v = 0; v < vertices.size(); ++v) net[std::size_t(v)] = points[std::size_t(vertices[v])].position;
      points_4x4 spline;
      std::copy_n(net.begin(), 16, spline.begin());
      // Of irregular patches OpenSubdiv 3.5 may tell a sharpness that was another's.
      bool const may_be_cut = creases == semi_sharp::cut && param.IsRegular();
      double const sharpness = may_be_cut ? double(table->GetSingleCreasePatchSharpnessValue(array, k)) : 0;
      std::vector<patch_part> parts;
      if (is_gregory) parts.push_back({from_gregory(net)});
      else if (sharpness > 0) parts = from_semi_sharp(spline, std::countr_zero(param.GetBoundary()), sharpness);
      else parts.push_back({from_bspline(spline, param.GetBoundary())});
      auto const [face, corner] = places[std::size_t(param.GetFaceId())];
      double const size = double(param.GetParamFraction());
      for (auto const& part : parts) {
        model.patches.push_back(part.patch);
        model.domains.push_back({face, corner, (param.GetU() + part.u) * size, (param.GetV() + part.v) * size,
                                 part.du * size, part.dv * size});
      }
    }
  }
  check_cover(model.domains);
  return model;
}

void subdivision_surface::check_cover(std::vector<patch_domain> const& domains) const {
  auto const level = base_->GetLevel(0);
  std::vector<double> uncovered(std::size_t(level.GetNumFaces()));  // of squares of side 1, exactly
  bfr::RefinerSurfaceFactory<> const factory(*base_);
  double expected = 0;
  for (int face = 0; face < level.GetNumFaces(); ++face) {
    int const size = level.GetFaceVertices(face).size();
    if (factory.FaceHasLimitSurface(face)) uncovered[std::size_t(face)] = size == 4 ? 1 : size;
    expected += uncovered[std::size_t(face)];
  }
  if (expected == 0) fail(name_, "a face with a limit surface", "none");
  for (auto const& domain : domains) uncovered[std::size_t(domain.face)] -= domain.du * domain.dv;
  auto const bare = std::find_if(uncovered.begin(), uncovered.end(), [](double area) { return area != 0; });
  if (bare != uncovered.end())
    fail(name_, "patches for each face once", "others for face " + std::to_string(bare - uncovered.begin()));
}

limit_distances subdivision_surface::distances(subdivided_model const& model, int n) const {
  auto around = box<double>::empty();
  for (auto const& patch : model.patches) around = merge(around, bounds(patch));
  double const diagonal = std::sqrt(dot(extent(around), extent(around)));
  // Faces of one kind follow each other: the surface of a face is made once.
  std::vector<std::size_t> order(model.patches.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return model.domains[a].face < model.domains[b].face; });
  complaints const said;
  limit_surface limit(*base_, vertices_);
  limit_distances found;
  double sum = 0;
  for (std::size_t const k : order) {
    double largest = 0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double const u = double(i) / (n - 1), v = double(j) / (n - 1);
        double const d = limit.distance(evaluate(model.patches[k], u, v).position, model.domains[k], u, v) / diagonal;
        largest = std::max(largest, d);
        sum = fma(d, d, sum);
        ++found.samples;
      }
    found.largest = std::max(found.largest, largest);
    if (largest <= 1e-13) ++found.exact_patches;
  }
  found.complaints = complaints::text();
  found.rms = std::sqrt(sum / double(found.samples));
  return found;
}

}  // namespace patchrt::examples
