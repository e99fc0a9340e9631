// SPDX-License-Identifier: MIT
#pragma once

#include <unistd.h>
#include <cstdio>
#include <string>

namespace patchrt::examples {

/// How much is done, on the standard error output where that is a terminal; nothing elsewhere.
class progress_bar {
 public:
  explicit progress_bar(bool wanted) : shown_(wanted && isatty(STDERR_FILENO)) {}
  progress_bar(progress_bar const&) = delete;
  progress_bar& operator=(progress_bar const&) = delete;
  /// The line is cleared: what comes next starts at its beginning.
  ~progress_bar() {
    if (shown_) std::fputs("\r\x1b[K", stderr);
  }

  /// \pre 0 <= part <= 1
  void update(double part) {
    if (!shown_) return;
    constexpr int width = 40;
    int const done = int(part * width);
    std::fprintf(stderr, "\r[%s%s] %3d %%", std::string(std::size_t(done), '#').c_str(),
                 std::string(std::size_t(width - done), '.').c_str(), int(part * 100));
    std::fflush(stderr);
  }

 private:
  bool shown_;
};

}  // namespace patchrt::examples
