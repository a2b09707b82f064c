#include "libmodels/cae_vae/network.hpp"

#include <cmath>
#include <numbers>

#include "libmocap/features/motegi.hpp"
#include "libmodels/nn/convolution.hpp"
#include "libmodels/nn/mlp.hpp"

namespace mocap::cae_vae {
namespace {

using torch::Tensor;

constexpr std::int64_t kColumns = features::kMotegiColumns, kRoot = features::kMotegiRootVelocities;
constexpr double kLeastLog = -12, kMostLog = 4;  // of a variance: exp() of what one odd window asks for has thrown trainings out
enum Draw : std::uint64_t { kAutoencoder = 1, kVariational = 2 };

}  // namespace

Autoencoder::Autoencoder(const CaeVaeConfig& config, Random random) : config_(config) {
  const std::int64_t root = config.root_filters, pose = config.filters - root, k = config.kernel;
  const auto weight = [&](const char* name, std::int64_t out, std::int64_t in, double gain) {
    return register_parameter(name, nn::normal_tensor({out, in, k}, random) * (gain / std::sqrt(static_cast<double>(in * k))));
  };
  const double relu = std::sqrt(2.0);  // He et al. 2015
  const std::int64_t seen = root > 0 ? kColumns - kRoot : kColumns;
  encoder_ = weight("encoder_weight", pose, seen, relu);
  if (root > 0) encoder_root_ = weight("encoder_root_weight", root, kRoot, relu);
  encoder_bias_ = register_parameter("encoder_bias", torch::zeros({config.filters}));
  decoder_ = weight("decoder_weight", seen, pose, 1);
  if (root > 0) decoder_root_ = weight("decoder_root_weight", kRoot, root, 1);
  decoder_bias_ = register_parameter("decoder_bias", torch::zeros({kColumns}));
}

Tensor Autoencoder::encode(const Tensor& x) const {
  const std::int64_t root = config_.root_filters, pose = config_.filters - root;
  Tensor y;  // (B, T, F)
  if (root == 0)
    y = nn::convolution(x, encoder_, encoder_bias_);
  else
    y = torch::cat({nn::convolution(x.narrow(2, 0, kColumns - kRoot), encoder_, encoder_bias_.narrow(0, 0, pose)), nn::convolution(x.narrow(2, kColumns - kRoot, kRoot), encoder_root_, encoder_bias_.narrow(0, pose, root))}, 2);
  const Tensor pairs = torch::relu(y).view({x.size(0), x.size(1) / 2, 2, config_.filters});
  return torch::max(pairs.select(2, 0), pairs.select(2, 1)).transpose(1, 2);
}

Tensor Autoencoder::decode(const Tensor& y) const {
  const Tensor rows = y.transpose(1, 2);  // (B, T/2, F)
  Tensor even = rows, odd = rows;
  if (config_.upsampling == Upsampling::linear) {
    const std::int64_t n = rows.size(1);
    even = 0.75 * rows + 0.25 * torch::cat({rows.narrow(1, 0, 1), rows.narrow(1, 0, n - 1)}, 1);
    odd = 0.75 * rows + 0.25 * torch::cat({rows.narrow(1, 1, n - 1), rows.narrow(1, n - 1, 1)}, 1);
  }
  const Tensor wide = torch::stack({even, odd}, 2).reshape({rows.size(0), 2 * rows.size(1), rows.size(2)});
  const std::int64_t root = config_.root_filters, pose = config_.filters - root;
  if (root == 0) return nn::convolution(wide, decoder_, decoder_bias_);
  return torch::cat({nn::convolution(wide.narrow(2, 0, pose), decoder_, decoder_bias_.narrow(0, 0, kColumns - kRoot)), nn::convolution(wide.narrow(2, pose, root), decoder_root_, decoder_bias_.narrow(0, kColumns - kRoot, kRoot))}, 2);
}

Tensor Autoencoder::decoder_kernel() const {
  const std::int64_t root = config_.root_filters, pose = config_.filters - root;
  if (root == 0) return decoder_;
  Tensor all = torch::zeros({kColumns, config_.filters, config_.kernel}, decoder_.options().requires_grad(false));
  const torch::NoGradGuard no_grad;
  all.narrow(0, 0, kColumns - kRoot).narrow(1, 0, pose).copy_(decoder_);
  all.narrow(0, kColumns - kRoot, kRoot).narrow(1, pose, root).copy_(decoder_root_);
  return all;
}

VariationalAutoencoder::VariationalAutoencoder(const CaeVaeConfig& config, Random random) {
  const auto layer = [&](const std::string& name, std::int64_t out, std::int64_t in, double gain, Tensor& weight, Tensor& bias) {
    weight = register_parameter(name + "_weight", nn::normal_tensor({out, in}, random) * (gain / std::sqrt(static_cast<double>(in))));
    bias = register_parameter(name + "_bias", torch::zeros({out}));
  };
  const double relu = std::sqrt(2.0), last = 0.1;  // variances begin at about 1, those of the prior and of standardised features
  layer("encoder_0", config.hidden, config.features(), relu, encoder_weight[0], encoder_bias[0]);
  layer("encoder_1", 2 * config.latent, config.hidden, last, encoder_weight[1], encoder_bias[1]);
  layer("decoder_0", config.hidden, config.latent, relu, decoder_weight[0], decoder_bias[0]);
  layer("decoder_1", 2 * config.features(), config.hidden, last, decoder_weight[1], decoder_bias[1]);
}

Gaussian VariationalAutoencoder::posterior(const Tensor& y) const {
  const Tensor out = torch::linear(torch::relu(torch::linear(y, encoder_weight[0], encoder_bias[0])), encoder_weight[1], encoder_bias[1]);
  const auto parts = out.chunk(2, 1);
  return {parts[0], parts[1].clamp(kLeastLog, kMostLog)};
}

Gaussian VariationalAutoencoder::likelihood(const Tensor& z) const {
  const Tensor out = torch::linear(torch::relu(torch::linear(z, decoder_weight[0], decoder_bias[0])), decoder_weight[1], decoder_bias[1]);
  const auto parts = out.chunk(2, 1);
  return {parts[0], parts[1].clamp(kLeastLog, kMostLog)};
}

Tensor negative_log_likelihood(const Gaussian& g, const Tensor& y, double floor) {
  const Tensor variance = g.log_variance.exp() + floor;
  return 0.5 * ((y - g.mean).square() / variance + variance.log() + std::log(2 * std::numbers::pi)).sum(1);
}

Tensor kl_divergence(const Gaussian& g) { return 0.5 * (g.mean.square() + g.log_variance.exp() - 1 - g.log_variance).sum(1); }

Network::Network(const CaeVaeConfig& config, std::uint64_t seed) : config_(config) {
  config_.validate();
  cae = register_module("cae", std::make_shared<Autoencoder>(config_, Random(seed, stream_of(kAutoencoder, 0))));
  scale_mean = register_parameter("scale_mean", torch::zeros({config_.filters}), false);
  scale_deviation = register_parameter("scale_deviation", torch::ones({config_.filters}), false);
  vae = register_module("vae", std::make_shared<VariationalAutoencoder>(config_, Random(seed, stream_of(kVariational, 0))));
}

Tensor Network::standardised(const Tensor& y) const { return ((y - scale_mean.unsqueeze(1)) / scale_deviation.unsqueeze(1)).reshape({y.size(0), config_.features()}); }

Tensor Network::restored(const Tensor& y) const { return y.reshape({y.size(0), config_.filters, config_.window / 2}) * scale_deviation.unsqueeze(1) + scale_mean.unsqueeze(1); }

}  // namespace mocap::cae_vae
