// Both stages as they lie in a model file.
#pragma once
#include <memory>
#include <string>

#include "libmocap/store/model_file.hpp"
#include "libmodels/cae_vae/latent_prior.hpp"
#include "libmodels/cae_vae/network.hpp"
#include "libmodels/cae_vae/windows.hpp"

namespace mocap::cae_vae {

struct Model {
  std::unique_ptr<Network> network;
  Reference reference;
  LatentPrior prior;
  std::vector<Quaternion> natural;  // mean local rotations of the training data, for what positions do not tell
  double floor_m = 0;         // where a decoded window's lowest joint is taken to rest
  std::string contacts_rule;  // "preset:NAME"
};

// Error(data) for a model of another kind, and naming the part where something is missing, of another size or not finite. Sizes are checked before any network is built.
Model read(const store::ModelFile& file, const std::string& name);

}  // namespace mocap::cae_vae
