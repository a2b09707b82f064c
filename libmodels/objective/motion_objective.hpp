// How far reconstructed motion is from real motion, for every generator that is trained on pose features (Ghorbani et al. 2020, section 3.5).
//
//   L_rec of a frame =
//       sum_k alpha_k d(X_k, X~_k)                           eq. 22; alpha_k by eq. 23, metres
//     + c_norm sum_k | |q~_k|^2 - 1 |                        eq. 26
//     + sum_r w_r (x_r - x~_r)^2                             root values, standardised
//     + c_v sum_k alpha_k 2 |Delta q_k - Delta q~_k|         change from frame to frame, across words too (|Delta q| is half an angle)
// The paper gives the six root values no loss and the last term does not exist there: w_r = root_weight for velocities,
// height and yaw rate, and the weight of the heaviest joint for the two tilts.
#pragma once
#include <torch/torch.h>

#include "libmocap/features/motion_cell.hpp"
#include "libmocap/skeleton/skeleton.hpp"
#include "libmodels/train/dataset.hpp"

namespace mocap::objective {

struct ObjectiveConfig {
  double root_weight = 0.5, unit_norm_weight = 0.1, velocity_weight = 0;
  double joint_weight_floor = 0.08;  // metres
};

// Sums over a batch's real frames, for the log.
struct Figures {
  double angle = 0;     // mean angle between rotations of a frame, radians
  double root = 0;      // weighted square error of the root values
  double velocity = 0;  // the last term before its weight
};

class MotionObjective {
 public:
  MotionObjective(const ObjectiveConfig& config, const train::MotionDataset& data);

  // y (B, T, D) standardised output of a model, with gradient; batch: what it should be. (B, T) L_rec, 0 where a frame is not real.
  torch::Tensor operator()(const torch::Tensor& y, const train::Batch& batch, Figures& figures) const;

 private:
  ObjectiveConfig config_;
  features::MotionCellLayout layout_;
  torch::Tensor mean_, deviation_, alpha_, root_weights_;
};

}  // namespace mocap::objective
