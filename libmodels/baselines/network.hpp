// The two deterministic baselines of Ghorbani et al. 2020, section 5.1: one recurrent network with two heads.
//
// Frame t follows from the frame before, u_t, and the attributes' one-hots a_t:
//   quaternet (Pavllo et al. 2019)       h_t = two GRU layers over [u_t, a_t];  o_t = W h_t + b
//   erd (Fragkiadaki et al. 2015)        h_t = two LSTM layers over enc([u_t, a_t]);  o_t = dec(h_t)
//                                        enc: two fully connected layers; dec: two and a linear one; ELU where they have ReLU
// Heads, on standardised features (raw = mean + sd y):
//   quaternet  the velocity form: raw q_t = q(u_t)/|q(u_t)| times (1 + sd_0 o_0, sd_1 o_1, sd_2 o_2, sd_3 o_3), a rotation
//              delta on the right (in the joint's own frame); not normalised, so that the unit-norm penalty of the objective
//              (theirs too) holds the delta's length; root values y = o
//   erd        y = o, the whole next frame
// u_t is x_{t-1} (teacher forcing) or y_{t-1} with its quaternions normalised (own output), plus given noise. u_0 = W s_0 + b
// of the initial state s_0: the one frame no data stand for is decoded from what was drawn.
// s_0 (h of both layers, for the LSTM then c of both) ~ N(mu, exp(log_sigma)^2), one row per combination of attributes,
// learned as in the Motion Cell: the only source of variety, everything after it is determined.
#pragma once
#include <torch/torch.h>

#include <memory>
#include <vector>

#include "libmodels/baselines/config.hpp"
#include "libmodels/nn/gru.hpp"
#include "libmodels/nn/lstm.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::baselines {

inline constexpr double kInitialStateSigma = 0.5;  // what exp(log_sigma) starts from, as in the Motion Cell

class PackedNetwork;  // the weights laid out for the recurrent passes

// Noise is passed in, so that the caller decides which stream it comes from. B clips, T frames.
struct NetworkInput {
  torch::Tensor x;              // (B, T, D) standardised features; x_{T-1} is not read
  torch::Tensor classes;        // (B, A) int64: class of each attribute; or (B, T, A) where attributes change
  torch::Tensor initial_noise;  // (B, state) standard normal
  torch::Tensor input_noise;    // (T, B, D) added to u; undefined: none
  torch::Tensor replace;        // (T, B) bool: where u_t is the network's own output, gradient kept; row 0 is not read;
                                // undefined: teacher forcing
};

class Network : public torch::nn::Module {
 public:
  // All weights drawn from Random(seed, stream of the part): equal seeds give equal networks. mean, deviation: the
  // normalisation of the features, D values each; constants, kept outside the weights.
  Network(const BaselineConfig& config, const std::vector<float>& mean, const std::vector<float>& deviation, std::uint64_t seed);

  const BaselineConfig& config() const { return config_; }
  const std::vector<float>& mean() const { return mean_; }
  const std::vector<float>& deviation() const { return deviation_; }
  std::int64_t parameter_count() const;
  // Of a network of these sizes, without building it: what a model file must hold before memory is taken for it.
  static std::int64_t parameter_count(const BaselineConfig& config);

  // (B, T, D): y, standardised. Differentiable once with respect to the parameters. The parameters may be double (then
  // noise and x are double). `packed`: the result of pack() since the parameters last changed, to be shared by shards.
  // Error(internal) where shapes disagree. On the caller's thread, the same bits on any x86-64 processor with fused multiply-add.
  torch::Tensor forward(const NetworkInput& input, std::shared_ptr<const PackedNetwork> packed = nullptr) const;
  std::shared_ptr<const PackedNetwork> pack(bool training = true) const;

  std::shared_ptr<nn::Mlp> encoder, decoder, start;  // encoder: erd only; start: s_0 -> u_0
  std::shared_ptr<nn::GruCell> gru_1, gru_2;         // quaternet
  std::shared_ptr<nn::LstmCell> lstm_1, lstm_2;      // erd
  torch::Tensor initial_mu, initial_log_sigma;       // (combinations, state), "initial_state/mu", "initial_state/log_sigma"

 private:
  BaselineConfig config_;
  std::vector<float> mean_, deviation_;
};

}  // namespace mocap::baselines
