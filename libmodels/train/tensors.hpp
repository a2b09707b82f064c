// Tensors between LibTorch and the model container.
#pragma once
#include <torch/torch.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "libmocap/store/model_file.hpp"
#include "libmodels/train/optimizer.hpp"

namespace mocap::train {

store::Tensor to_stored(const torch::Tensor& tensor);     // float32, C order
torch::Tensor from_stored(const store::Tensor& tensor);   // a copy
std::map<std::string, store::Tensor> to_stored(const NamedTensors& tensors);

// Copies stored weights into parameters. Error(data) naming the first parameter that is missing, superfluous or of another
// shape.
void load_weights(const NamedTensors& parameters, const std::map<std::string, store::Tensor>& stored, const std::string& file);

// Before a network is built from a file: `columns` finite means and deviations above 0, and `parameters` finite weights in all, so that a few
// numbers in a small file cannot ask for all memory. Error(data) naming the part.
void check_numbers(const store::ModelFile& model, std::int64_t columns, std::int64_t parameters, const std::string& file);

// What classifiers and denoisers say of themselves in /config.
struct Described {
  nlohmann::json network;  // null where there is none
  double frame_rate_hz = 0;
};
// Error(data) for a model of another kind, naming `kind` and the tool that makes one. 0 Hz where no rate is given.
Described described(const store::ModelFile& model, const std::string& kind, const std::string& file);

}  // namespace mocap::train
