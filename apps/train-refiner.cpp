// train-refiner - train the adversarial refiner of generated motion.
#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/generators/generator.hpp"
#include "libmodels/refiner/training.hpp"
#include "libmodels/tools/training_tool.hpp"

namespace {

using namespace mocap;

// `sample` of the same seed makes other motions than those trained on: streams from here on, a multiple of any number of starts that is a power of two.
constexpr std::uint64_t kOtherMotions = std::uint64_t{1} << 32;
constexpr std::int64_t kMostFrames = 1 << 21;

class TrainRefiner final : public tools::TrainingTool {
 public:
  std::string name() const override { return "train-refiner"; }
  std::string synopsis() const override { return "Train a refiner that makes the motion of a generator look like captured motion, against a discriminator"; }
  std::string description() const override {
    return "The refiner changes generated motion so that a discriminator, which sees head, hands and feet alone, cannot tell it from the motion of INPUT; the root is held near where it was. The motion to refine is "
           "sampled from --generator before the training starts, all its combinations of attributes equally; any model that `sample` knows will do, on the body and at the rate of INPUT. Both "
           "losses and how often the discriminator is right are in the log beside the model: half right is as good as it gets. Stop it and run the same line with --resume to continue to the same weights, "
           "bit for bit. `refine` applies the model.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"train-refiner walking.h5 --generator lstm.h5 -o refiner.h5", "minutes on two cores"},
            {"train-refiner walking.h5 --generator motion-cell.h5 --steps 6000 -o refiner.h5", "for another generator, longer"},
            {"train-refiner walking.h5 --generator lstm.h5 --no-contacts -o plain.h5", "blind to contacts"}};
  }
  std::vector<std::string> references() const override {
    return {"Wang, Chai, Xia 2018, Combining Recurrent Neural Networks and Adversarial Training for Human Motion Modelling, Synthesis and Control, sections 4.2 and 4.3"};
  }

  void options(CLI::App& app) override {
    app.add_option("--generator", generator_, "model whose motion is to be refined")->required()->check(cli::path());
    app.add_option("--preset", preset_, "paper (layers of 512, 3,000 updates, rates 0.002 and 0.005, 5 to 1) or small (128, 6,000 updates, rates 0.0003 and 0.001, 1 to 1, contact weight 10, full rate for a half, gradient limit 5)")->check(cli::one_of({"paper", "small"}))->capture_default_str();
    app.add_flag("--no-contacts", no_contacts_, "neither network sees the contact bits");
    app.add_option("--samples", samples_, "motions sampled from the generator")->check(cli::whole(1, 1000000, "MOTIONS"))->capture_default_str();
    app.add_option("--sample-frames", sample_frames_, "frames of each")->check(cli::whole(2, 1000000, "FRAMES"))->capture_default_str();
    app.add_option("--noise-scale", settings_.noise_scale, "factor on the generator's noise, as `sample` has it; refine what was sampled with the same")->check(cli::non_negative("FACTOR"))->capture_default_str();
    app.add_option("--steps", steps_, "updates of either network (preset)")->check(cli::whole(1, 1000000000, "STEPS"));
    app.add_option("--batch", c_.batch, "windows in a batch, an even number")->check(cli::whole(2, 65536, "CLIPS"))->capture_default_str();
    app.add_option("--window", c_.window, "frames of a window")->check(cli::whole(2, 100000, "FRAMES"))->capture_default_str();
    app.add_option("--buffer", c_.buffer, "refined motions remembered for the discriminator")->check(cli::whole(1, 1000000, "MOTIONS"))->capture_default_str();
    app.add_option("--root-weight", c_.root_weight, "of the squared distance between the root's ways before and after, m^2")->check(cli::non_negative("WEIGHT"))->capture_default_str();
    app.add_option("--contact-weight", contact_weight_, "of the squared speed of feet whose contact bit says that they are down, m^2/s^2 (preset; paper 0)")->check(cli::non_negative("WEIGHT"));
    app.add_option("--full-rate", full_rate_, "share of the updates after which both rates fall linearly to 0 (preset; paper 1)")->check(cli::between(0, 1, "SHARE"));
    app.add_option("--learning-rate", refiner_rate_, "of RMSProp, of the refiner (preset)")->check(cli::positive("RATE"));
    app.add_option("--discriminator-rate", discriminator_rate_, "of the discriminator (preset)")->check(cli::positive("RATE"));
    app.add_option("--gradient-limit", gradient_limit_, "largest norm of a gradient; 0: none (preset; paper 0)")->check(cli::non_negative("NORM"));
    app.add_option("--ratio", ratio_, "updates of the refiner for one of the discriminator (preset); doubled where it is too strong, halved where it is too weak")->check(cli::between(1, 80, "UPDATES"));
    add_loop_options(app);
  }

