// SPDX-License-Identifier: MIT
#include <exec/executor_properties.hpp>
#include <patchrt/exec/serial.hpp>

#include <vector>

using namespace patchrt;

static_assert(executor<serial>);
static_assert(!executor<int>);

TEST_CASE("the serial executor visits every index once") { test::check_every_index_is_visited_once(serial{}); }
TEST_CASE("the serial executor's chunks make up the list") { test::check_chunks_make_up_the_list(serial{}); }
TEST_CASE("the serial executor hands exceptions on") { test::check_exceptions_reach_the_caller(serial{}); }
TEST_CASE("the serial executor can be used within its own bodies") {
  test::check_a_body_may_use_the_executor(serial{});
}
TEST_CASE("the serial executor stops at an exception") { test::check_nothing_begins_after_an_exception(serial{}); }

TEST_CASE("the serial executor goes in ascending order, one call at a time") {
  REQUIRE(serial{}.concurrency() == 1);
  std::vector<std::size_t> order;
  serial{}.for_each(5, [&](std::size_t i) { order.push_back(i); });
  serial{}.for_each_chunk(5, 2, [&](std::size_t begin, std::size_t) { order.push_back(begin); });
  REQUIRE(order == std::vector<std::size_t>{0, 1, 2, 3, 4, 0, 2, 4});
}
