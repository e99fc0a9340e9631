// SPDX-License-Identifier: MIT
#include "support/catch.hpp"

#include <patchrt/core/vec.hpp>
#include <patchrt/numbers/pack.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

using namespace patchrt;

namespace {

template <class L> using bits_t = std::conditional_t<sizeof(L) == 4, std::uint32_t, std::uint64_t>;

/// The same bits, or a NaN both.
template <class L> bool is_same(L a, L b) {
  return std::bit_cast<bits_t<L>>(a) == std::bit_cast<bits_t<L>>(b) || (a != a && b != b);
}

template <class L> std::vector<L> special_numbers() {
  using limits = std::numeric_limits<L>;
  std::vector<L> all;
  for (L const x : {L(0), limits::denorm_min(), limits::min() / 2, limits::min(), limits::epsilon(), L(0.5),
                    1 - limits::epsilon() / 2, L(1), 1 + limits::epsilon(), L(3), limits::max(), limits::infinity()}) {
    all.push_back(x);
    all.push_back(-x);
  }
  all.push_back(limits::quiet_NaN());
  return all;
}

/// Triples of operands: every one of the special numbers, then random bits, then random numbers near 1.
template <class L> struct operands {
  std::vector<L> a, b, c;
  void push(L x, L y, L z) {
    a.push_back(x);
    b.push_back(y);
    c.push_back(z);
  }
};

template <class L> operands<L> make_operands() {
  operands<L> o;
  auto const special = special_numbers<L>();
  for (L const x : special) {
    for (L const y : special) {
      for (L const z : special) o.push(x, y, z);
    }
  }
  std::mt19937_64 g(20261122);
  std::uniform_real_distribution<double> near(-2, 2);
  auto const any = [&g] {
    L const x = std::bit_cast<L>(static_cast<bits_t<L>>(g()));
    return x != x ? L(1) : x;  // signalling NaNs are nobody's operands
  };
  for (int n = 0; n < 4000; ++n) o.push(any(), any(), any());
  for (int n = 0; n < 4000; ++n) o.push(L(near(g)), L(near(g)), L(near(g)));
  while (o.a.size() % 32) o.push(L(1), L(2), L(3));
  return o;
}

/// Whether each lane of wide(a, b, c) is narrow(a, b, c) of its operands, over all of them.
template <class T, class Wide, class Narrow> bool lanes_agree(Wide const& wide, Narrow const& narrow) {
  using L = lane_t<T>;
  static operands<L> const o = make_operands<L>();
  constexpr std::size_t lanes = std::size_t(lanes_v<T>);
  for (std::size_t n = 0; n < o.a.size(); n += lanes) {
    auto const w = wide(T::load(&o.a[n]), T::load(&o.b[n]), T::load(&o.c[n]));
    for (std::size_t k = 0; k < lanes; ++k) {
      auto const x = narrow(o.a[n + k], o.b[n + k], o.c[n + k]);
      bool same = false;
      if constexpr (std::is_same_v<decltype(w), mask_t<T> const>) same = w[int(k)] == x;
      else same = is_same(w[int(k)], x);
      if (!same) {
        UNSCOPED_INFO("operands " << o.a[n + k] << ", " << o.b[n + k] << ", " << o.c[n + k]);
        return false;
      }
    }
  }
  return true;
}

}  // namespace

#define PATCHRT_TEST_PACKS                                                                                        \
  (pack<float, 4>), (pack<float, 8>), (pack<float, 16>), (pack<float, 32>), (pack<double, 4>), (pack<double, 8>), \
      (pack<double, 16>)

/// The same expression over packs and over lanes.
#define PATCHRT_LANES_AGREE(expression)                                                                     \
  CHECK(lanes_agree<TestType>(                                                                              \
      []([[maybe_unused]] auto a, [[maybe_unused]] auto b, [[maybe_unused]] auto c) { return expression; }, \
      []([[maybe_unused]] auto a, [[maybe_unused]] auto b, [[maybe_unused]] auto c) { return expression; }))

TEMPLATE_TEST_CASE("every operation gives each lane the bits of the scalar operation", "", PATCHRT_TEST_PACKS) {
  static_assert(scalar<TestType>);
  PATCHRT_LANES_AGREE(power_of_two_below(abs(a)));
  PATCHRT_LANES_AGREE(a + b);
  PATCHRT_LANES_AGREE(a - b);
  PATCHRT_LANES_AGREE(a * b);
  PATCHRT_LANES_AGREE(a / b);
  PATCHRT_LANES_AGREE(-a);
  PATCHRT_LANES_AGREE(sqrt(a));
  PATCHRT_LANES_AGREE(abs(a));
  PATCHRT_LANES_AGREE(copysign(a, b));
  PATCHRT_LANES_AGREE(fma(a, b, c));
  PATCHRT_LANES_AGREE(min(a, b));
  PATCHRT_LANES_AGREE(max(a, b));
  PATCHRT_LANES_AGREE((a += b, a));
  PATCHRT_LANES_AGREE((a -= b, a));
  PATCHRT_LANES_AGREE((a *= b, a));
  PATCHRT_LANES_AGREE((a /= b, a));
  PATCHRT_LANES_AGREE(difference_of_products(a, b, c, a));
  PATCHRT_LANES_AGREE(lerp(a, b, c));
}

