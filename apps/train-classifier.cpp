// train-classifier - train a classifier of one attribute on a motion archive.
#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/classifier/classifier.hpp"
#include "libmodels/classifier/confusion.hpp"
#include "libmodels/classifier/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

class TrainClassifier final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-classifier"; }
  std::string synopsis() const override { return "Train a classifier of one attribute, to label motion and to judge generated motion by"; }
  std::string description() const override {
    return "Three convolutions over time see the pose and its change from frame to frame; their mean over the frames (32 numbers) gives the class scores. Every crop trained on "
           "is as long for one class as for another, so that duration does not give the class away. Give the classifier of a generator's loss one --half of the data and the one that "
           "judges it the other: they then share no source file. Writes a model file, with a log and checkpoints beside it while it runs; stop it and run the same line with "
           "--resume to continue to the same weights, bit for bit. With --val, accuracy on that archive is printed in the end.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-classifier train.h5 --attribute action --val val.h5 -o action.h5", "seconds on one core"},
            {"train-classifier train.h5 --attribute style --half B -o style-judge.h5", "the half that a generator's --half A classifier did not see"},
            {"train-classifier train.h5 --attribute gender --resume -o gender.h5", "the same line starts and continues it"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, sections 3.4 and 4.2, Table 1"}; }
  cli::Traits traits() const override {
    cli::Traits t = TrainingTool::traits();
    t.report = true;
    return t;
  }

  void options(CLI::App& app) override {
    app.add_option("--attribute", attribute_, "attribute to learn; clips without it are left out")->required();
    app.add_option("--val", validation_, "archive that loss and accuracy are found on, without effect on the weights")->check(cli::path());
    app.add_option("--half", half_, "train on one half of the source files; the paper trains on half of the data")->check(cli::one_of({"A", "B", "all"}))->capture_default_str();
    app.add_option("--half-seed", half_seed_, "decides the halves: equal for classifiers that are to share no source")->check(cli::whole(0))->capture_default_str();
    app.add_option("--epochs", c_.epochs, "passes over the clips")->check(cli::whole(1, 1000000000, "EPOCHS"))->capture_default_str();
    app.add_option("--batch", c_.batch, "crops in a batch")->check(cli::whole(1, 65536, "CLIPS"))->capture_default_str();
    app.add_option("--window", c_.window, "longest crop; no class's median clip is shorter than the crops drawn")->check(cli::whole(1, 100000, "FRAMES"))->capture_default_str();
    app.add_option("--noise", c_.noise, "deviation of the noise on standardised inputs")->check(cli::non_negative("DEVIATION"))->capture_default_str();
    app.add_option("--learning-rate", c_.learning_rate.rate, "of Adam at the start; it falls to 0.04 of this")->check(cli::positive("RATE"))->capture_default_str();
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    const std::string input = begin(context, {validation_});
    if (validation_ == "-") refuse_usage("--val -: accuracy is found in a second reading, expected a file");
    const classifier::Data data(input, attribute_, classifier::parse_half(half_), static_cast<std::uint64_t>(half_seed_));
    if (data.left_out() > 0) log::warn("{} clips are left out: they lack a label", data.left_out());
    std::unique_ptr<classifier::Data> validation;
    if (!validation_.empty()) validation = std::make_unique<classifier::Data>(validation_, attribute_, classifier::Half::all, 0, &data);
    c_.seed = context.seed();
    c_.shards = shards();
    c_.half = half_;
    c_.half_seed = static_cast<std::uint64_t>(half_seed_);
    classifier::ClassifierTraining training(c_, data, validation.get());
    log::info("{} clips, {} frames, {} classes of {}; {} parameters, {} steps on crops of {} to {} frames", data.items().size(), data.frames(), data.classes().size(), attribute_,
              training.network().config().parameter_count(), training.steps(), training.shortest(), training.longest());

    std::vector<HistoryInput> inputs = {{context.inputs()[0].label, data.file_sha256()}};
    if (validation) inputs.push_back(tools::history_input(validation_, validation->file_sha256()));
    if (const Exit exit = train(context, training, data.header().history, std::move(inputs)); exit != Exit::ok) return exit;
    if (validation) report(context);
    return Exit::ok;
  }

 private:
  void report(cli::Context& context) const {
    const auto trained = classifier::Classifier::load(context.common().output);
    const store::ArchiveReader reader(validation_);
    std::vector<Clip> clips;
    for (std::size_t i = 0; i < reader.size(); ++i) clips.push_back(reader.read(i));
    const auto found = classifier::confusion(*trained, clips, trained->judge(clips, context.threads()));
    if (context.common().json)
      context.print(found.to_json().dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    else
      context.print(found.to_text());
  }

  std::string attribute_, validation_, half_ = "all";
  std::int64_t half_seed_ = 1;
  classifier::TrainingConfig c_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainClassifier>(argc, argv); }
