// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// How the test programs call a kernel, whichever build of it: host compilers' and translated PTX export the
/// same function.

#include <cstddef>
#include <span>

namespace patchrt::test {

/// Bytes that a kernel may read and, where `writable`, write.
struct memory_range {
  void const* begin;
  void const* end;
  bool writable;
};

/// A one-dimensional launch. `arguments[k]` points at the kernel's k-th parameter.
struct launch_request {
  unsigned blocks;
  unsigned threads_per_block;
  void const* const* arguments;
  std::span<memory_range const> memory;
};

/// What a build exports under the name of each kernel.
using entry_point = void (*)(launch_request const&);

}  // namespace patchrt::test