TEMPLATE_TEST_CASE("comparisons and selections decide each lane as the scalar ones do", "", PATCHRT_TEST_PACKS) {
  PATCHRT_LANES_AGREE(a < b);
  PATCHRT_LANES_AGREE(a > b);
  PATCHRT_LANES_AGREE(a <= b);
  PATCHRT_LANES_AGREE(a >= b);
  PATCHRT_LANES_AGREE(a == b);
  PATCHRT_LANES_AGREE(!(a < b));
  PATCHRT_LANES_AGREE((a < b && b < c));
  PATCHRT_LANES_AGREE((a < b || b < c));
  PATCHRT_LANES_AGREE(select(a < b, b, c));
}

TEMPLATE_TEST_CASE("min, max, abs and copysign keep the operand's bits, NaN included", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  L const nan = std::numeric_limits<L>::quiet_NaN();
  CHECK(min(T(nan), T(L(1)))[0] == 1);
  CHECK(max(T(nan), T(L(1)))[0] == 1);
  CHECK(min(T(L(1)), T(nan))[0] != min(T(L(1)), T(nan))[0]);
  CHECK(std::signbit(min(T(L(0)), T(L(-0.0)))[0]));
  CHECK_FALSE(std::signbit(max(T(L(-0.0)), T(L(0)))[0]));
  CHECK(std::signbit((-T(L(0)))[0]));
  CHECK_FALSE(std::signbit(abs(T(-nan))[0]));
  CHECK(std::signbit(copysign(T(nan), T(L(-0.0)))[0]));
}

TEMPLATE_TEST_CASE("fma rounds once in every lane", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  L const e = std::numeric_limits<L>::epsilon();
  // (1 + e)(1 - e) - 1 = -e^2, which two roundings make 0.
  CHECK(all_of(fma(T(1 + e), T(1 - e), T(L(-1))) == T(-e * e)));
}

TEMPLATE_TEST_CASE("loading and storing keep every lane in its place", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  L in[lanes + 1], out[lanes + 1] = {};
  for (int k = 0; k <= lanes; ++k) in[k] = L(k);
  T const a = T::load(in + 1);  // at no multiple of the register's size
  a.store(out + 1);
  CHECK(out[0] == 0);
  for (int k = 0; k < lanes; ++k) {
    CHECK(a[k] == L(k + 1));
    CHECK(out[k + 1] == L(k + 1));
    CHECK(T(L(7))[k] == 7);
  }
}

TEMPLATE_TEST_CASE("permute gives each lane the lane it is told", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  unsigned const seed = 11;
  CAPTURE(seed);
  std::mt19937 g(seed);
  L in[lanes];
  for (int k = 0; k < lanes; ++k) in[k] = L(k + 1);
  T a;
  load_lanes(in, a);
  for (int n = 0; n < 50; ++n) {
    std::int32_t from[lanes];
    for (auto& k : from) k = std::int32_t(g() % unsigned(lanes));
    T const b = permute(a, from);
    auto const order = load_order(a, from);
    for (int k = 0; k < lanes; ++k) {
      REQUIRE(b[k] == in[from[k]]);
      REQUIRE(permute(b, order)[k] == in[from[from[k]]]);
    }
  }
}

TEMPLATE_TEST_CASE("records of eight numbers are loaded number by number", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  std::vector<L> in(8 * lanes + 1);
  for (std::size_t k = 0; k < in.size(); ++k) in[k] = L(k);
  T out[8];
  load_records(in.data() + 1, out);  // at no multiple of the register's size
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < lanes; ++i) REQUIRE(out[k][i] == L(8 * i + k + 1));
}

