// The points of a curve drawn in SVG (curve_file.hpp says which and how). Internal to libmocap/io.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/io/curve_file.hpp"

namespace mocap::io {

inline constexpr std::size_t kMostCurvePoints = 1'000'000;

// Points in order, metres; repeated ones are there as often as they were drawn. `text` without byte-order mark and NUL bytes.
std::vector<Vector2> parse_svg_curve(std::string_view text, const CurveReadOptions& options);

// The line, from 1, of the byte at `offset`: LF, CRLF and lone CR end lines.
long line_at(std::string_view text, std::size_t offset);

// A piece of a text as it may stand in a message: printable, quoted, at most 40 bytes.
std::string quoted(std::string_view piece);

}  // namespace mocap::io
