#include "libmodels/cae_vae/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/staged_adam.hpp"

namespace mocap::cae_vae {
namespace {

using Json = nlohmann::json;
using torch::Tensor;

enum Draw : std::uint64_t { kOrder = 101, kNoise = 102, kValidation = 103, kShift = 104 };  // the network draws its weights from the streams below

constexpr std::int64_t kPiece = 100;       // windows encoded at a time
constexpr std::int64_t kValidated = 2000;  // windows at most
constexpr double kLeastScale = 1e-4;       // of a filter that is never active
constexpr std::size_t kConstants = 2;      // scale_mean and scale_deviation come before what is learnt

}  // namespace

void TrainingConfig::validate() const {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("epochs", static_cast<double>(epochs));
  positive("epochs of the variational autoencoder", static_cast<double>(vae_epochs));
  positive("batch", static_cast<double>(batch));
  positive("learning rate", learning_rate);
  positive("components of the prior", prior_components);
  positive("gradient limit", gradient_limit);
  if (!(full_rate >= 0 && full_rate <= 1)) refuse_usage(fmt::format("share of the epochs with the whole rate is {}, expected a share", full_rate));
  if (!(std::isfinite(kl_weight) && kl_weight >= 0)) refuse_usage(fmt::format("weight of the KL divergence is {}, expected a number of at least 0", kl_weight));
  if (!(std::isfinite(least_deviation) && least_deviation >= 0)) refuse_usage(fmt::format("least deviation of the features is {}, expected a number of at least 0", least_deviation));
  if (shards < 1 || shards > batch) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and the batch", shards, batch));
}

Json to_json(const TrainingConfig& c) {
  return Json{{"epochs", c.epochs}, {"vae_epochs", c.vae_epochs}, {"batch", c.batch}, {"overlap", c.overlap}, {"shifted", c.shifted}, {"learning_rate", Json{{"rate", c.learning_rate}, {"full", c.full_rate}}}, {"gradient_limit", c.gradient_limit}, {"kl_weight", c.kl_weight}, {"least_deviation", c.least_deviation}, {"prior_components", c.prior_components}, {"shards", c.shards}, {"seed", c.seed}};
}

CaeVaeTraining::CaeVaeTraining(CaeVaeConfig network, TrainingConfig config, const WindowDataset& data, const WindowDataset* validation)
    : config_(config), data_(data), validation_(validation), network_(std::make_unique<Network>(network, config.seed)) {
  config_.validate();
  if (data.length() != network.window || (validation && validation->length() != network.window)) throw Error(Exit::internal, {}, "cae-vae: windows of another length than the network's");
  if (network.window > (1 << 20) / batch()) refuse_usage(fmt::format("{} windows of {} frames in a batch, expected at most {} frames in all", batch(), network.window, 1 << 20));
}

std::int64_t CaeVaeTraining::batch() const { return std::max<std::int64_t>(config_.shards, std::min(config_.batch, static_cast<std::int64_t>(data_.windows().size()))); }

std::int64_t CaeVaeTraining::steps_per_epoch() const { return (static_cast<std::int64_t>(data_.windows().size()) + batch() - 1) / batch(); }

double CaeVaeTraining::learning_rate(std::int64_t step) const {
  const bool second = step >= first_stage();
  const auto all = static_cast<double>((second ? config_.vae_epochs : config_.epochs) * steps_per_epoch()), done = static_cast<double>(second ? step - first_stage() : step) / all;
  return config_.learning_rate * (done < config_.full_rate ? 1 : (1 - done) / (1 - config_.full_rate));
}

double CaeVaeTraining::gradient_limit() const { return config_.gradient_limit * (second_ ? std::sqrt(static_cast<double>(network_->config().features())) : 1); }

store::ModelFile CaeVaeTraining::describe() const {
  store::ModelFile file;
  file.kind = "cae-vae";
  file.config = Json{{"network", cae_vae::to_json(network_->config())},
                     {"training", cae_vae::to_json(config_)},
                     {"features", "motegi"},
                     {"frame_rate_hz", data_.reference().frame_rate_hz},
                     {"contacts", data_.contacts_rule()},
                     {"floor_m", data_.floor_m()},
                     {"default_frames", network_->config().window}}
                    .dump();
  file.skeleton = data_.reference().skeleton;
  file.mean = data_.reference().mean;
  file.deviation = data_.reference().deviation;
  file.train_sources = data_.sources();
  if (prior_) file.weights = stored(*prior_);
  store::Tensor& natural = file.weights["natural"];
  natural.shape = {static_cast<std::int64_t>(data_.natural().size()), 4};
  for (const Quaternion& q : data_.natural())
    for (const double v : {q.w(), q.x(), q.y(), q.z()}) natural.values.push_back(static_cast<float>(v));
  return file;
}

std::string CaeVaeTraining::identity() const {
  return Json{{"kind", "cae-vae"},
              {"data", data_.digest()},
              {"validation", validation_ ? validation_->digest() : ""},
              {"network", cae_vae::to_json(network_->config())},
              {"training", cae_vae::to_json(config_)}}
      .dump();
}

train::NamedTensors CaeVaeTraining::parameters() { return nn::parameters_by_path(*network_); }

std::pair<std::size_t, std::size_t> CaeVaeTraining::trained() {
  const std::size_t first = network_->cae->parameters().size(), second = network_->vae->parameters().size();
  return second_ ? std::pair{kConstants + first, second} : std::pair{kConstants, first};
}

std::unique_ptr<train::Optimizer> CaeVaeTraining::optimizer() {
  const auto all = parameters();
  const std::size_t first = network_->cae->parameters().size();
  return std::make_unique<train::StagedAdam>(all, std::vector<train::StagedAdam::Stage>{{kConstants, first, 0}, {kConstants + first, all.size() - kConstants - first, first_stage()}});
}

void CaeVaeTraining::set_scale() {
  const torch::NoGradGuard no_grad;
  const auto filters = network_->config().filters;
  Tensor sum = torch::zeros({filters}, torch::kFloat64), squares = torch::zeros({filters}, torch::kFloat64);
  double count = 0;
  for (std::size_t begin = 0; begin < data_.windows().size(); begin += kPiece) {
    std::vector<std::size_t> piece(std::min<std::size_t>(kPiece, data_.windows().size() - begin));
    std::iota(piece.begin(), piece.end(), begin);
    const Tensor y = network_->cae->encode(data_.batch(piece)).to(torch::kFloat64);
    sum += y.sum(at::IntArrayRef({0, 2}));
    squares += y.square().sum(at::IntArrayRef({0, 2}));
    count += static_cast<double>(y.size(0) * y.size(2));
  }
  const Tensor mean = sum / count;
  network_->scale_mean.copy_(mean);
  network_->scale_deviation.copy_((squares / count - mean.square()).clamp_min(0).sqrt().clamp_min(kLeastScale));
}

void CaeVaeTraining::set_prior() {
  const torch::NoGradGuard no_grad;
  const auto n = static_cast<Eigen::Index>(data_.windows().size());
  Eigen::MatrixXd means(network_->config().latent, n), variances = means;
  for (std::size_t begin = 0; begin < data_.windows().size(); begin += kPiece) {
    std::vector<std::size_t> piece(std::min<std::size_t>(kPiece, data_.windows().size() - begin));
    std::iota(piece.begin(), piece.end(), begin);
    const Gaussian q = network_->vae->posterior(network_->standardised(network_->cae->encode(data_.batch(piece))));
    const Tensor mean = q.mean.contiguous(), variance = q.log_variance.exp().contiguous();
    for (std::size_t i = 0; i < piece.size(); ++i)
      for (Eigen::Index l = 0; l < means.rows(); ++l) {
        const auto at = static_cast<std::int64_t>(i) * means.rows() + l;
        means(l, static_cast<Eigen::Index>(begin + i)) = mean.data_ptr<float>()[at];
        variances(l, static_cast<Eigen::Index>(begin + i)) = variance.data_ptr<float>()[at];
      }
  }
  prior_ = fit_latent_prior(means, variances, config_.prior_components, config_.seed);
}

void CaeVaeTraining::updated(const train::LossTerms&) {
  if (step_ + 1 == steps()) set_prior();
}

void CaeVaeTraining::prepare(std::int64_t step) {
  step_ = step;
  second_ = step >= first_stage();
  if (step == first_stage()) set_scale();
  const std::int64_t per_epoch = steps_per_epoch(), epoch = step / per_epoch, n = static_cast<std::int64_t>(data_.windows().size());
  if (ordered_ != epoch) {
    order_.resize(static_cast<std::size_t>(n));
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    Random random(config_.seed, stream_of(kOrder, static_cast<std::uint64_t>(epoch)));
    for (std::size_t i = order_.size(); i > 1; --i) std::swap(order_[i - 1], order_[random.below(i)]);
    ordered_ = epoch;
  }
  std::vector<std::size_t> windows;
  for (std::int64_t b = 0; b < batch(); ++b) windows.push_back(order_[static_cast<std::size_t>((step % per_epoch * batch() + b) % n)]);
  if (config_.shifted) {
    Random random(config_.seed, stream_of(kShift, static_cast<std::uint64_t>(step)));
    rows_ = data_.batch(windows, data_.step() - 1, random);
  } else {
    rows_ = data_.batch(windows);
  }
  if (!second_) return;
  Random random(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step)));
  noise_ = nn::normal_tensor({batch(), network_->config().latent}, random);
}

