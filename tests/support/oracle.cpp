// SPDX-License-Identifier: MIT
#include "oracle.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

namespace patchrt::test {
namespace {

#if defined(__SIZEOF_FLOAT128__)
__extension__ typedef __float128 quad;
#else
using quad = long double;
#endif
using real = long double;

constexpr real rounding = std::numeric_limits<real>::epsilon();
/// How far beyond [0, 1] the search starts, and beyond a cell its root may lie.
constexpr real overhang = real(1) / 64;
constexpr int most_cells = 20000;
constexpr int newton_steps = 40;
/// Roundings of all cuts together, in units of the patch's projection: a cell's numbers shrink with it.
constexpr real rounding_steps = 256;

template <class R> struct point3 { R x, y, z; };
template <class R> R dot(point3<R> const& a, point3<R> const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class R> point3<R> cross(point3<R> const& a, point3<R> const& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
real length(point3<quad> const& a) { return std::sqrt(static_cast<real>(dot(a, a))); }

template <class R> R at(point3<R> const& p, int axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }
template <class R> point3<R> rounded(point3<quad> const& p) {
  return {static_cast<R>(p.x), static_cast<R>(p.y), static_cast<R>(p.z)};
}

/// The ray, and the way along its direction d to a coordinate plane: x_i - (d_i / d_k) x_k of a vector x, with k the largest
/// component of d and i the two others.
struct projection {
  point3<quad> origin;
  point3<quad> direction;
  int axis;
  quad slope[2];

  template <class R> R operator()(point3<R> const& x, int r) const {
    return at(x, (axis + 1 + r) % 3) - static_cast<R>(slope[r]) * at(x, axis);
  }
};

std::optional<projection> project_along(oracle_ray const& ray) {
  if (!std::all_of(ray.begin(), ray.begin() + 6, [](double x) { return std::isfinite(x); })) return {};
  if (std::isnan(ray[6]) || std::isnan(ray[7])) return {};
  int k = 3;
  for (int a = 4; a < 6; ++a) {
    if (std::abs(ray[std::size_t(a)]) > std::abs(ray[std::size_t(k)])) k = a;
  }
  if (ray[std::size_t(k)] == 0) return {};
  projection p{{ray[0], ray[1], ray[2]}, {ray[3], ray[4], ray[5]}, k - 3, {}};
  for (int r = 0; r < 2; ++r) p.slope[r] = at(p.direction, (p.axis + 1 + r) % 3) / at(p.direction, p.axis);
  return p;
}

/// A bicubic to the plane, over the cell x, y in [0, 1] that is u0 <= u <= u1, v0 <= v <= v1 of the patch.
struct cell {
  real f[2][4][4];
  real u0, u1, v0, v1;
};

void lower_part(real (&p)[4], real t) {
  for (int n = 1; n < 4; ++n) {
    for (int i = 3; i >= n; --i) p[i] = p[i - 1] + t * (p[i] - p[i - 1]);
  }
}

void upper_part(real (&p)[4], real t) {
  for (int n = 1; n < 4; ++n) {
    for (int i = 0; i < 4 - n; ++i) p[i] = p[i] + t * (p[i + 1] - p[i]);
  }
}

template <class Cut> void cut(cell& c, bool along_u, Cut const& curve) {
  for (auto& f : c.f) {
    for (int k = 0; k < 4; ++k) {
      real p[4];
      for (int i = 0; i < 4; ++i) p[i] = along_u ? f[i][k] : f[k][i];
      curve(p);
      for (int i = 0; i < 4; ++i) (along_u ? f[i][k] : f[k][i]) = p[i];
    }
  }
}

/// The part t0 <= x <= t1 of a cell, or y for x.
cell part(cell c, bool along_u, real t0, real t1) {
  if (t1 != 1) cut(c, along_u, [t1](real(&p)[4]) { lower_part(p, t1); });
  if (t0 != 0) cut(c, along_u, [t0, t1](real(&p)[4]) { upper_part(p, t0 / t1); });
  real& lo = along_u ? c.u0 : c.v0;
  real& hi = along_u ? c.u1 : c.v1;
  real const width = hi - lo, start = lo;
  lo = start + t0 * width;
  hi = start + t1 * width;
  return c;
}

/// The control points less the origin, projected.
template <class R> cell project(oracle_patch const& patch, projection const& view) {
  cell c{{}, 0, 1, 0, 1};
  point3<R> const o = rounded<R>(view.origin);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      std::size_t const k = std::size_t(3 * (4 * i + j));
      point3<R> const p{R(patch[k]) - o.x, R(patch[k + 1]) - o.y, R(patch[k + 2]) - o.z};
      for (int r = 0; r < 2; ++r) c.f[r][i][j] = static_cast<real>(view(p, r));
    }
  }
  return c;
}

real largest(cell const& c) {
  real m = 0;
  for (auto const& f : c.f) {
    for (auto const& row : f) {
      for (real const x : row) m = std::max(m, std::abs(x));
    }
  }
  return m;
}

/// Whether a line has all control points on one side, further than `error` from the origin on the other.
bool is_separated(cell const& c, real error) {
  real lo[2] = {c.f[0][0][0], c.f[1][0][0]}, hi[2] = {lo[0], lo[1]};
  for (int r = 0; r < 2; ++r) {
    for (auto const& row : c.f[r]) {
      for (real const x : row) {
        lo[r] = std::min(lo[r], x);
        hi[r] = std::max(hi[r], x);
      }
    }
    if (lo[r] > error || hi[r] < -error) return true;
  }
  // The cone of the control points from a clockwise to b; its bisector is the normal of the separating line.
  real ax = c.f[0][0][0], ay = c.f[1][0][0], bx = ax, by = ay;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      real const x = c.f[0][i][j], y = c.f[1][i][j];
      bool const left_of_a = ax * y - ay * x >= 0, right_of_b = x * by - y * bx >= 0;
      if (left_of_a && right_of_b) continue;
      if (!left_of_a && !right_of_b) return false;
      if (left_of_a) {
        bx = x;
        by = y;
      } else {
        ax = x;
        ay = y;
      }
    }
  }
  real const a = std::hypot(ax, ay), b = std::hypot(bx, by);
  real const nx = ax / a + bx / b, ny = ay / a + by / b, n = std::hypot(nx, ny);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      if (!(nx * c.f[0][i][j] + ny * c.f[1][i][j] > 2 * n * error)) return false;
    }
  }
  return true;
}

