// fid-eval - judge generated motion by a classifier's features, and by what the clips do.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/evaluation/evaluation.hpp"
#include "libmocap/evaluation/report.hpp"
#include "libmocap/evaluation/sets.hpp"
#include "libmocap/metrics/frechet.hpp"
#include "libmodels/classifier/classifier.hpp"
#include "libmodels/nn/blas.hpp"

namespace {

using namespace mocap;
using evaluation::Set;
using evaluation::Sets;

class FidEval final : public cli::Tool {
 public:
  std::string name() const override { return "fid-eval"; }
  std::string synopsis() const override { return "Judge generated motion: FID, IS and the field's other figures, with intervals and a real-against-real floor"; }
  std::string description() const override {
    return "Real and generated clips are cut to the same lengths (per class, by rank of length), judged by each classifier, and compared: the Frechet distance of its last features "
           "(of several classifiers side by side) in double precision; the inception score over the joint posterior of the attributes, and of each; KID; precision and recall; accuracy; "
           "diversity; variance within a class; multimodality. Of the clips themselves: feet that slide, penetration, jerk, energy, how many freeze or explode and which, and "
           "with --train the distance to the nearest training clip. Rows that end in .real are the real clips' own; fid.floor_halves is the distance between disjoint "
           "halves of the real clips, fid.floor_train that of real against training clips: no generator is better than that; fid.train is that of generated against training clips. KID is of features standardised by the real clips (as published with --compat, where its cube makes large "
           "features all that counts). Intervals cover 95 %: Student's t over --repeats parts of the generated clips, otherwise the bootstrap over generated clips, for figures "
           "of pairs of clips the jackknife, for shares Wilson's; a dash where there is none. Refused: what would give a figure that lies (no more clips "
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
    app.add_flag("--match-classes", match_, "leave out generated clips at random until their classes are as frequent as the real ones': to FID a difference of mix is one of motion");
    app.add_flag("--mean-pose", mean_pose_, "with --train and --classifier: the row fid.mean_pose, the distance of the training clips frozen in the mean pose of their class: what a generator reaches that knows no motion");
    app.add_option("--by", options_.by, "an attribute: rows of its own for each of its values (energy.walking): figures of clips, variance within a class");
    app.add_option("--frames", frames_, "cut clips to at most so many frames (0: no limit)")->check(cli::whole(0, 1000000, "FRAMES"))->capture_default_str();
    app.add_flag("--cut-anywhere", anywhere_, "cut real and training clips at a random place, not behind: for generators that were trained on windows from anywhere and begin in the midst of an action");
    app.add_option("--repeats", options_.repeats, "deal the generated clips into so many parts, each a repeat")->check(cli::whole(1, 1000, "N"))->capture_default_str();
    app.add_option("--resamples", options_.resamples, "resamples of the bootstrap (0: none)")->check(cli::whole(0, 100000, "N"))->capture_default_str();
    app.add_option("--splits", options_.splits, "parts that the inception score is averaged over")->check(cli::whole(1, 1000, "N"))->capture_default_str();
    app.add_option("--pca", pca_, "compare so many principal axes of the training clips' features (0: the features)")->check(cli::whole(0, 100000, "K"))->capture_default_str();
    app.add_option("--window", options_.neighbours.window, "frames of a window in the nearest-clip search")->check(cli::whole(2, 100000, "FRAMES"))->capture_default_str();
    app.add_option("--compat", compat_, "figures by the formula of another program")->check(cli::one_of({"none", "pytorch-fid", "clean-fid", "torch-fidelity", "a2m", "actor"}))->capture_default_str();
    app.add_option("--stats-cache", cache_, "write mean and covariance of the real features as pytorch-fid reads them (mu, sigma); a file that is there must hold the same")->check(cli::path("FILE.npz"));
    app.add_option("--format", format_, "form of the report")->check(cli::one_of({"text", "tsv", "json", "latex"}))->capture_default_str();
  }
  std::vector<std::string> non_content_options() const override { return {"--stats-cache"}; }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    options_.threads = context.threads();
    options_.seed = context.seed();
    options_.compat = metrics::parse_compat(compat_);
    options_.each_view = pca_ == 0;
    if (context.common().json) format_ = "json";
    if (features_ && !classifiers_.empty()) refuse_usage("--features and --classifier, expected one of them");
    if (pca_ > 0 && train_.empty()) refuse_usage("--pca without --train, expected the training clips that the axes are fitted on");
    const cli::InputFile& input = context.inputs().at(0);
    if (mean_pose_ && train_.empty()) refuse_usage("--mean-pose without --train, expected the training clips whose mean poses are meant");
    if (mean_pose_ && classifiers_.empty()) refuse_usage("--mean-pose without --classifier, expected one: the distance lies in what classifiers see");
    if ((input.path == "-") + (real_ == "-") + (train_ == "-") > 1) refuse_usage("standard input given twice, expected '-' once");
    Sets sets = features_ ? read_features(input.path) : judged_clips(input);
    if (pca_ > 0) {
      const auto before = sets.train->features.cols();
      const double kept = evaluation::reduce(sets, pca_);
      log::info("{} principal axes keep {:.1f} % of the variance of the training clips' {} features", pca_, 100 * kept, before);
    }
    if (!cache_.empty() && sets.real.given) refuse_usage("--stats-cache with statistics as --real, expected features");
    evaluation::Report report = evaluation::evaluate(sets, options_);
    report.compat = compat_;
    if (!cache_.empty() && sets.real.size() > 0) evaluation::keep_statistics(sets.real, cache_);
    context.print(evaluation::format_report(report, evaluation::parse_format(format_)));
    return Exit::ok;
  }

