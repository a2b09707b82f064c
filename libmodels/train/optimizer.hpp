// What the training loop asks of an optimiser, and how gradients are kept within bounds.
#pragma once
#include <torch/torch.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace mocap::train {

using NamedTensors = std::vector<std::pair<std::string, torch::Tensor>>;

class Optimizer {
 public:
  virtual ~Optimizer() = default;
  // One update of the parameters from `first` on, one for each gradient.
  virtual void step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first = 0) = 0;
  // Everything that the next update depends on beside the number of steps, by name; set_state throws Error(data) where one is missing or of another shape.
  virtual std::map<std::string, torch::Tensor> state() const = 0;
  virtual void set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps) = 0;
};

// Scales all gradients so that their joint Euclidean norm is at most `limit`; returns the norm before. Sums in double, in
// the order given.
double clip_gradients(std::vector<torch::Tensor>& gradients, double limit);

// Brings every entry into [-limit, limit].
void clip_entries(std::vector<torch::Tensor>& gradients, double limit);

// Copies the entry `name` of a state; Error(data) where it is missing or of another shape.
void restore(const std::map<std::string, torch::Tensor>& state, const std::string& name, torch::Tensor& target);

}  // namespace mocap::train
