// The Motion Cell network of Ghorbani et al. 2020 (Fig. 2 and 3, Table 1): training forward pass, Algorithm 1.
//
//   w_n = f_enc_w(x_{nl .. (n+1)l})                    word_encoder        (eq. 1)
//   q(z_n) = N(mu_q, sigma_q), from f_w(w_n), h, a     posterior_mu/sigma  (eq. 4, 5)     f_w: word_features
//   p(z_n) = N(mu_p, sigma_p), from h, a               prior_mu/sigma      (eq. 7, 8)     a = f_c(c): control_features
//   w~_n = f_dec(f_z(z_n), h, a)                       decoder             (eq. 10)       f_z: latent_features
//   h' = f_h(f_w(w_n), f_z(z_n), h)                    gru_1, gru_2        (eq. 11)
//   x~ = f_dec_w(w~_n)                                 word_decoder        (eq. 3)
// Words that overlap are not in the paper: f_dec_w writes l + o frames, the last o of them a second opinion on the next word's first,
//   x~_{nl + k} = (1 - u_k) f_dec_w(w~_{n-1})_{l + k} + u_k f_dec_w(w~_n)_k,   u_k = (k + 1) / (o + 1), k < o, n > 0.
// Each word's z is drawn for itself, which shows as a jolt every l frames; so it fades in.
// In a single-layer network (the paper's ablation "SL") w_n is the frame x_n itself: f_w reads it, f_dec is linear in its last layer
// and gives x~_n; word_encoder and word_decoder are null.
// with h = h_{n-1} the states of both GRU cells side by side. sigma = softplus(.) + kSigmaFloor.
// h_0 ~ N(initial_state.mu, exp(initial_state.log_sigma)^2), one row per combination of attributes, reparameterised.
#pragma once
#include <torch/torch.h>

#include <memory>
#include <vector>

#include "libmodels/motion_cell/config.hpp"
#include "libmodels/nn/gru.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::motion_cell {

inline constexpr double kSigmaFloor = 1e-4;
inline constexpr double kInitialStateSigma = 0.5;  // what exp(log_sigma) starts from

// u_k of overlapping words.
inline double fade_in(int frame, int overlap) { return (frame + 1.0) / (overlap + 1); }

class PackedCell;  // the weights laid out for the recurrent passes

// Noise is passed in, so that the caller decides which stream it comes from. B clips, N words, T = N l frames.
struct CellInput {
  torch::Tensor x;                // (B, T, D) standardised features
  torch::Tensor classes;          // (B, A) int64: class of each attribute; or (B, N, A) where attributes change
  torch::Tensor posterior_noise;  // (N, B, latent) standard normal
  torch::Tensor initial_noise;    // (B, 2 hidden) standard normal
  torch::Tensor replace;          // (N, B) bool: where f_w(w~_n) goes into the GRU cells instead of f_w(w_n), gradient
                                  // kept; undefined: teacher forcing
};

struct CellOutput {
  torch::Tensor y;      // (B, T, D) reconstruction, standardised: raw = mean + sd y
  torch::Tensor kl;     // (B, N) KL(q || p) of each word, nats
  torch::Tensor words;  // (B, N, decoded()) reconstructed motion words w~
};

class MotionCell : public torch::nn::Module {
 public:
  // All weights drawn from Random(seed, stream of the part): equal seeds give equal networks.
  MotionCell(const MotionCellConfig& config, std::uint64_t seed);

  const MotionCellConfig& config() const { return config_; }
  std::int64_t parameter_count() const;
  // Of a network of these sizes, without building it: what a model file must hold before memory is taken for it.
  static std::int64_t parameter_count(const MotionCellConfig& config);

  // Training forward pass, differentiable once with respect to the parameters. The parameters may be double (then all
  // noise and x are double). `packed`: the result of pack() since the parameters last changed, to be shared by shards;
  // without it the weights are packed here. Error(internal) where shapes disagree.
  // Runs on the caller's thread; results are the same bits on any x86-64 processor with fused multiply-add.
  CellOutput forward(const CellInput& input, std::shared_ptr<const PackedCell> packed = nullptr) const;

  // Weights laid out for forward() and its backward pass (training), or for the sampler (not training).
  std::shared_ptr<const PackedCell> pack(bool training = true) const;

  // f_dec_w(f_enc_w(x)): words through encoder and decoder alone, (B, T, D) -> (B, T, D), for tests; x itself without them.
  torch::Tensor autoencode(const torch::Tensor& x) const;

  std::shared_ptr<nn::Mlp> word_encoder, word_decoder, word_features, latent_features, control_features, posterior_mu,
      posterior_sigma, prior_mu, prior_sigma, decoder;
  std::shared_ptr<nn::GruCell> gru_1, gru_2;
  torch::Tensor initial_mu,
      initial_log_sigma;  // (combinations, 2 hidden), "initial_state/mu", "initial_state/log_sigma"

 private:
  MotionCellConfig config_;
};

}  // namespace mocap::motion_cell
