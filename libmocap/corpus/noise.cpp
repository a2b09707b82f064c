#include "libmocap/corpus/noise.hpp"

#include <algorithm>
#include <cmath>

#include "libmocap/corpus/curves.hpp"

namespace mocap::corpus {
namespace {

Vector3 random_direction(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return Vector3(x, y, z).normalized();
}

// `rate` events a second on average.
std::size_t event_count(double rate, double seconds, Random& random) {
  return static_cast<std::size_t>(rate * seconds + random.uniform());
}

// The place of the root is one more channel beside the joints.
std::size_t draw_channel(std::size_t joints, Random& random) {
  return static_cast<std::size_t>(random.below(joints + 1));
}

}  // namespace

std::vector<NoiseEvent> add_sensor_noise(Clip& clip, double level, Random& random) {
  std::vector<NoiseEvent> events;
  const std::size_t frames = clip.frames(), joints = static_cast<std::size_t>(clip.joints());
  if (level <= 0 || frames == 0) return events;
  const double seconds = static_cast<double>(frames) / clip.frame_rate_hz;
  const auto name = [&](std::size_t channel) {
    return channel == joints ? std::string("position") : clip.skeleton->joint_names[channel];
  };
  const auto frames_of = [&](double s) {
    return std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(s * clip.frame_rate_hz)));
  };

  // Held values are clean ones: a tracker that has lost its target repeats what it had.
  std::vector<NoiseEvent> later;
  for (std::size_t k = event_count(0.25 * level, seconds, random); k > 0; --k) {
    const std::size_t channel = draw_channel(joints, random), first = static_cast<std::size_t>(random.below(frames));
    const std::size_t count = std::min(frames_of(random.uniform(0.1, 0.6)), frames - first);
    later.push_back({"dropout", name(channel), first, count, 0, ""});
    std::vector<bool> below(joints, false);
    for (std::size_t j = channel; j < joints; ++j) {
      const int parent = clip.skeleton->parents[j];
      below[j] = j == channel || (parent >= 0 && below[static_cast<std::size_t>(parent)]);
    }
    for (std::size_t t = first; t < first + count; ++t) {
      if (channel == joints) clip.root_position[t] = clip.root_position[first];
      for (std::size_t j = 0; j < joints; ++j)
        if (below[j]) clip.rotations[t * joints + j] = clip.rotations[first * joints + j];
    }
  }
  for (std::size_t k = event_count(0.5 * level, seconds, random); k > 0; --k) {
    const std::size_t channel = draw_channel(joints, random), first = static_cast<std::size_t>(random.below(frames));
    const std::size_t count = std::min<std::size_t>(1 + static_cast<std::size_t>(random.below(4)), frames - first);
    const bool position = channel == joints;
    const double size = position ? random.uniform(0.05, 0.30) : random.uniform(15, 70);
    const Vector3 direction = random_direction(random);
    later.push_back({"spike", name(channel), first, count, size, position ? "m" : "deg"});
    for (std::size_t t = first; t < first + count; ++t) {
      if (position) {
        clip.root_position[t] += size * direction;
      } else {
        Quaternion& q = clip.rotations[t * joints + channel];
        q = q * exp_map(radians(size) * direction);
      }
    }
  }
  const double shake = 0.6 * level, shift = 0.004 * level;
  for (std::size_t j = 0; j < joints; ++j) {
    const double own = radians(shake) * std::exp(0.4 * random.normal()) / std::sqrt(3.0);
    for (std::size_t t = 0; t < frames; ++t) {
      Quaternion& q = clip.rotations[t * joints + j];
      const double x = random.normal(), y = random.normal(), z = random.normal();
      q = (q * exp_map(own * Vector3(x, y, z))).normalized();
    }
  }
  for (Vector3& p : clip.root_position) {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    p += shift / std::sqrt(3.0) * Vector3(x, y, z);
  }
  make_sign_continuous(clip);

  events.push_back({"jitter", "all", 0, frames, shake, "deg"});
  events.push_back({"jitter", "position", 0, frames, shift, "m"});
  std::stable_sort(later.begin(), later.end(),
                   [](const NoiseEvent& a, const NoiseEvent& b) { return a.first < b.first; });
  events.insert(events.end(), later.begin(), later.end());
  return events;
}

}  // namespace mocap::corpus
