#include "libmocap/evaluation/evaluation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/metrics/intervals.hpp"
#include "libmocap/metrics/sample_figures.hpp"

namespace mocap::evaluation {
namespace {

using metrics::Compat;
using metrics::Interval;

using Spread = std::function<Interval(double)>;

constexpr int kPairs = 200, kPairsOfClass = 20;  // of clips whose distance is averaged: those of action-to-motion
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class Evaluation {
 public:
  Evaluation(const Sets& sets, const Options& options) : generated_(sets.generated), real_(sets.real), train_(sets.train ? &*sets.train : nullptr), mean_pose_(sets.mean_pose ? &*sets.mean_pose : nullptr), o_(options), groups_(group_by_labels(sets)) {}

  Report run() {
    if (!o_.by.empty() && std::none_of(generated_.views.begin(), generated_.views.end(), [&](const View& v) { return v.attribute == o_.by; }))
      refuse_usage(fmt::format("figures by {}, expected an attribute that a classifier judges", o_.by));
    deal();
    if (generated_.size() > 0) feature_figures();
    if (!generated_.clips.empty()) clip_rows();
    return std::move(report_);
  }

 private:
  // Rows of each repeat: class by class, so that all repeats have all classes.
  void deal() {
    if (o_.repeats < 1) refuse_usage(fmt::format("{} repeats, expected at least one", o_.repeats));
    const std::size_t n = std::max(generated_.size(), generated_.clips.size());  // without a classifier there are only clips
    if (o_.repeats == 1) {
      parts_ = {all_rows(n)};
      return;
    }
    Rows order = shuffled(n, o_.seed, 0xdea1);
    if (!groups_.generated.empty()) std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return groups_.generated[a] < groups_.generated[b]; });
    parts_.assign(static_cast<std::size_t>(o_.repeats), {});
    for (std::size_t i = 0; i < n; ++i) parts_[i % parts_.size()].push_back(order[i]);
    for (const Rows& part : parts_)
      if (part.size() < 2) refuse({generated_.path, 0, {}}, fmt::format("{} clips for {} repeats, expected at least two for each", n, o_.repeats));
  }

  void add(const std::string& name, const Interval& interval) { report_.rows.push_back({name, interval}); }
  void add_value(const std::string& name, double value, std::size_t n) { add(name, {value, kNaN, kNaN, static_cast<long>(n)}); }
  // A figure of the generated clips: over the repeats, or once with the interval that `spread` finds.
  void figure(const std::string& name, const std::function<double(const Rows&)>& of, const Spread& spread = {}) {
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
    if (o_.compat != Compat::none) return metrics::frechet_distance_compat(a, b, o_.compat);
    return metrics::frechet_distance(a, b, o_.threads);
  }

