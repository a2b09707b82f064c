// render - draw motion as a film strip.
#include <fmt/core.h>

#include "libmocap/base/log.hpp"
#include "libmocap/cli/reading_options.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/draw/film_strip.hpp"
#include "libmocap/draw/selection.hpp"
#include "libmocap/formats/motion_input.hpp"

namespace {

using namespace mocap;

// Every clip of some opened files, by one running number.
class Clips {
 public:
  void open(const std::string& path, const std::string& label, const formats::ReadOptions& options) {
    files_.push_back({path == "-" ? "<stdin>" : path, label, formats::open_motion(path, label, options)});
    for (std::size_t i = 0; i < files_.back().input->size(); ++i) index_.push_back({files_.size() - 1, i});
    cli::ReadingOptions::report(*files_.back().input, label);
  }
  std::size_t size() const { return index_.size(); }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& [file, i] : index_) out.push_back(files_[file].input->name(i));
    return out;
  }
  Attributes attributes(std::size_t k) const { return files_[index_[k].first].input->attributes(index_[k].second); }
  Clip read(std::size_t k) const {
    const auto& [file, i] = index_[k];
    try {
      return files_[file].input->read(i);
    } catch (const Error& e) {
      throw e.where().file.empty() ? e.in_file(files_[file].path) : e;
    }
  }
  const std::string& label(std::size_t k) const { return files_[index_[k].first].label; }
  const std::string& path(std::size_t k) const { return files_[index_[k].first].path; }
  void add_history(History& history, std::vector<HistoryInput>& inputs) const {
    for (const auto& f : files_) {
      merge_into(history, f.input->history());
      inputs.push_back({f.label, f.input->sha256()});
      for (auto& companion : f.input->companions()) inputs.push_back(std::move(companion));
    }
  }

 private:
  struct File {
    std::string path, label;
    std::unique_ptr<formats::MotionInput> input;
  };
  std::vector<File> files_;
  std::vector<std::pair<std::size_t, std::size_t>> index_;
};

std::string base_name(const std::string& path) { return path.substr(path.rfind('/') + 1); }

