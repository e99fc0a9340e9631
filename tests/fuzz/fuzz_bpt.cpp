// SPDX-License-Identifier: MIT
// Any bytes are either a model of finite patches or one clear line of refusal, in memory that the bytes account for.
#include <support/model.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace {

void expect(bool holds, char const* property) {
  if (holds) return;
  std::fprintf(stderr, "fuzz_bpt: violated: %s\n", property);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  std::string_view const text(reinterpret_cast<char const*>(data), size);
  try {
    auto const patches = patchrt::parse_bpt(text, "fuzz.bpt");
    expect(!patches.empty(), "a model has a patch");
    expect(patches.capacity() <= size / 100 + 1, "memory is in proportion to the text");
    for (auto const& patch : patches)
      for (auto const& p : patch.control_points)
        expect(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z), "control points are finite");
  } catch (std::runtime_error const& error) {
    std::string_view const message = error.what();
    expect(message.starts_with("fuzz.bpt:"), "a refusal names the file");
    expect(message.find(": expected ") != message.npos && message.find(", got ") != message.npos,
           "a refusal says what was expected and what was there");
    expect(message.size() < 200, "a refusal is short");
    for (char const c : message) expect(c >= ' ' && c <= '~', "a refusal is one printable line");
  }
  return 0;
}
