// SPDX-License-Identifier: MIT
#include <device/kernels/isolate.hpp>
#include <device/support/builds.hpp>
#include <device/support/inputs.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

using namespace patchrt;
using namespace patchrt::test;

namespace {

/// Coefficients c[k][l] of u^k v^l.
template <class T> struct power_form {
  T c[4][4] = {};

  void to_bernstein(T* b) const {
    static constexpr T share[4][4] = {{1, 0, 0, 0}, {1, T(1) / 3, 0, 0}, {1, T(2) / 3, T(1) / 3, 0}, {1, 1, 1, 1}};
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        T sum(0);
        for (int k = 0; k <= i; ++k) {
          for (int l = 0; l <= j; ++l) sum += share[i][k] * share[j][l] * c[k][l];
        }
        b[4 * i + j] = sum;
      }
    }
  }
};

/// (x - a)(x - b)(x - c) by powers of x.
template <class T> std::array<T, 4> cubic(T a, T b, T c) { return {-a * b * c, a * b + b * c + c * a, -a - b - c, 1}; }

enum pair_kind { any, nasty, crossing, contact, near_contact, curve, vanishing, kinds };

template <class T> bernstein_pair<T> pair_of_kind(int kind, number_source& source) {
  bernstein_pair<T> p;
  p.error_f = p.error_g = 16 * std::numeric_limits<T>::epsilon();
  if (kind == any || kind == nasty) {
    int const rarity = kind == nasty ? 64 : 1 << 30;
    for (T& x : p.f) x = source.nasty<T>(rarity);
    for (T& x : p.g) x = source.nasty<T>(rarity);
    if (kind == nasty) p.error_f = source.nasty<T>(8);
    return p;
  }
  power_form<T> f, g;
  T const a = source.below(2) ? source.uniform(T(0), T(1)) : T(source.below(9)) / 8;
  T const b = source.below(2) ? source.uniform(T(0), T(1)) : T(source.below(9)) / 8;
  if (kind == crossing) {  // up to nine roots, some on borders and in corners
    auto const by_u = cubic(a, source.uniform(T(-0.5), T(1.5)), T(0));
    auto const by_v = cubic(b, source.uniform(T(-0.5), T(1.5)), T(1));
    for (std::size_t k = 0; k < 4; ++k) {
      f.c[k][0] = by_u[k];
      g.c[0][k] = by_v[k];
    }
  } else if (kind == contact || kind == near_contact) {  // a parabola that touches a line at (a, b), or comes near it
    f.c[0][0] = -b;
    g.c[0][0] = a * a - b;
    if (kind == near_contact) g.c[0][0] += std::ldexp(T(source.below(2) ? 1 : -1), -source.below(60));
    g.c[1][0] = -2 * a;
    f.c[0][1] = g.c[2][0] = g.c[0][1] = 1;
  } else if (kind == curve) {  // roots all along a line
    f.c[0][0] = a - b;
    f.c[1][0] = 1;
    f.c[0][1] = -1;
    if (source.below(2)) g = f;
  }
  f.to_bernstein(p.f);
  g.to_bernstein(p.g);
  if (kind == vanishing) {
    for (T& x : p.f) x = source.uniform(-p.error_f, p.error_f);
  } else if (source.below(2)) {  // the same roots, of curves that are not along the axes
    T const by = source.uniform(T(0.5), T(2));
    for (int k = 0; k < 16; ++k) {
      T const x = p.f[k];
      p.f[k] = x + by * p.g[k];
      p.g[k] = x - by * p.g[k];
    }
  }
  return p;
}

}  // namespace

TEMPLATE_TEST_CASE("roots are isolated in the same steps to the same boxes from every compiler and from PTX", "", float,
                   double) {
  using T = TestType;
  using kernel = isolate_kernel<T>;
  auto const seed = GENERATE(1u, 2u);
  CAPTURE(seed);
  number_source source(seed);
  int const count = 40 * kinds;
  std::vector<bernstein_pair<T>> pairs;
  std::vector<isolate_options<T>> options(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    pairs.push_back(pair_of_kind<T>(i % kinds, source));
    auto& o = options[static_cast<std::size_t>(i)];
    if (source.below(4) == 0) {
      T const low_u = source.uniform(T(0), T(0.5)), low_v = source.uniform(T(0), T(0.5));
      o.domain = {low_u, low_u + T(0.5), low_v, low_v + T(0.5)};
    }
    if (source.below(8) == 0) o.most_examined = source.below(64);
  }
  auto const results = check_same_in_every_build<T>("isolate", "isolate" + suffix<T>(), count,
                                                    {readable(pairs), readable(options)}, [&](T* out) {
                                                      return kernel{pairs.data(), options.data(), out};
                                                    });

  int of_kind[3] = {}, nothing = 0, incomplete = 0, on_border = 0;
  for (std::size_t i = 0; i < results.size(); i += kernel::outputs) {
    int const roots = static_cast<int>(results[i]);
    nothing += roots == 0;
    incomplete += results[i + 1] == 0;
    for (int k = 0; k < roots; ++k) {
      T const* const root = &results[i + 3 + static_cast<std::size_t>(k) * kernel::per_root];
      ++of_kind[static_cast<int>(root[6])];
      on_border += root[7] == 1;
    }
  }
  CAPTURE(of_kind[0], of_kind[1], of_kind[2], nothing, incomplete, on_border);
  CHECK(of_kind[0] > count / 2);
  CHECK(of_kind[1] > count / 10);
  CHECK(of_kind[2] > count / 4);
  CHECK(nothing > count / 20);
  CHECK(incomplete > count / 20);
  CHECK(on_border > count / 4);
}
