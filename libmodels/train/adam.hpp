// Adam (Kingma & Ba 2014, algorithm 1) over named parameters, with state that can be written down and restored.
//
//   m = b1 m + (1 - b1) g,   v = b2 v + (1 - b2) g^2,   p -= lr (m / (1 - b1^t)) / (sqrt(v / (1 - b2^t)) + eps)
//
// torch::optim::Adam keys its state by addresses, in a way that differs between LibTorch 1.13 and 2.x; here the key is the
// parameter's name. Equal to torch::optim::Adam within 1e-6 (tested). No weight decay (Ghorbani et al. 4.2).
#pragma once
#include "libmodels/train/optimizer.hpp"

namespace mocap::train {

class Adam final : public Optimizer {
 public:
  struct Options {
    double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  };
  explicit Adam(NamedTensors parameters) : Adam(std::move(parameters), Options()) {}
  Adam(NamedTensors parameters, Options options);

  // All parameters at once (`first` 0): the corrections for the start count steps.
  void step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first = 0) override;

  std::int64_t steps() const { return steps_; }
  std::map<std::string, torch::Tensor> state() const override;  // "<name>/m", "<name>/v"
  void set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps) override;

 private:
  NamedTensors parameters_;
  std::vector<torch::Tensor> m_, v_;
  Options options_;
  std::int64_t steps_ = 0;
};

}  // namespace mocap::train
