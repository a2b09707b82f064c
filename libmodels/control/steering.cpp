#include "libmodels/control/steering.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/math/rotation.hpp"

namespace mocap::control {

namespace {

constexpr double kHalfWindow = 0.25, kSpeedTolerance = 0.15, kSpeedShare = 0.1, kHeadingTolerance = 0.2;

constexpr std::string_view kBetween = " \t,\r";

}  // namespace

std::optional<Command> parse_command(std::string_view line, const std::optional<Command>& last) {
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
  return Command{values[0], values[1], values[2] * std::numbers::pi / 180};
}

Steering::Steering(const MotionModel& model, const lstm_gmm::Sampler& sampler, Carried start, Terms terms, const SteeringSettings& settings, const PlanOptions& options)
    : terms_(std::move(terms)), settings_(settings), seconds_(static_cast<double>(options.window) / model.reference().frame_rate_hz), planner_(model, sampler, std::move(start), options) {}

Planned Steering::next(const Command& command) {
  const double now = planner_.now().heading, most = settings_.turn_limit * seconds_;
  Terms all = terms_;
  all.push_back(speed_term(command.speed, settings_.speed_sigma));
  all.push_back(direction_term(now + std::clamp(wrap_angle(command.heading - now), -most, most), settings_.direction_sigma));
  return planner_.next(all);
}

std::vector<Obeyed> obeyed(const Clip& clip, const std::vector<Command>& commands) {
  const std::size_t frames = clip.frames();
  const double rate = clip.frame_rate_hz;
  const auto half = std::max<std::size_t>(1, static_cast<std::size_t>(std::llround(kHalfWindow * rate)));
  std::vector<double> speed(frames), heading(frames), facing(frames);
  for (std::size_t t = 0; t < frames; ++t) {
    facing[t] = features::placement_of(clip, t).heading;
    if (t > 0) facing[t] = facing[t - 1] + wrap_angle(facing[t] - facing[t - 1]);
  }
  for (std::size_t t = 0; t < frames; ++t) {
    const std::size_t from = t > half ? t - half : 0, to = std::min(frames - 1, t + half);
    double way = 0, sum = 0;
    for (std::size_t i = from; i <= to; ++i) {
      if (i > from) way += (clip.root_position[i] - clip.root_position[i - 1]).head<2>().norm();
      sum += facing[i];
    }
    speed[t] = to > from ? way * rate / static_cast<double>(to - from) : 0;
    heading[t] = sum / static_cast<double>(to - from + 1);
  }
  std::vector<Obeyed> all;
  for (std::size_t k = 0; k < commands.size(); ++k) {
    const auto frame = [&](double time) { return std::min<std::size_t>(frames, static_cast<std::size_t>(std::llround(std::min(time * rate, 1e9)))); };
    const std::size_t first = frame(commands[k].time), last = k + 1 < commands.size() ? frame(commands[k + 1].time) : frames;
    Obeyed o;
    // Half a window of the next command would be seen from the last frames.
    const std::size_t end = last > first + half && k + 1 < commands.size() ? last - half : last;
    std::size_t settled = end;
    for (std::size_t t = end; t-- > first;) {
      const bool close = std::abs(speed[t] - commands[k].speed) <= std::max(kSpeedTolerance, kSpeedShare * commands[k].speed) && std::abs(wrap_angle(heading[t] - commands[k].heading)) <= kHeadingTolerance;
      if (!close) break;
      settled = t;
    }
    if (settled < end) o.settled_s = static_cast<double>(settled - first) / rate;
    if (end > first) {
      o.speed = speed[end - 1];
      o.heading = wrap_angle(heading[end - 1]);
    }
    all.push_back(o);
  }
  return all;
}

}  // namespace mocap::control
