// train-denoiser - train a denoising autoencoder of poses on a motion archive.
#include <fmt/core.h>

#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/denoiser/training.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/train/loop.hpp"
#include "libmodels/train/signals.hpp"

namespace {

using namespace mocap;

class TrainDenoiser final : public cli::Tool {
 public:
  std::string name() const override { return "train-denoiser"; }
  std::string synopsis() const override { return "Train a denoiser on clean motion, which it learns to give back from corrupted motion"; }
  std::string description() const override {
    return "A convolutional autoencoder sees windows of standardised pose features in which some numbers are disturbed, and learns what was there before. Labels are not needed: "
           "train it on motion that the models do not use. By default a tenth of the numbers gets noise of 0.5 deviations, as in the paper, which teaches it to mend outliers; "
           "--corrupt-share 1 with a smaller --corrupt-deviation teaches it jitter of all joints. Writes a model file for `denoise`, with a log and checkpoints beside it while it runs; "
           "stop it and run the same line with --resume to continue to the same weights, bit for bit.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-denoiser rest.h5 --val val.h5 -o denoiser.h5", "the paper's settings, 300 epochs"},
            {"train-denoiser rest.h5 --corrupt-share 1 --corrupt-deviation 0.1 --learning-rate 0.001 --epochs 100 -o jitter.h5", "against jitter of everything, sooner"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, sections 3.1 and 4.2, Table 1"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::file;
    t.random = true;
    t.network = true;
    t.input_help = "motion archive to train on";
    t.output_help = "model file";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  bool check_output_first() const override { return !resume_; }
  std::vector<std::string> non_content_options() const override { return {"--resume", "--checkpoint-minutes", "--weights-only", "--val-epochs"}; }

  void options(CLI::App& app) override {
    app.add_option("--val", validation_, "archive whose loss is logged, without effect on the weights")->check(cli::path());
    app.add_option("--epochs", c_.epochs, "passes over the data")->check(cli::whole(1, 1000000000, "EPOCHS"))->capture_default_str();
    app.add_option("--batch", c_.batch, "windows in a batch")->check(cli::whole(1, 65536, "CLIPS"))->capture_default_str();
    app.add_option("--window", c_.window, "frames of a window, even; 12 more on either side are seen but not judged")->check(cli::whole(2, 100000, "FRAMES"))->capture_default_str();
    app.add_option("--corrupt-share", c_.share, "share of the numbers that are disturbed")->check(cli::between(0, 1, "SHARE"))->capture_default_str();
    app.add_option("--corrupt-deviation", c_.corruption, "of the noise on standardised features")->check(cli::positive("DEVIATION"))->capture_default_str();
    app.add_option("--learning-rate", c_.learning_rate, "of Adam; times 0.99 every 10 epochs")->check(cli::positive("RATE"))->capture_default_str();
    app.add_option("--shards", c_.shards, "parts of a batch computed side by side; part of the configuration, so that -j never changes the result")
        ->check(cli::whole(1, 1024, "PARTS"))->capture_default_str();
    app.add_flag("--resume", resume_, "continue from the newest checkpoint; start afresh where there is none");
    app.add_flag("--weights-only", weights_only_, "leave the optimiser's state out of the finished model (a third of the size)");
    app.add_option("--checkpoint-minutes", checkpoint_minutes_, "between checkpoints")->check(cli::positive("MINUTES"))->capture_default_str();
    app.add_option("--val-epochs", val_epochs_, "between validations")->check(cli::whole(1, 1000000000, "EPOCHS"))->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    const std::string& input = context.inputs().at(0).path;
    std::error_code ignored;
    if (std::filesystem::equivalent(input, context.common().output, ignored)) refuse_usage("-o " + context.common().output + " is the archive to train on, expected another file");
    const denoiser::Data data(input);
    std::unique_ptr<denoiser::Data> validation;
    if (!validation_.empty()) validation = std::make_unique<denoiser::Data>(validation_, &data);
    c_.seed = context.seed();
    denoiser::DenoiserTraining training(c_, data, validation.get());
    log::info("{} clips, {} frames; {} parameters, {} steps", data.clips().size(), data.frames(), training.network().config().parameter_count(), training.steps());

    train::LoopOptions loop;
    loop.output = context.common().output;
    loop.overwrite = context.overwrite();
    loop.resume = resume_;
    loop.weights_only = weights_only_;
    loop.threads = context.threads();
    loop.checkpoint_minutes = checkpoint_minutes_;
    loop.validate_epochs = val_epochs_;
    loop.history = data.header().history;
    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    if (validation) inputs.push_back({validation_.substr(validation_.rfind('/') + 1), validation->file_sha256()});
    loop.history.push_back(context.history_entry(std::move(inputs)));
    train::catch_stop_signals();
    const auto result = train::train(training, loop, [&](const train::Progress& p) {
      context.progress(static_cast<std::size_t>(p.step), static_cast<std::size_t>(p.steps), fmt::format("steps, loss {:.4g}", p.loss));
    });
    if (!result.finished) {
      log::info("stopped at step {} of {} with a checkpoint; run the same line with --resume to continue", result.step, training.steps());
      return Exit::interrupted;
    }
    return Exit::ok;
  }

 private:
  std::string validation_;
  denoiser::TrainingConfig c_;
  bool resume_ = false, weights_only_ = false;
  double checkpoint_minutes_ = 5;
  std::int64_t val_epochs_ = 10;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainDenoiser>(argc, argv); }
