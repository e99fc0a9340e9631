// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// Runs one kernel in every build there is and compares the answers bit for bit.

#include <device/support/launch_request.hpp>
#include <support/catch.hpp>

#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>
#include <type_traits>
#include <vector>

namespace patchrt::test {

/// A program of kernels (core, patch, ...) as one compiler made it; from PTX where `is_ptx`.
struct build {
  std::string name;
  bool is_ptx;
  void* library;

  /// Throws std::runtime_error where the program has no such kernel.
  entry_point kernel(std::string const& name) const;
};

/// Every build of a program; the first is the host compiler's with the project's own flags.
std::vector<build> builds_of(std::string const& program);

/// The bytes of a buffer that kernels read.
template <class Buffer> memory_range readable(Buffer const& b) { return {b.data(), b.data() + b.size(), false}; }

/// Launches `kernel` for `count` items.
template <class Kernel>
void launch(entry_point entry, Kernel const& kernel, int count, std::vector<memory_range> const& memory) {
  static_assert(std::is_trivially_copyable_v<Kernel>);
  unsigned const threads = 128;
  void const* const arguments[] = {&kernel, &count};
  entry({(static_cast<unsigned>(count) + threads - 1) / threads, threads, arguments, memory});
}

/// The suffix of kernels over T: their names say which number type they may use.
template <class T> std::string suffix() { return sizeof(T) == 8 ? "_f64" : "_f32"; }

/// Whether a and b have the same bits. Any NaN equals any other: PTX does not say which it gives.
template <class T> bool same_bits(T a, T b) {
  using bits = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
  return std::bit_cast<bits>(a) == std::bit_cast<bits>(b) || (a != a && b != b);
}

/// Runs `make_kernel(T* out)`, launched as `name` of `program`, in every build and checks that all agree with the
/// first.
/// \return The first build's results: `count` times Kernel::outputs numbers.
template <class T, class MakeKernel>
std::vector<T> check_same_in_every_build(std::string const& program, std::string const& name, int count,
                                         std::vector<memory_range> const& inputs, MakeKernel make_kernel) {
  using kernel_type = decltype(make_kernel(static_cast<T*>(nullptr)));
  constexpr std::size_t outputs = kernel_type::outputs;
  auto const builds = builds_of(program);
  std::vector<T> expected;
  for (build const& b : builds) {
    std::vector<T> results(static_cast<std::size_t>(count) * outputs, T(-987654321));
    std::vector<memory_range> memory = inputs;
    memory.push_back({results.data(), results.data() + results.size(), true});
    launch(b.kernel(name), make_kernel(results.data()), count, memory);
    if (&b == &builds.front()) {
      expected = results;
      continue;
    }
    std::size_t differing = 0;
    std::string first;
    for (std::size_t k = 0; k < results.size(); ++k) {
      if (same_bits(expected[k], results[k])) continue;
      if (differing++ == 0) {
        char text[200];
        std::snprintf(text, sizeof text, "item %zu, output %zu: %a against %a", k / outputs, k % outputs,
                      static_cast<double>(results[k]), static_cast<double>(expected[k]));
        first = text;
      }
    }
    INFO(program << "/" << name << ": " << b.name << " against " << builds.front().name << ": " << differing << " of "
                 << results.size() << " numbers differ, first " << first);
    CHECK(differing == 0);
  }
  return expected;
}

}  // namespace patchrt::test
