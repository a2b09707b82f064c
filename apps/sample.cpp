// sample - generate motion with a trained model.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/attribute_schedule.hpp"
#include "libmocap/metrics/position_error.hpp"
#include "libmocap/metrics/stillness.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/generators/generator.hpp"
#include "libmodels/generators/plans.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/tools/history_input.hpp"

namespace {

using namespace mocap;

class Sample final : public cli::Tool {
 public:
  std::string name() const override { return "sample"; }
  std::string synopsis() const override { return "Generate motions with any trained generator, into a motion archive"; }
  std::string description() const override {
    return "The model file says which kind of generator it holds, on which body and at which rate. Each clip has a random stream of its own: clip 7 of a seed is the same "
           "motion whether 8 or 8,000 are asked for, and whatever the number of threads. Contacts are labelled by the rule of the archive the model was trained on, or by the model where it knows about them. A --schedule is a tab-separated table with a "
           "header line: `start` in seconds, a column for each attribute that it sets, optional `end`, and `clip` for several schedules in one file; the clips carry it as segments. "
           "A model of joint positions (cae-vae) is brought onto the body, whose bones keep their length, and what that changes is told; motions longer than its window are made of windows that overlap.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"sample -m model.h5 -n 64 -o samples.h5", "64 motions, all combinations of attributes equally"},
            {"sample -m model.h5 -n 10 --attr action=walking --attr gender=female --frames 600 -o walks.h5", "ten long walks"},
            {"sample -m model.h5 -n 8 --schedule walk-jog-walk.tsv -o changes.h5", "attributes that change at the table's times"},
            {"sample -m model.h5 -n 40 --attr action=lifting --frames 300 --stop-when-still -o lifts.h5", "each ends when it has come to rest"},
            {"sample -m lstm.h5 --init walk.h5 --frames 9000 -o long.h5", "five minutes from the first frame of a clip (train-lstm)"},
            {"sample -m vae.h5 -n 36 --latent-axis 2 -o axis.h5", "four motions, each at nine places of axis 2 (train-vae)"},
            {"sample -m vae.h5 --interpolate walks.h5:walk_01 jumps.h5 -o between.h5", "nine motions from one window to another"},
            {"sample -m vae.h5 --reconstruct test.h5 -o again.h5", "what is left of motion that went through the latent space"},
            {"sample -m model.h5 -n 8 -o - | render - -o strips.png", "straight to a picture"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, sections 3.3.2 and 5.1, Algorithm 2", "Wang, Chai, Xia 2018, sections 4.1.4, 5.1 and 5.4", "Motegi, Hijioka, Murakami 2018, section V"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::none;
    t.output = cli::Output::file;
    t.random = true;
    t.network = true;
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }

  void options(CLI::App& app) override {
    app.add_option("-m,--model", model_, "trained model; '-' reads standard input")->required()->check(cli::path());
    app.add_option("-n,--count", count_, "motions in all; they take the schedules, then the combinations of attributes, in turn (default: 1, or one of each schedule)")->check(cli::whole(1, 100000000, "COUNT"));
    CLI::Option* frames = app.add_option("--frames", frames_, "frames of each motion (default: the model's)")->check(cli::whole(1, 1000000, "FRAMES"));
    CLI::Option* attributes = app.add_option("--attr", attributes_, "NAME=VALUE to generate (repeatable; several values of a name are all used; default: all combinations trained on, equally)");
    CLI::Option* schedule = app.add_option("--schedule", schedule_, "table of attributes over time; what it leaves open is as without it. Changes are moved to the model's nearest word")->check(cli::path("FILE.tsv"));
    CLI::Option* stop = app.add_flag("--stop-when-still", stop_, "end each motion where it comes to rest after having moved");
    app.add_option("--still-speed", stillness_.speed, "with --stop-when-still: impact-weighted joint speed under which a step is still, rad m/s")->needs(stop)->check(cli::positive("SPEED"))->capture_default_str();
    app.add_option("--still-seconds", stillness_.seconds, "with --stop-when-still: how long all steps have to be still; a quarter of a second of it is kept")->needs(stop)->check(cli::positive("SECONDS"))->capture_default_str();
    app.add_option("--init", init_, "clips whose first frames to start from, in turn: ARCHIVE, or one of them as ARCHIVE:CLIP (lstm-gmm; default: frames of its training data)")->check(cli::path("ARCHIVE"));
    app.add_option("--init-state", init_state_, "the network's hidden state before the first frame: found from the first two frames by gradient descent, or zero, which makes the second frame jump (lstm-gmm)")
        ->check(cli::one_of({"estimate", "zero"}))->capture_default_str();
    app.add_option("--network-noise", network_noise_, "deviation of noise on the network's standardised input (lstm-gmm)")->check(cli::non_negative("DEVIATION"))->capture_default_str();
    app.add_option("--prior", prior_, "what latents are drawn from: a mixture fitted to where the training windows lie, or the standard normal distribution, as in the paper (cae-vae)")->check(cli::one_of({"mixture", "normal"}))->capture_default_str();
    CLI::Option* axis = app.add_option("--latent-axis", axis_, "axis of the latent space, from 1: instead of motions of their own, each latent drawn gives a row of motions with that element at the --quantiles of its distribution (cae-vae)")
                            ->check(cli::whole(1, 4096, "K"));
    app.add_option("--quantiles", quantiles_, "FIRST:LAST:STEP, or one: probabilities above 0 and below 1")->needs(axis)->capture_default_str();
    CLI::Option* between = app.add_option("--interpolate", between_, "two clips as ARCHIVE or ARCHIVE:CLIP: -n motions (9) from the first window of one to that of the other, by their places in the latent space (cae-vae)")->expected(2);
    CLI::Option* again = app.add_option("--reconstruct", reconstruct_, "archive whose clips go through the latent space and back, instead of new motions (cae-vae)")->check(cli::path("ARCHIVE"));
    app.add_option("--through", through_, "how far --reconstruct goes: joint positions and rotations found for them, the convolutional autoencoder, or both stages")->needs(again)->check(cli::one_of({"positions", "autoencoder", "both"}))->capture_default_str();
    axis->excludes(between)->excludes(again);
    between->excludes(again);
    CLI::Option* noise = app.add_option("--noise-scale", noise_scale_, "factor on the latent noise, or on the spread of a mixture: 1 samples the model, 0 follows its mean")->check(cli::non_negative("FACTOR"))->capture_default_str();
    for (CLI::Option* of_new_motion : {frames, attributes, schedule, stop, noise}) again->excludes(of_new_motion);
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    std::string digest;
    const store::ModelFile model = store::read_model(model_, &digest);
    const auto generator = generators::make_generator(model, model_);
    std::vector<std::string> streams;
    for (const auto& [option, path] : {std::pair{"-m", &model_}, {"--init", &init_}, {"--schedule", &schedule_}, {"--reconstruct", &reconstruct_}})
      if (*path == "-") streams.emplace_back(option);
    for (const std::string& end : between_)
      if (end == "-") streams.emplace_back("--interpolate");
    if (streams.size() > 1) refuse_usage(streams[0] + " - and " + streams[1] + " -: expected one of them to be a file");
    std::vector<HistoryInput> inputs = {tools::history_input(model_, digest)};
    generators::SampleSettings settings;
    settings.seed = context.seed();
    settings.threads = context.threads();
    settings.noise_scale = noise_scale_;
    if (!generator->starts_from_frames() && (!init_.empty() || init_state_ != "estimate" || network_noise_ > 0))
      refuse_usage("--init, --init-state and --network-noise, expected a generator that starts from frames (lstm-gmm); " + model_ + " holds a model of kind " + generator->kind());
    read_starts(settings, inputs);
    settings.estimate_state = init_state_ == "estimate";
    settings.network_noise = network_noise_;
    if (generator->latent_dimensions() == 0 && (axis_ || !between_.empty() || !reconstruct_.empty() || prior_ != "mixture"))
      refuse_usage("--latent-axis, --interpolate, --reconstruct and --prior, expected a generator with a latent space (cae-vae); " + model_ + " holds a model of kind " + generator->kind());
    if (axis_ && *axis_ > generator->latent_dimensions()) refuse_usage(fmt::format("--latent-axis {}, expected one of the model's {} axes, from 1", *axis_, generator->latent_dimensions()));
    settings.standard_normal = prior_ == "normal";
    settings.through = through_ == "positions" ? generators::Through::positions : through_ == "autoencoder" ? generators::Through::autoencoder : generators::Through::both;
    generators::FitReport fit;
    settings.fit = &fit;
    if (!reconstruct_.empty()) {
      reconstruct(context, *generator, settings, model.history, std::move(inputs));
      tell(fit);
      return Exit::ok;
    }
    const std::vector<double> quantiles = axis_ ? generators::parse_quantiles(quantiles_) : std::vector<double>();
    for (const std::string& end : between_) settings.between.push_back(read_end(end, inputs));
    std::vector<generators::Plan> plans;
    std::int64_t usual = axis_ ? static_cast<std::int64_t>(quantiles.size()) : between_.empty() ? 1 : kSteps;
    if (schedule_.empty()) {
      plans = generators::attribute_plans(*generator, attributes_, frames_.value_or(generator->default_frames()));
    } else {
      const auto schedules = formats::AttributeSchedules::read(schedule_);
      inputs.push_back(tools::history_input(schedule_, schedules.sha256()));
      usual = static_cast<std::int64_t>(schedules.all().size());
      plans = generators::scheduled_plans(*generator, attributes_, frames_, schedules, schedule_ == "-" ? "<stdin>" : schedule_);
    }
    const std::int64_t count = count_.value_or(usual);
    if (!between_.empty() && count < 2) refuse_usage("--interpolate with -n 1, expected at least 2 motions: one for either end");
    std::int64_t longest = 1;
    for (const auto& plan : plans) longest = std::max(longest, plan.frames);

    store::ArchiveWriter writer(context.common().output, context.overwrite(), header_of(*generator, model.history, context.history_entry(std::move(inputs))));
    const int digits = static_cast<int>(std::to_string(count - 1).size());
    std::int64_t stopped = 0;
    // Bounded memory: about a million frames at a time, or one motion where it alone has more.
    const std::int64_t portion = std::max<std::int64_t>(1, 1000000 / longest);
    for (std::int64_t first = 0; first < count; first += portion) {
      std::vector<generators::ClipOrder> orders;
      for (std::int64_t i = first; i < std::min(first + portion, count); ++i) {
        const auto& plan = plans[static_cast<std::size_t>(i) % plans.size()];
        generators::ClipOrder order;
        order.attributes = plan.attributes;
        if (plan.name.empty())
          for (const auto& [key, value] : order.attributes) order.name += value + "-";
        else
          order.name = plan.name + "-";
        if (order.name.empty()) order.name = "motion-";  // of a model without attributes
        order.frames = plan.frames;
        order.stream = static_cast<std::uint64_t>(i);
        order.schedule = plan.changes;
        if (axis_) {  // a row of quantiles for each latent drawn
          const auto row = i / static_cast<std::int64_t>(quantiles.size());
          const double quantile = quantiles[static_cast<std::size_t>(i) % quantiles.size()];
          order.stream = static_cast<std::uint64_t>(row);
          order.axis = {*axis_, quantile};
          order.name += fmt::format("{:0{}}-axis-{}-at-{:.6g}", row, digits, *axis_, quantile);
        } else {
          order.name += fmt::format("{:0{}}", i, digits);
          if (!between_.empty()) order.between = static_cast<double>(i) / static_cast<double>(count - 1);
        }
        orders.push_back(std::move(order));
      }
      std::vector<Clip> made;
      try {
        made = generator->sample(orders, settings);
      } catch (const Error& e) {
        if (settings.init.empty() || e.status() != Exit::data) throw;
        throw e.in_file(init_ == "-" ? "<stdin>" : split_clip(init_).first);
      }
      for (const Clip& clip : made) {
        const std::size_t kept = stop_ ? metrics::frames_until_still(clip, stillness_) : clip.frames();
        if (kept == clip.frames()) {
          writer.add(clip);
          continue;
        }
        Clip ended = cut(clip, 0, kept);
        ended.source = clip.source;  // there is no file that it is a part of
        writer.add(ended);
        ++stopped;
      }
      context.progress(static_cast<std::size_t>(std::min(first + portion, count)), static_cast<std::size_t>(count), "motions");
    }
    writer.finish();
    tell(fit);
    if (stop_) log::info("{} of {} motions came to rest and end there", stopped, count);
    return Exit::ok;
  }

 private:
  static constexpr std::int64_t kSteps = 9;  // from one window to another

  static store::ArchiveHeader header_of(const generators::Generator& generator, History history, HistoryEntry command) {
    store::ArchiveHeader header;
    header.skeleton = generator.skeleton();
    header.frame_rate_hz = generator.frame_rate_hz();
    header.contacts_rule = generator.contacts_rule().starts_with("preset:") || generator.contacts_rule() == "model" ? generator.contacts_rule() : "";
    header.history = std::move(history);
    header.history.push_back(std::move(command));
    return header;
  }

  static void tell(const generators::FitReport& fit) {
    if (fit.points > 0) log::info("joints of the body are within {:.1f} mm of what the model made, at most {:.1f} mm ({}, {})", fit.mean_mm(), fit.worst_mm, fit.worst_clip, fit.worst_joint);
  }

  // ARCHIVE[:CLIP] as path and name, "" for all clips; a file of the whole name goes first.
  static std::pair<std::string, std::string> split_clip(const std::string& text) {
    std::error_code ignored;
    const auto colon = text.rfind(':');
    if (colon == std::string::npos || std::filesystem::exists(text, ignored)) return {text, ""};
    return {text.substr(0, colon), text.substr(colon + 1)};
  }

  static std::size_t find_clip(const store::ArchiveReader& reader, const std::string& path, const std::string& name) {
    for (std::size_t i = 0; i < reader.size(); ++i)
      if (name.empty() || reader.info(i).name == name) return i;
    if (reader.size() == 0) refuse({path, 0, {}}, "0 clips, expected at least one");
    refuse({path, 0, "clip " + name}, "no clip of this name, expected one such as " + reader.info(0).name);
  }

  // The clips to start from, as many as are needed.
  void read_starts(generators::SampleSettings& settings, std::vector<HistoryInput>& inputs) const {
    if (init_.empty()) return;
    const auto [path, name] = split_clip(init_);
    const store::ArchiveReader reader(path, store::Caching::in_order);
    inputs.push_back(tools::history_input(path, reader.file_sha256()));
    const std::size_t first = find_clip(reader, path, name), wanted = name.empty() ? static_cast<std::size_t>(count_.value_or(1)) : 1;
    for (std::size_t i = first; i < reader.size() && settings.init.size() < wanted; ++i) {
      Clip clip = reader.read(i);
      settings.init.push_back(clip.frames() > 2 && !clip.contacts.empty() ? cut(clip, 0, 2) : std::move(clip));  // contacts are found in all of a clip
    }
  }

  static Clip read_end(const std::string& text, std::vector<HistoryInput>& inputs) {
    const auto [path, name] = split_clip(text);
    const store::ArchiveReader reader(path);
    inputs.push_back(tools::history_input(path, reader.file_sha256()));
    return reader.read(find_clip(reader, path, name));
  }

  // Every clip of an archive through the model's latent space and back.
  void reconstruct(cli::Context& context, const generators::Generator& generator, const generators::SampleSettings& settings, const History& history, std::vector<HistoryInput> inputs) const {
    const store::ArchiveReader reader(reconstruct_, store::Caching::in_order);
    inputs.push_back(tools::history_input(reconstruct_, reader.file_sha256()));
    store::ArchiveHeader header = header_of(generator, history, context.history_entry(std::move(inputs)));
    header.attributes = reader.header().attributes;
    header.segment_attributes = reader.header().segment_attributes;
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    std::size_t short_ones = 0, done = 0;
    const auto count = static_cast<std::size_t>(count_.value_or(static_cast<std::int64_t>(reader.size())));
    std::vector<Clip> portion;
    std::int64_t frames = 0;
    double all_frames = 0, world = 0, pose = 0;
    const auto flush = [&] {
      try {
        const auto made = generator.reconstruct(portion, settings);
        for (std::size_t i = 0; i < made.size(); ++i) {
          writer.add(made[i]);
          const auto error = metrics::position_error(made[i], portion[i]);
          const auto n = static_cast<double>(made[i].frames());
          all_frames += n, world += n * error.world_mm, pose += n * error.pose_mm;
        }
      } catch (const Error& e) {
        throw e.status() == Exit::data ? e.in_file(reader.name()) : e;
      }
      portion.clear();
      frames = 0;
    };
    for (std::size_t i = 0; i < reader.size() && done < count; ++i) {
      context.progress(i, reader.size(), "clips");
      if (reader.info(i).length < generator.default_frames()) {
        ++short_ones;
        continue;
      }
      portion.push_back(reader.read(i));
      ++done;
      frames += reader.info(i).length;
      if (frames > 100000) flush();
    }
    flush();
    if (done == 0) refuse({reader.name(), 0, {}}, fmt::format("{} clips, none as long as the model's window of {} frames", reader.size(), generator.default_frames()));
    writer.finish();
    log::info("{} clips, {} frames: joints are within {:.1f} mm of the originals' in the world, {:.1f} mm seen from the root", done, all_frames, world / all_frames, pose / all_frames);
    if (short_ones > 0) log::warn("{}: {} clips shorter than the model's window of {} frames are left out", reader.name(), short_ones, generator.default_frames());
  }

  std::string model_, schedule_, init_, init_state_ = "estimate";
  double network_noise_ = 0;
  std::optional<std::int64_t> count_, frames_;
  std::optional<int> axis_;
  std::string quantiles_ = "0.1:0.9:0.1", reconstruct_, prior_ = "mixture", through_ = "both";
  std::vector<std::string> between_;
  bool stop_ = false;
  metrics::Stillness stillness_;
  std::vector<std::string> attributes_;
  double noise_scale_ = 1;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Sample>(argc, argv); }