enum class verdict { no_root, one_root_at_most, undecided };

/// Krawczyk's operator on the cell: K = m - A f(m) + (I - A J)(X - m), with A the inverse of J(m), m the middle of X.
///
/// Slopes |I - A J| up to 1/2 on the cell are below 1 on a cell 1/64 larger on each side: no two roots there.
verdict krawczyk(cell const& c, real error, real& x, real& y) {
  real f[2], du[2], dv[2];
  for (int r = 0; r < 2; ++r) {
    real p[4], q[4];
    for (int i = 0; i < 4; ++i) {
      auto const& w = c.f[r][i];
      p[i] = (w[0] + 3 * (w[1] + w[2]) + w[3]) / 8;
      q[i] = 3 * (w[3] + w[2] - w[1] - w[0]) / 4;
    }
    f[r] = (p[0] + 3 * (p[1] + p[2]) + p[3]) / 8;
    du[r] = 3 * (p[3] + p[2] - p[1] - p[0]) / 4;
    dv[r] = (q[0] + 3 * (q[1] + q[2]) + q[3]) / 8;
  }
  real const det = du[0] * dv[1] - du[1] * dv[0];
  real const size = (std::abs(du[0]) + std::abs(dv[0])) * (std::abs(du[1]) + std::abs(dv[1]));
  if (!(std::abs(det) > 1024 * rounding * size)) return verdict::undecided;
  real const inverse[2][2] = {{dv[1] / det, -dv[0] / det}, {-du[1] / det, du[0] / det}};
  real middle[2], radius[2];
  for (int r = 0; r < 2; ++r) {
    real const a = inverse[r][0], b = inverse[r][1];
    real slope[2] = {0, 0};  // largest |I - A J|
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        if (i < 3) {
          real const s = 3 * (a * (c.f[0][i + 1][j] - c.f[0][i][j]) + b * (c.f[1][i + 1][j] - c.f[1][i][j]));
          slope[0] = std::max(slope[0], std::abs((r == 0) - s));
        }
        if (j < 3) {
          real const s = 3 * (a * (c.f[0][i][j + 1] - c.f[0][i][j]) + b * (c.f[1][i][j + 1] - c.f[1][i][j]));
          slope[1] = std::max(slope[1], std::abs((r == 1) - s));
        }
      }
    }
    real const noise = (std::abs(a) + std::abs(b)) * error;
    middle[r] = real(0.5) - (a * f[0] + b * f[1]);
    radius[r] = (slope[0] + slope[1]) * (real(0.5) + 32 * rounding) + 16 * noise;
  }
  x = middle[0];
  y = middle[1];
  for (int r = 0; r < 2; ++r) {
    if (std::abs(middle[r] - real(0.5)) > radius[r] + real(0.5)) return verdict::no_root;
  }
  return std::max(radius[0], radius[1]) <= real(0.25) ? verdict::one_root_at_most : verdict::undecided;
}

