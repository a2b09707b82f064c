// Mean per-joint position error (MPJPE) of one motion against another of the same frames and joints.
#pragma once
#include "libmocap/clip/clip.hpp"

namespace mocap::metrics {

struct PositionError {
  double world_mm = 0;  // mean distance of a joint in the world
  double pose_mm = 0;   // the same with the root's place on the ground and heading (twist of the pelvis about Z) taken out of both
};
// Over all frames and joints. Error(data) where skeletons' joints or frames differ in number, and without frames. Cost O(T J).
PositionError position_error(const Clip& clip, const Clip& truth);

}  // namespace mocap::metrics
