// Adam for networks that are trained one after the other: each stage has its own moments and its own count of steps, which the corrections for the start go by.
#pragma once
#include "libmodels/train/adam.hpp"

namespace mocap::train {

class StagedAdam final : public Optimizer {
 public:
  struct Stage {
    std::size_t first = 0, count = 0;  // of the parameters
    std::int64_t begin = 0;            // the training's step with which it begins; it ends where the next one begins
  };
  StagedAdam(const NamedTensors& parameters, std::vector<Stage> stages);

  // `first` names the stage: Error(internal) where none begins there.
  void step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first = 0) override;
  std::map<std::string, torch::Tensor> state() const override;
  void set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps) override;

 private:
  std::vector<Stage> stages_;
  std::vector<Adam> adams_;
};

}  // namespace mocap::train