/// Surface point and tangents.
template <class R> struct jet { point3<R> q, du, dv; };

template <class R> jet<R> evaluate(oracle_patch const& patch, R u, R v) {
  R const su = 1 - u, sv = 1 - v;
  R const bu[4] = {su * su * su, 3 * u * su * su, 3 * u * u * su, u * u * u};
  R const bv[4] = {sv * sv * sv, 3 * v * sv * sv, 3 * v * v * sv, v * v * v};
  R const cu[3] = {3 * su * su, 6 * u * su, 3 * u * u};
  R const cv[3] = {3 * sv * sv, 6 * v * sv, 3 * v * v};
  R out[3][3] = {};
  for (std::size_t a = 0; a < 3; ++a) {
    R row[4];
    for (std::size_t i = 0; i < 4; ++i) {
      R const p[4] = {patch[12 * i + a], patch[12 * i + 3 + a], patch[12 * i + 6 + a], patch[12 * i + 9 + a]};
      row[i] = bv[0] * p[0] + bv[1] * p[1] + bv[2] * p[2] + bv[3] * p[3];
      out[0][a] += bu[i] * row[i];
      out[2][a] += bu[i] * (cv[0] * (p[1] - p[0]) + cv[1] * (p[2] - p[1]) + cv[2] * (p[3] - p[2]));
    }
    for (std::size_t i = 0; i < 3; ++i) out[1][a] += cu[i] * (row[i + 1] - row[i]);
  }
  auto const point = [](R const(&p)[3]) { return point3<R>{p[0], p[1], p[2]}; };
  return {point(out[0]), point(out[1]), point(out[2])};
}

/// Newton on the two projected coordinates from (u, v), to small steps that no longer shrink: whether it came there.
template <class R> bool polish(oracle_patch const& patch, projection const& view, quad& u, quad& v) {
  point3<R> const o = rounded<R>(view.origin);
  real last = std::numeric_limits<real>::infinity();
  for (int n = 0; n < newton_steps; ++n) {
    jet<R> const s = evaluate<R>(patch, static_cast<R>(u), static_cast<R>(v));
    point3<R> const q{s.q.x - o.x, s.q.y - o.y, s.q.z - o.z};
    R const f = view(q, 0), g = view(q, 1);
    R const fu = view(s.du, 0), fv = view(s.dv, 0), gu = view(s.du, 1), gv = view(s.dv, 1);
    R const det = fu * gv - fv * gu;
    if (det == 0) return false;
    R const step_u = (f * gv - g * fv) / det, step_v = (fu * g - gu * f) / det;
    real const step = std::max(std::abs(static_cast<real>(step_u)), std::abs(static_cast<real>(step_v)));
    if (step < 1e-9L && !(step < last)) return true;
    last = step;
    u -= step_u;
    v -= step_v;
    if (step == 0) return true;
  }
  return false;
}

oracle_root describe(oracle_patch const& patch, projection const& view, int index, quad u, quad v) {
  jet<quad> const s = evaluate<quad>(patch, u, v);
  point3<quad> const q{s.q.x - view.origin.x, s.q.y - view.origin.y, s.q.z - view.origin.z};
  point3<quad> const n = cross(s.du, s.dv);
  real const t = static_cast<real>(dot(q, view.direction) / dot(view.direction, view.direction));
  real const det = std::abs(static_cast<real>(dot(n, view.direction)));
  real const a = length(s.du), b = length(s.dv), d = length(view.direction), area = length(n);
  auto const ratio = [](real x, real y) { return static_cast<double>(y > 0 ? x / y : 0); };
  real const ru = static_cast<real>(u), rv = static_cast<real>(v);
  real const edge = std::min(std::min(ru, 1 - ru) * a, std::min(rv, 1 - rv) * b);
  return {t, ru, rv, index, ratio(det, area * d), ratio(det, a * b * d), static_cast<double>(edge), 0, false, 0};
}

/// One root, or several that no arithmetic at hand tells apart, in a cell at the rounding level.
struct cluster {
  real u0, u1, v0, v1;
  bool touches(cluster const& o) const { return u0 <= o.u1 && o.u0 <= u1 && v0 <= o.v1 && o.v0 <= v1; }
  bool holds(oracle_root const& r) const {
    real const du = u1 - u0, dv = v1 - v0;
    return u0 - du <= r.u && r.u <= u1 + du && v0 - dv <= r.v && r.v <= v1 + dv;
  }
};

