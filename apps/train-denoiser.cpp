// train-denoiser - train a denoising autoencoder of poses on a motion archive.
#include <memory>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/denoiser/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

class TrainDenoiser final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-denoiser"; }
  std::string synopsis() const override { return "Train a denoiser on clean motion, which it learns to give back from corrupted motion"; }
  std::string description() const override {
    return "A convolutional autoencoder sees windows of standardised pose features in which some numbers are disturbed, and learns what was there before. Labels are not needed: "
           "train it on motion that the models do not use. By default a tenth of the numbers gets noise of 0.5 deviations, as in the paper, which teaches it to mend outliers; "
           "--corrupt-share 1 with a smaller --corrupt-deviation teaches it jitter of all joints. Where the same clips exist as a sensor gives them, --noisy teaches it that sensor's noise, "
           "which is best. The untrained network is a Savitzky-Golay filter. Writes a model file for `denoise`, with a log and checkpoints beside it while it runs; "
           "stop it and run the same line with --resume to continue to the same weights, bit for bit.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-denoiser rest.h5 --val val.h5 -o denoiser.h5", "the paper's settings, 300 epochs"},
            {"train-denoiser clean.h5 --noisy noisy.h5 --learning-rate 0.0005 --rate-decay 0.7 --epochs 80 -o denoiser.h5", "from pairs, minutes"},
            {"train-denoiser rest.h5 --corrupt-share 1 --corrupt-deviation 0.1 --learning-rate 0.001 --epochs 100 -o jitter.h5", "against jitter of everything, sooner"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, sections 3.1 and 4.2, Table 1"}; }
  void options(CLI::App& app) override {
    app.add_option("--noisy", noisy_, "the same clips as a sensor shows them (equal names and lengths): learn from these pairs, without made noise")->check(cli::path());
    app.add_option("--val", validation_, "archive whose loss is logged, without effect on the weights")->check(cli::path());
    app.add_option("--val-noisy", validation_noisy_, "the clips of --val as a sensor shows them; goes with --noisy")->check(cli::path());
    app.add_option("--epochs", c_.epochs, "passes over the data")->check(cli::whole(1, 1000000000, "EPOCHS"))->capture_default_str();
    app.add_option("--batch", c_.batch, "windows in a batch")->check(cli::whole(1, 65536, "CLIPS"))->capture_default_str();
    app.add_option("--window", c_.window, "frames of a window; 8 more on either side are seen but not judged")->check(cli::whole(1, 100000, "FRAMES"))->capture_default_str();
    share_given_ = app.add_option("--corrupt-share", c_.share, "share of the numbers that are disturbed")->check(cli::between(0, 1, "SHARE"))->capture_default_str();
    corruption_given_ = app.add_option("--corrupt-deviation", c_.corruption, "of the noise on standardised features")->check(cli::positive("DEVIATION"))->capture_default_str();
    app.add_option("--learning-rate", c_.learning_rate, "of Adam at the start")->check(cli::positive("RATE"))->capture_default_str();
    app.add_option("--rate-decay", c_.decay, "what the learning rate is multiplied by every 10 epochs")->check(cli::between(0, 1, "FACTOR"))->capture_default_str();
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    const std::string input = begin(context, {noisy_, validation_, validation_noisy_});
    if (!noisy_.empty() && (corruption_given_->count() > 0 || share_given_->count() > 0)) refuse_usage("--corrupt-share or --corrupt-deviation with --noisy, which takes the place of made noise");
    if (noisy_.empty() && !validation_noisy_.empty()) refuse_usage("--val-noisy without --noisy, expected both");
    if (!noisy_.empty() && validation_.empty() != validation_noisy_.empty()) refuse_usage("--val and --val-noisy, expected both or none with --noisy");
    for (const std::string* path : {&noisy_, &validation_, &validation_noisy_})
      if (*path == "-") refuse_usage("standard input as a second archive, expected a file");
    const denoiser::Data data(input);
    const auto read = [&](const std::string& path, const denoiser::Data* twins_of) {
      std::unique_ptr<denoiser::Data> out;
      if (path.empty()) return out;
      out = std::make_unique<denoiser::Data>(path, &data);
      if (twins_of) out->match(*twins_of);
      return out;
    };
    const auto noisy = read(noisy_, &data), validation = read(validation_, nullptr), validation_noisy = read(validation_noisy_, validation.get());
    c_.seed = context.seed();
    c_.shards = shards();
    denoiser::DenoiserTraining training(c_, {&data, noisy.get(), validation.get(), validation_noisy.get()});
    log::info("{} clips, {} frames; {} parameters, {} steps", data.clips().size(), data.frames(), training.network().config().parameter_count(), training.steps());
    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    for (const auto& [path, read_from] : {std::pair{&noisy_, noisy.get()}, {&validation_, validation.get()}, {&validation_noisy_, validation_noisy.get()}})
      if (read_from) inputs.push_back(tools::history_input(*path, read_from->file_sha256()));
    return train(context, training, data.header().history, std::move(inputs));
  }

 private:
  std::string noisy_, validation_, validation_noisy_;
  denoiser::TrainingConfig c_;
  CLI::Option *share_given_ = nullptr, *corruption_given_ = nullptr;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainDenoiser>(argc, argv); }
