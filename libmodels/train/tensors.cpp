#include "libmodels/train/tensors.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "libmocap/base/error.hpp"

namespace mocap::train {

store::Tensor to_stored(const torch::Tensor& tensor) {
  const torch::Tensor t = tensor.detach().to(torch::kCPU, torch::kFloat32).contiguous();
  store::Tensor out;
  out.shape = t.sizes().vec();
  out.values.assign(t.data_ptr<float>(), t.data_ptr<float>() + t.numel());
  return out;
}

torch::Tensor from_stored(const store::Tensor& stored) {
  const torch::Tensor t = torch::empty(stored.shape, torch::kFloat32);
  std::copy(stored.values.begin(), stored.values.end(), t.data_ptr<float>());
  return t;
}

std::map<std::string, store::Tensor> to_stored(const NamedTensors& tensors) {
  std::map<std::string, store::Tensor> out;
  for (const auto& [name, tensor] : tensors) out[name] = to_stored(tensor);
  return out;
}

void load_weights(const NamedTensors& parameters, const std::map<std::string, store::Tensor>& stored, const std::string& file) {
  const torch::NoGradGuard no_grad;
  for (const auto& [name, parameter] : parameters) {
    const auto it = stored.find(name);
    if (it == stored.end()) refuse({file, 0, "weights/" + name}, "missing, expected one tensor for each parameter of the network");
    if (it->second.shape != parameter.sizes().vec())
      refuse({file, 0, "weights/" + name}, fmt::format("shape {}, expected {}", fmt::join(it->second.shape, " x "), fmt::join(parameter.sizes().vec(), " x ")));
    torch::Tensor target = parameter;
    target.copy_(from_stored(it->second));
  }
  if (stored.size() != parameters.size()) refuse({file, 0, "weights"}, fmt::format("{} tensors, expected the {} of the network", stored.size(), parameters.size()));
}

}  // namespace mocap::train
