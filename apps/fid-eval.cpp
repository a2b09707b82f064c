// fid-eval - judge generated motion by a classifier's features, and by what the clips do.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/output_file.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/io/npz.hpp"
#include "libmocap/metrics/clip_figures.hpp"
#include "libmocap/metrics/frechet.hpp"
#include "libmocap/metrics/intervals.hpp"
#include "libmocap/metrics/sample_figures.hpp"
#include "libmodels/classifier/classifier.hpp"
#include "libmodels/nn/blas.hpp"

namespace {

using namespace mocap;
using metrics::Compat;
using metrics::Interval;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
using Rows = std::vector<std::size_t>;

// What one classifier says of a set, or what a file of features holds.
struct View {
  std::string attribute;
  std::vector<std::string> classes;
  Eigen::MatrixXd features, posteriors;  // posteriors may be empty
  std::vector<int> labels;               // -1: unlabelled; empty: none is labelled
};

struct Set {
  std::string role, path;  // "generated", "real", "train"
  std::vector<View> views;
  Eigen::MatrixXd features;               // of all views, side by side
  std::optional<metrics::Gaussian> given;  // statistics read in place of features
  std::vector<std::string> group;         // labels of all attributes of a clip, "" where one lacks
  std::vector<int> label;                 // index of the group in the list of classes, -1: none
  std::vector<Clip> clips;
  std::vector<metrics::ClipFigures> figures;
  History history;
  std::string sha256;
  std::size_t size() const { return static_cast<std::size_t>(features.rows()); }
};

Eigen::MatrixXd take(const Eigen::MatrixXd& x, const Rows& rows) {
  Eigen::MatrixXd out(static_cast<Eigen::Index>(rows.size()), x.cols());
  for (std::size_t i = 0; i < rows.size(); ++i) out.row(static_cast<Eigen::Index>(i)) = x.row(static_cast<Eigen::Index>(rows[i]));
  return out;
}
template <class T>
std::vector<T> take(const std::vector<T>& x, const Rows& rows) {
  std::vector<T> out;
  for (const std::size_t i : rows) out.push_back(x[i]);
  return out;
}
Rows all_rows(std::size_t n) {
  Rows rows(n);
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  return rows;
}
Rows shuffled(std::size_t n, std::uint64_t seed, std::uint64_t stream) {
  Rows rows = all_rows(n);
  Random random(seed, stream);
  for (std::size_t i = n; i-- > 1;) std::swap(rows[i], rows[random.below(i + 1)]);
  return rows;
}

Eigen::MatrixXd matrix(const io::Npz& npz, const std::string& name, const std::string& path) {
  const auto& array = npz.at(name);
  if (array.shape.size() != 2) refuse({path, 0, name}, fmt::format("an array of {} dimensions, expected [N,d]", array.shape.size()));
  Eigen::MatrixXd out(static_cast<Eigen::Index>(array.shape[0]), static_cast<Eigen::Index>(array.shape[1]));
  const auto fill = [&](const auto& values) {
    for (Eigen::Index i = 0; i < out.rows(); ++i)
      for (Eigen::Index j = 0; j < out.cols(); ++j) out(i, j) = static_cast<double>(values[static_cast<std::size_t>(i * out.cols() + j)]);
  };
  if (const auto* d = std::get_if<std::vector<double>>(&array.data)) fill(*d);
  else if (const auto* k = std::get_if<std::vector<std::int64_t>>(&array.data)) fill(*k);
  else refuse({path, 0, name}, "an array of texts, expected numbers");
  return out;
}

// A table as embed writes it: columns f0, f1, ... are the features, the others are passed over.
io::Npz read_table(const std::string& text) {
  std::vector<std::size_t> columns;
  std::vector<double> values;
  std::size_t rows = 0;
  long number = 0;
  for (std::size_t begin = 0; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::vector<std::string> cells(1);
    for (const char c : text.substr(begin, end - begin))
      if (c == '\t') cells.emplace_back();
      else if (c != '\r') cells.back() += c;
    begin = end + 1;
    if (number == 0) {
      for (std::size_t i = 0; i < cells.size(); ++i)
        if (cells[i] == "f" + std::to_string(columns.size())) columns.push_back(i);
      if (columns.empty()) refuse({{}, 1, {}}, "neither an npz file nor a table with the columns f0, f1, ..., expected one of them");
      continue;
    }
    if (cells.size() == 1 && cells[0].empty()) continue;
    for (const std::size_t i : columns) {
      const auto value = i < cells.size() ? cli::parse_number(cells[i]) : std::nullopt;
      if (!value) refuse({{}, number + 1, {}}, fmt::format("'{}' in column {}, expected a number", i < cells.size() ? cells[i] : "", i + 1));
      values.push_back(*value);
    }
    ++rows;
  }
  return {{"features", {{rows, columns.size()}, values}}};
}

// features [N,d]; posteriors [N,C], labels [N] (numbers, or names out of classes [C]), classes as far as they are there; or mu and sigma.
Set read_features(const std::string& role, const std::string& path) {
  Set set;
  set.role = role;
  set.path = path == "-" ? "<stdin>" : path;
  io::Npz npz;
  try {
    const std::string bytes = read_file(path);
    npz = bytes.starts_with("PK") ? io::parse_npz(bytes) : read_table(bytes);
  } catch (const Error& e) {
    throw e.in_file(set.path);
  }
  if (!npz.contains("features") && npz.contains("mu") && npz.contains("sigma")) {
    if (role != "real") refuse({set.path, 0, {}}, "statistics (mu, sigma), expected features", "statistics can stand for the real clips only");
    auto& mu = npz["mu"];
    mu.shape = {1, std::accumulate(mu.shape.begin(), mu.shape.end(), std::size_t{1}, std::multiplies<>())};
    set.given = metrics::Gaussian{matrix(npz, "mu", set.path).row(0).transpose(), matrix(npz, "sigma", set.path), 0};
    return set;
  }
  if (!npz.contains("features")) refuse({set.path, 0, {}}, "no array 'features', expected features [N,d]");
  View view;
  view.attribute = "class";
  view.features = matrix(npz, "features", set.path);
  const auto n = static_cast<std::size_t>(view.features.rows());
  if (npz.contains("classes")) {
    if (const auto* names = std::get_if<std::vector<std::string>>(&npz["classes"].data)) view.classes = *names;
    else refuse({set.path, 0, "classes"}, "an array of numbers, expected names");
  }
  if (npz.contains("posteriors")) {
    view.posteriors = matrix(npz, "posteriors", set.path);
    if (static_cast<std::size_t>(view.posteriors.rows()) != n) refuse({set.path, 0, "posteriors"}, fmt::format("{} rows, expected {} as in features", view.posteriors.rows(), n));
    for (auto c = view.classes.size(); c < static_cast<std::size_t>(view.posteriors.cols()); ++c) view.classes.push_back(std::to_string(c));
  }
  if (npz.contains("labels")) {
    const auto& data = npz["labels"].data;
    if (const auto* names = std::get_if<std::vector<std::string>>(&data)) {
      if (view.classes.empty()) view.classes = [&] { const std::set<std::string> unique(names->begin(), names->end()); return std::vector<std::string>(unique.begin(), unique.end()); }();
      for (const auto& name : *names) {
        const auto at = std::find(view.classes.begin(), view.classes.end(), name);
        if (at == view.classes.end() && !name.empty()) refuse({set.path, 0, "labels"}, "class '" + name + "', expected one of " + fmt::format("{}", fmt::join(view.classes, ", ")));
        view.labels.push_back(name.empty() ? -1 : static_cast<int>(at - view.classes.begin()));
      }
    } else if (const auto* numbers = std::get_if<std::vector<std::int64_t>>(&data)) {
      const std::int64_t most = numbers->empty() ? 0 : *std::max_element(numbers->begin(), numbers->end());
      if (!view.classes.empty() ? most >= static_cast<std::int64_t>(view.classes.size()) : most > 100000)
        refuse({set.path, 0, "labels"}, fmt::format("class {}, expected one of {} classes", most, view.classes.size()));
      for (auto c = static_cast<std::int64_t>(view.classes.size()); c <= most; ++c) view.classes.push_back(std::to_string(c));
      for (const auto v : *numbers) view.labels.push_back(v < 0 ? -1 : static_cast<int>(v));
    } else {
      refuse({set.path, 0, "labels"}, "fractions, expected whole numbers or names");
    }
    if (view.labels.size() != n) refuse({set.path, 0, "labels"}, fmt::format("{} labels, expected {} as features has rows", view.labels.size(), n));
  }
  set.views.push_back(std::move(view));
  return set;
}

Set read_clips(const std::string& role, const std::string& path, const std::string& label) {
  Set set;
  set.role = role;
  set.path = path == "-" ? "<stdin>" : path;
  const auto input = formats::open_motion(path, label);
  for (std::size_t i = 0; i < input->size(); ++i) set.clips.push_back(input->read(i));
  if (set.clips.empty()) refuse({set.path, 0, {}}, "0 clips, expected at least one");
  set.history = input->history();
  set.sha256 = input->sha256();
  return set;
}

struct Row {
  std::string name;
  Interval interval;
};

class FidEval final : public cli::Tool {
 public:
  std::string name() const override { return "fid-eval"; }
  std::string synopsis() const override { return "Judge generated motion: FID, IS and the field's other figures, with intervals and a real-against-real floor"; }
  std::string description() const override {
    return "Real and generated clips are cut to the same lengths (per class, by rank of length), judged by each classifier, and compared: the Frechet distance of its last features "
           "(of several classifiers side by side) in double precision; the inception score over the joint posterior of the attributes, and of each; KID; precision and recall; accuracy; "
           "diversity; variance within a class; multimodality. Of the clips themselves: feet that slide, penetration, jerk, energy, how many freeze or explode and which, and "
           "with --train the distance to the nearest training clip. Rows that end in .real are the real clips' own; fid.floor_halves is the distance between disjoint "
           "halves of the real clips, fid.floor_train that of real against training clips: no generator is better than that. Intervals cover 95 %: Student's t over --repeats "
           "parts of the generated clips, otherwise the bootstrap over generated clips or, for shares, Wilson's; a dash where there is none. Refused: what would give a figure that lies (no more clips "
           "than features, a classifier that saw the real clips or trained the generator, test clips in the training set, unequal rates or bodies, an empty class).";
  }
  std::vector<cli::Example> examples() const override {
    return {{"fid-eval samples.h5 --real test.h5 --train train.h5 --classifier action.h5 --classifier gender.h5", "all figures, as a table"},
            {"sample -m model.h5 -n 400 -o - | fid-eval - --real test.h5 --classifier action.h5 --json", "from a pipe, as JSON"},
            {"fid-eval samples.npz --features --real test.npz --compat pytorch-fid", "features made elsewhere, by another program's formula"}};
  }
  std::vector<std::string> references() const override {
    return {"Ghorbani et al. 2020, section 5.2, eq. 27 to 29", "Heusel et al. 2017 (FID)", "Salimans et al. 2016 (IS)", "Binkowski et al. 2018 (KID)", "Kynkaanniemi et al. 2019 (precision and recall)"};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::none;
    t.report = true;
    t.random = true;
    t.network = true;
    t.input_help = "generated motion (archive or motion file; '-' for standard input), or an npz file of features with --features";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  void options(CLI::App& app) override {
    app.add_option("--real", real_, "real motion that was not trained on; with --features an npz file, also one of statistics (mu, sigma)")->required()->check(cli::path());
    app.add_option("--train", train_, "what the generator was trained on")->check(cli::path());
    app.add_option("--classifier", classifiers_, "classifier of one attribute, trained on other clips (repeatable; none: only the figures that need none)")->check(cli::path());
    app.add_flag("--features", features_, "inputs are npz files: features [N,d] and, as far as there, posteriors [N,C], labels [N], classes [C]; or tables with columns f0, f1, ...");
    app.add_option("--frames", frames_, "cut clips to at most so many frames (0: no limit)")->check(cli::whole(0, 1000000, "FRAMES"))->capture_default_str();
    app.add_option("--repeats", repeats_, "deal the generated clips into so many parts, each a repeat")->check(cli::whole(1, 1000, "N"))->capture_default_str();
    app.add_option("--resamples", resamples_, "resamples of the bootstrap (0: none)")->check(cli::whole(0, 100000, "N"))->capture_default_str();
    app.add_option("--splits", splits_, "parts that the inception score is averaged over")->check(cli::whole(1, 1000, "N"))->capture_default_str();
    app.add_option("--pca", pca_, "compare so many principal axes of the training clips' features (0: the features)")->check(cli::whole(0, 100000, "K"))->capture_default_str();
    app.add_option("--window", neighbours_.window, "frames of a window in the nearest-clip search")->check(cli::whole(2, 100000, "FRAMES"))->capture_default_str();
    app.add_option("--compat", compat_, "figures by the formula of another program")->check(cli::one_of({"none", "pytorch-fid", "clean-fid", "torch-fidelity", "a2m", "actor"}))->capture_default_str();
    app.add_option("--stats-cache", cache_, "write mean and covariance of the real features as pytorch-fid reads them (mu, sigma); a file that is there must hold the same")->check(cli::path("FILE.npz"));
    app.add_option("--format", format_, "form of the report")->check(cli::one_of({"text", "tsv", "json", "latex"}))->capture_default_str();
  }
  std::vector<std::string> non_content_options() const override { return {"--stats-cache"}; }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    threads_ = context.threads();
    seed_ = context.seed();
    formula_ = metrics::parse_compat(compat_);
    if (context.common().json) format_ = "json";
    if (features_ && !classifiers_.empty()) refuse_usage("--features and --classifier, expected one of them");
    if (pca_ > 0 && train_.empty()) refuse_usage("--pca without --train, expected the training clips that the axes are fitted on");
    const cli::InputFile& input = context.inputs().at(0);
    if ((input.path == "-") + (real_ == "-") + (train_ == "-") > 1) refuse_usage("standard input given twice, expected '-' once");
    if (features_) {
      generated_ = read_features("generated", input.path);
      real_set_ = read_features("real", real_);
      if (!train_.empty()) train_set_ = read_features("train", train_);
      for (Set* set : sets()) side_by_side(*set);
    } else {
      generated_ = read_clips("generated", input.path, input.label);
      real_set_ = read_clips("real", real_, real_);
      if (!train_.empty()) train_set_ = read_clips("train", train_, train_);
      prepare_clips();
    }
    if (pca_ > 0) reduce();
    group();
    deal();
    if (generated_.size() > 0) feature_figures();
    if (!features_) clip_rows();
    print(context);
    return Exit::ok;
  }

