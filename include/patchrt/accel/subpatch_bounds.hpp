// SPDX-License-Identifier: MIT
// host only
#pragma once

/// \file
/// Sub-patches of one patch, eight at a time, one a lane: their control nets, and the bounds that a sub-patch tree
/// stores.
///
/// The innermost loops run over lanes, without branches, calls or sums over lanes: g++ and clang++ make vector
/// instructions of them whatever the machine, and as nothing is reordered all of them give the same bits.

#include <patchrt/shapes/bezier_patch.hpp>

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>

namespace patchrt::detail {

inline constexpr int net_lanes = 8;
using lane_row = float[net_lanes];

/// f(lane) for every lane, in a loop that g++ leaves whole until it looks for vector instructions.
template <class F> PATCHRT_INLINE void for_each_lane(F&& f) {
#if defined(__GNUC__) && !defined(__CUDACC__)
#  pragma GCC unroll 1
#endif
  for (int k = 0; k < net_lanes; ++k) f(k);
}

/// Control nets, one a lane, with the vectors between neighbours. Halving leaves those as long as they are: only their
/// directions are of use, and this way their errors stay small beside them.
struct lane_nets {
  alignas(32) lane_row point[16][3];    // (i, j) at 4 i + j
  alignas(32) lane_row along_u[12][3];  // from (i, j) to (i + 1, j), at 4 i + j
  alignas(32) lane_row along_v[12][3];  // from (i, j) to (i, j + 1), at 4 j + i
};

/// The bounds of one sub-patch a lane.
struct lane_bounds {
  alignas(32) lane_row lo[3], hi[3];
  alignas(32) lane_row remainder[3];
  alignas(32) lane_row axis[3];  // whole numbers
  alignas(32) lane_row sine;     // times |axis| / 127 where that is more than 1; 2 where there is no cone
};

/// De Casteljau's scheme at one half for cubics, given by four rows, `Stride` apart, of each of `lines` lists.
template <int Stride> void halve_cubics(lane_row (*first)[3], lane_row (*second)[3], int lines) {
  for (int j = 0; j < lines; ++j)
    for (int c = 0; c < 3; ++c) {
      lane_row(*const p)[3] = first + j * (5 - Stride);
      lane_row(*const q)[3] = second + j * (5 - Stride);
      for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
        float const p1 = p[Stride][c][k], p2 = p[2 * Stride][c][k], p3 = p[3 * Stride][c][k];
        float const a = 0.5f * (p[0][c][k] + p1), b = 0.5f * (p1 + p2), d = 0.5f * (p2 + p3);
        float const e = 0.5f * (a + b), f = 0.5f * (b + d), middle = 0.5f * (e + f);
        p[Stride][c][k] = a;
        p[2 * Stride][c][k] = e;
        p[3 * Stride][c][k] = middle;
        q[0][c][k] = middle;
        q[Stride][c][k] = f;
        q[2 * Stride][c][k] = d;
        q[3 * Stride][c][k] = p3;
      });
    }
}

/// The same for quadratics, four lists of three rows with stride 4.
inline void halve_quadratics(lane_row (*first)[3], lane_row (*second)[3]) {
  for (int j = 0; j < 4; ++j)
    for (int c = 0; c < 3; ++c) {
      lane_row(*const p)[3] = first + j;
      lane_row(*const q)[3] = second + j;
      for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
        float const p1 = p[4][c][k], p2 = p[8][c][k];
        float const a = 0.5f * (p[0][c][k] + p1), b = 0.5f * (p1 + p2), middle = 0.5f * (a + b);
        p[4][c][k] = a;
        p[8][c][k] = middle;
        q[0][c][k] = middle;
        q[4][c][k] = b;
        q[8][c][k] = p2;
      });
    }
}

/// Halves all nets along u or v; the first halves stay.
inline void halve(lane_nets& nets, bool along_v, lane_nets& second) {
  if (along_v) {
    halve_cubics<1>(nets.point, second.point, 4);
    halve_cubics<1>(nets.along_u, second.along_u, 3);
    halve_quadratics(nets.along_v, second.along_v);
  } else {
    halve_cubics<4>(nets.point, second.point, 4);
    halve_quadratics(nets.along_u, second.along_u);
    halve_cubics<1>(nets.along_v, second.along_v, 3);
  }
}