struct found {
  std::vector<oracle_root> roots;
  std::vector<cluster> clusters;
  bool complete = true;
};

/// All roots of the patch over [-margin, 1 + margin]^2.
found search(oracle_patch const& patch, projection const& view, int index, real margin) {
  found out;
  real reach = 0;
  for (double const x : patch) reach = std::max(reach, std::abs(real(x)));
  for (int a = 0; a < 3; ++a) reach = std::max(reach, std::abs(static_cast<real>(at(view.origin, a))));
  cell const rough = project<real>(patch, view);
  if (is_separated(rough, 16 * rounding * reach + 16 * margin * largest(rough))) return out;
  cell const whole = project<quad>(patch, view);
  real const error = rounding_steps * rounding * largest(whole);
  std::vector<cell> stack{part(part(whole, true, -overhang, 1 + overhang), false, -overhang, 1 + overhang)};
  for (int visited = 0; !stack.empty(); ++visited) {
    cell const c = stack.back();
    stack.pop_back();
    if (visited == most_cells) {
      out.complete = false;
      out.clusters.assign(1, {0, 1, 0, 1});
      return out;
    }
    if (c.u1 < -margin || c.v1 < -margin || c.u0 > 1 + margin || c.v0 > 1 + margin) continue;
    if (is_separated(c, error)) continue;
    real x = 0, y = 0;
    verdict const k = krawczyk(c, error, x, y);
    if (k == verdict::no_root) continue;
    if (k == verdict::one_root_at_most) {
      quad u = c.u0 + x * (c.u1 - c.u0), v = c.v0 + y * (c.v1 - c.v0);
      bool const is_polished = polish<real>(patch, view, u, v) && polish<quad>(patch, view, u, v);
      oracle_root const root = describe(patch, view, index, u, v);
      real const du = overhang * (c.u1 - c.u0), dv = overhang * (c.v1 - c.v0);
      bool const in_cell = c.u0 - du <= root.u && root.u <= c.u1 + du && c.v0 - dv <= root.v && root.v <= c.v1 + dv;
      bool const in_patch = root.u >= -margin && root.u <= 1 + margin && root.v >= -margin && root.v <= 1 + margin;
      bool const known = std::any_of(out.roots.begin(), out.roots.end(), [&](oracle_root const& r) {
        return std::abs(r.u - root.u) <= 1e-15L && std::abs(r.v - root.v) <= 1e-15L;
      });
      if (in_patch && in_cell && is_polished && !known) out.roots.push_back(root);
      if (in_cell && is_polished) continue;
    }
    real along[2] = {0, 0};  // extents of the cell's image
    for (auto const& f : c.f) {
      for (int i = 0; i < 4; ++i) {
        real u_lo = f[0][i], u_hi = u_lo, v_lo = f[i][0], v_hi = v_lo;
        for (int j = 1; j < 4; ++j) {
          u_lo = std::min(u_lo, f[j][i]);
          u_hi = std::max(u_hi, f[j][i]);
          v_lo = std::min(v_lo, f[i][j]);
          v_hi = std::max(v_hi, f[i][j]);
        }
        along[0] = std::max(along[0], u_hi - u_lo);
        along[1] = std::max(along[1], v_hi - v_lo);
      }
    }
    if (std::max(along[0], along[1]) <= 16 * error) {
      out.clusters.push_back({c.u0, c.u1, c.v0, c.v1});
      continue;
    }
    bool const along_u = along[0] >= along[1];
    stack.push_back(part(c, along_u, 0.5L, 1));
    stack.push_back(part(c, along_u, 0, 0.5L));
  }
  return out;
}

/// Range of t over the part of the patch that a cluster is, by the hull of its control points.
void range_of_t(oracle_patch const& patch, projection const& view, cluster const& k, real& lo, real& hi) {
  cell c{{}, 0, 1, 0, 1};
  quad const dd = dot(view.direction, view.direction);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      std::size_t const n = std::size_t(3 * (4 * i + j));
      point3<quad> const p{quad(patch[n]) - view.origin.x, quad(patch[n + 1]) - view.origin.y,
                           quad(patch[n + 2]) - view.origin.z};
      c.f[0][i][j] = static_cast<real>(dot(view.direction, p) / dd);
    }
  }
  c = part(part(c, true, k.u0, std::max(k.u1, real(1e-30L))), false, k.v0, std::max(k.v1, real(1e-30L)));
  lo = hi = c.f[0][0][0];
  for (auto const& row : c.f[0]) {
    for (real const t : row) {
      lo = std::min(lo, t);
      hi = std::max(hi, t);
    }
  }
}

