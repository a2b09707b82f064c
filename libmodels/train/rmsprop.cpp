#include "libmodels/train/rmsprop.hpp"

namespace mocap::train {

RmsProp::RmsProp(NamedTensors parameters, Options options) : parameters_(std::move(parameters)), options_(options) {
  for (const auto& [name, p] : parameters_) v_.push_back(torch::zeros_like(p, torch::MemoryFormat::Contiguous).detach());
}

void RmsProp::step(const std::vector<torch::Tensor>& gradients, double learning_rate, std::size_t first) {
  const torch::NoGradGuard no_grad;
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    torch::Tensor& v = v_.at(first + i);
    v.mul_(options_.decay).addcmul_(gradients[i], gradients[i], 1 - options_.decay);
    parameters_[first + i].second.addcdiv_(gradients[i], v.sqrt().add_(options_.epsilon), -learning_rate);
  }
}

std::map<std::string, torch::Tensor> RmsProp::state() const {
  std::map<std::string, torch::Tensor> out;
  for (std::size_t i = 0; i < parameters_.size(); ++i) out[parameters_[i].first + "/v"] = v_[i];
  return out;
}

void RmsProp::set_state(const std::map<std::string, torch::Tensor>& state, std::int64_t) {
  for (std::size_t i = 0; i < parameters_.size(); ++i) restore(state, parameters_[i].first + "/v", v_[i]);
}

}  // namespace mocap::train
