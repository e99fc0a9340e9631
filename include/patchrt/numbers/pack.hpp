// SPDX-License-Identifier: MIT
#pragma once

#if defined(__CUDACC__)
#  error \
      "patchrt/numbers/pack.hpp is for host translation units: nvcc rejects vector registers in __host__ __device__ code"
#endif

/// \file
/// N lanes of float or double on the host, over xsimd's `batch`. Component `patchrt::pack` of the CMake package.

#include <patchrt/core/scalar.hpp>

#include <xsimd/xsimd.hpp>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace patchrt {

namespace detail {

/// The widest register of this build that N lanes fill.
template <class T, int N>
using pack_batch = std::conditional_t<(int(xsimd::batch<T>::size) <= N), xsimd::batch<T>,
                                      xsimd::make_sized_batch_t<T, std::size_t(N)>>;

/// a b + c in one rounding. xsimd 8 has no fused form for AVX-512 and an unfused one where the machine has none.
template <class T, class A>
PATCHRT_INLINE xsimd::batch<T, A> fused(xsimd::batch<T, A> a, xsimd::batch<T, A> b, xsimd::batch<T, A> c) {
#if defined(__AVX512F__)
  if constexpr (sizeof(a) == 64) {
    if constexpr (sizeof(T) == 4) return _mm512_fmadd_ps(a, b, c);
    else return _mm512_fmadd_pd(a, b, c);
  } else
#endif
#if defined(__FMA__)
      if constexpr (sizeof(a) == 16) {  // a sized batch of 128 bits is of an architecture without fma
    if constexpr (sizeof(T) == 4) return _mm_fmadd_ps(a, b, c);
    else return _mm_fmadd_pd(a, b, c);
  } else
#endif
#if defined(__FMA__) || defined(__aarch64__)
  {
    return xsimd::fma(a, b, c);
  }
#else
  {
    alignas(64) T x[xsimd::batch<T, A>::size], y[xsimd::batch<T, A>::size], z[xsimd::batch<T, A>::size];
    a.store_aligned(x);
    b.store_aligned(y);
    c.store_aligned(z);
    for (std::size_t i = 0; i < xsimd::batch<T, A>::size; ++i) z[i] = std::fma(x[i], y[i], z[i]);
    return xsimd::batch<T, A>::load_aligned(z);
  }
#endif
}

/// |a| with the sign of b: in AVX-512 by one operation, where xsimd takes three.
template <class T, class A> PATCHRT_INLINE xsimd::batch<T, A> with_sign(xsimd::batch<T, A> a, xsimd::batch<T, A> b) {
#if defined(__AVX512F__)
  if constexpr (sizeof(a) == 64) {
    xsimd::batch<T, A> const sign(T(-0.0));
    constexpr int by_third = 0xd8;  // bits of the second where the third's are set, else of the first
    if constexpr (sizeof(T) == 4)
      return _mm512_castsi512_ps(_mm512_ternarylogic_epi32(_mm512_castps_si512(a), _mm512_castps_si512(b),
                                                           _mm512_castps_si512(sign), by_third));
    else
      return _mm512_castsi512_pd(_mm512_ternarylogic_epi64(_mm512_castpd_si512(a), _mm512_castpd_si512(b),
                                                           _mm512_castpd_si512(sign), by_third));
  } else
#endif
  {
    return xsimd::copysign(a, b);
  }
}

/// One bit a lane, lane 0 lowest.
template <class T, class A> PATCHRT_INLINE std::uint32_t batch_bits(xsimd::batch_bool<T, A> m) {
#if defined(__AVX512F__)
  if constexpr (sizeof(xsimd::batch<T, A>) == 64) return static_cast<std::uint32_t>(m.data);
#endif
#if defined(__AVX__)
  if constexpr (sizeof(xsimd::batch<T, A>) == 32) {
    if constexpr (sizeof(T) == 4) return static_cast<std::uint32_t>(_mm256_movemask_ps(m));
    else return static_cast<std::uint32_t>(_mm256_movemask_pd(m));
  }
#endif
#if defined(__SSE2__)
  if constexpr (sizeof(xsimd::batch<T, A>) == 16) {
    if constexpr (sizeof(T) == 4) return static_cast<std::uint32_t>(_mm_movemask_ps(m));
    else return static_cast<std::uint32_t>(_mm_movemask_pd(m));
  }
#endif
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < xsimd::batch<T, A>::size; ++i) bits |= std::uint32_t(m.get(i)) << i;
  return bits;
}

