// How a rig stands when all its rotations are zero, and where its soles are.
#pragma once
#include <optional>
#include <vector>

#include "libmocap/skeleton/joint_map.hpp"

namespace mocap {

// World orientation of every source joint when the figure stands in T-pose, expressed in the canonical frame (facing +X,
// left +Y, up +Z). Rigs whose rest pose stands - legs parallel and opposite to the trunk, arms out or down, whatever axis of the
// file it stands along and whichever way it faces - have the same rotation everywhere: the one that sets it upright. A rig of
// a known family whose rest pose is none (Bandai-Namco: every bone along +-X) has a table of axes. nullopt otherwise: then
// the motion has to tell (clip/pose_alignment.hpp). The skeleton must be in metres, Z up. [J]
std::optional<std::vector<Quaternion>> t_pose_orientations(const Skeleton& skeleton, const JointMap& map);

// Which way is up in a rest pose that stands, in the skeleton's own axes and any unit; nullopt where it does not stand.
std::optional<Vector3> rest_up(const Skeleton& skeleton, const JointMap& map);

// Whether ankle to toe base in T-pose, canonical frame, falls so steeply (over 65 degrees) that the foot cannot stand flat: some rigs rest with
// every bone of the leg in one line.
bool foot_hangs(const Vector3& ankle_to_toe);

// Positions of all joints in that T-pose, root at the origin. [J]
std::vector<Vector3> t_pose_positions(const Skeleton& skeleton, const std::vector<Quaternion>& t_pose);

// Length of the legs over the bones from hip to ankle: mean of both, that of the only one, 0 without legs.
double leg_length(const Skeleton& skeleton, const JointMap& map);

// Height of toe base and ankle above the sole with a flat foot, metres: the lowest point of foot, toes and their end sites in
// T-pose is a toe tip kToeTipHeight above the sole. On the canonical body kFootSoleHeight and kAnkleSoleHeight. A rig without a
// T-pose, without anything below the ankle or with hanging toes, gets the canonical heights scaled by its legs.
inline constexpr double kToeTipHeight = 0.010;
struct SoleHeights {
  double toe, ankle;  // where there is no toe joint: toe == ankle
};
SoleHeights sole_heights(const Skeleton& skeleton);

}  // namespace mocap
