// Adversarial training of the refiner (Wang, Chai, Xia 2018, section 4.2).
//
//   refiner        E = mean -log D(R(x)) + lambda mean |root(x) - root(R(x))|^2       eq. 9 and 13, lambda 20; root positions in metres over the window
//   discriminator  E = (mean -log(1 - D(R(x))) + mean -log D(x_real)) / 2              eq. 10, halved: the "softmax loss" whose limits steer the training, log 2 where D knows nothing
// Means over the frames of all windows. Clips shorter than a window are left out.
//
// In the beginning both are updated 75 times in turns. After that one update of the discriminator follows every n of the refiner: n = 5, doubled where the discriminator's loss is below 0.01,
// halved (5 to 2) where it is above 1, kept within 1..80. The paper goes by the loss, here it is its mean over about ten updates (exponential, from log 2 after each change): by single batches,
// two unlucky ones in eight hundred updates left n at 1, and the discriminator won for good. Half of the refined motions that the discriminator sees are made by the refiner as it is, half come from a buffer of 320 made by earlier ones,
// of which as many are then replaced by the new. RMSProp, 0.002 and 0.005, decay 0.9.
//
// The preset `small` begins at one to one and with rates of 0.0003 and 0.001: with the paper's, a short training chases the mean pose to and fro and never gets to smoothness (docs/results.md). It has
// the contact term with weight 10, rates that fall from half of the updates on and a limit of 5.
//
// With contacts a term of ours can be added, 0 as in the paper: mean over frames and feet of c |v|^2, v the toe base's velocity in m/s and c 1 where the refined motion's own bit says that it is down.
// It takes slipping feet for what they are, which the discriminator learns late. Gradients go through v, not through c: lifting the bit is no way out. Rates can fall linearly to 0 from a share of
// the updates on, and the norm of the gradient can be kept under a limit: RMSProp, which remembers ten updates, answers a sudden large gradient with a step that throws the refiner back by hundreds.
//
// The contact bits that the discriminator sees carry noise of deviation 0.1, those of real motion too: a refined bit is a number near 0 or 1, and exactness alone would give it away.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>

#include "libmodels/refiner/network.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::refiner {

struct TrainingConfig {
  std::int64_t steps = 3000, batch = 32, window = 50;  // steps: updates of either network
  std::int64_t buffer = 320, beginning = 75;           // updates of each in the beginning
  double ratio = 5, most_ratio = 80;
  double root_weight = 20, contact_weight = 0, contact_noise = 0.1;
  double refiner_rate = 2e-3, discriminator_rate = 5e-3, rmsprop_decay = 0.9;
  double full_rate = 1;       // share of the updates with the whole rates
  double gradient_limit = 0;  // of the joint norm; 0: none
  double low_loss = 0.01, high_loss = 1;
  int shards = 2;
  std::uint64_t seed = 1;

  static TrainingConfig preset(const std::string& name);  // "paper" or "small"; Error(usage) for another name
  void validate() const;  // Error(usage)
};
nlohmann::json to_json(const TrainingConfig& config);

class RefinerTraining final : public train::Trainable {
 public:
  // Features, effectors and rate follow the data. `generated` has the real data's reference; `generator` says where it came from (part of the identity). Error(data) where no clip of either is as long as a window, and for a body without feet.
  RefinerTraining(RefinerConfig network, TrainingConfig config, const train::StateDataset& real, const train::StateDataset& generated, nlohmann::json generator);

  const RefinerNetwork& refiner() const { return *refiner_; }

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return config_.steps; }
  std::int64_t steps_per_epoch() const override { return 100; }
  double learning_rate(std::int64_t step) const override;
  double gradient_limit() const override { return config_.gradient_limit > 0 ? config_.gradient_limit : Trainable::gradient_limit(); }
  std::unique_ptr<train::Optimizer> optimizer() override;
  int shards() const override { return config_.shards; }
  std::pair<std::size_t, std::size_t> trained() override;
  train::NamedTensors memory() override;
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;
  void updated(const train::LossTerms& terms) override;

 private:
  torch::Tensor windows(const train::StateDataset& data, std::int64_t count, std::uint64_t stream) const;  // (T, count, D + 2)
  torch::Tensor effectors(const torch::Tensor& rows) const;  // standardised
  torch::Tensor standardised(const torch::Tensor& effectors) const;
  torch::Tensor refined(const torch::Tensor& rows, std::shared_ptr<const nn::PackedLstmCell> packed) const;

  RefinerConfig network_;
  TrainingConfig config_;
  const train::StateDataset &real_, &generated_;
  nlohmann::json generator_;
  EndEffectors end_effectors_;
  torch::Tensor effector_mean_, effector_deviation_;  // (6 E)
  std::unique_ptr<RefinerNetwork> refiner_;
  std::unique_ptr<Discriminator> discriminator_;
  std::shared_ptr<const nn::PackedLstmCell> packed_refiner_;
  std::unique_ptr<Discriminator::Packed> packed_discriminator_;
  // What the next step depends on: kept in checkpoints.
  torch::Tensor buffer_;   // (buffer, T, D + 2) refined motions
  torch::Tensor balance_;  // n; updates of the refiner since the discriminator's last; then the last figures of the log
  // The prepared step.
  bool discriminating_ = false;
  torch::Tensor fake_, truth_;  // (T, batch, D + 2): to refine, or refined already; real
  std::int64_t step_ = 0;
};

}  // namespace mocap::refiner
