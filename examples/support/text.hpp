// SPDX-License-Identifier: MIT
#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>

namespace patchrt::examples {

/// All of `text` as a decimal number, whatever the locale; nothing where it is something else or out of T's range.
/// NaN and infinities are numbers here.
template <class T>
requires std::integral<T> || std::floating_point<T> std::optional<T> to_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// `text` between quotes for an error message: cut where long, other bytes than printable ASCII as '?'.
std::string in_quotes(std::string_view text);

}  // namespace patchrt::examples
