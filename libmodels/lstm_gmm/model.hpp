// A mixture generator as it lies in a model file.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "libmocap/store/model_file.hpp"
#include "libmodels/lstm_gmm/network.hpp"
#include "libmodels/train/state_dataset.hpp"

namespace mocap::lstm_gmm {

struct Model {
  std::unique_ptr<Network> network;
  train::Reference reference;  // skeleton, rate, mean and deviation
  torch::Tensor starts;             // (K, 2, input): pairs of frames of the training data to start from
  std::int64_t default_frames = 0;
};

// Error(data) for a model of another kind, and naming the part where something is missing, of another size or not finite. Sizes are checked before any network is built.
Model read(const store::ModelFile& file, const std::string& name);

}  // namespace mocap::lstm_gmm