/// b in every lane.
template <class B> PATCHRT_INLINE typename B::batch_bool_type uniform_mask(bool b) {
#if defined(__AVX512F__)  // xsimd sets it bit by bit
  if constexpr (sizeof(B) == 64) {
    using bits = typename B::batch_bool_type::register_type;
    return typename B::batch_bool_type(static_cast<bits>(b ? ~bits(0) : bits(0)));
  }
#endif
  return typename B::batch_bool_type(b);
}
/// The inverse of `batch_bits`.
template <class B> PATCHRT_INLINE typename B::batch_bool_type batch_mask(std::uint32_t bits) {
#if defined(__AVX512F__)
  if constexpr (sizeof(B) == 64)
    return typename B::batch_bool_type(static_cast<typename B::batch_bool_type::register_type>(bits));
#endif
  using T = typename B::value_type;
  alignas(64) T lane[B::size];
  for (std::size_t i = 0; i < B::size; ++i) lane[i] = T((bits >> i) & 1u);
  return B::load_aligned(lane) != B(T(0));
}

}  // namespace detail

/// One flag a lane of `pack<T, N>`.
template <class T, int N> struct pack_mask {
  using batch = detail::pack_batch<T, N>;
  using batch_bool = typename batch::batch_bool_type;
  static constexpr int width = int(batch::size);
  static constexpr int parts = N / width;
  batch_bool part[parts];

  pack_mask() = default;
  PATCHRT_INLINE explicit pack_mask(bool b) {
    PATCHRT_UNROLL
    for (auto& p : part) p = detail::uniform_mask<batch>(b);
  }
  /// Lane i is bit i of `bits`.
  PATCHRT_INLINE static pack_mask from_bits(std::uint32_t bits) {
    pack_mask m;
    for (int i = 0; i < parts; ++i) m.part[i] = detail::batch_mask<batch>((bits >> (i * width)) & lane_bits());
    return m;
  }
  /// Lane i in bit i.
  PATCHRT_INLINE std::uint32_t bits() const {
    std::uint32_t b = 0;
    for (int i = 0; i < parts; ++i) b |= (detail::batch_bits(part[i]) & lane_bits()) << (i * width);
    return b;
  }
  PATCHRT_INLINE bool operator[](int i) const { return (bits() >> i) & 1u; }

  PATCHRT_INLINE friend pack_mask operator!(pack_mask a) {
    PATCHRT_UNROLL
    for (auto& p : a.part) p = ~p;
    return a;
  }
  PATCHRT_INLINE friend pack_mask operator&&(pack_mask a, pack_mask b) {
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) a.part[i] = a.part[i] & b.part[i];
    return a;
  }
  PATCHRT_INLINE friend pack_mask operator||(pack_mask a, pack_mask b) {
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) a.part[i] = a.part[i] | b.part[i];
    return a;
  }
  PATCHRT_INLINE friend bool any_of(pack_mask a) { return a.bits() != 0; }
  PATCHRT_INLINE friend bool all_of(pack_mask a) { return a.bits() == all_bits(); }

 private:
  static constexpr std::uint32_t lane_bits() { return width == 32 ? ~0u : (1u << width) - 1u; }
  static constexpr std::uint32_t all_bits() { return N == 32 ? ~0u : (1u << N) - 1u; }
};

