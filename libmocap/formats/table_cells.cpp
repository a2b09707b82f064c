#include "libmocap/formats/table_cells.hpp"

#include <charconv>
#include <cmath>

namespace mocap::formats {

std::vector<std::string> split_cells(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == '\t')
      cells.emplace_back();
    else
      cells.back() += c;
  }
  return cells;
}

double parse_seconds(const std::string& cell, const Where& where) {
  double v = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), v);
  if (error != std::errc{} || end != cell.data() + cell.size() || !std::isfinite(v) || v < 0) refuse(where, "'" + cell + "', expected seconds");
  return v;
}

}  // namespace mocap::formats
