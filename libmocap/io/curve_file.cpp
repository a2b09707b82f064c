#include "libmocap/io/curve_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "libmocap/base/error.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/io/svg_curve.hpp"
#include "libmocap/io/text_cursor.hpp"

namespace mocap::io {
namespace {

constexpr std::size_t kMostBytes = std::size_t{64} << 20;

// Cells of the line ahead, from the first character that is not blank on; the cursor ends up at the line's end. Where there is a comma it separates and blanks around it do not.
std::vector<std::string_view> cells_of_line(TextCursor& text) {
  std::vector<std::string_view> cells;
  const auto cell = [&] {
    const char* const first = text.p;
    while (!text.at_line_end() && !is_blank(*text.p) && *text.p != ',') ++text.p;
    cells.emplace_back(first, static_cast<std::size_t>(text.p - first));
    text.skip_blanks();
  };
  cell();
  while (!text.at_line_end()) {
    if (*text.p == ',') {
      ++text.p;
      text.skip_blanks();
    }
    cell();
  }
  return cells;
}

std::vector<Vector2> parse_csv(std::string_view bytes) {
  std::vector<Vector2> points;
  TextCursor text(bytes);
  bool first = true;
  for (text.skip_space(); !text.done(); text.skip_space()) {
    const auto fail = [&](const std::string& found) { refuse({{}, text.line, {}}, found + ", expected two numbers x,y in metres"); };
    if (*text.p == '#') {
      text.skip_to_line_end();
      continue;
    }
    const auto cells = cells_of_line(text);
    const bool header = first && cells.size() == 2 && same_ignoring_case(cells[0], "x") && same_ignoring_case(cells[1], "y");
    first = false;
    if (header) continue;
    Vector2 p(0, 0);
    for (std::size_t k = 0; k < cells.size(); ++k) {
      double v = 0;
      const char* const end = cells[k].data() + cells[k].size();
      if (read_number(cells[k].data(), end, v) != end) fail(cells[k].empty() ? "nothing beside a comma" : quoted(cells[k]));
      if (std::abs(v) > GroundCurve::kFarthest) refuse({{}, text.line, {}}, fmt::format("{}, expected metres within +-{:g}", quoted(cells[k]), GroundCurve::kFarthest));
      if (k < 2) p[static_cast<Eigen::Index>(k)] = v;
    }
    if (cells.size() != 2) fail(fmt::format("{} number{}", cells.size(), cells.size() == 1 ? "" : "s"));
    if (points.size() == kMostCurvePoints) refuse({{}, text.line, {}}, fmt::format("another point, expected at most {}", kMostCurvePoints));
    points.push_back(p);
  }
  return points;
}

void check(const CurveReadOptions& options) {
  const auto above_0 = [](const char* name, double v) {
    if (!(v > 0) || !std::isfinite(v)) refuse_usage(fmt::format("{} of {}, expected a finite number above 0", name, v));
  };
  above_0("a scale in metres per unit", options.metres_per_unit);
  above_0("a tolerance in metres", options.tolerance);
}

}  // namespace

long line_at(std::string_view text, std::size_t offset) {
  long line = 1;
  for (std::size_t i = 0; i < std::min(offset, text.size()); ++i)
    if (text[i] == '\n' || (text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n'))) ++line;
  return line;
}

std::string quoted(std::string_view piece) {
  std::string s = "'";
  for (const char c : piece.substr(0, 40)) s += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  return s + (piece.size() > 40 ? "...'" : "'");
}

GroundCurve parse_curve(std::string_view text, const CurveReadOptions& options) {
  check(options);
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) refuse({{}, 1, {}}, "UTF-16 text, expected UTF-8");
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  if (const std::size_t at = text.find('\0'); at != text.npos) refuse({{}, line_at(text, at), {}}, "a NUL byte, expected text");
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != text.npos && text[first] == '<') return GroundCurve(parse_svg_curve(text, options));
  if (!options.id.empty()) refuse({}, fmt::format("a table of points, expected SVG with the id {}", quoted(options.id)));
  return GroundCurve(parse_csv(text));
}

GroundCurve read_curve(const std::string& path, const CurveReadOptions& options, Digest* digest) {
  check(options);
  try {
    return parse_curve(read_file(path, kMostBytes, digest), options);
  } catch (const Error& e) {
    throw e.where().file.empty() ? e.in_file(path == "-" ? "<stdin>" : path) : e;
  }
}

std::string write_curve_csv(const GroundCurve& curve) {
  std::string out = "x,y\n";
  for (const Vector2& p : curve.points()) fmt::format_to(std::back_inserter(out), "{},{}\n", p.x(), p.y());
  return out;
}

}  // namespace mocap::io
