#include "libmocap/formats/labels.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/base/text_lines.hpp"
#include "libmocap/formats/table_cells.hpp"

namespace mocap::formats {
namespace {

namespace fs = std::filesystem;

std::string stem_of(const std::string& name) {
  fs::path p = fs::path(name).filename();
  if (p.extension() == ".gz") p = p.stem();
  return p.stem().string();
}

}  // namespace

Labels Labels::read(const std::string& path) {
  Labels labels;
  labels.folder_ = fs::path(path).parent_path().string();
  Digest digest{};
  const auto lines = read_lines(path, &digest);
  labels.sha256_ = to_hex(digest);
  std::vector<std::string> header;
  std::size_t file = 0, start = ~std::size_t{0}, end = start;
  for (const auto& [number, line] : lines) {
    const auto cells = split_cells(line);
    if (header.empty()) {
      header = cells;
      const auto column = [&](const char* name) {
        for (std::size_t c = 0; c < header.size(); ++c)
          if (header[c] == name) return c;
        return ~std::size_t{0};
      };
      file = column("file");
      start = column("start");
      end = column("end");
      if (file == ~std::size_t{0}) refuse({path, number, {}}, "a header without a column 'file', expected tab-separated names with 'file' among them");
      for (std::size_t c = 0; c < header.size(); ++c)
        if (c != file && c != start && c != end) labels.attributes_.push_back(header[c]);
      continue;
    }
    if (cells.size() != header.size())
      refuse({path, number, {}}, std::to_string(cells.size()) + " columns, expected " + std::to_string(header.size()) + " as in the header");
    Row row;
    for (std::size_t c = 0; c < header.size(); ++c) {
      if (c == start || c == end) {
        if (!cells[c].empty()) (c == start ? row.start_s : row.end_s) = parse_seconds(cells[c], {path, number, header[c]});
      } else if (c != file && !cells[c].empty()) {
        row.attributes[header[c]] = cells[c];
      }
    }
    if (row.start_s && row.end_s && *row.end_s <= *row.start_s) refuse({path, number, {}}, "an end that is not after the start");
    auto& rows = labels.rows_[cells[file]];
    const bool timed = row.start_s || row.end_s;
    if (!rows.empty() && (!timed || (!rows[0].start_s && !rows[0].end_s)))
      refuse({path, number, {}}, cells[file] + " is labelled twice, expected start and end times on both rows");
    if (rows.empty()) {
      auto& known = labels.by_stem_[stem_of(cells[file])];
      known = known.empty() ? cells[file] : std::string();
    }
    rows.push_back(std::move(row));
  }
  if (header.empty()) refuse({path, 0, {}}, "an empty table, expected a header line with a column 'file'");
  return labels;
}

const std::vector<Labels::Row>& Labels::of(const std::string& path, const std::string& label) const {
  static const std::vector<Row> none;
  std::error_code ignored;
  const fs::path relative = fs::relative(fs::path(path), folder_.empty() ? fs::path(".") : fs::path(folder_), ignored);
  for (const std::string& name : {relative.string(), label})
    if (const auto it = rows_.find(name); it != rows_.end()) return it->second;
  if (const auto it = by_stem_.find(stem_of(label)); it != by_stem_.end() && !it->second.empty()) return rows_.at(it->second);
  return none;
}

void Labels::apply(Clip& clip, const std::string& path, const std::string& label) const {
  const auto& rows = of(path, label);
  if (rows.empty()) return;
  if (!rows[0].start_s && !rows[0].end_s) {
    for (const auto& [key, value] : rows[0].attributes) clip.attributes[key] = value;
    return;
  }
  // Times are the file's own; the clip may start later (a dropped calibration pose).
  const auto frame = [&](double s) {
    return std::clamp<std::int64_t>(std::llround((s - clip.source.start_s) * clip.frame_rate_hz), 0, static_cast<std::int64_t>(clip.frames()));
  };
  Attributes common = rows[0].attributes;
  for (const Row& row : rows) {
    const std::int64_t a = frame(row.start_s.value_or(0)), b = row.end_s ? frame(*row.end_s) : static_cast<std::int64_t>(clip.frames());
    if (a < b) clip.segments.push_back({a, b - a, row.attributes});
    std::erase_if(common, [&](const auto& item) {
      const auto it = row.attributes.find(item.first);
      return it == row.attributes.end() || it->second != item.second;
    });
  }
  for (const auto& [key, value] : common) clip.attributes[key] = value;
}

}  // namespace mocap::formats
