// embed - features of clips by trained classifiers, and a map of them.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/draw/scatter.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/metrics/frechet.hpp"
#include "libmocap/metrics/linear_algebra.hpp"
#include "libmocap/metrics/tsne.hpp"
#include "libmodels/classifier/classifier.hpp"
#include "libmodels/nn/blas.hpp"

namespace {

using namespace mocap;

std::string base_name(const std::string& path) { return path == "-" ? "<stdin>" : path.substr(path.rfind('/') + 1); }

// A table's cells end at tabs and line ends.
std::string cell(std::string text) {
  for (char& c : text)
    if (c == '\t' || c == '\n' || c == '\r') c = ' ';
  return text;
}

struct Map {
  Eigen::MatrixXd points;  // [N,2]
  std::string name, x_label, y_label;
};

class Embed final : public cli::Tool {
 public:
  std::string name() const override { return "embed"; }
  std::string synopsis() const override { return "Map clips by what classifiers see in them: t-SNE or principal axes of their features, as a picture or a table"; }
  std::string description() const override {
    return "Each clip is judged by every classifier, the features of its last layer side by side, and laid out on a plane: by exact t-SNE in double precision (clips that look alike to the classifiers lie "
           "together; distances between groups and the sizes of groups mean little), or by the two principal axes of all clips. Real clips are drawn as circles, generated ones as crosses. With --real the clips of INPUT "
           "are the generated ones; without it a clip counts as generated if it was made of no file, which is how `sample` writes them. The ending of -o says what is written; the table has the columns clip, "
           "kind (real or generated), the attributes, x and y; without -o it goes to standard output. With --features-only it has clip, the attributes, f0, f1, ... instead, as fid-eval --features reads it.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"embed samples.h5 --real test.h5 --classifier action.h5 --color-by action -o map.svg", "do generated clips fall among the real ones of their action?"},
            {"sample -m model.h5 -n 160 -o - | embed - --real test.h5 --classifier action.h5 --classifier gender.h5 --color-by action --color-by gender -o map.png", "from a pipe; a colour for each action and gender"},
            {"embed test.h5 --classifier action.h5 --features-only -o features.tsv", "the features themselves"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, section 5.2, Figure 4", "van der Maaten and Hinton 2008 (t-SNE)"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::file;
    t.output_required = false;
    t.random = true;
    t.network = true;
    t.input_help = "motion archive or motion file; '-' for standard input";
    t.output_help = "table (.tsv) or picture (.svg, .png); '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  void options(CLI::App& app) override {
    app.add_option("--real", real_, "real motion, for the circles; the clips of INPUT are crosses then")->check(cli::path());
    app.add_option("--classifier", classifiers_, "classifier whose features are used (repeatable: side by side)")->required()->check(cli::path());
    app.add_option("--color-by", color_by_, "attribute that colours the clips (repeatable: a colour for each combination); default: that of the first classifier")->check(cli::path("ATTRIBUTE"));
    app.add_option("--method", method_, "kind of map")->check(cli::one_of({"tsne", "pca"}))->capture_default_str();
    app.add_option("--perplexity", tsne_.perplexity, "t-SNE: how many neighbours a clip has, about; at most a third of the other clips")->check(cli::between(2, 5000))->capture_default_str();
    app.add_option("--iterations", tsne_.iterations, "t-SNE: steps of the descent, the first 250 with early exaggeration")->check(cli::whole(1, 1000000))->capture_default_str();
    app.add_option("--learning-rate", tsne_.learning_rate, "t-SNE: step size; 0: clips / early exaggeration / 4, at least 50")->check(cli::non_negative("RATE"))->capture_default_str();
    app.add_option("--early-exaggeration", tsne_.exaggeration, "t-SNE: factor on the attraction in the first 250 steps")->check(cli::between(1, 1000, "FACTOR"))->capture_default_str();
    app.add_option("--init", init_, "t-SNE: where clips start: on the principal axes, or at random by --seed")->check(cli::one_of({"pca", "random"}))->capture_default_str();
    app.add_flag("--features-only", features_only_, "write the features of INPUT, no map");
    app.add_option("--table", table_, "the map's table as well, beside a picture")->check(cli::path("FILE.tsv"));
    app.add_option("--format", format_, "what to write; auto: by the output's ending, the table for '-'")->check(cli::one_of({"auto", "tsv", "svg", "png"}))->capture_default_str();
    app.add_option("--title", title_, "title of the picture; default: what it shows")->check(cli::path("TEXT"));
    app.add_option("--size", page_.width, "width of the picture; its height is 0.7 of it")->check(cli::between(300, draw::kMaximumSide, "PIXELS"))->capture_default_str();
    app.add_option("--mark", page_.mark, "radius of circles and crosses")->check(cli::between(0.5, 100, "PIXELS"))->capture_default_str();
  }
  std::vector<std::string> non_content_options() const override { return {"--table"}; }

  Exit run(cli::Context& context) override {
    const cli::InputFile& input = context.inputs().at(0);
    const std::string format = check_usage(context.common().output, input.path);
    if (!table_.empty()) check_output(table_, context.overwrite());
    nn::use_one_blas_thread();
    metrics::use_one_blas_thread();
    load_classifiers();
    if (!real_.empty()) read(real_, base_name(real_));
    read(input.path, input.label);
    std::vector<std::string> groups;
    const std::vector<int> group = features_only_ ? std::vector<int>() : group_clips(groups);
    const Eigen::MatrixXd features = judge(context.threads());
    const std::vector<std::string> attributes = attribute_columns();
    std::string out;
    if (features_only_) {
      out = feature_table(attributes, features);
    } else {
      const Map map = method_ == "tsne" ? tsne_map(context, features) : principal_map(features);
      const std::string rows = map_table(attributes, map.points);
      History history = history_;
      std::vector<HistoryInput> used = history_inputs_;
      used.insert(used.end(), classifier_inputs_.begin(), classifier_inputs_.end());
      history.push_back(context.history_entry(std::move(used)));
      out = format == "tsv" ? rows : picture(map, groups, group, format == "svg" ? draw::ImageFormat::svg : draw::ImageFormat::png, to_json_lines(history));
      if (!table_.empty()) write_file(table_, rows, context.overwrite());
    }
    if (context.common().output.empty()) context.print(out);
    else write_file(context.common().output, out, context.overwrite());
    return Exit::ok;
  }

 private:
  // Returns "tsv", "svg" or "png".
  std::string check_usage(const std::string& output, const std::string& input) const {
    if ((input == "-") + (real_ == "-") + std::count(classifiers_.begin(), classifiers_.end(), "-") > 1) refuse_usage("standard input given twice, expected '-' once");
    std::string format = format_;
    if (format == "auto") {
      std::string ending = output.size() >= 4 ? output.substr(output.size() - 4) : "";
      std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (output.empty() || output == "-" || ending == ".tsv") format = "tsv";
      else if (ending == ".svg" || ending == ".png") format = ending.substr(1);
      else refuse_usage(output + ": expected a name that ends in .tsv, .svg or .png", "--format says what to write whatever the name");
    }
    if (output.empty() && format != "tsv") refuse_usage("a picture without -o, expected a file, or -o - for standard output");
    if (features_only_) {
      if (format != "tsv") refuse_usage("--features-only writes a table, expected no picture (" + format + ")");
      for (const auto& [option, given] : {std::pair{"--real", !real_.empty()}, {"--color-by", !color_by_.empty()}, {"--table", !table_.empty()}})
        if (given) refuse_usage(std::string("--features-only and ") + option + ", expected one of them", "--features-only writes the features of INPUT alone: run it once for each archive");
    }
    if (!table_.empty() && format == "tsv") refuse_usage("--table beside a table, expected -o to be a picture", "-o writes the table itself");
    return format;
  }

  void load_classifiers() {
    for (const auto& path : classifiers_) {
      std::string digest;
      judges_.push_back(classifier::Classifier::load(path, &digest));
      classifier_inputs_.push_back({base_name(path), digest});
    }
    if (color_by_.empty() && !features_only_) color_by_ = {judges_[0]->attribute()}, own_colors_ = false;
  }

  void read(const std::string& path, const std::string& label) {
    const auto input = formats::open_motion(path, label);
    const std::string file = path == "-" ? "<stdin>" : path;
    if (input->size() == 0) refuse({file, 0, {}}, "0 clips, expected at least one");
    const bool from_real = !real_.empty() && clips_.empty();
    for (std::size_t i = 0; i < input->size(); ++i) {
      Clip clip = input->read(i);
      const Clip& like = clips_.empty() ? clip : clips_[0];
      const std::string like_file = files_.empty() ? file : files_[0];
      if (std::abs(clip.frame_rate_hz - like.frame_rate_hz) > 1e-6 * like.frame_rate_hz)
        refuse({file, 0, "clip " + clip.name}, fmt::format("{} Hz, expected {} Hz as in {}", clip.frame_rate_hz, like.frame_rate_hz, like_file), "canonicalize brings clips to one rate (--fps)");
      if (!clip.skeleton->same_as(*like.skeleton, 1e-5)) refuse({file, 0, "clip " + clip.name}, "another skeleton, expected that of " + like_file, "canonicalize brings clips onto one body");
      generated_.push_back(real_.empty() ? clip.source.sha256.empty() : !from_real);
      clips_.push_back(std::move(clip));
    }
    files_.push_back(file);
    ends_.push_back(clips_.size());
    merge_into(history_, input->history());
    history_inputs_.push_back({label, input->sha256()});
  }

  // The class of each clip as an index into `groups`, -1 where it lacks an attribute. Before the judging, which takes its time.
  std::vector<int> group_clips(std::vector<std::string>& groups) const {
    for (const auto& attribute : own_colors_ ? color_by_ : std::vector<std::string>()) {
      std::set<std::string> known;
      for (const Clip& c : clips_)
        for (const auto& [key, value] : c.attributes)
          if (!value.empty()) known.insert(key);
      if (!known.contains(attribute))
        refuse_usage("--color-by " + attribute + ": no clip has this attribute, expected " + (known.empty() ? "clips with attributes" : fmt::format("one of {}", fmt::join(known, ", "))));
    }
    std::vector<std::string> label;
    std::set<std::string> names;
    for (const Clip& c : clips_) {
      std::string text;
      for (const auto& attribute : color_by_) {
        const auto at = c.attributes.find(attribute);
        if (at == c.attributes.end() || at->second.empty()) {
          text.clear();
          break;
        }
        text += (text.empty() ? "" : " ") + at->second;
      }
      if (!text.empty()) names.insert(text);
      label.push_back(text);
    }
    groups.assign(names.begin(), names.end());
    std::vector<int> out;
    for (const auto& text : label) out.push_back(text.empty() ? -1 : static_cast<int>(std::lower_bound(groups.begin(), groups.end(), text) - groups.begin()));
    return out;
  }

  Eigen::MatrixXd judge(int threads) const {
    Eigen::MatrixXd features(static_cast<Eigen::Index>(clips_.size()), 0);
    for (std::size_t k = 0; k < judges_.size(); ++k) {
      const auto& classifier = judges_[k];
      const std::string path = classifiers_[k] == "-" ? "<stdin>" : classifiers_[k];
      if (std::abs(classifier->frame_rate_hz() - clips_[0].frame_rate_hz) > 1e-6 * clips_[0].frame_rate_hz)
        refuse({path, 0, {}}, fmt::format("a classifier for {} Hz, expected {} Hz as in {}", classifier->frame_rate_hz(), clips_[0].frame_rate_hz, files_[0]));
      const auto seen = std::count_if(clips_.begin(), clips_.end(), [&](const Clip& c) { return !c.source.sha256.empty() && classifier->train_sources().contains(c.source.sha256); });
      if (seen > 0 && !features_only_) log::warn("{}: this classifier was trained on {} of the {} clips: they lie further apart than clips it never saw", path, seen, clips_.size());
      // One file at a time, so that an error names its file.
      const Eigen::Index first = features.cols();
      std::size_t begin = 0;
      for (std::size_t f = 0; f < files_.size(); ++f) {
        classifier::Judged judged;
        try {
          judged = classifier->judge({clips_.begin() + static_cast<std::ptrdiff_t>(begin), clips_.begin() + static_cast<std::ptrdiff_t>(ends_[f])}, threads);
        } catch (const Error& e) {
          throw e.in_file(files_[f]);
        }
        if (f == 0) features.conservativeResize(Eigen::NoChange, first + judged.features.cols());
        features.block(static_cast<Eigen::Index>(begin), first, judged.features.rows(), judged.features.cols()) = judged.features;
        begin = ends_[f];
      }
    }
    return features;
  }

  Map tsne_map(cli::Context& context, const Eigen::MatrixXd& features) {
    tsne_.seed = context.seed();
    tsne_.random_start = init_ == "random";
    tsne_.threads = context.threads();
    tsne_.progress = [&](int done) { context.progress(static_cast<std::size_t>(done), static_cast<std::size_t>(tsne_.iterations), "iterations"); };
    metrics::TsneMap found;
    try {
      found = metrics::tsne(features, tsne_);
    } catch (const Error& e) {
      throw e.in_file(fmt::format("{}", fmt::join(files_, ", ")));
    }
    log::info("t-SNE of {} clips with {} features: KL divergence {:.4f}, perplexity {:.4g}, learning rate {:.4g}", features.rows(), features.cols(), found.divergence, found.perplexity, found.learning_rate);
    return {found.points, "t-SNE", "t-SNE 1", "t-SNE 2"};
  }

  Map principal_map(const Eigen::MatrixXd& features) const {
    const std::string file = fmt::format("{}", fmt::join(files_, ", "));
    if (features.rows() < 3) refuse({file, 0, {}}, fmt::format("{} clips, expected at least 3 for a map", features.rows()));
    const auto pca = metrics::fit_pca(features, 2);
    const double whole = pca.variance.sum() / pca.kept;
    if (!(whole > 0)) refuse({file, 0, {}}, fmt::format("all {} clips have the same features, expected at least two that differ", features.rows()));
    const double first = 100 * pca.variance[0] / whole, second = 100 * pca.variance[1] / whole;
    log::info("principal axes of {} clips with {} features: {:.1f} % and {:.1f} % of the variance", features.rows(), features.cols(), first, second);
    const auto label = [](int axis, double share) { return fmt::format("principal axis {} ({:.1f} % of the variance)", axis, share); };
    return {metrics::project(pca, features), "Principal axes", label(1, first), label(2, second)};
  }

  std::vector<std::string> attribute_columns() const {
    std::set<std::string> names;
    for (const Clip& c : clips_)
      for (const auto& [key, value] : c.attributes)
        if (!value.empty()) names.insert(key);
    for (const auto& name : names) {
      const bool feature = name.size() > 1 && name[0] == 'f' && std::all_of(name.begin() + 1, name.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
      if (name == "clip" || (features_only_ ? feature : name == "kind" || name == "x" || name == "y"))
        refuse({files_.back(), 0, {}}, "an attribute '" + name + "', which the table has a column of its own for, expected another name");
    }
    return {names.begin(), names.end()};
  }

  std::string attribute_cells(const std::vector<std::string>& attributes, std::size_t i) const {
    std::string out;
    for (const auto& name : attributes) {
      const auto at = clips_[i].attributes.find(name);
      out += "\t" + (at == clips_[i].attributes.end() ? std::string() : cell(at->second));
    }
    return out;
  }

  std::string map_table(const std::vector<std::string>& attributes, const Eigen::MatrixXd& points) const {
    std::string out = "clip\tkind";
    for (const auto& name : attributes) out += "\t" + cell(name);
    out += "\tx\ty\n";
    for (std::size_t i = 0; i < clips_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      out += fmt::format("{}\t{}{}\t{}\t{}\n", cell(clips_[i].name), generated_[i] ? "generated" : "real", attribute_cells(attributes, i), points(row, 0), points(row, 1));
    }
    return out;
  }

  std::string feature_table(const std::vector<std::string>& attributes, const Eigen::MatrixXd& features) const {
    std::string out = "clip";
    for (const auto& name : attributes) out += "\t" + cell(name);
    for (Eigen::Index k = 0; k < features.cols(); ++k) out += fmt::format("\tf{}", k);
    out += "\n";
    for (std::size_t i = 0; i < clips_.size(); ++i) {
      out += cell(clips_[i].name) + attribute_cells(attributes, i);
      for (Eigen::Index k = 0; k < features.cols(); ++k) out += fmt::format("\t{}", features(static_cast<Eigen::Index>(i), k));
      out += "\n";
    }
    return out;
  }

  std::string picture(const Map& map, const std::vector<std::string>& groups, const std::vector<int>& group, draw::ImageFormat format, const std::string& history) {
    draw::Scatter plot;
    plot.title = title_;
    if (plot.title.empty()) {
      std::vector<std::string> names, judged;
      for (const auto& file : files_) names.push_back(base_name(file));
      for (const auto& judge : judges_) judged.push_back(judge->attribute());
      plot.title = fmt::format("{} of {} features: {}", map.name, fmt::join(judged, " and "), fmt::join(names.rbegin(), names.rend(), " against "));
    }
    plot.x_label = map.x_label;
    plot.y_label = map.y_label;
    plot.legend = fmt::format("{}", fmt::join(color_by_, " "));
    plot.circles = "real";
    plot.crosses = "generated";
    plot.groups = groups;
    for (const bool crosses : {false, true})  // crosses on top
      for (std::size_t i = 0; i < clips_.size(); ++i)
        if (generated_[i] == crosses) plot.points.push_back({map.points(static_cast<Eigen::Index>(i), 0), map.points(static_cast<Eigen::Index>(i), 1), group[i], crosses ? draw::Mark::cross : draw::Mark::circle});
    page_.height = std::max(200.0, std::round(0.7 * page_.width));
    return draw::scatter(plot, page_, format, history);
  }

  std::string real_, method_ = "tsne", init_ = "pca", table_, format_ = "auto", title_;
  std::vector<std::string> classifiers_, color_by_;
  bool features_only_ = false, own_colors_ = true;
  metrics::TsneOptions tsne_;
  draw::ScatterOptions page_;
  std::vector<Clip> clips_;  // of --real, then of INPUT
  std::vector<bool> generated_;
  std::vector<std::unique_ptr<classifier::Classifier>> judges_;
  std::vector<std::string> files_;
  std::vector<std::size_t> ends_;  // of each file, in clips_
  History history_;
  std::vector<HistoryInput> history_inputs_, classifier_inputs_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Embed>(argc, argv); }
