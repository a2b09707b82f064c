// train-vrnn - train the Motion Cell on a motion archive.
#include <fmt/core.h>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/motion_cell/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

class TrainVrnn final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-vrnn"; }
  std::string synopsis() const override { return "Train the Motion Cell, a hierarchical recurrent latent-variable model of motion, on a motion archive"; }
  std::string description() const override {
    return "Writes a model file that `sample` generates motion from, with a log (OUTPUT.log.tsv) and two checkpoints (OUTPUT.ckpt-1, OUTPUT.ckpt-2) beside it while it "
           "runs. Stop it at any moment (Ctrl-C, SIGTERM and SIGUSR1 write a checkpoint and end with status 75) and run the same line with --resume to continue to the "
           "same weights, bit for bit; the number of threads does not change them either. The preset `paper` has the sizes and the 1,600 epochs of the paper, `small` fits two CPU "
           "cores and some minutes. Options given on the command line win over the preset.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-vrnn train.h5 --preset small --val val.h5 -o model.h5", "minutes on two cores"},
            {"train-vrnn train.h5 --preset paper --resume -o model.h5", "the paper's size; the same line starts and continues it"},
            {"train-vrnn train.h5 --preset small --steps 9000 --attribute action -o model.h5", "longer, and conditioned on one attribute alone"}};
  }
  std::vector<std::string> references() const override {
    return {"Ghorbani et al. 2020, Probabilistic Character Motion Synthesis using a Hierarchical Deep Latent Variable Model, sections 3 and 4, Table 1"};
  }
  void options(CLI::App& app) override {
    app.add_option("--preset", preset_, "sizes and schedules: paper (Table 1, 1,600 epochs) or small (GRU cells of 256)")->check(cli::one_of({"paper", "small"}))->capture_default_str();
    app.add_option("--attribute", attributes_, "attribute to condition on (repeatable; default: all that label at least half of the clips, but subject; clips without them are left out)");
    app.add_option("--unlabelled", unlabelled_, "clips that lack a label: drop, or fill: draw it each time from the probabilities that `classify` left in the archive")
        ->check(cli::one_of({"drop", "fill"}))
        ->capture_default_str();
    app.add_option("--val", validation_, "archive whose loss is logged, without effect on the weights")->check(cli::path());
    app.add_option("--steps", steps_, "optimiser steps, word pretraining included")->check(cli::whole(1, 1000000000, "STEPS"));
    app.add_option("--epochs", epochs_, "passes over the clips, instead of --steps")->check(cli::whole(1, 1000000000, "EPOCHS"));
    app.add_option("--batch", batch_, "clips in a batch (preset)")->check(cli::whole(1, 65536, "CLIPS"));
    app.add_option("--window", window_, "frames of a training window, instead of the preset's growing ones; cut to whole words")->check(cli::whole(3, 100000, "FRAMES"));
    app.add_option("--learning-rate", rate_, "of Adam (preset)")->check(cli::positive("RATE"));
    app.add_option("--reconstruction-scale", scale_, "weight of the reconstruction against a KL weight of 1 (preset)")->check(cli::positive("WEIGHT"));
    app.add_option("--velocity-weight", velocity_, "weight of the frame-to-frame change of rotations; 0 as in the paper (preset)")->check(cli::non_negative("WEIGHT"));
    app.add_option("--kl-ramp", kl_ramp_, "progress at which the KL weight starts to rise from 0 and reaches 1 (preset)")->expected(2)->check(cli::between(0, 1, "PROGRESS"));
    app.add_option("--own-output", own_output_, "progress at which replacing input words by the model's own output starts, and at which it replaces all (preset)")
        ->expected(2)
        ->check(cli::between(0, 1, "PROGRESS"));
    app.add_option("--own-output-rate", own_output_rate_, "share of input words replaced in the end (preset)")->check(cli::between(0, 1, "SHARE"));
    app.add_option("--pretrain-steps", pretrain_, "of --steps, steps on single words without recurrence at the start (preset)")->check(cli::whole(0, 1000000000, "STEPS"));
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    const std::string input = begin(context);
    if (steps_ && epochs_) refuse_usage("both --steps and --epochs, expected one of them");
    const train::MotionDataset data(input, features::RotationRepresentation::quaternion, attributes_, nullptr, unlabelled());
    if (data.vocabulary().empty())
      refuse({input, 0, {}}, "no attribute labels half of the clips or more, expected at least one to condition on", "give `canonicalize --labels` a table, or name one with --attribute");
    if (data.left_out() > 0)
      log::warn("{} of {} clips are left out: they lack a label{}", data.left_out(), data.left_out() + data.clips().size(),
                data.fillable() > 0 ? fmt::format(" (--unlabelled fill would use {}, with the probabilities that a classifier found)", data.fillable()) : std::string());
    if (data.filled() > 0) log::warn("{} of {} clips lack a label: each draw takes one from the probabilities that a classifier found", data.filled(), data.clips().size());
    if (data.changing() > 0) log::info("{} clips change their attributes on the way", data.changing());
    std::unique_ptr<train::MotionDataset> validation;
    if (!validation_.empty()) validation = std::make_unique<train::MotionDataset>(validation_, features::RotationRepresentation::quaternion, attributes_, &data, unlabelled());
    motion_cell::TrainingConfig config = configuration(static_cast<std::int64_t>(data.clips().size()));
    config.seed = context.seed();
    motion_cell::MotionCellTraining training(motion_cell::MotionCellConfig::preset(preset_), config, data, validation.get());
    log::info("{} clips, {} frames, {} combinations of attributes; {} parameters, {} steps", data.clips().size(), data.frames(), data.combinations().size(),
              training.network().parameter_count(), training.steps());

    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    if (validation) inputs.push_back(tools::history_input(validation_, validation->file_sha256()));
    return train(context, training, data.header().history, std::move(inputs));
  }

 private:
  train::Unlabelled unlabelled() const { return unlabelled_ == "fill" ? train::Unlabelled::fill : train::Unlabelled::drop; }

  motion_cell::TrainingConfig configuration(std::int64_t clips) const {
    auto c = motion_cell::TrainingConfig::preset(preset_);
    if (batch_) c.batch = *batch_;
    if (steps_ || epochs_) {
      // A shorter or longer run of a preset keeps the preset's share of word pretraining.
      const double share = c.steps > 0 ? static_cast<double>(c.pretraining.steps) / static_cast<double>(c.steps) : 0;
      c.epochs = epochs_.value_or(0);
      c.steps = steps_ ? *steps_ : c.epochs * ((clips + c.batch - 1) / c.batch);
      c.pretraining.steps = static_cast<std::int64_t>(share * static_cast<double>(c.steps));
    }
    c.shards = shards();
    if (window_) c.windows = {{0, *window_ - *window_ % 3}};
    if (rate_) c.learning_rate.rate = *rate_;
    if (scale_) c.reconstruction_scale = *scale_;
    if (velocity_) c.velocity_weight = *velocity_;
    if (pretrain_) c.pretraining.steps = *pretrain_;
    const auto ramp = [](const char* name, const std::vector<double>& v, train::Ramp& r) {
      if (v.empty()) return;
      if (v[0] > v[1]) refuse_usage(fmt::format("{} {} {}, expected the start before the end", name, v[0], v[1]));
      r.begin = v[0];
      r.end = v[1];
    };
    ramp("--kl-ramp", kl_ramp_, c.kl_weight);
    ramp("--own-output", own_output_, c.own_output);
    if (own_output_rate_) c.own_output.to = *own_output_rate_;
    return c;
  }

  std::string preset_ = "small", validation_, unlabelled_ = "drop";
  std::vector<std::string> attributes_;
  std::optional<std::int64_t> steps_, epochs_, batch_, window_, pretrain_;
  std::optional<double> rate_, scale_, velocity_, own_output_rate_;
  std::vector<double> kl_ramp_, own_output_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainVrnn>(argc, argv); }
