#include "libmodels/denoiser/network.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/features/motion_cell.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::denoiser {

int NetworkConfig::columns() const { return features::MotionCellLayout{joints, features::RotationRepresentation::quaternion}.columns(); }

void NetworkConfig::validate() const {
  const auto check = [](const char* name, int value) {
    if (value < 1 || value > 1 << 14) refuse({{}, 0, "config"}, fmt::format("{} is {}, expected a whole number in 1..{}", name, value, 1 << 14));
  };
  check("joints", joints);
  check("width", width);
  check("code", code);
}

std::int64_t NetworkConfig::parameter_count() const {
  const std::int64_t d = columns(), w = width, c = code;
  return d * w * 5 + w + w * c * 5 + c + c * w * 4 + w + w * d * 5 + d;
}

nlohmann::json to_json(const NetworkConfig& c) { return {{"joints", c.joints}, {"width", c.width}, {"code", c.code}}; }

NetworkConfig network_config_from_json(const nlohmann::json& j) {
  NetworkConfig c;
  try {
    j.at("joints").get_to(c.joints);
    j.at("width").get_to(c.width);
    j.at("code").get_to(c.code);
  } catch (const nlohmann::json::exception&) {
    refuse({{}, 0, "config"}, "not the sizes of a denoiser, expected joints, width and code");
  }
  c.validate();
  return c;
}

Network::Network(const NetworkConfig& config, Random& random) : config_(config) {
  config_.validate();
  const int d = config_.columns(), w = config_.width, c = config_.code;
  const auto weight = [&](const char* name, at::IntArrayRef shape, double fan_in) { return register_parameter(name, nn::normal_tensor(shape, random) * std::sqrt(2.0 / fan_in)); };
  w1_ = weight("conv1_weight", {w, d, 5}, 5.0 * d);
  b1_ = register_parameter("conv1_bias", torch::zeros({w}));
  w2_ = weight("conv2_weight", {c, w, 5}, 5.0 * w);
  b2_ = register_parameter("conv2_bias", torch::zeros({c}));
  w3_ = weight("deconv1_weight", {c, w, 4}, 2.0 * c);  // at stride 2 two of the four taps meet in a frame
  b3_ = register_parameter("deconv1_bias", torch::zeros({w}));
  w4_ = register_parameter("deconv2_weight", torch::zeros({w, d, 5}));
  b4_ = register_parameter("deconv2_bias", torch::zeros({d}));
}

torch::Tensor Network::forward(const torch::Tensor& x) const {
  torch::Tensor y = torch::relu(torch::conv1d(x.transpose(1, 2).clamp(-kFarthest, kFarthest).contiguous(), w1_, b1_, 1, 2));
  y = torch::relu(torch::conv1d(y, w2_, b2_, 2, 2));
  y = torch::relu(torch::conv_transpose1d(y, w3_, b3_, 2, 1));
  y = torch::conv_transpose1d(y, w4_, b4_, 1, 2);
  return x + y.transpose(1, 2);
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
