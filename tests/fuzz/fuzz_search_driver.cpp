// SPDX-License-Identifier: MIT
// Feeds random bytes to the fuzz target where the compiler has no libFuzzer: each input is made from its own number, so
// that any one can be run again.
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size);

namespace {

constexpr std::size_t input_size = 400;
constexpr unsigned most_seconds = 30;  ///< an input takes 20 ms

unsigned long long current = 0;

void run(unsigned long long number) {
  current = number;
  std::mt19937_64 random(number);
  std::vector<std::uint8_t> bytes(input_size);
  for (auto& b : bytes) b = std::uint8_t(random());
  alarm(most_seconds);
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

[[noreturn]] void stop(char const* why) {
  std::fprintf(stderr, "fuzz: %s; again by: 0 %llu\n", why, current);
  std::_Exit(1);
}

}  // namespace

/// usage: fuzz_search SECONDS FIRST; FIRST 0 takes one at random. SECONDS 0 runs input FIRST alone.
int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: fuzz_search SECONDS FIRST");
  double const seconds = std::stod(argv[1]);
  unsigned long long first = std::stoull(argv[2]);
  if (first == 0) first = (static_cast<unsigned long long>(std::random_device()()) << 24) + 1;
  std::printf("first input %llu\n", first);
  std::fflush(stdout);
  std::signal(SIGABRT, [](int) { stop("aborted"); });
  std::signal(SIGALRM, [](int) { stop("hangs"); });
  auto const start = std::chrono::steady_clock::now();
  unsigned long long tries = 0;
  do run(first + tries++);
  while (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds);
  std::printf("%llu inputs, no violation\n", tries);
} catch (std::exception const& error) {
  std::fprintf(stderr, "fuzz: %s\n", error.what());
  stop("threw");
}
