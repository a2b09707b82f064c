// Tensors between LibTorch and the model container.
#pragma once
#include <torch/torch.h>

#include <map>
#include <string>

#include "libmocap/store/model_file.hpp"
#include "libmodels/train/adam.hpp"

namespace mocap::train {

store::Tensor to_stored(const torch::Tensor& tensor);     // float32, C order
torch::Tensor from_stored(const store::Tensor& tensor);   // a copy
std::map<std::string, store::Tensor> to_stored(const NamedTensors& tensors);

// Copies stored weights into parameters. Error(data) naming the first parameter that is missing, superfluous or of another
// shape.
void load_weights(const NamedTensors& parameters, const std::map<std::string, store::Tensor>& stored, const std::string& file);

}  // namespace mocap::train
