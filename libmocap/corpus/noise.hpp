// Sensor noise as optical and inertial capture show it: for training and judging denoisers against the clean twin.
#pragma once
#include <string>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmocap/clip/clip.hpp"

namespace mocap::corpus {

// One disturbance: "jitter" of all joints over the whole clip, a "spike" or a "dropout" of one joint.
struct NoiseEvent {
  std::string kind;                  // jitter, spike, dropout
  std::string joint;                 // "all", "position" for the place of the root, otherwise a joint
  std::size_t first = 0, count = 0;  // frames
  double size = 0;                   // jitter: standard deviation; spike: height; dropout: 0
  std::string unit;                  // "deg" or "m"; "" for dropouts
};

// Disturbs rotations and root position in place; contacts, attributes and segments stay. At level 1:
//   jitter    white, 0.6 degrees for each joint (times a factor per joint) and 4 mm for the root
//   spikes    0.5 a second: one joint off by 15-70 degrees, or the root by 5-30 cm, for 1-4 frames
//   dropouts  0.25 a second: a joint and all below it, or the root's place, holds its last value for 0.1-0.6 s
// level scales deviations and rates; 0 leaves the clip as it is. Returns what was done, jitter first, in order of time.
std::vector<NoiseEvent> add_sensor_noise(Clip& clip, double level, Random& random);

}  // namespace mocap::corpus
