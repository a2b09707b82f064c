// canonicalize - bring clips onto the canonical body, rate and frame.
#include "libmocap/clip/canonicalize.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <set>

#include "libmocap/base/log.hpp"
#include "libmocap/clip/rate_check.hpp"
#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/joint_map_file.hpp"
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
  std::vector<Canonicalizer::Result> results;
  std::unique_ptr<formats::MotionInput> input;
  std::vector<std::string> doubts;  // about the rate
  bool unmatched = false;           // by --attr-from-path
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
    t.by_label = true;
    t.input_help = "motion files (BVH, AMC, npz, archives), folders, @list.txt";
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
    app.add_option("--body", body_, "onto the canonical body, or kept on the common skeleton of the inputs, whose joints and bones the first one gives")
        ->check(cli::one_of({"canonical", "source"}))->capture_default_str();
    app.add_option("--joint-map", joint_map_, "which joint is which, where names do not tell: TOML, [joints], canonical = \"theirs\"")->check(cli::path("FILE.toml"));
    app.add_option("--alignment", alignment_, "where the axes of joints come from: rest pose, motion, or the rest pose where it stands")
        ->check(cli::one_of({"auto", "rest", "motion"}))->capture_default_str();
    app.add_flag("--mirror", options_.mirror, "a mirrored copy after each clip, left and right exchanged");
    app.add_option("--report", report_, "table of how far each bone of each clip points from its source's, and of foot slide added")->check(cli::path("FILE.tsv"));
    app.add_option("--min-seconds", options_.min_seconds, "refuse shorter clips")->check(cli::non_negative("SECONDS"))->capture_default_str();
  }

  std::vector<std::string> non_content_options() const override { return {"--report"}; }

  Exit run(cli::Context& context) override {
    options_.all_phases = phases_ == "all";
    options_.alignment = alignment_ == "rest" ? Alignment::rest : alignment_ == "motion" ? Alignment::motion : Alignment::automatic;
    options_.anti_alias = anti_alias_ == "sinc" ? AntiAlias::sinc : AntiAlias::none;
    if (!trim_.empty()) options_.trim = Trim::parse(trim_);
    if (!attr_from_path_.empty()) from_path_.emplace(attr_from_path_);
    if (body_ == "source" && !report_.empty()) refuse_usage("--report --body source: nothing is retargeted, expected --body canonical");
    if (!report_.empty()) check_output(report_, context.overwrite());
    read_options_ = reading_.options();
    if (!body_model_.empty()) read_options_.body_model = io::BodyModel::read(body_model_);
    std::vector<HistoryInput> option_files = cli::ReadingOptions::files(read_options_);
    if (!joint_map_.empty()) {
      const auto map = formats::read_joint_map(joint_map_);
      read_options_.joints = map.joints;
      option_files.push_back({base_name(joint_map_), map.sha256});
    }
    std::optional<formats::Labels> labels;
    if (!labels_.empty()) labels = formats::Labels::read(labels_);
    if (labels) option_files.push_back({base_name(labels_), labels->sha256()});

    if (done_before(context, option_files, labels)) {
      log::info("{} is up to date", context.common().output);
      return context.batch_status();
    }
    if (body_ == "source") options_.body = common_body(context);
    const Canonicalizer canonicalizer(options_);
    store::ArchiveHeader header;
    header.skeleton = options_.body ? options_.body : canonical_body();
    header.frame_rate_hz = options_.rate_hz;
    header.contacts_rule = "preset:" + options_.contacts;
    header.attribute_classes = common_classes(context);
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    std::set<std::string> names;
    std::vector<HistoryInput> inputs = std::move(option_files);
    RetargetTable report;
    std::size_t frames = 0, unlabelled = 0, unmatched = 0, files = 0;
    double seconds = 0;
    bool no_row = false;  // of the file at hand in --labels
    std::map<std::string, std::size_t> found;  // what units, axes and rates the files have
    const auto finish_clip = [&](Clip& clip) {
      std::string unique = clip.name;
      for (int n = 2; !names.insert(unique).second; ++n) unique = fmt::format("{}#{}", clip.name, n);
      clip.name = unique;
      unlabelled += no_row;
      frames += clip.frames();
      seconds += clip.seconds();
      writer.add(clip);
    };
    const auto finish_result = [&](const cli::InputFile& file, Canonicalizer::Result&& result) {
      const ClipSource& source = result.clips.front().source;
      ++found[fmt::format("{}, {} up, {:.6g} Hz", source.unit.empty() ? "unit unknown" : source.unit, source.up_axis.empty() ? "?" : source.up_axis, source.frame_rate_hz)];
      for (const auto& note : result.notes) log::info("{}: {}", file.label, note);
      if (result.report) report.add(result.clips.front().name, *result.report);
      std::stable_sort(result.clips.begin(), result.clips.end(), [](const Clip& a, const Clip& b) { return store::source_order(a.source, b.source); });
      for (Clip& clip : result.clips) finish_clip(clip);
    };
    const Exit status = context.for_each<Prepared>(
        [&](const cli::InputFile& file) {
          Prepared p;
          if (file.path == "-" && stdin_failure_) throw Error(*stdin_failure_);
          p.input = file.path == "-" && stdin_ ? std::move(stdin_) : formats::open_motion(file.path, file.label, read_options_);
          if (p.input->format() == "archive") return p;
          p.results.push_back(prepare(p, 0, file, labels, canonicalizer));
          return p;
        },
        [&](const cli::InputFile& file, Prepared&& p) {
          cli::ReadingOptions::report(*p.input, file.label);
          no_row = labels && labels->of(file.path, file.label).empty();
          for (auto& result : p.results) finish_result(file, std::move(result));
          if (p.results.empty())
            for (std::size_t i = 0; i < p.input->size(); ++i) finish_result(file, prepare(p, i, file, labels, canonicalizer));
          for (const auto& doubt : p.doubts) log::warn("{}", doubt);
          unmatched += p.unmatched;
          ++files;
          history_.add(p.input->history());
          inputs.push_back({file.label, p.input->sha256()});
          add_companions(inputs, p.input->companions());
        });
    if (writer.size() == 0) throw Error(status == Exit::ok ? Exit::data : status, {context.common().output, 0, {}}, "not written: no input gave a clip");
    History history = history_.merged();
    sort_inputs(inputs);
    history.push_back(context.history_entry(std::move(inputs)));
    writer.set_history(std::move(history));
    writer.finish();
    if (!report_.empty()) {
      write_file(report_, report.text(), context.overwrite());
      log::info("{}", report.summary());
    }
    cli::ReadingOptions::report_unused(read_options_, context);
    if (unmatched > 0) log::warn("--attr-from-path does not match {} of {} files", unmatched, files);
    if (unlabelled > 0) log::warn("{} of {} clips have no row in {}", unlabelled, writer.size(), labels_);
    log::info("read as {}", read_as(found));
    log::info("{} clips, {} frames, {:.1f} s", writer.size(), frames, seconds);
    return status;
  }

 private:
  // --skip-existing: an archive is one output, so it is done where it was made by this command from these very files. Those it was not made from are refused now as they were then, which is
  // reported again; one that is not refused is new.
  bool done_before(cli::Context& context, std::vector<HistoryInput> now, const std::optional<formats::Labels>& labels) const {
    const std::string& output = context.common().output;
    if (!context.common().skip_existing || output == "-") return false;
    const std::optional<store::ArchiveReader> existing = archive_at(output);
    const History history = existing ? existing->header().history : History();
    std::set<std::pair<std::string, std::string>> made_from;
    if (!history.empty())
      for (const HistoryInput& input : history.back().inputs) made_from.emplace(input.path, input.sha256);
    std::vector<std::pair<const cli::InputFile*, Error>> refused;
    for (const auto& file : context.inputs()) {
      Digest digest{};
      try {
        if (file.path != "-") (void)read_file(file.path, std::size_t{1} << 36, &digest);
      } catch (const Error&) {
      }
      const std::string sha256 = to_hex(digest);
      if (!made_from.empty() && !made_from.contains({file.label, sha256}) && file.path != "-")
        if (const auto error = refusal(file, labels, existing->header().skeleton)) {
          refused.emplace_back(&file, *error);
          continue;
        }
      now.push_back({file.label, sha256});
      add_companions(now, formats::companions_of(file.path, file.label, read_options_));
    }
    sort_inputs(now);
    if (!context.up_to_date(output, context.history_entry(std::move(now)), [&](const std::string&) { return history; })) return false;
    for (const auto& [file, error] : refused) context.reject(*file, error);
    return true;
  }

  static std::optional<store::ArchiveReader> archive_at(const std::string& path) {
    try {
      return std::optional<store::ArchiveReader>(std::in_place, path);
    } catch (const Error&) {  // none, or a damaged one
      return std::nullopt;
    }
  }

  // Why an input cannot be used, where it cannot.
  std::optional<Error> refusal(const cli::InputFile& file, const std::optional<formats::Labels>& labels, const std::shared_ptr<const Skeleton>& body) const {
    if (file.failure) return file.failure;
    try {
      CanonicalizeOptions options = options_;
      if (body_ == "source") options.body = body;
      const Canonicalizer canonicalizer(options);
      Prepared p;
      p.input = formats::open_motion(file.path, file.label, read_options_);
      for (std::size_t i = 0; i < p.input->size(); ++i) (void)prepare(p, i, file, labels, canonicalizer);
      return std::nullopt;
    } catch (const Error& e) {
      if (e.status() != Exit::data) throw;
      return e;
    }
  }

  // An ASF that several files share is listed once, behind the first of them.
  static void add_companions(std::vector<HistoryInput>& inputs, const std::vector<HistoryInput>& companions) {
    for (const auto& c : companions)
      if (std::none_of(inputs.rbegin(), inputs.rend(), [&](const HistoryInput& i) { return i.path == c.path && i.sha256 == c.sha256; })) inputs.push_back(c);
  }

  // "cmu, y up, 120 Hz (87); cm, y up, 60 Hz (1)", the commonest first.
  static std::string read_as(const std::map<std::string, std::size_t>& found) {
    std::vector<std::pair<std::string, std::size_t>> ways(found.begin(), found.end());
    std::stable_sort(ways.begin(), ways.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
    std::string text;
    for (std::size_t k = 0; k < std::min<std::size_t>(ways.size(), 6); ++k) text += fmt::format("{}{} ({})", k > 0 ? "; " : "", ways[k].first, ways[k].second);
    return text + (ways.size() > 6 ? fmt::format("; and {} more ways", ways.size() - 6) : "");
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

  Canonicalizer::Result prepare(Prepared& p, std::size_t i, const cli::InputFile& file, const std::optional<formats::Labels>& labels, const Canonicalizer& canonicalizer) const {
    try {
      Clip clip = p.input->read(i);
      const bool archive = p.input->format() == "archive";
      if (!archive) clip.name = file.stem;  // unique in the whole batch, whatever --shard leaves of it
      if (!attach_path(clip, p.input->format(), file)) p.unmatched = true;
      if (labels) labels->apply(clip, file.path, file.label);
      Canonicalizer::Result result = canonicalizer(clip, !report_.empty());
      if (const auto doubt = result.clips.empty() ? std::nullopt : check_rate(result.clips.front())) {
        const std::string name = (file.path == "-" ? "<stdin>" : file.path) + (archive ? ":clip " + clip.name : "");
        p.doubts.push_back(fmt::format("{}: its motion contradicts {:.6g} Hz: {}; --fps-override sets another", name, clip.source.frame_rate_hz, *doubt));
      }
      return result;
    } catch (const Error& e) {
      throw e.status() == Exit::data && e.where().file.empty() ? e.in_file(file.path == "-" ? "<stdin>" : file.path) : e;
    }
  }

  // What classifiers found in archives among the inputs is kept: their classes, of all shards, as the columns for it.
  std::map<std::string, std::vector<std::string>> common_classes(cli::Context& context) {
    std::map<std::string, std::vector<std::string>> all;
    for (const auto& file : context.all_inputs()) {
      if (file.path != "-" && store::probe(file.path) != "mocap-motion") continue;
      try {
        if (file.path == "-" && !stdin_) stdin_ = formats::open_motion(file.path, file.label, read_options_);  // it can be read only once
        const auto found = file.path == "-" ? stdin_->attribute_classes() : store::ArchiveReader(file.path).header().attribute_classes;
        for (const auto& [name, classes] : found)
          for (const auto& value : classes)
            if (auto& known = all[name]; std::find(known.begin(), known.end(), value) == known.end()) known.push_back(value);
      } catch (const Error& e) {
        if (e.status() != Exit::data) throw;
        if (file.path == "-") stdin_failure_ = e;  // its turn to be rejected comes
      }
    }
    return all;
  }

  // --body source: the rig of the first input that can be read, whatever the shard. Its bones are every clip's.
  std::shared_ptr<const Skeleton> common_body(cli::Context& context) {
    for (const auto& file : context.all_inputs()) {
      try {
        auto input = formats::open_motion(file.path, file.label, read_options_);
        const Clip clip = input->read(0);
        if (file.path == "-") stdin_ = std::move(input);  // it can be read only once
        if (const JointMap map = map_to_canonical(*clip.skeleton); !map.missing().empty()) continue;
        std::vector<std::string> notes;
        return without_translations(clip, notes).skeleton;
      } catch (const Error& e) {
        if (e.status() != Exit::data) throw;  // its turn to be rejected comes
      }
    }
    throw Error(Exit::data, {context.common().output, 0, {}}, "not written: no input has a skeleton to keep");
  }

  std::unique_ptr<formats::MotionInput> stdin_;
  std::optional<Error> stdin_failure_;
  cli::ReadingOptions reading_;
  formats::ReadOptions read_options_;
  CanonicalizeOptions options_;
  std::string labels_, phases_ = "first", anti_alias_ = "none", body_ = "canonical", joint_map_, alignment_ = "auto", trim_, attr_from_path_, body_model_, report_;
  std::optional<formats::PathAttributes> from_path_;
  HistoryUnion history_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Canonicalize>(argc, argv); }
