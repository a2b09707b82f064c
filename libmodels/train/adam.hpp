// Adam (Kingma & Ba 2014, algorithm 1) over named parameters, with state that can be written down and restored.
//
//   m = b1 m + (1 - b1) g,   v = b2 v + (1 - b2) g^2,   p -= lr (m / (1 - b1^t)) / (sqrt(v / (1 - b2^t)) + eps)
//
// torch::optim::Adam keys its state by addresses, in a way that differs between LibTorch 1.13 and 2.x; here the key is the
// parameter's name. Equal to torch::optim::Adam within 1e-6 (tested). No weight decay (Ghorbani et al. 4.2).
#pragma once
#include <torch/torch.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace mocap::train {

using NamedTensors = std::vector<std::pair<std::string, torch::Tensor>>;

class Adam {
 public:
  struct Options {
    double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  };
  explicit Adam(NamedTensors parameters) : Adam(std::move(parameters), Options()) {}
  Adam(NamedTensors parameters, Options options);

  // One update; gradients in the order of the parameters.
  void step(const std::vector<torch::Tensor>& gradients, double learning_rate);

  std::int64_t steps() const { return steps_; }
  // "<name>/m", "<name>/v" -> tensor; set_state throws Error(data) where one is missing or of another shape.
  std::map<std::string, torch::Tensor> state() const;
  void set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps);

 private:
  NamedTensors parameters_;
  std::vector<torch::Tensor> m_, v_;
  Options options_;
  std::int64_t steps_ = 0;
};

// Scales all gradients so that their joint Euclidean norm is at most `limit`; returns the norm before. Sums in double, in
// the order given.
double clip_gradients(std::vector<torch::Tensor>& gradients, double limit);

}  // namespace mocap::train
