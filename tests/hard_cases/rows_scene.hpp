// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Flat and edge-on patches, borders and joins, rays along axes, sizes and places, sheets close together.

#include "hard_case.hpp"

namespace patchrt::test {

inline void add_flat(std::vector<hard_case>& out) {
  family flat(out, "flat");
  rational const half = frac(1, 2), quarter = frac(1, 4), v = frac(3, 8);
  exact_patch const square = surface(u_, v_, polynomial(0));
  exact_patch const bent_inside = surface(u_ + u_ * (polynomial(1) - u_) * b_, v_, polynomial(0));
  flat.add({"a square from the front",
            "kite issue 9: the cases every intersector needs",
            {square},
            {quarter, v, 1},
            {0, 0, -1},
            {{1, quarter, v}}});
  flat.add({"a square's middle, where all cells meet",
            "Campagna et al. 1997, Efremov et al. 2005: one root reported by several cells",
            {square},
            {half, half, 1},
            {0, 0, -1},
            {{1, half, half}}});
  flat.add({"a flat patch with bent parameter lines",
            "construction: no thickness, no constant tangents",
            {bent_inside},
            {quarter + frac(3, 16) * -frac(1, 8), v, 1},
            {0, 0, -1},
            {{1, quarter, v}}});
  flat.add({"a square edge-on, in its plane",
            "kite issue 9: parallel and on top",
            {square},
            {-1, v, 0},
            {1, 0, 0},
            {{1, 0, v, contact::curve, 0, 2}}});
  flat.add({"a square edge-on, along its diagonal",
            "kite issue 9: parallel and on top",
            {square},
            {-1, -1, 0},
            {1, 1, 0},
            {{1, 0, 0, contact::curve, 0, 2}}});
  flat.add({"a square edge-on, along its border",
            "axom pull request 1477: a segment of intersections",
            {square},
            {-1, 0, 0},
            {1, 0, 0},
            {{1, 0, 0, contact::curve, 0, 2}}});
  for (int k : {10, 20, 40})
    flat.add({power_name("a square edge-on, beside its plane by", -k),
              "brepkit pull request 1069: parallel by an absolute epsilon",
              {square},
              {-1, v, two_to(-k)},
              {1, 0, 0},
              {}});
  for (int k : {10, 20, 30, 40, 46}) {
    rational const e = two_to(-k);
    auto& c = flat.add({power_name("a square at a slope of", -k),
                        "Embree issue 387: nearly parallel to the plane, t far off",
                        {square},
                        {-half, v, e},
                        {1, 0, -e},
                        {{1, half, v}}});
    c.is_close = k >= 40;
  }
  exact_patch const gutter = surface(u_, v_, u_ * u_);
  flat.add({"a cylinder's ruling",
            "quadrics: a ray along a generator",
            {gutter},
            {quarter, -1, frac(1, 16)},
            {0, 1, 0},
            {{1, quarter, 0, contact::curve, 0, 2}}});
  flat.add({"beside a cylinder's ruling by 2^-20",
            "quadrics: a ray along a generator",
            {gutter},
            {quarter, -1, frac(1, 16) + two_to(-20)},
            {0, 1, 0},
            {}});
  for (int k : {10, 20, 30})
    flat.add({power_name("a cylinder's ruling at a slope of", -k),
              "quadrics: a ray nearly along a generator",
              {gutter},
              {quarter, -half, frac(1, 16) - two_to(-k)},
              {0, 1, two_to(-k)},
              {{1, quarter, half}}});
}

inline void add_borders(std::vector<hard_case>& out) {
  family border(out, "border");
  rational const half = frac(1, 2), v = frac(3, 8);
  exact_patch const hill = surface(u_, v_, u_ * (polynomial(1) - u_) + v_ * v_);
  exact_patch const next = surface(u_ + polynomial(1), v_, polynomial(-1) * (u_ * (polynomial(1) - u_)) + v_ * v_);
  border.add({"a border curve",
              "Embree issue 181: through the geometry at a vertex",
              {hill},
              {0, v, -1},
              {0, 0, 1},
              {{1 + v * v, 0, v, contact::border}}});
  border.add({"a corner",
              "Embree issue 181: through the geometry at a vertex",
              {hill},
              {1, 1, -1},
              {0, 0, 1},
              {{2, 1, 1, contact::border}}});
  border.add({"a corner, aslant",
              "vk_raytracing_tutorial issue 12: through a vertex",
              {hill},
              {-1, -2, -3},
              {1, 2, 3},
              {{1, 0, 0, contact::border}}});
  border.add({"the border of two patches",
              "GoTools pull request 155, solvespace issue 732: on a seam",
              {hill, next},
              {1, v, -1},
              {0, 0, 1},
              {{1 + v * v, 1, v, contact::border}, {1 + v * v, 0, v, contact::border, 1}}});
  border.add({"the border of two patches, from the side",
              "solvespace issue 732: on a seam",
              {hill, next},
              {-1, v, v * v - 1},
              {2, 0, 1},
              {{1, 1, v, contact::border}, {1, 0, v, contact::border, 1}}});
  exact_patch const quarters[] = {
      surface(u_, v_, u_ * v_), surface(u_ - polynomial(1), v_, (u_ - polynomial(1)) * v_),
      surface(u_, v_ - polynomial(1), u_ * (v_ - polynomial(1))),
      surface(u_ - polynomial(1), v_ - polynomial(1), (u_ - polynomial(1)) * (v_ - polynomial(1)))};
  border.add({"the corner of four patches",
              "rays through a corner shared by many patches: PEERS 10",
              {quarters[0], quarters[1], quarters[2], quarters[3]},
              {frac(1, 8), frac(1, 4), -1},
              {-frac(1, 8), -frac(1, 4), 1},
              {{1, 0, 0, contact::border},
               {1, 1, 0, contact::border, 1},
               {1, 0, 1, contact::border, 2},
               {1, 1, 1, contact::border, 3}}});
  border.add({"along the border of two patches",
              "solvespace pull request 1751: the intersection is on the boundary by construction",
              {quarters[0], quarters[1]},
              {0, -1, 0},
              {0, 1, 0},
              {{1, 0, 0, contact::curve, 0, 2}, {1, 1, 0, contact::curve, 1, 2}}});
  // A T-junction: one patch to the left, its halves to the right.
  exact_patch const left = surface(u_ - polynomial(1), v_, v_ * v_);
  exact_patch const low = surface(u_, polynomial(half) * v_, polynomial(frac(1, 4)) * v_ * v_ + u_);
  exact_patch const high = surface(u_, polynomial(half) + polynomial(half) * v_,
                                   polynomial(frac(1, 4)) * (polynomial(1) + v_) * (polynomial(1) + v_) + u_);
  border.add({"the corner of a T-junction",
              "cracks at T-junctions: PEERS 6",
              {left, low, high},
              {0, half, -1},
              {0, 0, 1},
              {{frac(5, 4), 1, half, contact::border},
               {frac(5, 4), 0, 1, contact::border, 1},
               {frac(5, 4), 0, 0, contact::border, 2}}});
  border.add({"the bar of a T-junction",
              "cracks at T-junctions: PEERS 6",
              {left, low, high},
              {0, frac(1, 4), -1},
              {0, 0, 1},
              {{frac(17, 16), 1, frac(1, 4), contact::border}, {frac(17, 16), 0, half, contact::border, 1}}});
  for (int k : {10, 20, 30, 40, 50}) {
    rational const e = two_to(-k);
    auto& c = border.add({power_name("outside a border by", -k),
                          "rayx issue 467: hits that are not there",
                          {hill},
                          {-e, v, -1},
                          {0, 0, 1},
                          {}});
    if (k >= 48) c.roots = {{1 - e - e * e + v * v, -e, v, contact::beyond}};
    auto& d = border.add({power_name("inside a border by", -k),
                          "construction: the last of the patch",
                          {hill},
                          {e, v, -1},
                          {0, 0, 1},
                          {{1 + e - e * e + v * v, e, v}}});
    if (k >= 48) d.roots[0].kind = contact::border;
  }
}

inline void add_axes(std::vector<hard_case>& out) {
  family axis(out, "range");
  rational const v = frac(3, 8), quarter = frac(1, 4), half = frac(1, 2);
  exact_patch const arch = surface(u_, v_, constant(frac(1, 16)) - a_ * a_);
  exact_point const from{-1, v, 0}, along{1, 0, 0};
  std::vector<exact_root> const roots{{frac(5, 4), quarter, v}, {frac(7, 4), 3 * quarter, v}};
  std::string const secondary = "secondary rays that hit their own start: PEERS 7, rayx issue 467";
  auto const ranged = [&](std::string const& name, double t_min, double t_max) {
    auto& c = axis.add({name, secondary, {arch}, from, along, roots});
    c.t_min = t_min;
    c.t_max = t_max;
  };
  ranged("from 2^-30 before the first root", 1.25 - 0x1p-30, 2);
  ranged("from 2^-30 behind the first root", 1.25 + 0x1p-30, 2);
  ranged("between the two roots", 1.25 + 0x1p-30, 1.75 - 0x1p-30);
  ranged("up to 2^-30 behind the last root", 1.25 + 0x1p-30, 1.75 + 0x1p-30);
  ranged("behind both roots", 1.75 + 0x1p-30, 1e300);
  ranged("a range of negative t", -8, -1);
  {
    auto& c = axis.add({"from a point of the patch to another",
                        secondary,
                        {arch},
                        {quarter, v, 0},
                        {1, 0, 0},
                        {{0, quarter, v}, {half, 3 * quarter, v}}});
    c.t_min = 0x1p-40;
  }
  for (int k : {-60, 60})
    axis.add({power_name("a direction of length", k),
              "construction: t counts in lengths of the direction",
              {arch},
              from,
              {two_to(k), 0, 0},
              {{frac(5, 4) / two_to(k), quarter, v}, {frac(7, 4) / two_to(k), 3 * quarter, v}}});
  for (int k : {-30, -80, -140})
    axis.add({power_name("a component of the direction of", k),
              "optiland pull request 778: 0/0 for an axial ray",
              {surface(u_, v_, v_)},
              {half, half, 0},
              {two_to(k), 0, 1},
              {{half, half + two_to(k) / 2, half}}});
}

inline void add_sizes(std::vector<hard_case>& out) {
  family size(out, "size");
  rational const half = frac(1, 2), v = frac(3, 8), quarter = frac(1, 4);
  for (int k : {10, 20, 30, 40}) {
    rational const e = two_to(-k);
    // At 2^-40 turned poses leave little more than rounding between the two sides.
    size.add({power_name("a sliver of width", -k),
              "slivers of aspect 1e6 and beyond: PEERS 9, Embree issue 387",
              {surface(u_, constant(e) * v_, a_ * a_)},
              {quarter, e * v, -1},
              {0, 0, 1},
              {{frac(17, 16), quarter, v}}})
        .is_close = k >= 40;
    size.add({power_name("past a sliver of width", -k),
              "slivers of aspect 1e6 and beyond: PEERS 9",
              {surface(u_, constant(e) * v_, a_ * a_)},
              {quarter, e * frac(17, 16), -1},
              {0, 0, 1},
              {}});
    size.add({power_name("a small patch beside a large one, as", -k),
              "construction: one tree, two sizes; ospray issue 600: far and thin",
              {surface(u_, v_, u_ * v_),
               surface(constant(e) * u_ + polynomial(2), constant(e) * v_, constant(e) * u_ * v_)},
              {2 + e * half, e * v, -1},
              {0, 0, 1},
              {{1 + e * half * v, half, v, contact::simple, 1}}})
        .is_close = k >= 40;
    size.add({power_name("a patch away from the origin by", k),
              "offsets of 1e6 diagonals: PEERS 9",
              {surface(u_ + constant(1 / e), v_ - constant(1 / e), u_ * v_)},
              {1 / e + half, quarter - 1 / e, -1},
              {0, 0, 1},
              {{frac(9, 8), half, quarter}}});
    size.add({power_name("a ray from afar, at", k),
              "far eyes: PEERS 9; ospray issue 600",
              {surface(u_, v_, u_ * v_)},
              {half, quarter, -1 / e},
              {0, 0, 1},
              {{1 / e + frac(1, 8), half, quarter}}});
    size.add({power_name("a patch as high as", k),
              "construction: a slope everywhere steep",
              {surface(u_, v_, constant(1 / e) * u_ * v_)},
              {half, quarter, -1},
              {0, 0, 1},
              {{1 + 1 / e / 8, half, quarter}}})
        .is_close = k >= 40;
  }

  family sheets(out, "sheets");
  for (int k : {10, 20, 30, 40, 48}) {
    rational const e = two_to(-k);
    auto& c = sheets.add({power_name("two sheets apart by", -k),
                          "nearly coincident sheets",
                          {surface(u_, v_, u_ * v_ + constant(e)), surface(u_, v_, u_ * v_)},
                          {half, quarter, 1},
                          {0, 0, -1},
                          {{frac(7, 8) - e, half, quarter}, {frac(7, 8), half, quarter, contact::simple, 1}}});
    c.is_close = k >= 48;
  }
  sheets.add({"two sheets that are the same",
              "duplicates in axom pull request 1477",
              {surface(u_, v_, u_ * v_), surface(u_, v_, u_ * v_)},
              {half, quarter, 1},
              {0, 0, -1},
              {{frac(7, 8), half, quarter}, {frac(7, 8), half, quarter, contact::simple, 1}}});
  sheets.add({"two sheets that cross where the ray meets them",
              "construction: two patches, one point",
              {surface(u_, v_, u_), surface(u_, v_, polynomial(1) - u_)},
              {half, quarter, 2},
              {0, 0, -1},
              {{frac(3, 2), half, quarter}, {frac(3, 2), half, quarter, contact::simple, 1}}});
  sheets.add({"beside the line where two sheets cross by 2^-30",
              "construction: the order of patches turns about",
              {surface(u_, v_, u_), surface(u_, v_, polynomial(1) - u_)},
              {half - two_to(-30), quarter, 2},
              {0, 0, -1},
              {{frac(3, 2) - two_to(-30), half - two_to(-30), quarter, contact::simple, 1},
               {frac(3, 2) + two_to(-30), half - two_to(-30), quarter}}});
}

}  // namespace patchrt::test
