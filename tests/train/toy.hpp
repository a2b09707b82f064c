// The smallest training: linear regression on batches that depend on (seed, step) alone.
#pragma once
#include <torch/torch.h>

#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "libmocap/base/random.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::testing {

struct ToySettings {
  std::int64_t steps = 40;
  double rate = 0.05, limit = 1e9;
  int shards = 4;
  std::uint64_t seed = 3;
  std::int64_t nan_at = -1;  // the step whose loss is not finite
};

class Toy final : public train::Trainable {
 public:
  static constexpr int kIn = 5, kOut = 3, kBatch = 16;
  using Settings = ToySettings;
  explicit Toy(Settings settings = {}) : settings_(settings) {
    Random random(settings.seed, 1), truth(99, 0);
    weight_ = nn::normal_tensor({kIn, kOut}, random).set_requires_grad(true);
    bias_ = torch::zeros({kOut}).set_requires_grad(true);
    true_weight_ = nn::normal_tensor({kIn, kOut}, truth);
  }

  store::ModelFile describe() const override {
    store::ModelFile file;
    file.kind = "toy";
    file.config = nlohmann::json{{"rate", settings_.rate}}.dump();
    file.skeleton = canonical_body();
    return file;
  }
  std::string identity() const override {
    return nlohmann::json{{"seed", settings_.seed}, {"steps", settings_.steps}, {"optimizer", {{"rate", settings_.rate}}}, {"stages", std::vector<int>(extra_stages + 1, 7)}}.dump();
  }
  train::NamedTensors parameters() override { return {{"layer/weight", weight_}, {"layer/bias", bias_}}; }
  std::int64_t steps() const override { return settings_.steps; }
  std::int64_t steps_per_epoch() const override { return 8; }
  double learning_rate(std::int64_t step) const override { return settings_.rate * (1 - 0.5 * static_cast<double>(step) / static_cast<double>(settings_.steps)); }
  double gradient_limit() const override { return settings_.limit; }
  int shards() const override { return settings_.shards; }
  void prepare(std::int64_t step) override {
    step_ = step;
    Random random(settings_.seed, stream_of(2, static_cast<std::uint64_t>(step)));
    x_ = nn::normal_tensor({kBatch, kIn}, random);
    y_ = x_.matmul(true_weight_) + 0.5;
    if (after_prepare) after_prepare(step);
  }
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override {
    const auto [first, last] = nn::shard_range(kBatch, settings_.shards, shard);
    const torch::Tensor error = (x_.narrow(0, first, last - first).matmul(weight_) + bias_ - y_.narrow(0, first, last - first)).square().sum() / kBatch;
    const double bad = step_ == settings_.nan_at ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    terms = {{"square_error", error.item<double>()}, {"nonsense", bad}};
    return error + bad;
  }
  std::optional<double> validation_loss() override { return (weight_ - true_weight_).square().sum().item<double>(); }

  std::function<void(std::int64_t)> after_prepare;
  int extra_stages = 0;

 private:
  Settings settings_;
  torch::Tensor weight_, bias_, true_weight_, x_, y_;
  std::int64_t step_ = 0;
};

}  // namespace mocap::testing
