// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>

namespace patchrt {

/// How a list is processed: in this thread, by many, on a device. A function over a list takes its executor as an
/// argument.
///
/// `for_each(n, f)` calls f(i) once for every i < n, `for_each_chunk(n, grain, f)` calls f(begin, end) for disjoint
/// ranges of at most `grain` that make up [0, n); in any order, perhaps at once, all done on return. An exception out
/// of f reaches the caller: where several calls throw, one of them; calls not yet begun are then left out.
/// `concurrency()` is how many calls may run at once.
template <class E>
concept executor = requires(E const& e, std::size_t n, void (*f)(std::size_t), void (*g)(std::size_t, std::size_t)) {
  e.for_each(n, f);
  e.for_each_chunk(n, n, g);
  { e.concurrency() } -> std::convertible_to<int>;
};

}  // namespace patchrt
