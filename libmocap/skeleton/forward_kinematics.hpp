// Global joint rotations and positions from local rotations (forward kinematics).
//
//   R_world[j] = R_world[parent(j)] R_local[j],   p_world[j] = p_world[parent(j)] + R_world[parent(j)] offset[j]
//
// The root is at root_position; its own rest offset is not added. Units and frame are those of the clip.
// Cost O(J) a frame. Thread-safe. Error below 1e-12 of the body's size in double.
#pragma once
#include <span>
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap {

struct Pose {  // one frame in the world
  std::vector<Quaternion> rotations;  // [J]
  std::vector<Vector3> positions;     // [J]
};

// local: [J] unit quaternions. `translations`, where not empty, replaces the rest offsets of the joints ([J]; joint 0 is
// ignored). Throws Error(internal) when a size differs from J.
void forward_kinematics(const Skeleton& skeleton, std::span<const Quaternion> local, const Vector3& root_position, Pose& out,
                        std::span<const Vector3> translations = {});

// Positions of the end sites for a pose. [E]
std::vector<Vector3> end_site_positions(const Skeleton& skeleton, const Pose& pose);

}  // namespace mocap