 private:
  std::vector<Set*> sets() {
    std::vector<Set*> out = {&generated_, &real_set_};
    if (!train_.empty()) out.push_back(&train_set_);
    return out;
  }

  static void side_by_side(Set& set) {
    if (set.views.empty()) return;
    Eigen::Index columns = 0;
    for (const View& v : set.views) columns += v.features.cols();
    set.features.resize(set.views[0].features.rows(), columns);
    Eigen::Index at = 0;
    for (const View& v : set.views) {
      set.features.middleCols(at, v.features.cols()) = v.features;
      at += v.features.cols();
    }
    for (Eigen::Index j = 0; j < columns; ++j)
      for (Eigen::Index i = 0; i < set.features.rows(); ++i)
        if (!std::isfinite(set.features(i, j))) refuse({set.path, 0, "features"}, fmt::format("row {}, column {} is not finite, expected finite numbers", i + 1, j + 1));
  }

  void prepare_clips() {
    const Clip& like = real_set_.clips[0];
    for (const Set* set : sets())
      for (const Clip& c : set->clips) {
        if (std::abs(c.frame_rate_hz - like.frame_rate_hz) > 1e-6 * like.frame_rate_hz)
          refuse({set->path, 0, "clip " + c.name}, fmt::format("{} Hz, expected {} Hz as in {}", c.frame_rate_hz, like.frame_rate_hz, real_set_.path), "canonicalize brings clips to one rate (--fps)");
        if (!c.skeleton->same_as(*like.skeleton, 1e-5)) refuse({set->path, 0, "clip " + c.name}, "another skeleton, expected that of " + real_set_.path, "canonicalize brings clips onto one body");
      }
    std::set<std::string> real_sources;
    for (const Clip& c : real_set_.clips)
      if (!c.source.sha256.empty()) real_sources.insert(c.source.sha256);
    for (const Clip& c : train_set_.clips)
      if (real_sources.contains(c.source.sha256))
        refuse({train_set_.path, 0, "clip " + c.name}, "made of " + c.source.path + ", of which there are clips in " + real_set_.path + " too, expected no source in both", "motion-split keeps sources apart");
    for (const auto& entry : generated_.history)
      for (const auto& used : entry.inputs)
        if (used.sha256 == real_set_.sha256) log::warn("{} was made with {} ({}): its clips are no test", generated_.path, real_set_.path, entry.tool);

    for (const auto& path : classifiers_) {
      std::string digest;
      auto judge = classifier::Classifier::load(path, &digest);
      for (const auto& entry : generated_.history)
        if (entry.tool.starts_with("train-"))
          for (const auto& used : entry.inputs)
            if (used.sha256 == digest) refuse({path, 0, {}}, "this classifier took part in training the generator (" + entry.tool + "), expected one that did not", "train one on other clips: a generator pleases its own");
      for (const Clip& c : real_set_.clips)
        if (judge->train_sources().contains(c.source.sha256) && !c.source.sha256.empty())
          refuse({path, 0, {}}, "this classifier was trained on " + c.source.path + ", of which there are clips in " + real_set_.path + ", expected real clips it never saw");
      for (const Set* set : sets()) {
        const Clip& c = set->clips[0];
        if (std::abs(judge->frame_rate_hz() - c.frame_rate_hz) > 1e-6 * c.frame_rate_hz) refuse({path, 0, {}}, fmt::format("a classifier for {} Hz, expected {} Hz as in {}", judge->frame_rate_hz(), c.frame_rate_hz, set->path));
      }
      judges_.push_back(std::move(judge));
    }
    for (Set* set : sets()) {
      for (const auto& judge : judges_) {
        View view;
        view.attribute = judge->attribute();
        view.classes = judge->classes();
        if (view.classes.size() < 2) refuse({set->path, 0, {}}, fmt::format("a classifier of {} class of {}, expected at least two", view.classes.size(), view.attribute));
        for (const Clip& c : set->clips) {
          const auto label = c.attributes.find(view.attribute);
          if (label == c.attributes.end() || label->second.empty()) {
            view.labels.push_back(-1);
            continue;
          }
          const auto at = std::find(view.classes.begin(), view.classes.end(), label->second);
          if (at == view.classes.end())
            refuse({set->path, 0, "clip " + c.name}, fmt::format("{} '{}', expected one of the classifier's: {}", view.attribute, label->second, fmt::join(view.classes, ", ")));
          view.labels.push_back(static_cast<int>(at - view.classes.begin()));
        }
        set->views.push_back(std::move(view));
      }
    }
    cut_clips();
    for (Set* set : sets()) {
      for (std::size_t v = 0; v < judges_.size(); ++v) {
        classifier::Judged judged;
        try {
          judged = judges_[v]->judge(set->clips, threads_);
        } catch (const Error& e) {
          throw e.in_file(set->path);
        }
        set->views[v].features = std::move(judged.features);
        set->views[v].posteriors = std::move(judged.posteriors);
      }
      side_by_side(*set);
    }
  }

