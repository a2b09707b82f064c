#include "libmodels/classifier/network.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/convolution.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::classifier {
namespace {

constexpr int kMost = 1024;

features::MotionCellLayout layout_of(int joints) { return {joints, features::RotationRepresentation::quaternion}; }

// (B, T, 1) 1 where a frame is real.
torch::Tensor mask_of(const std::vector<std::int64_t>& lengths, std::int64_t frames) {
  torch::Tensor mask = torch::zeros({static_cast<std::int64_t>(lengths.size()), frames, 1}, torch::kFloat32);
  for (std::size_t b = 0; b < lengths.size(); ++b) mask[static_cast<std::int64_t>(b)].narrow(0, 0, lengths[b]).fill_(1);
  return mask;
}

}  // namespace

int NetworkConfig::inputs() const { return 2 * layout_of(joints).columns(); }

void NetworkConfig::validate() const {
  const auto check = [](const char* name, int value, int low, int high) {
    if (value < low || value > high) refuse({{}, 0, "config"}, fmt::format("{} is {}, expected a whole number in {}..{}", name, value, low, high));
  };
  check("joints", joints, 1, 1 << 16);
  check("classes", classes, 2, 1 << 16);
  check("kernel", kernel, 1, 99);
  if (kernel % 2 == 0) refuse({{}, 0, "config"}, fmt::format("kernel is {}, expected an odd number", kernel));
  if (widths.empty() || widths.size() > 16 || widths.size() != strides.size()) refuse({{}, 0, "config"}, fmt::format("{} widths and {} strides, expected one of each a layer, at most 16", widths.size(), strides.size()));
  for (const int width : widths) check("a width", width, 1, kMost);
  for (const int stride : strides) check("a stride", stride, 1, 16);
  check("the last width", widths.back(), 1, 64);
}

std::int64_t NetworkConfig::parameter_count() const {
  std::int64_t n = 0, in = inputs();
  for (const int width : widths) {
    n += width * (in * kernel + 1);
    in = width;
  }
  return n + classes * (in + 1);
}

nlohmann::json to_json(const NetworkConfig& c) {
  return {{"joints", c.joints}, {"widths", c.widths}, {"strides", c.strides}, {"kernel", c.kernel}, {"classes", c.classes}};
}

NetworkConfig network_config_from_json(const nlohmann::json& j) {
  NetworkConfig c;
  try {
    j.at("joints").get_to(c.joints);
    j.at("widths").get_to(c.widths);
    j.at("strides").get_to(c.strides);
    j.at("kernel").get_to(c.kernel);
    j.at("classes").get_to(c.classes);
  } catch (const nlohmann::json::exception&) {
    refuse({{}, 0, "config"}, "not the sizes of a classifier, expected joints, widths, strides, kernel and classes");
  }
  c.validate();
  return c;
}

Network::Network(const NetworkConfig& config, Random& random) : config_(config) {
  config_.validate();
  int in = config_.inputs();
  for (std::size_t i = 0; i < config_.widths.size(); ++i) {
    const int out = config_.widths[i];
    const std::string name = fmt::format("conv{}_", i);
    weights_.push_back(register_parameter(name + "weight", nn::normal_tensor({out, in, config_.kernel}, random) * std::sqrt(2.0 / (in * config_.kernel))));
    biases_.push_back(register_parameter(name + "bias", torch::zeros({out})));
    in = out;
  }
  score_weight_ = register_parameter("scores_weight", nn::normal_tensor({config_.classes, in}, random) * (0.5 / std::sqrt(static_cast<double>(in))));
  score_bias_ = register_parameter("scores_bias", torch::zeros({config_.classes}));
}

std::vector<torch::Tensor> Network::layers(const torch::Tensor& x, const std::vector<std::int64_t>& lengths) const {
  std::vector<torch::Tensor> all;
  std::vector<std::int64_t> real = lengths;
  torch::Tensor mask = mask_of(real, x.size(1)), y = x * mask;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const std::int64_t stride = config_.strides[i];
    y = torch::relu(nn::convolution(y, weights_[i], biases_[i], config_.strides[i]));
    for (auto& n : real) n = (n + stride - 1) / stride;
    mask = mask_of(real, y.size(1));
    y = y * mask;
    all.push_back(y.transpose(1, 2));
  }
  all.push_back(y.sum(1) / mask.sum(1));
  return all;
}

torch::Tensor Network::features(const torch::Tensor& x, const std::vector<std::int64_t>& lengths) const { return layers(x, lengths).back(); }

torch::Tensor Network::scores(const torch::Tensor& pooled) const { return torch::addmm(score_bias_, pooled, score_weight_.t()); }

features::FeatureMatrix encode(const Clip& clip) {
  const features::FeatureMatrix pose = features::encode_motion_cell(clip, features::RotationRepresentation::quaternion);
  const Eigen::Index frames = pose.rows(), d = pose.cols();
  features::FeatureMatrix x = features::FeatureMatrix::Zero(frames, 2 * d);
  x.leftCols(d) = pose;
  if (frames > 1) {
    x.block(0, d, frames - 1, d) = pose.bottomRows(frames - 1) - pose.topRows(frames - 1);
    x.block(frames - 1, d, 1, d) = x.block(frames - 2, d, 1, d);
  }
  if (!x.allFinite()) refuse({{}, 0, "clip " + clip.name}, "features that are not finite, expected motion of finite numbers");
  return x;
}

Statistics::Statistics(int joints) : layout_(layout_of(joints)), pose_(layout_), squares_(Eigen::VectorXd::Zero(layout_.columns())) {}

void Statistics::add(const features::FeatureMatrix& encoded) {
  pose_.add(encoded.leftCols(layout_.columns()));
  squares_ += encoded.rightCols(layout_.columns()).array().square().matrix().colwise().sum().transpose();
  count_ += static_cast<double>(encoded.rows());
}

std::vector<float> Statistics::mean() const {
  auto out = pose_.mean();
  out.resize(2 * out.size(), 0.0f);
  return out;
}

std::vector<float> Statistics::deviation() const {
  auto out = pose_.deviation();
  const int k = layout_.rotation_values();
  for (int c = 0; c < layout_.columns(); ++c) {
    const bool rotation = c < layout_.rotation_columns();
    const double largest = rotation ? squares_.segment(c / k * k, k).maxCoeff() : squares_[c];
    out.push_back(static_cast<float>(std::max(std::sqrt(largest / std::max(1.0, count_)), rotation ? 1e-3 : 1e-4)));
  }
  return out;
}

torch::Tensor standardise(const features::FeatureMatrix& encoded, const std::vector<float>& mean, const std::vector<float>& deviation) {
  torch::Tensor x = torch::empty({encoded.rows(), encoded.cols()}, torch::kFloat32);
  float* out = x.data_ptr<float>();
  for (Eigen::Index t = 0; t < encoded.rows(); ++t)
    for (Eigen::Index c = 0; c < encoded.cols(); ++c) {
      const auto i = static_cast<std::size_t>(c);
      *out++ = static_cast<float>(std::clamp((encoded(t, c) - mean[i]) / deviation[i], -kFarthest, kFarthest));
    }
  return x;
}

}  // namespace mocap::classifier