TEMPLATE_TEST_CASE("records of any length are stored number by number", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  constexpr int lanes = lanes_v<T>;
  auto const check = [](auto const& in) {
    constexpr std::size_t fields = std::extent_v<std::remove_cvref_t<decltype(in)>>;
    std::vector<L> out(fields * lanes + 2, L(-1));
    store_records(in, out.data() + 1);  // at no multiple of the register's size
    REQUIRE((out.front() == L(-1) && out.back() == L(-1)));
    for (std::size_t k = 0; k < fields; ++k)
      for (int i = 0; i < lanes; ++i) REQUIRE(out[1 + fields * std::size_t(i) + k] == in[k][i]);
  };
  auto const numbered = [](int first) {
    L lane[lanes];
    for (int i = 0; i < lanes; ++i) lane[i] = L(first + i);
    T x;
    load_lanes(lane, x);
    return x;
  };
  T const one[1] = {numbered(0)};
  T const three[3] = {numbered(0), numbered(100), numbered(200)};
  T const five[5] = {numbered(0), numbered(100), numbered(200), numbered(300), numbered(400)};
  check(one);
  check(three);
  check(five);
}

TEMPLATE_TEST_CASE("masks convert to bits and back, lane 0 lowest", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  using L = lane_t<T>;
  using mask = mask_t<T>;
  constexpr int lanes = lanes_v<T>;
  constexpr std::uint32_t all = lanes == 32 ? ~0u : (1u << lanes) - 1;
  CHECK(mask(true).bits() == all);
  CHECK(mask(false).bits() == 0);
  CHECK((any_of(mask(true)) && all_of(mask(true)) && !any_of(mask(false)) && !all_of(mask(false))));
  std::mt19937 g(3);
  for (int n = 0; n < 500; ++n) {
    std::uint32_t const x = n < lanes ? 1u << n : static_cast<std::uint32_t>(g()), y = static_cast<std::uint32_t>(g());
    mask const m = mask::from_bits(x), k = mask::from_bits(y);
    REQUIRE(m.bits() == (x & all));
    REQUIRE((!m).bits() == (~x & all));
    REQUIRE((m && k).bits() == (x & y & all));
    REQUIRE((m || k).bits() == ((x | y) & all));
    REQUIRE(any_of(m) == ((x & all) != 0));
    REQUIRE(all_of(m) == ((x & all) == all));
    REQUIRE(all_of(!m) == ((x & all) == 0));
    T const s = select(m, T(L(1)), T(L(2)));
    for (int i = 0; i < lanes; ++i) {
      REQUIRE(m[i] == bool(x >> i & 1));
      REQUIRE(s[i] == (m[i] ? 1 : 2));
    }
  }
}

TEMPLATE_TEST_CASE_SIG("lanes convert between float and double as scalars do", "", ((int N), N), 4, 8, 16) {
  auto const floats = make_operands<float>();
  auto const doubles = make_operands<double>();
  bool same = true;
  for (std::size_t n = 0; n + N <= doubles.a.size(); n += N) {
    auto const narrow = convert<pack<float, N>>(pack<double, N>::load(&doubles.a[n]));
    for (int k = 0; k < N; ++k) same = same && is_same(narrow[k], static_cast<float>(doubles.a[n + std::size_t(k)]));
  }
  CHECK(same);
  same = true;
  for (std::size_t n = 0; n + N <= floats.a.size(); n += N) {
    auto const wide = convert<pack<double, N>>(pack<float, N>::load(&floats.a[n]));
    for (int k = 0; k < N; ++k) same = same && is_same(wide[k], static_cast<double>(floats.a[n + std::size_t(k)]));
  }
  CHECK(same);
  for (std::uint32_t const bits : {0u, 1u, 0x5a5au, 0xffffu}) {
    auto const m = pack_mask<float, N>::from_bits(bits);
    CHECK(convert<pack_mask<double, N>>(m).bits() == m.bits());
    CHECK(convert<pack_mask<float, N>>(convert<pack_mask<double, N>>(m)).bits() == m.bits());
  }
  CHECK(convert<pack<double, N>>(0.1f)[N - 1] == double(0.1f));
}

TEMPLATE_TEST_CASE("vectors of packs compute each lane's dot and cross products", "", PATCHRT_TEST_PACKS) {
  using T = TestType;
  auto const pick = [](auto const& v, auto axis) { return component(v, axis); };
  CHECK(lanes_agree<T>(
      [](T a, T b, T c) {
        return dot(vec3<T>{a, b, c}, vec3<T>{c, a, b});
      },
      [](auto a, auto b, auto c) {
        using L = decltype(a);
        return dot(vec3<L>{a, b, c}, vec3<L>{c, a, b});
      }));
  for (int axis = 0; axis < 3; ++axis) {
    CHECK(lanes_agree<T>(
        [&](T a, T b, T c) {
          return pick(cross(vec3<T>{a, b, c}, vec3<T>{c, a, b}), axis);
        },
        [&](auto a, auto b, auto c) {
          using L = decltype(a);
          return pick(cross(vec3<L>{a, b, c}, vec3<L>{c, a, b}), axis);
        }));
  }
}