  void feature_figures() {
    if (generated_.features.cols() == 0) return;
    const Eigen::MatrixXd& x = generated_.features;
    const Eigen::MatrixXd& y = real_.features;
    const auto whole = [&](const std::string& name, const Eigen::MatrixXd& mine, const Set& set, const Eigen::MatrixXd& theirs, bool intervals) {
      try {
        std::optional<metrics::Gaussian> reference;
        if (set.given) reference = set.given;
        else if (o_.compat == Compat::none) reference = metrics::gaussian(theirs, set.path);
        figure(
            name,
            [&](const Rows& rows) {
              const Eigen::MatrixXd part = rows.size() == static_cast<std::size_t>(mine.rows()) ? mine : take(mine, rows);
              return o_.compat == Compat::none || set.given ? metrics::frechet_distance(metrics::gaussian(part, generated_.path), *reference) : frechet(part, theirs);
            },
            !intervals || o_.resamples < 2 || !reference ? Spread() : [&](double value) {
              Interval i = metrics::bootstrap_interval(
                  static_cast<std::size_t>(mine.rows()), value, [&](const std::vector<int>& counts) { return metrics::frechet_distance(metrics::gaussian(mine, counts), *reference); }, o_.resamples, 0.95, o_.seed, o_.threads);
              i.low = std::max(0.0, i.low);
              return i;
            });
      } catch (const Error& e) {
        throw e.in_file(generated_.path);
      }
    };
    whole("fid", x, real_, y, true);
    if (generated_.views.size() > 1 && o_.each_view)
      for (const View& v : generated_.views) whole("fid." + v.attribute, v.features, real_, view_of(real_, v.attribute).features, false);
    // Many training clips may stand where test clips are few; a generator that repeats them does well here, which nearest_training shows.
    if (train_ && (train_->features.rows() > train_->features.cols() || o_.compat != Compat::none)) whole("fid.train", x, *train_, train_->features, true);
    if (!real_.given) floors();
    scores();
    if (!real_.given) {
      metrics::KidOptions k;
      k.seed = o_.compat == Compat::torch_fidelity ? 2020 : o_.seed;
      k.numpy_draws = o_.compat == Compat::torch_fidelity;
      k.threads = o_.threads;
      // The kernel is made for features of about unit size.
      const bool published = o_.compat != Compat::none;
      const auto standard = published ? metrics::Standard{Eigen::RowVectorXd::Zero(y.cols()), Eigen::RowVectorXd::Ones(y.cols())} : metrics::standard_of(y);
      const Eigen::MatrixXd xs = standard(x), ys = standard(y);
      metrics::MeanDeviation found;
      figure(
          "kid", [&](const Rows& rows) { return (found = metrics::kid(take(xs, rows), ys, k)).mean; },
          published ? Spread() : [&](double) { return metrics::kid_interval(xs, ys, found, k); });
      const Rows order = shuffled(real_.size(), o_.seed, 0xf100);
      const auto half = static_cast<std::ptrdiff_t>(order.size() / 2);
      if (half > 1) add_value("kid.floor_halves", metrics::kid(take(ys, Rows(order.begin(), order.begin() + half)), take(ys, Rows(order.begin() + half, order.end())), k).mean, static_cast<std::size_t>(half));
      const std::size_t n = real_.size();
      if (std::min(x.rows(), y.rows()) > 3) {
        std::vector<metrics::PrecisionRecall> pr;
        for (const Rows& part : parts_) pr.push_back(metrics::precision_recall(take(x, part), y, 3, o_.threads));
        std::size_t k = 0;
        figure("precision", [&](const Rows&) { return pr[k++].precision; }, [&](double v) { return metrics::share_interval(v, static_cast<long>(x.rows())); });
        k = 0;
        figure("recall", [&](const Rows&) { return pr[k++].recall; }, [&](double v) { return metrics::share_interval(v, static_cast<long>(n)); });
      }
    }
    const bool a2m = o_.compat == Compat::a2m || o_.compat == Compat::actor, own = o_.compat == Compat::none;
    const auto diversity = [&](const Eigen::MatrixXd& f) { return a2m ? metrics::diversity_a2m(f, kPairs, static_cast<std::uint32_t>(o_.seed)) : metrics::diversity(f, kPairs, o_.seed); };
    const auto diversity_of = [&](const Eigen::MatrixXd& f, double v) { return metrics::diversity_interval(v, f, kPairs, o_.threads); };
    figure("diversity", [&](const Rows& rows) { return diversity(take(x, rows)); }, own ? [&](double v) { return diversity_of(x, v); } : Spread());
    if (y.rows() > 1) own ? add("diversity.real", diversity_of(y, diversity(y))) : add_value("diversity.real", diversity(y), real_.size());
    if (!groups_.by_class) return;
    const auto variance = [&](const Eigen::MatrixXd& f, const std::vector<int>& labels) { return metrics::within_class_variance(f, labels, groups_.classes); };
    const auto variance_of = [&](const Eigen::MatrixXd& f, const std::vector<int>& labels, double v) { return metrics::within_class_variance_interval(v, f, labels, groups_.classes); };
    const auto modes = [&](const Eigen::MatrixXd& f, const std::vector<int>& labels) {
      return a2m ? metrics::multimodality_a2m(f, labels, groups_.classes, kPairsOfClass, static_cast<std::uint32_t>(o_.seed)) : metrics::multimodality(f, labels, groups_.classes, kPairsOfClass, o_.seed);
    };
    const auto modes_of = [&](const Eigen::MatrixXd& f, const std::vector<int>& labels, double v) { return metrics::multimodality_interval(v, f, labels, groups_.classes, kPairsOfClass, o_.threads); };
    const auto by_class = [&](const std::string& name, const auto& of, const auto& interval) {
      figure(name, [&](const Rows& rows) { return of(take(x, rows), take(groups_.generated, rows)); }, own ? [&](double v) { return interval(x, groups_.generated, v); } : Spread());
      if (!groups_.real_by_class) return;
      const double value = of(y, groups_.real);
      own ? add(name + ".real", interval(y, groups_.real, value)) : add_value(name + ".real", value, real_.size());
    };
    try {
      by_class("within_class_variance", variance, variance_of);
      by_class("multimodality", modes, modes_of);
      for (const auto& [name, classes] : classes_by_value()) {
        // The classes of one value alone, renumbered; the other clips count as unlabelled.
        const auto within = [&](const std::vector<int>& labels) {
          std::vector<int> out;
          for (const int l : labels) out.push_back(l < 0 ? -1 : classes.at[static_cast<std::size_t>(l)]);
          return out;
        };
        by_class(
            "within_class_variance." + name, [&](const Eigen::MatrixXd& f, const std::vector<int>& labels) { return metrics::within_class_variance(f, within(labels), classes.names); },
            [&](const Eigen::MatrixXd& f, const std::vector<int>& labels, double v) { return metrics::within_class_variance_interval(v, f, within(labels), classes.names); });
      }
    } catch (const Error& e) {
      throw e.in_file(generated_.path);
    }
  }

