// labels.tsv: attributes of files and of parts of files (contract/cli.md).
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::formats {

// Tab-separated, a header line; column `file` (a path relative to the table, or a stem), then any attribute columns;
// optional `start` and `end` in seconds: several rows of one file become segments. Blank lines are skipped.
class Labels {
 public:
  struct Row {
    std::optional<double> start_s, end_s;
    Attributes attributes;
  };

  // Error(data) with line: no `file` column, a row of another width, a time that is no finite number, end before start, a
  // file labelled twice without times.
  static Labels read(const std::string& path);

  // Rows of a file, found by its path below the table's folder, then by label, then by stem. Empty where it has none.
  const std::vector<Row>& of(const std::string& path, const std::string& label) const;
  const std::vector<std::string>& attributes() const { return attributes_; }
  std::size_t size() const { return rows_.size(); }
  const std::string& sha256() const { return sha256_; }

  // Puts the attributes on the clip: one row without times labels the whole clip; rows with times become segments (and an
  // attribute on which all of them agree labels the clip too).
  void apply(Clip& clip, const std::string& path, const std::string& label) const;

 private:
  std::string folder_, sha256_;
  std::vector<std::string> attributes_;
  std::map<std::string, std::vector<Row>> rows_;  // by the name given in the table
  std::map<std::string, std::string> by_stem_;    // stem -> name in the table; "" where several share it
};

}  // namespace mocap::formats
