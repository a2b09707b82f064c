#include "libmodels/objective/motion_objective.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/losses.hpp"

namespace mocap::objective {
namespace {

using features::RotationRepresentation;
using torch::Tensor;

constexpr std::array<std::pair<Distance, const char*>, 6> kNames = {
    {{Distance::d1, "d1"}, {Distance::d2, "d2"}, {Distance::d3, "d3"}, {Distance::geodesic, "geodesic"}, {Distance::l2, "l2"}, {Distance::fk, "fk"}}};

bool possible(Distance d, RotationRepresentation r) {
  if (d == Distance::geodesic) return r != RotationRepresentation::quaternion;
  if (d == Distance::l2 || d == Distance::fk) return true;
  return r != RotationRepresentation::rotation_matrix;
}

}  // namespace

Distance parse_distance(const std::string& name) {
  for (const auto& [d, known] : kNames)
    if (name == known) return d;
  refuse_usage("distance '" + name + "', expected d1, d2, d3, geodesic, l2 or fk");
}

std::string text(Distance distance) {
  for (const auto& [d, name] : kNames)
    if (distance == d) return name;
  return {};
}

Distance default_distance(RotationRepresentation r) {
  return r == RotationRepresentation::quaternion ? Distance::d1 : (r == RotationRepresentation::rotation_matrix ? Distance::geodesic : Distance::l2);
}

void check_distance(Distance distance, RotationRepresentation r) {
  if (possible(distance, r)) return;
  std::string list;
  for (const auto& [d, name] : kNames)
    if (possible(d, r)) list += (list.empty() ? "" : ", ") + std::string(name);
  refuse_usage(fmt::format("distance {} of representation {}, expected one of {}", text(distance), features::text(r), list));
}

nlohmann::json to_json(const ObjectiveConfig& c) {
  return {{"root_weight", c.root_weight},
          {"unit_norm_weight", c.unit_norm_weight},
          {"velocity_weight", c.velocity_weight},
          {"joint_weight_floor", c.joint_weight_floor},
          {"distance", text(c.distance)},
          {"uniform_joints", c.uniform_joints},
          {"orthogonality_weight", c.orthogonality_weight},
          {"determinant_weight", c.determinant_weight}};
}

ObjectiveConfig objective_config_from_json(const nlohmann::json& j) {
  ObjectiveConfig c;
  const Where where{{}, 0, "config/training/objective"};
  try {
    j.at("root_weight").get_to(c.root_weight);
    j.at("unit_norm_weight").get_to(c.unit_norm_weight);
    j.at("velocity_weight").get_to(c.velocity_weight);
    j.at("joint_weight_floor").get_to(c.joint_weight_floor);
    c.distance = parse_distance(j.at("distance").get<std::string>());
    j.at("uniform_joints").get_to(c.uniform_joints);
    j.at("orthogonality_weight").get_to(c.orthogonality_weight);
    j.at("determinant_weight").get_to(c.determinant_weight);
  } catch (const nlohmann::json::exception& e) {
    refuse(where, std::string("not the settings of an objective: ") + e.what());
  } catch (const Error& e) {
    refuse(where, e.message());
  }
  return c;
}

MotionObjective::MotionObjective(const ObjectiveConfig& config, const train::MotionDataset& data) : config_(config), poses_(data), body_(*data.header().skeleton) {
  check_distance(config_.distance, poses_.layout().representation);
  if (config_.distance == Distance::fk && config_.uniform_joints) refuse_usage("uniform joint weights with distance fk, which weighs no joints; expected another distance");
  alpha_ = nn::joint_weights(*data.header().skeleton, config_.joint_weight_floor);
  if (config_.uniform_joints) alpha_.fill_(alpha_.mean().item<float>());
  const double heaviest = alpha_.max().item<double>();
  alpha_ = alpha_.narrow(0, 1, poses_.layout().joints).contiguous();  // the root's rotation is among the six root values
  root_weights_ = torch::full({features::kRootValues}, config_.root_weight, torch::kFloat32);
  root_weights_.narrow(0, 4, 2).fill_(heaviest);
}

// (B T, points, 3)
Tensor MotionObjective::positions(const Tensor& unit, const Tensor& standardised) const {
  const std::int64_t frames = unit.size(0) * unit.size(1);
  const Tensor tilt = poses_.root(standardised).narrow(2, 4, 2).reshape({frames, 2});
  const Tensor root = nn::quaternions_of_vectors(torch::cat({tilt, torch::zeros({frames, 1})}, 1));
  return body_(torch::cat({root.unsqueeze(1), unit.reshape({frames, -1, 4})}, 1));
}

Tensor MotionObjective::operator()(const Tensor& y, const train::Batch& batch, Figures& figures) const {
  const std::int64_t b = y.size(0), t = y.size(1), rotations = poses_.layout().rotation_columns();
  const RotationRepresentation representation = poses_.layout().representation;
  const Tensor raw = poses_.rotations(y), real = poses_.rotations(batch.features), target = poses_.target(real);
  Tensor unit;
  const auto normalised = [&] {
    if (!unit.defined()) unit = poses_.unit(raw);
    return unit;
  };

  Tensor angle, distance;  // (B, T, J) without a gradient to keep, (B, T)
  switch (config_.distance) {
    case Distance::d1:
    case Distance::geodesic:
      // The angle is that of the normalised quaternion whatever its length.
      angle = nn::geodesic_distance(representation == RotationRepresentation::quaternion ? raw : normalised(), target);
      distance = torch::matmul(angle, alpha_);
      break;
    case Distance::d2: distance = torch::matmul(nn::quaternion_d2(normalised(), target), alpha_); break;
    case Distance::d3: distance = torch::matmul(nn::quaternion_d3(normalised(), target), alpha_); break;
    case Distance::l2: distance = torch::matmul((raw - real).square().sum(-1), alpha_); break;
    case Distance::fk: {
      const Tensor there = [&] {
        const torch::NoGradGuard no_grad;
        return positions(target, batch.features);
      }();
      // A micrometre keeps the slope finite.
      distance = ((positions(normalised(), y) - there).square().sum(-1) + 1e-12).sqrt().sum(-1).view({b, t});
      break;
    }
  }
  if (!angle.defined()) {
    if (config_.velocity_weight > 0) normalised();  // with its graph, before the guard
    const torch::NoGradGuard no_grad;
    angle = nn::geodesic_distance(unit.defined() ? unit : poses_.unit(raw), target);
  }

  // A thousandth of a deviation keeps the slope finite.
  const auto size_of_root = [&](const Tensor& e) { return torch::matmul((e.square() + 1e-6).sqrt() - 1e-3, root_weights_); };
  const Tensor root_error = y.narrow(2, rotations, features::kRootValues) - batch.features.narrow(2, rotations, features::kRootValues), root = size_of_root(root_error);
  Tensor frame_loss = distance + root;
  figures = {};
  if (representation != RotationRepresentation::axis_angle) {
    const Tensor constraint = representation == RotationRepresentation::quaternion
                                  ? config_.unit_norm_weight * nn::unit_norm_penalty(raw).sum(-1)
                                  : torch::matmul(nn::matrix_constraints(raw).sum(2), torch::tensor({config_.orthogonality_weight, config_.determinant_weight}, torch::kFloat32));
    frame_loss = frame_loss + constraint;
    figures.constraint = (constraint.detach() * batch.mask).sum().item<double>();
  }
  if (config_.velocity_weight > 0 && t > 1) {
    const Tensor error = beside(normalised(), target) - target;
    const Tensor change = error.narrow(1, 1, t - 1) - error.narrow(1, 0, t - 1);
    // |Delta q| is half an angle: twice it weighs like the distances above. The small constant keeps the slope finite.
    const Tensor turned = torch::matmul(2 * (change.square().sum(-1) + 1e-8).sqrt(), alpha_);
    const Tensor velocity = (turned + size_of_root(root_error.narrow(1, 1, t - 1) - root_error.narrow(1, 0, t - 1))) * batch.mask.narrow(1, 1, t - 1);
    frame_loss = torch::cat({frame_loss.narrow(1, 0, 1), frame_loss.narrow(1, 1, t - 1) + config_.velocity_weight * velocity}, 1);
    figures.velocity = velocity.detach().sum().item<double>();
  }
  figures.angle = (angle.detach().mean(-1) * batch.mask).sum().item<double>();
  figures.distance = (distance.detach() * batch.mask).sum().item<double>();
  figures.root = (root.detach() * batch.mask).sum().item<double>();
  return frame_loss * batch.mask;
}

}  // namespace mocap::objective
