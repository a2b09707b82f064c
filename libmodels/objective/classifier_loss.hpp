// What trained classifiers see differently in reconstructed motion than in real motion (Ghorbani et al. 2020, eq. 24).
//
//   L_CL = sum over classifiers c of [ sum over intermediate layers l of  |l(X) - l(X~)|^2 / |l(X)|^2  +  CE(p_c(X), p_c(X~)) - CE(p_c(X), p_c(X)) ]
// The norms are over all real frames and channels of the rows given, so that beta_(c,l) is one over the layer's mean square on real
// motion: raw errors are of the size of the layers and swamp everything. CE is the cross-entropy of class probabilities, mean over
// the rows, with the classifier's own opinion of the real motion as the label, less the least it can be: 0 for a perfect
// reconstruction. The gradient goes through the reconstruction alone; the classifiers stay as they are.
// Classifiers look at quaternions and their frame differences (classifier/network.hpp): other representations are converted,
// signs follow the real motion's.
#pragma once
#include <torch/torch.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libmodels/classifier/classifier.hpp"
#include "libmodels/objective/poses.hpp"
#include "libmodels/train/dataset.hpp"

namespace mocap::objective {

class ClassifierLoss {
 public:
  // Classifier files. Error(data) for what is none, for another skeleton (1e-5 m) or rate than the data's, for the same file twice.
  ClassifierLoss(const std::vector<std::string>& files, const train::MotionDataset& data);
  ~ClassifierLoss();

  // y (B, T, D) standardised reconstruction with gradient, batch: the real motion. L_CL, a scalar. Any number of threads at once.
  torch::Tensor operator()(const torch::Tensor& y, const train::Batch& batch) const;

  const std::vector<std::string>& sha256() const { return digests_; }  // of the files, in order
  // [{"attribute": ..., "sha256": ...}, ...]: kept in the model file's config and in the training's identity.
  nlohmann::json to_json() const;

 private:
  struct Frozen;
  Poses poses_;
  std::vector<Frozen> classifiers_;
  std::vector<std::string> digests_;
};

}  // namespace mocap::objective
