// Training of both stages, one after the other (Motegi, Hijioka, Murakami 2018, sections III.B and IV.B).
//
//   autoencoder              E = mean |x - Phi'(Phi(x))|^2                                          over windows, frames and columns, standardised
//   variational autoencoder  E = mean over windows of -log p(y | z) + beta KL(q(z | y) || p(z)),  z drawn from q      beta 1
// Adam, 0.001 (the paper gives no rate), batches of 100 windows, 200 epochs each. An epoch takes every window once, in an order of its own; the last batch is filled up from the epoch's beginning.
// The paper's windows are fixed. Here each may begin up to a window's step later (`shifted`), drawn anew every epoch: with a few hundred clips the second stage knows fixed windows by heart soon.
// For the same reason deviations of p(y | z) are at least `least_deviation`.
// Rates fall linearly to 0 from `full_rate` of each stage on, and the norm of the gradient is kept under `gradient_limit` (of the second stage: times the root of the number of features, over
// which its loss is a sum).
// At the end a mixture is fitted to where the training windows lie in the latent space (latent_prior.hpp).
// Between the stages mean and deviation of every filter over all training windows become constants of the model. Each stage has its own count of Adam's steps.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "libmodels/cae_vae/latent_prior.hpp"
#include "libmodels/cae_vae/network.hpp"
#include "libmodels/cae_vae/windows.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::cae_vae {

struct TrainingConfig {
  std::int64_t epochs = 200, vae_epochs = 200, batch = 100, overlap = 60;  // overlap: frames that windows share; the data set was cut by it
  bool shifted = true;
  double learning_rate = 1e-3, full_rate = 0.5, gradient_limit = 5;
  double kl_weight = 1, least_deviation = 0.3;  // of standardised features
  int prior_components = 64;
  int shards = 2;
  std::uint64_t seed = 1;

  void validate() const;  // Error(usage)
};
nlohmann::json to_json(const TrainingConfig& config);

class CaeVaeTraining final : public train::Trainable {
 public:
  // The data's windows are as long as the network's. `validation` may be null; both must outlive the training.
  CaeVaeTraining(CaeVaeConfig network, TrainingConfig config, const WindowDataset& data, const WindowDataset* validation);

  const Network& network() const { return *network_; }

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return (config_.epochs + config_.vae_epochs) * steps_per_epoch(); }
  std::int64_t steps_per_epoch() const override;
  double learning_rate(std::int64_t step) const override;
  double gradient_limit() const override;  // of the prepared step
  std::unique_ptr<train::Optimizer> optimizer() override;
  int shards() const override { return config_.shards; }
  std::pair<std::size_t, std::size_t> trained() override;
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;  // terms: square_error, nats (of the likelihood), kl; those of the other stage are 0
  void updated(const train::LossTerms& terms) override;
  std::optional<double> validation_loss() override;                       // of the stage; of the second, with the same draws every time

 private:
  std::int64_t first_stage() const { return config_.epochs * steps_per_epoch(); }  // steps
  std::int64_t batch() const;
  void set_scale();  // between the stages
  void set_prior();  // after both
  torch::Tensor negative_log_likelihood(const torch::Tensor& z, const torch::Tensor& y) const;

  TrainingConfig config_;
  const WindowDataset& data_;
  const WindowDataset* validation_;
  std::unique_ptr<Network> network_;
  std::optional<LatentPrior> prior_;
  std::vector<std::size_t> order_;                // of the epoch
  std::int64_t ordered_ = -1;                     // epoch that it is the order of
  // The prepared step.
  bool second_ = false;
  std::int64_t step_ = 0;
  torch::Tensor rows_, noise_;
};

}  // namespace mocap::cae_vae
