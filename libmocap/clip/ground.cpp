#include "libmocap/clip/ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/rest_pose.hpp"

namespace mocap {
namespace {

constexpr double kBelowSoles = 0.15, kFleshUnderJoint = 0.05;  // metres

struct FootTrack {  // one point of one foot over time
  std::vector<Vector3> position;
  double sole_height = 0;  // of the joint above the sole

  double height(std::size_t t) const { return position[t].z() - sole_height; }
  // The slower of the steps to either side: a foot that stands for four frames between two flights is still in all four.
  double speed(std::size_t t, double rate_hz) const {
    double slowest = std::numeric_limits<double>::infinity();
    if (t > 0) slowest = std::min(slowest, (position[t] - position[t - 1]).norm());
    if (t + 1 < position.size()) slowest = std::min(slowest, (position[t + 1] - position[t]).norm());
    return std::isfinite(slowest) ? slowest * rate_hz : 0;
  }
};

// [0] left toe base, [1] right toe base, [2] left ankle, [3] right ankle; empty where the role is missing.
// `lowest`, if given, gets the height of the lowest joint of the body in each frame: of those with a role, for props and references are none of it.
std::array<FootTrack, 4> foot_tracks(const Clip& clip, std::vector<double>* lowest = nullptr) {
  std::array<FootTrack, 4> tracks;
  const std::array<int, 4> joint = {clip.skeleton->find_role("left_foot"), clip.skeleton->find_role("right_foot"), clip.skeleton->find_role("left_ankle"),
                                    clip.skeleton->find_role("right_ankle")};
  std::vector<std::size_t> body;
  for (const auto& [role, name] : clip.skeleton->roles)
    if (const int j = clip.skeleton->find(name); j >= 0) body.push_back(static_cast<std::size_t>(j));
  Pose pose;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    if (lowest) {
      double low = std::numeric_limits<double>::infinity();
      for (const std::size_t j : body) low = std::min(low, pose.positions[j].z());
      lowest->push_back(low);
    }
    for (std::size_t k = 0; k < 4; ++k)
      if (joint[k] >= 0) tracks[k].position.push_back(pose.positions[static_cast<std::size_t>(joint[k])]);
  }
  const SoleHeights sole = sole_heights(*clip.skeleton);
  for (std::size_t k = 0; k < 4; ++k) tracks[k].sole_height = k < 2 ? sole.toe : sole.ankle;
  return tracks;
}

// Of weighted values, interpolated between them: a value or weight that moves a little moves it a little.
double quantile(std::vector<std::pair<double, double>> values, double p) {
  std::sort(values.begin(), values.end());
  double total = 0, below = 0;
  for (const auto& [value, weight] : values) total += weight;
  // Each value stands at the middle of its weight.
  double last_at = 0, last = values.front().first;
  for (const auto& [value, weight] : values) {
    const double at = (below + weight / 2) / total;
    if (at >= p) return at > last_at ? last + (value - last) * (p - last_at) / (at - last_at) : value;
    below += weight;
    last_at = at;
    last = value;
  }
  return last;
}

// Turns runs of `value` shorter than `least` into the other value; runs at the ends stay.
void drop_short_runs(std::vector<std::array<std::uint8_t, 2>>& labels, std::size_t foot, std::uint8_t value, std::size_t least) {
  std::size_t start = 0;
  for (std::size_t t = 1; t <= labels.size(); ++t) {
    if (t < labels.size() && labels[t][foot] == labels[start][foot]) continue;
    if (labels[start][foot] == value && t - start < least && start > 0 && t < labels.size())
      for (std::size_t u = start; u < t; ++u) labels[u][foot] = static_cast<std::uint8_t>(1 - value);
    start = t;
  }
}

}  // namespace

double floor_height(const Clip& clip) {
  std::vector<double> lowest;
  const auto tracks = foot_tracks(clip, &lowest);
  std::vector<std::pair<double, double>> slow, all;  // height, weight
  double weights = 0;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    double low = std::numeric_limits<double>::infinity(), speed = 0;
    for (const auto& track : tracks)
      if (!track.position.empty() && track.height(t) < low) {
        low = track.height(t);
        speed = track.speed(t, clip.frame_rate_hz);
      }
    if (!std::isfinite(low)) return 0;
    all.emplace_back(low, 1);
    const double weight = std::clamp((0.30 - speed) / 0.10, 0.0, 1.0);
    if (weight > 0) slow.emplace_back(low, weight);
    weights += weight;
  }
  if (all.empty()) return 0;
  const double floor = weights >= 5 ? quantile(std::move(slow), 0.25) : quantile(std::move(all), 0.05);
  // Who stands on the hands or lies with the feet up does not stand on the soles: most of the time something is well below them.
  std::sort(lowest.begin(), lowest.end());
  return lowest[lowest.size() / 2] < floor - kBelowSoles ? lowest[lowest.size() / 4] - kFleshUnderJoint : floor;
}

double set_on_ground(Clip& clip) {
  const double shift = -floor_height(clip);
  for (auto& p : clip.root_position) p.z() += shift;
  clip.source.origin.z() -= shift;
  return shift;
}

const std::vector<ContactPreset>& contact_presets() {
  constexpr double kAnyHeight = 1e9;
  static const std::vector<ContactPreset> presets = {
      {"default", 0.30, 0.05, 0.25, 0.1, true},
      {"holden", 0.757, 0.113, 0, 0, false},          // squared displacement < 0.05 units at 60 Hz, toe height 2 units
      {"lafan1", 0.042, kAnyHeight, 0, 0, false},     // squared displacement < 0.02 cm^2 at 30 Hz
      {"humanml3d", 0.894, kAnyHeight, 0, 0, false},  // squared displacement < 0.002 m^2 at 20 Hz
      {"humor", 0.15, 0.04, 0, 0, false},             // displacement < 0.005 m a frame, read at 30 Hz; toe height 4 cm
      {"motion-matching", 0.15, kAnyHeight, 0, 0.1, false},  // toe speed, then a 6-frame median at 60 Hz
  };
  return presets;
}

const ContactPreset& contact_preset(const std::string& name) {
  std::string known;
  for (const auto& p : contact_presets()) {
    if (p.name == name) return p;
    known += (known.empty() ? "" : ", ") + p.name;
  }
  throw Error(Exit::usage, {}, "contact preset '" + name + "', expected one of " + known);
}

std::vector<std::array<std::uint8_t, 2>> label_contacts(const Clip& clip, const ContactPreset& preset) {
  const auto tracks = foot_tracks(clip);
  if (tracks[0].position.empty() || tracks[1].position.empty()) return {};
  std::vector<std::array<std::uint8_t, 2>> labels(clip.frames(), {0, 0});
  for (std::size_t foot = 0; foot < 2; ++foot) {
    bool down = false;
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      const double factor = down ? 1 + preset.hysteresis : 1;
      const auto still = [&](const FootTrack& track) {
        return !track.position.empty() && track.speed(t, clip.frame_rate_hz) < factor * preset.speed_mps && track.height(t) < factor * preset.height_m;
      };
      down = still(tracks[foot]) || (preset.ankle && still(tracks[foot + 2]));
      labels[t][foot] = down;
    }
    const auto least = static_cast<std::size_t>(std::lround(preset.min_seconds * clip.frame_rate_hz));
    drop_short_runs(labels, foot, 0, least);
    drop_short_runs(labels, foot, 1, least);
  }
  return labels;
}

}  // namespace mocap
