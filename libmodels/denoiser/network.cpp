#include "libmodels/denoiser/network.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "libmocap/base/error.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmodels/nn/convolution.hpp"

namespace mocap::denoiser {
namespace {

constexpr std::int64_t kKernel = 5;

}  // namespace

int NetworkConfig::columns() const { return features::MotionCellLayout{joints, features::RotationRepresentation::quaternion}.columns(); }

void NetworkConfig::validate() const {
  if (joints < 1 || joints > 1 << 12) refuse({{}, 0, "config"}, fmt::format("joints is {}, expected a whole number in 1..{}", joints, 1 << 12));
}

std::int64_t NetworkConfig::parameter_count() const {
  const std::int64_t d = columns(), w = 2 * d;
  return kKernel * (2 * d * w + 2 * w * w) + 3 * w + d;
}

nlohmann::json to_json(const NetworkConfig& c) { return {{"joints", c.joints}}; }

NetworkConfig network_config_from_json(const nlohmann::json& j) {
  NetworkConfig c;
  try {
    j.at("joints").get_to(c.joints);
  } catch (const nlohmann::json::exception&) {
    refuse({{}, 0, "config"}, "not the sizes of a denoiser, expected joints");
  }
  c.validate();
  return c;
}

Network::Network(const NetworkConfig& config) : config_(config) {
  config_.validate();
  const int d = config_.columns(), w = 2 * d;
  // What goes through: a convolution's (out, in, k), a transposed one's (in, out, k), each `start` spread over the taps.
  const torch::Tensor one = torch::tensor({0.0F, 0.0F, 1.0F, 0.0F, 0.0F}), smooth = torch::tensor({-3.0F, 12.0F, 17.0F, 12.0F, -3.0F}) / 35;
  const auto weight = [&](const char* name, const torch::Tensor& start, const torch::Tensor& taps) { return register_parameter(name, start.unsqueeze(2) * taps); };
  const torch::Tensor identity = torch::eye(d), both = torch::cat({identity, -identity});
  w1_ = weight("conv1_weight", both, smooth);
  b1_ = register_parameter("conv1_bias", torch::zeros({w}));
  w2_ = weight("conv2_weight", torch::eye(w), one);
  b2_ = register_parameter("conv2_bias", torch::zeros({w}));
  w3_ = weight("deconv1_weight", torch::eye(w), one);
  b3_ = register_parameter("deconv1_bias", torch::zeros({w}));
  w4_ = weight("deconv2_weight", both, smooth);
  b4_ = register_parameter("deconv2_bias", torch::zeros({d}));
}

torch::Tensor Network::forward(const torch::Tensor& x) const {
  // A transposed convolution of stride 1 is one with the kernel turned round.
  const auto turned = [](const torch::Tensor& weight) { return weight.transpose(0, 1).flip(2); };
  torch::Tensor y = torch::relu(nn::convolution(x.clamp(-kCut, kCut), w1_, b1_));
  y = torch::relu(nn::convolution(y, w2_, b2_));
  y = torch::relu(nn::convolution(y, turned(w3_), b3_));
  return nn::convolution(y, turned(w4_), b4_);
}

torch::Tensor with_edges(const torch::Tensor& x, std::int64_t first, std::int64_t count) {
  const std::int64_t frames = x.size(0), total = count + 2 * kReach;
  torch::Tensor out = torch::empty({total, x.size(1)}, x.options());
  for (std::int64_t t = 0; t < total;) {
    const std::int64_t at = first - kReach + t;
    if (at >= 0 && at < frames) {
      const std::int64_t n = std::min(total - t, frames - at);
      out.narrow(0, t, n).copy_(x.narrow(0, at, n));
      t += n;
    } else {
      const std::int64_t n = at < 0 ? std::min(total - t, -at) : total - t;
      out.narrow(0, t, n).copy_(x[at < 0 ? 0 : frames - 1].expand({n, -1}));
      t += n;
    }
  }
  return out;
}

}  // namespace mocap::denoiser