/// Joins what touches, drops what a regular root explains, and gives each rest one root in its middle.
void describe_clusters(oracle_patch const& patch, projection const& view, int index, found& f) {
  std::vector<cluster> joined;
  for (cluster c : f.clusters) {
    for (std::size_t i = 0; i < joined.size();) {
      if (!joined[i].touches(c)) {
        ++i;
        continue;
      }
      c = {std::min(c.u0, joined[i].u0), std::max(c.u1, joined[i].u1), std::min(c.v0, joined[i].v0),
           std::max(c.v1, joined[i].v1)};
      joined.erase(joined.begin() + std::ptrdiff_t(i));
      i = 0;
    }
    joined.push_back(c);
  }
  std::size_t const regular = f.roots.size();
  for (cluster const& c : joined) {
    bool const explained = f.complete && std::any_of(f.roots.begin(), f.roots.begin() + std::ptrdiff_t(regular),
                                                     [&c](oracle_root const& r) { return c.holds(r); });
    if (explained) continue;
    oracle_root root = describe(patch, view, index, (quad(c.u0) + quad(c.u1)) / 2, (quad(c.v0) + quad(c.v1)) / 2);
    real lo, hi;
    range_of_t(patch, view, c, lo, hi);
    root.t = (lo + hi) / 2;
    root.slack = (hi - lo) / 2;
    root.singular = true;
    f.roots.push_back(root);
  }
}

}  // namespace

oracle::oracle(std::span<oracle_patch const> patches) : patches_(patches.begin(), patches.end()) {
  for (oracle_patch const& p : patches_) {
    bounds b;
    for (std::size_t a = 0; a < 3; ++a) {
      b.lo[a] = b.hi[a] = p[a];
      for (std::size_t k = a; k < 48; k += 3) {
        b.lo[a] = std::min(b.lo[a], p[k]);
        b.hi[a] = std::max(b.hi[a], p[k]);
      }
    }
    // Room for the overhang, whose control points leave the hull by less than 2 (1 + 2/64)^3 - 2 = 0.2 of its sides.
    for (std::size_t a = 0; a < 3; ++a) {
      double const room = 0.2 * (b.hi[a] - b.lo[a]) + 1e-12 * std::max(std::abs(b.lo[a]), std::abs(b.hi[a]));
      b.lo[a] -= room;
      b.hi[a] += room;
    }
    bounds_.push_back(b);
  }
}

std::vector<oracle_root> oracle::all_hits(oracle_ray const& ray, double margin) const {
  std::vector<oracle_root> hits;
  auto const view = project_along(ray);
  if (!view) return hits;
  for (std::size_t k = 0; k < patches_.size(); ++k) {
    real near = -std::numeric_limits<real>::infinity(), far = -near;
    bool miss = false;
    for (std::size_t a = 0; a < 3; ++a) {
      real const o = ray[a], d = ray[3 + a], lo = bounds_[k].lo[a] - o, hi = bounds_[k].hi[a] - o;
      if (d == 0) {
        miss = miss || lo > 0 || hi < 0;
      } else {
        near = std::max(near, std::min(lo / d, hi / d));
        far = std::min(far, std::max(lo / d, hi / d));
      }
    }
    real const reach = 1e-6L * (std::abs(near) + std::abs(far));
    if (miss || near > far + reach || far + reach < ray[6] || near - reach > ray[7]) continue;
    found f = search(patches_[k], *view, static_cast<int>(k), margin);
    describe_clusters(patches_[k], *view, static_cast<int>(k), f);
    for (oracle_root& r : f.roots) {
      real const end = std::min(r.t + r.slack - ray[6], ray[7] - (r.t - r.slack));
      r.end_distance = static_cast<double>(end);
      if (end >= -margin * std::abs(r.t)) hits.push_back(r);
    }
  }
  std::sort(hits.begin(), hits.end(), [](oracle_root const& a, oracle_root const& b) { return a.t < b.t; });
  return hits;
}

long double oracle::distance(int patch, oracle_ray const& ray, long double t, long double u, long double v) const {
  point3<quad> const q = evaluate<quad>(patches_[std::size_t(patch)], u, v).q;
  return length({q.x - (quad(ray[0]) + quad(t) * quad(ray[3])), q.y - (quad(ray[1]) + quad(t) * quad(ray[4])),
                 q.z - (quad(ray[2]) + quad(t) * quad(ray[5]))});
}

std::vector<oracle_root> oracle_all_hits(std::span<oracle_patch const> patches, oracle_ray const& ray) {
  return oracle(patches).all_hits(ray);
}

}  // namespace patchrt::test
