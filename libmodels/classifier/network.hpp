// The classifier's network and what it sees (Ghorbani et al. 2020, section 3.4 and Table 1): three Conv1D + ReLU, average pooling over
// time, one fully connected layer.
//
//   input   (B, T, 2D): the D pose features (features/motion_cell.hpp, quaternions) and their change from frame to frame, both standardised.
//           Pose alone is blind to freezing and jitter (both keep a classifier of poses content).
//   layers  kernel 5, strides 1, 2, 2, zero padding of 2, widths 48, 48, 32 (the paper does not give them)
//   pooled  f = mean over the real frames of the last layer, (B, 32): the features that motion is judged by
//   scores  W f + b, (B, C)
// Frames past a row's length are zero before every layer, so that a row of a padded batch gives what it gives alone (within 1e-5, tested).
#pragma once
#include <torch/torch.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "libmocap/base/random.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/features/motion_cell.hpp"

namespace mocap::classifier {

inline constexpr double kFarthest = 20;  // deviations at which a standardised value is cut

struct NetworkConfig {
  int joints = 21;  // without the root
  std::vector<int> widths = {48, 48, 32}, strides = {1, 2, 2};
  int kernel = 5, classes = 2;
  int inputs() const;      // 2D
  int features() const { return widths.back(); }
  void validate() const;   // Error(data) naming the field
  std::int64_t parameter_count() const;
};
nlohmann::json to_json(const NetworkConfig& config);
NetworkConfig network_config_from_json(const nlohmann::json& json);  // Error(data)

class Network : public torch::nn::Module {
 public:
  // He initialisation from `random`, biases 0.
  Network(const NetworkConfig& config, Random& random);
  const NetworkConfig& config() const { return config_; }
  // x (B, T, 2D) float; lengths: real frames of each row, 1..T -> pooled features (B, F).
  torch::Tensor features(const torch::Tensor& x, const std::vector<std::int64_t>& lengths) const;
  // The output of each convolution after its ReLU, (B, width, T') with zeros past a row's end, and last the pooled features.
  std::vector<torch::Tensor> layers(const torch::Tensor& x, const std::vector<std::int64_t>& lengths) const;
  torch::Tensor scores(const torch::Tensor& pooled) const;

 private:
  NetworkConfig config_;
  std::vector<torch::Tensor> weights_, biases_;  // of the convolutions
  torch::Tensor score_weight_, score_bias_;
};

// (T, 2D) pose features and their differences x[t+1] - x[t], not standardised; the last frame repeats the difference before, a single one has 0.
// Error(data) naming the clip where a value is not finite.
features::FeatureMatrix encode(const Clip& clip);

// Of the columns of encode(): FeatureStatistics for the pose, and for the differences one deviation per joint (the largest of its four, at
// least 0.001) and one for each root value (at least 0.0001); their mean is taken as 0.
class Statistics {
 public:
  explicit Statistics(int joints);
  void add(const features::FeatureMatrix& encoded);
  std::vector<float> mean() const;
  std::vector<float> deviation() const;

 private:
  features::MotionCellLayout layout_;
  features::FeatureStatistics pose_;
  Eigen::VectorXd squares_;
  double count_ = 0;
};

// (T, 2D) float: (x - mean) / deviation, cut to +-20 so that one broken frame does not decide a clip.
torch::Tensor standardise(const features::FeatureMatrix& encoded, const std::vector<float>& mean, const std::vector<float>& deviation);

}  // namespace mocap::classifier
