// Training of the mixture generator (Wang, Chai, Xia 2018, sections 4.1.2 and 4.1.3).
//
// Windows of 50 frames at 30 Hz, each from a state of 0; noise of deviation 0.05 on the standardised features that the network sees, never on what it should predict;
// RMSProp, 1e-3, times 0.95 per epoch of 200 steps; every derivative is clipped to [-5, 5]. The paper's 30,000 iterations of batch 20 to convergence are the preset `paper`;
// `small` has fewer steps, in which the rate falls 75 times by 0.95: after 150 times the second half of a short training learns nothing.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>

#include "libmodels/lstm_gmm/network.hpp"
#include "libmodels/train/state_dataset.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::lstm_gmm {

struct TrainingConfig {
  std::int64_t steps = 3000, batch = 20, window = 50;
  double input_noise = 0.05;
  double rate = 1e-3, decay = 0.95;  // the rate is multiplied by `decay` every `decay_steps`
  std::int64_t decay_steps = 40;
  double rmsprop_decay = 0.9, derivative_limit = 5;
  int shards = 2;
  std::uint64_t seed = 1;
  std::string init_digest = {};  // of the model whose weights it starts from; "" for none

  static TrainingConfig preset(const std::string& name);
  void validate() const;  // Error(usage)
};
nlohmann::json to_json(const TrainingConfig& config);

class LstmGmmTraining final : public train::Trainable {
 public:
  // `validation` may be null. Features and contacts follow the data.
  LstmGmmTraining(LstmGmmConfig network, TrainingConfig config, const train::StateDataset& data, const train::StateDataset* validation);

  // Takes the weights of a network of the same sizes (Error(internal)); its normalisation must be the data's, and config's init_digest say which it was.
  void start_from(const Network& other);

  const Network& network() const { return *network_; }
  const TrainingConfig& config() const { return config_; }

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return config_.steps; }
  std::int64_t steps_per_epoch() const override;
  double learning_rate(std::int64_t step) const override;
  double entry_limit() const override { return config_.derivative_limit; }
  std::unique_ptr<train::Optimizer> optimizer() override;
  int shards() const override { return config_.shards; }
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;
  std::optional<double> validation_loss() override;  // nats a frame, without noise

 private:
  TrainingConfig config_;
  const train::StateDataset &data_;
  const train::StateDataset* validation_;
  std::unique_ptr<Network> network_;
  std::unique_ptr<PackedNetwork> packed_;
  train::StateBatch batch_;
  double real_ = 0;  // predicted rows of the batch
  std::int64_t step_ = 0;
};

// What a model says of motion that it should predict: means over all frames but the first of each clip, from a state of 0, without noise.
struct Prediction {
  double nats = 0;          // of features and contacts together
  double contact_nats = 0;  // of contacts alone
  double angle_deg = 0;     // between predicted (the most probable component's mean) and real joint rotations, mean over joints
  double persistence_deg = 0;  // the same for the frame before as the prediction
  double contact_errors = 0;   // share of bits on the wrong side of 1/2
};
Prediction prediction(const Network& network, const train::StateDataset& data);

}  // namespace mocap::lstm_gmm
