// Where motion comes to rest for good: generated actions that are not periodic (a jump, a lift) end there (Ghorbani et al. 2020, section 5.1: "we
// terminated the generated sequence when they collapse to the mean pose").
#pragma once
#include "libmocap/clip/clip.hpp"

namespace mocap::metrics {

// A step from frame t to t + 1 is still where E(t) of joint_energy is under `speed`: joint speeds weighted by the impact factors of eq. 23. Real
// people who stand have 0.1 to 0.8 rad m/s, in their slowest walking steps 4 and on average 10 to 15, and pause for up to 1.2 s within a lift.
struct Stillness {
  double speed = 1;            // rad m/s
  double seconds = 1.5;        // for so long without a break
  double tail_seconds = 0.25;  // of rest that is kept
  double least_seconds = 1;    // a shorter motion is never left
};

// Frames to keep: up to the first rest of `seconds` that follows motion, and the tail. All frames where there is none. Rest at the beginning, before
// a step of at least twice `speed`, does not count - a jump begins with standing - and so a clip that never moves is kept whole.
std::size_t frames_until_still(const Clip& clip, const Stillness& stillness = {});

}  // namespace mocap::metrics
