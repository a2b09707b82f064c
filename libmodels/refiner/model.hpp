// A refiner as it lies in a model file, and its use on motion.
#pragma once
#include <memory>
#include <string>

#include "libmocap/features/state.hpp"
#include "libmocap/store/model_file.hpp"
#include "libmodels/refiner/network.hpp"

namespace mocap::refiner {

struct Model {
  std::unique_ptr<RefinerNetwork> network;
  train::Reference reference;                // skeleton, rate, mean and deviation
  torch::Tensor effector_mean, effector_deviation;  // (6 E)
  std::string contacts_rule;                      // of the data it was trained on
};

// Error(data) for a model of another kind, and naming the part where something is missing, of another size or not finite. Sizes are checked before any network is built.
Model read(const store::ModelFile& file, const std::string& name);

// One motion, piece by piece: what is carried from piece to piece makes the result that of the whole, to the bit, if the first piece has two frames or more.
class Refining {
 public:
  explicit Refining(const Model& model);  // kept by reference
  // Rotations, root and contacts of the next frames; starts where the motion starts. The piece has contacts (Error(internal)); skeleton and rate of the model (Error(data)).
  Clip operator()(const Clip& piece);

 private:
  const Model& model_;
  EndEffectors end_effectors_;
  features::StateEncoder encode_;
  std::unique_ptr<features::StateDecoder> decode_;
  std::shared_ptr<const nn::PackedLstmCell> cell_;
  torch::Tensor state_, before_;
};

// A whole clip in pieces of `piece` frames, with everything but its frames kept.
Clip refine(const Model& model, const Clip& clip, std::size_t piece = 4096);

}  // namespace mocap::refiner