/// N numbers that every operation treats alike and apart: one ray, one candidate or one control point a lane.
///
/// N is a power of two up to 32; more lanes than the machine's registers hold take several registers. Each lane of each
/// operation gives the bits that the scalar operation gives.
template <class T, int N> struct pack {
  using batch = detail::pack_batch<T, N>;
  static constexpr int width = int(batch::size);
  static constexpr int parts = N / width;
  static_assert(width * parts == N);
  using mask = pack_mask<T, N>;
  batch part[parts];

  pack() = default;
  PATCHRT_INLINE pack(T s) {  // NOLINT(google-explicit-constructor): constants enter kernels as T(2)
    PATCHRT_UNROLL
    for (auto& p : part) p = batch(s);
  }

  PATCHRT_INLINE static pack load(T const* p) {
    pack r;
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) r.part[i] = batch::load_unaligned(p + i * width);
    return r;
  }
  PATCHRT_INLINE void store(T* p) const {
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) part[i].store_unaligned(p + i * width);
  }
  /// Lane i, by way of memory: for tests and rare paths.
  T operator[](int i) const {
    alignas(64) T lane[N];
    store(lane);
    return lane[i];
  }

  PATCHRT_INLINE pack& operator+=(pack b) { return *this = *this + b; }
  PATCHRT_INLINE pack& operator-=(pack b) { return *this = *this - b; }
  PATCHRT_INLINE pack& operator*=(pack b) { return *this = *this * b; }
  PATCHRT_INLINE pack& operator/=(pack b) { return *this = *this / b; }
  PATCHRT_INLINE friend pack operator+(pack a, pack b) {
    return zip(a, b, [](batch x, batch y) { return x + y; });
  }
  PATCHRT_INLINE friend pack operator-(pack a, pack b) {
    return zip(a, b, [](batch x, batch y) { return x - y; });
  }
  PATCHRT_INLINE friend pack operator*(pack a, pack b) {
    return zip(a, b, [](batch x, batch y) { return x * y; });
  }
  PATCHRT_INLINE friend pack operator/(pack a, pack b) {
    return zip(a, b, [](batch x, batch y) { return x / y; });
  }
  PATCHRT_INLINE friend pack operator-(pack a) {  // -0 - x, not xsimd's 0 - x: the sign of zero is a bit too
    return map(a, [](batch x) { return batch(T(-0.0)) - x; });
  }
  PATCHRT_INLINE friend pack sqrt(pack a) {
    return map(a, [](batch x) { return xsimd::sqrt(x); });
  }
  PATCHRT_INLINE friend pack abs(pack a) {
    return map(a, [](batch x) { return xsimd::abs(x); });
  }
  PATCHRT_INLINE friend pack power_of_two_below(pack a) {
    return map(a, [](batch x) { return x & batch(std::numeric_limits<T>::infinity()); });
  }
  PATCHRT_INLINE friend pack copysign(pack a, pack b) {
    return zip(a, b, [](batch x, batch y) { return detail::with_sign(x, y); });
  }
  PATCHRT_INLINE friend pack fma(pack a, pack b, pack c) {
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) c.part[i] = detail::fused(a.part[i], b.part[i], c.part[i]);
    return c;
  }
  PATCHRT_INLINE friend pack min(pack a, pack b) {
#if defined(__SSE2__)  // minps is a < b ? a : b
    return zip(a, b, [](batch x, batch y) { return xsimd::min(x, y); });
#else
    return select(a < b, a, b);
#endif
  }
  PATCHRT_INLINE friend pack max(pack a, pack b) {
#if defined(__SSE2__)  // maxps is b < a ? a : b
    return zip(a, b, [](batch x, batch y) { return xsimd::max(x, y); });
#else
    return select(b < a, a, b);
#endif
  }
  PATCHRT_INLINE friend mask operator<(pack a, pack b) {
    return compare(a, b, [](batch x, batch y) { return x < y; });
  }
  PATCHRT_INLINE friend mask operator>(pack a, pack b) { return b < a; }
  PATCHRT_INLINE friend mask operator<=(pack a, pack b) {
    return compare(a, b, [](batch x, batch y) { return x <= y; });
  }
  PATCHRT_INLINE friend mask operator>=(pack a, pack b) { return b <= a; }
  PATCHRT_INLINE friend mask operator==(pack a, pack b) {
    return compare(a, b, [](batch x, batch y) { return x == y; });
  }
  PATCHRT_INLINE friend pack select(mask m, pack a, pack b) {
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) a.part[i] = xsimd::select(m.part[i], a.part[i], b.part[i]);
    return a;
  }

 private:
  template <class F> PATCHRT_INLINE static pack map(pack a, F f) {
    PATCHRT_UNROLL
    for (auto& p : a.part) p = f(p);
    return a;
  }
  template <class F> PATCHRT_INLINE static pack zip(pack a, pack b, F f) {
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) a.part[i] = f(a.part[i], b.part[i]);
    return a;
  }
  template <class F> PATCHRT_INLINE static mask compare(pack a, pack b, F f) {
    mask m;
    PATCHRT_UNROLL
    for (int i = 0; i < parts; ++i) m.part[i] = f(a.part[i], b.part[i]);
    return m;
  }
};

template <class T, int N> PATCHRT_INLINE unsigned mask_bits(pack_mask<T, N> const& m) { return m.bits(); }
template <class T, int N> PATCHRT_INLINE void store_lanes(pack<T, N> const& x, T* lanes) { x.store(lanes); }

