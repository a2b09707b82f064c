// Updates as the training loop makes them, without its files.
#pragma once
#include <memory>
#include <vector>

#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::bench {

class Stepper {
 public:
  Stepper(train::Trainable& training, int shards, int threads, std::int64_t first_step = 0) : training_(training), optimizer_(training.optimizer()), executor_(shards, threads), step_(first_step) {
    for (const auto& [name, tensor] : training.parameters()) parameters_.push_back(tensor.set_requires_grad(true));
  }
  void operator()() {
    training_.prepare(step_);
    const auto [first, count] = training_.trained();
    const std::vector<torch::Tensor> trained(parameters_.begin() + static_cast<std::ptrdiff_t>(first), parameters_.begin() + static_cast<std::ptrdiff_t>(first + count));
    train::LossTerms sums;
    auto gradient = executor_.compute(trained, [&](int shard) {
      train::LossTerms terms;
      nn::ShardedGradient::Share share{training_.shard_loss(shard, terms), {}};
      if (shard == 0) sums = terms;
      return share;
    });
    optimizer_->step(gradient.gradients, training_.learning_rate(step_), first);
    training_.updated(sums);
    ++step_;
  }

 private:
  train::Trainable& training_;
  std::unique_ptr<train::Optimizer> optimizer_;
  nn::ShardedGradient executor_;
  std::vector<torch::Tensor> parameters_;
  std::int64_t step_;
};

}  // namespace mocap::bench
