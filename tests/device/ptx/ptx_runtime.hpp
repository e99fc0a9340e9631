// SPDX-License-Identifier: MIT
#pragma once

/// \file
/// What translated PTX runs on: threads one after another, one flat address space that is the host's, and a
/// check of every access (inside a buffer of the launch or a thread's own frame, aligned to its size, writable).

#include <device/ptx/ptx_operations.hpp>
#include <device/support/launch_request.hpp>

#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#define PTX_EXPORT __attribute__((visibility("default")))

namespace ptx {

struct index3 {
  u32 x = 0, y = 0, z = 0;
};

/// The memory that one launch may touch.
class memory_map {
 public:
  void add(patchrt::test::memory_range const& range) { ranges_.push_back(range); }
  void remove_last() {
    ranges_.pop_back();
    last_ = 0;
  }
  char const* read(u64 address, std::size_t size) { return check(address, size, false); }
  char* write(u64 address, std::size_t size) { return check(address, size, true); }

 private:
  char* check(u64 address, std::size_t size, bool writes) {
    if (address % size != 0) fail("misaligned", address, size);
    if (!inside(last_, address, size, writes)) {
      for (last_ = 0; !inside(last_, address, size, writes); ++last_)
        if (last_ >= ranges_.size()) fail(writes ? "out-of-range write" : "out-of-range read", address, size);
    }
    return reinterpret_cast<char*>(address);
  }
  bool inside(std::size_t i, u64 address, std::size_t size, bool writes) const {
    return i < ranges_.size() && address >= reinterpret_cast<u64>(ranges_[i].begin) &&
           address + size <= reinterpret_cast<u64>(ranges_[i].end) && (ranges_[i].writable || !writes);
  }
  [[noreturn]] static void fail(char const* what, u64 address, std::size_t size) {
    char text[80];
    std::snprintf(text, sizeof text, "PTX: %s of %zu bytes at %#llx", what, size,
                  static_cast<unsigned long long>(address));
    throw std::runtime_error(text);
  }

  std::vector<patchrt::test::memory_range> ranges_;
  std::size_t last_ = 0;  // where the previous access was: the next one is likely there too
};

struct thread {
  index3 thread_index, block_size, block_index, grid_size;
  memory_map* memory;
  u32 labels_passed = 0;

  /// Counts the labels that the thread runs over, so that an endless loop ends.
  void at_label() {
    if (++labels_passed > 5'000'000)
      throw std::runtime_error("PTX: endless loop in thread " + std::to_string(thread_index.x));
  }
};

/// A local array: part of the thread's memory while its function runs, full of NaN before it is written.
class local_frame {
 public:
  local_frame(thread& t, char* frame, std::size_t size) : thread_(t) {
    std::memset(frame, 0xff, size);
    t.memory->add({frame, frame + size, true});
  }
  ~local_frame() { thread_.memory->remove_last(); }
  local_frame(local_frame const&) = delete;
  local_frame& operator=(local_frame const&) = delete;

 private:
  thread& thread_;
};

/// Parameter space: the translator knows its layout, so its accesses need no check.
inline char* unchecked(u64 address) { return reinterpret_cast<char*>(address); }
inline u64 address_of(char const* p) { return reinterpret_cast<u64>(p); }

[[noreturn]] inline void throw_trap() { throw std::runtime_error("PTX: trap"); }
[[noreturn]] inline void throw_bad_branch() { throw std::runtime_error("PTX: branch index out of range"); }

/// Where a kernel's parameter lies in its parameter block.
struct parameter {
  std::size_t offset, size;
};

/// Runs body(thread, parameter block) for every thread of the launch.
template <class Body>
void run(patchrt::test::launch_request const& request, parameter const* layout, std::size_t parameter_count,
         std::vector<patchrt::test::memory_range> const& module_memory, Body body) {
  std::vector<u64> block;
  for (std::size_t k = 0; k < parameter_count; ++k) {
    block.resize((layout[k].offset + layout[k].size + 7) / 8);
    std::memcpy(reinterpret_cast<char*>(block.data()) + layout[k].offset, request.arguments[k], layout[k].size);
  }
  memory_map memory;
  for (auto const& range : request.memory) memory.add(range);
  for (auto const& range : module_memory) memory.add(range);
  memory.add({block.data(), block.data() + block.size(), false});
  for (u32 b = 0; b < request.blocks; ++b) {
    for (u32 i = 0; i < request.threads_per_block; ++i) {
      thread t{{i, 0, 0}, {request.threads_per_block, 1, 1}, {b, 0, 0}, {request.blocks, 1, 1}, &memory, 0};
      body(t, reinterpret_cast<char*>(block.data()));
    }
  }
}

}  // namespace ptx
