#include "libmocap/metrics/stillness.hpp"

#include <algorithm>
#include <cmath>

#include "libmocap/metrics/motion_statistics.hpp"

namespace mocap::metrics {

std::size_t frames_until_still(const Clip& clip, const Stillness& stillness) {
  const auto frames = [&](double seconds) { return static_cast<std::size_t>(std::llround(seconds * clip.frame_rate_hz)); };
  const std::size_t needed = std::max<std::size_t>(1, frames(stillness.seconds));
  const auto energy = joint_energy(clip);
  bool moved = false;
  std::size_t still = 0;  // steps, up to the one at hand
  for (std::size_t t = 0; t < energy.size(); ++t) {
    still = energy[t] < stillness.speed ? still + 1 : 0;
    moved = moved || energy[t] >= 2 * stillness.speed;
    if (!moved) still = 0;
    if (still < needed) continue;
    const std::size_t rest = t + 1 - still;  // the frame at which it begins
    return std::min(clip.frames(), std::max(rest + 1 + frames(stillness.tail_seconds), frames(stillness.least_seconds)));
  }
  return clip.frames();
}

}  // namespace mocap::metrics