Tensor CaeVaeTraining::negative_log_likelihood(const Tensor& z, const Tensor& y) const {
  return cae_vae::negative_log_likelihood(network_->vae->likelihood(z), y, config_.least_deviation * config_.least_deviation);
}

Tensor CaeVaeTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto [first, last] = nn::shard_range(batch(), config_.shards, shard);
  const Tensor rows = rows_.narrow(0, first, last - first);
  const auto all = static_cast<double>(batch());
  if (!second_) {
    const Tensor loss = (network_->cae->decode(network_->cae->encode(rows)) - rows).square().sum() / (all * static_cast<double>(rows.size(1) * rows.size(2)));
    terms = {{"square_error", loss.item<double>()}, {"nats", 0}, {"kl", 0}};
    return loss;
  }
  Tensor y;
  {
    const torch::NoGradGuard no_grad;
    y = network_->standardised(network_->cae->encode(rows));
  }
  const Gaussian q = network_->vae->posterior(y);
  const Tensor z = q.mean + noise_.narrow(0, first, last - first) * (0.5 * q.log_variance).exp();
  const Tensor nats = negative_log_likelihood(z, y).sum() / all, kl = kl_divergence(q).sum() / all;
  terms = {{"square_error", 0}, {"nats", nats.item<double>()}, {"kl", kl.item<double>()}};
  return nats + config_.kl_weight * kl;
}

