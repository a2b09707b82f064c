// From a file's own unit and axes to metres with Z up, and from there to the canonical place and heading.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap {

enum class Unit { automatic, metre, decimetre, centimetre, millimetre, inch, cmu };  // cmu: ASF units, 1/0.45 inch = 0.0564444 m
enum class UpAxis { automatic, y, z };
enum class FirstFrame { automatic, keep, drop };

double metres_per(Unit unit);  // Error(internal) for automatic
std::string text(Unit unit);
std::string text(UpAxis up);

// What was found or forced. Leg length (hip to ankle over the bones of the rest pose) decides the unit: the candidate
// that brings it nearest to 0.83 m, within a factor of 1.7 (decimetres, which few write, must do so by a factor of 1.15
// better); files without legs go by the extent of the whole skeleton.
// The axis is the one along which the head lies above the feet, in the rest pose where that stands and over the motion; where the two
// differ or neither tells (somebody lies, crawls, stands on the hands; a rig turned by its root alone) also the one along which the lowest
// point stays where it is while the body travels, and is near 0.
struct WorldFrame {
  Unit unit = Unit::metre;
  UpAxis up = UpAxis::z;
  double leg_length_m = 0;         // after conversion; 0 where no legs were found
  std::vector<std::string> notes;  // doubts worth printing
};
WorldFrame detect_world_frame(const Clip& raw, Unit unit, UpAxis up);

// Applies it in place. Y up to Z up is the cyclic permutation (x,y,z) -> (z,x,y): exact, and a Y-up figure facing +Z ends
// facing +X with its left at +Y. Rotations, offsets, end sites and positions are all expressed in the new axes, so that
// forward kinematics holds as before.
void to_metres_z_up(Clip& clip, const WorldFrame& frame);

// How many leading frames are a calibration pose rather than motion: cgspeed's CMU conversion adds a T-pose, here and there
// followed by frames of zeros where the capture had not begun; other writers put the rest pose, whatever it is. All of them stand in a T-pose
// (arms in one line, legs straight and square to them, whatever the file's axes) or turn no joint but the root, and the jump into the take is over 0.1 rad a
// joint of the body (0.03 where no joint is turned) and eight times the median step of the second that follows. At most 8.
std::size_t calibration_frames(const Clip& clip);

// Refuses reflections: no rotation turns a left-handed capture into a right-handed one, and what calls itself left is then right.
// Judged by anatomy over up to 128 frames: with left and right as the joints are named, the toes of a person who stands or walks point
// where the body faces, and knees bend so that the heels rise behind. Error(data) where both feet point backwards (mean cosine
// below -0.3, legs in line with the trunk alone) and no knee says otherwise, or the knees bend forwards on a rig without toes or that never
// stands. Clips that show neither pass.
void require_right_handed(const Clip& clip);

// Moves and turns the whole clip: the root of frame 0 above the origin, facing +X. Heights are untouched; the path, source.origin
// and source.yaw follow.
void face_forward(Clip& clip);

// Facing of a pose: (across-vector of hips and shoulders) x up projected on the ground, as a yaw angle (0 is +X);
// nullopt when undefined (lying, or no such joints).
std::optional<double> facing_yaw(const Skeleton& skeleton, const Pose& pose);

}  // namespace mocap
