// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Catch2, version 2 or 3, under the names that both have; and a skip that both know.

#if __has_include(<catch2/catch_all.hpp>)
#  include <catch2/catch_all.hpp>
#else
#  include <catch2/catch.hpp>
#endif

#include <iostream>
#include <string>

#if __has_include(<catch2/catch_all.hpp>)
using Catch::Approx;
#endif

namespace patchrt::test {

/// Matches strings that contain `part`: `REQUIRE_THROWS_WITH(load(path), contains_text("line 3"))`.
inline auto contains_text(std::string const& part) {
#if __has_include(<catch2/catch_all.hpp>)
  return Catch::Matchers::ContainsSubstring(part);
#else
  return Catch::Matchers::Contains(part);
#endif
}

}  // namespace patchrt::test

/// Leaves the test case; ctest counts it as skipped and shows why.
#define PATCHRT_SKIP(why)                                          \
  do {                                                             \
    std::cout << "patchrt test skipped: " << (why) << std::endl;   \
    return;                                                        \
  } while (false)