std::optional<double> CaeVaeTraining::validation_loss() {
  if (!validation_) return std::nullopt;
  const torch::NoGradGuard no_grad;
  const auto n = static_cast<std::int64_t>(validation_->windows().size()), used = std::min(n, kValidated);
  double sum = 0;
  for (std::int64_t begin = 0; begin < used; begin += kPiece) {
    std::vector<std::size_t> windows;
    for (std::int64_t i = begin; i < std::min(begin + kPiece, used); ++i) windows.push_back(static_cast<std::size_t>(i * n / used));
    const Tensor x = validation_->batch(windows);
    if (!second_) {
      sum += (network_->cae->decode(network_->cae->encode(x)) - x).square().mean({1, 2}).sum().item<double>();
      continue;
    }
    const Tensor y = network_->standardised(network_->cae->encode(x));
    const Gaussian q = network_->vae->posterior(y);
    Random random(config_.seed, stream_of(kValidation, static_cast<std::uint64_t>(begin)));
    const Tensor z = q.mean + nn::normal_tensor({y.size(0), network_->config().latent}, random) * (0.5 * q.log_variance).exp();
    sum += (negative_log_likelihood(z, y) + config_.kl_weight * kl_divergence(q)).sum().item<double>();
  }
  return sum / static_cast<double>(used);
}

}  // namespace mocap::cae_vae