template <class T, int N> PATCHRT_INLINE void load_lanes(T const* lanes, pack<T, N>& x) { x = pack<T, N>::load(lanes); }
/// An order of the lanes of a pack, for many permutations: in a register where the machine permutes by one. What it is made
/// from must outlive it.
template <class T, int N> struct lane_order {
  std::int32_t const* index;
  PATCHRT_INLINE explicit lane_order(std::int32_t const* from) : index(from) {}
};
#if defined(__AVX512F__)
template <> struct lane_order<float, 16> {
  __m512i index;
  PATCHRT_INLINE explicit lane_order(std::int32_t const* from) : index(_mm512_loadu_si512(from)) {}
};
#endif
#if defined(__AVX2__)
template <> struct lane_order<float, 8> {
  __m256i index;
  PATCHRT_INLINE explicit lane_order(std::int32_t const* from)
      : index(_mm256_loadu_si256(reinterpret_cast<__m256i const*>(from))) {}
};
#endif
/// That order for packs like the first argument.
template <class T, int N> PATCHRT_INLINE lane_order<T, N> load_order(pack<T, N> const&, std::int32_t const* index) {
  return lane_order<T, N>(index);
}

template <class T, int N> PATCHRT_INLINE pack<T, N> permute(pack<T, N> const& x, lane_order<T, N> const& order) {
#if defined(__AVX512F__)
  if constexpr (sizeof(T) == 4 && N == 16) {
    pack<T, N> r;
    r.part[0] = _mm512_maskz_permutexvar_ps(0xffff, order.index, x.part[0]);
    return r;
  } else
#endif
#if defined(__AVX2__)
      if constexpr (sizeof(T) == 4 && N == 8) {
    pack<T, N> r;
    r.part[0] = _mm256_permutevar8x32_ps(x.part[0], order.index);
    return r;
  } else
#endif
  {
    alignas(64) T from[N], to[N];
    x.store(from);
    for (int i = 0; i < N; ++i) to[i] = from[order.index[i]];
    return pack<T, N>::load(to);
  }
}
template <class T, int N> PATCHRT_INLINE pack<T, N> permute(pack<T, N> const& x, std::int32_t const* index) {
  return permute(x, load_order(x, index));
}

template <class T, int N> PATCHRT_INLINE T least_lane(pack<T, N> const& x) {
#if defined(__AVX512F__)  // by halves of the register: gcc 12 warns inside its own reductions
  if constexpr (sizeof(T) == 4 && N == 16) {
    __m512 const a = x.part[0];
    __m512 const b = _mm512_maskz_min_ps(0xffff, a, _mm512_maskz_shuffle_f32x4(0xffff, a, a, 0x4e));
    __m512 const c = _mm512_maskz_min_ps(0xffff, b, _mm512_maskz_shuffle_f32x4(0xffff, b, b, 0xb1));
    __m128 const d = _mm512_castps512_ps128(c);
    __m128 const e = _mm_min_ps(d, _mm_movehl_ps(d, d));
    return _mm_cvtss_f32(_mm_min_ss(e, _mm_shuffle_ps(e, e, 1)));
  }
#endif
  alignas(64) T lane[N];
  x.store(lane);
  T least = lane[0];
  for (int i = 1; i < N; ++i) least = lane[i] < least ? lane[i] : least;
  return least;
}

/// The lanes in which a <= b, a bit each: `mask_bits(a <= b)` on a shorter way.
template <class T, int N> PATCHRT_INLINE std::uint32_t at_most_bits(pack<T, N> const& a, pack<T, N> const& b) {
#if defined(__AVX512VL__)
  if constexpr (sizeof(T) == 4 && pack<T, N>::parts == 1 && N == 8)
    return _mm256_cmp_ps_mask(a.part[0], b.part[0], _CMP_LE_OQ);
#endif
  return (a <= b).bits();
}

/// The lanes of x whose bit is set, in order, to `out`, where N numbers have room: what is behind them is unspecified.
template <class T, int N> PATCHRT_INLINE void store_some(std::uint32_t bits, pack<T, N> const& x, T* out) {
#if defined(__AVX512VL__)
  if constexpr (sizeof(T) == 4 && pack<T, N>::parts == 1 && N == 8) {
    _mm256_storeu_ps(out, _mm256_maskz_compress_ps(static_cast<__mmask8>(bits), x.part[0]));
    return;
  }
#endif
  alignas(64) T lane[N];
  x.store(lane);
  for (; bits != 0; bits &= bits - 1) *out++ = lane[std::countr_zero(bits)];
}

