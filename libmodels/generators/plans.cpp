#include "libmodels/generators/plans.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"

namespace mocap::generators {
namespace {

constexpr std::size_t kMostQuantiles = 10000;

std::string text(const Attributes& attributes) {
  std::string list;
  for (const auto& [name, value] : attributes) list += (list.empty() ? "" : " ") + name + "=" + value;
  return list;
}

std::string listed(const std::vector<std::string>& values) {
  std::string list;
  for (const auto& v : values) list += (list.empty() ? "" : ", ") + v;
  return list;
}
std::string listed(const std::map<std::string, std::vector<std::string>>& vocabulary) {
  if (vocabulary.empty()) return "none: it was trained without attributes";
  std::vector<std::string> names;
  for (const auto& [name, values] : vocabulary) names.push_back(name);
  return listed(names);
}

// Every combination that was trained on, or those of them that `attributes_given` (--attr) names. A schedule gives some from the start on: where no
// combination trained on has them, they replace the values of those that there are.
std::vector<Attributes> chosen_combinations(const Generator& generator, const std::vector<std::string>& attributes_given, const Attributes& given) {
  std::map<std::string, std::vector<std::string>> chosen;
  for (const auto& pair : attributes_given) {
    const auto equals = pair.find('=');
    if (equals == std::string::npos || equals == 0) refuse_usage("--attr " + pair + ", expected NAME=VALUE");
    const std::string key = pair.substr(0, equals), value = pair.substr(equals + 1);
    const auto known = generator.vocabulary().find(key);
    if (known == generator.vocabulary().end()) refuse_usage("--attr " + pair + ": the model knows no attribute '" + key + "', expected " + listed(generator.vocabulary()));
    if (std::find(known->second.begin(), known->second.end(), value) == known->second.end())
      refuse_usage("--attr " + pair + ": the model was not trained on '" + value + "', expected " + listed(known->second));
    if (given.contains(key)) refuse_usage("--attr " + pair + ": the schedule sets " + key + " from the start on, expected it from one of them");
    chosen[key].push_back(value);
  }
  const auto matching = [&](bool also_given) {
    std::vector<Attributes> all;
    for (const auto& combination : generator.combinations()) {
      const auto wanted = [&](const auto& item) {
        if (const auto at = given.find(item.first); at != given.end()) return !also_given || at->second == item.second;
        const auto it = chosen.find(item.first);
        return it == chosen.end() || std::find(it->second.begin(), it->second.end(), item.second) != it->second.end();
      };
      if (!std::all_of(combination.begin(), combination.end(), wanted)) continue;
      Attributes attributes = combination;
      for (const auto& [name, value] : given) attributes[name] = value;
      if (std::find(all.begin(), all.end(), attributes) == all.end()) all.push_back(std::move(attributes));
    }
    return all;
  };
  std::vector<Attributes> all = matching(true);
  if (all.empty() && !given.empty()) all = matching(false);
  if (all.empty()) {
    std::string list;
    for (const auto& combination : generator.combinations()) list += (list.empty() ? "" : "; ") + text(combination);
    refuse_usage("no motion with these attributes together was trained on, expected one of " + list);
  }
  return all;
}

}  // namespace

std::vector<Plan> attribute_plans(const Generator& generator, const std::vector<std::string>& attributes, std::int64_t frames) {
  std::vector<Plan> plans;
  for (auto& chosen : chosen_combinations(generator, attributes, {})) plans.push_back({{}, std::move(chosen), {}, frames});
  return plans;
}

std::vector<Plan> scheduled_plans(const Generator& generator, const std::vector<std::string>& attributes, std::optional<std::int64_t> frames_given, const formats::AttributeSchedules& schedules, const std::string& file) {
  const auto& vocabulary = generator.vocabulary();
  for (const auto& name : schedules.attributes())
    if (!vocabulary.contains(name)) refuse({file, schedules.header_line(), name}, "the model knows no attribute '" + name + "', expected " + listed(vocabulary));
  const std::int64_t step = generator.schedule_step();
  const double rate = generator.frame_rate_hz();
  std::vector<std::vector<Plan>> of_schedule;
  std::set<Attributes> warned;
  std::size_t most = 0;
  for (const auto& schedule : schedules.all()) {
    for (const auto& row : schedule.rows)
      for (const auto& [name, value] : row.attributes) {
        const auto& known = vocabulary.at(name);
        if (std::find(known.begin(), known.end(), value) == known.end()) refuse({file, row.line, name}, "the model was not trained on '" + value + "', expected " + listed(known));
      }
    const Attributes& given = schedule.rows[0].attributes;
    if (schedule.end_s && frames_given) refuse_usage("--frames and a schedule whose last row has an end, expected one of them");
    const double length = schedule.end_s ? std::round(*schedule.end_s * rate) : static_cast<double>(frames_given.value_or(generator.default_frames()));
    if (!(length >= 1 && length <= 1000000)) refuse({file, schedule.rows.back().line, "end"}, fmt::format("{} frames, expected between 1 and 1000000", length));
    const auto frames = static_cast<std::int64_t>(length);
    std::vector<std::int64_t> starts;
    for (const auto& row : schedule.rows) {
      if (row.start_s * rate >= length)
        refuse({file, row.line, "start"}, fmt::format("{} s, expected a time within the {} frames ({:.6g} s) of the motion", row.start_s, frames, length / rate), "--frames makes it longer, or an end in the last row");
      starts.push_back(std::llround(row.start_s * rate / static_cast<double>(step)) * step);
      if (starts.size() > 1 && starts.back() <= starts[starts.size() - 2])
        refuse({file, row.line, "start"}, fmt::format("{} s falls on the same word of the model as the row before, expected a step of {:.6g} s or more", row.start_s, static_cast<double>(step) / rate));
    }
    std::vector<Plan> plans;
    for (const Attributes& first : chosen_combinations(generator, attributes, given)) {
      Plan plan{schedule.clip.empty() ? "schedule" : schedule.clip, first, {}, frames};
      for (std::size_t k = 0; k < schedule.rows.size(); ++k) {
        Attributes now = first;
        for (const auto& [name, value] : schedule.rows[k].attributes) now[name] = value;
        const auto& trained = generator.combinations();
        if (std::find(trained.begin(), trained.end(), now) == trained.end() && warned.insert(now).second)
          log::warn("{}:{}: no motion with {} together was trained on: what the model makes of it is a guess", file, schedule.rows[k].line, text(now));
        if (k == 0)
          plan.attributes = now;
        else if (starts[k] < frames)
          plan.changes.push_back({starts[k], std::move(now)});
        else if (plans.empty())
          log::warn("{}:{}: {} s is less than half a word of the model before the motion's end: the row changes nothing", file, schedule.rows[k].line, schedule.rows[k].start_s);
      }
      plans.push_back(std::move(plan));
    }
    most = std::max(most, plans.size());
    of_schedule.push_back(std::move(plans));
  }
  std::vector<Plan> all;
  for (std::size_t k = 0; k < most; ++k)
    for (const auto& plans : of_schedule) all.push_back(plans[k % plans.size()]);
  return all;
}

std::vector<double> parse_quantiles(const std::string& text) {
  const std::string expected = "--quantiles " + text + ", expected FIRST:LAST:STEP or a number, above 0 and below 1";
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(':', begin), text.size());
    double value = 0;
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, value, std::chars_format::fixed);
    if (error != std::errc() || stop != text.data() + end || begin == end || !std::isfinite(value)) refuse_usage(expected);
    numbers.push_back(value);
    begin = end + 1;
  }
  if (numbers.size() == 1) numbers = {numbers[0], numbers[0], 1};
  if (numbers.size() != 3 || !(numbers[0] > 0 && numbers[1] < 1 && numbers[0] <= numbers[1] && numbers[2] > 0)) refuse_usage(expected);
  const double count = std::floor((numbers[1] - numbers[0]) / numbers[2] + 1e-9) + 1;
  if (count > static_cast<double>(kMostQuantiles)) refuse_usage(fmt::format("--quantiles {}: {} quantiles, expected at most {}", text, count, kMostQuantiles));
  std::vector<double> quantiles;
  for (double k = 0; k < count; ++k) quantiles.push_back(std::min(numbers[0] + k * numbers[2], numbers[1]));
  return quantiles;
}

}  // namespace mocap::generators
