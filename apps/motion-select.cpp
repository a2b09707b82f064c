// motion-select - some of the clips of motion archives, whole or in part.
#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_set>

#include "libmocap/base/log.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/base/text_lines.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/store/archive_set.hpp"

namespace {

using namespace mocap;

// Frames of a clip, and the segment they are: what is chosen or not.
struct Piece {
  std::size_t item = 0;
  std::int64_t first = 0, count = 0;
  std::string name;
  Attributes attributes;
  const Segment* segment = nullptr;
};

// NAME=VALUE or NAME!=VALUE.
struct Condition {
  std::string name, value;
  bool equal = true;
};

Condition parse_condition(const std::string& text) {
  const auto at = text.find('=');
  const bool equal = at == std::string::npos || at == 0 || text[at - 1] != '!';
  Condition c{text.substr(0, equal || at == std::string::npos ? at : at - 1), at == std::string::npos ? std::string() : text.substr(at + 1), equal};
  if (at == std::string::npos || c.name.empty()) refuse_usage("--attr " + text + ": expected NAME=VALUE or NAME!=VALUE");
  return c;
}

bool matches(const std::vector<std::string>& globs, const std::string& text) {
  return std::any_of(globs.begin(), globs.end(), [&](const std::string& glob) { return ::fnmatch(glob.c_str(), text.c_str(), 0) == 0; });
}

class MotionSelect final : public cli::Tool {
 public:
  std::string name() const override { return "motion-select"; }
  std::string synopsis() const override { return "Choose clips of motion archives by attribute, name, source, length or time"; }
  std::string description() const override {
    return "A clip is kept where every filter holds. Of repeated --attr the values of one attribute are alternatives, and different attributes must all hold; "
           "of repeated --name, --not-name and --source one must match. --time and --segments cut clips first, and the filters judge the parts: their length, "
           "and the attributes of their segment. Then --invert turns the choice round, and --every, --random and --head thin it out, in this order. Clips keep "
           "their order, names, contacts and sources; a part says which seconds of the source it is. A part starts where it starts in its clip: --recenter "
           "brings its first frame above the origin, facing +X. Patterns are the shell's: * ? [a-z], and * matches '/' too.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"motion-select all.h5 --attr action=walking --attr action=jogging --attr gender=female -o some.h5", "two actions of one gender"},
            {"motion-select all.h5 --segments --attr action=jogging --min-seconds 2 --recenter -o jogging.h5", "what a table of labels calls jogging, from wherever it is"},
            {"motion-select all.h5 --random 20 --seed 3 --dry-run > names.txt", "which clips these are; --list names.txt chooses them again"}};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::file;
    t.output_required = false;
    t.random = true;
    t.threads = false;
    t.input_help = "motion archives of one skeleton, rate and rule for contacts";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  void options(CLI::App& app) override {
    app.add_option("--attr", attributes_, "keep clips with this value of an attribute (repeatable); NAME= keeps unlabelled ones, NAME!=VALUE all others")
        ->check(cli::path("NAME=VALUE"));
    app.add_option("--name", names_, "keep clips whose name matches (repeatable); with --segments that of the clip or of the part")->check(cli::path("GLOB"));
    app.add_option("--not-name", not_names_, "drop clips whose name matches (repeatable)")->check(cli::path("GLOB"));
    app.add_option("--source", sources_, "keep clips whose source file matches (repeatable)")->check(cli::path("GLOB"));
    app.add_option("--list", list_, "keep the clips named in a file, one a line")->check(cli::path("FILE"));
    app.add_option("--min-seconds", min_seconds_, "drop shorter clips")->check(cli::non_negative("SECONDS"));
    app.add_option("--max-seconds", max_seconds_, "drop longer clips; 0: none is too long")->check(cli::non_negative("SECONDS"));
    app.add_option("--mirrored", mirrored_, "keep mirrored copies, originals, or both")->check(cli::one_of({"yes", "no", "any"}));
    app.add_option("--phase", phase_, "keep clips of this decimation offset; -1: any")->check(cli::whole(-1, 1000000));
    app.add_option("--time", time_, "only these seconds of each clip, both ends included, either may be missing; clips that end before are dropped")
        ->check(cli::path("START:END"));
    app.add_flag("--segments", segments_, "each labelled segment becomes a clip NAME/1, NAME/2, ... with the segment's attributes");
    app.add_flag("--recenter", recenter_, "move and turn each clip so that its first frame is above the origin, facing +X");
    app.add_flag("--invert", invert_, "keep what the filters drop");
    app.add_option("--every", every_, "of what is left every N-th, from the first")->check(cli::whole(1));
    app.add_option("--random", random_, "of what is left N at random; 0: all")->check(cli::whole(0));
    app.add_option("--head", head_, "of what is left the first N; 0: all")->check(cli::whole(0));
    app.add_flag("--dry-run", dry_run_, "write the names of the clips chosen to standard output, and no archive");
  }
  std::vector<std::string> non_content_options() const override { return {"--dry-run"}; }
  bool accepts(const std::string& path) const override { return store::probe(path) == "mocap-motion"; }

