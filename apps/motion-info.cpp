// motion-info - what is in a motion archive, a model or any mocap file.
#include <fmt/format.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <set>

#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/store/archive.hpp"
#include "libmocap/store/model_file.hpp"

namespace {

using namespace mocap;
using Json = nlohmann::ordered_json;

// Names come from files: control characters must not reach a terminal or break a line.
std::string printable(const std::string& text) {
  std::string s;
  for (const char c : text) s += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? fmt::format("\\x{:02x}", static_cast<unsigned char>(c)) : std::string(1, c);
  return s;
}

std::string duration(double seconds) {
  if (seconds < 120) return fmt::format("{:.1f} s", seconds);
  const auto whole = static_cast<long long>(seconds + 0.5);
  return whole < 7200 ? fmt::format("{} min {} s", whole / 60, whole % 60) : fmt::format("{} h {} min", whole / 3600, whole / 60 % 60);
}

std::string row(const std::string& key, const std::string& value) { return fmt::format("  {:<11} {}\n", key, value); }

Json skeleton_json(const Skeleton& s) {
  Json joints = Json::array();
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    const Vector3& o = s.rest_offsets[j];
    joints.push_back({{"name", s.joint_names[j]}, {"parent", s.parents[j]}, {"rest_offset", {o.x(), o.y(), o.z()}}});
  }
  return {{"joints", joints}, {"end_sites", s.end_sites.size()}, {"roles", s.roles}};
}

// A tree in which a run of only children takes one line: "left_hip [left_hip] - left_knee - left_ankle".
std::string skeleton_text(const Skeleton& s) {
  std::map<std::string, std::string> role_of;
  for (const auto& [role, joint] : s.roles)
    if (role != joint) role_of[joint] += (role_of[joint].empty() ? "" : ", ") + role;
  const auto label = [&](int j) {
    const std::string& name = s.joint_names[static_cast<std::size_t>(j)];
    const auto role = role_of.find(name);
    return printable(name) + (role == role_of.end() ? "" : " [" + printable(role->second) + "]");
  };
  std::string text = row("skeleton", fmt::format("{} joints, {} end sites", s.joint_count(), s.end_sites.size()));
  const auto children = s.children();
  std::vector<std::pair<int, std::size_t>> open{{0, 4}};  // joint, indentation
  while (!open.empty()) {
    auto [j, indent] = open.back();
    open.pop_back();
    text += std::string(std::min<std::size_t>(indent, 60), ' ') + label(j);
    const std::vector<int>* below = &children[static_cast<std::size_t>(j)];
    for (; below->size() == 1; below = &children[static_cast<std::size_t>(j)]) text += " - " + label(j = below->front());
    text += "\n";
    for (auto child = below->rbegin(); child != below->rend(); ++child) open.emplace_back(*child, indent + 2);
  }
  return text;
}

using Counts = std::map<std::string, std::map<std::string, std::size_t>>;  // attribute -> value -> clips; "" unlabelled

Counts count_attributes(const std::vector<const Attributes*>& clips) {
  Counts counts;
  for (const Attributes* clip : clips)
    for (const auto& [name, value] : *clip) ++counts[name][value];
  for (auto& [name, values] : counts) {
    std::size_t labelled = 0;
    for (const auto& [value, n] : values) labelled += n;
    if (labelled < clips.size()) values[""] += clips.size() - labelled;
  }
  return counts;
}

std::string counts_text(const Counts& counts) {
  std::string text;
  for (const auto& [name, values] : counts) {
    std::string line;
    std::size_t shown = 0;
    for (const auto& [value, n] : values) {
      if (++shown > 10 && values.size() > 11) {
        line += fmt::format(", and {} more", values.size() - 10);
        break;
      }
      line += fmt::format("{}{} {}", line.empty() ? "" : ", ", value.empty() ? "(none)" : printable(value), n);
    }
    text += row("attribute", printable(name) + ": " + line);
  }
  return text;
}

// "cm, y up": how the source of a clip was read; "" where nothing is known.
std::string axes_text(const ClipSource& source) {
  const std::string up = source.up_axis.empty() ? "" : printable(source.up_axis) + " up";
  return printable(source.unit) + (source.unit.empty() || up.empty() ? "" : ", ") + up;
}

std::string counted(const std::string& key, const std::map<std::string, std::size_t>& counts) {
  std::string line;
  for (const auto& [value, n] : counts) line += fmt::format("{}{}: {}", line.empty() ? "" : "; ", value, n);
  return line.empty() ? "" : row(key, line);
}

