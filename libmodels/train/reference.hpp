// What two data sets of one model have in common, and a model with the clips it is used on.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::train {

struct Reference {
  std::shared_ptr<const Skeleton> skeleton;
  double frame_rate_hz = 30;
  std::vector<float> mean, deviation;  // of the features' columns
};

// Error(data) where `skeleton` or rate are others; `of`: whose the reference's are ("the model", "the training data").
void check_alike(const Skeleton& skeleton, double frame_rate_hz, const Reference& reference, const Where& where, const std::string& of);

}  // namespace mocap::train
