// SPDX-License-Identifier: MIT
#define TINYOBJLOADER_IMPLEMENTATION
#include "obj.hpp"

#include "file.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <istream>
#include <limits>
#include <stdexcept>
#include <streambuf>

namespace patchrt::examples {

namespace {

/// The words of a line, one after the other; empty at its end.
class words {
 public:
  explicit words(std::string_view line) : rest_(line) {}

  std::string_view next() {
    constexpr std::string_view white = " \t";
    rest_.remove_prefix(std::min(rest_.find_first_not_of(white), rest_.size()));
    std::string_view const word = rest_.substr(0, rest_.find_first_of(white));
    rest_.remove_prefix(word.size());
    return word;
  }

 private:
  std::string_view rest_;
};

/// Hands a text to tinyobjloader line by line, so that whoever it calls back knows the line.
///
/// tinyobjloader finds the statements. It reads words that are no numbers as 0, decimals to within a few ulp, integers modulo
/// 2^32, and passes over what it does not know; so numbers are read anew from the line, and what it calls back for is held
/// against that.
class reader : public std::streambuf {
 public:
  reader(std::string_view text, obj_model& model) : rest_(text), model_(model) {}

  void read() {
    tinyobj::callback_t callbacks;
    callbacks.vertex_cb = [](void* self, auto...) { static_cast<reader*>(self)->add_vertex(); };
    callbacks.index_cb = [](void* self, tinyobj::index_t* indices, int count) {
      static_cast<reader*>(self)->add_face({indices, std::size_t(count)});
    };
    std::istream stream(this);
    stream.exceptions(std::ios::badbit);  // what is thrown here passes through the stream
    tinyobj::LoadObjWithCallback(stream, callbacks, this);
    check_indices();
  }

 protected:
  int_type underflow() override {
    if (must_be_called_back_) fail("a statement of OBJ", current_);
    if (rest_.empty()) return traits_type::eof();
    std::size_t const end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    current_ = rest_.substr(0, end);
    std::size_t const past = rest_.substr(end, 2) == "\r\n" ? end + 2 : std::min(end + 1, rest_.size());
    rest_.remove_prefix(past);
    ++line_;
    begin_line();
    buffer_.assign(current_);
    buffer_ += '\n';
    setg(buffer_.data(), buffer_.data(), buffer_.data() + buffer_.size());
    return traits_type::to_int_type(buffer_.front());
  }

 private:
  [[noreturn]] void fail(std::size_t line, std::string const& expected, std::string const& got) const {
    throw std::runtime_error(model_.name + ":" + std::to_string(line) + ": expected " + expected + ", got " + got);
  }
  [[noreturn]] void fail(std::string const& expected, std::string_view got) const {
    fail(line_, expected, got.empty() ? "the end of the line" : in_quotes(got));
  }

  void begin_line() {
    words in(current_);
    std::string_view const keyword = in.next();
    constexpr std::array<std::string_view, 10> passed_over = {"vn", "vt", "vp", "vw",     "g",
                                                              "o",  "s",  "mg", "usemtl", "mtllib"};
    if (keyword.empty() || keyword.front() == '#') return;
    if (keyword == "v") {
      must_be_called_back_ = true;
    } else if (keyword == "f") {
      if (in.next().empty()) model_.faces.push_back({model_.corners.size(), 0, line_});
      else must_be_called_back_ = true;
    } else if (keyword == "t") {
      add_tag(in);
    } else if (std::find(passed_over.begin(), passed_over.end(), keyword) == passed_over.end()) {
      if (model_.other_statements++ == 0) model_.first_other_line = line_;
    }
  }

  void add_vertex() {
    must_be_called_back_ = false;
    words in(current_);
    in.next();
    vec3<double> v;
    for (int axis = 0; axis < 3; ++axis) {
      std::string_view const word = in.next();
      auto const value = to_number<double>(word);
      if (!value || !std::isfinite(*value)) fail(std::string("a finite number for ") + "xyz"[axis], word);
      v[axis] = *value;
    }
    if (model_.vertices.size() == std::numeric_limits<std::int32_t>::max()) fail("at most 2^31 - 1 vertices", current_);
    model_.vertices.push_back(v);
  }

