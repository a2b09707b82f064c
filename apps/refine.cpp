// refine - refine generated motion with a trained refiner, pin feet that are down, or both.
#include <fmt/core.h>

#include <algorithm>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/clip/foot_pinning.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/refiner/model.hpp"
#include "libmodels/tools/history_input.hpp"

namespace {

using namespace mocap;

class Refine final : public cli::Tool {
 public:
  std::string name() const override { return "refine"; }
  std::string synopsis() const override { return "Refine generated motion with a trained refiner, and hold feet that are on the ground still"; }
  std::string description() const override {
    return "With -m, each clip goes through the refiner, which takes foot sliding and other marks of generated motion away and labels contacts anew (unless it was trained without them); names, attributes and segments stay. With --pin-feet, feet that are "
           "labelled as down are then held still by inverse kinematics, without a jump when they come down and rise; hips, knees, ankles and the height of the root change and nothing else. Without -m, --pin-feet works "
           "alone and on any motion: archives, BVH, AMC, npz. Clips without contacts are labelled by the model's rule, or by `default`.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"sample -m lstm.h5 -n 100 -o - | refine -m refiner.h5 - -o refined.h5", "straight from the generator"},
            {"sample -m lstm.h5 -n 100 -o - | refine -m refiner.h5 --pin-feet - -o - | fid-eval - --real test.h5 --classifier action.h5", "with feet held, into the evaluation"},
            {"refine --pin-feet slides.bvh -o - | motion-export - -o clean/", "a BVH whose feet slide"},
            {"refine --pin-feet --contacts holden samples.h5 -o pinned.h5", "where feet slide too fast to count as down"}};
  }
  std::vector<std::string> references() const override {
    return {"Wang, Chai, Xia 2018, sections 4.2 and 4.3", "Kovar, Schreiner, Gleicher 2002, Footskate cleanup for motion capture editing"};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::file;
    t.network = true;
    t.input_help = "motion archive or motion file (BVH, AMC, npz); '-' for standard input";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  void options(CLI::App& app) override {
    app.add_option("-m,--model", model_, "refiner (train-refiner)")->check(cli::path());
    CLI::Option* pin = app.add_flag("--pin-feet", pin_, "hold feet that are down still");
    app.add_option("--blend-seconds", pinning_.blend_seconds, "with --pin-feet: over which a correction comes and goes")->needs(pin)->check(cli::between(0, 10, "SECONDS"))->capture_default_str();
    app.add_option("--most-root", pinning_.most_root, "with --pin-feet: by which the root may sink so that legs reach, or rise by half of it so that straight legs stay so, metres")->needs(pin)->check(cli::non_negative("METRES"))->capture_default_str();
    app.add_option("--contacts", contacts_, "keep the contacts of the input, or label them anew by this rule before anything else")->check(cli::one_of(rules()))->capture_default_str();
    reading_.add(app);
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    if (model_.empty() && !pin_) refuse_usage("neither -m nor --pin-feet, expected something to do");
    const cli::InputFile& file = context.inputs().at(0);
    if (model_ == "-" && file.path == "-") refuse_usage("-m - and the input -: expected one of them to be a file");
    std::vector<HistoryInput> inputs;
    refiner::Model model;
    std::string rule = "preset:default";
    if (!model_.empty()) {
      std::string digest;
      model = refiner::read(store::read_model(model_, &digest), model_);
      inputs.push_back(tools::history_input(model_, digest));
      if (model.contacts_rule.starts_with("preset:")) rule = model.contacts_rule;
    }
    if (contacts_ != "keep") rule = "preset:" + contacts_;
    const formats::ReadOptions reading = reading_.options();
    const auto input = formats::open_motion(file.path, file.label, reading);
    cli::ReadingOptions::report(*input, file.label);
    inputs.insert(inputs.begin(), {file.label, input->sha256()});
    for (auto& more : input->companions()) inputs.push_back(std::move(more));
    for (auto& more : cli::ReadingOptions::files(reading)) inputs.push_back(std::move(more));
    const bool archive = input->format() == "archive";

    std::unique_ptr<store::ArchiveWriter> writer;
    PinningReport pinned;
    std::size_t labelled = 0;
    const std::size_t portion = static_cast<std::size_t>(2 * context.threads());  // clips in memory
    for (std::size_t first = 0; first < input->size(); first += portion) {
      std::vector<Clip> clips(std::min(portion, input->size() - first));
      for (std::size_t i = 0; i < clips.size(); ++i) clips[i] = input->read(first + i);
      std::vector<PinningReport> reports(clips.size());
      std::vector<char> here(clips.size());
      parallel_for(clips.size(), context.threads(), [&](std::size_t i) {
        nn::initialize_worker_thread();
        Clip& clip = clips[i];
        try {
          if (!archive) set_on_ground(clip);
          if (clip.contacts.empty() || contacts_ != "keep") {
            here[i] = clip.contacts.empty();
            clip.contacts = label_contacts(clip, contact_preset(rule.substr(7)));
            if (clip.contacts.empty()) refuse({{}, 0, "clip " + clip.name}, "a skeleton without feet, expected the roles left_foot and right_foot");
          }
          if (model.network) clip = refiner::refine(model, clip);
          if (pin_) reports[i] = pin_feet(clip, pinning_);
        } catch (const Error& e) {
          throw e.in_file(file.label);
        }
      });
      for (std::size_t i = 0; i < clips.size(); ++i) {
        if (!writer) writer = std::make_unique<store::ArchiveWriter>(context.common().output, context.overwrite(), header(*input, clips[i], model.network && model.network->config().contacts, rule, context, inputs));
        labelled += here[i];
        add(pinned, reports[i]);
        writer->add(clips[i]);
      }
      context.progress(first + clips.size(), input->size(), "clips");
    }
    if (!writer) refuse({file.label, 0, {}}, "0 clips, expected at least one");
    writer->finish();
    if (labelled > 0) log::warn("{}: {} clips without contacts were labelled by the rule {}", file.label, labelled, rule.substr(7));
    if (pin_)
      log::info("{} times a foot is down, {} frames; moved by at most {:.1f} mm; {} frames beyond reach, by at most {:.1f} mm; the root by at most {:.1f} mm", pinned.runs, pinned.frames, 1000 * pinned.largest_correction,
                pinned.unreached, 1000 * pinned.largest_miss, 1000 * pinned.largest_root);
    return Exit::ok;
  }

 private:
  static std::vector<std::string> rules() {
    std::vector<std::string> names = {"keep"};
    for (const auto& preset : contact_presets()) names.push_back(preset.name);
    return names;
  }

  store::ArchiveHeader header(const formats::MotionInput& input, const Clip& clip, bool by_model, const std::string& rule, cli::Context& context, const std::vector<HistoryInput>& inputs) const {
    store::ArchiveHeader h;
    h.skeleton = clip.skeleton;
    h.frame_rate_hz = clip.frame_rate_hz;
    h.contacts_rule = by_model ? "model" : contacts_ == "keep" && !input.contacts_rule().empty() ? input.contacts_rule() : rule;
    h.history = input.history();
    h.history.push_back(context.history_entry(inputs));
    h.attribute_classes = input.attribute_classes();
    return h;
  }

  static void add(PinningReport& all, const PinningReport& one) {
    all.runs += one.runs;
    all.frames += one.frames;
    all.unreached += one.unreached;
    all.largest_correction = std::max(all.largest_correction, one.largest_correction);
    all.largest_miss = std::max(all.largest_miss, one.largest_miss);
    all.largest_root = std::max(all.largest_root, one.largest_root);
  }

  std::string model_, contacts_ = "keep";
  bool pin_ = false;
  PinningOptions pinning_;
  cli::ReadingOptions reading_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Refine>(argc, argv); }
