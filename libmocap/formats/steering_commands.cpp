#include "libmocap/formats/steering_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"

namespace mocap::formats {
namespace {

constexpr std::size_t kMostLine = 4096;
constexpr std::string_view kBetween = " \t,\r";

}  // namespace

std::optional<SteeringCommand> parse_steering_command(std::string_view line, const std::optional<SteeringCommand>& last) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; (at = line.find_first_not_of(kBetween, at)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBetween, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  if (words.empty() || words[0].starts_with('#')) return std::nullopt;
  constexpr const char* kExpected = "expected time, speed and heading: seconds, m/s, degrees";
  if (words.size() != 3) refuse({}, fmt::format("{} values, {}", words.size(), kExpected));
  double values[3];
  for (std::size_t i = 0; i < 3; ++i) {
    std::string_view word = words[i];
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(values[i])) refuse({}, fmt::format("'{}', {}", words[i], kExpected));
  }
  if (values[0] < 0) refuse({}, fmt::format("time {}, expected at least 0", words[0]));
  if (values[1] < 0) refuse({}, fmt::format("speed {}, expected at least 0", words[1]));
  if (std::abs(values[2]) > 1e6) refuse({}, fmt::format("heading {}, expected at most 1e6 degrees either way", words[2]));
  if (last && values[0] < last->time) refuse({}, fmt::format("time {}, expected at least that of the command before, {:g}", words[0], last->time));
  return SteeringCommand{values[0], values[1], values[2] * std::numbers::pi / 180};
}

SteeringCommandReader::SteeringCommandReader(const std::string& path, bool lenient) : label_(path == "-" ? "<stdin>" : path), lenient_(lenient), in_(path == "-" ? &std::cin : &file_) {
  if (path == "-") return;
  file_.open(path, std::ios::binary);
  if (!file_) refuse({label_, 0, {}}, "the file cannot be opened");
}

SteeringCommandReader::SteeringCommandReader(std::istream& in, std::string label, bool lenient) : label_(std::move(label)), lenient_(lenient), in_(&in) {}

std::optional<SteeringCommand> SteeringCommandReader::next() {
  std::string line;
  while (read(line)) {
    try {
      if (auto command = parse_steering_command(line, last_)) return last_ = command;
    } catch (const Error& e) {
      if (!lenient_) refuse({label_, number_, {}}, e.message());
      log::warn("{}:{}: {}: skipped", label_, number_, e.message());
      ++skipped_;
    }
  }
  return std::nullopt;
}

bool SteeringCommandReader::read(std::string& line) {
  line.clear();
  char c = 0;
  while (in_->get(c) && c != '\n') {
    if (line.size() == kMostLine) refuse({label_, number_ + 1, {}}, fmt::format("a line of more than {} bytes", kMostLine));
    line += c;
  }
  if (!*in_ && line.empty()) {
    if (in_->bad()) refuse({label_, 0, {}}, "reading failed");
    return false;
  }
  ++number_;
  hash_.update(line);
  if (*in_) hash_.update("\n");
  return true;
}

}  // namespace mocap::formats