  // Values of the attribute Options::by, each with those classes (combinations of labels) that have it.
  struct Classes {
    std::vector<std::string> names;
    std::vector<int> at;  // of every class: its place in names, -1: it has another value
  };
  std::map<std::string, Classes> classes_by_value() const {
    std::map<std::string, Classes> out;
    if (o_.by.empty()) return out;
    for (const Set* set : {&generated_, &real_}) {
      const View& view = view_of(*set, o_.by);
      const std::vector<int>& groups = set == &generated_ ? groups_.generated : groups_.real;
      for (std::size_t i = 0; i < groups.size(); ++i) {
        if (groups[i] < 0) continue;
        Classes& c = out[view.classes[static_cast<std::size_t>(view.labels[i])]];
        c.at.resize(groups_.classes.size(), -1);
        int& place = c.at[static_cast<std::size_t>(groups[i])];
        if (place >= 0) continue;
        place = static_cast<int>(c.names.size());
        c.names.push_back(groups_.classes[static_cast<std::size_t>(groups[i])]);
      }
    }
    return out;
  }

  static const View& view_of(const Set& set, const std::string& attribute) {
    return *std::find_if(set.views.begin(), set.views.end(), [&](const View& v) { return v.attribute == attribute; });
  }

  void floors() {
    const Eigen::MatrixXd& y = real_.features;
    const Rows order = shuffled(real_.size(), o_.seed, 0xf100);
    const auto half = static_cast<std::ptrdiff_t>(order.size() / 2);
    const auto d = y.cols();
    double value = kNaN;
    if (half > d || (o_.compat != Compat::none && half > 1))
      value = frechet(take(y, Rows(order.begin(), order.begin() + half)), take(y, Rows(order.begin() + half, order.end())));
    else
      log::warn("{}: halves of {} clips with {} features: no floor of halves, which takes more clips than features (--pca K --train gives fewer)", real_.path, half, d);
    add_value("fid.floor_halves", value, static_cast<std::size_t>(half));
    if (train_) {
      value = kNaN;
      if (train_->features.rows() > d || o_.compat != Compat::none)
        value = frechet(train_->features, y);
      else
        log::warn("{}: {} clips with {} features: no floor of training clips, which takes more clips than features", train_->path, train_->features.rows(), d);
      add_value("fid.floor_train", value, train_->size());
    }
    if (mean_pose_) add_value("fid.mean_pose", frechet(mean_pose_->features, y), mean_pose_->size());
  }

