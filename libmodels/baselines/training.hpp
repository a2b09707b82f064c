// Training the deterministic baselines (Ghorbani et al. 2020, section 5.1): the Motion Cell's objective, batches, windows,
// optimiser and schedules, without a latent variable.
//
//   L = (1/B) sum_b sum_t L_rec(t)     libmodels/objective; frames past the end of a clip are masked out
// Exposure bias: own output (Pavllo et al. 2019: the share of frames whose predecessor is the network's own grows over the
// training) and Gaussian noise on u_t whose deviation grows in steps (Fragkiadaki et al. 2015), each for either network.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "libmodels/baselines/network.hpp"
#include "libmodels/objective/motion_objective.hpp"
#include "libmodels/train/dataset.hpp"
#include "libmodels/train/schedule.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::baselines {

// Deviation of the noise on u_t, of the standardised features: `levels` equal steps up to `ramp.to`.
struct InputNoise {
  train::Ramp ramp{0, 0, 0.1, 0.6};
  int levels = 5;
  double at(double progress) const;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(InputNoise, ramp, levels)

struct TrainingConfig {
  std::int64_t steps = 4000;
  std::int64_t batch = 32;
  int shards = 2;
  objective::ObjectiveConfig objective{0.5, 0.1, 0.7, 0.08};
  double gradient_limit = 0.1;
  train::LearningRate learning_rate;
  train::Ramp own_output{0, 1, 0.1, 0.6};
  InputNoise input_noise;
  std::vector<train::WindowStage> windows = {{0, 45}, {0.4, 90}, {0.7, 120}};
  std::uint64_t seed = 1;

  // What the two differ in, the rest of the Motion Cell's preset `small`: quaternet own output of all frames in the end, as theirs, no
  // noise; erd noise up to a deviation of 0.2 and own output of half of the frames.
  static TrainingConfig of(Arch arch);
  void validate() const;  // Error(usage) naming the field
};
nlohmann::json to_json(const TrainingConfig& config);
TrainingConfig training_config_from_json(const nlohmann::json& json);

class BaselineTraining final : public train::Trainable {
 public:
  // `validation` may be null. Both must outlive the object. Error(usage) where the data are not quaternions.
  BaselineTraining(BaselineConfig network, TrainingConfig config, const train::MotionDataset& data, const train::MotionDataset* validation);

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return config_.steps; }
  std::int64_t steps_per_epoch() const override;
  double learning_rate(std::int64_t step) const override { return config_.learning_rate.at(step, config_.steps); }
  double gradient_limit() const override { return config_.gradient_limit; }
  int shards() const override { return config_.shards; }
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;
  std::optional<double> validation_loss() override;  // per frame, by teacher forcing, without noise

  const Network& network() const { return *network_; }

 private:
  TrainingConfig config_;
  const train::MotionDataset& data_;
  const train::MotionDataset* validation_;
  std::unique_ptr<Network> network_;
  std::unique_ptr<objective::MotionObjective> objective_;
  torch::Tensor padding_;

  // Of the step in hand.
  std::int64_t step_ = 0;
  double own_output_ = 0, input_noise_ = 0, real_frames_ = 0;
  train::Batch batch_;
  std::shared_ptr<const PackedNetwork> packed_;
};

}  // namespace mocap::baselines