Json history_json(const History& history) {
  Json lines = Json::array();
  const std::string text = to_json_lines(history);
  for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1) lines.push_back(Json::parse(text.substr(at, text.find('\n', at) - at)));
  return lines;
}

std::string history_text(const History& history) {
  if (history.empty()) return row("history", "none");
  std::string steps, last;
  for (const auto& e : history) steps += (steps.empty() ? "" : ", ") + printable(e.tool);
  for (const auto& word : history.back().argv) last += (last.empty() ? "" : " ") + printable(word);
  return row("history", steps) + row("last", last);
}

// Standard input as a file that can be opened as often as needed; any other path as it is.
class Opened {
 public:
  explicit Opened(const cli::InputFile& file) : name(file.path == "-" ? "<stdin>" : file.path), path(file.path), label(file.label) {
    if (path != "-") return;
    const std::string bytes = read_file("-");
    spooled_ = path = temporary_file("mocapkit-stdin");
    try {
      write_file(path, bytes, Overwrite::allow);
    } catch (...) {
      ::unlink(spooled_.c_str());
      throw;
    }
  }
  ~Opened() {
    if (!spooled_.empty()) ::unlink(spooled_.c_str());
  }
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;

  // A line of check() with the name that the user knows.
  std::string named(const std::string& line) const { return line.starts_with(path) ? name + line.substr(path.size()) : line; }

  std::string name, path, label;

 private:
  std::string spooled_;
};

struct Result {
  std::string text;  // what is printed without --json
  Json json;
  History history;
  bool defective = false;
};

