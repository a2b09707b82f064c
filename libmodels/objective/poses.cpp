#include "libmodels/objective/poses.hpp"

#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/rotations.hpp"

namespace mocap::objective {

using features::RotationRepresentation;
using torch::Tensor;

Poses::Poses(const train::MotionDataset& data) : layout_(data.layout()), mean_(torch::tensor(data.mean(), torch::kFloat32)), deviation_(torch::tensor(data.deviation(), torch::kFloat32)) {}

Tensor Poses::rotations(const Tensor& x) const {
  const std::int64_t n = layout_.rotation_columns();
  return (x.narrow(2, 0, n) * deviation_.narrow(0, 0, n) + mean_.narrow(0, 0, n)).view({x.size(0), x.size(1), layout_.joints, layout_.rotation_values()});
}

Tensor Poses::root(const Tensor& x) const {
  const std::int64_t n = layout_.rotation_columns();
  return x.narrow(2, n, features::kRootValues) * deviation_.narrow(0, n, features::kRootValues) + mean_.narrow(0, n, features::kRootValues);
}

Tensor Poses::unit(const Tensor& r) const {
  switch (layout_.representation) {
    case RotationRepresentation::axis_angle: return nn::quaternions_of_vectors(r);
    case RotationRepresentation::quaternion: return nn::normalize_quaternions(r);
    case RotationRepresentation::rotation_matrix: return nn::quaternions_of_matrices(r);
  }
  return r;
}

Tensor Poses::target(const Tensor& r) const {
  if (layout_.representation == RotationRepresentation::quaternion) return r;  // unit up to the rounding of the features
  const torch::NoGradGuard no_grad;
  Tensor q = unit(r);
  if (layout_.representation == RotationRepresentation::rotation_matrix) nn::make_signs_continuous(q);
  return q;
}

Tensor beside(const Tensor& unit, const Tensor& target) {
  return unit * torch::where((unit.detach() * target).sum(-1, true) < 0, torch::full({}, -1.0f), torch::full({}, 1.0f));
}

}  // namespace mocap::objective