/// Puts the net of `second` in the lanes whose numbers have bit `bit` set.
inline void choose_half(lane_nets& nets, lane_nets const& second, int bit) {
  auto const choose = [bit](auto& rows, auto const& others) {
    for (std::size_t q = 0; q < std::size(rows); ++q)
      for (int c = 0; c < 3; ++c)
        for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
          rows[q][c][k] = (k >> bit & 1) != 0 ? others[q][c][k] : rows[q][c][k];
        });
  };
  choose(nets.point, second.point);
  choose(nets.along_u, second.along_u);
  choose(nets.along_v, second.along_v);
}

/// The boxes of the control points.
inline void bound_hulls(lane_nets const& nets, lane_bounds& b) {
  alignas(32) lane_row lo, hi;
  for (int c = 0; c < 3; ++c) {
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA { lo[k] = hi[k] = nets.point[0][c][k]; });
    for (int i = 0; i < 4; ++i) {
      lane_row const(*const p)[3] = nets.point + 4 * i;
      for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
        lo[k] = min(lo[k], min(min(p[0][c][k], p[1][c][k]), min(p[2][c][k], p[3][c][k])));
        hi[k] = max(hi[k], max(max(p[0][c][k], p[1][c][k]), max(p[2][c][k], p[3][c][k])));
      });
    }
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
      b.lo[c][k] = lo[k];
      b.hi[c][k] = hi[k];
    });
  }
}

/// How far sub-patches leave their tangent planes at the middle, by coordinate: by the hull property at most as far as
/// their control nets are from those of the planes, and `error`.
inline void bound_remainders(lane_nets const& nets, float error, lane_bounds& b) {
  alignas(32) lane_row value[4], slope[4];  // of each column's cubic in the middle
  alignas(32) lane_row middle, by_row, by_column, farthest;
  for (int c = 0; c < 3; ++c) {
    for (int j = 0; j < 4; ++j) {
      lane_row const(*const p)[3] = nets.point + j;
      for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
        value[j][k] = 0.125f * (p[0][c][k] + p[12][c][k]) + 0.375f * (p[4][c][k] + p[8][c][k]);
        slope[j][k] = 0.75f * ((p[12][c][k] - p[0][c][k]) + (p[8][c][k] - p[4][c][k]));
      });
    }
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
      middle[k] = 0.125f * (value[0][k] + value[3][k]) + 0.375f * (value[1][k] + value[2][k]);
      by_row[k] = 0.125f * (slope[0][k] + slope[3][k]) + 0.375f * (slope[1][k] + slope[2][k]);
      by_column[k] = 0.75f * ((value[3][k] - value[0][k]) + (value[2][k] - value[1][k]));
      farthest[k] = 0;
    });
    for (int i = 0; i < 4; ++i) {
      lane_row const(*const p)[3] = nets.point + 4 * i;
      for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
        float const row = middle[k] + (float(i) / 3.0f - 0.5f) * by_row[k];
        float const outer = 0.5f * by_column[k], inner = (1.0f / 6.0f) * by_column[k];
        float const r0 = std::fabs(p[0][c][k] - (row - outer)), r1 = std::fabs(p[1][c][k] - (row - inner));
        float const r2 = std::fabs(p[2][c][k] - (row + inner)), r3 = std::fabs(p[3][c][k] - (row + outer));
        farthest[k] = max(farthest[k], max(max(r0, r1), max(r2, r3)));
      });
    }
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA { b.remainder[c][k] = farthest[k] + error; });
  }
}

/// 1 / sqrt(x) within 2^-21 for x in [2^-126, 2^126], finite for 0: of std::sqrt compilers make no vector instruction, because
/// it may set errno.
inline float inverse_root(float x) {
  float y = std::bit_cast<float>(0x5f3759dfu - (std::bit_cast<std::uint32_t>(x) >> 1));
  float const half = 0.5f * x;
  y = y * (1.5f - half * y * y);
  y = y * (1.5f - half * y * y);
  return y * (1.5f - half * y * y);
}

/// The nearest whole number, for |x| < 2^22.
inline float round_small(float x) { return (x + 0x1.8p23f) - 0x1.8p23f; }

