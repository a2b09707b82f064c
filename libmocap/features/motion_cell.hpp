// The pose features of the Motion Cell (Ghorbani et al. 2020, section 3.1): D_p = k (J - 1) + 6 numbers a frame, free of
// ground-plane place and heading; for the canonical body 21 k + 6.
//
// Columns: the local rotation of each joint but the root, in skeleton order, k numbers each; then the root's
//   [0] forward velocity, m/s      [1] leftward velocity, m/s     [2] height, m
//   [3] yaw rate, rad/s            [4] roll, rad                  [5] pitch, rad
// Heading psi is the twist of the root about Z, q_root = R_z(psi) s, and (roll, pitch, 0) = log s: exactly invertible
// below a half turn of tilt. Velocities lead from frame t to t+1, in the heading frame of t; the last frame repeats the one
// before. The paper names the six values and leaves their definition open.
// Quaternions are continuous in time and each joint of a clip lies, taken over its frames, on the side w > 0.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "libmocap/clip/clip.hpp"

namespace mocap::features {

using FeatureMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;  // [T, D]

enum class RotationRepresentation { axis_angle = 3, quaternion = 4, rotation_matrix = 9 };  // the values are k
RotationRepresentation parse_representation(const std::string& name);  // "axis-angle", ...; Error(usage)
std::string text(RotationRepresentation r);

inline constexpr int kRootValues = 6;

struct MotionCellLayout {
  int joints = 21;  // without the root
  RotationRepresentation representation = RotationRepresentation::quaternion;
  int rotation_values() const { return static_cast<int>(representation); }
  int rotation_columns() const { return joints * rotation_values(); }
  int columns() const { return rotation_columns() + kRootValues; }
};

// Error(data) for a clip with translations or without frames. Cost O(T J).
FeatureMatrix encode_motion_cell(const Clip& clip, RotationRepresentation representation);

struct Placement {  // what the features leave out
  double heading = 0;  // of frame 0, radians from +X
  Vector2 position = Vector2::Zero();
};

// The inverse: decode(encode(clip), placement of clip) gives the clip back within 1e-9 in double. Rotations need not be
// valid (a network's output): quaternions are normalised, matrices orthonormalised (Gram-Schmidt), a quaternion of norm
// below 1e-6 becomes the identity.
Clip decode_motion_cell(const FeatureMatrix& features, const std::shared_ptr<const Skeleton>& skeleton, double frame_rate_hz,
                        RotationRepresentation representation, const Placement& start = {});

// Mean and deviation of each column over all frames of a training split. One deviation for all numbers of a joint's
// rotation (the largest of them, at least 0.02), so that errors of a quaternion's parts weigh alike; root columns have
// their own (at least 1e-3). Sums in double, in the order added.
class FeatureStatistics {
 public:
  explicit FeatureStatistics(const MotionCellLayout& layout);
  void add(const FeatureMatrix& features);
  std::vector<float> mean() const;
  std::vector<float> deviation() const;

 private:
  MotionCellLayout layout_;
  Eigen::VectorXd shift_, sum_, square_sum_;  // about the first frame, against cancellation
  double count_ = 0;
};

}  // namespace mocap::features
