// Training the Motion Cell: objective, schedules and batches (Ghorbani et al. 2020, sections 3.5 and 4.2).
//
//   L = (1/B) sum_b sum_n [ S L_rec(n) + lambda_KL KL_n ],   eq. 14 and 15 with the classifier term left out so far
//   L_rec(n) = sum over the word's frames of libmodels/objective; the velocity term's weight is 0 in the preset `paper`. S weighs
// reconstruction against a KL weight of 1; the paper's own scale is lost with its supplement's figure. Sums over words
// and joints, mean over the batch; frames past the end of a clip are masked out of every term.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "libmodels/motion_cell/network.hpp"
#include "libmodels/objective/motion_objective.hpp"
#include "libmodels/train/dataset.hpp"
#include "libmodels/train/schedule.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::motion_cell {

struct WindowStage {
  double begin = 0;          // progress from which it holds
  std::int64_t frames = 120;  // a multiple of the word length
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WindowStage, begin, frames)

// Single words without recurrence first: window of one word, initial state drawn as always, many words a batch.
struct WordPretraining {
  std::int64_t steps = 0;
  std::int64_t batch = 256;
  double kl_weight = 0.1, learning_rate = 2e-3, final_factor = 0.2;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WordPretraining, steps, batch, kl_weight, learning_rate, final_factor)

struct TrainingConfig {
  std::int64_t steps = 0;   // word pretraining included; 0: from epochs
  std::int64_t epochs = 1600;
  std::int64_t batch = 64;
  int shards = 2;
  double reconstruction_scale = 4;
  double root_weight = 0.5, unit_norm_weight = 0.1, velocity_weight = 0;
  double joint_weight_floor = 0.08;
  double gradient_limit = 0.1;
  train::LearningRate learning_rate;
  train::Ramp kl_weight{0, 1, 0.05, 0.4};
  train::Ramp own_output{0, 1, 0.1, 0.6};
  std::vector<WindowStage> windows = {{0, 198}};
  WordPretraining pretraining;
  std::uint64_t seed = 1;

  static TrainingConfig preset(const std::string& name);  // "paper", "small"; Error(usage)
  void validate(int word_length) const;                   // Error(usage) naming the field
};
nlohmann::json to_json(const TrainingConfig& config);
TrainingConfig training_config_from_json(const nlohmann::json& json);

class MotionCellTraining final : public train::Trainable {
 public:
  // `validation` may be null. Both must outlive the object.
  MotionCellTraining(MotionCellConfig network, TrainingConfig config, const train::MotionDataset& data, const train::MotionDataset* validation);

  store::ModelFile describe() const override;
  std::string identity() const override;
  train::NamedTensors parameters() override;
  std::int64_t steps() const override { return config_.steps; }
  std::int64_t steps_per_epoch() const override;
  double learning_rate(std::int64_t step) const override;
  double gradient_limit() const override { return config_.gradient_limit; }
  int shards() const override { return config_.shards; }
  void prepare(std::int64_t step) override;
  torch::Tensor shard_loss(int shard, train::LossTerms& terms) override;
  std::optional<double> validation_loss() override;

  const MotionCell& network() const { return *cell_; }

 private:
  struct Weights {  // of the terms at a step
    double kl, own_output, progress;
  };
  struct Parts {  // sums over a batch, not yet divided
    torch::Tensor loss;
    objective::Figures figures;
    double kl;
  };
  bool pretraining(std::int64_t step) const { return step < config_.pretraining.steps; }
  Weights weights(std::int64_t step) const;
  Parts objective(const train::Batch& batch, const CellInput& input, const Weights& weights, std::shared_ptr<const PackedCell> packed) const;

  TrainingConfig config_;
  const train::MotionDataset& data_;
  const train::MotionDataset* validation_;
  std::unique_ptr<MotionCell> cell_;
  std::unique_ptr<objective::MotionObjective> objective_;
  torch::Tensor padding_;

  // Of the step in hand.
  std::int64_t step_ = 0;
  train::Batch batch_;
  double real_frames_ = 0, real_words_ = 0;
  std::shared_ptr<const PackedCell> packed_;
};

}  // namespace mocap::motion_cell
