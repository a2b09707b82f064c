// The mixture generator of Wang, Chai, Xia 2018, section 4.1.2 and Fig. 3: FC1, LSTM1, LSTM2, FC2, FC3. From a frame's features x_t and contacts c_t it gives the
// distribution of the next frame,
//
//   p(x_{t+1}) = sum_i w_i N(x_{t+1} | mu_i, diag sigma_i^2)          eq. 6, M = 5
//   w = softmax(w^), mu = mu^, sigma = exp(sigma^)                    eq. 7; here mu = carry x_t + mu^
//   P(c_{t+1} = 1) = sigmoid(c^) for each foot                        section 4.3: contacts are predicted beside the features
//   E = -log p(x_{t+1}) - sum log P(c_{t+1})                          eq. 8, by log-sum-exp over the components
//
// All x are standardised. ELU after FC1 and FC2, which the paper leaves open. sigma^ is kept above -7, since a feature that never moves would drive it to minus infinity.
#pragma once
#include <torch/torch.h>

#include <memory>

#include "libmodels/lstm_gmm/config.hpp"
#include "libmodels/nn/lstm_sequence.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::lstm_gmm {

inline constexpr double kLeastLogSigma = -7;

// R rows.
struct Mixture {
  torch::Tensor log_weights;     // (R, M), log w
  torch::Tensor means;           // (R, M, D)
  torch::Tensor log_sigmas;      // (R, M, D)
  torch::Tensor contact_logits;  // (R, 2)
};

class Network;

// The recurrent layers' weights laid out: made once a step, shared by the shards.
struct PackedNetwork {
  explicit PackedNetwork(const Network& network, bool training = true);
  std::shared_ptr<const nn::PackedLstmCell> lstm_1, lstm_2;
};

class Network : public torch::nn::Module {
 public:
  // All weights drawn from Random(seed, stream of the part): equal seeds give equal networks.
  Network(const LstmGmmConfig& config, std::uint64_t seed);
  const LstmGmmConfig& config() const { return config_; }

  struct Output {
    torch::Tensor y;      // (T B, outputs): FC3
    torch::Tensor state;  // (B, state) after the last frame
  };
  // x (T B, input) time-major, state (B, state) before frame 0. Differentiable once with respect to x, state and the parameters; float or double.
  Output forward(const torch::Tensor& x, const torch::Tensor& state, const PackedNetwork* packed = nullptr) const;
  Mixture mixture(const torch::Tensor& y, const torch::Tensor& x) const;  // of the rows of FC3's output and of the frames that it was given

  std::shared_ptr<nn::Mlp> encoder, decoder;  // FC1; FC2 and FC3
  std::shared_ptr<nn::LstmCell> lstm_1, lstm_2;

 private:
  LstmGmmConfig config_;
};

// Nats of each row, (R): of the features under the mixture, and of the contacts (R, 2) under their bits. x (R, D).
torch::Tensor feature_loss(const Mixture& mixture, const torch::Tensor& x);
torch::Tensor contact_loss(const Mixture& mixture, const torch::Tensor& contacts);

// Eq. 26: the state before frame 1 under which frame 2 is most probable, by `steps` of Adam from 0. first, second (B, input), float -> (B, state).
// Each sequence has an objective of its own; nothing but the frames decides the result.
torch::Tensor initial_state(const Network& network, const torch::Tensor& first, const torch::Tensor& second, int steps = 60, double rate = 0.05);

}  // namespace mocap::lstm_gmm
