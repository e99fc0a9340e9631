// SPDX-License-Identifier: MIT
#pragma once

#include "image.hpp"
#include "text.hpp"

#include <patchrt/core/vec.hpp>

#include <CLI/CLI.hpp>

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace patchrt::examples {

/// What every program asks: the model, how exactly, with how many threads.
struct trace_options {
  std::string model;
  std::string accuracy = "refined";
  int threads = 0;  ///< 0 leaves the number to OpenMP.
};

void add_model_and_threads(CLI::App& app, trace_options& options);
void add_accuracy(CLI::App& app, trace_options& options);

/// "X,Y,Z", finite.
std::optional<vec3<double>> parse_vector(std::string_view text);
/// "WxH", 1 to 65536 a side and 2^28 pixels at most.
std::optional<image_size> parse_size(std::string_view text);
inline constexpr char const* size_expected = "WIDTHxHEIGHT, 1 to 65536 a side and 2^28 pixels at most";
/// Degrees above 0 and below 180.
std::optional<double> parse_field_of_view(std::string_view text);

/// An integer from 1 to `most`.
template <int most> std::optional<int> parse_count(std::string_view text) {
  auto const n = to_number<int>(text);
  return n && 1 <= *n && *n <= most ? n : std::nullopt;
}

/// Adds an option whose text `parse` turns into `value`; text that it returns nothing for is refused as
/// "NAME: expected EXPECTED, got 'TEXT'".
template <class T, class V>
CLI::Option* add_parsed(CLI::App& app, std::string const& name, V& value, std::optional<T> (*parse)(std::string_view),
                        std::string const& expected, std::string const& description) {
  return app.add_option_function<std::string>(
      name,
      [=, &value](std::string const& text) {
        std::optional<T> const parsed = parse(text);
        if (!parsed) throw CLI::ValidationError(name, "expected " + expected + ", got " + in_quotes(text));
        value = *parsed;
      },
      description);
}

/// Reads the command line into what `app`'s options write to, then runs `body`.
/// \return 0; or 1 after one line "PROGRAM: what is wrong" on the standard error output.
int run_program(CLI::App& app, int argc, char const* const* argv, std::function<void()> const& body);

}  // namespace patchrt::examples
