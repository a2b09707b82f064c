// train-lstm - train the LSTM generator with mixture outputs on a motion archive.
#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/lstm_gmm/model.hpp"
#include "libmodels/lstm_gmm/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

class TrainLstm final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-lstm"; }
  std::string synopsis() const override { return "Train the contact-aware LSTM generator, which predicts the next frame as a Gaussian mixture"; }
  std::string description() const override {
    return "Two LSTM layers between fully connected ones give, from a frame and what came before, the distribution of the next frame's features and of both foot contacts. It needs no labels and "
           "generates motion without end: `sample` starts it from the first frame of any clip. Clips without contacts are labelled by the rule `default`. Writes a model file, with a log and "
           "checkpoints beside it while it runs; stop it and run the same line with --resume to continue to the same weights, bit for bit. --init-from starts from a model trained on more or other "
           "motion of the same body. With --val, likelihood and one-step error on that archive are printed in the end.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-lstm walking.h5 --val val.h5 -o lstm.h5", "minutes on two cores"},
            {"train-lstm all.h5 -o general.h5 && train-lstm walking.h5 --init-from general.h5 --steps 2000 -o lstm.h5", "first everything, then the part that counts"},
            {"train-lstm walking.h5 --preset paper --resume -o lstm.h5", "the paper's size and 30,000 iterations; the same line starts and continues it"}};
  }
  std::vector<std::string> references() const override {
    return {"Wang, Chai, Xia 2018, Combining Recurrent Neural Networks and Adversarial Training for Human Motion Modelling, Synthesis and Control, section 4.1 and Appendix A"};
  }
  cli::Traits traits() const override {
    cli::Traits t = TrainingTool::traits();
    t.report = true;
    return t;
  }

  void options(CLI::App& app) override {
    app.add_option("--preset", preset_, "paper (layers of 512, 30,000 steps) or small (256, 3,000)")->check(cli::one_of({"paper", "small"}))->capture_default_str();
    app.add_option("--cell", cell_, "what the gates of the LSTM see: its memory and its output (paper), or its output alone (standard)")->check(cli::one_of({"paper", "standard"}))->capture_default_str();
    app.add_option("--carry", carry_, "share of the frame before that the means of the mixture are added to; 0, as in the paper, learns much more slowly")->check(cli::between(0, 1, "SHARE"))->capture_default_str();
    app.add_option("--init-from", init_, "start from the weights and the normalisation of this model, which decides preset's sizes, --cell and --carry")->check(cli::path());
    app.add_option("--val", validation_, "archive that loss and one-step error are found on, without effect on the weights")->check(cli::path());
    app.add_option("--steps", steps_, "optimiser steps (preset)")->check(cli::whole(1, 1000000000, "STEPS"));
    app.add_option("--batch", c_.batch, "windows in a batch")->check(cli::whole(1, 65536, "CLIPS"))->capture_default_str();
    app.add_option("--window", c_.window, "frames of a window")->check(cli::whole(1, 100000, "FRAMES"))->capture_default_str();
    app.add_option("--input-noise", c_.input_noise, "deviation of the noise on the standardised input features")->check(cli::non_negative("DEVIATION"))->capture_default_str();
    app.add_option("--learning-rate", c_.rate, "of RMSProp at the start")->check(cli::positive("RATE"))->capture_default_str();
    app.add_option("--decay-steps", decay_steps_, "after which the rate is multiplied by 0.95 (a 75th of the steps; paper: a 150th)")->check(cli::whole(1, 1000000000, "STEPS"));
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    const std::string input = begin(context, {validation_, init_});
    if (validation_ == "-") refuse_usage("--val -: standard input is for the archive to train on, expected a file");
    if (init_ == "-" && input == "-") refuse_usage("--init-from - and the archive from standard input, expected one of them to be a file");
    lstm_gmm::LstmGmmConfig network = lstm_gmm::LstmGmmConfig::preset(preset_);
    network.cell = lstm_gmm::parse_cell(cell_);
    network.carry = carry_;
    lstm_gmm::Model init;
    std::string init_digest;
    History before;
    if (!init_.empty()) {
      const store::ModelFile file = store::read_model(init_, &init_digest);
      init = lstm_gmm::read(file, init_);
      network = init.network->config();
      before = file.history;
    }
    const train::StateDataset data(input, init.network ? std::optional(init.reference) : std::nullopt);
    if (data.left_out() > 0) log::warn("{} clips of one frame are left out: there is no next frame to predict", data.left_out());
    if (data.labelled_here()) log::warn("{}: clips without contacts are labelled by the rule default", input);
    std::unique_ptr<train::StateDataset> validation;
    if (!validation_.empty()) validation = std::make_unique<train::StateDataset>(validation_, data.reference());
    c_.steps = steps_.value_or(lstm_gmm::TrainingConfig::preset(preset_).steps);
    c_.decay_steps = decay_steps_.value_or(std::max<std::int64_t>(1, c_.steps / (preset_ == "paper" ? 150 : 75)));
    c_.seed = context.seed();
    c_.shards = shards();
    c_.init_digest = init_digest;
    lstm_gmm::LstmGmmTraining training(network, c_, data, validation.get());
    if (init.network) training.start_from(*init.network);
    log::info("{} clips, {} frames; {} parameters, {} steps", data.clips().size(), data.frames(), network.parameter_count(), training.steps());

    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    if (validation) inputs.push_back(tools::history_input(validation_, validation->file_sha256()));
    History history = data.header().history;
    if (!init_.empty()) {
      inputs.push_back(tools::history_input(init_, init_digest));
      history.insert(history.end(), before.begin(), before.end());
    }
    if (const Exit exit = train(context, training, std::move(history), std::move(inputs)); exit != Exit::ok) return exit;
    if (validation) report(context, *validation);
    return Exit::ok;
  }

 private:
  static void report(cli::Context& context, const train::StateDataset& validation) {
    const std::string& output = context.common().output;
    const auto p = lstm_gmm::prediction(*lstm_gmm::read(store::read_model(output), output).network, validation);
    if (context.common().json)
      context.print(nlohmann::ordered_json{{"nats_per_frame", p.nats}, {"contact_nats_per_frame", p.contact_nats}, {"angle_error_deg", p.angle_deg}, {"persistence_deg", p.persistence_deg}, {"contact_error", p.contact_errors}}.dump(2) + "\n");
    else
      context.print(fmt::format("negative log-likelihood  {:.3f} nats a frame, of contacts {:.4f}\none-step joint error     {:.3f} degrees (the frame before: {:.3f})\ncontact bits wrong       {:.2f} %\n", p.nats, p.contact_nats,
                                p.angle_deg, p.persistence_deg, 100 * p.contact_errors));
  }

  std::string preset_ = "small", cell_ = "paper", init_, validation_;
  double carry_ = lstm_gmm::LstmGmmConfig{}.carry;
  std::optional<std::int64_t> steps_, decay_steps_;
  lstm_gmm::TrainingConfig c_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainLstm>(argc, argv); }
