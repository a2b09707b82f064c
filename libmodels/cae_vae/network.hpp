// The two networks of Motegi, Hijioka, Murakami 2018: a convolutional autoencoder of windows of motion (section III), a variational autoencoder of what it finds (section IV).
//
//   y = Phi(x) = maxpool_2(relu(x * W + b))                x (B, T, 58) standardised features (features/motegi.hpp) -> y (B, F, T/2)
//   x' = Phi'(y) = upsample_2(y) * W' + b'                 F = 32 filters of 15 frames; beyond a window's ends are zeros, the mean pose
//   q(z|y) = N(mu_phi(y), diag sigma_phi^2(y)),  p(y|z) = N(mu_theta(z), diag sigma_theta^2(z)),  p(z) = N(0, I)
//   both: one hidden layer of 256 units with ReLU, then means and log variances
//   C = -E_q[log p(y|z)] + KL(q || p)                      minimised, mean over windows
//   KL = 1/2 sum_m (mu_m^2 + sigma_m^2 - 1 - log sigma_m^2),  z = mu_phi + eps sigma_phi
//
// The paper prints the KL divergence with the sign of its negative and multiplies eps by the variance; both are slips, the right ones are above (Kingma & Welling 2014, appendix B, 2.4).
// The activation of the last layers "in the heat layer" is lost; they are linear here.
//
// How the paper upsamples it does not say. Twice the same leaves steps at 15 Hz that a filter of 15 frames does not smooth out: joints tremble (docs/results.md). Linear is the default.
//
// With root filters (section VI) the last `root_filters` filters see and make the three root velocities alone, the others the 55 numbers of the pose; the variational autoencoder joins them.
//
// The stages meet in units of their own: y is standardised by filter (mean and deviation over the training windows, constants of the model under /weights/scale), so that where the first stage
// leaves its scale - which nothing fixes - does not decide how the second weighs likelihood against KL. Variances of p(y|z) have a floor: a rectified feature is exactly 0 in many windows, where
// a density without one would be driven to infinity. Log variances are kept within -12 and 4.
#pragma once
#include <torch/torch.h>

#include <memory>

#include "libmocap/base/random.hpp"
#include "libmodels/cae_vae/config.hpp"

namespace mocap::cae_vae {

struct Gaussian {
  torch::Tensor mean, log_variance;  // (B, N)
};

class Autoencoder : public torch::nn::Module {
 public:
  Autoencoder(const CaeVaeConfig& config, Random random);
  torch::Tensor encode(const torch::Tensor& x) const;  // (B, T, 58) -> (B, F, T/2)
  torch::Tensor decode(const torch::Tensor& y) const;  // (B, F, T/2) -> (B, T, 58)
  // W' as one kernel (58, F, K), zero where filters of the root and columns of the pose meet or the reverse, and b'.
  torch::Tensor decoder_kernel() const;
  const torch::Tensor& decoder_bias() const { return decoder_bias_; }

 private:
  CaeVaeConfig config_;
  torch::Tensor encoder_, encoder_root_, encoder_bias_, decoder_, decoder_root_, decoder_bias_;
};

class VariationalAutoencoder : public torch::nn::Module {
 public:
  VariationalAutoencoder(const CaeVaeConfig& config, Random random);
  Gaussian posterior(const torch::Tensor& y) const;   // (B, F T/2) standardised -> of z, (B, latent)
  Gaussian likelihood(const torch::Tensor& z) const;  // (B, latent) -> of y standardised
  torch::Tensor mean(const torch::Tensor& z) const { return likelihood(z).mean; }

  torch::Tensor encoder_weight[2], encoder_bias[2], decoder_weight[2], decoder_bias[2];  // hidden layer, then means above log variances
};

// -log N(y | mean, variance + floor) summed over the values of each row, and KL(N(mean, variance) || N(0, I)) likewise: (B) nats.
torch::Tensor negative_log_likelihood(const Gaussian& gaussian, const torch::Tensor& y, double floor = 0);
torch::Tensor kl_divergence(const Gaussian& gaussian);

class Network : public torch::nn::Module {
 public:
  // All weights drawn from Random(seed, stream of the part): equal seeds give equal networks.
  Network(const CaeVaeConfig& config, std::uint64_t seed);
  const CaeVaeConfig& config() const { return config_; }

  // From the first stage's features to those of the second, (B, F, T/2) <-> (B, F T/2).
  torch::Tensor standardised(const torch::Tensor& y) const;
  torch::Tensor restored(const torch::Tensor& y) const;

  std::shared_ptr<Autoencoder> cae;
  torch::Tensor scale_mean, scale_deviation;  // (F) of y; set between the stages, not learnt
  std::shared_ptr<VariationalAutoencoder> vae;

 private:
  CaeVaeConfig config_;
};

}  // namespace mocap::cae_vae