template <class T, int N> struct scalar_traits<pack<T, N>> {
  using lane = T;
  using mask = pack_mask<T, N>;
  template <class L> using rebind = pack<L, N>;
  static constexpr int lanes = N;
};

namespace detail {
/// The parts of a pack or a mask: each its own register as a `Part`.
template <class Whole, class Part> struct register_parts {
  using part = Part;
  static constexpr int count = Whole::parts;
  PATCHRT_INLINE static part get(Whole const& x, int i) {
    part p;
    p.part[0] = x.part[i];
    return p;
  }
  PATCHRT_INLINE static void set(Whole& x, int i, part const& p) { x.part[i] = p.part[0]; }
};
}  // namespace detail

template <class T, int N>
struct scalar_parts<pack<T, N>> : detail::register_parts<pack<T, N>, pack<T, pack<T, N>::width>> {};
template <class T, int N>
struct scalar_parts<pack_mask<T, N>> : detail::register_parts<pack_mask<T, N>, pack_mask<T, pack_mask<T, N>::width>> {};

/// Lanes to lanes of the other precision.
template <class To, class From, int N>
requires(!std::is_same_v<To, From>) struct scalar_convert<pack<To, N>, pack<From, N>> {
  PATCHRT_INLINE static pack<To, N> apply(pack<From, N> a) {
#if defined(__AVX512F__)  // the masked forms: gcc 12 warns inside its own unmasked ones
    if constexpr (N == 16 && sizeof(To) == 8) {
      pack<To, N> r;
      __m512 const x = a.part[0];
      r.part[0] = _mm512_maskz_cvtps_pd(0xff, _mm512_castps512_ps256(x));
      r.part[1] = _mm512_maskz_cvtps_pd(0xff, _mm512_castps512_ps256(_mm512_maskz_shuffle_f32x4(0xffff, x, x, 0x4e)));
      return r;
    } else if constexpr (N == 16 && sizeof(To) == 4) {
      __m512 const lo = _mm512_zextps256_ps512(_mm512_maskz_cvtpd_ps(0xff, a.part[0]));
      __m512 const hi = _mm512_zextps256_ps512(_mm512_maskz_cvtpd_ps(0xff, a.part[1]));
      pack<To, N> r;
      r.part[0] = _mm512_maskz_shuffle_f32x4(0xffff, lo, hi, 0x44);
      return r;
    } else
#endif
    {
      alignas(64) From in[N];
      alignas(64) To out[N];
      a.store(in);
      for (int i = 0; i < N; ++i) out[i] = static_cast<To>(in[i]);
      return pack<To, N>::load(out);
    }
  }
};

template <class T, int N> struct scalar_convert<pack_mask<T, N>, unsigned> {
  PATCHRT_INLINE static pack_mask<T, N> apply(unsigned bits) { return pack_mask<T, N>::from_bits(bits); }
};

