// RMSProp (Tieleman & Hinton 2012, lecture 6.5) over named parameters, with state that can be written down and restored.
//
//   v = rho v + (1 - rho) g^2,   p -= lr g / (sqrt(v) + eps)
//
// v starts at 0, as in torch::optim::RMSprop, to which it is equal within 1e-6 (tested): the first step is lr / sqrt(1 - rho) long.
#pragma once
#include "libmodels/train/optimizer.hpp"

namespace mocap::train {

class RmsProp final : public Optimizer {
 public:
  struct Options {
    double decay = 0.9, epsilon = 1e-8;
  };
  RmsProp(NamedTensors parameters, Options options);
  explicit RmsProp(NamedTensors parameters) : RmsProp(std::move(parameters), Options()) {}

  void step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first = 0) override;
  std::map<std::string, torch::Tensor> state() const override;  // "<name>/v"
  void set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps) override;

 private:
  NamedTensors parameters_;
  std::vector<torch::Tensor> v_;
  Options options_;
};

}  // namespace mocap::train
