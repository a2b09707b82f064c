#include "libmocap/formats/attribute_schedule.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/base/text_lines.hpp"
#include "libmocap/formats/table_cells.hpp"

namespace mocap::formats {
namespace {

constexpr double kSameTime = 1e-6;  // seconds

}  // namespace

AttributeSchedules AttributeSchedules::read(const std::string& path) {
  AttributeSchedules out;
  Digest digest{};
  const auto lines = read_lines(path, &digest);
  out.sha256_ = to_hex(digest);
  const std::string file = path == "-" ? "<stdin>" : path;
  std::vector<std::string> header;
  std::map<std::string, std::size_t> by_clip;
  for (const auto& [number, line] : lines) {
    if (line.starts_with('#')) continue;
    const auto cells = split_cells(line);
    if (header.empty()) {
      header = cells;
      out.header_line_ = number;
      for (std::size_t c = 0; c < header.size(); ++c) {
        if (std::count(header.begin(), header.end(), header[c]) > 1) refuse({file, number, {}}, "a header with two columns '" + header[c] + "'");
        if (header[c].empty()) refuse({file, number, {}}, "a header with a column without a name");
        if (header[c] != "start" && header[c] != "end" && header[c] != "clip") out.attributes_.push_back(header[c]);
      }
      if (std::find(header.begin(), header.end(), "start") == header.end())
        refuse({file, number, {}}, "a header without a column 'start', expected tab-separated names with 'start' among them");
      if (out.attributes_.empty()) refuse({file, number, {}}, "a header without a column for an attribute, expected one at least");
      continue;
    }
    if (cells.size() != header.size()) refuse({file, number, {}}, fmt::format("{} columns, expected {} as in the header", cells.size(), header.size()));
    std::map<std::string, std::string> row;
    for (std::size_t c = 0; c < header.size(); ++c) row[header[c]] = cells[c];
    const std::string clip = row.contains("clip") ? row["clip"] : std::string();
    if (row.contains("clip") && clip.empty()) refuse({file, number, "clip"}, "an empty name, expected that of the clip");
    const auto [at, fresh] = by_clip.emplace(clip, out.schedules_.size());
    if (fresh) out.schedules_.push_back({clip, {}, {}});
    AttributeSchedule& schedule = out.schedules_[at->second];
    ScheduleRow next;
    next.line = number;
    next.start_s = parse_seconds(row["start"], {file, number, "start"});
    if (fresh) {
      if (next.start_s > 0) refuse({file, number, {}}, fmt::format("a gap: the first row{} starts at {} s, expected 0", clip.empty() ? "" : " of " + clip, row["start"]));
    } else {
      const ScheduleRow& before = schedule.rows.back();
      if (next.start_s <= before.start_s) refuse({file, number, {}}, fmt::format("a start at {} s, expected one after the {} s of line {}", next.start_s, before.start_s, before.line));
      if (schedule.end_s && *schedule.end_s < next.start_s - kSameTime)
        refuse({file, number, {}}, fmt::format("a gap: a start at {} s, expected the {} s at which line {} ends", next.start_s, *schedule.end_s, before.line));
      if (schedule.end_s && *schedule.end_s > next.start_s + kSameTime)
        refuse({file, number, {}}, fmt::format("a start at {} s, before line {} ends at {} s", next.start_s, before.line, *schedule.end_s));
      next.attributes = before.attributes;
    }
    schedule.end_s.reset();
    if (row.contains("end") && !row["end"].empty()) {
      schedule.end_s = parse_seconds(row["end"], {file, number, "end"});
      if (*schedule.end_s <= next.start_s) refuse({file, number, {}}, "an end that is not after the start");
    }
    for (const auto& name : out.attributes_)
      if (!row[name].empty()) next.attributes[name] = row[name];
    schedule.rows.push_back(std::move(next));
  }
  if (header.empty()) refuse({file, 0, {}}, "an empty table, expected a header line with a column 'start'");
  if (out.schedules_.empty()) refuse({file, 0, {}}, "a table without rows, expected one that starts at 0");
  return out;
}

}  // namespace mocap::formats
