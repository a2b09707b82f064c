// How the joint frames of a rig lie in its body, found from the motion: for rigs whose zero rotation is no pose that stands.
#pragma once
#include <vector>

#include "libmocap/clip/clip.hpp"
#include "libmocap/skeleton/joint_map.hpp"

namespace mocap {

// A_c for every canonical joint c, so that R_c(t) = R_s(t) A_c is the orientation of the canonical joint: A_c takes the canonical
// joint frame (T-pose: x forward, y left, z up) to the local frame of the source joint s that stands for c. Two directions of each
// frame come from joint positions, averaged over up to 512 frames in the local frame of the source joint, where they do not move:
//   limbs           the bone, exactly; the twist from the axis about which knee and elbow bend, weighted by the sine of the bend
//   trunk, neck     the bone, exactly; the across-vector of hips and shoulders
//   pelvis          the across-vector of the hips, exactly; the direction of the trunk
//   feet            upright while they stand still under an upright shank; the direction of the toes
//   head            upright (in line with the trunk while that is not) and looking along with the shoulders, on average
//   toes and hands  as foot and forearm, on average
// Twist over time is the source's own. Limbs that never bend, and clips of a few frames, take the twist from the trunk's facing.
// Accuracy: on a made walk within 4 degrees, toes and hands 15 (tests/clip/pose_alignment_test.cpp). Against the table of Bandai-Namco's axes, mean
// over 143 clips that walk: hips, knees, shoulders 0.5 degrees, trunk 0.4 to 3.3, feet 2 to 7, clavicles 9, forearms 5 and 18 (they turn with the hand),
// head 18, hands 21 and 28.
// `clip` in metres, Z up; joints that are not mapped get the identity. map.missing() must be empty. [22]
std::vector<Quaternion> alignment_from_motion(const Clip& clip, const JointMap& map);

}  // namespace mocap
