// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What every executor on the host must do.

#include <patchrt/exec/executor.hpp>
#include <support/catch.hpp>

#include <atomic>
#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>

namespace patchrt::test {

template <executor E> void check_every_index_is_visited_once(E const& exec) {
  for (std::size_t const n : {0u, 1u, 2u, 7u, 1000u, 100003u}) {
    CAPTURE(n);
    auto const visits = std::make_unique<std::atomic<int>[]>(n + 1);
    exec.for_each(n, [&](std::size_t i) { ++visits[i < n ? i : n]; });
    std::size_t once = 0;
    for (std::size_t i = 0; i < n; ++i) once += visits[i] == 1;
    REQUIRE(once == n);
    REQUIRE(visits[n] == 0);
  }
}

template <executor E> void check_chunks_make_up_the_list(E const& exec) {
  for (std::size_t const n : {0u, 1u, 2u, 63u, 64u, 65u, 1000u})
    for (std::size_t const grain : {1u, 3u, 64u, 1000u, 1u << 30u}) {
      CAPTURE(n, grain);
      auto const visits = std::make_unique<std::atomic<int>[]>(n + 1);
      std::atomic<int> wrong = 0;
      exec.for_each_chunk(n, grain, [&](std::size_t begin, std::size_t end) {
        wrong += !(begin < end && end <= n && end - begin <= grain);
        for (std::size_t i = begin; i < end && i < n; ++i) ++visits[i];
      });
      REQUIRE(wrong == 0);
      std::size_t once = 0;
      for (std::size_t i = 0; i < n; ++i) once += visits[i] == 1;
      REQUIRE(once == n);
    }
}

template <executor E> void check_exceptions_reach_the_caller(E const& exec) {
  REQUIRE_THROWS_AS(exec.for_each(1000,
                                  [](std::size_t i) {
                                    if (i == 617) throw std::out_of_range("element 617");
                                  }),
                    std::out_of_range);
  REQUIRE_THROWS_WITH(exec.for_each_chunk(1000, 7, [](std::size_t, std::size_t) { throw std::runtime_error("each"); }),
                      "each");
  std::atomic<int> visits = 0;
  exec.for_each(1000, [&](std::size_t) { ++visits; });  // and leave it fit for more
  REQUIRE(visits == 1000);
}

template <executor E> void check_a_body_may_use_the_executor(E const& exec) {
  std::atomic<int> visits = 0;
  exec.for_each(10, [&](std::size_t) { exec.for_each(10, [&](std::size_t) { ++visits; }); });
  REQUIRE(visits == 100);
}

/// With one call at a time.
template <executor E> void check_nothing_begins_after_an_exception(E const& exec) {
  int calls = 0;
  REQUIRE_THROWS(exec.for_each_chunk(1000, 1, [&](std::size_t, std::size_t) {
    ++calls;
    throw std::runtime_error("first");
  }));
  REQUIRE(calls == 1);
}

}  // namespace patchrt::test