  void scores() {
    const auto with_posteriors = [](const Set& set) { return !set.views.empty() && std::all_of(set.views.begin(), set.views.end(), [](const View& v) { return v.posteriors.size() > 0; }); };
    if (!with_posteriors(generated_)) return;
    const auto score = [&](const Eigen::MatrixXd& p) {
      return o_.compat == Compat::torch_fidelity ? metrics::inception_score_torch_fidelity(p).mean : metrics::inception_score(p, o_.splits, o_.seed).mean;
    };
    const auto one = [&](const std::string& name, const Eigen::MatrixXd& p, const std::optional<Eigen::MatrixXd>& real) {
      try {
        figure(
            name, [&](const Rows& rows) { return score(take(p, rows)); },
            o_.resamples < 2 || o_.splits > 1 || o_.compat == Compat::torch_fidelity ? Spread() : [&](double value) {
              return metrics::bootstrap_interval(
                  static_cast<std::size_t>(p.rows()), value,
                  [&](const std::vector<int>& counts) {
                    Rows rows;
                    for (std::size_t i = 0; i < counts.size(); ++i) rows.insert(rows.end(), static_cast<std::size_t>(counts[i]), i);
                    return metrics::inception_score(take(p, rows)).mean;
                  },
                  o_.resamples, 0.95, o_.seed, o_.threads);
            });
        add_value(name + ".bound", metrics::inception_bound(static_cast<long>(p.cols()), static_cast<long>(parts_[0].size())), parts_[0].size());
        if (real) add_value(name + ".real", score(*real), static_cast<std::size_t>(real->rows()));
      } catch (const Error& e) {
        throw e.in_file(generated_.path);
      }
    };
    const bool real = with_posteriors(real_);
    const auto joint = [](const Set& set) {
      std::vector<Eigen::MatrixXd> p;
      for (const View& v : set.views) p.push_back(v.posteriors);
      return metrics::joint_posteriors(p);
    };
    one("is", joint(generated_), real ? std::optional(joint(real_)) : std::nullopt);
    for (std::size_t v = 0; v < generated_.views.size(); ++v) {
      const View& mine = generated_.views[v];
      if (generated_.views.size() > 1) one("is." + mine.attribute, mine.posteriors, real ? std::optional(real_.views[v].posteriors) : std::nullopt);
      const auto labelled = [](const std::vector<int>& labels) { return std::count_if(labels.begin(), labels.end(), [](int l) { return l >= 0; }); };
      if (const auto n = labelled(mine.labels); n > 0)
        figure("accuracy." + mine.attribute, [&](const Rows& rows) { return metrics::accuracy(take(mine.posteriors, rows), take(mine.labels, rows)); }, [&](double share) { return metrics::share_interval(share, n); });
      if (real && labelled(real_.views[v].labels) > 0) {
        long n = 0;
        const double share = metrics::accuracy(real_.views[v].posteriors, real_.views[v].labels, &n);
        add("accuracy." + mine.attribute + ".real", metrics::share_interval(share, n));
      }
    }
  }

