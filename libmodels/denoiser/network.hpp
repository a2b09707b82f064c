// The denoising autoencoder of Ghorbani et al. 2020 (section 3.1, Table 1): two Conv1D + ReLU, transposed convolutions back.
//
//   x (B, T, D)  standardised pose features (features/motion_cell.hpp, quaternions), T even
//   y = x + deconv2(relu(deconv1(relu(conv2(relu(conv1(x cut to +-5)))))))
//   conv1    kernel 5, stride 1, D -> 96          conv2    kernel 5, stride 2, 96 -> 64
//   deconv1  kernel 4, stride 2, 64 -> 96         deconv2  kernel 5, stride 1, 96 -> D, 0 at the start
// The paper gives neither widths nor strides, and no x +: with it an untrained network changes nothing, and a short training removes noise
// instead of first learning to copy. The cut keeps one outlier, which may lie hundreds of deviations off in a feature that hardly varies,
// from spoiling everything around it.
#pragma once
#include <torch/torch.h>

#include <cstdint>
#include <nlohmann/json.hpp>

#include "libmocap/base/random.hpp"

namespace mocap::denoiser {

struct NetworkConfig {
  int joints = 21;  // without the root
  int width = 96, code = 64;
  int columns() const;     // D
  void validate() const;   // Error(data) naming the field
  std::int64_t parameter_count() const;
};
nlohmann::json to_json(const NetworkConfig& config);
NetworkConfig network_config_from_json(const nlohmann::json& json);  // Error(data)

// Frames on either side that an output frame depends on.
inline constexpr std::int64_t kReach = 12;
inline constexpr double kFarthest = 5;  // deviations from the mean that the network sees

class Network : public torch::nn::Module {
 public:
  Network(const NetworkConfig& config, Random& random);
  const NetworkConfig& config() const { return config_; }
  torch::Tensor forward(const torch::Tensor& x) const;

 private:
  NetworkConfig config_;
  torch::Tensor w1_, b1_, w2_, b2_, w3_, b3_, w4_, b4_;
};

// Frames [first - kReach, first + count + kReach) of (T, D); before the start the first frame, past the end the last one.
torch::Tensor with_edges(const torch::Tensor& x, std::int64_t first, std::int64_t count);

}  // namespace mocap::denoiser
