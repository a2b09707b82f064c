// How a figure goes: by which clips that begin alike are told apart.
#pragma once
#include <cstddef>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::metrics {

struct Gait {
  double speed_mps = 0;      // way of the root on the ground by time, m/s; NaN below 2 frames
  double turning_dps = 0;    // change of heading from the first frame to the last, turns counted, by time: degrees a second, to the left positive; NaN below 2 frames
  double step_length_m = 0;  // horizontal distance between the foot joints where one comes down and where the other came down before it, mean over steps, metres; NaN: no two steps
};
// From the clip's contacts and the roles left_foot and right_foot; where there are none, step_length_m is NaN. Cost O(T J).
Gait gait(const Clip& clip);

// Consecutive pieces of `frames` frames; what is left over at the end is left out, but a clip that is shorter is one piece. Error(internal) for 0 frames.
std::vector<Clip> stretches(const Clip& clip, std::size_t frames);

}  // namespace mocap::metrics