  static std::string label_of(const Set& set, std::size_t i) {
    std::string out;
    for (const View& v : set.views) {
      const int label = v.labels.empty() ? -1 : v.labels[i];
      if (label < 0) return {};
      out += (out.empty() ? "" : " ") + v.classes[static_cast<std::size_t>(label)];
    }
    return out;
  }

  // Class by class, so that a class of short clips is not compared with its long ones; training clips take the real clips' lengths.
  void cut_clips() {
    const auto limit = static_cast<std::size_t>(frames_);
    const auto lengths = [](const Set& set, const Rows& rows) {
      std::vector<std::size_t> out;
      for (const std::size_t i : rows) out.push_back(set.clips[i].frames());
      return out;
    };
    const auto by_class = [](const Set& set) {
      std::map<std::string, Rows> out;
      for (std::size_t i = 0; i < set.clips.size(); ++i) out[label_of(set, i)].push_back(i);
      return out;
    };
    const auto shorten = [](Set& set, const Rows& rows, const std::vector<std::size_t>& to) {
      for (std::size_t k = 0; k < rows.size(); ++k)
        if (to[k] < set.clips[rows[k]].frames()) set.clips[rows[k]] = cut(set.clips[rows[k]], 0, to[k]);
    };
    const auto g = by_class(generated_), r = by_class(real_set_), t = by_class(train_set_);
    for (const auto& [label, rows] : r) {
      const Rows other = g.contains(label) ? g.at(label) : Rows{};
      const auto [mine, theirs] = metrics::common_lengths(lengths(generated_, other), lengths(real_set_, rows), limit);
      shorten(generated_, other, mine);
      shorten(real_set_, rows, theirs);
      if (t.contains(label)) shorten(train_set_, t.at(label), metrics::common_lengths(lengths(train_set_, t.at(label)), lengths(real_set_, rows), limit).first);
    }
  }

