#include "libmodels/train/tensors.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

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

void check_numbers(const store::ModelFile& model, std::int64_t columns, std::int64_t parameters, const std::string& file) {
  const auto finite = [](float v) { return std::isfinite(v); };
  if (static_cast<std::int64_t>(model.mean.size()) != columns || static_cast<std::int64_t>(model.deviation.size()) != columns)
    refuse({file, 0, "normalization"}, fmt::format("{} means and {} deviations, expected {}", model.mean.size(), model.deviation.size(), columns));
  if (!std::all_of(model.mean.begin(), model.mean.end(), finite) || !std::all_of(model.deviation.begin(), model.deviation.end(), [&](float v) { return finite(v) && v > 0; }))
    refuse({file, 0, "normalization"}, "a mean that is not finite or a deviation that is not above 0");
  std::int64_t stored = 0;
  for (const auto& [name, tensor] : model.weights) {
    stored += static_cast<std::int64_t>(tensor.values.size());
    if (!std::all_of(tensor.values.begin(), tensor.values.end(), finite)) refuse({file, 0, "weights/" + name}, "a value that is not finite");
  }
  if (stored != parameters) refuse({file, 0, "weights"}, fmt::format("{} values, expected the {} of the network in config", stored, parameters));
}

Described described(const store::ModelFile& model, const std::string& kind, const std::string& file) {
  if (model.kind != kind) refuse({file, 0, {}}, "a model of kind '" + model.kind + "', expected a " + kind, "train-" + kind + " makes one");
  const auto config = nlohmann::json::parse(model.config, [](int depth, nlohmann::json::parse_event_t, nlohmann::json&) { return depth < 32; }, false);
  Described out;
  if (config.is_object() && config.contains("network")) out.network = config["network"];
  if (config.is_object() && config.contains("frame_rate_hz") && config["frame_rate_hz"].is_number()) out.frame_rate_hz = config["frame_rate_hz"].get<double>();
  return out;
}

}  // namespace mocap::train