class Render final : public cli::Tool {
 public:
  std::string name() const override { return "render"; }
  std::string synopsis() const override { return "Draw motion as a film strip of stick figures, PNG or SVG"; }
  std::string description() const override {
    return "One row a clip: figures evenly spaced in time over a ground line, left limbs blue, right limbs orange, feet on the ground marked below it. "
           "The camera looks at the figure's right side: who walks forwards goes to the right. With --compare each row of the input is followed by the "
           "row of OTHER with the same attributes. All rows of a picture share one scale.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"render walk.bvh -o walk.png", "one clip"},
            {"render test.h5 --compare samples.h5 -o strips.png", "real above sampled, one pair for each combination of attributes"},
            {"sample -m model.h5 -n 4 -o - | render - --contacts --trajectory -o samples.svg", "from a pipe, with foot-fall charts and ground tracks"}};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::many;
    t.output = cli::Output::file;
    t.threads = false;
    t.input_help = "motion archives or motion files (BVH, AMC, npz), folders, @list.txt";
    t.output_help = "picture, .png or .svg; '-' writes standard output";
    return t;
  }
  void options(CLI::App& app) override {
    app.add_option("--compare", compare_, "second archive or file, drawn below the input's row of the same attributes")->check(cli::path("OTHER"));
    app.add_option("--clip", clips_, "clip to draw, by name or by number from 1");
    app.add_option("--max-clips", max_clips_, "most clips (with --compare: pairs); more are thinned out evenly")->check(cli::whole(1, 1000))->capture_default_str();
    app.add_option("--view", view_, "where the viewer stands, from the mean facing of each clip")->check(cli::one_of({"side", "front", "top", "oblique"}))->capture_default_str();
    app.add_option("--frames", strip_.figures, "figures in a row")->check(cli::whole(1, 1000))->capture_default_str();
    app.add_option("--spread", spread_, "figures evenly over time, at their place along the path, or path where they stand clear of each other")
        ->check(cli::one_of({"auto", "time", "path"}))
        ->capture_default_str();
    app.add_option("--start", start_, "first moment drawn")->check(cli::non_negative("SECONDS"))->capture_default_str();
    app.add_option("--seconds", seconds_, "length drawn; 0: to the end")->check(cli::non_negative("SECONDS"))->capture_default_str();
    app.add_flag("--trajectory", strip_.trajectory, "the root's way over the ground beside each row, with the path it was asked to follow");
    app.add_flag("--contacts", strip_.contacts, "a foot-fall chart below each row; clips without contacts are labelled by the default rule");
    app.add_option("--size", strip_.width, "width of the picture")->check(cli::between(200, draw::kMaximumSide, "PIXELS"))->capture_default_str();
    app.add_option("--row-height", strip_.row_height, "most that the figures of a row may take")->check(cli::between(40, 4000, "PIXELS"))->capture_default_str();
    app.add_option("--format", format_, "png or svg; auto: by the output's ending, PNG for '-'")->check(cli::one_of({"auto", "png", "svg"}))->capture_default_str();
    reading_.add(app);
  }

  Exit run(cli::Context& context) override {
    const std::string& output = context.common().output;
    const auto format = format_ == "auto" ? draw::image_format_of(output) : format_ == "svg" ? draw::ImageFormat::svg : draw::ImageFormat::png;
    strip_.view = draw::parse_view(view_);
    strip_.spread = draw::parse_spread(spread_);

    const formats::ReadOptions reading = reading_.options();
    Clips clips, others;
    const auto& files = context.inputs();
    // Of thousands of files only those that will be drawn are opened.
    const bool all = !clips_.empty() || !compare_.empty();
    for (const std::size_t i : draw::evenly_chosen(files.size(), all ? files.size() : max_clips_)) clips.open(files[i].path, files[i].label, reading);
    if (!compare_.empty()) others.open(compare_, base_name(compare_), reading);

    std::vector<draw::StripRow> rows;
    if (compare_.empty()) {
      for (const std::size_t k : chosen(clips)) rows.push_back(row(clips, k, files.size() > 1 || clips.size() == 1 ? "" : clips.label(k) + ": "));
    } else {
      for (const auto& [first, second] : pairs(clips, others)) {
        rows.push_back(row(clips, first, clips.label(first) + ": "));
        rows.push_back(row(others, second, others.label(second) + ": "));
      }
    }
    History history;
    std::vector<HistoryInput> inputs = cli::ReadingOptions::files(reading);
    clips.add_history(history, inputs);
    others.add_history(history, inputs);
    history.push_back(context.history_entry(std::move(inputs)));
    write_file(output, draw::film_strip(rows, strip_, format, to_json_lines(history)), context.overwrite());
    return Exit::ok;
  }

 private:
  std::vector<std::size_t> chosen(const Clips& clips) const {
    const auto named = clips_.empty() ? std::vector<std::size_t>() : draw::clips_named(clips.names(), clips_);
    std::vector<std::size_t> out;
    for (const std::size_t k : draw::evenly_chosen(clips_.empty() ? clips.size() : named.size(), max_clips_)) out.push_back(clips_.empty() ? k : named[k]);
    return out;
  }

  std::vector<draw::Pair> pairs(const Clips& clips, const Clips& others) const {
    std::vector<std::size_t> candidates;
    if (clips_.empty())
      for (std::size_t k = 0; k < clips.size(); ++k) candidates.push_back(k);
    else
      candidates = draw::clips_named(clips.names(), clips_);
    std::vector<Attributes> first, second;
    for (const std::size_t k : candidates) first.push_back(clips.attributes(k));
    for (std::size_t k = 0; k < others.size(); ++k) second.push_back(others.attributes(k));
    const auto found = draw::pair_by_attributes(first, second);
    if (found.empty()) refuse({compare_, 0, {}}, "no clip has the attributes of a clip of the input, expected at least one such pair");
    std::vector<draw::Pair> out;
    for (const std::size_t p : draw::evenly_chosen(found.size(), max_clips_)) out.push_back({candidates[found[p].first], found[p].second});
    return out;
  }

  draw::StripRow row(const Clips& clips, std::size_t k, const std::string& before) const {
    Clip clip = clips.read(k);
    const auto frame_at = [&](double seconds) { return static_cast<std::size_t>(std::min(seconds * clip.frame_rate_hz + 0.5, 1e15)); };
    const std::size_t first = frame_at(start_);
    if (first >= clip.frames()) refuse({clips.path(k), 0, "clip " + clip.name}, fmt::format("{:.2f} s long, expected more than --start {} s", clip.seconds(), start_));
    const std::size_t length = seconds_ > 0 ? frame_at(seconds_) + 1 : clip.frames();
    if (first > 0 || length < clip.frames()) clip = cut(clip, first, std::min(length, clip.frames() - first));
    if (strip_.contacts && clip.contacts.empty()) {
      Clip named = clip;
      named.skeleton = std::make_shared<const Skeleton>(draw::anatomy_of(*clip.skeleton).with_roles);
      clip.contacts = label_contacts(named, contact_preset("default"));
      if (clip.contacts.empty()) log::warn("{}: clip {}: no feet found, the foot-fall chart stays empty", clips.path(k), clip.name);
    }
    return {before + clip.name, std::move(clip)};
  }

  draw::StripOptions strip_;
  cli::ReadingOptions reading_;
  std::string compare_, view_ = "side", spread_ = "auto", format_ = "auto";
  std::vector<std::string> clips_;
  std::size_t max_clips_ = 8;
  double start_ = 0, seconds_ = 0;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Render>(argc, argv); }
