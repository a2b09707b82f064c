// denoise - remove noise from the clips of a motion archive with a trained denoiser.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/denoiser/denoiser.hpp"
#include "libmodels/nn/blas.hpp"

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
  std::string synopsis() const override { return "Remove noise from the clips of a motion archive with a trained denoiser"; }
  std::string description() const override {
    return "Rotations and root positions are denoised; names, attributes, segments and sources stay. Contacts are labelled anew where a preset labelled them. Clips may have any length. Heading and ground path follow those of "
           "the input, so that nothing drifts. --report says for each joint of each clip how much was changed, where most, and how much of its peak speed is left: a denoiser "
           "that takes away jumps and blows shows there.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"denoise noisy.h5 -m denoiser.h5 --report changes.tsv -o clean.h5", "and what was changed"},
            {"canonicalize raw/ -o - | denoise - -m denoiser.h5 -o - | motion-export - -o bvh/", "in a pipeline"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, section 3.1"}; }
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
  std::vector<std::string> non_content_options() const override { return {"--report"}; }
  void options(CLI::App& app) override {
    app.add_option("-m,--model", model_, "denoiser")->required()->check(cli::path());
    app.add_option("--report", report_, "table of changes: clip, joint, mean_deg, worst_deg, worst_deg_frame, mean_mm, worst_mm, worst_mm_frame, peak_speed_mps, peak_speed_kept_percent")
        ->check(cli::path("FILE.tsv"));
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    const cli::InputFile& input = context.inputs().at(0);
    if (model_ == "-" && input.path == "-") refuse_usage("-m - and the input -: expected one of them to be a file");
    if (report_ == "-") refuse_usage("--report -: standard output is for the archive, expected a file");
    if (!report_.empty()) {
      for (const std::string& other : {context.common().output, input.path, model_})
        if (std::filesystem::path(report_).lexically_normal() == std::filesystem::path(other).lexically_normal()) refuse_usage("--report " + report_ + " is another file of this command, expected one of its own");
      check_output(report_, context.overwrite());
    }
    std::string model_digest;
    const auto trained = denoiser::Denoiser::load(model_, &model_digest);
    const store::ArchiveReader reader(input.path);
    store::ArchiveHeader header = reader.header();
    header.history.push_back(context.history_entry({{input.label, reader.file_sha256()}, {model_ == "-" ? "<stdin>" : model_.substr(model_.rfind('/') + 1), model_digest}}));
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    std::string table = "clip\tjoint\tmean_deg\tworst_deg\tworst_deg_frame\tmean_mm\tworst_mm\tworst_mm_frame\tpeak_speed_mps\tpeak_speed_kept_percent\n";

    // A preset's contacts were found in the noise; those of another rule come from elsewhere and stay.
    const ContactPreset* preset = header.contacts_rule.starts_with("preset:") ? &contact_preset(header.contacts_rule.substr(7)) : nullptr;
    const std::size_t portion = static_cast<std::size_t>(4 * context.threads());  // clips in memory
    for (std::size_t first = 0; first < reader.size(); first += portion) {
      std::vector<Clip> before, after(std::min(portion, reader.size() - first));
      for (std::size_t i = 0; i < after.size(); ++i) before.push_back(reader.read(first + i));
      parallel_for(after.size(), context.threads(), [&](std::size_t i) {
        nn::initialize_worker_thread();
        try {
          after[i] = trained->apply(before[i]);
          if (preset && !before[i].contacts.empty()) after[i].contacts = label_contacts(after[i], *preset);
        } catch (const Error& e) {
          throw e.in_file(reader.name());
        }
      });
      for (std::size_t i = 0; i < after.size(); ++i) {
        writer.add(after[i]);
        if (!report_.empty()) append(table, before[i], after[i]);
      }
      context.progress(first + after.size(), reader.size(), "clips");
    }
    writer.finish();
    if (!report_.empty()) write_file(report_, table, context.overwrite());
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

  std::string model_, report_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Denoise>(argc, argv); }
