// The state features of Wang, Chai, Xia 2018, section 4.1.1: what one frame is, seen from the frame before it (eq. 2-4).
//
//   x = [dt_x dt_y dr_z  t_z r_x r_y  theta_2 ... theta_d]        eq. 3; the paper is Y up, here Z is
//
// Columns: [0] forward and [1] leftward step of the root from frame t-1 to t in the ground frame of t-1, m; [2] change of heading, rad;
// [3] height, m; [4] roll, [5] pitch, rad; then three joint angles for each joint but the root, in skeleton order, rad. Heading is the twist of the root
// about Z and (roll, pitch, 0) the rotation vector of what is left, as in features/motion_cell.hpp; joint angles are rotation vectors (axis times angle),
// continuous in time: the first frame on the side of less than a half turn, every other on the side of the frame before it. So frames can be encoded as they come.
// Frame 0 has no frame before it and takes the step of frame 1 (0 where there is none); decoding starts at the placement and does not read it.
//
// The paper's body has 18 joints below the pelvis. Of the canonical 21, sixteen are theirs by another name: collar (clavicle), shoulder (humerus), elbow (radius),
// wrist (hand), hip (femur), knee (tibia), ankle (foot) and foot (toe) of both sides; their thorax is spine1, spine2 and spine3 here, their head is neck and head.
// All 21 stay features of their own - folding three spine joints into one could not be inverted - so a state has 6 + 63 numbers. Any other skeleton works alike.
#pragma once
#include <optional>

#include "libmocap/features/motion_cell.hpp"

namespace mocap::features {

inline constexpr int kStateRootValues = 6;
int state_columns(const Skeleton& skeleton);  // 6 + 3 (J - 1)

// Encodes a motion piece by piece: the pieces one after the other give what the whole gives, but for frame 0's step where the first piece is one frame long (0 then).
class StateEncoder {
 public:
  // [T, columns]. Error(data) for a clip with translations or without frames. Cost O(T J).
  FeatureMatrix operator()(const Clip& piece);

 private:
  std::vector<Quaternion> before_;  // of the last frame; empty at the start
  Vector3 place_ = Vector3::Zero();
};

// Decodes piece by piece likewise. decode(encode(clip)) from the placement of frame 0 gives the clip back within 1e-9 in double.
class StateDecoder {
 public:
  StateDecoder(std::shared_ptr<const Skeleton> skeleton, double frame_rate_hz, const Placement& start = {});
  Clip operator()(const FeatureMatrix& features);  // Error(internal) for another number of columns

 private:
  std::shared_ptr<const Skeleton> skeleton_;
  double rate_;
  Placement now_;
  std::vector<Quaternion> before_;
};

FeatureMatrix encode_state(const Clip& clip);
Clip decode_state(const FeatureMatrix& features, const std::shared_ptr<const Skeleton>& skeleton, double frame_rate_hz, const Placement& start = {});

// Where a frame stands, for StateDecoder.
Placement placement_of(const Clip& clip, std::size_t frame = 0);

}  // namespace mocap::features
