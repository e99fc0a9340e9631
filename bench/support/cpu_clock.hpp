// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Processor time, which a busy machine stretches far less than the wall clock.

#include <ctime>

namespace patchrt::bench {

inline double clock_seconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Processor seconds that f() takes on the calling thread.
template <class F> double thread_seconds(F&& f) {
  double const start = clock_seconds(CLOCK_THREAD_CPUTIME_ID);
  f();
  return clock_seconds(CLOCK_THREAD_CPUTIME_ID) - start;
}

/// Processor seconds that f() takes on all threads of the program together.
template <class F> double process_seconds(F&& f) {
  double const start = clock_seconds(CLOCK_PROCESS_CPUTIME_ID);
  f();
  return clock_seconds(CLOCK_PROCESS_CPUTIME_ID) - start;
}

}  // namespace patchrt::bench
