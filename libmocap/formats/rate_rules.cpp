#include "libmocap/formats/rate_rules.hpp"

#include <fmt/core.h>
#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/base/text_lines.hpp"
#include "libmocap/formats/motion_input.hpp"

namespace mocap::formats {
namespace {

std::optional<double> number(std::string_view text) {
  double v = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(v) || !(v > 0)) return std::nullopt;
  return v;
}

std::optional<double> rate_of(std::string_view cell) {
  const auto slash = cell.find('/');
  if (slash == std::string_view::npos) return number(cell);
  const auto above = number(cell.substr(0, slash)), below = number(cell.substr(slash + 1));
  if (!above || !below) return std::nullopt;
  // 1001/30000 is a frame time: nobody means a rate below one frame a second.
  const double rate = *above < *below ? *below / *above : *above / *below;
  return std::isfinite(rate) && rate > 0 ? std::optional(rate) : std::nullopt;
}

class WithRate final : public MotionInput {
 public:
  WithRate(std::unique_ptr<MotionInput> input, double rate_hz) : input_(std::move(input)), rate_hz_(rate_hz), notes_(input_->notes()) {
    if (input_->size() > 0) notes_.push_back(fmt::format("{} Hz by --fps-override, the file says {} Hz", rate_hz_, input_->read(0).frame_rate_hz));
  }
  std::string format() const override { return input_->format(); }
  std::size_t size() const override { return input_->size(); }
  Clip read(std::size_t i) const override {
    Clip clip = input_->read(i);
    const double ratio = rate_hz_ / clip.frame_rate_hz;
    // Of an archive's clip the source ran at another rate than the clip: both were wrong by the same factor.
    clip.source.frame_rate_hz = clip.source.frame_rate_hz == clip.frame_rate_hz ? rate_hz_ : clip.source.frame_rate_hz * ratio;
    clip.source.start_s /= ratio;
    clip.source.end_s /= ratio;
    clip.frame_rate_hz = rate_hz_;
    clip.contacts.clear();
    return clip;
  }
  std::string name(std::size_t i) const override { return input_->name(i); }
  Attributes attributes(std::size_t i) const override { return input_->attributes(i); }
  const History& history() const override { return input_->history(); }
  const std::vector<std::string>& notes() const override { return notes_; }
  std::vector<std::string> doubts() const override { return input_->doubts(); }
  std::vector<HistoryInput> companions() const override { return input_->companions(); }
  std::string sha256() const override { return input_->sha256(); }
  std::map<std::string, std::vector<std::string>> attribute_classes() const override { return input_->attribute_classes(); }

 private:
  std::unique_ptr<MotionInput> input_;
  double rate_hz_;
  std::vector<std::string> notes_;
};

}  // namespace

std::shared_ptr<const RateRules> RateRules::read(const std::string& path) {
  const std::shared_ptr<RateRules> rules(new RateRules);
  rules->path_ = path;
  Digest digest{};
  const auto lines = read_lines(path, &digest);
  rules->sha256_ = to_hex(digest);
  bool header = false;
  for (const auto& [number_of_line, line] : lines) {
    if (line.starts_with('#')) continue;
    const Where where{path, number_of_line, {}};
    const auto columns = std::count(line.begin(), line.end(), '\t') + 1;
    if (!header) {
      if (line != "pattern\trate") refuse(where, fmt::format("a header '{}', expected 'pattern' and 'rate' with a tab between them", line));
      header = true;
      continue;
    }
    if (columns != 2) refuse(where, fmt::format("{} columns, expected 2: pattern and rate", columns));
    const std::string pattern = line.substr(0, line.find('\t')), cell = line.substr(line.find('\t') + 1);
    if (pattern.empty()) refuse(where, "an empty pattern, expected a shell glob");
    const auto rate = rate_of(cell);
    if (!rate) refuse({path, number_of_line, "rate"}, fmt::format("'{}', expected a number above 0 or a fraction (30000/1001)", cell));
    rules->rules_.push_back({pattern, *rate, number_of_line});
  }
  if (!header) refuse({path, 0, {}}, "an empty table, expected a header line 'pattern' and 'rate'");
  if (rules->rules_.empty()) refuse({path, 0, {}}, "a header and no rule, expected at least one");
  rules->used_ = std::make_unique<std::atomic<bool>[]>(rules->rules_.size());
  return rules;
}

std::optional<double> RateRules::rate_for(const std::string& path, const std::string& label) const {
  for (std::size_t i = 0; i < rules_.size(); ++i) {
    const char* pattern = rules_[i].pattern.c_str();
    if (::fnmatch(pattern, label.c_str(), 0) != 0 && ::fnmatch(pattern, path.c_str(), 0) != 0) continue;
    used_[i] = true;
    return rules_[i].rate_hz;
  }
  return std::nullopt;
}

std::vector<RateRules::Rule> RateRules::unused() const {
  std::vector<Rule> out;
  for (std::size_t i = 0; i < rules_.size(); ++i)
    if (!used_[i]) out.push_back(rules_[i]);
  return out;
}

std::unique_ptr<MotionInput> with_rate(std::unique_ptr<MotionInput> input, double rate_hz) { return std::make_unique<WithRate>(std::move(input), rate_hz); }

}  // namespace mocap::formats