  Exit run(cli::Context& context) override {
    if (context.common().output.empty() && !dry_run_) refuse_usage("no output given, expected -o or --dry-run");
    for (const auto& text : attributes_) conditions_.push_back(parse_condition(text));
    parse_time();
    std::vector<std::string> paths;
    for (const auto& input : context.inputs()) {
      if (input.failure) throw Error(*input.failure);
      paths.push_back(input.path);
    }
    const store::ArchiveSet set(paths);
    const auto items = set.items();
    for (const Condition& c : conditions_)
      if (c.equal && !c.value.empty() && !has_attribute(set, c.name))
        refuse({set.archive(0).name(), 0, {}}, "no clip has the attribute " + c.name + ", expected one to choose by");

    std::vector<Piece> pieces;
    for (std::size_t i = 0; i < items.size(); ++i) add_pieces(set, items, i, pieces);
    const std::size_t all = pieces.size();
    Digest list_digest{};
    const auto listed = list_.empty() ? std::unordered_set<std::string>{} : read_list(items, pieces, list_digest);
    std::erase_if(pieces, [&](const Piece& p) { return holds(set, items, p, listed) == invert_; });
    thin_out(pieces, context.seed());
    if (pieces.empty()) refuse({set.size() == 1 ? set.archive(0).name() : std::string(), 0, {}}, fmt::format("none of {} {} chosen, expected at least one", all, segments_ ? "segments" : "clips"));

    std::unordered_set<std::string> taken;
    for (Piece& p : pieces) {
      const std::string name = p.name;
      for (int n = 2; !taken.insert(p.name).second; ++n) p.name = fmt::format("{}#{}", name, n);
    }
    if (dry_run_) {
      for (const Piece& p : pieces) context.print(p.name + "\n");
    } else {
      write(context, set, items, pieces, list_digest);
    }
    log::info("{} of {} {}", pieces.size(), all, segments_ ? "segments" : "clips");
    return Exit::ok;
  }

 private:
  void parse_time() {
    if (time_.empty()) return;
    const auto colon = time_.find(':');
    const auto side = [&](const std::string& text, double missing) {
      const auto value = text.empty() ? missing : cli::parse_number(text);
      if (!value || *value < 0) refuse_usage("--time " + time_ + ": expected START:END in seconds from 0");
      return *value;
    };
    if (colon == std::string::npos) refuse_usage("--time " + time_ + ": expected START:END in seconds from 0");
    from_ = side(time_.substr(0, colon), 0);
    to_ = side(time_.substr(colon + 1), 1e9);
    if (to_ < from_) refuse_usage("--time " + time_ + ": the end lies before the start");
  }

  bool has_attribute(const store::ArchiveSet& set, const std::string& name) const {
    if (set.header().attributes.contains(name)) return true;
    return segments_ && set.header().segment_attributes.contains(name);
  }

  // The part of a clip that --time leaves, or of each of its segments.
  void add_pieces(const store::ArchiveSet& set, const std::vector<store::ArchiveSet::Item>& items, std::size_t i, std::vector<Piece>& pieces) const {
    const store::ClipInfo& clip = set.info(items[i]);
    const double rate = set.header().frame_rate_hz;
    std::int64_t begin = 0, end = clip.length;
    if (!time_.empty()) {
      begin = static_cast<std::int64_t>(std::ceil(std::min(from_ * rate, 1e15) - 1e-6));
      end = std::min(end, static_cast<std::int64_t>(std::floor(std::min(to_ * rate, 1e15) + 1e-6)) + 1);
    }
    if (!segments_) {
      if (begin < end) pieces.push_back({i, begin, end - begin, items[i].name, clip.attributes, nullptr});
      return;
    }
    for (std::size_t k = 0; k < clip.segments.size(); ++k) {
      const Segment& s = clip.segments[k];
      const std::int64_t a = std::max(s.start, begin), b = std::min(s.start + s.length, end);
      if (a >= b) continue;
      Attributes merged = s.attributes;
      merged.insert(clip.attributes.begin(), clip.attributes.end());
      pieces.push_back({i, a, b - a, fmt::format("{}/{}", items[i].name, k + 1), std::move(merged), &s});
    }
  }

