// Attributes over time for motion to be generated (sample --schedule).
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::formats {

struct ScheduleRow {
  double start_s = 0;
  Attributes attributes;  // all that are known from here on: the row's own, and those of the rows before that it leaves empty
  long line = 0;
};

struct AttributeSchedule {
  std::string clip;               // of the column `clip`; "" where there is none
  std::vector<ScheduleRow> rows;  // ascending, the first at 0
  std::optional<double> end_s;    // of the last row
};

// A table: tab-separated, a header line; a column `start` in seconds, any attribute columns, optional `end` in seconds and `clip`: the rows of one
// name are one schedule. An empty cell of an attribute keeps the value before. Blank lines and lines that start with # are skipped.
class AttributeSchedules {
 public:
  // Error(data) with file and line: no column `start` or no attribute, a column twice, a row of another width, a time that is none, a first row that
  // does not start at 0, starts that do not ascend, an end that is not after its start or is not the next row's start, no row at all.
  static AttributeSchedules read(const std::string& path);

  const std::vector<AttributeSchedule>& all() const { return schedules_; }  // in the order of the table
  const std::vector<std::string>& attributes() const { return attributes_; }
  const std::string& sha256() const { return sha256_; }
  long header_line() const { return header_line_; }

 private:
  std::vector<AttributeSchedule> schedules_;
  std::vector<std::string> attributes_;
  std::string sha256_;
  long header_line_ = 0;
};

}  // namespace mocap::formats