  void reduce() {
    const auto pca = metrics::fit_pca(train_set_.features, pca_);
    log::info("{} principal axes keep {:.1f} % of the variance of the training clips' {} features", pca_, 100 * pca.kept, train_set_.features.cols());
    if (real_set_.given) refuse({real_set_.path, 0, {}}, "statistics (mu, sigma) with --pca, expected features");
    for (Set* set : sets()) set->features = metrics::project(pca, set->features);
  }

  // The list of classes over all attributes, and each clip's place in it.
  void group() {
    std::set<std::string> names;
    for (Set* set : sets()) {
      set->group.resize(set->size());
      if (!set->views.empty())
        for (std::size_t i = 0; i < set->size(); ++i) set->group[i] = label_of(*set, i);
      if (set != &train_set_) names.insert(set->group.begin(), set->group.end());
    }
    names.erase("");
    classes_.assign(names.begin(), names.end());
    for (Set* set : sets())
      for (const auto& g : set->group) set->label.push_back(g.empty() || !names.contains(g) ? -1 : static_cast<int>(std::lower_bound(classes_.begin(), classes_.end(), g) - classes_.begin()));
    const auto labelled = [](const Set& set) { return std::any_of(set.label.begin(), set.label.end(), [](int l) { return l >= 0; }); };
    by_class_ = !classes_.empty() && labelled(generated_);
    real_by_class_ = by_class_ && labelled(real_set_);
    if (real_by_class_)
      for (const Set* set : {&generated_, &real_set_})
        for (std::size_t c = 0; c < classes_.size(); ++c)
          if (const auto n = std::count(set->label.begin(), set->label.end(), static_cast<int>(c)); n < 2)
            refuse({set->path, 0, {}}, fmt::format("class {} has {} clips, expected at least two in the generated and the real ones", classes_[c], n), "motion-select takes the classes that both have");
  }

