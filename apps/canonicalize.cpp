// canonicalize - bring clips onto the canonical body, rate and frame.
#include "libmocap/clip/canonicalize.hpp"

#include <fmt/core.h>

#include <set>

#include "libmocap/base/log.hpp"
#include "libmocap/clip/rate_check.hpp"
#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/labels.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/formats/path_attributes.hpp"
#include "libmocap/io/body_model.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/store/archive.hpp"

namespace {

using namespace mocap;

// What one input gives: finished clips, or an archive whose clips are taken one by one when its turn comes.
struct Prepared {
  std::vector<Clip> clips;
  std::unique_ptr<formats::MotionInput> input;
  std::vector<std::string> doubts;  // about the rate
  bool unmatched = false;           // by --attr-from-path
};

class Canonicalize final : public cli::Tool {
 public:
  std::string name() const override { return "canonicalize"; }
  std::string synopsis() const override { return "Bring motion files onto one body, one rate and one frame, into a motion archive"; }
  std::string description() const override {
    return "Reads BVH, npz and motion archives, whatever their skeleton, unit, up axis and rate, and writes one motion archive: the canonical "
           "22-joint body in metres, Z up, soles at z = 0, each clip's first frame above the origin facing +X, resampled in time (SLERP), foot "
           "contacts labelled, attributes attached. Files that cannot be used are reported, listed in --rejects and skipped.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"canonicalize cmu/bvh --labels cmu/labels.tsv -o cmu.h5", "a folder of BVH files with their labels"},
            {"canonicalize walk.bvh -o - | motion-info -", "one file through a pipe"},
            {"canonicalize mocap/ --fps 30 --phases all --rejects rejects.tsv -o all.h5", "all four offsets of 120 Hz files; refused files in a table"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, section 3.1 (30 frames per second, all four offsets)"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::file;
    t.batch = true;
    t.input_help = "motion files (BVH, npz, archives), folders, @list.txt";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  void options(CLI::App& app) override {
    reading_.add(app);
    app.add_option("--labels", labels_, "tab-separated table: file, then attributes; with start and end rows become segments")->check(cli::path("FILE.tsv"));
    app.add_option("--attr-from-path", attr_from_path_, "regular expression (PCRE) whose named groups, (?<subject>...), become attributes; held against the path below the folder given")
        ->check(cli::path("REGEX"));
    app.add_option("--body-model", body_model_, "your own SMPL, SMPL+H or SMPL-X model: AMASS clips get exact rest joints by their betas")->check(cli::path("FILE.npz"));
    app.add_option("--fps", options_.rate_hz, "frame rate of the output")->check(cli::between(0.1, 10000, "HZ"))->capture_default_str();
    app.add_option("--phases", phases_, "of a higher source rate: the first decimation offset, or all, each a clip")->check(cli::one_of({"first", "all"}))->capture_default_str();
    app.add_option("--anti-alias", anti_alias_, "low-pass before going down in rate; none keeps the frames that fall on the new times")->check(cli::one_of({"none", "sinc"}))->capture_default_str();
    app.add_option("--contacts", options_.contacts, "rule that labels foot contacts")->check(cli::one_of(preset_names()))->capture_default_str();
    app.add_option("--trim", trim_, "cut from the start and the end of each file: seconds (0.5) or percent (10%), one for both or A,B")->check(cli::path("A[,B]"));
    app.add_option("--min-seconds", options_.min_seconds, "refuse shorter clips")->check(cli::non_negative("SECONDS"))->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    options_.all_phases = phases_ == "all";
    options_.anti_alias = anti_alias_ == "sinc" ? AntiAlias::sinc : AntiAlias::none;
    if (!trim_.empty()) options_.trim = Trim::parse(trim_);
    if (!attr_from_path_.empty()) from_path_.emplace(attr_from_path_);
    formats::ReadOptions reading = reading_.options();
    if (!body_model_.empty()) reading.body_model = io::BodyModel::read(body_model_);
    std::vector<HistoryInput> option_files = cli::ReadingOptions::files(reading);
    const Canonicalizer canonicalizer(options_);
    std::optional<formats::Labels> labels;
    if (!labels_.empty()) labels = formats::Labels::read(labels_);
    if (labels) option_files.push_back({base_name(labels_), labels->sha256()});

    if (done_before(context, option_files)) {
      log::info("{} is up to date", context.common().output);
      return Exit::ok;
    }
    store::ArchiveHeader header;
    header.skeleton = canonical_body();
    header.frame_rate_hz = options_.rate_hz;
    header.contacts_rule = "preset:" + options_.contacts;
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    std::set<std::string> names;
    std::vector<HistoryInput> inputs = std::move(option_files);
    std::size_t frames = 0, unlabelled = 0, unmatched = 0, files = 0;
    double seconds = 0;
    bool no_row = false;  // of the file at hand in --labels
    const auto finish_clip = [&](Clip& clip) {
      std::string unique = clip.name;
      for (int n = 2; !names.insert(unique).second; ++n) unique = fmt::format("{}#{}", clip.name, n);
      clip.name = unique;
      unlabelled += no_row;
      frames += clip.frames();
      seconds += clip.seconds();
      writer.add(clip);
    };
    const Exit status = context.for_each<Prepared>(
        [&](const cli::InputFile& file) {
          Prepared p;
          p.input = formats::open_motion(file.path, file.label, reading);
          if (p.input->format() == "archive") return p;
          p.clips = prepare(p, 0, file, labels, canonicalizer);
          return p;
        },
        [&](const cli::InputFile& file, Prepared&& p) {
          for (const auto& note : p.input->notes()) log::debug("{}: {}", file.label, note);
          no_row = labels && labels->of(file.path, file.label).empty();
          for (Clip& clip : p.clips) finish_clip(clip);
          if (p.clips.empty())
            for (std::size_t i = 0; i < p.input->size(); ++i)
              for (Clip& clip : prepare(p, i, file, labels, canonicalizer)) finish_clip(clip);
          for (const auto& doubt : p.doubts) log::warn("{}", doubt);
          unmatched += p.unmatched;
          ++files;
          merge_into(history_, p.input->history());
          inputs.push_back({file.label, p.input->sha256()});
        });
    if (writer.size() == 0) throw Error(status == Exit::ok ? Exit::data : status, {context.common().output, 0, {}}, "not written: no input gave a clip");
    history_.push_back(context.history_entry(std::move(inputs)));
    writer.set_history(history_);
    writer.finish();
    cli::ReadingOptions::report_unused(reading, context);
    if (unmatched > 0) log::warn("--attr-from-path does not match {} of {} files", unmatched, files);
    if (unlabelled > 0) log::warn("{} of {} clips have no row in {}", unlabelled, writer.size(), labels_);
    log::info("{} clips, {} frames, {:.1f} s", writer.size(), frames, seconds);
    return status;
  }

 private:
  // --skip-existing: an archive is one output, so it is done where it was made by this command from these very files.
  bool done_before(cli::Context& context, std::vector<HistoryInput> now) const {
    if (!context.common().skip_existing || context.common().output == "-") return false;
    for (const auto& file : context.inputs()) {
      Digest digest{};
      try {
        if (file.path != "-") (void)read_file(file.path, std::size_t{1} << 36, &digest);
      } catch (const Error&) {  // its turn comes: the archive was not made from it
      }
      now.push_back({file.label, to_hex(digest)});
    }
    return context.up_to_date(context.common().output, context.history_entry(std::move(now)), [](const std::string& path) { return store::ArchiveReader(path).header().history; });
  }

  static std::string base_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

  static std::vector<std::string> preset_names() {
    std::vector<std::string> names;
    for (const auto& p : contact_presets()) names.push_back(p.name);
    return names;
  }

  // What the path says of a clip: by --attr-from-path, otherwise of AMASS files by their folders. False where the expression does not fit.
  bool attach_path(Clip& clip, const std::string& format, const cli::InputFile& file) const {
    // Of an archive's clip the file that it came from says more than the archive.
    if (from_path_) return from_path_->apply(clip.attributes, file.path, format == "archive" && !clip.source.path.empty() ? clip.source.path : file.label);
    if (format == "npz (SMPL+H)" || format == "npz (SMPL-X)") formats::amass_attributes(clip.attributes, file.path, file.label);
    return true;
  }

  std::vector<Clip> prepare(Prepared& p, std::size_t i, const cli::InputFile& file, const std::optional<formats::Labels>& labels, const Canonicalizer& canonicalizer) const {
    try {
      Clip clip = p.input->read(i);
      if (!attach_path(clip, p.input->format(), file)) p.unmatched = true;
      if (labels) labels->apply(clip, file.path, file.label);
      std::vector<Clip> clips = canonicalizer(clip);
      if (const auto doubt = clips.empty() ? std::nullopt : check_rate(clips.front())) {
        const std::string name = (file.path == "-" ? "<stdin>" : file.path) + (p.input->format() == "archive" ? ":clip " + clip.name : "");
        p.doubts.push_back(fmt::format("{}: its motion contradicts {:.6g} Hz: {}; --fps-override sets another", name, clip.source.frame_rate_hz, *doubt));
      }
      return clips;
    } catch (const Error& e) {
      throw e.status() == Exit::data && e.where().file.empty() ? e.in_file(file.path == "-" ? "<stdin>" : file.path) : e;
    }
  }

  cli::ReadingOptions reading_;
  CanonicalizeOptions options_;
  std::string labels_, phases_ = "first", anti_alias_ = "none", trim_, attr_from_path_, body_model_;
  std::optional<formats::PathAttributes> from_path_;
  History history_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Canonicalize>(argc, argv); }
