// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Rays and patches that defeat ray tracers, with answers that are known exactly because the patches are made for them:
/// coordinates are polynomials in u and v with dyadic coefficients, so that a ray through given points has roots that
/// anyone can check by hand. Nothing here is computed by what is tested.

// First: what follows has products of its own for points of rationals, which hide patchrt's.
#include "support/rays.hpp"

#include "roots/exact_polynomial.hpp"
#include "shapes/exact.hpp"

#include <patchrt/accel/patch_search.hpp>

#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace patchrt::test {

/// How ray and patch meet.
enum class contact {
  simple,    ///< a regular root inside the patch: must be found, and certified
  border,    ///< a regular root on the patch's border: must be found; rounding decides on which side it is
  singular,  ///< a crossing where the parameters or tangents are singular (a pole, a cusp): must be found
  beyond,    ///< a regular root outside the patch by less than rounding: may be found
  touch,     ///< the ray touches the patch, or crosses it in a root of odd multiplicity: may be found
  curve      ///< where ray and patch begin to have a segment in common: may be found, there or up to its end
};

/// A common point of ray and patch.
struct exact_root {
  rational t, u, v;  ///< (u, v) in [0, 1]^2 unless `beyond`
  contact kind = contact::simple;
  int patch = 0;
  rational t_end = 0;  ///< of a curve
};

/// The levels of accuracy, as sets.
inline constexpr unsigned in_fast = 1u << int(accuracy::fast), in_refined = 1u << int(accuracy::refined),
                          in_certified = 1u << int(accuracy::certified), in_reference = 1u << int(accuracy::reference);
/// `all_hits`, at any level.
inline constexpr unsigned in_all_hits = 1u << 8;
/// The same bits in every size.
inline constexpr unsigned in_scales = 1u << 9;

struct hard_case {
  std::string family;
  std::string name;
  std::string origin;  ///< the paper, a peer's report, or what the construction is meant to defeat
  std::vector<exact_patch> patches;
  exact_point ray_origin, ray_direction;
  std::vector<exact_root> roots;  ///< all those of the whole line, by ascending t
  bool is_close = false;  ///< ray and patch come as near to touching as rounding is: `tangent` is a right answer
  unsigned lost = 0;      ///< levels that are known to give a wrong answer
  unsigned defects = 0;   ///< levels that are wrong against their promise, until that is mended
  double t_min = 0, t_max = std::numeric_limits<double>::infinity();
};

/// Control points are multiplied by this, which makes those of dyadic coefficients dyadic.
inline constexpr int net_scale = 9;

/// The patch with the given coordinates, times `net_scale`.
/// \pre no coordinate is of a degree above 3 in u or v
inline exact_patch surface(polynomial const& x, polynomial const& y, polynomial const& z) {
  exact_patch p{3, 3, std::vector<exact_point>(16)};
  polynomial const* const coordinates[] = {&x, &y, &z};
  for (std::size_t c = 0; c < 3; ++c) {
    polynomial const& q = *coordinates[c];
    if (q.degree_u() > 3 || q.degree_v() > 3)
      throw std::logic_error("a coordinate of a bicubic patch of higher degree");
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        rational b = 0;
        for (std::size_t k = 0; k <= i; ++k) {
          for (std::size_t l = 0; l <= j; ++l)
            b += q.at(k, l) * rational_binomial(i, k) / rational_binomial(3, k) * rational_binomial(j, l) /
                 rational_binomial(3, l);
        }
        p(int(i), int(j))[c] = net_scale * b;
      }
    }
  }
  return p;
}

/// The parameters, and centred ones.
inline polynomial const u_ = in_u(), v_ = in_v();
inline polynomial const a_ = u_ - polynomial(rational(1, 2)), b_ = v_ - polynomial(rational(1, 2));

inline polynomial constant(rational const& c) { return polynomial(c); }
inline rational frac(long long n, long long d) { return rational(n, d); }

/// What makes a row, in the units of the polynomials: a ray from `from` along `along`.
struct row {
  std::string name, origin;
  std::vector<exact_patch> patches;
  exact_point from, along;
  std::vector<exact_root> roots;
};

inline hard_case make_case(std::string const& family, row r) {
  hard_case c;
  c.family = family;
  c.name = std::move(r.name);
  c.origin = std::move(r.origin);
  c.patches = std::move(r.patches);
  c.ray_origin = rational(net_scale) * r.from;
  c.ray_direction = rational(net_scale) * r.along;
  c.roots = std::move(r.roots);
  return c;
}

/// A family being written down; `add` returns the row for its flags.
class family {
 public:
  family(std::vector<hard_case>& out, std::string name) : out_(&out), name_(std::move(name)) {}
  hard_case& add(row r) { return out_->emplace_back(make_case(name_, std::move(r))); }

 private:
  std::vector<hard_case>* out_;
  std::string name_;
};

/// Every hard case that is known.
std::vector<hard_case> const& catalogue();

inline std::string power_name(std::string const& text, int k) { return text + " 2^" + std::to_string(k); }

}  // namespace patchrt::test
