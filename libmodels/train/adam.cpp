#include "libmodels/train/adam.hpp"

#include <cmath>

#include "libmocap/base/error.hpp"

namespace mocap::train {

Adam::Adam(NamedTensors parameters, Options options) : parameters_(std::move(parameters)), options_(options) {
  for (const auto& [name, p] : parameters_) {
    m_.push_back(torch::zeros_like(p, torch::MemoryFormat::Contiguous).detach());
    v_.push_back(torch::zeros_like(p, torch::MemoryFormat::Contiguous).detach());
  }
}

void Adam::step(const std::vector<torch::Tensor>& gradients, double learning_rate) {
  const torch::NoGradGuard no_grad;
  ++steps_;
  const double correction1 = 1 - std::pow(options_.beta1, static_cast<double>(steps_));
  const double correction2 = 1 - std::pow(options_.beta2, static_cast<double>(steps_));
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    m_[i].mul_(options_.beta1).add_(gradients[i], 1 - options_.beta1);
    v_[i].mul_(options_.beta2).addcmul_(gradients[i], gradients[i], 1 - options_.beta2);
    const torch::Tensor denominator = (v_[i] / correction2).sqrt_().add_(options_.epsilon);
    parameters_[i].second.addcdiv_(m_[i], denominator, -learning_rate / correction1);
  }
}

std::map<std::string, torch::Tensor> Adam::state() const {
  std::map<std::string, torch::Tensor> out;
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    out[parameters_[i].first + "/m"] = m_[i];
    out[parameters_[i].first + "/v"] = v_[i];
  }
  return out;
}

void Adam::set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t steps) {
  const torch::NoGradGuard no_grad;
  for (std::size_t i = 0; i < parameters_.size(); ++i)
    for (auto [suffix, target] : {std::pair{"/m", &m_[i]}, std::pair{"/v", &v_[i]}}) {
      const auto it = state.find(parameters_[i].first + suffix);
      if (it == state.end() || it->second.sizes() != target->sizes())
        refuse({{}, 0, "training/" + parameters_[i].first + suffix}, "missing or of another shape, expected the optimizer's state");
      target->copy_(it->second);
    }
  steps_ = steps;
}

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

}  // namespace mocap::train
