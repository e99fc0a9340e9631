// SPDX-License-Identifier: MIT
// Any bytes are either a mesh of finite vertices and indices in range or one clear line of refusal, in memory that the bytes
// account for.
#include <support/load_mesh.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

namespace {

void expect(bool holds, char const* property) {
  if (holds) return;
  std::fprintf(stderr, "fuzz_obj: violated: %s\n", property);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  std::string_view const text(reinterpret_cast<char const*>(data), size);
  try {
    auto model = patchrt::examples::parse_obj(text, "fuzz.obj");
    expect(!model.vertices.empty() && !model.faces.empty(), "a model has a vertex and a face");
    expect(model.vertices.capacity() <= 2 * size && model.corners.capacity() <= 2 * size &&
               model.faces.capacity() <= 2 * size && model.tags.capacity() <= 2 * size,
           "memory is in proportion to the text");
    for (auto const& v : model.vertices)
      expect(std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z), "vertices are finite");
    for (auto const& face : model.faces) {
      expect(face.first + face.size <= model.corners.size(), "faces have their corners");
      for (auto const v : model.corners_of(face)) expect(v < model.vertices.size(), "corners are vertices");
    }
    std::size_t const corners = model.corners.size();
    auto const mesh = patchrt::examples::triangulate(std::move(model));
    expect(!mesh.triangles.empty() && mesh.triangles.size() <= corners, "a mesh has a triangle, none without a corner");
    for (auto const& t : mesh.triangles) {
      expect(t[0] != t[1] && t[1] != t[2] && t[2] != t[0], "triangles have three vertices");
      for (auto const v : t) expect(v < mesh.vertices.size(), "triangles are of the mesh's vertices");
    }
  } catch (std::runtime_error const& error) {
    std::string_view const message = error.what();
    expect(message.starts_with("fuzz.obj:"), "a refusal names the file");
    expect(message.find(": expected ") != message.npos && message.find(", got ") != message.npos,
           "a refusal says what was expected and what was there");
    expect(message.size() < 200, "a refusal is short");
    for (char const c : message) expect(c >= ' ' && c <= '~', "a refusal is one printable line");
  }
  return 0;
}
