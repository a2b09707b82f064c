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

void Adam::step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first) {
  const torch::NoGradGuard no_grad;
  if (first != 0 || gradients.size() != parameters_.size()) throw Error(Exit::internal, {}, "Adam: a part of the parameters, expected all");
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
  for (std::size_t i = 0; i < parameters_.size(); ++i) {
    restore(state, parameters_[i].first + "/m", m_[i]);
    restore(state, parameters_[i].first + "/v", v_[i]);
  }
  steps_ = steps;
}

}  // namespace mocap::train
