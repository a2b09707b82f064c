// How far reconstructed motion is from real motion, for every generator that is trained on pose features (Ghorbani et al. 2020, section 3.5).
//
//   L_rec of a frame =
//       sum_k alpha_k d(X_k, X~_k)                           eq. 22; alpha_k by eq. 23, metres
//     + L_ang                                                eq. 25 for matrices, eq. 26 for quaternions, none for axis-angle vectors
//     + sum_r w_r |x_r - x~_r|                               root values, standardised (round within 1e-3)
//     + c_v (sum_k alpha_k 2 |Delta q_k - Delta q~_k|        change from frame to frame, across words too (|Delta q| is half an angle),
//            + sum_r w_r |Delta x_r - Delta x~_r|)           of root values likewise
// The paper gives the six root values no loss and the last term does not exist there. Root values are standardised over all actions, so that a square would make the drift of somebody
// who stands cheap: errors count by their size, as angles do. w_r = root_weight for velocities,
// height and yaw rate, and the weight of the heaviest joint for the two tilts. q are unit quaternions in every representation.
//
// d, by `distance` (X~ is normalised before, but for l2: quaternions by their length, matrices by Gram-Schmidt, vectors by the
// exponential map):
//   d1        2 arccos |q . q~|, radians (eq. 17)            quaternion, axis-angle
//   d2        1 - |q . q~| (eq. 18)                          quaternion, axis-angle
//   d3        min(|q - q~|^2, |q + q~|^2) (eq. 20)           quaternion, axis-angle
//   geodesic  |log(R~ R^T)|, the same angle (eq. 21)         rotation-matrix, axis-angle
//   l2        |x - x~|^2 of the numbers as they stand        all
//   fk        no angles and no alpha: the sum of the distances |p - p~| in metres of all joints and end sites of the body, root at
//             the origin, turned by its tilt and not by its heading (as QuaterNet's loss)     all
// The paper measures quaternions by d1 and matrices by eq. 21; for axis-angle vectors it has no distance of rotations and
// leaves them as they are ("no normalization step was applied"), so that their default here is l2.
//
// L_ang = c_1 |R~ R~^T - I|^2 + c_2 |det R~ - 1| (eq. 25) or c |(|q~|^2 - 1)| (eq. 26), before normalising. The paper also prints a
// Sigmoid on the network's matrices "in the range of [0, 1]", which cannot be: entries of a rotation matrix lie in [-1, 1]. No
// squashing is done here; the two constraints keep the entries in range. Gram-Schmidt never looks at the third column, which
// learns from eq. 25 alone (and from l2).
#pragma once
#include <torch/torch.h>

#include <nlohmann/json.hpp>
#include <string>

#include "libmocap/features/motion_cell.hpp"
#include "libmocap/skeleton/skeleton.hpp"
#include "libmodels/nn/rotations.hpp"
#include "libmodels/objective/poses.hpp"
#include "libmodels/train/dataset.hpp"

namespace mocap::objective {

enum class Distance { d1, d2, d3, geodesic, l2, fk };
Distance parse_distance(const std::string& name);  // "d1", ...; Error(usage)
std::string text(Distance distance);
Distance default_distance(features::RotationRepresentation representation);  // d1, geodesic, l2
// Error(usage), naming those that can, where rotations of this representation cannot be compared so.
void check_distance(Distance distance, features::RotationRepresentation representation);

struct ObjectiveConfig {
  double root_weight = 0.5, unit_norm_weight = 0.1, velocity_weight = 0;
  double joint_weight_floor = 0.08;  // metres
  Distance distance = Distance::d1;
  bool uniform_joints = false;  // every alpha is the mean of those of all joints, so that their sum stays
  double orthogonality_weight = 0.1, determinant_weight = 0.1;  // c_1, c_2 of eq. 25
};
// Every field under its name, `distance` as text. Reading: Error(data) in "config/training/objective" where one lacks or is no such value.
nlohmann::json to_json(const ObjectiveConfig& config);
ObjectiveConfig objective_config_from_json(const nlohmann::json& json);

// Sums over a batch's real frames, for the log.
struct Figures {
  double angle = 0;       // mean angle between rotations of a frame, radians
  double distance = 0;    // the first term
  double constraint = 0;  // the second, L_ang
  double root = 0;        // weighted error of the root values
  double velocity = 0;    // the last term before its weight
};

class MotionObjective {
 public:
  // Error(usage) for a distance that the data's representation does not have, and for uniform joints with fk.
  MotionObjective(const ObjectiveConfig& config, const train::MotionDataset& data);

  // y (B, T, D) standardised output of a model, with gradient; batch: what it should be. (B, T) L_rec, 0 where a frame is not real.
  torch::Tensor operator()(const torch::Tensor& y, const train::Batch& batch, Figures& figures) const;

 private:
  torch::Tensor positions(const torch::Tensor& unit, const torch::Tensor& standardised) const;

  ObjectiveConfig config_;
  Poses poses_;
  nn::BodyPositions body_;
  torch::Tensor alpha_, root_weights_;
};

}  // namespace mocap::objective
