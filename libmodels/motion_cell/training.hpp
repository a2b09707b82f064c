// Training the Motion Cell: objective, schedules and batches (Ghorbani et al. 2020, sections 3.5 and 4.2).
//
//   L = (1/B) sum_b sum_n [ S (L_rec(n) + lambda_CL L_CL) + lambda_KL KL_n ],   eq. 14 and 15
//   L_rec(n) = sum over the word's frames of libmodels/objective, L_ang included; the velocity term's weight is 0 in the preset `paper`.
//   L_CL     = objective/classifier_loss.hpp over the clips of a shard, once for each word of three frames (a third of it where words
//              are frames); absent without classifiers.
// S weighs reconstruction against a KL weight of 1. The paper's own scale and schedules are lost with its supplement's figure:
// lambda_CL is 0 for 10 % of the steps after word pretraining and rises linearly to 0.03 at 40 %. Sums over words and joints, mean
// over the batch; frames past the end of a clip are masked out of every term. The loss of held-out data leaves L_CL out, so that
// trainings with and without it compare.
//
// Exposure bias (section 4.2, three remedies, each growing from nothing over the same ramp):
//   own_output     a share of the words that the GRU cells read is the network's own (network.hpp, `replace`)
//   noise          standard normal numbers times a deviation are added to the standardised features that the encoder reads
//   joint_dropout  rotations that the encoder reads, each joint and frame for itself, are set to their mean with a probability
// Targets are never changed.
#pragma once
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "libmodels/motion_cell/network.hpp"
#include "libmodels/objective/classifier_loss.hpp"
#include "libmodels/objective/motion_objective.hpp"
#include "libmodels/train/dataset.hpp"
#include "libmodels/train/schedule.hpp"
#include "libmodels/train/trainable.hpp"

namespace mocap::motion_cell {

// Single words without recurrence first: window of one word, initial state drawn as always, many words a batch.
struct WordPretraining {
  std::int64_t steps = 0;
  std::int64_t batch = 256;
  double kl_weight = 0.1, learning_rate = 2e-3, final_factor = 0.2;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(WordPretraining, steps, batch, kl_weight, learning_rate, final_factor)

enum class Exposure { none, own_output, noise, joint_dropout };
Exposure parse_exposure(const std::string& name);  // "none", "own-output", "noise", "joint-dropout"; Error(usage)
std::string text(Exposure exposure);

struct TrainingConfig {
  std::int64_t steps = 0;   // word pretraining included; 0: from epochs
  std::int64_t epochs = 1600;
  std::int64_t batch = 64;
  int shards = 2;
  double reconstruction_scale = 8;
  objective::ObjectiveConfig objective;
  double gradient_limit = 0.1;
  train::LearningRate learning_rate;
  train::Ramp kl_weight{0.1, 1, 0, 0.4};  // at 0 words would fill with what the prior cannot say, and have to be emptied again
  train::Ramp classifier_weight{0, 0.03, 0.1, 0.4};
  Exposure exposure = Exposure::own_output;  // which of the three ramps below is followed
  train::Ramp own_output{0, 1, 0.1, 0.6};    // share of words
  train::Ramp noise{0, 0.05, 0.1, 0.6};      // deviation, of standardised features
  train::Ramp joint_dropout{0, 0.1, 0.1, 0.6};  // probability
  std::vector<train::WindowStage> windows = {{0, 198}};
  WordPretraining pretraining;
  std::uint64_t seed = 1;

  static TrainingConfig preset(const std::string& name);  // "paper", "small"; Error(usage)
  void validate(int word_length) const;                   // Error(usage) naming the field
};
nlohmann::json to_json(const TrainingConfig& config);
TrainingConfig training_config_from_json(const nlohmann::json& json);

class MotionCellTraining final : public train::Trainable {
 public:
  // `validation` and `classifiers` may be null. All must outlive the object. Error(usage) for settings that are out of range or that the
  // data's representation does not allow.
  MotionCellTraining(MotionCellConfig network, TrainingConfig config, const train::MotionDataset& data, const train::MotionDataset* validation,
                     const objective::ClassifierLoss* classifiers = nullptr);

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
    double kl, classifiers, exposure, progress;
  };
  struct Parts {  // sums over a batch, not yet divided
    torch::Tensor loss;
    objective::Figures figures;
    double kl, classifiers;
  };
  bool pretraining(std::int64_t step) const { return step < config_.pretraining.steps; }
  Weights weights(std::int64_t step) const;
  torch::Tensor corrupted(const torch::Tensor& features, double amount, int shard) const;
  Parts objective(const train::Batch& batch, const CellInput& input, const Weights& weights, std::shared_ptr<const PackedCell> packed) const;

  TrainingConfig config_;
  const train::MotionDataset& data_;
  const train::MotionDataset* validation_;
  std::unique_ptr<MotionCell> cell_;
  const objective::ClassifierLoss* classifiers_;
  std::unique_ptr<objective::MotionObjective> objective_;
  torch::Tensor padding_;

  // Of the step in hand.
  std::int64_t step_ = 0;
  train::Batch batch_;
  double real_frames_ = 0, real_words_ = 0;
  std::shared_ptr<const PackedCell> packed_;
};

}  // namespace mocap::motion_cell
