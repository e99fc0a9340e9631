// SPDX-License-Identifier: MIT
// Stands in for libFuzzer where the compiler has none: mutates a corpus at random, without coverage to guide it.
#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size);

namespace {

using bytes = std::string;

/// Fragments that break parsers of numbers, counts and lines more often than random bytes do.
constexpr std::array<std::string_view, 24> dictionary = {"nan",
                                                         "inf",
                                                         "-inf",
                                                         "1e999",
                                                         "1e-999",
                                                         "-0",
                                                         "0x1p3",
                                                         "3 3\n",
                                                         "\r",
                                                         "\r\n",
                                                         "\t",
                                                         "2000000000",
                                                         "18446744073709551616",
                                                         "-1",
                                                         "+",
                                                         "+-1",
                                                         ".",
                                                         "e",
                                                         "1e",
                                                         "0",
                                                         "\xEF\xBB\xBF",
                                                         "\x1b[",
                                                         "NaN(1)",
                                                         "1,5"};

class mutator {
 public:
  explicit mutator(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t n) { return n == 0 ? 0 : std::size_t(random_() % n); }

  bytes mutate(std::vector<bytes> const& corpus) {
    bytes text = corpus[below(corpus.size())];
    for (std::size_t n = 1 + below(4); n > 0; --n) {
      std::size_t const at = below(text.size() + 1);
      std::size_t const length = below(std::min<std::size_t>(text.size() - at, 64) + 1);
      switch (below(6)) {
        case 0:
          text.erase(at, length);
          break;
        case 1:
          text.resize(at);
          break;
        case 2:
          text.insert(at, dictionary[below(dictionary.size())]);
          break;
        case 3:
          text.replace(at, length, dictionary[below(dictionary.size())]);
          break;
        case 4:
          if (at < text.size()) text[at] = char(below(256));
          break;
        default: {
          bytes const& other = corpus[below(corpus.size())];
          std::size_t const from = below(other.size() + 1);
          text.insert(at, other, from, below(other.size() - from + 1));
        }
      }
    }
    return text;
  }

 private:
  std::mt19937_64 random_;
};

std::vector<bytes> read_corpus(std::filesystem::path const& path) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_directory(path))
    for (auto const& entry : std::filesystem::directory_iterator(path)) files.push_back(entry.path());
  else files.push_back(path);
  std::sort(files.begin(), files.end());
  std::vector<bytes> corpus;
  for (auto const& file : files) {
    std::ifstream stream(file, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
  return corpus;
}

/// What is being tried, of exactly its own length so that a sanitizer sees a read beyond the end.
std::vector<std::uint8_t> current;

[[noreturn]] void keep_current_and_exit(char const* why) {
  std::ofstream("crash.bpt", std::ios::binary)
      .write(reinterpret_cast<char const*>(current.data()), std::streamsize(current.size()));
  std::fprintf(stderr, "fuzz: %s; the input is in crash.bpt\n", why);
  std::_Exit(1);
}

void run(bytes const& input) {
  current = std::vector<std::uint8_t>(input.begin(), input.end());
  try {
    LLVMFuzzerTestOneInput(current.data(), current.size());
  } catch (std::exception const& error) {
    keep_current_and_exit(error.what());
  }
}

}  // namespace

/// usage: driver SECONDS SEED CORPUS...; SEED 0 takes one at random.
int main(int argc, char** argv) try {
  if (argc < 4) throw std::runtime_error("usage: driver SECONDS SEED CORPUS...");
  double const seconds = std::stod(argv[1]);
  std::uint64_t seed = std::stoull(argv[2]);
  if (seed == 0) seed = std::random_device()();
  std::vector<bytes> corpus{""};
  for (int i = 3; i < argc; ++i) std::ranges::move(read_corpus(argv[i]), std::back_inserter(corpus));
  std::printf("seed %llu, %zu inputs in the corpus\n", static_cast<unsigned long long>(seed), corpus.size());
  std::fflush(stdout);

  mutator random(seed);
  std::signal(SIGABRT, [](int) { keep_current_and_exit("aborted"); });
  auto const start = std::chrono::steady_clock::now();
  for (bytes const& input : corpus) run(input);
  std::uint64_t tries = corpus.size();
  for (; std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() < seconds; ++tries)
    run(random.mutate(corpus));
  std::printf("%llu inputs, no violation\n", static_cast<unsigned long long>(tries));
} catch (std::exception const& error) {
  std::fprintf(stderr, "fuzz: %s\n", error.what());
  return 1;
}
