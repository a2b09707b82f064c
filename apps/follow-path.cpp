// follow-path - make motion in which a point of the body follows a curve on the ground.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmocap/base/sha256.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/io/curve_file.hpp"
#include "libmocap/metrics/clip_figures.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/control/path_follower.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/tools/control_options.hpp"
#include "libmodels/tools/history_input.hpp"

namespace {

using namespace mocap;

std::string stem_of(const std::string& path) {
  if (path == "-") return "stdin";
  std::filesystem::path p(path);
  if (p.extension() == ".gz") p = p.stem();
  return p.stem().string();
}

class FollowPath final : public cli::Tool {
 public:
  std::string name() const override { return "follow-path"; }
  std::string synopsis() const override { return "Make motion in which the root, or another joint, follows a curve on the ground"; }
  std::string description() const override {
    return "Window by window the most probable motion under the generator is looked for that keeps to the curve and lets feet stand that are down: a particle swarm finds a start, L-BFGS ends it. The clip begins at the "
           "curve's beginning, facing along it, and ends where its end is reached; the curve is stored with it and `render --trajectory` draws both. A curve is a text file of `x,y` lines in metres, or an SVG with one "
           "path, whose y points down on paper and forward here. What no motion that the model knows can follow is followed as far as is natural, and said. It goes on at the speed of the frame that it starts with unless --speed says another. "
           "--report has a row for each window: the objective after swarm and L-BFGS, and every term in nats.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"follow-path -m lstm.h5 --path curve.csv -o walk.h5", "a walk along a curve"},
            {"follow-path -m lstm.h5 --refiner refiner.h5 --path drawing.svg --metres-per-unit 0.02 --report windows.tsv -o - | refine --pin-feet - -o walk.h5", "refined within the search, feet held after it"},
            {"follow-path -m lstm.h5 --path a.csv --path b.csv -o both.h5 && render both.h5 --view top --trajectory -o both.png", "several curves, seen from above"}};
  }
  std::vector<std::string> references() const override { return {"Wang, Chai, Xia 2018, section 5.2"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::none;
    t.output = cli::Output::file;
    t.random = true;
    t.report = true;
    t.network = true;
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  std::vector<std::string> non_content_options() const override { return {"--report"}; }

  void options(CLI::App& app) override {
    control_.add_models(app);
    app.add_option("--path", curves_, "curve to follow, CSV or SVG (repeatable: a clip each)")->required()->check(cli::path("FILE"));
    app.add_option("--metres-per-unit", reading_.metres_per_unit, "of an SVG")->check(cli::positive("METRES"))->capture_default_str();
    app.add_option("--point", point_, "joint that follows the curve with its place above the ground (default: the root)");
    app.add_option("--curve-sigma", settings_.curve_sigma, "deviation of the point from the curve; smaller follows more closely and less naturally")->check(cli::positive("METRES"))->capture_default_str();
    app.add_option("--facing-sigma", settings_.facing_sigma, "deviation of the heading from the curve's direction; 0: it is free")->check(cli::non_negative("RADIANS"))->capture_default_str();
    app.add_option("--speed", settings_.speed, "mean speed of the root over a window (default: that of the frame it starts with)")->check(cli::positive("MPS"));
    app.add_option("--speed-sigma", settings_.speed_sigma, "deviation from it")->check(cli::positive("MPS"))->capture_default_str();
    app.add_option("--step-length", settings_.step_length, "way between the feet where one comes down (default: the generator's own)")->check(cli::positive("METRES"));
    app.add_option("--step-sigma", settings_.step_sigma, "deviation from it")->check(cli::positive("METRES"))->capture_default_str();
    app.add_option("--most-seconds", settings_.most_seconds, "most that a motion may last; 0: 3 times what 1 m/s takes")->check(cli::non_negative("SECONDS"))->capture_default_str();
    control_.add_search(app);
    app.add_option("--report", report_, "table of windows")->check(cli::path("FILE.tsv"));
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    if (report_ == "-") refuse_usage("--report -: standard output is for the archive, expected a file");
    if (context.common().json && context.common().output == "-") refuse_usage("--json and -o -: both write standard output, expected a file for one of them");
    if ((control_.generator() == "-") + (control_.refiner() == "-") + std::count(curves_.begin(), curves_.end(), "-") > 1) refuse_usage("standard input given twice, expected '-' once");
    if (!report_.empty()) check_output(report_, context.overwrite());
    control_.plan().seed = context.seed();
    control_.plan().validate();
    std::vector<HistoryInput> inputs;
    std::vector<std::shared_ptr<const GroundCurve>> curves;
    for (const auto& path : curves_) {
      Digest digest;
      curves.push_back(std::make_shared<GroundCurve>(io::read_curve(path, reading_, &digest)));
      inputs.push_back(tools::history_input(path, to_hex(digest)));
    }
    const auto models = control_.load();
    inputs.insert(inputs.begin(), models.inputs.begin(), models.inputs.end());
    const int point = point_.empty() ? -1 : tools::ControlOptions::joint(*models.generator.reference.skeleton, point_);

    store::ArchiveHeader header;
    header.skeleton = models.generator.reference.skeleton;
    header.frame_rate_hz = models.generator.reference.frame_rate_hz;
    header.contacts_rule = "model";
    header.history = models.history;
    header.history.push_back(context.history_entry(std::move(inputs)));
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);

    // Several curves side by side, one alone with all threads for its swarm.
    const int side_by_side = static_cast<int>(std::min<std::size_t>(curves.size(), static_cast<std::size_t>(context.threads())));
    control_.plan().swarm.threads = side_by_side > 1 ? 1 : context.threads();
    std::vector<control::Followed> followed(curves.size());
    parallel_for(curves.size(), side_by_side, [&](std::size_t i) {
      nn::initialize_worker_thread();
      try {
        const control::MotionModel model(models.generator, models.refines(), point);
        followed[i] = control::follow_path(model, *models.sampler, *curves[i], control_.terms(model), settings_, control_.plan(), i);
      } catch (const Error& e) {
        if (e.status() != Exit::data || !e.where().file.empty()) throw;
        throw e.in_file(models.refiner ? control_.refiner() : control_.generator());
      }
    });

    nlohmann::json summary = nlohmann::json::array();
    std::string table;
    std::map<std::string, int> names;
    std::size_t windows = 0, lowered = 0;
    for (std::size_t i = 0; i < curves.size(); ++i) {
      control::Followed& f = followed[i];
      f.clip.name = stem_of(curves_[i]);
      if (const int again = ++names[f.clip.name]; again > 1) f.clip.name += fmt::format("#{}", again);
      const auto figures = metrics::clip_figures(f.clip);
      for (const auto& w : f.windows) {
        ++windows;
        lowered += w.after_lbfgs < w.after_swarm;
        if (table.empty()) {
          table = "clip\tframe\tafter_swarm\tafter_lbfgs\tprior_per_frame\tmean_distance_m";
          for (const auto& [name, value] : w.terms) table += "\t" + name;
          table += "\n";
        }
        table += fmt::format("{}\t{}\t{:.6g}\t{:.6g}\t{:.6g}\t{:.6g}", f.clip.name, w.first, w.after_swarm, w.after_lbfgs, w.prior_per_frame, w.mean_distance);
        for (const auto& [name, value] : w.terms) table += fmt::format("\t{:.6g}", value);
        table += "\n";
      }
      summary.push_back({{"clip", f.clip.name},
                         {"curve_m", curves[i]->length()},
                         {"frames", f.clip.frames()},
                         {"reached_end", f.reached_end},
                         {"followed_m", f.followed_m},
                         {"mean_distance_m", f.mean_distance},
                         {"largest_distance_m", f.largest_distance},
                         {"mean_speed_mps", f.mean_speed},
                         {"skate_mps", figures.skate_mps},
                         {"contact_speed_mps", figures.contact_speed_mps},
                         {"prior_per_frame", f.prior_per_frame},
                         {"windows", f.windows.size()}});
      for (auto& [key, value] : summary.back().items())
        if (value.is_number_float() && !std::isfinite(value.get<double>())) value = nullptr;
      if (!f.reached_end)
        log::warn("{}: followed for {:.2f} of {:.2f} m: {}", curves_[i], f.followed_m, curves[i]->length(), f.stalled ? "from there on nothing natural under this model goes on along it" : "--most-seconds is over");
      else if (f.mean_distance > control::kFarFromCurve)
        log::warn("{}: {:.2f} m from the curve in the mean, at most {:.2f} m: no motion natural under this model follows it more closely", curves_[i], f.mean_distance, f.largest_distance);
      writer.add(f.clip);
    }
    writer.finish();
    if (table.empty()) table = "clip\tframe\tafter_swarm\tafter_lbfgs\tprior_per_frame\tmean_distance_m\n";  // --most-seconds ended it before the first
    if (!report_.empty()) write_file(report_, table, context.overwrite());
    log::info("{} curves, {} windows; L-BFGS lowered the objective in {:.1f} % of them", curves.size(), windows, windows ? 100.0 * static_cast<double>(lowered) / static_cast<double>(windows) : 0.0);
    if (context.common().json) context.print(nlohmann::json{{"clips", summary}, {"windows", windows}, {"lowered", lowered}}.dump(1) + "\n");
    return Exit::ok;
  }

 private:
  tools::ControlOptions control_;
  std::vector<std::string> curves_;
  io::CurveReadOptions reading_;
  control::FollowSettings settings_;
  std::string point_, report_;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<FollowPath>(argc, argv); }
