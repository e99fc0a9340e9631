// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Portability macros. The only macros patchrt defines; all start with PATCHRT_.

#include <cassert>

#if defined(__CUDACC__)
#  define PATCHRT_HD __host__ __device__
#else
#  define PATCHRT_HD
#endif

/// Inlined even where the compiler's size heuristics would not: kernels of a few instructions whose lanes must stay in
/// registers.
#if defined(__CUDACC__)
#  define PATCHRT_INLINE __host__ __device__ __forceinline__
#elif defined(__GNUC__)
#  define PATCHRT_INLINE __attribute__((always_inline)) inline
#else
#  define PATCHRT_INLINE inline
#endif

/// The same for a lambda: stands behind its parameters.
#if defined(__GNUC__)
#  define PATCHRT_INLINE_LAMBDA __attribute__((always_inline))
#else
#  define PATCHRT_INLINE_LAMBDA
#endif

/// Kept out of line: a large step whose variables would spill the registers of whatever it is inlined into.
#if defined(__CUDACC__)
#  define PATCHRT_OUTLINE __host__ __device__ __noinline__
#elif defined(__GNUC__)
#  define PATCHRT_OUTLINE __attribute__((noinline))
#else
#  define PATCHRT_OUTLINE
#endif

/// Unrolls the loop that follows, of a constant count: arrays of packs stay in memory where g++ unrolls them too late.
/// nvcc unrolls by itself, and its host pass warns of either pragma.
#if defined(__GNUC__) && !defined(__CUDACC__)
#  define PATCHRT_UNROLL _Pragma("GCC unroll 16")
#else
#  define PATCHRT_UNROLL
#endif

/// Keeps the loop that follows, of a constant count, for the vectoriser: unrolled early it would be single operations.
#if defined(__GNUC__) && !defined(__clang__) && !defined(__CUDACC__)
#  define PATCHRT_VECTORISE _Pragma("GCC unroll 1")
#else
#  define PATCHRT_VECTORISE
#endif

/// States a precondition. Checked where NDEBUG is absent, on host and device alike; never evaluated otherwise.
#define PATCHRT_EXPECTS(...) assert((__VA_ARGS__))
