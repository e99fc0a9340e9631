// SPDX-License-Identifier: MIT
#include "model.hpp"

#include "file.hpp"
#include "text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace patchrt {

namespace {

using examples::in_quotes;
using examples::to_number;

/// The tokens of a text, one after the other, and where they are.
class tokens {
 public:
  tokens(std::string_view text, std::string_view name) : rest_(text), name_(name) {}

  /// The next token; empty at the end of the text.
  std::string_view next() {
    constexpr std::string_view white = " \t\r\n\v\f";
    std::size_t const start = std::min(rest_.find_first_not_of(white), rest_.size());
    line_ += std::count(rest_.begin(), rest_.begin() + std::ptrdiff_t(start), '\n');
    rest_.remove_prefix(start);
    std::string_view const token = rest_.substr(0, rest_.find_first_of(white));
    rest_.remove_prefix(token.size());
    return token;
  }
  std::size_t bytes_left() const { return rest_.size(); }

  [[noreturn]] void fail(std::string const& where, std::string const& expected, std::string_view got) const {
    throw std::runtime_error(std::string(name_) + ":" + std::to_string(line_) + ": " + where + "expected " + expected +
                             ", got " + (got.empty() ? "the end of the file" : in_quotes(got)));
  }

 private:
  std::string_view rest_;
  std::string_view name_;
  std::ptrdiff_t line_ = 1;
};

}  // namespace

std::vector<bicubic_patch<double>> parse_bpt(std::string_view text, std::string_view name) {
  tokens in(text, name);
  std::string_view token = in.next();
  auto const count = to_number<std::size_t>(token);
  if (!count || *count == 0) in.fail("", "the number of patches, 1 or more", token);

  constexpr std::size_t least_bytes_per_patch = 2 * (2 + 16 * 3);  // one digit and one separator a token
  std::vector<bicubic_patch<double>> patches;
  patches.reserve(std::min(*count, in.bytes_left() / least_bytes_per_patch));
  for (std::size_t k = 0; k < *count; ++k) {
    // Made only for a message: a model has half a million tokens.
    auto const where = [&] { return "patch " + std::to_string(k) + ": "; };
    for (char const* direction : {"u", "v"})
      if (token = in.next(); token != "3") in.fail(where(), std::string("degree 3 in ") + direction, token);
    bicubic_patch<double> patch;
    for (int point = 0; point < 16; ++point) {
      double xyz[3];
      for (int axis = 0; axis < 3; ++axis) {
        token = in.next();
        auto const value = to_number<double>(token);
        if (!value || !std::isfinite(*value))
          in.fail(where(),
                  std::string("a finite number for ") + "xyz"[axis] + " of control point " + std::to_string(point),
                  token);
        xyz[axis] = *value;
      }
      patch.control_points[point] = {xyz[0], xyz[1], xyz[2]};
    }
    patches.push_back(patch);
  }
  if (token = in.next(); !token.empty())
    in.fail("", "the end of the file after patch " + std::to_string(*count - 1), token);
  return patches;
}

std::vector<bicubic_patch<double>> load_bpt(std::filesystem::path const& file) {
  constexpr std::uintmax_t four_gib = std::uintmax_t(4) << 30;
  return parse_bpt(examples::read_file(file, four_gib), file.string());
}

std::string to_bpt(std::span<bicubic_patch<double> const> patches) {
  std::string text = std::to_string(patches.size()) + '\n';
  auto const append = [&](double x, char end) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, x).ptr) += end;
  };
  for (auto const& patch : patches) {
    text += "3 3\n";
    for (auto const& p : patch.control_points) {
      append(p.x, ' ');
      append(p.y, ' ');
      append(p.z, '\n');
    }
  }
  return text;
}

}  // namespace patchrt