  void clip_rows() {
    const auto figures = [&](const Set& set) {
      try {
        return metrics::clip_figures(set.clips, o_.threads);
      } catch (const Error& e) {
        throw e.in_file(set.path);
      }
    };
    using Figures = std::vector<metrics::ClipFigures>;
    const Figures generated = figures(generated_), real = figures(real_);
    const auto mean = [](const std::vector<double>& values) {
      double sum = 0, n = 0;
      for (const double v : values)
        if (std::isfinite(v)) sum += v, ++n;
      return n > 0 ? sum / n : kNaN;
    };
    const auto compare = [&](const std::string& name, const std::vector<double>& mine, const std::vector<double>& theirs) {
      const auto spread = [&](std::vector<double> values) {
        std::erase_if(values, [](double v) { return !std::isfinite(v); });
        if (values.empty()) return Interval{kNaN, kNaN, kNaN, 0};
        return o_.resamples < 2 ? Interval{mean(values), kNaN, kNaN, static_cast<long>(values.size())} : metrics::bootstrap_mean(values, o_.resamples, 0.95, o_.seed);
      };
      figure(name, [&](const Rows& rows) { return mean(take(mine, rows)); }, [&](double) { return spread(mine); });
      add(name + ".real", spread(theirs));
    };
    // A clip of another value is one without the figure.
    std::vector<std::string> values;
    if (!o_.by.empty()) values = view_of(generated_, o_.by).classes;
    const auto only = [&](const Set& set, std::size_t value, std::vector<double> figures) {
      const std::vector<int>& labels = view_of(set, o_.by).labels;
      for (std::size_t i = 0; i < figures.size(); ++i)
        if (labels[i] != static_cast<int>(value)) figures[i] = kNaN;
      return figures;
    };
    const auto any = [](const std::vector<double>& figures) { return std::any_of(figures.begin(), figures.end(), [](double v) { return std::isfinite(v); }); };
    const auto both = [&](const std::string& name, const std::vector<double>& mine, const std::vector<double>& theirs) {
      compare(name, mine, theirs);
      for (std::size_t v = 0; v < values.size(); ++v) {
        const auto a = only(generated_, v, mine), b = only(real_, v, theirs);
        if (any(a) || any(b)) compare(name + "." + values[v], a, b);
      }
    };
    const auto column = [](const Figures& of_clips, double metrics::ClipFigures::* of) {
      std::vector<double> out;
      for (const auto& f : of_clips) out.push_back(f.*of);
      return out;
    };
    for (const auto& [name, of] : {std::pair{"skate_mps", &metrics::ClipFigures::skate_mps}, {"skate_gmd", &metrics::ClipFigures::skate_gmd}, {"penetration_m", &metrics::ClipFigures::penetration_m},
                                   {"jerk", &metrics::ClipFigures::jerk}, {"energy", &metrics::ClipFigures::energy}})
      both(name, column(generated, of), column(real, of));
    for (const auto& [name, of] : {std::pair{"contact_speed_mps", &metrics::ClipFigures::contact_speed_mps}, {"contact_height_m", &metrics::ClipFigures::contact_height_m}})
      if (any(column(generated, of)) || any(column(real, of))) both(name, column(generated, of), column(real, of));

    // The real mean energy of each class; of all clips for those without one.
    std::map<std::string, std::pair<double, double>> energy;
    const auto label = [](const Set& set, std::size_t i) { return set.views.empty() ? std::string() : label_of(set, i); };
    for (std::size_t i = 0; i < real_.clips.size(); ++i)
      if (std::isfinite(real[i].energy))
        for (const std::string& key : std::set<std::string>{label(real_, i), ""}) {
          energy[key].first += real[i].energy;
          energy[key].second += 1;
        }
    for (const Set* set : {&generated_, &real_}) {
      const Figures& of_clips = set == &generated_ ? generated : real;
      std::vector<double> frozen, exploding;
      for (std::size_t i = 0; i < set->clips.size(); ++i) {
        const std::string key = energy.contains(label(*set, i)) ? label(*set, i) : "";
        const auto found = energy.empty() ? metrics::Liveliness::alive : metrics::liveliness(of_clips[i], energy[key].first / energy[key].second);
        frozen.push_back(found == metrics::Liveliness::frozen);
        exploding.push_back(found == metrics::Liveliness::exploding);
        if (set == &generated_ && frozen.back() > 0) report_.frozen.push_back(set->clips[i].name);
        if (set == &generated_ && exploding.back() > 0) report_.exploding.push_back(set->clips[i].name);
      }
      for (const auto& [name, shares] : {std::pair{"frozen_share", &frozen}, {"exploding_share", &exploding}}) {
        const auto of_clips = [&, end = set == &generated_ ? "" : ".real"](const std::string& name, const std::vector<double>& v) {
          const auto n = std::count_if(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
          if (n > 0 && *end == 0) figure(name, [&](const Rows& rows) { return mean(take(v, rows)); }, [&](double share) { return metrics::share_interval(share, n); });
          else if (n > 0) add(name + end, metrics::share_interval(mean(v), n));
        };
        of_clips(name, *shares);
        for (std::size_t v = 0; v < values.size(); ++v) of_clips(std::string(name) + "." + values[v], only(*set, v, *shares));
      }
    }
    if (!train_) return;
    metrics::NeighbourOptions neighbours = o_.neighbours;
    neighbours.threads = o_.threads;
    const auto distances = [&](const Set& set) {
      std::vector<double> out(set.clips.size(), kNaN);
      for (const auto& n : metrics::nearest_training_clips(set.clips, train_->clips, neighbours)) out[n.clip] = n.distance;
      return out;
    };
    both("nearest_training", distances(generated_), distances(real_));
  }

  const Set& generated_;
  const Set& real_;
  const Set* train_;
  const Set* mean_pose_;
  Options o_;
  Groups groups_;
  std::vector<Rows> parts_;
  Report report_;
};

}  // namespace

Report evaluate(const Sets& sets, const Options& options) { return Evaluation(sets, options).run(); }

}  // namespace mocap::evaluation
