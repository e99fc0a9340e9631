// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays that touch, or nearly.

#include "hard_case.hpp"

namespace patchrt::test {

/// A trough along v, seen along its bottom: z = (u - 1/2)^2 - depth.
inline exact_patch trough(rational const& depth) { return surface(u_, v_, a_ * a_ - polynomial(depth)); }

inline void add_contacts(std::vector<hard_case>& out) {
  family silhouette(out, "silhouette");
  exact_point const from{-1, frac(3, 8), 0}, along{1, 0, 0};
  rational const v = frac(3, 8), half = frac(1, 2), middle = frac(3, 2);
  for (int k : {2, 5, 10, 15, 20, 22, 24}) {
    rational const e = two_to(-k);
    auto& c = silhouette.add({power_name("two roots to either side of a contact, apart by", 1 - k),
                              "the nearer of two roots at a silhouette: Open CASCADE takes the farther, Tejima et al. "
                              "2015 lose it; multiplicity that samples do not see: Oblikovati issue 1608",
                              {trough(e * e)},
                              from,
                              along,
                              {{middle - e, half - e, v}, {middle + e, half + e, v}}});
    c.is_close = k >= 22;
  }
  silhouette.add({"a ray that touches a trough",
                  "solvespace issues 1743 and 1291: no convergence on a grazing root",
                  {trough(0)},
                  from,
                  along,
                  {{middle, half, v, contact::touch}}});
  for (int k : {10, 20, 30, 40, 46, 50}) {
    auto& c = silhouette.add({power_name("a ray that passes a trough at", -k),
                              "rayx issue 467, Embree issue 387: hits that are not there",
                              {trough(-two_to(-k))},
                              from,
                              along,
                              {}});
    c.is_close = k >= 44;
  }
  silhouette.add({"a saddle touched along a principal direction",
                  "construction: contact of order 2, curvature of both signs",
                  {surface(u_, v_, a_ * a_ - b_ * b_)},
                  {-1, half, 0},
                  along,
                  {{middle, half, half, contact::touch}}});
  silhouette.add({"a saddle's straight line",
                  "construction: an asymptotic line lies in the surface",
                  {surface(u_, v_, a_ * a_ - b_ * b_)},
                  {-1, -1, 0},
                  {1, 1, 0},
                  {{1, 0, 0, contact::curve, 0, 2}}});
  silhouette.add({"a contact of order four at a point",
                  "construction: both curvatures vanish",
                  {surface(u_, v_, a_ * a_ * b_ * b_)},
                  {-1, -1, 0},
                  {1, 1, 0},
                  {{middle, half, half, contact::touch}}});
  silhouette.add({"a contact of order six",
                  "construction: the highest that a ray has with a bicubic graph",
                  {surface(u_, v_, a_ * a_ * a_ * b_ * b_ * b_)},
                  {-1, -1, 0},
                  {1, 1, 0},
                  {{middle, half, half, contact::touch}}});
  silhouette.add({"a root of multiplicity three",
                  "construction: a ray along an inflection",
                  {surface(u_, v_, a_ * a_ * a_)},
                  from,
                  along,
                  {{middle, half, v, contact::touch}}});
  for (int k : {3, 6, 9, 12}) {
    rational const e = two_to(-k);
    auto& c = silhouette.add({power_name("three roots at an inflection, apart by", -k),
                              "construction: two folds in one cell, Campagna et al. 1997 on several roots",
                              {surface(u_, v_, a_ * (a_ * a_ - polynomial(e * e)))},
                              from,
                              along,
                              {{middle - e, half - e, v}, {middle, half, v}, {middle + e, half + e, v}}});
    c.is_close = k >= 12;
  }
  silhouette.add({"a contact on the border",
                  "construction: the patch ends where it is touched",
                  {surface(u_, v_, u_ * u_)},
                  from,
                  along,
                  {{1, 0, v, contact::touch}}});
  silhouette.add({"a contact at a corner",
                  "construction: touched from outside the parameter square",
                  {surface(u_, v_, u_ * u_ + v_ * v_)},
                  {-1, 1, 0},
                  {1, -1, 0},
                  {{1, 0, 0, contact::touch}}});
  exact_patch const wall = surface(polynomial(3), u_, v_ - polynomial(half));
  silhouette.add({"a contact before a wall",
                  "construction: what is not certain is before what is",
                  {trough(0), wall},
                  from,
                  along,
                  {{middle, half, v, contact::touch}, {4, v, half, contact::simple, 1}}});
  silhouette.add({"a wall before a contact",
                  "construction: a contact behind the hit is no concern of its",
                  {wall, trough(0)},
                  {6, v, 0},
                  {-1, 0, 0},
                  {{3, v, half}, {frac(11, 2), half, v, contact::touch, 1}}});
  silhouette.add({"a near miss of one patch and a hit on the next",
                  "construction: what nearly touches must not hide what is behind",
                  {trough(-two_to(-30)), wall},
                  from,
                  along,
                  {{4, v, half, contact::simple, 1}}});

  family newton(out, "newton");
  for (int k : {4, 10, 16, 20, 24}) {
    auto& c = newton.add(
        {power_name("a root beyond a valley that is no root by", -2 * k),
         "Newton started outside its basin: Toth 1985, and the phantom root of rayx issue 467",
         {surface(u_, v_,
                  (u_ - polynomial(frac(7, 8))) *
                      ((u_ - polynomial(frac(3, 8))) * (u_ - polynomial(frac(3, 8))) + polynomial(two_to(-2 * k))))},
         from,
         along,
         {{frac(15, 8), frac(7, 8), v}}});
    c.is_close = k >= 22;
  }
  for (int k : {1, 5, 10, 20, 30, 40}) {
    newton.add({power_name("the only root lies beyond the border by", -k),
                "a root off the patch: optiland pull request 778, iterating to the last step",
                {surface(u_, v_, u_ - polynomial(1 + two_to(-k)))},
                from,
                along,
                {}});
    newton.add({power_name("the only root lies within the border by", -k),
                "the same root on the patch: it must not be lost either",
                {surface(u_, v_, u_ - polynomial(1 - two_to(-k)))},
                from,
                along,
                {{2 - two_to(-k), 1 - two_to(-k), v}}});
  }
  polynomial const x = polynomial(4) * a_;
  newton.add(
      {"steps that go to and fro about a fold",
       "construction: x^3 - 2 x + 119/64 has an attracting cycle of Newton's steps near 0 and 1, its root is -7/4",
       {surface(u_, v_, x * x * x - polynomial(2) * x + polynomial(frac(119, 64)))},
       from,
       along,
       {{frac(17, 16), frac(1, 16), v}}});
  newton.add({"a root where all derivatives by u but the third vanish",
              "construction: steps that shrink by two thirds only",
              {surface(polynomial(4) * a_ * a_ * a_, v_, u_)},
              {frac(1, 16), v, -1},
              {0, 0, 1},
              {{frac(7, 4), frac(3, 4), v}}});
  newton.add({"tangents a million times as long at one end",
              "parameters that run unevenly: Efremov et al. 2005",
              {surface(polynomial(two_to(20)) * u_ * u_ * u_ + u_, v_, a_)},
              {two_to(20) / 8 + half, v, -1},
              {0, 0, 1},
              {{1, half, v}}});
  newton.add({"control points far apart along the ray alone",
              "the z component of pbrt-v3 pull request 1 (curves)",
              {surface(u_, v_, polynomial(two_to(16)) * u_ * u_ * u_)},
              {frac(1, 4), v, -1},
              {0, 0, 1},
              {{1 + two_to(10), frac(1, 4), v}}});
}

}  // namespace patchrt::test