  // Rows of each repeat: class by class, so that all repeats have all classes.
  void deal() {
    const std::size_t n = features_ || !classifiers_.empty() ? generated_.size() : generated_.clips.size();
    if (repeats_ == 1) {
      parts_ = {all_rows(n)};
      return;
    }
    Rows order = shuffled(n, seed_, 0xdea1);
    if (!generated_.label.empty()) std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return generated_.label[a] < generated_.label[b]; });
    parts_.assign(static_cast<std::size_t>(repeats_), {});
    for (std::size_t i = 0; i < n; ++i) parts_[i % parts_.size()].push_back(order[i]);
    for (const Rows& part : parts_)
      if (part.size() < 2) refuse({generated_.path, 0, {}}, fmt::format("{} clips for {} repeats, expected at least two for each", n, repeats_));
  }

  void add(const std::string& name, const Interval& interval) { rows_.push_back({name, interval}); }
  void add_value(const std::string& name, double value, std::size_t n) { add(name, {value, kNaN, kNaN, static_cast<long>(n)}); }
  // A figure of the generated clips: over the repeats, or once with the interval that `spread` finds.
  void figure(const std::string& name, const std::function<double(const Rows&)>& of, const std::function<Interval(double)>& spread = {}) {
    if (parts_.size() > 1) {
      std::vector<double> values;
      for (const Rows& part : parts_) values.push_back(of(part));
      return add(name, metrics::t_interval(values));
    }
    const double value = of(parts_[0]);
    if (spread && std::isfinite(value)) return add(name, spread(value));
    add_value(name, value, parts_[0].size());
  }

  double frechet(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) const {
    if (formula_ != Compat::none) return metrics::frechet_distance_compat(a, b, formula_);
    return metrics::frechet_distance(a, b, threads_);
  }

  void feature_figures() {
    if (generated_.features.cols() == 0) return;
    const Eigen::MatrixXd& x = generated_.features;
    const Eigen::MatrixXd& y = real_set_.features;
    const auto whole = [&](const Eigen::MatrixXd& features, const std::string& name, bool intervals) {
      const Eigen::MatrixXd& mine = features;
      const Eigen::MatrixXd& theirs = name.empty() ? y : view_of(real_set_, name).features;
      try {
        std::optional<metrics::Gaussian> reference;
        if (real_set_.given) reference = real_set_.given;
        else if (formula_ == Compat::none) reference = metrics::gaussian(theirs, real_set_.path);
        figure(
            name.empty() ? "fid" : "fid." + name,
            [&](const Rows& rows) {
              const Eigen::MatrixXd part = rows.size() == static_cast<std::size_t>(mine.rows()) ? mine : take(mine, rows);
              return formula_ == Compat::none || real_set_.given ? metrics::frechet_distance(metrics::gaussian(part, generated_.path), *reference) : frechet(part, theirs);
            },
            !intervals || resamples_ < 2 || !reference ? std::function<Interval(double)>() : [&](double value) {
              Interval i = metrics::bootstrap_interval(
                  static_cast<std::size_t>(mine.rows()), value, [&](const std::vector<int>& counts) { return metrics::frechet_distance(metrics::gaussian(mine, counts), *reference); }, resamples_, 0.95, seed_, threads_);
              i.low = std::max(0.0, i.low);
              return i;
            });
      } catch (const Error& e) {
        throw e.in_file(generated_.path);
      }
    };
    whole(x, "", true);
    if (generated_.views.size() > 1 && pca_ == 0)
      for (const View& v : generated_.views) whole(v.features, v.attribute, false);
    if (!real_set_.given) floors();
    cache();
    scores();
    if (!real_set_.given) {
      metrics::KidOptions o;
      o.seed = formula_ == Compat::torch_fidelity ? 2020 : seed_;
      o.numpy_draws = formula_ == Compat::torch_fidelity;
      o.threads = threads_;
      figure("kid", [&](const Rows& rows) { return metrics::kid(take(x, rows), y, o).mean; });
      const Rows order = shuffled(real_set_.size(), seed_, 0xf100);
      const auto half = static_cast<std::ptrdiff_t>(order.size() / 2);
      if (half > 1) add_value("kid.floor_halves", metrics::kid(take(y, Rows(order.begin(), order.begin() + half)), take(y, Rows(order.begin() + half, order.end())), o).mean, static_cast<std::size_t>(half));
      const std::size_t n = real_set_.size();
      if (std::min(x.rows(), y.rows()) > 3) {
        std::vector<metrics::PrecisionRecall> pr;
        for (const Rows& part : parts_) pr.push_back(metrics::precision_recall(take(x, part), y, 3, threads_));
        std::size_t k = 0;
        figure("precision", [&](const Rows&) { return pr[k++].precision; }, [&](double v) { return metrics::share_interval(v, static_cast<long>(x.rows())); });
        k = 0;
        figure("recall", [&](const Rows&) { return pr[k++].recall; }, [&](double v) { return metrics::share_interval(v, static_cast<long>(n)); });
      }
    }
    const bool a2m = formula_ == Compat::a2m || formula_ == Compat::actor;
    const auto diversity = [&](const Eigen::MatrixXd& f) { return a2m ? metrics::diversity_a2m(f, 200, static_cast<std::uint32_t>(seed_)) : metrics::diversity(f, 200, seed_); };
    figure("diversity", [&](const Rows& rows) { return diversity(take(x, rows)); });
    if (y.rows() > 1) add_value("diversity.real", diversity(y), real_set_.size());
    if (!by_class_) return;
    const auto modes = [&](const Eigen::MatrixXd& f, const std::vector<int>& labels) {
      return a2m ? metrics::multimodality_a2m(f, labels, classes_, 20, static_cast<std::uint32_t>(seed_)) : metrics::multimodality(f, labels, classes_, 20, seed_);
    };
    try {
      figure("within_class_variance", [&](const Rows& rows) { return metrics::within_class_variance(take(x, rows), take(generated_.label, rows), classes_); });
      if (real_by_class_) add_value("within_class_variance.real", metrics::within_class_variance(y, real_set_.label, classes_), real_set_.size());
      figure("multimodality", [&](const Rows& rows) { return modes(take(x, rows), take(generated_.label, rows)); });
      if (real_by_class_) add_value("multimodality.real", modes(y, real_set_.label), real_set_.size());
    } catch (const Error& e) {
      throw e.in_file(generated_.path);
    }
  }

  static const View& view_of(const Set& set, const std::string& attribute) {
    return *std::find_if(set.views.begin(), set.views.end(), [&](const View& v) { return v.attribute == attribute; });
  }

  void floors() {
    const Eigen::MatrixXd& y = real_set_.features;
    const Rows order = shuffled(real_set_.size(), seed_, 0xf100);
    const auto half = static_cast<std::ptrdiff_t>(order.size() / 2);
    const auto d = y.cols();
    double value = kNaN;
    if (half > d || (formula_ != Compat::none && half > 1))
      value = frechet(take(y, Rows(order.begin(), order.begin() + half)), take(y, Rows(order.begin() + half, order.end())));
    else
      log::warn("{}: halves of {} clips with {} features: no floor of halves, which takes more clips than features (--pca K --train gives fewer)", real_set_.path, half, d);
    add_value("fid.floor_halves", value, static_cast<std::size_t>(half));
    if (!train_.empty()) {
      value = kNaN;
      if (train_set_.features.rows() > d || formula_ != Compat::none)
        value = frechet(train_set_.features, y);
      else
        log::warn("{}: {} clips with {} features: no floor of training clips, which takes more clips than features", train_set_.path, train_set_.features.rows(), d);
      add_value("fid.floor_train", value, train_set_.size());
    }
  }

  void cache() {
    if (cache_.empty()) return;
    if (real_set_.given) refuse_usage("--stats-cache with statistics as --real, expected features");
    const metrics::Gaussian g = metrics::gaussian(real_set_.features, real_set_.path);
    const auto d = static_cast<std::size_t>(g.mean.size());
    if (std::filesystem::exists(cache_)) {
      const Set there = read_features("real", cache_);
      const bool same = there.given && there.given->mean.size() == g.mean.size() && there.given->covariance.rows() == g.covariance.rows() &&
                        (there.given->mean - g.mean).norm() <= 1e-9 * (1 + g.mean.norm()) && (there.given->covariance - g.covariance).norm() <= 1e-9 * (1 + g.covariance.norm());
      if (!same) refuse({cache_, 0, {}}, "statistics of other clips, expected those of " + real_set_.path, "remove the file to have it written again");
      return;
    }
    io::Npz npz;
    npz["mu"] = {{d}, std::vector<double>(g.mean.data(), g.mean.data() + d)};
    npz["sigma"] = {{d, d}, std::vector<double>(g.covariance.data(), g.covariance.data() + d * d)};
    write_file(cache_, io::format_npz(npz), Overwrite::refuse);
  }

  void scores() {
    const auto with_posteriors = [](const Set& set) { return !set.views.empty() && std::all_of(set.views.begin(), set.views.end(), [](const View& v) { return v.posteriors.size() > 0; }); };
    if (!with_posteriors(generated_)) return;
    const auto score = [&](const Eigen::MatrixXd& p) {
      return formula_ == Compat::torch_fidelity ? metrics::inception_score_torch_fidelity(p).mean : metrics::inception_score(p, splits_, seed_).mean;
    };
    const auto one = [&](const std::string& name, const Eigen::MatrixXd& p, const std::optional<Eigen::MatrixXd>& real) {
      try {
        figure(
            name, [&](const Rows& rows) { return score(take(p, rows)); },
            resamples_ < 2 || splits_ > 1 || formula_ == Compat::torch_fidelity ? std::function<Interval(double)>() : [&](double value) {
              return metrics::bootstrap_interval(
                  static_cast<std::size_t>(p.rows()), value,
                  [&](const std::vector<int>& counts) {
                    Rows rows;
                    for (std::size_t i = 0; i < counts.size(); ++i) rows.insert(rows.end(), static_cast<std::size_t>(counts[i]), i);
                    return metrics::inception_score(take(p, rows)).mean;
                  },
                  resamples_, 0.95, seed_, threads_);
            });
        add_value(name + ".bound", metrics::inception_bound(static_cast<long>(p.cols()), static_cast<long>(parts_[0].size())), parts_[0].size());
        if (real) add_value(name + ".real", score(*real), static_cast<std::size_t>(real->rows()));
      } catch (const Error& e) {
        throw e.in_file(generated_.path);
      }
    };
    const bool real = with_posteriors(real_set_);
    const auto joint = [](const Set& set) {
      std::vector<Eigen::MatrixXd> p;
      for (const View& v : set.views) p.push_back(v.posteriors);
      return metrics::joint_posteriors(p);
    };
    one("is", joint(generated_), real ? std::optional(joint(real_set_)) : std::nullopt);
    for (std::size_t v = 0; v < generated_.views.size(); ++v) {
      const View& mine = generated_.views[v];
      if (generated_.views.size() > 1) one("is." + mine.attribute, mine.posteriors, real ? std::optional(real_set_.views[v].posteriors) : std::nullopt);
      const auto labelled = [](const std::vector<int>& labels) { return std::count_if(labels.begin(), labels.end(), [](int l) { return l >= 0; }); };
      if (const auto n = labelled(mine.labels); n > 0)
        figure("accuracy." + mine.attribute, [&](const Rows& rows) { return metrics::accuracy(take(mine.posteriors, rows), take(mine.labels, rows)); }, [&](double share) { return metrics::share_interval(share, n); });
      if (real && labelled(real_set_.views[v].labels) > 0) {
        long n = 0;
        const double share = metrics::accuracy(real_set_.views[v].posteriors, real_set_.views[v].labels, &n);
        add("accuracy." + mine.attribute + ".real", metrics::share_interval(share, n));
      }
    }
  }

  void clip_rows() {
    for (Set* set : {&generated_, &real_set_}) {
      try {
        set->figures = metrics::clip_figures(set->clips, threads_);
      } catch (const Error& e) {
        throw e.in_file(set->path);
      }
    }
    const auto mean = [](const std::vector<double>& values) {
      double sum = 0, n = 0;
      for (const double v : values)
        if (std::isfinite(v)) sum += v, ++n;
      return n > 0 ? sum / n : kNaN;
    };
    const auto both = [&](const std::string& name, const std::vector<double>& mine, const std::vector<double>& theirs) {
      const auto spread = [&](std::vector<double> values) {
        std::erase_if(values, [](double v) { return !std::isfinite(v); });
        if (values.empty()) return Interval{kNaN, kNaN, kNaN, 0};
        return resamples_ < 2 ? Interval{mean(values), kNaN, kNaN, static_cast<long>(values.size())} : metrics::bootstrap_mean(values, resamples_, 0.95, seed_);
      };
      figure(name, [&](const Rows& rows) { return mean(take(mine, rows)); }, [&](double) { return spread(mine); });
      add(name + ".real", spread(theirs));
    };
    const auto column = [](const Set& set, double metrics::ClipFigures::* of) {
      std::vector<double> out;
      for (const auto& f : set.figures) out.push_back(f.*of);
      return out;
    };
    for (const auto& [name, of] : {std::pair{"skate_mps", &metrics::ClipFigures::skate_mps}, {"skate_gmd", &metrics::ClipFigures::skate_gmd}, {"penetration_m", &metrics::ClipFigures::penetration_m},
                                   {"jerk", &metrics::ClipFigures::jerk}, {"energy", &metrics::ClipFigures::energy}})
      both(name, column(generated_, of), column(real_set_, of));

    // The real mean energy of each class; of all clips for those without one.
    std::map<std::string, std::pair<double, double>> energy;
    const auto label = [](const Set& set, std::size_t i) { return set.views.empty() ? std::string() : label_of(set, i); };
    for (std::size_t i = 0; i < real_set_.clips.size(); ++i)
      if (std::isfinite(real_set_.figures[i].energy))
        for (const std::string& key : std::set<std::string>{label(real_set_, i), ""}) {
          energy[key].first += real_set_.figures[i].energy;
          energy[key].second += 1;
        }
    for (Set* set : {&generated_, &real_set_}) {
      std::vector<double> frozen, exploding;
      for (std::size_t i = 0; i < set->clips.size(); ++i) {
        const std::string key = energy.contains(label(*set, i)) ? label(*set, i) : "";
        const auto found = energy.empty() ? metrics::Liveliness::alive : metrics::liveliness(set->figures[i], energy[key].first / energy[key].second);
        frozen.push_back(found == metrics::Liveliness::frozen);
        exploding.push_back(found == metrics::Liveliness::exploding);
        if (set == &generated_ && frozen.back() > 0) frozen_.push_back(set->clips[i].name);
        if (set == &generated_ && exploding.back() > 0) exploding_.push_back(set->clips[i].name);
      }
      for (const auto& [name, values] : {std::pair{"frozen_share", &frozen}, {"exploding_share", &exploding}}) {
        const long n = static_cast<long>(values->size());
        if (set == &generated_) figure(name, [&, v = values](const Rows& rows) { return mean(take(*v, rows)); }, [&](double share) { return metrics::share_interval(share, n); });
        else add(std::string(name) + ".real", metrics::share_interval(mean(*values), n));
      }
    }
    if (train_.empty()) return;
    neighbours_.threads = threads_;
    const auto distances = [&](const Set& set) {
      std::vector<double> out(set.clips.size(), kNaN);
      for (const auto& n : metrics::nearest_training_clips(set.clips, train_set_.clips, neighbours_)) out[n.clip] = n.distance;
      return out;
    };
    both("nearest_training", distances(generated_), distances(real_set_));
  }

  void print(cli::Context& context) const {
    const auto text = [](double v) { return std::isfinite(v) ? fmt::format("{:.6g}", v) : std::string("-"); };
    const auto columns = [&](const Row& r) { return std::array{r.name, text(r.interval.value), text(r.interval.low), text(r.interval.high), std::to_string(r.interval.n)}; };
    std::string out;
    if (format_ == "json") {
      nlohmann::ordered_json document;
      const auto number = [](double v) { return std::isfinite(v) ? nlohmann::ordered_json(v) : nlohmann::ordered_json(nullptr); };
      document["compat"] = compat_;
      for (const Row& r : rows_) {
        document[r.name + ".value"] = number(r.interval.value);
        document[r.name + ".low"] = number(r.interval.low);
        document[r.name + ".high"] = number(r.interval.high);
        document[r.name + ".n"] = r.interval.n;
      }
      document["frozen"] = frozen_;
      document["exploding"] = exploding_;
      out = document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    } else if (format_ == "tsv") {
      out = "figure\tvalue\tlow\thigh\tn\n";
      for (const Row& r : rows_) out += fmt::format("{}\n", fmt::join(columns(r), "\t"));
    } else if (format_ == "latex") {
      out = "\\begin{tabular}{lrrrr}\n\\hline\nfigure & value & low & high & n \\\\\n\\hline\n";
      for (const Row& r : rows_) {
        std::string line = fmt::format("{} \\\\\n", fmt::join(columns(r), " & "));
        for (std::size_t at = 0; (at = line.find('_', at)) != std::string::npos; at += 2) line.insert(at, "\\");
        out += line;
      }
      out += "\\hline\n\\end{tabular}\n";
    } else {
      out = fmt::format("{:<28}{:>13}{:>13}{:>13}{:>8}\n", "figure", "value", "low", "high", "n");
      for (const Row& r : rows_) {
        const auto c = columns(r);
        out += fmt::format("{:<28}{:>13}{:>13}{:>13}{:>8}\n", c[0], c[1], c[2], c[3], c[4]);
      }
      for (const auto& [what, names] : {std::pair{"frozen", &frozen_}, {"exploding", &exploding_}})
        if (!names->empty()) {
          const std::size_t shown = std::min<std::size_t>(names->size(), 20);
          out += fmt::format("{}: {}{}\n", what, fmt::join(names->begin(), names->begin() + static_cast<std::ptrdiff_t>(shown), " "), shown < names->size() ? fmt::format(" and {} more", names->size() - shown) : std::string());
        }
    }
    context.print(out);
  }

  std::string real_, train_, compat_ = "none", cache_, format_ = "text";
  std::vector<std::string> classifiers_;
  bool features_ = false;
  int frames_ = 0, repeats_ = 1, resamples_ = 200, splits_ = 1, pca_ = 0, threads_ = 1;
  std::uint64_t seed_ = 1;
  Compat formula_ = Compat::none;
  metrics::NeighbourOptions neighbours_;
  std::vector<std::unique_ptr<classifier::Classifier>> judges_;
  Set generated_, real_set_, train_set_;
  std::vector<std::string> classes_;
  bool by_class_ = false, real_by_class_ = false;
  std::vector<Rows> parts_;
  std::vector<Row> rows_;
  std::vector<std::string> frozen_, exploding_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<FidEval>(argc, argv); }