 private:
  Sets read_features(const std::string& generated) const {
    Sets sets;
    sets.generated = evaluation::read_features(generated);
    sets.real = evaluation::read_features_or_statistics(real_);
    if (!train_.empty()) sets.train = evaluation::read_features(train_);
    match(sets);
    for (Set* set : sets.all()) evaluation::join_views(*set);
    return sets;
  }

  void match(Sets& sets) const {
    if (match_) {
      if (sets.real.given) refuse_usage("--match-classes with statistics as --real, expected features with labels");
      const std::size_t out = evaluation::match_classes(sets.generated, sets.real, options_.seed);
      log::info("{} generated clips left out to match the real ones' classes", out);
    } else if (const std::string most = evaluation::difference_of_mix(sets); !most.empty()) {
      log::warn("classes are not as frequent as among the real clips, which FID, KID and IS take for a difference of motion; {} (--match-classes)", most);
    }
  }

  Sets judged_clips(const cli::InputFile& input) const {
    Sets sets;
    sets.generated = evaluation::read_clips(input.path, input.label);
    sets.real = evaluation::read_clips(real_, real_);
    if (!train_.empty()) sets.train = evaluation::read_clips(train_, train_);
    evaluation::check_alike(sets);
    for (const auto& entry : sets.generated.history)
      for (const auto& used : entry.inputs)
        if (used.sha256 == sets.real.sha256) log::warn("{} was made with {} ({}): its clips are no test", sets.generated.path, sets.real.path, entry.tool);
    std::vector<std::unique_ptr<classifier::Classifier>> judges;
    for (const auto& path : classifiers_) {
      auto judge = load_judge(path, sets);
      for (const auto& other : judges)
        if (other->attribute() == judge->attribute()) refuse({path, 0, {}}, "a second classifier of " + judge->attribute() + ", expected one for each attribute", "judge by each alone and compare the tables");
      judges.push_back(std::move(judge));
    }
    for (Set* set : sets.all())
      for (const auto& judge : judges) evaluation::add_labels(*set, judge->attribute(), judge->classes());
    match(sets);
    evaluation::cut_to_same_lengths(sets, static_cast<std::size_t>(frames_), anywhere_ ? std::optional(options_.seed) : std::nullopt);
    if (mean_pose_) {
      sets.mean_pose = evaluation::mean_poses(*sets.train);
      if (match_) evaluation::match_classes(*sets.mean_pose, sets.real, options_.seed);
    }
    for (Set* set : sets.all()) {
      for (std::size_t v = 0; v < judges.size(); ++v) {
        classifier::Judged judged;
        try {
          judged = judges[v]->judge(set->clips, options_.threads);
        } catch (const Error& e) {
          throw e.in_file(set->path);
        }
        set->views[v].features = std::move(judged.features);
        set->views[v].posteriors = std::move(judged.posteriors);
      }
      evaluation::join_views(*set);
    }
    return sets;
  }

  static std::unique_ptr<classifier::Classifier> load_judge(const std::string& path, const Sets& sets) {
    std::string digest;
    auto judge = classifier::Classifier::load(path, &digest);
    for (const auto& entry : sets.generated.history)
      if (entry.tool.starts_with("train-"))
        for (const auto& used : entry.inputs)
          if (used.sha256 == digest) refuse({path, 0, {}}, "this classifier took part in training the generator (" + entry.tool + "), expected one that did not", "train one on other clips: a generator pleases its own");
    for (const Clip& c : sets.real.clips)
      if (judge->train_sources().contains(c.source.sha256) && !c.source.sha256.empty())
        refuse({path, 0, {}}, "this classifier was trained on " + c.source.path + ", of which there are clips in " + sets.real.path + ", expected real clips it never saw");
    for (const Set* set : sets.all()) {
      const Clip& c = set->clips[0];
      if (std::abs(judge->frame_rate_hz() - c.frame_rate_hz) > 1e-6 * c.frame_rate_hz) refuse({path, 0, {}}, fmt::format("a classifier for {} Hz, expected {} Hz as in {}", judge->frame_rate_hz(), c.frame_rate_hz, set->path));
    }
    return judge;
  }

  std::string real_, train_, compat_ = "none", cache_, format_ = "text";
  std::vector<std::string> classifiers_;
  bool features_ = false, match_ = false, mean_pose_ = false, anywhere_ = false;
  int frames_ = 0, pca_ = 0;
  evaluation::Options options_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<FidEval>(argc, argv); }