  std::unordered_set<std::string> read_list(const std::vector<store::ArchiveSet::Item>& items, const std::vector<Piece>& pieces, Digest& digest) const {
    std::unordered_set<std::string> known, listed;
    for (const auto& item : items) known.insert(item.name);
    for (const Piece& p : pieces) known.insert(p.name);
    for (const auto& [number, line] : read_lines(list_, &digest)) {
      if (!known.contains(line)) refuse({list_, number, {}}, "no clip is named '" + line + "', expected the name of one");
      listed.insert(line);
    }
    if (listed.empty()) refuse({list_, 0, {}}, "an empty list, expected one name a line");
    return listed;
  }

  bool holds(const store::ArchiveSet& set, const std::vector<store::ArchiveSet::Item>& items, const Piece& p, const std::unordered_set<std::string>& listed) const {
    const ClipSource& source = set.info(items[p.item]).source;
    const std::string& whole = items[p.item].name;
    std::map<std::string, bool> found;  // attribute -> one of its values fits
    for (const Condition& c : conditions_) {
      const auto at = p.attributes.find(c.name);
      const bool same = (at == p.attributes.end() ? std::string() : at->second) == c.value;
      if (!c.equal && same) return false;
      if (c.equal) found[c.name] |= same;
    }
    if (std::any_of(found.begin(), found.end(), [](const auto& one) { return !one.second; })) return false;
    if (!names_.empty() && !matches(names_, p.name) && !matches(names_, whole)) return false;
    if (matches(not_names_, p.name) || matches(not_names_, whole)) return false;
    if (!sources_.empty() && !matches(sources_, source.path)) return false;
    if (!list_.empty() && !listed.contains(p.name) && !listed.contains(whole)) return false;
    if (mirrored_ != "any" && source.mirrored != (mirrored_ == "yes")) return false;
    if (phase_ >= 0 && source.phase != phase_) return false;
    const double seconds = static_cast<double>(p.count - 1) / set.header().frame_rate_hz;
    return seconds >= min_seconds_ - 1e-9 && (max_seconds_ == 0 || seconds <= max_seconds_ + 1e-9);
  }

  void thin_out(std::vector<Piece>& pieces, std::uint64_t seed) const {
    std::size_t position = 0;
    std::erase_if(pieces, [&](const Piece&) { return position++ % static_cast<std::size_t>(every_) != 0; });
    if (random_ > 0) {
      if (static_cast<std::size_t>(random_) > pieces.size()) log::warn("--random {}: {} clips are all there are", random_, pieces.size());
      // Each is taken with the chance that fills what is wanted from what is left: N of all, in their order.
      Random random(seed, 0);
      std::uint64_t wanted = static_cast<std::uint64_t>(random_), left = pieces.size();
      std::erase_if(pieces, [&](const Piece&) {
        const bool taken = random.below(left--) < wanted;
        wanted -= taken;
        return !taken;
      });
    }
    if (head_ > 0 && static_cast<std::size_t>(head_) < pieces.size()) pieces.resize(static_cast<std::size_t>(head_));
  }

  void write(cli::Context& context, const store::ArchiveSet& set, const std::vector<store::ArchiveSet::Item>& items, const std::vector<Piece>& pieces, const Digest& list_digest) const {
    store::ArchiveHeader header = set.header();
    std::vector<HistoryInput> inputs;
    for (std::size_t a = 0; a < set.size(); ++a) {
      merge_into(header.history, set.archive(a).header().history);
      inputs.push_back({context.inputs()[a].label, set.archive(a).file_sha256()});
    }
    if (!list_.empty()) inputs.push_back({list_.substr(list_.rfind('/') + 1), to_hex(list_digest)});
    header.history.push_back(context.history_entry(std::move(inputs)));
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);
    for (const Piece& p : pieces) {
      Clip clip = set.read(items[p.item]);
      if (p.first > 0 || static_cast<std::size_t>(p.count) < clip.frames()) clip = cut(clip, static_cast<std::size_t>(p.first), static_cast<std::size_t>(p.count));
      clip.name = p.name;
      clip.attributes = p.attributes;
      if (p.segment)  // what holds for all of the part is its attributes now
        std::erase_if(clip.segments, [&](const Segment& s) { return s.start == 0 && s.length == p.count && s.attributes == p.segment->attributes; });
      if (recenter_) face_forward(clip);
      writer.add(clip);
      context.progress(writer.size(), pieces.size(), "clips");
    }
    writer.finish();
  }

  std::vector<std::string> attributes_, names_, not_names_, sources_;
  std::string list_, time_, mirrored_ = "any";
  double min_seconds_ = 0, max_seconds_ = 0;
  std::int64_t phase_ = -1, every_ = 1, random_ = 0, head_ = 0;
  bool segments_ = false, recenter_ = false, invert_ = false, dry_run_ = false;
  std::vector<Condition> conditions_;
  double from_ = 0, to_ = 0;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<MotionSelect>(argc, argv); }
