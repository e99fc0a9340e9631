// SPDX-License-Identifier: MIT
#pragma once

#if !defined(_OPENMP)
#  error "patchrt/exec/openmp.hpp needs OpenMP: link patchrt::openmp, or compile with -fopenmp"
#endif

/// \file
/// Lists over the cores of the host. Component `patchrt::openmp` of the CMake package.

#include <patchrt/core/config.hpp>
#include <patchrt/exec/executor.hpp>

#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>

namespace patchrt {

/// Threads of OpenMP's pool, which take the next chunk as they become free.
class openmp {
 public:
  /// `threads` at once; 0 leaves the number to OpenMP (OMP_NUM_THREADS, else the cores there are).
  explicit openmp(int threads = 0) : threads_(threads > 0 ? threads : omp_get_max_threads()) {}

  int concurrency() const { return threads_; }

  /// In chunks of a sixteenth of a thread's share: for work of even and small cost. Take `for_each_chunk` for other
  /// work.
  template <class F> void for_each(std::size_t n, F&& f) const {
    std::size_t const grain = std::max(std::size_t(1), n / (16 * static_cast<std::size_t>(threads_)));
    for_each_chunk(n, grain, [&f](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) f(i);
    });
  }

  /// \pre grain > 0
  template <class F> void for_each_chunk(std::size_t n, std::size_t grain, F&& f) const {
    PATCHRT_EXPECTS(grain > 0);
    std::size_t const chunks = n / grain + (n % grain != 0);
    if (chunks == 0) return;
    std::atomic<bool> failed = false;
    std::exception_ptr failure;  // written by the one thread that sets `failed`, read after the region
    int const threads = static_cast<int>(std::min(chunks, static_cast<std::size_t>(threads_)));
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (std::size_t c = 0; c < chunks; ++c) {
      if (failed.load(std::memory_order_relaxed)) continue;
      try {
        std::size_t const begin = c * grain;
        f(begin, begin + std::min(grain, n - begin));
      } catch (...) {
        if (!failed.exchange(true)) failure = std::current_exception();
      }
    }
    if (failure) std::rethrow_exception(failure);
  }

 private:
  int threads_;
};

}  // namespace patchrt
