#include "libmodels/objective/motion_objective.hpp"

#include "libmodels/nn/losses.hpp"

namespace mocap::objective {

MotionObjective::MotionObjective(const ObjectiveConfig& config, const train::MotionDataset& data) : config_(config), layout_(data.layout()) {
  const auto tensor = [](const std::vector<float>& v) { return torch::tensor(v, torch::kFloat32); };
  mean_ = tensor(data.mean());
  deviation_ = tensor(data.deviation());
  alpha_ = nn::joint_weights(*data.header().skeleton, config_.joint_weight_floor);
  const double heaviest = alpha_.max().item<double>();
  alpha_ = alpha_.narrow(0, 1, layout_.joints).contiguous();  // the root's rotation is among the six root values
  root_weights_ = torch::full({features::kRootValues}, config_.root_weight, torch::kFloat32);
  root_weights_.narrow(0, 4, 2).fill_(heaviest);
}

torch::Tensor MotionObjective::operator()(const torch::Tensor& y, const train::Batch& batch, Figures& figures) const {
  const std::int64_t b = y.size(0), t = y.size(1), rotations = layout_.rotation_columns();
  const auto quaternions = [&](const torch::Tensor& standardised) {
    return (standardised.narrow(2, 0, rotations) * deviation_.narrow(0, 0, rotations) + mean_.narrow(0, 0, rotations)).view({b, t, layout_.joints, 4});
  };
  const torch::Tensor q = quaternions(y), target = quaternions(batch.features);
  const torch::Tensor angle = nn::geodesic_distance(q, target);  // (B, T, J)
  const torch::Tensor rotation = torch::matmul(angle, alpha_);
  const torch::Tensor norm = nn::unit_norm_penalty(q).sum(-1);
  const torch::Tensor root = torch::matmul((y.narrow(2, rotations, features::kRootValues) - batch.features.narrow(2, rotations, features::kRootValues)).square(), root_weights_);
  torch::Tensor frame_loss = rotation + config_.unit_norm_weight * norm + root;
  figures = {};
  if (config_.velocity_weight > 0 && t > 1) {
    const torch::Tensor unit = nn::normalize_quaternions(q);
    const torch::Tensor side = torch::where((unit.detach() * target).sum(-1, true) < 0, torch::full({}, -1.0f), torch::full({}, 1.0f));
    const torch::Tensor error = unit * side - target;
    const torch::Tensor change = error.narrow(1, 1, t - 1) - error.narrow(1, 0, t - 1);
    // |Delta q| is half an angle: twice it weighs like the distances above. The small constant keeps the slope finite.
    const torch::Tensor velocity = torch::matmul(2 * (change.square().sum(-1) + 1e-8).sqrt(), alpha_) * batch.mask.narrow(1, 1, t - 1);
    frame_loss = torch::cat({frame_loss.narrow(1, 0, 1), frame_loss.narrow(1, 1, t - 1) + config_.velocity_weight * velocity}, 1);
    figures.velocity = velocity.detach().sum().item<double>();
  }
  figures.angle = (angle.detach().mean(-1) * batch.mask).sum().item<double>();
  figures.root = (root.detach() * batch.mask).sum().item<double>();
  return frame_loss * batch.mask;
}

}  // namespace mocap::objective
