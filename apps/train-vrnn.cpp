// train-vrnn - train the Motion Cell, or a baseline of it, on a motion archive.
#include <fmt/core.h>

#include <algorithm>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/baselines/training.hpp"
#include "libmodels/motion_cell/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

class TrainVrnn final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-vrnn"; }
  std::string synopsis() const override { return "Train the Motion Cell, a hierarchical recurrent latent-variable model of motion, or one of its baselines, on a motion archive"; }
  std::string description() const override {
    return "Writes a model file that `sample` generates motion from, with a log (OUTPUT.log.tsv) and two checkpoints (OUTPUT.ckpt-1, OUTPUT.ckpt-2) beside it while it "
           "runs. Stop it at any moment (Ctrl-C, SIGTERM and SIGUSR1 write a checkpoint and end with status 75) and run the same line with --resume to continue to the "
           "same weights, bit for bit; the number of threads does not change them either. The preset `paper` has the sizes and the 1,600 epochs of the paper, `small` fits two CPU "
           "cores and some minutes. Options given on the command line win over the preset. With --classifier, what classifiers of the attributes (train-classifier, on one half of "
           "the data) see differently in reconstructed motion joins the loss; judge the samples by others: fid-eval refuses those that took part. --ablate takes parts of the model away, "
           "as the paper's comparisons do.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-vrnn train.h5 --preset small --val val.h5 -o model.h5", "minutes on two cores"},
            {"train-vrnn train.h5 --preset paper --resume -o model.h5", "the paper's size; the same line starts and continues it"},
            {"train-vrnn train.h5 --arch quaternet --own-output-rate 0.75 -o quaternet.h5", "a deterministic baseline: same batches, steps and loss"},
            {"train-vrnn train.h5 --preset small --steps 9000 --attribute action -o model.h5", "longer, and conditioned on one attribute alone"},
            {"train-vrnn train.h5 --classifier action-a.h5 --classifier gender-a.h5 -o model.h5", "with the classifiers' loss"},
            {"train-vrnn train.h5 --representation rotation-matrix -o model.h5", "rotation matrices, compared by the angle between them"},
            {"train-vrnn train.h5 --ablate single-layer --exposure noise -o model.h5", "an ablation, and another remedy for exposure bias"}};
  }
  std::vector<std::string> references() const override {
    return {"Ghorbani et al. 2020, Probabilistic Character Motion Synthesis using a Hierarchical Deep Latent Variable Model, sections 3 and 4, Table 1"};
  }
  void options(CLI::App& app) override {
    app.add_option("--arch", arch_, "motion-cell, or a deterministic baseline of the paper's section 5.1 trained the same way: quaternet (Pavllo et al. 2019) or erd (Fragkiadaki et al. 2015)")
        ->check(cli::one_of({"motion-cell", "quaternet", "erd"}))
        ->capture_default_str();
    app.add_option("--input-noise", input_noise_, "quaternet, erd: progress at which Gaussian noise on the input starts and is full, and its deviation then, of standardised features; it grows in 5 steps (quaternet 0.1 0.6 0, erd 0.1 0.6 0.2)")
        ->expected(3)
        ->check(cli::non_negative("NUMBER"));
    app.add_option("--preset", preset_, "sizes and schedules: paper (Table 1, or the baselines' own papers; 1,600 epochs) or small (recurrent layers of 256)")->check(cli::one_of({"paper", "small"}))->capture_default_str();
    app.add_option("--representation", representation_, "of rotations")->check(cli::one_of({"quaternion", "rotation-matrix", "axis-angle"}))->capture_default_str();
    app.add_option("--distance", distance_, "between rotations: 2 arccos |q.q'| (d1), 1 - |q.q'| (d2), min |q-+q'|^2 (d3), angle between matrices (geodesic), squared difference of the numbers (l2), or between joint "
                   "positions by forward kinematics (fk); default: d1 of quaternions, geodesic of matrices, l2 of axis-angle vectors")->check(cli::one_of({"d1", "d2", "d3", "geodesic", "l2", "fk"}));
    app.add_option("--ablate", ablations_, "leave a part of the model out (repeatable): the word encoder and decoder (single-layer: words are frames), the joints' weights (uniform-joints), the classifiers (no-classifier)")
        ->check(cli::one_of({"single-layer", "uniform-joints", "no-classifier"}));
    app.add_option("--exposure", exposure_, "remedy for exposure bias: the model's own output, noise on the input, joints of the input left out, none")->check(cli::one_of({"own-output", "noise", "joint-dropout", "none"}))->capture_default_str();
    app.add_option("--classifier", classifiers_, "classifier of one attribute whose layers join the loss (repeatable)")->check(cli::path());
    app.add_option("--attribute", attributes_, "attribute to condition on (repeatable; default: all that label at least half of the clips, but subject; clips without them are left out)");
    app.add_option("--unlabelled", unlabelled_, "clips that lack a label: drop, or fill: draw it each time from the probabilities that `classify` left in the archive")
        ->check(cli::one_of({"drop", "fill"}))
        ->capture_default_str();
    app.add_option("--val", validation_, "archive whose loss is logged, without effect on the weights")->check(cli::path());
    app.add_option("--steps", steps_, "optimiser steps, word pretraining included")->check(cli::whole(1, 1000000000, "STEPS"));
    app.add_option("--epochs", epochs_, "passes over the clips, instead of --steps")->check(cli::whole(1, 1000000000, "EPOCHS"));
    app.add_option("--batch", batch_, "clips in a batch (preset)")->check(cli::whole(1, 65536, "CLIPS"));
    app.add_option("--window", window_, "frames of a training window, instead of the preset's growing ones; the Motion Cell's are cut to whole words")->check(cli::whole(3, 100000, "FRAMES"));
    app.add_option("--learning-rate", rate_, "of Adam (preset)")->check(cli::positive("RATE"));
    app.add_option("--reconstruction-scale", scale_, "weight of the reconstruction against a KL weight of 1 (preset)")->check(cli::positive("WEIGHT"));
    app.add_option("--velocity-weight", velocity_, "weight of the frame-to-frame change of rotations and root values; 0 as in the paper (preset)")->check(cli::non_negative("WEIGHT"));
    app.add_option("--root-weight", root_, "weight of the root's velocities, height and turning, in standard deviations, against rotations in radians times metres of reach (0.25; quaternet, erd 0.5)")->check(cli::non_negative("WEIGHT"));
    app.add_option("--constraint-weight", constraint_, "weight of what keeps rotations valid: unit quaternions, orthonormal matrices (0.1)")->check(cli::non_negative("WEIGHT"));
    app.add_option("--classifier-weight", classifier_weight_, "weight of the classifiers' loss against the reconstruction, in the end (0.03)")->check(cli::non_negative("WEIGHT"));
    app.add_option("--cl-ramp", cl_ramp_, "progress at which the classifiers' weight starts to rise from 0 and reaches its end (0.1 0.4)")->expected(2)->check(cli::between(0, 1, "PROGRESS"));
    app.add_option("--kl-ramp", kl_ramp_, "progress at which the KL weight starts to rise from 0.1 and reaches 1 (0 0.4)")->expected(2)->check(cli::between(0, 1, "PROGRESS"));
    app.add_option("--exposure-ramp,--own-output", exposure_ramp_, "progress at which the remedy for exposure bias starts to grow from nothing and reaches its end (0.1 0.6)")
        ->expected(2)
        ->check(cli::between(0, 1, "PROGRESS"));
    app.add_option("--own-output-rate", own_output_rate_, "share of input words replaced by the model's own in the end, with --exposure own-output (1; erd 0.5)")->check(cli::between(0, 1, "SHARE"));
    app.add_option("--noise-deviation", noise_, "of the noise on standardised features in the end, with --exposure noise (0.05)")->check(cli::non_negative("DEVIATION"));
    app.add_option("--dropout-rate", dropout_, "share of input joints left out in the end, with --exposure joint-dropout (0.1)")->check(cli::between(0, 1, "SHARE"));
    app.add_option("--overlap", overlap_, "frames of the next word that each word's decoder writes too, faded into it; 0 as in the paper (preset)")->check(cli::whole(0, 3, "FRAMES"));
    app.add_option("--pretrain-steps", pretrain_, "of --steps, steps on single words without recurrence at the start (preset)")->check(cli::whole(0, 1000000000, "STEPS"));
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    std::vector<std::string> read = classifiers_;
    read.push_back(validation_);
    const std::string input = begin(context, read);
    if (steps_ && epochs_) refuse_usage("both --steps and --epochs, expected one of them");
    const auto representation = features::parse_representation(representation_);
    if (!distance_.empty()) objective::check_distance(objective::parse_distance(distance_), representation);
    const train::MotionDataset data(input, representation, attributes_, nullptr, unlabelled());
    if (data.vocabulary().empty())
      refuse({input, 0, {}}, "no attribute labels half of the clips or more, expected at least one to condition on", "give `canonicalize --labels` a table, or name one with --attribute");
    if (data.left_out() > 0)
      log::warn("{} of {} clips are left out: they lack a label{}", data.left_out(), data.left_out() + data.clips().size(),
                data.fillable() > 0 ? fmt::format(" (--unlabelled fill would use {}, with the probabilities that a classifier found)", data.fillable()) : std::string());
    if (data.filled() > 0) log::warn("{} of {} clips lack a label: each draw takes one from the probabilities that a classifier found", data.filled(), data.clips().size());
    if (data.changing() > 0) log::info("{} clips change their attributes on the way", data.changing());
    std::unique_ptr<train::MotionDataset> validation;
    if (!validation_.empty()) validation = std::make_unique<train::MotionDataset>(validation_, representation, attributes_, &data, unlabelled());
    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    if (validation) inputs.push_back(tools::history_input(validation_, validation->file_sha256()));
    if (arch_ != "motion-cell") return train_baseline(context, data, validation.get(), std::move(inputs));
    return train_motion_cell(context, data, validation.get(), std::move(inputs));
  }

 private:
  train::Unlabelled unlabelled() const { return unlabelled_ == "fill" ? train::Unlabelled::fill : train::Unlabelled::drop; }
  bool ablated(const char* part) const { return std::find(ablations_.begin(), ablations_.end(), part) != ablations_.end(); }

  Exit train_motion_cell(cli::Context& context, const train::MotionDataset& data, const train::MotionDataset* validation, std::vector<HistoryInput> inputs) {
    motion_cell::MotionCellConfig network = motion_cell::MotionCellConfig::preset(preset_);
    if (ablated("single-layer")) {
      if (overlap_.value_or(0) > 0) refuse_usage("--overlap with --ablate single-layer, which has no words");
      network.single_layer = true;
      network.overlap = 0;
      network.word_length = 1;
    }
    if (overlap_) network.overlap = *overlap_;
    if (!input_noise_.empty()) refuse_usage("--input-noise with --arch motion-cell, expected quaternet or erd");
    motion_cell::TrainingConfig config = configuration(data, network.word_length);
    config.seed = context.seed();
    std::unique_ptr<objective::ClassifierLoss> classifiers;
    if (ablated("no-classifier")) {
      if (!classifiers_.empty()) log::info("--ablate no-classifier: the classifiers given take no part");
    } else if (!classifiers_.empty()) {
      classifiers = std::make_unique<objective::ClassifierLoss>(classifiers_, data);
      // In the history, where fid-eval finds who trained the generator.
      for (std::size_t i = 0; i < classifiers_.size(); ++i) inputs.push_back(tools::history_input(classifiers_[i], classifiers->sha256()[i]));
    }
    motion_cell::MotionCellTraining training(network, config, data, validation, classifiers.get());
    log::info("{} clips, {} frames, {} combinations of attributes; {} parameters, {} steps", data.clips().size(), data.frames(), data.combinations().size(),
              training.network().parameter_count(), training.steps());
    return train(context, training, data.header().history, std::move(inputs));
  }

  // The deterministic baselines take over batches, windows, schedules and length of the Motion Cell's training.
  Exit train_baseline(cli::Context& context, const train::MotionDataset& data, const train::MotionDataset* validation, std::vector<HistoryInput> inputs) const {
    if (scale_ || !kl_ramp_.empty() || pretrain_ || overlap_) refuse_usage(fmt::format("--reconstruction-scale, --kl-ramp, --pretrain-steps or --overlap with --arch {}, which has no latent variable", arch_));
    if (!classifiers_.empty() || ablated("single-layer") || ablated("no-classifier")) refuse_usage(fmt::format("--classifier or --ablate single-layer or no-classifier with --arch {}, expected --arch motion-cell", arch_));
    if (exposure_ != "own-output") refuse_usage(fmt::format("--exposure {} with --arch {}, expected --own-output-rate and --input-noise", exposure_, arch_));
    const motion_cell::TrainingConfig c = configuration(data, 1);  // their words are frames
    const auto arch = arch_ == "erd" ? baselines::Arch::erd : baselines::Arch::quaternet;
    baselines::TrainingConfig config = baselines::TrainingConfig::of(arch);
    config.steps = c.steps > 0 ? c.steps : c.epochs * ((static_cast<std::int64_t>(data.clips().size()) + c.batch - 1) / c.batch);
    config.batch = c.batch;
    config.shards = c.shards;
    config.seed = context.seed();
    config.objective = c.objective;
    config.objective.root_weight = root_.value_or(objective::ObjectiveConfig{}.root_weight);  // the preset's is tuned for the Motion Cell
    config.gradient_limit = c.gradient_limit;
    config.learning_rate = c.learning_rate;
    config.windows = c.windows;
    config.own_output = {0, own_output_rate_.value_or(config.own_output.to), c.own_output.begin, c.own_output.end};
    if (!input_noise_.empty()) {
      if (input_noise_[0] > input_noise_[1] || input_noise_[1] > 1) refuse_usage(fmt::format("--input-noise {} {}, expected the start before the end and both in 0..1", input_noise_[0], input_noise_[1]));
      config.input_noise.ramp = {0, input_noise_[2], input_noise_[0], input_noise_[1]};
    }
    baselines::BaselineTraining training(baselines::BaselineConfig::preset(arch, preset_), config, data, validation);
    log::info("{}: {} clips, {} frames, {} combinations of attributes; {} parameters, {} steps", arch_, data.clips().size(), data.frames(), data.combinations().size(),
              training.network().parameter_count(), training.steps());
    return train(context, training, data.header().history, std::move(inputs));
  }

  motion_cell::TrainingConfig configuration(const train::MotionDataset& data, std::int64_t word_length) const {
    auto c = motion_cell::TrainingConfig::preset(preset_);
    const auto clips = static_cast<std::int64_t>(data.clips().size());
    c.objective.distance = distance_.empty() ? objective::default_distance(data.layout().representation) : objective::parse_distance(distance_);
    if (batch_) c.batch = *batch_;
    if (steps_ || epochs_) {
      // A shorter or longer run of a preset keeps the preset's share of word pretraining.
      const double share = c.steps > 0 ? static_cast<double>(c.pretraining.steps) / static_cast<double>(c.steps) : 0;
      c.epochs = epochs_.value_or(0);
      c.steps = steps_ ? *steps_ : c.epochs * ((clips + c.batch - 1) / c.batch);
      c.pretraining.steps = static_cast<std::int64_t>(share * static_cast<double>(c.steps));
    }
    c.shards = shards();
    if (window_) c.windows = {{0, *window_ - *window_ % word_length}};
    if (rate_) c.learning_rate.rate = *rate_;
    if (scale_) c.reconstruction_scale = *scale_;
    if (velocity_) c.objective.velocity_weight = *velocity_;
    if (root_) c.objective.root_weight = *root_;
    if (constraint_ && data.layout().representation == features::RotationRepresentation::axis_angle) log::warn("--constraint-weight: axis-angle vectors have no constraint, it changes nothing");
    if (constraint_) c.objective.unit_norm_weight = c.objective.orthogonality_weight = c.objective.determinant_weight = *constraint_;
    c.objective.uniform_joints = ablated("uniform-joints");
    if (pretrain_) c.pretraining.steps = *pretrain_;
    const auto ramp = [](const char* name, const std::vector<double>& v, train::Ramp& r) {
      if (v.empty()) return;
      if (v[0] > v[1]) refuse_usage(fmt::format("{} {} {}, expected the start before the end", name, v[0], v[1]));
      r.begin = v[0];
      r.end = v[1];
    };
    ramp("--kl-ramp", kl_ramp_, c.kl_weight);
    ramp("--cl-ramp", cl_ramp_, c.classifier_weight);
    for (train::Ramp* r : {&c.own_output, &c.noise, &c.joint_dropout}) ramp("--exposure-ramp", exposure_ramp_, *r);
    c.exposure = motion_cell::parse_exposure(exposure_);
    if (c.exposure == motion_cell::Exposure::none && !exposure_ramp_.empty()) refuse_usage("--exposure-ramp with --exposure none, which has nothing that grows");
    const auto amount = [&](const char* name, const std::optional<double>& value, motion_cell::Exposure of, train::Ramp& r) {
      if (!value) return;
      if (c.exposure != of) refuse_usage(fmt::format("{} with --exposure {}, expected --exposure {}", name, exposure_, motion_cell::text(of)));
      r.to = *value;
    };
    amount("--own-output-rate", own_output_rate_, motion_cell::Exposure::own_output, c.own_output);
    amount("--noise-deviation", noise_, motion_cell::Exposure::noise, c.noise);
    amount("--dropout-rate", dropout_, motion_cell::Exposure::joint_dropout, c.joint_dropout);
    if (classifiers_.empty() && (classifier_weight_ || !cl_ramp_.empty())) refuse_usage("a weight or ramp of the classifiers' loss without classifiers, expected --classifier FILE");
    if (classifier_weight_) c.classifier_weight.to = *classifier_weight_;
    return c;
  }

  std::string arch_ = "motion-cell", preset_ = "small", validation_, unlabelled_ = "drop", representation_ = "quaternion", distance_, exposure_ = "own-output";
  std::vector<std::string> attributes_, ablations_, classifiers_;
  std::optional<int> overlap_;
  std::optional<std::int64_t> steps_, epochs_, batch_, window_, pretrain_;
  std::optional<double> rate_, scale_, velocity_, root_, constraint_, classifier_weight_, own_output_rate_, noise_, dropout_;
  std::vector<double> kl_ramp_, cl_ramp_, exposure_ramp_, input_noise_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainVrnn>(argc, argv); }
