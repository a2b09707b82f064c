// Frame rates for files that state a wrong one (--fps-override).
#pragma once
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace mocap::formats {

class MotionInput;

// A table: tab-separated, the header line `pattern<TAB>rate`, then one rule a line; blank lines and lines that start with #
// are skipped. A pattern is a shell glob (fnmatch(3); `*` crosses `/`), held against a file's label and its path as typed;
// the first rule that fits decides. A rate is a number of Hz above 0, or a fraction: 30000/1001 Hz. A fraction below 1 whose
// frame time is meant, 1001/30000, is the same rate.
class RateRules {
 public:
  struct Rule {
    std::string pattern;
    double rate_hz = 0;
    long line = 0;
  };

  // Error(data) with file and line: another header, a row of other than two columns, an empty pattern, a rate that is none,
  // no rule at all.
  static std::shared_ptr<const RateRules> read(const std::string& path);

  // The rate of the first rule that fits, in Hz; the rule counts as used. Thread-safe.
  std::optional<double> rate_for(const std::string& path, const std::string& label) const;
  // Rules that have set no file's rate so far: a mistyped pattern, or one behind another that fits all it fits.
  std::vector<Rule> unused() const;

  const std::string& path() const { return path_; }
  const std::string& sha256() const { return sha256_; }

 private:
  RateRules() = default;
  std::string path_, sha256_;
  std::vector<Rule> rules_;
  std::unique_ptr<std::atomic<bool>[]> used_;
};

// The input with its clips at `rate_hz`: frames as they are, source times and the source's rate rescaled, contacts (labelled
// at the wrong speed) left out, and a note of what the file says itself.
std::unique_ptr<MotionInput> with_rate(std::unique_ptr<MotionInput> input, double rate_hz);

}  // namespace mocap::formats
