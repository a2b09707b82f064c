// Standardised pose features read back as rotations, whichever the representation: what the terms of the objective and the
// classifiers look at. Differentiable; no state of their own, so that shards may share one.
#pragma once
#include <torch/torch.h>

#include "libmocap/features/motion_cell.hpp"
#include "libmodels/train/dataset.hpp"

namespace mocap::objective {

class Poses {
 public:
  explicit Poses(const train::MotionDataset& data);
  const features::MotionCellLayout& layout() const { return layout_; }

  // Numbers of the rotations as the representation has them, (B, T, D) -> (B, T, J, k), not standardised and not normalised.
  torch::Tensor rotations(const torch::Tensor& standardised) const;
  // The six root values in their units, (B, T, 6).
  torch::Tensor root(const torch::Tensor& standardised) const;
  // rotations() as unit quaternions (B, T, J, 4): divided by their length, through the exponential map, through Gram-Schmidt.
  torch::Tensor unit(const torch::Tensor& rotations) const;
  // The same of real motion, without gradient, with signs as features/motion_cell.hpp has them: continuous in time, w > 0 over the
  // window. (Those of quaternions and of axis-angle vectors are the clip's own; matrices do not keep them.)
  torch::Tensor target(const torch::Tensor& rotations) const;

 private:
  features::MotionCellLayout layout_;
  torch::Tensor mean_, deviation_;
};

// Each quaternion of `unit` on the side of its target.
torch::Tensor beside(const torch::Tensor& unit, const torch::Tensor& target);

}  // namespace mocap::objective