/// N records of eight numbers each, one after the other in memory, to eight packs: out[k][i] = records[8 i + k].
template <class T, int N> PATCHRT_INLINE void load_records(T const* records, pack<T, N> (&out)[8]) {
#if defined(__AVX512F__)
  if constexpr (sizeof(T) == 8 && pack<T, N>::width == 8) {
    PATCHRT_UNROLL
    for (int part = 0; part < pack<T, N>::parts; ++part) {
      __m512d r[8], s[8];
      for (int i = 0; i < 8; ++i) r[i] = _mm512_loadu_pd(records + 64 * part + 8 * i);
      for (int i = 0; i < 8; i += 2) {  // pairs of records: even and odd numbers side by side
        s[i] = __builtin_shufflevector(r[i], r[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
        s[i + 1] = __builtin_shufflevector(r[i], r[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
      }
      PATCHRT_UNROLL
      for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; ++k) {  // four records: numbers k, k + 4 and k + 2, k + 6
          r[i + k] = __builtin_shufflevector(s[i + k], s[i + k + 2], 0, 1, 8, 9, 4, 5, 12, 13);
          r[i + k + 2] = __builtin_shufflevector(s[i + k], s[i + k + 2], 2, 3, 10, 11, 6, 7, 14, 15);
        }
      PATCHRT_UNROLL
      for (int k = 0; k < 4; ++k) {
        out[k].part[part] = __builtin_shufflevector(r[k], r[k + 4], 0, 1, 2, 3, 8, 9, 10, 11);
        out[k + 4].part[part] = __builtin_shufflevector(r[k], r[k + 4], 4, 5, 6, 7, 12, 13, 14, 15);
      }
    }
    return;
  }
  if constexpr (sizeof(T) == 4 && pack<T, N>::width == 16) {
    PATCHRT_UNROLL
    for (int part = 0; part < pack<T, N>::parts; ++part) {
      __m512 r[8], s[8];
      for (int i = 0; i < 8; ++i) r[i] = _mm512_loadu_ps(records + 128 * part + 16 * i);
      PATCHRT_UNROLL
      for (int i = 0; i < 4; ++i) {  // four records: numbers 0 to 3, and 4 to 7
        s[2 * i] =
            __builtin_shufflevector(r[2 * i], r[2 * i + 1], 0, 8, 16, 24, 1, 9, 17, 25, 2, 10, 18, 26, 3, 11, 19, 27);
        s[2 * i + 1] =
            __builtin_shufflevector(r[2 * i], r[2 * i + 1], 4, 12, 20, 28, 5, 13, 21, 29, 6, 14, 22, 30, 7, 15, 23, 31);
      }
      PATCHRT_UNROLL
      for (int i = 0; i < 8; i += 4)
        for (int k = 0; k < 2; ++k) {  // eight records: numbers 4k and 4k + 1, and 4k + 2 and 4k + 3
          r[i + 2 * k] =
              __builtin_shufflevector(s[i + k], s[i + k + 2], 0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21, 22, 23);
          r[i + 2 * k + 1] = __builtin_shufflevector(s[i + k], s[i + k + 2], 8, 9, 10, 11, 24, 25, 26, 27, 12, 13, 14,
                                                     15, 28, 29, 30, 31);
        }
      PATCHRT_UNROLL
      for (int k = 0; k < 4; ++k) {
        out[2 * k].part[part] =
            __builtin_shufflevector(r[k], r[k + 4], 0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23);
        out[2 * k + 1].part[part] =
            __builtin_shufflevector(r[k], r[k + 4], 8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31);
      }
    }
    return;
  }
#endif
  alignas(64) T lane[N];
  PATCHRT_UNROLL
  for (int k = 0; k < 8; ++k) {
    for (int i = 0; i < N; ++i) lane[i] = records[8 * i + k];
    out[k] = pack<T, N>::load(lane);
  }
}

/// The same lanes of a pack of the other precision.
template <class To, class From, int N> struct scalar_convert<pack_mask<To, N>, pack_mask<From, N>> {
  PATCHRT_INLINE static pack_mask<To, N> apply(pack_mask<From, N> m) {
    if constexpr (std::is_same_v<To, From>) return m;
    else return pack_mask<To, N>::from_bits(m.bits());
  }
};

namespace detail {
/// Records of F numbers, 16 records a row of F registers: the record of each number of a row, and the numbers of each field.
template <std::size_t F> struct record_rows {
  alignas(64) std::int32_t record[F][16];
  std::uint16_t of_field[F][F];
};
template <std::size_t F>
inline constexpr record_rows<F> rows_of_records = [] {
  record_rows<F> rows{};
  for (std::size_t at = 0; at < 16 * F; ++at) {
    rows.record[at / 16][at % 16] = static_cast<std::int32_t>(at / F);
    rows.of_field[at / 16][at % F] |= static_cast<std::uint16_t>(1u << at % 16);
  }
  return rows;
}();
}  // namespace detail

/// N records of F numbers each, one after the other in memory: records[F i + k] = in[k][i].
template <class T, int N, std::size_t F> PATCHRT_INLINE void store_records(pack<T, N> const (&in)[F], T* records) {
#if defined(__AVX512F__)
  if constexpr (sizeof(T) == 4 && N == 16) {
    auto const& rows = detail::rows_of_records<F>;
    PATCHRT_UNROLL
    for (std::size_t row = 0; row < F; ++row) {
      __m512i const record = _mm512_load_si512(rows.record[row]);
      __m512 out = in[0].part[0];
      PATCHRT_UNROLL
      for (std::size_t k = 0; k < F; ++k)
        out = _mm512_mask_permutexvar_ps(out, rows.of_field[row][k], record, in[k].part[0]);
      _mm512_storeu_ps(records + 16 * row, out);
    }
    return;
  }
#endif
  alignas(64) T lane[N];
  for (std::size_t k = 0; k < F; ++k) {
    in[k].store(lane);
    for (std::size_t i = 0; i < std::size_t(N); ++i) records[F * i + k] = lane[i];
  }
}

}  // namespace patchrt
