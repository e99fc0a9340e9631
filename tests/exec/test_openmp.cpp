// SPDX-License-Identifier: MIT
#include <exec/executor_properties.hpp>
#include <patchrt/exec/openmp.hpp>

#include <chrono>
#include <thread>

using namespace patchrt;

static_assert(executor<openmp>);

TEST_CASE("the OpenMP executor visits every index once") {
  for (int const threads : {0, 1, 2, 5}) test::check_every_index_is_visited_once(openmp(threads));
}
TEST_CASE("the OpenMP executor's chunks make up the list") {
  for (int const threads : {0, 1, 2, 5}) test::check_chunks_make_up_the_list(openmp(threads));
}
TEST_CASE("the OpenMP executor hands one exception on") {
  for (int const threads : {0, 1, 2, 5}) test::check_exceptions_reach_the_caller(openmp(threads));
}
TEST_CASE("the OpenMP executor can be used within its own bodies") {
  test::check_a_body_may_use_the_executor(openmp(3));
}
TEST_CASE("the OpenMP executor begins nothing after an exception") {
  test::check_nothing_begins_after_an_exception(openmp(1));
}

TEST_CASE("the OpenMP executor has the threads asked for, and some where none are named") {
  REQUIRE(openmp(3).concurrency() == 3);
  REQUIRE(openmp().concurrency() == omp_get_max_threads());
  REQUIRE(openmp(-1).concurrency() == omp_get_max_threads());
}

TEST_CASE("two threads of the OpenMP executor run at once") {
  if (omp_get_thread_limit() < 2) PATCHRT_SKIP("OpenMP is limited to one thread");
  std::atomic<int> arrived = 0, met = 0;
  openmp(2).for_each_chunk(2, 1, [&](std::size_t, std::size_t) {
    ++arrived;
    auto const patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (arrived < 2 && std::chrono::steady_clock::now() < patience) std::this_thread::yield();
    met += arrived == 2;
  });
  REQUIRE(met == 2);
}
