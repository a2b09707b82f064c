#include "libmodels/train/optimizer.hpp"

#include <cmath>

#include "libmocap/base/error.hpp"

namespace mocap::train {

double clip_gradients(std::vector<torch::Tensor>& gradients, double limit) {
  const torch::NoGradGuard no_grad;
  double sum = 0;
  for (const auto& g : gradients) {
    const double n = g.norm().item<double>();
    sum += n * n;
  }
  const double norm = std::sqrt(sum);
  if (norm > limit)
    for (auto& g : gradients) g = g * (limit / norm);  // not in place: gradients may share memory, also with themselves (expand)
  return norm;
}

void clip_entries(std::vector<torch::Tensor>& gradients, double limit) {
  const torch::NoGradGuard no_grad;
  for (auto& g : gradients) g = g.clamp(-limit, limit);
}

void restore(const std::map<std::string, torch::Tensor>& state, const std::string& name, torch::Tensor& target) {
  const torch::NoGradGuard no_grad;
  const auto it = state.find(name);
  if (it == state.end() || it->second.sizes() != target.sizes()) refuse({{}, 0, "training/" + name}, "missing or of another shape, expected the state of the training");
  target.copy_(it->second);
}

}  // namespace mocap::train
