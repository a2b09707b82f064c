#include "libmocap/metrics/position_error.hpp"

#include <fmt/core.h>

#include "libmocap/base/error.hpp"

namespace mocap::metrics {

PositionError position_error(const Clip& clip, const Clip& truth) {
  if (clip.frames() == 0 || clip.frames() != truth.frames() || clip.joints() != truth.joints())
    refuse({{}, 0, "clip " + clip.name}, fmt::format("{} frames of {} joints, expected {} of {} as in what it is compared with", clip.frames(), clip.joints(), truth.frames(), truth.joints()));
  PositionError error;
  Pose a, b;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, a);
    world_pose(truth, t, b);
    const Quaternion turn_a = yaw_rotation(-yaw_of(a.rotations[0])), turn_b = yaw_rotation(-yaw_of(b.rotations[0]));
    const Vector3 place_a(a.positions[0].x(), a.positions[0].y(), 0), place_b(b.positions[0].x(), b.positions[0].y(), 0);
    for (std::size_t j = 0; j < a.positions.size(); ++j) {
      error.world_mm += (a.positions[j] - b.positions[j]).norm();
      error.pose_mm += (turn_a * (a.positions[j] - place_a) - turn_b * (b.positions[j] - place_b)).norm();
    }
  }
  const double mm = 1000 / (static_cast<double>(clip.frames()) * clip.joints());
  error.world_mm *= mm;
  error.pose_mm *= mm;
  return error;
}

}  // namespace mocap::metrics