  Exit run(cli::Context& context) override {
    const std::string input = begin(context, {generator_});
    if (generator_ == "-" && input == "-") refuse_usage("--generator - and the archive from standard input, expected one of them to be a file");
    const auto preset = refiner::TrainingConfig::preset(preset_);
    c_.steps = steps_.value_or(preset.steps);
    c_.refiner_rate = refiner_rate_.value_or(preset.refiner_rate);
    c_.discriminator_rate = discriminator_rate_.value_or(preset.discriminator_rate);
    c_.ratio = ratio_.value_or(preset.ratio);
    c_.contact_weight = contact_weight_.value_or(preset.contact_weight);
    c_.full_rate = full_rate_.value_or(preset.full_rate);
    c_.gradient_limit = gradient_limit_.value_or(preset.gradient_limit);
    c_.seed = context.seed();
    c_.shards = shards();
    c_.validate();
    if (sample_frames_ < c_.window) refuse_usage(fmt::format("--sample-frames {} and windows of {}, expected motions as long as a window at least", sample_frames_, c_.window));
    if (samples_ > kMostFrames / sample_frames_) refuse_usage(fmt::format("{} motions of {} frames, expected at most {} frames in all", samples_, sample_frames_, kMostFrames));
    const train::StateDataset real(input);
    if (real.left_out() > 0) log::warn("{} clips of one frame are left out", real.left_out());
    if (real.labelled_here()) log::warn("{}: clips without contacts are labelled by the rule default", input);
    std::string digest;
    const store::ModelFile file = store::read_model(generator_, &digest);
    const auto generator = generators::make_generator(file, generator_);
    train::check_alike(*generator->skeleton(), generator->frame_rate_hz(), real.reference(), {generator_, 0, {}}, "the training data");
    if (const std::size_t few = real.shorter_than(c_.window); few > 0) log::warn("{} clips of less than --window {} frames are left out", few, c_.window);
    settings_.seed = context.seed();
    settings_.threads = context.threads();
    std::vector<generators::ClipOrder> orders;
    for (std::int64_t i = 0; i < samples_; ++i)
      orders.push_back({fmt::format("sample-{}", i), generator->combinations()[static_cast<std::size_t>(i) % generator->combinations().size()], sample_frames_, kOtherMotions + static_cast<std::uint64_t>(i)});
    const train::StateDataset generated(generator_, generator->sample(orders, settings_), real.reference());
    refiner::RefinerConfig network = refiner::RefinerConfig::preset(preset_);
    network.contacts = !no_contacts_;
    std::unique_ptr<refiner::RefinerTraining> made;
    try {
      made = std::make_unique<refiner::RefinerTraining>(network, c_, real, generated, nlohmann::json{{"kind", generator->kind()}, {"sha256", digest}, {"samples", samples_}, {"frames", sample_frames_}, {"noise_scale", settings_.noise_scale}});
    } catch (const Error& e) {
      if (e.status() != Exit::data || !e.where().file.empty()) throw;
      throw e.in_file(real.name());
    }
    refiner::RefinerTraining& training = *made;
    log::info("{} clips, {} frames; {} motions of {}; {} updates", real.clips().size(), real.frames(), samples_, generator_, training.steps());
    History history = real.header().history;
    history.insert(history.end(), file.history.begin(), file.history.end());
    return train(context, training, std::move(history), {{context.inputs()[0].label, real.file_sha256()}, tools::history_input(generator_, digest)});
  }

 private:
  std::string generator_, preset_ = "small";
  bool no_contacts_ = false;
  std::int64_t samples_ = 512, sample_frames_ = 150;
  std::optional<std::int64_t> steps_;
  std::optional<double> refiner_rate_, discriminator_rate_, ratio_, contact_weight_, full_rate_, gradient_limit_;
  generators::SampleSettings settings_;
  refiner::TrainingConfig c_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<TrainRefiner>(argc, argv); }
