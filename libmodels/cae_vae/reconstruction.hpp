// What the stages lose of motion that goes through them, in millimetres.
#pragma once
#include "libmodels/cae_vae/network.hpp"
#include "libmodels/cae_vae/windows.hpp"

namespace mocap::cae_vae {

struct StageError {
  double pose_mm = 0;   // mean distance of a joint, seen from the frame on the ground under the root; root: its height
  double world_mm = 0;  // mean distance in the world from the same first frame on: with what the root's velocities add up to
};
struct ReconstructionError {
  std::size_t windows = 0;
  StageError autoencoder;    // Phi'(Phi(x))
  StageError both;           // with z the mean of q(z | Phi(x)) and y the mean of p(y | z)
  double mean_pose_mm = 0;   // the pose's distance to the training data's mean: what knowing nothing costs
};

// Over all windows of a data set, standardised as the network's training data. Cost: about 0.3 ms a window.
ReconstructionError reconstruction_error(const Network& network, const WindowDataset& data);

}  // namespace mocap::cae_vae
