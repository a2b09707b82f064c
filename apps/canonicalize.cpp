// canonicalize - bring clips onto the canonical body, rate and frame.
#include "libmocap/clip/canonicalize.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "libmocap/base/log.hpp"
#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/labels.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/store/archive.hpp"

namespace {

using namespace mocap;

// What one input gives: finished clips, or an archive whose clips are taken one by one when its turn comes.
struct Prepared {
  std::vector<Clip> clips;
  std::unique_ptr<formats::MotionInput> input;
};

class Canonicalize final : public cli::Tool {
 public:
  std::string name() const override { return "canonicalize"; }
  std::string synopsis() const override { return "Bring motion files onto one body, one rate and one frame, into a motion archive"; }
  std::string description() const override {
    return "Reads BVH, AMC with its ASF, npz and motion archives, whatever their skeleton, unit, up axis and rate, and writes one motion archive: the canonical "
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
    t.input_help = "motion files (BVH, AMC, npz, archives), folders, @list.txt";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  void options(CLI::App& app) override {
    reading_.add(app);
    app.add_option("--labels", labels_, "tab-separated table: file, then attributes; with start and end rows become segments")->check(cli::path("FILE.tsv"));
    app.add_option("--fps", options_.rate_hz, "frame rate of the output")->check(cli::between(0.1, 10000, "HZ"))->capture_default_str();
    app.add_option("--phases", phases_, "of a higher source rate: the first decimation offset, or all, each a clip")->check(cli::one_of({"first", "all"}))->capture_default_str();
    app.add_option("--contacts", options_.contacts, "rule that labels foot contacts")->check(cli::one_of(preset_names()))->capture_default_str();
    app.add_option("--min-seconds", options_.min_seconds, "refuse shorter clips")->check(cli::non_negative("SECONDS"))->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    options_.all_phases = phases_ == "all";
    const Canonicalizer canonicalizer(options_);
    std::optional<formats::Labels> labels;
    if (!labels_.empty()) labels = formats::Labels::read(labels_);

    if (done_before(context, labels)) {
      log::info("{} is up to date", context.common().output);
      return Exit::ok;
    }
    store::ArchiveHeader header;
    header.skeleton = canonical_body();
    header.frame_rate_hz = options_.rate_hz;
    header.contacts_rule = "preset:" + options_.contacts;
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    std::set<std::string> names;
    std::vector<HistoryInput> inputs;
    if (labels) inputs.push_back({base_name(labels_), labels->sha256()});
    std::size_t frames = 0, unlabelled = 0;
    double seconds = 0;
    const auto finish_clip = [&](Clip& clip) {
      std::string unique = clip.name;
      for (int n = 2; !names.insert(unique).second; ++n) unique = fmt::format("{}#{}", clip.name, n);
      clip.name = unique;
      unlabelled += labels && clip.attributes.empty();
      frames += clip.frames();
      seconds += clip.seconds();
      writer.add(clip);
    };
    const Exit status = context.for_each<Prepared>(
        [&](const cli::InputFile& file) {
          Prepared p;
          p.input = formats::open_motion(file.path, file.label, reading_.options());
          if (p.input->format() == "archive") return p;
          p.clips = prepare(*p.input, 0, file, labels, canonicalizer);
          return p;
        },
        [&](const cli::InputFile& file, Prepared&& p) {
          for (const auto& note : p.input->notes()) log::debug("{}: {}", file.label, note);
          for (Clip& clip : p.clips) finish_clip(clip);
          if (p.clips.empty())
            for (std::size_t i = 0; i < p.input->size(); ++i)
              for (Clip& clip : prepare(*p.input, i, file, labels, canonicalizer)) finish_clip(clip);
          merge_into(history_, p.input->history());
          inputs.push_back({file.label, p.input->sha256()});
          add_companions(inputs, p.input->companions());
        });
    if (writer.size() == 0) throw Error(status == Exit::ok ? Exit::data : status, {context.common().output, 0, {}}, "not written: no input gave a clip");
    history_.push_back(context.history_entry(std::move(inputs)));
    writer.set_history(history_);
    writer.finish();
    if (unlabelled > 0) log::warn("{} of {} clips have no row in {}", unlabelled, writer.size(), labels_);
    log::info("{} clips, {} frames, {:.1f} s", writer.size(), frames, seconds);
    return status;
  }

 private:
  // --skip-existing: an archive is one output, so it is done where it was made by this command from these very files.
  bool done_before(cli::Context& context, const std::optional<formats::Labels>& labels) const {
    if (!context.common().skip_existing || context.common().output == "-") return false;
    std::vector<HistoryInput> now;
    if (labels) now.push_back({base_name(labels_), labels->sha256()});
    for (const auto& file : context.inputs()) {
      Digest digest{};
      try {
        if (file.path != "-") (void)read_file(file.path, std::size_t{1} << 36, &digest);
      } catch (const Error&) {  // its turn comes: the archive was not made from it
      }
      now.push_back({file.label, to_hex(digest)});
      add_companions(now, formats::companions_of(file.path, file.label, reading_.options()));
    }
    return context.up_to_date(context.common().output, context.history_entry(std::move(now)), [](const std::string& path) { return store::ArchiveReader(path).header().history; });
  }

  // An ASF that several files share is listed once, behind the first of them.
  static void add_companions(std::vector<HistoryInput>& inputs, const std::vector<HistoryInput>& companions) {
    for (const auto& c : companions)
      if (std::none_of(inputs.rbegin(), inputs.rend(), [&](const HistoryInput& i) { return i.path == c.path && i.sha256 == c.sha256; })) inputs.push_back(c);
  }

  static std::string base_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

  static std::vector<std::string> preset_names() {
    std::vector<std::string> names;
    for (const auto& p : contact_presets()) names.push_back(p.name);
    return names;
  }

  static std::vector<Clip> prepare(const formats::MotionInput& input, std::size_t i, const cli::InputFile& file, const std::optional<formats::Labels>& labels,
                                   const Canonicalizer& canonicalizer) {
    try {
      Clip clip = input.read(i);
      if (labels) labels->apply(clip, file.path, file.label);
      return canonicalizer(clip);
    } catch (const Error& e) {
      throw e.status() == Exit::data && e.where().file.empty() ? e.in_file(file.path == "-" ? "<stdin>" : file.path) : e;
    }
  }

  cli::ReadingOptions reading_;
  CanonicalizeOptions options_;
  std::string labels_, phases_ = "first";
  History history_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Canonicalize>(argc, argv); }