class MotionInfo final : public cli::Tool {
 public:
  std::string name() const override { return "motion-info"; }
  std::string synopsis() const override { return "Show what is in a motion archive, a model or a mocap file, and check it"; }
  std::string description() const override {
    return "A summary for people, or with --json everything for programs. --history prints the commands that made a file as a shell script. --check "
           "verifies the index and the markers, --check full every checksum, digest and invariant: status 0 where all hold, 1 where a readable file "
           "breaks one (one line each), 3 where a file cannot be read.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"motion-info all.h5", "clips, skeleton, attributes, last command"},
            {"motion-info --check full split/*.h5", "is everything as it was written?"},
            {"motion-info --history samples.h5 > again.sh", "the pipeline behind a result"}};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::none;
    t.threads = false;
    t.report = true;
    t.input_help = "archives, models, BVH, AMC, npz";
    return t;
  }
  void options(CLI::App& app) override {
    app.add_flag("--list", list_, "also one line for each clip or tensor");
    history_option_ = app.add_flag("--history", history_, "the commands that made the file, as a shell script; nothing else");
    app.add_option("--check", check_, "verify instead of describing; without a value quick")->check(cli::one_of({"quick", "full"}))->excludes(history_option_);
    reading_.add(app);
  }
  bool accepts(const std::string& path) const override { return Tool::accepts(path) || store::probe(path) == "mocap-model"; }

  Exit run(cli::Context& context) override {
    read_options_ = reading_.options();
    if (history_ && context.common().json) refuse_usage("--history and --json exclude each other");
    Json documents = Json::array();
    bool defective = false;
    const Exit status = context.for_each<Result>(
        [&](const cli::InputFile& file) {
          const Opened opened(file);
          try {
            Result r = inspect(opened);
            if (history_) r.text = to_shell(r.history);
            Json named{{"file", opened.name}};
            named.update(r.json);
            r.json = std::move(named);
            return r;
          } catch (const Error& e) {
            // Spooled standard input has another name; a defect of an AMC's ASF is not the AMC's.
            throw e.status() == Exit::data && (e.where().file.empty() || e.where().file == opened.path) ? e.in_file(opened.name) : e;
          }
        },
        [&](const cli::InputFile&, Result&& r) {
          defective = defective || r.defective;
          if (context.common().json) documents.push_back(std::move(r.json));
          else context.print(r.text);
        });
    cli::ReadingOptions::report_unused(read_options_, context);
    // One input, one document; a list where several were asked for.
    if (context.common().json && !(context.lone_input() && documents.empty())) {
      const Json& whole = context.lone_input() ? documents[0] : documents;
      context.print(whole.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    }
    return status == Exit::ok && defective ? Exit::some_failed : status;
  }

 private:
  Result inspect(const Opened& file) const {
    const std::string format = store::probe(file.path);
    if (format == "mocap-model") return model(file);
    if (format == "mocap-motion") return archive(file);
    return motion_file(file);
  }

  Result verdict(const Opened& file, const std::string& format, const std::vector<std::string>& defects) const {
    Result r;
    r.json = {{"format", format}, {"check", check_}, {"defects", Json::array()}};
    for (const auto& d : defects) {
      r.text += printable(file.named(d)) + "\n";
      r.json["defects"].push_back(file.named(d));
    }
    r.defective = !defects.empty();
    if (!r.defective) r.text = fmt::format("{}: ok ({} check)\n", printable(file.name), check_);
    return r;
  }

  Result archive(const Opened& file) const {
    const store::ArchiveReader in(file.path);
    if (!check_.empty()) return verdict(file, "archive", in.check(check_ == "full"));
    const Skeleton& skeleton = *in.header().skeleton;
    const double rate = in.header().frame_rate_hz;
    std::int64_t frames = 0, least = in.info(0).length, most = 0;
    double seconds = 0;
    std::size_t mirrored = 0, segments = 0, segmented = 0, paths = 0;
    std::map<std::string, std::size_t> units;
    std::set<std::string> sources;
    std::vector<const Attributes*> attributes;
    std::string lines;
    Json clips = Json::array();
    for (std::size_t i = 0; i < in.size(); ++i) {
      const store::ClipInfo& c = in.info(i);
      frames += c.length;
      least = std::min(least, c.length);
      most = std::max(most, c.length);
      seconds += static_cast<double>(c.length - 1) / rate;
      mirrored += c.source.mirrored;
      segments += c.segments.size();
      segmented += !c.segments.empty();
      paths += c.path_points > 0;
      if (!c.source.sha256.empty() || !c.source.path.empty()) sources.insert(c.source.sha256.empty() ? c.source.path : c.source.sha256);
      attributes.push_back(&c.attributes);
      const std::string axes = axes_text(c.source);
      if (!axes.empty()) ++units[axes];
      if (!list_) continue;
      std::string labels;
      for (const auto& [name, value] : c.attributes) labels += " " + printable(name) + "=" + printable(value);
      lines += row("clip", fmt::format("{}: {} frames,{}{} from {}", printable(c.name), c.length, labels, labels.empty() ? "" : ",", c.source.path.empty() ? "nowhere" : printable(c.source.path)) +
                               (axes.empty() ? "" : " (" + axes + ")"));
      clips.push_back({{"name", c.name}, {"frames", c.length}, {"attributes", c.attributes}, {"source", c.source.path}, {"source_sha256", c.source.sha256},
                       {"source_start", c.source.start_s}, {"source_end", c.source.end_s}, {"source_frame_rate_hz", c.source.frame_rate_hz}, {"phase", c.source.phase},
                       {"mirrored", c.source.mirrored}, {"source_unit", c.source.unit}, {"source_up_axis", c.source.up_axis}, {"source_scale", c.source.scale},
                       {"source_yaw", c.source.yaw}, {"source_origin", {c.source.origin.x(), c.source.origin.y(), c.source.origin.z()}}, {"segments", c.segments.size()}, {"path_points", c.path_points}, {"digest", c.digest}});
    }
    const Counts counts = count_attributes(attributes);
    const std::string& rule = in.header().contacts_rule;
    Result r;
    r.history = in.header().history;
    r.json = {{"format", "archive"}, {"clips", in.size()}, {"frames", frames}, {"seconds", seconds}, {"frame_rate_hz", rate}, {"frames_least", least}, {"frames_most", most},
              {"sources", sources.size()}, {"mirrored", mirrored}, {"source_axes", units}, {"segments", segments}, {"paths", paths}, {"attributes", counts}, {"contacts", rule},
              {"digest", in.digest()}, {"sha256", in.file_sha256()}, {"skeleton", skeleton_json(skeleton)}, {"history", history_json(r.history)}};
    if (list_) r.json["clip"] = std::move(clips);
    r.text = fmt::format("{}: motion archive, {} clips, {} frames, {} at {} Hz\n", printable(file.name), in.size(), frames, duration(seconds), rate) +
             row("clips", fmt::format("{} to {} frames, {} sources, {} mirrored", least, most, sources.size(), mirrored)) + counted("source axes", units) + skeleton_text(skeleton) + counts_text(counts) +
             (segments > 0 ? row("segments", fmt::format("{} in {} clips", segments, segmented)) : "") + (paths > 0 ? row("paths", fmt::format("{} clips", paths)) : "") +
             row("contacts", rule.empty() ? "none" : printable(rule)) + row("digest", in.digest()) + history_text(r.history) + lines;
    return r;
  }

  Result model(const Opened& file) const {
    if (!check_.empty()) return verdict(file, "model", store::check_model(file.path, check_ == "full"));
    const store::ModelFile m = store::read_model(file.path);
    std::size_t parameters = 0;
    std::string lines;
    Json tensors = Json::array();
    for (const auto& [path, tensor] : m.weights) {
      parameters += tensor.values.size();
      if (!list_) continue;
      lines += row("tensor", fmt::format("{} [{}]", printable(path), fmt::join(tensor.shape, ",")));
      tensors.push_back({{"name", path}, {"shape", tensor.shape}});
    }
    const Json config = Json::parse(m.config);
    Result r;
    r.history = m.history;
    r.json = {{"format", "model"}, {"kind", m.kind}, {"parameters", parameters}, {"tensors", m.weights.size()}, {"training_state", m.has_training}, {"config", config},
              {"vocabulary", m.vocabulary}, {"train_sources", m.train_sources.size()}, {"skeleton", m.skeleton ? skeleton_json(*m.skeleton) : Json()}, {"history", history_json(m.history)}};
    if (list_) r.json["tensor"] = std::move(tensors);
    r.text = fmt::format("{}: model, {}, {} parameters in {} tensors, {}\n", printable(file.name), printable(m.kind), parameters, m.weights.size(),
                         m.has_training ? "with training state" : "weights only");
    if (m.skeleton) r.text += skeleton_text(*m.skeleton);
    for (const auto& [attribute, classes] : m.vocabulary) {
      std::string words;
      for (const auto& c : classes) words += (words.empty() ? "" : ", ") + printable(c);
      r.text += row("vocabulary", printable(attribute) + ": " + words);
    }
    r.text += row("trained on", fmt::format("{} source files", m.train_sources.size()));
    for (const auto& [key, value] : config.items()) r.text += row("config", printable(key) + " = " + printable(value.dump(-1, ' ', false, Json::error_handler_t::replace)));
    r.text += history_text(m.history) + lines;
    return r;
  }

  Result motion_file(const Opened& file) const {
    const auto in = formats::open_motion(file.path, file.label, read_options_);
    const Clip clip = in->read(0);
    // Reading a text or npz file checks all of it.
    if (!check_.empty()) return verdict(file, in->format(), {});
    const Counts counts = count_attributes({&clip.attributes});
    Result r;
    r.history = in->history();
    r.json = {{"format", in->format()}, {"clips", 1}, {"frames", clip.frames()}, {"seconds", clip.seconds()}, {"frame_rate_hz", clip.frame_rate_hz}, {"attributes", counts},
              {"notes", in->notes()}, {"doubts", in->doubts()}, {"sha256", in->sha256()}, {"skeleton", skeleton_json(*clip.skeleton)}, {"history", history_json(r.history)}};
    r.text = fmt::format("{}: {}, {} frames, {} at {} Hz\n", printable(file.name), in->format(), clip.frames(), duration(clip.seconds()), clip.frame_rate_hz) +
             skeleton_text(*clip.skeleton) + counts_text(counts);
    for (const auto& note : in->notes()) r.text += row("note", printable(note));
    for (const auto& doubt : in->doubts()) r.text += row("doubt", printable(doubt));
    r.text += history_text(r.history);
    return r;
  }

  cli::ReadingOptions reading_;
  formats::ReadOptions read_options_;
  CLI::Option* history_option_ = nullptr;
  bool list_ = false, history_ = false;
  std::string check_;
};

}  // namespace

int main(int argc, char** argv) {
  // `--check FILE` asks for the quick check of FILE, `--check full FILE` for the full one.
  std::vector<std::string> words(argv, argv + argc);
  for (std::size_t i = 1; i < words.size() && words[i] != "--"; ++i) {
    if (words[i] != "--check") continue;
    const bool valued = i + 1 < words.size() && (words[i + 1] == "full" || words[i + 1] == "quick");
    words[i] = "--check=" + (valued ? words[i + 1] : "quick");
    if (valued) words.erase(words.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
  std::vector<char*> arguments;
  for (auto& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  return mocap::cli::run<MotionInfo>(static_cast<int>(words.size()), arguments.data());
}
