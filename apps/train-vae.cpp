// train-vae - train the convolutional autoencoder and the variational autoencoder of motion windows.
#include <fmt/core.h>

#include <memory>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/cae_vae/reconstruction.hpp"
#include "libmodels/cae_vae/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

class TrainVae final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-vae"; }
  std::string synopsis() const override { return "Train a convolutional autoencoder of motion windows and a variational autoencoder of its features"; }
  std::string description() const override {
    return "Motion is cut into windows of joint positions, seen from a frame on the ground under the root, with the root's velocities. A convolutional autoencoder learns to give a window back "
           "from half as many frames of fewer features; then a variational autoencoder learns where these lie in a latent space in which `sample` can draw new motion, walk along single axes and go from one window to another. "
           "Both stages go into one model file. Labels are not needed. Clips shorter than a window are not used; split by clip or source before (motion-split), so that no window of a test clip is seen. "
           "At the end what each stage loses is told in millimetres, of --val where it is given. Stop it and run the same line with --resume to continue to the same weights, bit for bit.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-vae train.h5 --val val.h5 -o vae.h5", "the paper's sizes, 200 epochs of each stage"},
            {"train-vae train.h5 --windows fixed --upsampling nearest --full-rate 1 --least-deviation 0 -o paper.h5", "without what was added to the paper; sample --prior normal goes with it"},
            {"train-vae train.h5 --root-filters separate -o separate.h5", "the authors' remedy for root motion that does not match the body"},
            {"train-vae train.h5 --window 60 --overlap 30 -o short.h5", "windows of two seconds, for shorter clips"}};
  }
  std::vector<std::string> references() const override { return {"Motegi, Hijioka, Murakami 2018, sections II to IV and VI"}; }
  void options(CLI::App& app) override {
    app.add_option("--val", validation_, "archive whose loss is logged, without effect on the weights")->check(cli::path());
    app.add_option("--root-filters", root_filters_, "whether the filters that see the pose see the root's velocities as well, or these have filters of their own")->check(cli::one_of({"shared", "separate"}))->capture_default_str();
    app.add_option("--epochs", c_.epochs, "passes over the data of the autoencoder")->check(cli::whole(1, 1000000000, "EPOCHS"))->capture_default_str();
    app.add_option("--vae-epochs", vae_epochs_, "passes over the data of the variational autoencoder (default: as many)")->check(cli::whole(1, 1000000000, "EPOCHS"));
    app.add_option("--batch", c_.batch, "windows in a batch")->check(cli::whole(1, 65536, "WINDOWS"))->capture_default_str();
    app.add_option("--window", n_.window, "frames of a window; even")->check(cli::whole(2, 4096, "FRAMES"))->capture_default_str();
    app.add_option("--overlap", overlap_, "frames that a window shares with the one before it (default: half of them)")->check(cli::whole(0, 4095, "FRAMES"));
    app.add_option("--filters", n_.filters, "of the autoencoder; an eighth of them, at least one, are the root's where they are separate")->check(cli::whole(2, 4096, "FILTERS"))->capture_default_str();
    app.add_option("--kernel", n_.kernel, "frames that a filter sees; odd")->check(cli::whole(1, 4095, "FRAMES"))->capture_default_str();
    app.add_option("--upsampling", upsampling_, "of pooled frames: each twice, or linear between them")->check(cli::one_of({"nearest", "linear"}))->capture_default_str();
    app.add_option("--hidden", n_.hidden, "units of the hidden layers of the variational autoencoder")->check(cli::whole(1, 4096, "UNITS"))->capture_default_str();
    app.add_option("--latent", n_.latent, "dimensions of the latent space")->check(cli::whole(1, 4096, "DIMENSIONS"))->capture_default_str();
    app.add_option("--learning-rate", c_.learning_rate, "of Adam")->check(cli::positive("RATE"))->capture_default_str();
    app.add_option("--full-rate", c_.full_rate, "share of each stage's epochs with the whole rate; from there on it falls linearly to 0 (1: never, as in the paper)")->check(cli::between(0, 1, "SHARE"))->capture_default_str();
    app.add_option("--gradient-limit", c_.gradient_limit, "of the norm of all derivatives together, for each root of a feature in the second stage")->check(cli::positive("NORM"))->capture_default_str();
    app.add_option("--kl-weight", c_.kl_weight, "factor on the KL divergence; above 1 latents lie closer to what is drawn from, and say less")->check(cli::non_negative("FACTOR"))->capture_default_str();
    app.add_option("--windows", windows_, "fixed: those of --overlap, as in the paper; shifted: each begins up to a step later, drawn anew every epoch")->check(cli::one_of({"shifted", "fixed"}))->capture_default_str();
    app.add_option("--least-deviation", c_.least_deviation, "that a feature of the autoencoder can be told with, standardised; a floor keeps the second stage from knowing its windows by heart")->check(cli::non_negative("DEVIATION"))->capture_default_str();
    app.add_option("--prior-components", c_.prior_components, "Gaussians of the mixture that is fitted to where the training windows lie in the latent space, for `sample --prior mixture`")->check(cli::whole(1, 1024, "COMPONENTS"))->capture_default_str();
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    const std::string input = begin(context, {validation_});
    if (validation_ == "-") refuse_usage("standard input as a second archive, expected a file");
    c_.vae_epochs = vae_epochs_.value_or(c_.epochs);
    c_.overlap = overlap_.value_or(n_.window / 2);
    if (cae_vae::parse_root_filters(root_filters_) == cae_vae::RootFilters::separate) n_.root_filters = std::max(1, n_.filters / 8);
    n_.upsampling = cae_vae::parse_upsampling(upsampling_);
    try {
      n_.validate();
    } catch (const Error& e) {
      refuse_usage(e.message());
    }
    const cae_vae::WindowDataset data(input, n_.window, c_.overlap);
    std::unique_ptr<cae_vae::WindowDataset> validation;
    if (!validation_.empty()) validation = std::make_unique<cae_vae::WindowDataset>(validation_, n_.window, c_.overlap, &data.reference());
    c_.seed = context.seed();
    c_.shifted = windows_ == "shifted";
    c_.shards = shards();
    cae_vae::CaeVaeTraining training(n_, c_, data, validation.get());
    log::info("{} windows of {} clips, {} frames; {} parameters, {} steps", data.windows().size(), data.clips(), data.frames(), n_.parameter_count(), training.steps());
    if (data.left_out() > 0) log::warn("{}: {} clips shorter than a window of {} frames are not used", data.name(), data.left_out(), n_.window);
    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    if (validation) inputs.push_back(tools::history_input(validation_, validation->file_sha256()));
    const Exit status = train(context, training, data.header().history, std::move(inputs));
    if (status == Exit::ok) tell(training, validation ? *validation : data);
    return status;
  }

 private:
  static void tell(const cae_vae::CaeVaeTraining& training, const cae_vae::WindowDataset& data) {
    const auto e = cae_vae::reconstruction_error(training.network(), data);
    log::info("{}: joints of {} windows are given back within {:.1f} mm by the autoencoder, {:.1f} mm by both stages, {:.1f} mm where every frame is the mean pose; with the root's way {:.1f}, {:.1f} mm",
              data.name(), e.windows, e.autoencoder.pose_mm, e.both.pose_mm, e.mean_pose_mm, e.autoencoder.world_mm, e.both.world_mm);
  }

  std::string validation_, root_filters_ = "shared", windows_ = "shifted", upsampling_ = "linear";
  cae_vae::CaeVaeConfig n_;
  cae_vae::TrainingConfig c_;
  std::optional<std::int64_t> vae_epochs_, overlap_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainVae>(argc, argv); }
