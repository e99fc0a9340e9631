// SPDX-License-Identifier: MIT
// Bytes become patches and rays of the kinds that ray tracers fail on; all levels trace them, and the oracle judges.
#include "fuzz_search.hpp"

#include <cstdint>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Choices read from bytes; zeros where there are no more.
class choices {
 public:
  choices(std::uint8_t const* data, std::size_t size) : data_(data), size_(size) {}
  int below(int n) {
    if (at_ >= size_) return 0;
    return int(data_[at_++]) % n;
  }
  int between(int low, int high) { return low + below(high - low + 1); }
  double two_to(int low, int high) { return std::ldexp(1, between(low, high)); }
  bool is_empty() const { return at_ >= size_; }

 private:
  std::uint8_t const* data_;
  std::size_t size_;
  std::size_t at_ = 0;
};

vec3<double> small_vector(choices& c, int most) {
  double const x = c.between(-most, most), y = c.between(-most, most), z = c.between(-most, most);
  return {x, y, z};
}

/// One coordinate along one parameter: monotone, folded, with vanishing ends or middle, or nothing.
std::array<double, 4> profile(choices& c) {
  constexpr std::array<std::array<double, 4>, 9> shapes = {{{0, 1, 2, 3},
                                                            {0, 0, 0, 3},
                                                            {0, 0, 1, 3},
                                                            {0, 3, 0, 3},
                                                            {0, 3, 3, 0},
                                                            {0, 0, 3, 3},
                                                            {0, 9, -6, 3},
                                                            {1, 1, 1, 1},
                                                            {-1, 1, -1, 1}}};
  return shapes[std::size_t(c.below(int(shapes.size())))];
}

void fill(bicubic_patch<double>& p, choices& c) {
  int const kind = c.below(6);
  vec3<double> const a = small_vector(c, 3), b = small_vector(c, 3), o = small_vector(c, 3);
  std::array<double, 4> const in_u[3] = {profile(c), profile(c), profile(c)},
                              in_v[3] = {profile(c), profile(c), profile(c)};
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      auto const k = std::size_t(i), l = std::size_t(j);
      vec3<double>& q = p(i, j);
      switch (kind) {
        case 0:  // anywhere on a grid
          q = small_vector(c, 3);
          break;
        case 1:  // a bumpy sheet
          q = vec3<double>(i, j, c.between(-2, 2));
          break;
        case 2:  // profiles along u and v
          q = vec3<double>(in_u[0][k] + in_v[0][l], in_u[1][k] - in_v[1][l], in_u[2][k] * in_v[2][l]);
          break;
        case 3:  // a plane, with any parameters
          q = o + a * (in_u[0][k] + 0.25 * c.below(5)) + b * (in_v[0][l] + 0.25 * c.below(5));
          break;
        case 4:  // rows of points on lines
          q = o + a * double(i) + b * (in_v[0][l] * (1 + in_u[0][k]));
          break;
        default:  // a sheet off its grid by 1/256
          q = vec3<double>(i + c.between(-128, 127) / 256., j + c.between(-128, 127) / 256.,
                           c.between(-128, 127) / 64.);
      }
    }
  }
}

/// Points made equal, or nearly, and lines of them straight.
void spoil(bicubic_patch<double>& p, choices& c) {
  int const i = c.below(4), j = c.below(4);
  switch (c.below(8)) {
    case 0:  // an edge is one point
      for (int k = 0; k < 4; ++k) p(k, j < 2 ? 0 : 3) = p(0, j < 2 ? 0 : 3);
      break;
    case 1:
      for (int k = 0; k < 4; ++k) p(i < 2 ? 0 : 3, k) = p(i < 2 ? 0 : 3, 0);
      break;
    case 2:  // a corner's neighbours are the corner
      p(0, 1) = p(1, 0) = p(1, 1) = p(0, 0);
      break;
    case 3:  // a row again
      for (int k = 0; k < 4; ++k) p(1, k) = p(0, k);
      break;
    case 4:  // an edge straight
      for (int k = 1; k < 3; ++k) p(0, k) = p(0, 0) + (p(0, 3) - p(0, 0)) * (k / 4.);
      break;
    case 5:
      p(i, j) += small_vector(c, 1) * c.two_to(-50, -10);
      break;
    case 6:
      p(i, j) = p(3 - i, 3 - j);
      break;
    default:
      break;
  }
}

ray<double> aimed_ray(patch_list const& patches, choices& c) {
  auto const& p = patches[std::size_t(c.below(int(patches.size())))];
  auto const parameter = [&] {
    constexpr std::array<double, 6> special = {0, 1, 0.5, 0.25, 0.75, 0x1p-20};
    int const k = c.below(10);
    return k < 6 ? special[std::size_t(k)] : c.below(256) / 255.;
  };
  double const u = parameter(), v = parameter();
  auto const s = evaluate(p, u, v);
  vec3<double> const normal = cross(s.du, s.dv);
  vec3<double> way = small_vector(c, 3);
  switch (c.below(8)) {
    case 0:
      way = vec3<double>(0.0);
      way[glm::length_t(c.below(3))] = c.below(2) ? 1 : -1;
      break;
    case 1:
      way = s.du * double(c.between(-2, 2)) + s.dv * double(c.between(-2, 2));
      break;
    case 2:
      way = s.du * double(c.between(-2, 2)) + s.dv * double(c.between(-2, 2)) + normal * c.two_to(-40, 0);
      break;
    case 3:
      way = normal;
      break;
    case 4:
      way = evaluate(p, parameter(), parameter()).position - s.position;
      break;
    default:
      break;
  }
  if (!(dot(way, way) > 0)) way = {0, 1, 2};
  constexpr std::array<double, 6> starts = {1, 2, 0.5, 0, 64, 0x1p20};
  double const start = starts[std::size_t(c.below(6))];
  vec3<double> from = s.position - way * start;
  if (c.below(4) == 0) from += normal * c.two_to(-50, -10);
  int const range = c.below(6);
  return {from, way, range == 0 ? -no_limit : range == 1 ? start : 0, range == 2 ? start : no_limit};
}

search_input decode(std::uint8_t const* data, std::size_t size) {
  choices c(data, size);
  search_input in;
  in.patches.resize(std::size_t(1 + c.below(5) / 3));
  for (auto& p : in.patches) {
    fill(p, c);
    for (int k = c.below(4); k > 1; --k) spoil(p, c);
  }
  if (in.patches.size() == 2 && c.below(3) == 0) {  // nearly the same sheet twice
    in.patches[1] = in.patches[0];
    for (auto& q : in.patches[1].control_points) q.z += c.two_to(-50, -10);
  }
  constexpr std::array<double, 6> sizes = {1, 1, 1, 0x1p20, 0x1p-20, 1e-3}, far = {0, 0, 0, 1e3, 1e6, 0x1p30};
  vec3<double> squash(1.0);
  if (c.below(4) == 0) squash[glm::length_t(c.below(3))] = c.two_to(-30, -1);
  double const scale = sizes[std::size_t(c.below(6))];
  vec3<double> const offset = small_vector(c, 2) * (far[std::size_t(c.below(6))] * scale);
  for (auto& p : in.patches)
    for (auto& q : p.control_points) q = q * squash * scale + offset;
  for (int k = 0; k < 12; ++k) in.rays.push_back(aimed_ray(in.patches, c));
  return in;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  search_input const in = decode(data, size);
  search_violation const v = find_violation(in);
  if (v.property.empty()) return 0;
  std::fprintf(stderr, "fuzz_search: violated: %s\n%s", v.property.c_str(), as_row(in, v).c_str());
  std::abort();
}