/// Bounds on control vectors: on the ratios of two of their components to a third.
struct lane_slopes {
  alignas(32) lane_row least;             // of the third component
  alignas(32) lane_row across[2], up[2];  // of the ratios, least and largest, and 0
};

/// Bounds control vectors' components along `across` and `up` over that along `forward`.
///
/// `error` is at least five times what a component can be off by, which covers ratios up to 3 where `least` > `error`.
/// A vector that is zero says nothing, and counts as a long one along `forward`.
inline lane_slopes bound_slopes(lane_row const (&vectors)[12][3], float error, lane_row const (&forward)[3],
                                lane_row const (&across)[3], lane_row const (&up)[3]) {
  constexpr float inf = std::numeric_limits<float>::infinity();
  lane_slopes b;
  for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
    b.least[k] = inf;
    b.across[0][k] = b.across[1][k] = b.up[0][k] = b.up[1][k] = 0;
  });
  for (auto const& vector : vectors)
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
      float const x = vector[0][k], y = vector[1][k], z = vector[2][k];
      float const length = std::fabs(x) + std::fabs(y) + std::fabs(z);
      float const a = x * forward[0][k] + y * forward[1][k] + z * forward[2][k] + (length > 0 ? 0.0f : inf);
      float const inverse = 1.0f / a, spread = error * inverse;
      float const s = (x * across[0][k] + y * across[1][k] + z * across[2][k]) * inverse;
      float const h = (x * up[0][k] + y * up[1][k] + z * up[2][k]) * inverse;
      b.least[k] = min(b.least[k], a);
      b.across[0][k] = min(b.across[0][k], s - spread);
      b.across[1][k] = max(b.across[1][k], s + spread);
      b.up[0][k] = min(b.up[0][k], h - spread);
      b.up[1][k] = max(b.up[1][k], h + spread);
    });
  return b;
}