  void add_face(std::span<tinyobj::index_t const> indices) {
    must_be_called_back_ = false;
    words in(current_);
    in.next();
    obj_face const face{model_.corners.size(), indices.size(), line_};
    auto const count = std::int64_t(model_.vertices.size());
    for (auto const& index : indices) {
      std::string_view const word = in.next();
      auto const number = to_number<std::int32_t>(word.substr(0, word.find('/')));
      if (!number || *number != index.vertex_index || *number == 0)
        fail("an index of a vertex, from 1 on or negative", word);
      if (*number < -count)
        fail("an index of one of the " + std::to_string(count) + " vertices before this line", word);
      model_.corners.push_back(std::uint32_t(*number > 0 ? *number - 1 : count + *number));
    }
    if (std::string_view const word = in.next(); !word.empty()) fail("the end of the line", word);
    model_.faces.push_back(face);
  }

  void add_tag(words& in) {
    obj_tag tag{std::string(in.next()), {}, {}, {}, line_};
    if (tag.name.empty()) fail("the name of a tag", {});
    std::string_view const three_counts = in.next();
    std::string_view counts = three_counts;
    std::array<std::size_t, 3> number_of;
    for (std::size_t k = 0; k < 3; ++k) {
      std::size_t const end = k < 2 ? counts.find('/') : counts.size();
      auto const n = end == counts.npos ? std::nullopt : to_number<std::size_t>(counts.substr(0, end));
      if (!n) fail("the numbers of integers, reals and words as I/R/S", three_counts);
      number_of[k] = *n;
      counts.remove_prefix(std::min(end + 1, counts.size()));
    }
    for (std::size_t k = 0; k < number_of[0]; ++k) {
      std::string_view const word = in.next();
      auto const value = to_number<std::int64_t>(word);
      if (!value) fail("an integer of the tag " + in_quotes(tag.name), word);
      tag.integers.push_back(*value);
    }
    for (std::size_t k = 0; k < number_of[1]; ++k) {
      std::string_view const word = in.next();
      auto const value = to_number<double>(word);
      if (!value || !std::isfinite(*value)) fail("a finite number of the tag " + in_quotes(tag.name), word);
      tag.reals.push_back(*value);
    }
    for (std::size_t k = 0; k < number_of[2]; ++k) {
      std::string_view const word = in.next();
      if (word.empty()) fail("a word of the tag " + in_quotes(tag.name), word);
      tag.words.emplace_back(word);
    }
    if (std::string_view const word = in.next(); !word.empty()) fail("the end of the line", word);
    model_.tags.push_back(tag);
  }

  void check_indices() {
    if (model_.vertices.empty()) fail(line_, "a vertex", "the end of the file");
    if (model_.faces.empty()) fail(line_, "a face", "the end of the file");
    for (auto const& face : model_.faces)
      for (std::uint32_t const v : model_.corners_of(face))
        if (v >= model_.vertices.size())
          fail(face.line, "an index of one of the " + std::to_string(model_.vertices.size()) + " vertices",
               std::to_string(v + 1));
  }

  std::string_view rest_;
  std::string_view current_;
  std::string buffer_;
  std::size_t line_ = 0;
  bool must_be_called_back_ = false;
  obj_model& model_;
};

}  // namespace

obj_model parse_obj(std::string_view text, std::string_view name) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  obj_model model;
  model.name = name;
  reader(text, model).read();
  return model;
}

obj_model load_obj(std::filesystem::path const& file) {
  constexpr std::uintmax_t four_gib = std::uintmax_t(4) << 30;
  return parse_obj(read_file(file, four_gib), file.string());
}

std::string describe_ignored(obj_model const& model) {
  if (model.other_statements == 0) return {};
  return "statements that are neither vertices nor faces: " + std::to_string(model.other_statements) +
         " ignored, the first in line " + std::to_string(model.first_other_line);
}

}  // namespace patchrt::examples
