// denoise - remove noise from the clips of a motion archive with a trained denoiser, or as a MAP problem under a trained generator.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/control/map_denoiser.hpp"
#include "libmodels/denoiser/denoiser.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/tools/control_options.hpp"
#include "libmodels/tools/history_input.hpp"

namespace {

using namespace mocap;

// A text as one cell of a table.
std::string cell(std::string text) {
  std::replace_if(text.begin(), text.end(), [](char c) { return c == '\t' || c == '\n' || c == '\r'; }, ' ');
  return text;
}

class Denoise final : public cli::Tool {
 public:
  std::string name() const override { return "denoise"; }
  std::string synopsis() const override { return "Remove noise from the clips of a motion archive with a trained denoiser or a trained generator"; }
  std::string description() const override {
    return "--method dae sends each clip through a denoising autoencoder (train-denoiser). --method map looks, window by window, for the motion that is most probable under a generator (train-lstm) and under what was "
           "measured, each value with a deviation of --sigma-root or --sigma-angle; values far from what is found, and values that a sensor held, are left out and what the generator says takes their place (--outliers lists "
           "them). Either way rotations and root positions are denoised; names, attributes, segments and sources stay, and heading and ground path follow those of "
           "the input, so that nothing drifts. Contacts: with dae they are labelled anew where a preset labelled them; with map all are those that the generator reads, or the refiner, and the archive says `model`. "
           "Clips may have any length, with map 2 frames or more. --report says for each joint of each clip how much was changed, where most, and how much of its peak speed is left: a denoiser "
           "that takes away jumps and blows shows there.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"denoise noisy.h5 -m denoiser.h5 --report changes.tsv -o clean.h5", "and what was changed"},
            {"canonicalize raw/ -o - | denoise - -m denoiser.h5 -o - | motion-export - -o bvh/", "in a pipeline"},
            {"denoise noisy.h5 --method map -m lstm.h5 --outliers outliers.tsv -o clean.h5", "spikes and dropouts replaced by what the generator expects"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, section 3.1", "Wang, Chai, Xia 2018, section 5.4"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::file;
    t.network = true;
    t.input_help = "motion archive; '-' for standard input";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  std::vector<std::string> non_content_options() const override { return {"--report", "--outliers"}; }
  void options(CLI::App& app) override {
    app.add_option("--method", method_, "denoising autoencoder, or most probable motion under a generator")->check(cli::one_of({"dae", "map"}))->capture_default_str();
    control_.add_models(app, true, "denoiser (train-denoiser); with map a generator (train-lstm)", "with map: refiner (train-refiner) through which the motion is seen while it is looked for");
    app.add_option("--report", report_, "table of changes: clip, joint, mean_deg, worst_deg, worst_deg_frame, mean_mm, worst_mm, worst_mm_frame, peak_speed_mps, peak_speed_kept_percent")
        ->check(cli::path("FILE.tsv"));
    of_map_ = {app.get_option("--refiner")};
    const std::size_t shared = app.get_options().size();
    app.add_option("--sigma-root", settings_.sigma_root, "deviation of the root positions measured")->check(cli::positive("METRES"))->capture_default_str();
    app.add_option("--sigma-angle", settings_.sigma_angle, "deviation of the joint angles measured")->check(cli::positive("RADIANS"))->capture_default_str();
    app.add_option("--outlier-sigmas", settings_.outlier_sigmas, "a position or rotation further than this many of these deviations from what is found is left out; so is one further than this many of the clip's own, where that is noisier")
        ->check(cli::positive("FACTOR"))
        ->capture_default_str();
    app.add_option("--outliers", outliers_, "table of what was left out: clip, joint, first_frame, last_frame, kind (spike, dropout), largest, unit (deg, mm)")->check(cli::path("FILE.tsv"));
    control_.plan().lbfgs = control::map_lbfgs();
    control_.set_sigmas(control::kMapNoiseSigma, control::kMapContactSigma, control::kMapHeightSigma);
    control_.add_search(app, false);
    app.get_option("--rereads")->description("runs, between which contacts are read from the network and values judged anew");
    const auto options = app.get_options();
    for (std::size_t i = shared; i < options.size(); ++i) {
      of_map_.push_back(options[i]);
      options[i]->description("with map: " + options[i]->get_description());
    }
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    const cli::InputFile& input = context.inputs().at(0);
    const bool map = method_ == "map";
    if (!map)
      for (const CLI::Option* option : of_map_)
        if (option->count() > 0) refuse_usage(option->get_name() + ": an option of --method map, and the method is dae");
    const std::string &model = control_.generator(), &refiner = control_.refiner();
    if (input.path == "-" && (model == "-" || refiner == "-")) refuse_usage((model == "-" ? "-m" : "--refiner") + std::string(" - and the input -: expected one of them to be a file"));
    for (const auto& [option, table] : {std::pair<std::string, std::string>{"--report", report_}, {"--outliers", outliers_}}) {
      if (table.empty()) continue;
      if (table == "-") refuse_usage(option + " -: standard output is for the archive, expected a file");
      for (const std::string& other : {context.common().output, input.path, model, refiner, option == "--outliers" ? report_ : std::string()})
        if (!other.empty() && std::filesystem::path(table).lexically_normal() == std::filesystem::path(other).lexically_normal()) refuse_usage(option + " " + table + " is another file of this command, expected one of its own");
      check_output(table, context.overwrite());
    }
    control_.plan().validate();
    std::vector<HistoryInput> inputs;
    std::unique_ptr<denoiser::Denoiser> trained;
    tools::ControlOptions::Models models;
    try {
      if (map) {
        models = control_.load();
        inputs = models.inputs;
      } else {
        std::string digest;
        trained = denoiser::Denoiser::load(model, &digest);
        inputs.push_back(tools::history_input(model, digest));
      }
    } catch (const Error& e) {
      if (e.message().find("a model of kind") == std::string::npos) throw;
      throw Error(e.status(), e.where(), e.message(), "-m of --method dae comes from train-denoiser, of --method map from train-lstm, --refiner from train-refiner");
    }
    const store::ArchiveReader reader(input.path);
    store::ArchiveHeader header = reader.header();
    inputs.insert(inputs.begin(), {input.label, reader.file_sha256()});
    header.history.push_back(context.history_entry(std::move(inputs)));
    if (map) header.contacts_rule = "model";
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    std::string table = "clip\tjoint\tmean_deg\tworst_deg\tworst_deg_frame\tmean_mm\tworst_mm\tworst_mm_frame\tpeak_speed_mps\tpeak_speed_kept_percent\n";

    std::string left_out = "clip\tjoint\tfirst_frame\tlast_frame\tkind\tlargest\tunit\n";
    std::size_t windows = 0, lowered = 0, spikes = 0, dropouts = 0, single = 0;

    // A preset's contacts were found in the noise; those of another rule come from elsewhere and stay.
    const ContactPreset* preset = !map && header.contacts_rule.starts_with("preset:") ? &contact_preset(header.contacts_rule.substr(7)) : nullptr;
    const std::size_t portion = static_cast<std::size_t>(4 * context.threads());  // clips in memory
    for (std::size_t first = 0; first < reader.size(); first += portion) {
      std::vector<Clip> before, after(std::min(portion, reader.size() - first));
      std::vector<control::MapDenoised> found(after.size());
      for (std::size_t i = 0; i < after.size(); ++i) before.push_back(reader.read(first + i));
      parallel_for(after.size(), context.threads(), [&](std::size_t i) {
        nn::initialize_worker_thread();
        try {
          if (map && before[i].frames() < 2) {  // nothing that a frame before or after could say anything of
            after[i] = before[i];
            if (after[i].contacts.empty()) after[i].contacts.resize(after[i].frames());
            return;
          }
          if (map) {
            const control::MotionModel motion(models.generator, models.refines());
            found[i] = control::denoise_map(motion, control_.terms(motion), settings_, control_.plan(), before[i]);
            after[i] = std::move(found[i].clip);
            return;
          }
          after[i] = trained->apply(before[i]);
          if (preset && !before[i].contacts.empty()) after[i].contacts = label_contacts(after[i], *preset);
        } catch (const Error& e) {
          throw e.where().object.starts_with("clip ") ? e.in_file(reader.name()) : e.in_file(refiner.empty() ? model : refiner);
        }
      });
      for (std::size_t i = 0; i < after.size(); ++i) {
        writer.add(after[i]);
        if (!report_.empty()) append(table, before[i], after[i]);
        single += map && before[i].frames() < 2;
        windows += found[i].windows;
        lowered += found[i].lowered;
        for (const control::Outlier& o : found[i].outliers) {
          ++(o.dropout ? dropouts : spikes);
          const bool position = o.joint < 0;
          left_out += fmt::format("{}\t{}\t{}\t{}\t{}\t{:.4g}\t{}\n", cell(before[i].name), position ? "position" : cell(before[i].skeleton->joint_names[static_cast<std::size_t>(o.joint)]), o.first, o.last,
                                  o.dropout ? "dropout" : "spike", position ? 1000 * o.largest : o.largest * 180 / std::numbers::pi, position ? "mm" : "deg");
        }
      }
      context.progress(first + after.size(), reader.size(), "clips");
    }
    writer.finish();
    if (!report_.empty()) write_file(report_, table, context.overwrite());
    if (!outliers_.empty()) write_file(outliers_, left_out, context.overwrite());
    if (single > 0) log::warn("{} of {} clips have one frame and are passed on as they are", single, reader.size());
    if (map) log::info("{} windows; L-BFGS lowered the objective in {:.1f} % of them; {} spikes and {} dropouts left out", windows, windows ? 100.0 * static_cast<double>(lowered) / static_cast<double>(windows) : 0.0, spikes, dropouts);
    return Exit::ok;
  }

 private:
  static void append(std::string& table, const Clip& before, const Clip& after) {
    const auto changed = denoiser::changes(before, after);
    for (std::size_t j = 0; j < changed.size(); ++j) {
      const auto& c = changed[j];
      table += fmt::format("{}\t{}\t{:.4f}\t{:.4f}\t{}\t{:.3f}\t{:.3f}\t{}\t{:.4f}\t{:.2f}\n", cell(before.name), cell(before.skeleton->joint_names[j]), c.mean_deg, c.worst_deg,
                           c.worst_deg_frame, c.mean_mm, c.worst_mm, c.worst_mm_frame, c.peak_speed_mps, 100 * c.peak_speed_kept);
    }
  }

  std::string method_ = "dae", report_, outliers_;
  tools::ControlOptions control_;
  control::MapSettings settings_;
  std::vector<CLI::Option*> of_map_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Denoise>(argc, argv); }
