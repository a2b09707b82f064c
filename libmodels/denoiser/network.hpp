// The denoising autoencoder of Ghorbani et al. 2020 (section 3.1, Table 1): two Conv1D + ReLU, transposed convolutions back.
//
//   x (B, T, D)  standardised pose features (features/motion_cell.hpp, quaternions)
//   y = deconv2(relu(deconv1(relu(conv2(relu(conv1(x cut to +-8)))))))
//   conv1, conv2, deconv1, deconv2: kernel 5, stride 1, widths D -> 2D -> 2D -> 2D -> D
// The paper gives neither widths nor strides. A code narrower in time or width than the pose learns for hours to copy what it should leave
// alone. Here conv1 starts as (s x, -s x) and deconv2 as s of the difference of both halves, s the Savitzky-Golay filter of 5 frames and
// degree 2, with the identity between: an untrained network is that filter twice, the trade's own, and training learns what a filter cannot
// know: how joints move together, and what noise looks like. The cut keeps one outlier, which may lie hundreds of
// deviations off in a feature that hardly varies, from spoiling everything around it.
#pragma once
#include <torch/torch.h>

#include <cstdint>
#include <nlohmann/json.hpp>


namespace mocap::denoiser {

struct NetworkConfig {
  int joints = 21;  // without the root
  int columns() const;     // D
  void validate() const;   // Error(data) naming the field
  std::int64_t parameter_count() const;
};
nlohmann::json to_json(const NetworkConfig& config);
NetworkConfig network_config_from_json(const nlohmann::json& json);  // Error(data)

inline constexpr double kCut = 8;

// Frames on either side that an output frame depends on.
inline constexpr std::int64_t kReach = 8;

class Network : public torch::nn::Module {
 public:
  explicit Network(const NetworkConfig& config);  // the same weights every time: no two units of them start equal
  const NetworkConfig& config() const { return config_; }
  torch::Tensor forward(const torch::Tensor& x) const;

 private:
  NetworkConfig config_;
  torch::Tensor w1_, b1_, w2_, b2_, w3_, b3_, w4_, b4_;
};

// Frames [first - kReach, first + count + kReach) of (T, D); before the start the first frame, past the end the last one.
torch::Tensor with_edges(const torch::Tensor& x, std::int64_t first, std::int64_t count);

}  // namespace mocap::denoiser
