// A leg brought to where its ankle should be. Internal to libmocap/clip.
#pragma once
#include "libmocap/math/rotation.hpp"

namespace mocap {

// Changes the world rotations of hip and knee so that the ankle comes to `ankle`, as far as the leg reaches: the knee bends about its own
// Y axis (positive is flexion), then the whole leg turns by the shortest rotation. Canonical frames: both bones lie along -Z at rest.
// Beyond 99.5 % of the full length, or beyond where the leg reaches as it comes if that is more, the reach grows ever slower and never attains
// the full length, so that a straight knee does not snap.
void reach(const Vector3& hip_position, double thigh, double shank, const Vector3& ankle, Quaternion& hip, Quaternion& knee);

}  // namespace mocap
