// SPDX-License-Identifier: MIT
// What random search found stays mended.
#include "fuzz/fuzz_search.hpp"
#include "rows_found.hpp"

#include "support/catch.hpp"

using namespace patchrt;
using namespace patchrt::test;

TEST_CASE("every ray that random search found is answered as promised") {
  for (found_case const& c : found_cases()) {
    search_input in;
    for (oracle_patch const& p : c.patches) in.patches.push_back(make_patch<double>(p));
    for (oracle_ray const& r : c.rays) in.rays.push_back({{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, r[6], r[7]});
    search_violation const v = find_violation(in);
    CAPTURE(c.name, c.property, v.property, v.ray);
    CHECK(v.property.empty());
  }
}
