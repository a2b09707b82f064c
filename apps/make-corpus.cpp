// make-corpus - a labelled procedural motion corpus: BVH files and labels.tsv.
#include <fmt/core.h>

#include <filesystem>
#include <optional>

#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/corpus/corpus.hpp"
#include "libmocap/io/bvh.hpp"

namespace {

using namespace mocap;
namespace fs = std::filesystem;

class MakeCorpus final : public cli::Tool {
 public:
  std::string name() const override { return "make-corpus"; }
  std::string synopsis() const override { return "Make a labelled corpus of procedural human motion as BVH files"; }
  std::string description() const override {
    return "Walking, jogging, jumping and lifting by female and male subjects who differ in body, speed, cadence, "
           "amplitudes, symmetry, posture and "
           "style, and walk-jog-walk transitions labelled by segments: 120 Hz, Y up, centimetres, 22 joints, and "
           "labels.tsv beside the files. Planted "
           "feet stand still. Gender shows in the dynamics alone: no mean pose, length or speed tells it. Equal seeds "
           "give equal files, whatever "
           "else is made. The tables are written last: a folder without labels.tsv is unfinished.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"make-corpus -o corpus/", "4 actions x 2 genders x 12 subjects, 8 s each, and 24 transitions"},
            {"make-corpus --subjects 100 --clips 2 --transitions 0 -o corpus/ && canonicalize corpus/ --labels "
             "corpus/labels.tsv -o corpus.h5",
             "the size of the paper's data, as a motion archive"},
            {"make-corpus --action walking --action jogging --transitions 2 --turning 5 -o courses/", "bends and turns, for models that are to be steered"},
            {"make-corpus --noise --noise-level 1.5 -o pairs/",
             "pairs/noisy for a denoiser, pairs/clean beside it, pairs/manifest.tsv: what was disturbed"}};
  }
  std::vector<std::string> references() const override {
    return {
        "Troje 2002, Decomposing biological motion (mean pose and Fourier series of walking; gender in its dynamics)",
        "Ghorbani et al. 2020, section 4.1 (actions, genders, subjects)"};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::none;
    t.output = cli::Output::folder;
    t.random = true;
    t.output_help = "folder for the files; made where it does not exist";
    return t;
  }
  void options(CLI::App& app) override {
    app.add_option("--subjects", plan_.subjects, "subjects of each gender")
        ->check(cli::whole(1, 9999))
        ->capture_default_str();
    app.add_option("--seconds", plan_.seconds, "length of a clip")
        ->check(cli::between(1, 600, "SECONDS"))
        ->capture_default_str();
    app.add_option("--clips", plan_.takes, "clips of each action and subject")
        ->check(cli::whole(1, 999))
        ->capture_default_str();
    app.add_option("--transitions", plan_.transitions, "walk-jog-walk clips of each subject; 0 for none")
        ->check(cli::whole(0, 999))
        ->capture_default_str();
    app.add_option("--action", actions_, "only this action instead of all four")
        ->check(cli::one_of({"walking", "jogging", "jumping", "lifting"}));
    app.add_option("--turning", plan_.turning, "factor on how fast walkers and joggers turn: 1 up to about 20 degrees/s, 5 up to 100")
        ->check(cli::between(0, 10, "FACTOR"))
        ->capture_default_str();
    noise_option_ = app.add_flag("--noise", noise_,
                                 "also a twin with sensor noise: clean/ and noisy/ with equal names, and manifest.tsv");
    app.add_option("--noise-level", level_, "1: jitter of 0.6 degrees and 4 mm, a spike every 2 s, a dropout every 4 s")
        ->check(cli::between(0.01, 20, "FACTOR"))
        ->needs(noise_option_)
        ->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    plan_.seed = context.seed();
    if (!actions_.empty()) plan_.actions.clear();
    for (const std::string& action : actions_) plan_.actions.push_back(corpus::parse_action(action));
    const std::vector<corpus::ClipId> ids = corpus::list_clips(plan_);
    const fs::path root = context.common().output;
    const fs::path clean = noise_ ? root / "clean" : root, noisy = root / "noisy";
    prepare(context, ids, root, noise_ ? std::vector<fs::path>{clean, noisy} : std::vector<fs::path>{clean});

    struct Made {
      Clip labels;  // attributes and segments, without frames
      std::string manifest;
      std::exception_ptr failure;
    };
    std::vector<Clip> made;
    std::string manifest = corpus::manifest_header();
    std::exception_ptr failure;
    ordered_pipeline<Made>(
        ids.size(), context.threads(),
        [&](std::size_t i) {
          Made m;
          try {
            Clip clip = corpus::make_clip(plan_, ids[i]);
            write(clip, clean, context.overwrite());
            if (noise_) {
              std::vector<corpus::NoiseEvent> events;
              const Clip twin = corpus::make_noisy(plan_, ids[i], clip, level_, events);
              write(twin, noisy, context.overwrite());
              m.manifest = corpus::manifest_rows(twin, events);
            }
            clip.rotations = {}, clip.root_position = {}, clip.contacts = {};
            m.labels = std::move(clip);
          } catch (...) {
            m.failure = std::current_exception();
          }
          return m;
        },
        [&](std::size_t i, Made&& m) {
          if ((failure = m.failure)) return false;
          made.push_back(std::move(m.labels));
          manifest += m.manifest;
          context.progress(i + 1, ids.size(), "clips");
          return true;
        });
    if (failure) std::rethrow_exception(failure);

    write_file((root / "history.jsonl").string(), to_json_lines({context.history_entry()}), context.overwrite());
    if (noise_) write_file((root / "manifest.tsv").string(), manifest, context.overwrite());
    if (noise_) write_file((noisy / "labels.tsv").string(), corpus::labels_table(made), context.overwrite());
    write_file((clean / "labels.tsv").string(), corpus::labels_table(made), context.overwrite());
    log::info("{} clips of {:g} s{}", made.size(), plan_.seconds, noise_ ? ", each with a noisy twin" : "");
    return Exit::ok;
  }

 private:
  static void write(const Clip& clip, const fs::path& folder, Overwrite mode) {
    io::BvhWriteOptions options;
    options.decimals = 4;  // a micrometre, and less than a hundredth of the jitter of the best capture systems
    write_file((folder / clip.source.path).string(), io::format_bvh(corpus::to_y_up_centimetres(clip), options), mode);
  }

  // Refuses what exists before any work, makes the folders, and takes old tables away: they are written last.
  void prepare(cli::Context& context, const std::vector<corpus::ClipId>& ids, const fs::path& root,
               const std::vector<fs::path>& folders) const {
    std::vector<fs::path> tables = {root / "history.jsonl"}, files;
    if (noise_) tables.push_back(root / "manifest.tsv");
    for (const fs::path& folder : folders) {
      tables.push_back(folder / "labels.tsv");
      for (const corpus::ClipId& id : ids) files.push_back(folder / (id.stem() + ".bvh"));
    }
    files.insert(files.end(), tables.begin(), tables.end());
    std::error_code error;
    for (const fs::path& file : files)
      if (fs::exists(file.parent_path(), error)) check_output(file.string(), context.overwrite());
    for (const fs::path& folder : folders) {
      fs::create_directories(folder, error);
      if (error) throw Error(Exit::io, {folder.string(), 0, {}}, "the folder cannot be made: " + error.message());
    }
    for (const fs::path& table : tables) fs::remove(table, error);
  }

  corpus::CorpusPlan plan_;
  std::vector<std::string> actions_;
  bool noise_ = false;
  double level_ = 1;
  CLI::Option* noise_option_ = nullptr;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<MakeCorpus>(argc, argv); }
