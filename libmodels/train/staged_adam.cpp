#include "libmodels/train/staged_adam.hpp"

#include <algorithm>

#include "libmocap/base/error.hpp"

namespace mocap::train {

StagedAdam::StagedAdam(const NamedTensors& parameters, std::vector<Stage> stages) : stages_(std::move(stages)) {
  for (const Stage& stage : stages_) {
    const auto begin = parameters.begin() + static_cast<std::ptrdiff_t>(stage.first);
    adams_.emplace_back(NamedTensors(begin, begin + static_cast<std::ptrdiff_t>(stage.count)));
  }
}

void StagedAdam::step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first) {
  for (std::size_t i = 0; i < stages_.size(); ++i)
    if (stages_[i].first == first) return adams_[i].step(gradients, learning_rate);
  throw Error(Exit::internal, {}, "StagedAdam: parameters of no stage");
}

std::map<std::string, torch::Tensor> StagedAdam::state() const {
  std::map<std::string, torch::Tensor> all;
  for (const Adam& adam : adams_) all.merge(adam.state());
  return all;
}

void StagedAdam::set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps) {
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    const std::int64_t end = i + 1 < stages_.size() ? stages_[i + 1].begin : steps;
    adams_[i].set_state(state, std::clamp<std::int64_t>(std::min(steps, end) - stages_[i].begin, 0, steps));
  }
}

}  // namespace mocap::train