/// Cones that hold all products S_u x S_v' of tangents, at one point or at two.
///
/// With n = axis / |axis|, near the product of the mean tangents, and e and f what these have across n, every control
/// vector along u is a multiple of e + s f + h n, every one along v of t e + f + g n; s, for one, is its ratio of
/// components along n x e and f x n. Tangents are sums of control vectors, so that the ranges of s, h, t and g hold for
/// them too, and S_u x S_v' is a multiple of
///
///     (s g - h) f x n + (t h - g) n x e + (1 - s t) e x f.
///
/// The axis is the one that is stored, so that rounding it to whole numbers makes the cone no wider than it has to be.
inline void bound_normals(lane_nets const& nets, float error_u, float error_v, lane_bounds& b) {
  alignas(32) lane_row mean_u[3], mean_v[3];  // times some number
  for (int c = 0; c < 3; ++c) {
    lane_row const(*const u)[3] = nets.along_u, (*const v)[3] = nets.along_v;
    for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
      mean_u[c][k] = ((u[0][c][k] + u[1][c][k]) + (u[2][c][k] + u[3][c][k])) +
                     ((u[4][c][k] + u[5][c][k]) + (u[6][c][k] + u[7][c][k])) +
                     ((u[8][c][k] + u[9][c][k]) + (u[10][c][k] + u[11][c][k]));
      mean_v[c][k] = ((v[0][c][k] + v[1][c][k]) + (v[2][c][k] + v[3][c][k])) +
                     ((v[4][c][k] + v[5][c][k]) + (v[6][c][k] + v[7][c][k])) +
                     ((v[8][c][k] + v[9][c][k]) + (v[10][c][k] + v[11][c][k]));
    });
  }
  alignas(32) lane_row beside_v[3], beside_u[3], normal[3];  // f x n, n x e, and n times `area`
  alignas(32) lane_row squared_u, squared_v, between, area;  // e.e, f.f, e.f, (e x f).n
  alignas(32) lane_row to_stored;                            // from a sine to what is stored of it
  for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
    float ux = mean_u[0][k], uy = mean_u[1][k], uz = mean_u[2][k];
    float vx = mean_v[0][k], vy = mean_v[1][k], vz = mean_v[2][k];
    float const uu = ux * ux + uy * uy + uz * uz, vv = vx * vx + vy * vy + vz * vz;
    float const to_unit_u = inverse_root(uu), to_unit_v = inverse_root(vv);
    ux *= to_unit_u, uy *= to_unit_u, uz *= to_unit_u;
    vx *= to_unit_v, vy *= to_unit_v, vz *= to_unit_v;
    float nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    float const nn = nx * nx + ny * ny + nz * nz;
    // Tangents that are parallel, or vanish, leave the axis 0.
    float const to_axis = min(uu, vv) > 1e-30f && nn > 1e-10f ? 127.0f * inverse_root(nn) : 0.0f;
    nx = round_small(to_axis * nx), ny = round_small(to_axis * ny), nz = round_small(to_axis * nz);
    b.axis[0][k] = nx;
    b.axis[1][k] = ny;
    b.axis[2][k] = nz;
    float const aa = nx * nx + ny * ny + nz * nz, to_unit = inverse_root(aa), length = aa * to_unit;
    to_stored[k] = max(1.0f, length * (1.0f / 127.0f));
    nx *= to_unit, ny *= to_unit, nz *= to_unit;
    float const un = ux * nx + uy * ny + uz * nz, vn = vx * nx + vy * ny + vz * nz;
    float const ex = ux - un * nx, ey = uy - un * ny, ez = uz - un * nz;
    float const fx = vx - vn * nx, fy = vy - vn * ny, fz = vz - vn * nz;
    float const gx = fy * nz - fz * ny, gy = fz * nx - fx * nz, gz = fx * ny - fy * nx;
    beside_v[0][k] = gx;
    beside_v[1][k] = gy;
    beside_v[2][k] = gz;
    beside_u[0][k] = ny * ez - nz * ey;
    beside_u[1][k] = nz * ex - nx * ez;
    beside_u[2][k] = nx * ey - ny * ex;
    squared_u[k] = ex * ex + ey * ey + ez * ez;
    squared_v[k] = fx * fx + fy * fy + fz * fz;
    between[k] = ex * fx + ey * fy + ez * fz;
    area[k] = ex * gx + ey * gy + ez * gz;
    normal[0][k] = area[k] * nx;
    normal[1][k] = area[k] * ny;
    normal[2][k] = area[k] * nz;
  });
  lane_slopes const u = bound_slopes(nets.along_u, error_u, beside_v, beside_u, normal);
  lane_slopes const v = bound_slopes(nets.along_v, error_v, beside_u, beside_v, normal);
  for_each_lane([&](int k) PATCHRT_INLINE_LAMBDA {
    float const s0 = u.across[0][k], s1 = u.across[1][k], h0 = u.up[0][k], h1 = u.up[1][k];
    float const t0 = v.across[0][k], t1 = v.across[1][k], g0 = v.up[0][k], g1 = v.up[1][k];
    // each range holds 0, so that a product is largest at equal ends and least at opposite ones
    float const p0 = min(s0 * g1, s1 * g0) - h1, p1 = max(s0 * g0, s1 * g1) - h0;
    float const q0 = min(t0 * h1, t1 * h0) - g1, q1 = max(t0 * h0, t1 * h1) - g0;
    float const ee = squared_u[k], ff = squared_v[k], ef = 2 * between[k];
    // |p f x n + q n x e|^2 is largest in a corner, being convex
    float const beside = max(max(p0 * (ff * p0 - ef * q0) + ee * q0 * q0, p0 * (ff * p0 - ef * q1) + ee * q1 * q1),
                             max(p1 * (ff * p1 - ef * q0) + ee * q0 * q0, p1 * (ff * p1 - ef * q1) + ee * q1 * q1));
    float const upright = area[k] * (1.0f - max(s0 * t0, s1 * t1)), all = beside + upright * upright;
    float const sine = beside * inverse_root(beside * all) * to_stored[k];
    float const steepest = max(max(max(-s0, s1), max(-h0, h1)), max(max(-t0, t1), max(-g0, g1)));
    float const if_upright = upright > 0 ? sine : 2.0f;
    float const if_covered = steepest <= 3 ? if_upright : 2.0f;
    b.sine[k] = min(u.least[k] - error_u, v.least[k] - error_v) > 0 ? if_covered : 2.0f;
  });
}

}  // namespace patchrt::detail
