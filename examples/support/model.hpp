// SPDX-License-Identifier: MIT
#pragma once

#include <patchrt/shapes/bezier_patch.hpp>

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace patchrt {

/// The patches of a model in the .bpt format, in file order.
///
/// The text is the number of patches, then for each patch its degrees `3 3` and 16 control points of three numbers, four
/// rows of four, row i along u and column j along v. Tokens are separated by white space of any kind. Patches that collapse
/// to a line or a point are legal.
/// \param  name The file's name for messages.
/// \return One patch or more, all coordinates finite. Memory grows with the text, never with the number it announces.
/// \throws std::runtime_error "NAME:LINE: patch K: expected ..., got ...", one line; lines count from 1, patches from 0 as
///         in hits.
std::vector<bicubic_patch<double>> parse_bpt(std::string_view text, std::string_view name);

/// `parse_bpt` of a file.
/// \throws std::runtime_error as `parse_bpt`, or "FILE: ..." for what cannot be read.
std::vector<bicubic_patch<double>> load_bpt(std::filesystem::path const& file);

/// The patches in the .bpt format; `parse_bpt` returns them bit for bit.
std::string to_bpt(std::span<bicubic_patch<double> const> patches);

}  // namespace patchrt
