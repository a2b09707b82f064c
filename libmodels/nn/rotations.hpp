// Rotations as networks give them, brought to unit quaternions (wxyz), and what a body does with them: differentiable, one pass
// forward and one backward, float or double. Gradients of a rotation are those along the group: what changes a unit quaternion's
// length is left out, so that they may be handed to any of the maps below.
#pragma once
#include <torch/torch.h>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::nn {

// Exponential map, (..., 3) axis times angle -> (..., 4): (cos(a / 2), sin(a / 2) axis). Neither half of the quaternions is
// chosen: continuous vectors give continuous quaternions beyond a half turn as well.
torch::Tensor quaternions_of_vectors(const torch::Tensor& v);

// Gram-Schmidt on the first two columns (the third is their cross product and what the network gives there is not looked at),
// then Shepperd's method: (..., 9) row-major -> (..., 4), w >= 0. Where a column is shorter than 1e-6 or both are parallel as far
// as that: the identity, gradient 0.
torch::Tensor quaternions_of_matrices(const torch::Tensor& m);

// Eq. 25 of Ghorbani et al. 2020 per matrix, (..., 9) -> (..., 2): |M M^T - I|^2 (Frobenius) and |det M - 1|.
torch::Tensor matrix_constraints(const torch::Tensor& m);

// (B, T, J, 4) in place: each quaternion on the side of the one before, each joint of a row on the side whose w add up to more.
void make_signs_continuous(torch::Tensor& q);

// Forward kinematics of unit quaternions (libmocap/skeleton/forward_kinematics.hpp), root at the origin: local rotations
// (N, J, 4), the root's first, to the positions in metres of the joints but the root and of the end sites, (N, J - 1 + E, 3).
class BodyPositions {
 public:
  explicit BodyPositions(const Skeleton& skeleton) : skeleton_(skeleton) {}
  std::int64_t points() const { return skeleton_.joint_count() - 1 + static_cast<std::int64_t>(skeleton_.end_sites.size()); }
  torch::Tensor operator()(const torch::Tensor& q) const;

 private:
  Skeleton skeleton_;
};

}  // namespace mocap::nn
