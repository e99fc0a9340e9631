// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Patches that fold, cross themselves, have cusps, poles, vanishing tangents, or are no surfaces at all.

#include "hard_case.hpp"

namespace patchrt::test {

inline void add_folds(std::vector<hard_case>& out) {
  family fold(out, "fold");
  rational const half = frac(1, 2), quarter = frac(1, 4), v = frac(3, 8);
  for (int k : {4, 10, 20, 30, 40}) {
    rational const thin = two_to(-k);
    fold.add({power_name("two sheets of one patch, apart by", -k - 1),
              "a fold-over seen from the front: PEERS 5",
              {surface(a_ * a_, v_, constant(thin) * u_)},
              {frac(1, 16), v, -1},
              {0, 0, 1},
              {{1 + thin / 4, quarter, v}, {1 + 3 * thin / 4, 3 * quarter, v}}});
  }
  fold.add({"a flat patch folded on itself",
            "Nishita et al. 1990: one point with two parameters is not one root",
            {surface(polynomial(2) * u_ - polynomial(2) * u_ * u_, v_, polynomial(0))},
            {frac(3, 8), v, -1},
            {0, 0, 1},
            {{1, quarter, v}, {1, 3 * quarter, v}}});
  fold.add({"the crease of a flat patch folded on itself",
            "construction: a contact in the patch's own plane",
            {surface(polynomial(2) * u_ - polynomial(2) * u_ * u_, v_, polynomial(0))},
            {half, v, -1},
            {0, 0, 1},
            {{1, half, v, contact::touch}}});
  fold.add({"beside the crease of a flat patch folded on itself",
            "construction: beyond the silhouette by 2^-20",
            {surface(polynomial(2) * u_ - polynomial(2) * u_ * u_, v_, polynomial(0))},
            {half + two_to(-20), v, -1},
            {0, 0, 1},
            {}});
  auto const thrice = [](polynomial const& p) {
    polynomial const a = p - constant(frac(1, 2));
    return a * (a * a - constant(frac(1, 16)));
  };
  std::vector<exact_root> nine;
  for (int j = 1; j < 4; ++j)
    for (int i = 1; i < 4; ++i) nine.push_back({1 + frac(i, 4) + frac(4 * j, 4), frac(i, 4), frac(j, 4)});
  fold.add({"nine roots on one patch",
            "several roots on one patch: Kajiya 1982 counts up to 18; duplicates in axom pull request 1477",
            {surface(thrice(u_), thrice(v_), u_ + polynomial(4) * v_)},
            {0, 0, -1},
            {0, 0, 1},
            nine});
  // A node: x = a^2 - 1/16, z = a x, crosses itself at a = +-1/4.
  polynomial const x = a_ * a_ - constant(frac(1, 16));
  fold.add({"the crossing of a patch with itself",
            "construction: two roots at one point of space",
            {surface(x, v_, a_ * x)},
            {-1, v, 0},
            {1, 0, 0},
            {{frac(15, 16), half, v}, {1, quarter, v}, {1, 3 * quarter, v}}});
  fold.add({"beside the crossing of a patch with itself",
            "construction: the order of the two sheets changes at the crossing",
            {surface(x, v_, a_ * x)},
            {frac(1, 64) - frac(1, 16), v, -1},
            {0, 0, 1},
            {{1 - frac(3, 512), frac(5, 8), v}, {1 + frac(3, 512), frac(3, 8), v}}});

  family cusp(out, "cusp");
  exact_patch const edge = surface(a_ * a_, v_, a_ * a_ * a_);
  for (int k : {2, 5, 10, 15}) {
    rational const e = two_to(-k);
    cusp.add({power_name("beside a cuspidal edge, parameters off by", -k),
              "construction: two sheets as near as a cube",
              {edge},
              {e * e, v, -1},
              {0, 0, 1},
              {{1 - e * e * e, half - e, v}, {1 + e * e * e, half + e, v}}})
        .is_close = k >= 15;
  }
  cusp.add({"on a cuspidal edge, across it",
            "construction: the normal vanishes along a line",
            {edge},
            {-1, v, 0},
            {1, 0, 0},
            {{1, half, v, contact::touch}}});
  cusp.add({"on a cuspidal edge, along its tangent plane",
            "construction: the ray meets the edge from the side",
            {edge},
            {0, v, -1},
            {0, 0, 1},
            {{1, half, v, contact::touch}}});
  cusp.add({"beyond a cuspidal edge by 2^-30",
            "construction: no sheet is there",
            {edge},
            {-two_to(-30), v, -1},
            {0, 0, 1},
            {}})
      .is_close = true;
  exact_patch const umbrella = surface(a_, a_ * b_, b_ * b_);
  cusp.add({"Whitney's umbrella across its double line",
            "construction: the singularity that stays under deformation",
            {umbrella},
            {-1, -1, frac(1, 16)},
            {1, 1, 0},
            {{1, half, quarter}, {1, half, 3 * quarter}}});
  cusp.add({"Whitney's umbrella at its pinch point",
            "construction: the singularity that stays under deformation",
            {umbrella},
            {-1, -1, 0},
            {1, 1, 0},
            {{1, half, half, contact::touch}}});
  cusp.add({"Whitney's umbrella along its double line",
            "construction: the ray lies in the patch",
            {umbrella},
            {0, 0, -1},
            {0, 0, 1},
            {{1, half, half, contact::curve, 0, frac(5, 4)}}});
  cusp.add({"Whitney's umbrella below its pinch point",
            "construction: where two sheets were",
            {umbrella},
            {-1, -1, -two_to(-10)},
            {1, 1, 0},
            {}});
}

inline void add_poles(std::vector<hard_case>& out) {
  family pole(out, "pole");
  rational const half = frac(1, 2), quarter = frac(1, 4), v = frac(3, 8);
  std::string const povray = "POV-Ray issue 217: artefacts where the four points of an edge are one; the teapot's lid";
  exact_patch const flat = surface(u_, u_ * v_, polynomial(0));
  exact_patch const cone = surface(u_ * (constant(1) - v_ * v_), polynomial(2) * u_ * v_, u_);
  pole.add(
      {"a triangle with a collapsed edge, inside", povray, {flat}, {half, quarter, -1}, {0, 0, 1}, {{1, half, half}}});
  for (int k : {5, 10, 20, 30, 40}) {
    rational const e = two_to(-k);
    // At 2^-40 rounding moves v by 2^-12.
    pole.add({power_name("a triangle beside its collapsed edge by", -k),
              povray,
              {flat},
              {e, e * v, -1},
              {0, 0, 1},
              {{1, e, v}}})
        .is_close = k >= 40;
    pole.add({power_name("a cone beside its apex by", -k),
              "solvespace issues 652 and 736: no normal at the apex",
              {cone},
              {e * (1 - v * v), 2 * e * v, -1},
              {0, 0, 1},
              {{1 + e, e, v}}})
        .is_close = k >= 40;
  }
  pole.add(
      {"the collapsed corner of a triangle", povray, {flat}, {0, 0, -1}, {0, 0, 1}, {{1, 0, half, contact::singular}}});
  pole.add({"the collapsed corner of a triangle, from the side",
            povray,
            {flat},
            {-2, -1, -1},
            {2, 1, 1},
            {{1, 0, half, contact::singular}}});
  pole.add({"before the collapsed corner of a triangle by 2^-20",
            "rayx issue 467: hits that are not there",
            {flat},
            {-two_to(-20), 0, -1},
            {0, 0, 1},
            {}});
  pole.add({"beside a triangle by 2^-20 near its collapsed corner",
            "rayx issue 467: hits that are not there",
            {flat},
            {two_to(-10), two_to(-10) + two_to(-20), -1},
            {0, 0, 1},
            {}});
  pole.add({"the apex of a cone",
            "truck issue 5, solvespace pull request 736: a normal of length 0",
            {cone},
            {-1, -2, -1},
            {1, 2, 1},
            {{1, 0, half, contact::singular}}});
  exact_patch const lens = surface(u_, u_ * (constant(1) - u_) * b_, polynomial(0));
  pole.add({"a lens with two collapsed edges, inside",
            povray,
            {lens},
            {quarter, frac(3, 16) * -frac(1, 8), -1},
            {0, 0, 1},
            {{1, quarter, v}}});
  pole.add({"a lens near one of its two collapsed edges",
            povray,
            {lens},
            {1 - two_to(-20), two_to(-20) * (1 - two_to(-20)) * -frac(1, 8), -1},
            {0, 0, 1},
            {{1, 1 - two_to(-20), v}}});
  exact_patch const dome = surface(u_ * u_ * (constant(1) - v_ * v_), u_ * u_ * v_, constant(1) - u_ * u_);
  pole.add({"a dome beside a pole where tangents vanish too",
            "the bottom of the teapot and Gumbo's feet: PEERS 3",
            {dome},
            {two_to(-20) * (1 - v * v), two_to(-20) * v, 3},
            {0, 0, -1},
            {{2 + two_to(-20), two_to(-10), v}}});

  family vanishing(out, "tangents");
  exact_patch const squares = surface(u_ * u_, v_ * v_, polynomial(0)),
                    cubes = surface(u_ * u_ * u_, v_ * v_ * v_, polynomial(0));
  std::string const corner =
      "control points that coincide at a corner: 294 corners of the models have vanishing tangents";
  pole.add({"a dome's pole where tangents vanish too",
            "the bottom of the teapot and Gumbo's feet: PEERS 3",
            {dome},
            {0, 0, 3},
            {0, 0, -1},
            {{2, 0, half, contact::singular}}});
  vanishing.add({"tangents that vanish along two edges, inside",
                 corner,
                 {squares},
                 {frac(1, 16), quarter, -1},
                 {0, 0, 1},
                 {{1, quarter, half}}});
  for (int k : {5, 10, 15}) {
    rational const e = two_to(-k);
    vanishing.add({power_name("squares beside the corner where tangents vanish by", -2 * k),
                   corner,
                   {squares},
                   {e * e, e * e, -1},
                   {0, 0, 1},
                   {{1, e, e}}});
    vanishing
        .add({power_name("cubes beside the corner where tangents vanish by", -3 * k),
              corner,
              {cubes},
              {e * e * e, e * e * e, -1},
              {0, 0, 1},
              {{1, e, e}}})
        .is_close = k >= 15;
    vanishing
        .add({power_name("beside a line inside where a tangent vanishes by", -3 * k),
              "construction: regular as a set, singular in the parameters",
              {surface(a_ * a_ * a_, v_, u_)},
              {e * e * e, v, -1},
              {0, 0, 1},
              {{frac(3, 2) + e, half + e, v}}})
        .is_close = k >= 15;
  }
  vanishing.add(
      {"the corner where tangents vanish", corner, {squares}, {0, 0, -1}, {0, 0, 1}, {{1, 0, 0, contact::singular}}});
  vanishing.add({"the corner where second derivatives vanish too",
                 corner,
                 {cubes},
                 {0, 0, -1},
                 {0, 0, 1},
                 {{1, 0, 0, contact::singular}}});
  vanishing.add({"a line inside where a tangent vanishes",
                 "construction: regular as a set, singular in the parameters",
                 {surface(a_ * a_ * a_, v_, polynomial(0))},
                 {0, v, -1},
                 {0, 0, 1},
                 {{1, half, v, contact::singular}}});
  vanishing.add({"a point inside where both tangents vanish",
                 "construction: regular as a set, singular in the parameters",
                 {surface(a_ * a_ * a_, b_ * b_ * b_, polynomial(0))},
                 {0, 0, -1},
                 {0, 0, 1},
                 {{1, half, half, contact::singular}}});

  family collapsed(out, "collapsed");
  exact_patch const line = surface(u_, polynomial(0), polynomial(0)),
                    back = surface(u_ * (constant(1) - u_), polynomial(0), polynomial(0));
  exact_patch const point = surface(constant(1), constant(1), constant(1));
  std::string const collinear = "patches with all points on a line: netradiant-custom issue 302";
  collapsed.add({"through a patch that is a line",
                 collinear,
                 {line},
                 {quarter, 1, 1},
                 {0, -1, -1},
                 {{1, quarter, half, contact::touch}}});
  collapsed.add({"past a patch that is a line", collinear, {line}, {quarter, 1, 1 + two_to(-20)}, {0, -1, -1}, {}});
  collapsed.add(
      {"along a patch that is a line", collinear, {line}, {-1, 0, 0}, {1, 0, 0}, {{1, 0, half, contact::curve, 0, 2}}});
  collapsed.add({"through a line there and back",
                 collinear,
                 {back},
                 {frac(3, 16), 1, 1},
                 {0, -1, -1},
                 {{1, quarter, half, contact::touch}, {1, 3 * quarter, half, contact::touch}}});
  collapsed.add({"through a patch that is a point",
                 "construction: every parameter is a root",
                 {point},
                 {0, 0, 0},
                 {1, 1, 1},
                 {{1, half, half, contact::touch}}});
  collapsed.add(
      {"past a patch that is a point", "construction: no box has a size", {point}, {0, two_to(-20), 0}, {1, 1, 1}, {}});
  collapsed.add({"through a patch that is a point, to a wall",
                 "construction: what is degenerate must not hide what is behind",
                 {point, surface(constant(2), polynomial(4) * u_, polynomial(4) * v_)},
                 {0, 0, 0},
                 {1, 1, 1},
                 {{1, half, half, contact::touch}, {2, half, half, contact::simple, 1}}});
  exact_patch const curve = surface(u_, u_ * u_, u_ * u_ * u_);
  collapsed.add({"through a patch that is a curve",
                 collinear,
                 {curve},
                 {half, quarter, -1},
                 {0, 0, 1},
                 {{frac(9, 8), half, half, contact::touch}}});
  collapsed.add({"past a patch that is a curve", collinear, {curve}, {half, quarter + two_to(-20), -1}, {0, 0, 1}, {}});
}

}  // namespace patchrt::test
