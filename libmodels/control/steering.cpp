#include "libmodels/control/steering.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/math/rotation.hpp"

namespace mocap::control {

namespace {

constexpr double kHalfWindow = 0.25, kSpeedTolerance = 0.15, kSpeedShare = 0.1, kHeadingTolerance = 0.2;

}  // namespace

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
