// SPDX-License-Identifier: MIT
#include "command_line.hpp"

#include "tracing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <iostream>
#include <new>
#include <stdexcept>
#include <vector>

namespace patchrt::examples {

void add_model_and_threads(CLI::App& app, trace_options& options) {
  app.add_option("MODEL", options.model,
                 "Bicubic Bezier patches as .bpt: their number, then for each 3 3 and 16 points")
      ->required();
  add_parsed(app, "--threads", options.threads, parse_count<1024>, "a number of threads from 1 to 1024",
             "Threads; by default as many as there are processors")
      ->type_name("N");
}

void add_accuracy(CLI::App& app, trace_options& options) {
  std::vector<std::string> names;
  for (accuracy const level : accuracy_levels) names.emplace_back(name_of(level));
  app.add_option("--accuracy", options.accuracy, "fast = float; refined = corrected in double; reference = the paper's")
      ->check(CLI::IsMember(names))
      ->capture_default_str()
      ->type_name("LEVEL");
}

std::optional<vec3<double>> parse_vector(std::string_view text) {
  vec3<double> v;
  for (int axis = 0; axis < 3; ++axis) {
    std::size_t const end = axis < 2 ? text.find(',') : text.size();
    if (end == text.npos) return std::nullopt;
    auto const x = to_number<double>(text.substr(0, end));
    if (!x || !std::isfinite(*x)) return std::nullopt;
    v[axis] = *x;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return v;
}

std::optional<image_size> parse_size(std::string_view text) {
  std::size_t const cross = text.find('x');
  if (cross == text.npos) return std::nullopt;
  auto const width = parse_count<65536>(text.substr(0, cross));
  auto const height = parse_count<65536>(text.substr(cross + 1));
  if (!width || !height || std::int64_t(*width) * *height > 1 << 28) return std::nullopt;
  return image_size{*width, *height};
}

std::optional<double> parse_field_of_view(std::string_view text) {
  auto const degrees = to_number<double>(text);
  return degrees && 0 < *degrees && *degrees < 180 ? degrees : std::nullopt;
}

int run_program(CLI::App& app, int argc, char const* const* argv, std::function<void()> const& body) {
  std::string wrong;
  try {
    app.parse(argc, argv);
    body();
    if (!std::cout.flush()) throw std::runtime_error("the standard output cannot be written");
    return 0;
  } catch (CLI::Success const& help) {
    return app.exit(help);
  } catch (std::bad_alloc const&) {
    wrong = "out of memory";
  } catch (std::exception const& error) {
    wrong = error.what();
    std::replace(wrong.begin(), wrong.end(), '\n', ' ');
  }
  std::cerr << app.get_name() << ": " << wrong << '\n';
  return 1;
}

}  // namespace patchrt::examples
