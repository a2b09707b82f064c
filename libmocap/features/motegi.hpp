// The position features of Motegi, Hijioka, Murakami 2018, section II: 58 numbers a frame, free of ground-plane place, heading and floor height.
//
//   v_f = (p_ls - p_h) x (p_rs - p_h)                     forward; h hip (pelvis), ls and rs the shoulders
//   x = v_f without its height, normalised;  z = up;  y = z x x, to the left
//   M_gl(t): that frame with its origin on the floor below the pelvis;  p^(l) = M_lg p^(g)
//   Delta M(t) = M_lg(t-1) M_gl(t)
//
// Columns: [0] height of the pelvis, m; [1..54] the other 18 joints in the frame above, x y z each, m; [55] forward and [56] leftward velocity of the pelvis, m/s: Delta M's translation times the
// rate, so in the frame of t-1; [57] yaw rate, rad/s, counter-clockwise. Frame 0 has no frame before it and takes the velocities of frame 1 (0 where there is none); decoding does not read them.
//
// The paper is Y up with Z forward and prints e_x = v_f x e_y, e_z = e_y x e_x. That basis is left-handed: R_gl mirrors left and right. Here it is e_x = e_y x v_f, in our axes y = z x x.
// Its floor is the lowest joint of the first frame, kept aside in the placement like place and heading: joints rest above the ground by the thickness of what is around them.
// Its body has 19 joints that Fig. 1 names. Of the canonical 22 these are all but both collars and spine2: spine1 is rigid on the pelvis and with both hips tells how that is turned; what is left
// out is found again between its neighbours (clip/position_fit.hpp).
// Where v_f is steeper than 84 degrees - lying on the back or the face, bent until the back is level - it says nothing of the heading: the last one that did goes on, before the first the first,
// and 0 where there is none. Bent further, shoulders under hips, v_f points behind: the heading jumps by half a turn and back, in the paper as here.
#pragma once
#include <array>
#include <string_view>
#include <vector>

#include "libmocap/features/motion_cell.hpp"

namespace mocap::features {

inline constexpr int kMotegiJoints = 19;
inline constexpr int kMotegiRootVelocities = 3;  // the last columns
inline constexpr int kMotegiColumns = 1 + 3 * (kMotegiJoints - 1) + kMotegiRootVelocities;

const std::array<std::string_view, kMotegiJoints>& motegi_joint_names();  // the pelvis first
std::vector<int> motegi_joints(const Skeleton& skeleton);                 // their indices; Error(data) naming the first that is missing

// World positions of the 19 joints, [T, 57], m, by forward kinematics. Error(data) as motegi_joints, and for a clip without frames.
FeatureMatrix motegi_positions(const Clip& clip);

struct MotegiPlacement {  // what the features leave out
  double x = 0, y = 0, heading = 0, floor = 0;  // of a frame: the pelvis on the ground, radians from +X; height of its lowest joint (what is encoded has the floor of frame 0)
};
// Error(internal) for positions that have not 57 columns or not that frame.
MotegiPlacement motegi_placement(const FeatureMatrix& positions, Eigen::Index frame = 0);

// positions [T, 57] -> [T, 58]. Error(data) for another number of columns, no frames, a rate that is not above 0, and numbers that are not finite. Cost O(T).
FeatureMatrix encode_motegi(const FeatureMatrix& positions, double frame_rate_hz);

// The inverse: decode(encode(p), rate, placement(p)) gives p back within 1e-9 m over 10,000 frames. Any numbers will do (a network's output). Cost O(T), millions of frames a second.
// Error(data) likewise.
FeatureMatrix decode_motegi(const FeatureMatrix& features, double frame_rate_hz, const MotegiPlacement& start = {});

}  // namespace mocap::features
