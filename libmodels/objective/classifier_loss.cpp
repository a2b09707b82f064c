#include "libmodels/objective/classifier_loss.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmodels/classifier/network.hpp"

namespace mocap::objective {

using torch::Tensor;

struct ClassifierLoss::Frozen {
  std::unique_ptr<classifier::Classifier> model;
  Tensor mean, deviation;  // (2 D)
};

ClassifierLoss::~ClassifierLoss() = default;

ClassifierLoss::ClassifierLoss(const std::vector<std::string>& files, const train::MotionDataset& data) : poses_(data) {
  for (const auto& path : files) {
    std::string digest;
    Frozen c;
    c.model = classifier::Classifier::load(path, &digest);
    if (!c.model->skeleton()->same_as(*data.header().skeleton, 1e-5)) refuse({path, 0, "skeleton"}, "another skeleton than the training data's", "train the classifier on motion of the same body");
    if (std::abs(c.model->frame_rate_hz() - data.header().frame_rate_hz) > 1e-9 * data.header().frame_rate_hz)
      refuse({path, 0, {}}, fmt::format("a classifier for {} Hz, expected the {} Hz of the training data", c.model->frame_rate_hz(), data.header().frame_rate_hz));
    if (std::find(digests_.begin(), digests_.end(), digest) != digests_.end()) refuse({path, 0, {}}, "the same classifier a second time, expected each once");
    for (const Tensor& p : c.model->network().parameters()) p.requires_grad_(false);
    c.mean = torch::tensor(c.model->mean(), torch::kFloat32);
    c.deviation = torch::tensor(c.model->deviation(), torch::kFloat32);
    digests_.push_back(std::move(digest));
    classifiers_.push_back(std::move(c));
  }
}

nlohmann::json ClassifierLoss::to_json() const {
  nlohmann::json all = nlohmann::json::array();
  for (std::size_t i = 0; i < classifiers_.size(); ++i) all.push_back({{"attribute", classifiers_[i].model->attribute()}, {"sha256", digests_[i]}});
  return all;
}

namespace {

// (B, T, D) poses -> (B, T, 2 D) with the change to the next frame, the last of a row's repeated, as classifier::encode() has it.
Tensor with_changes(const Tensor& pose, const std::vector<std::int64_t>& lengths) {
  const std::int64_t t = pose.size(1);
  if (t == 1) return torch::cat({pose, torch::zeros_like(pose)}, 2);
  const Tensor change = pose.narrow(1, 1, t - 1) - pose.narrow(1, 0, t - 1);
  Tensor next = torch::cat({change, change.narrow(1, t - 2, 1)}, 1);
  if (std::any_of(lengths.begin(), lengths.end(), [&](std::int64_t n) { return n < t; })) {
    const Tensor last = torch::zeros({pose.size(0), t, 1}, torch::kBool), none = torch::zeros({pose.size(0), 1, 1}, torch::kBool);
    for (std::size_t b = 0; b < lengths.size(); ++b) {
      last.data_ptr<bool>()[static_cast<std::int64_t>(b) * t + lengths[b] - 1] = true;
      none.data_ptr<bool>()[b] = lengths[b] == 1;
    }
    next = torch::where(last, torch::cat({change.narrow(1, 0, 1), change}, 1), next);
    next = torch::where(none, torch::zeros({}), next);
  }
  return torch::cat({pose, next}, 2);
}

}  // namespace

Tensor ClassifierLoss::operator()(const Tensor& y, const train::Batch& batch) const {
  const std::int64_t b = y.size(0), t = y.size(1);
  const Tensor counted = batch.mask.sum(1).to(torch::kInt64).contiguous();
  const std::vector<std::int64_t> lengths(counted.data_ptr<std::int64_t>(), counted.data_ptr<std::int64_t>() + b);
  const Tensor target = poses_.target(poses_.rotations(batch.features));
  const auto seen = [&](const Tensor& quaternions, const Tensor& standardised) { return with_changes(torch::cat({quaternions.reshape({b, t, -1}), poses_.root(standardised)}, 2), lengths); };
  const Tensor real = seen(target, batch.features);
  const Tensor made = seen(beside(poses_.unit(poses_.rotations(y)), target), y);

  Tensor loss = torch::zeros({});
  for (const Frozen& c : classifiers_) {
    const classifier::Network& network = c.model->network();
    const auto standardised = [&](const Tensor& x) { return ((x - c.mean) / c.deviation).clamp(-classifier::kFarthest, classifier::kFarthest); };
    std::vector<Tensor> goal;
    Tensor opinion;  // log of the class probabilities
    {
      const torch::NoGradGuard no_grad;
      goal = network.layers(standardised(real), lengths);
      opinion = torch::log_softmax(network.scores(goal.back()), 1);
    }
    const std::vector<Tensor> layers = network.layers(standardised(made), lengths);
    for (std::size_t i = 0; i + 1 < layers.size(); ++i)
      loss = loss + (layers[i] - goal[i]).square().sum() / (goal[i].square().sum() + 1e-6 * static_cast<double>(goal[i].size(0) * goal[i].size(1)));  // a layer that sees nothing divides by that
    const Tensor scores = torch::log_softmax(network.scores(layers.back()), 1);
    loss = loss + (opinion.exp() * (opinion - scores)).sum() / static_cast<double>(b);
  }
  return loss;
}

}  // namespace mocap::objective
