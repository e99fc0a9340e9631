// SPDX-License-Identifier: MIT
#pragma once

#include "obj.hpp"

#include <patchrt/shapes/bezier_patch.hpp>

#include <opensubdiv/far/topologyRefiner.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace patchrt::examples {

/// How the faces that no B-spline patch describes (at irregular vertices, semi-sharp creases) become bicubic patches at the
/// deepest level.
enum class end_cap {
  bspline,  ///< B-spline patches that OpenSubdiv fits
  gregory,  ///< OpenSubdiv's Gregory patches, the two inner points at each corner replaced by their mean: edges stay as they
            ///< are, so neighbours share them
};

/// What becomes of faces with a crease of finite sharpness along one side, the same beyond both ends, that are regular
/// otherwise: the limit surface there is two or three bicubic patches.
enum class semi_sharp {
  cut,     ///< those patches
  isolate  ///< divided towards the crease: the same surface in many more patches
};

/// Where a patch lies in the control mesh: the rectangle of size (du, dv) from (u, v) of a face of four corners, or of the
/// quarter of the face at the given corner where it has another number of corners.
struct patch_domain {
  int face;
  int corner;  ///< of the face; -1 where the face has four
  double u, v, du, dv;
};

struct subdivided_model {
  std::vector<bicubic_patch<double>> patches;  ///< u, v and normals as the faces have them
  std::vector<patch_domain> domains;           ///< of each patch
};

/// How far points of patches are from the limit surface, in diagonals of the patches' box.
struct limit_distances {
  double largest = 0;
  double rms = 0;
  std::size_t samples = 0;
  std::size_t exact_patches = 0;  ///< those with no point farther than 1e-13: rounding
  std::string complaints;         ///< OpenSubdiv's while it evaluated the limit surface: it may be wrong then
};

/// The Catmull-Clark surface of a control mesh with creases, by OpenSubdiv.
class subdivision_surface {
 public:
  static constexpr int deepest_level = 10;

  /// \param control The tags are those of OpenSubdiv's shapes: `crease` pairs of vertices and a sharpness for all or one for
  ///        each pair, `corner` the same of vertices, `hole` faces, `interpolateboundary` 0 none, 1 edges and corners, 2
  ///        edges (the default), `creasemethod` normal or chaikin, `smoothtriangles` catmark or smooth; indices count from 0.
  ///        Tags whose names begin with `facevarying` are of texture coordinates and passed over.
  /// \throws std::runtime_error "NAME:LINE: expected ..., got ..." for tags and faces that are wrong, edges of more than two
  ///         faces or of two that run it the same way, and vertices whose faces are not all joined.
  explicit subdivision_surface(obj_model const& control);
  ~subdivision_surface();

  /// The limit surface as bicubic Bezier patches.
  ///
  /// Faces are divided until they are regular, `level` times at most; regular faces become Bezier patches exactly, also at
  /// boundaries and creases. What is still irregular then is approximated; creases of finite sharpness are as sharp as the
  /// level at most.
  /// \param level From 0, or 1 where a face has other than four corners, to `deepest_level`.
  /// \throws std::runtime_error "NAME: expected ..., got ..." for another level, no patch at all, or more than 2^23
  ///         faces in all levels.
  subdivided_model to_bezier(int level, end_cap cap, semi_sharp creases = semi_sharp::cut) const;

  /// The distances of n x n points of each patch, edges included, from the limit surface of its face: an upper bound of those
  /// from the whole limit surface, and at most those between points of the same parameters.
  ///
  /// The limit surface is evaluated by OpenSubdiv at ten levels of division; the nearest point is searched by the Gauss-Newton
  /// iteration from the point of the same parameters.
  /// \pre n from 2 on.
  limit_distances distances(subdivided_model const& model, int n) const;

 private:
  void refine(OpenSubdiv::Far::TopologyRefiner& refiner,
              OpenSubdiv::Far::TopologyRefiner::AdaptiveOptions options) const;
  void check_cover(std::vector<patch_domain> const& domains) const;

  std::string name_;
  std::vector<vec3<double>> vertices_;
  int least_level_ = 0;
  std::unique_ptr<OpenSubdiv::Far::TopologyRefiner> base_;
};

}  // namespace patchrt::examples
