// motion-compare - put generated motion beside real motion, in figures that need no classifier.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/motion_input.hpp"
#include "libmocap/metrics/gait.hpp"
#include "libmocap/metrics/motion_statistics.hpp"

namespace {

using namespace mocap;

std::vector<Clip> load(const std::string& path) {
  const auto input = formats::open_motion(path, path);
  std::vector<Clip> clips;
  for (std::size_t i = 0; i < input->size(); ++i) clips.push_back(input->read(i));
  if (clips.empty()) refuse({path, 0, {}}, "0 clips, expected at least one");
  return clips;
}

class MotionCompare final : public cli::Tool {
 public:
  std::string name() const override { return "motion-compare"; }
  std::string synopsis() const override { return "Compare generated motion with real motion: energy, root height, foot skate, smoothness, nearest training clip"; }
  std::string description() const override {
    return "One row for each set of clips, by combination of attributes and over all. Energy is joint speed weighted by each joint's reach; "
           "frozen counts clips whose last third has under a fifth of the real energy; jerkiness is the mean second difference of the rotations over the "
           "first; nearest is the median distance of a window to the nearest window of the real clips, in deviations per column: samples that copy their "
           "training data lie nearer than unseen real clips do. --spread tells how much clips differ from each other in speed, turning and step length, --stretches whether long motion "
           "stays within what real motion does, or freezes or drifts away.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"motion-compare samples.h5 --real train.h5 --unseen test.h5", "samples beside what they were trained on and what they were not"},
            {"sample -m lstm.h5 --frames 9000 -o - | motion-compare - --real train.h5 --stretches 10", "does a motion of five minutes go on as it began?"},
            {"sample -m lstm.h5 -n 100 --init start.h5 -o - | motion-compare - --real train.h5 --spread", "what becomes of one beginning"},
            {"sample -m model.h5 -n 64 -o - | motion-compare - --real train.h5 --by action --json", "by action alone, as JSON, from a pipe"}};
  }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::none;
    t.report = true;
    t.input_help = "generated motion (archive or motion file)";
    return t;
  }
  void options(CLI::App& app) override {
    app.add_option("--real", real_, "real motion, usually the training split")->required()->check(cli::path());
    app.add_option("--unseen", unseen_, "real motion that was not trained on")->check(cli::path());
    app.add_option("--by", by_, "attribute to break the rows down by (repeatable; none: no breakdown; default: all that label every generated clip)");
    app.add_option("--window", nearest_.window, "frames of a window in the nearest-clip search")->check(cli::whole(2, 100000, "FRAMES"))->capture_default_str();
    app.add_flag("--spread", spread_, "speed, turning (to the left positive) and step length over clips: mean, deviation, smallest and largest");
    app.add_option("--stretches", stretch_, "figures of each stretch of so many seconds, over all generated clips, against the smallest and largest of real ones")->check(cli::positive("SECONDS"));
  }

  Exit run(cli::Context& context) override {
    nearest_.threads = context.threads();
    real_clips_ = load(real_);
    std::vector<std::pair<std::string, std::vector<Clip>>> sets = {{"real", real_clips_}};
    if (!unseen_.empty()) sets.emplace_back("unseen", load(unseen_));
    sets.emplace_back("generated", load(context.inputs().at(0).path));
    if (by_.empty())
      by_ = common_attributes(sets.back().second);
    else if (by_ == std::vector<std::string>{"none"})
      by_.clear();
    for (const auto& name : by_)
      for (const auto& [set, clips] : sets)
        if (set != "unseen" && std::none_of(clips.begin(), clips.end(), [&](const Clip& c) { return c.attributes.contains(name); }))
          refuse({set == "real" ? real_ : context.inputs()[0].path, 0, {}}, "no clip has the attribute '" + name + "', expected those of --by");
    nearest_.match = by_;
    for (const auto& [name, clips] : sets)
      if (clips.at(0).joints() != real_clips_.at(0).joints() || clips[0].frame_rate_hz != real_clips_[0].frame_rate_hz)
        refuse({}, fmt::format("{} motion of {} joints at {} Hz, expected {} joints at {} Hz as in {}", name, clips[0].joints(), clips[0].frame_rate_hz,
                               real_clips_[0].joints(), real_clips_[0].frame_rate_hz, real_));
    if (!context.common().json)
      context.print(fmt::format("{:<28}{:<11}{:>6}{:>8}{:>8}{:>7}{:>15}{:>7}{:>7}{:>8}{:>9}\n", "group", "set", "clips", "frames", "energy", "ratio", "root height m", "m/s", "skate",
                                "frozen", "nearest"));
    // What was not generated has nothing to be compared with.
    std::set<std::vector<std::string>> groups;
    for (const Clip& c : sets.back().second) groups.insert(key(c));
    for (auto& [name, clips] : sets) std::erase_if(clips, [&](const Clip& c) { return !groups.contains(key(c)); });
    if (sets[0].second.empty()) refuse({real_, 0, {}}, "no clip has the attributes of a generated one, expected motion to compare with");
    real_clips_ = sets[0].second;
    if (!by_.empty())
      for (const auto& g : groups) table(context, sets, g);
    table(context, sets, std::nullopt);
    nlohmann::ordered_json document{{"rows", rows_}};
    if (spread_) document["spread"] = spread(context, sets);
    if (stretch_) document["stretches"] = over_time(context, sets.front().second, sets.back().second);
    if (context.common().json) context.print(document.dump(2) + "\n");
    return Exit::ok;
  }

 private:
  static std::vector<std::string> common_attributes(const std::vector<Clip>& clips) {
    std::vector<std::string> names;
    for (const auto& [name, value] : clips.at(0).attributes)
      if (name != "subject" && std::all_of(clips.begin(), clips.end(), [&](const Clip& c) { return c.attributes.contains(name) && !c.attributes.at(name).empty(); })) names.push_back(name);
    return names;
  }

  std::vector<std::string> key(const Clip& c) const {
    std::vector<std::string> k;
    for (const auto& a : by_) k.push_back(c.attributes.contains(a) ? c.attributes.at(a) : "");
    return k;
  }

  void table(cli::Context& context, const std::vector<std::pair<std::string, std::vector<Clip>>>& sets, const std::optional<std::vector<std::string>>& group) {
    std::string label = "all";
    if (group) {
      label.clear();
      for (const auto& v : *group) label += (label.empty() ? "" : " ") + (v.empty() ? std::string("(none)") : v);
    }
    const auto members = [&](const std::vector<Clip>& clips) {
      std::vector<Clip> out;
      for (const Clip& c : clips)
        if (!group || key(c) == *group) out.push_back(c);
      return out;
    };
    double real_energy = 0;
    for (const auto& [name, clips] : sets) {
      const auto chosen = members(clips);
      if (chosen.empty()) continue;
      const auto s = metrics::motion_statistics(chosen, real_energy);
      if (name == "real") real_energy = s.energy;
      // Over all groups, still is what is still for its group: a wave moves less than a run.
      auto& frozen = frozen_clips_[name];
      if (group) frozen += s.frozen_share * static_cast<double>(s.clips);
      const double frozen_share = !group && !by_.empty() ? frozen / static_cast<double>(s.clips) : s.frozen_share;
      const double nearest = name == "real" ? std::numeric_limits<double>::quiet_NaN() : metrics::median(metrics::nearest_training_distances(chosen, members(real_clips_), nearest_));
      if (context.common().json) {
        nlohmann::ordered_json row{{"group", label}, {"set", name}, {"clips", s.clips}, {"frames", s.frames}, {"energy", s.energy}, {"energy_ratio", s.energy / real_energy},
                                   {"root_height_low", s.root_height_low}, {"root_height_high", s.root_height_high}, {"root_speed_mps", s.root_speed},
                                   {"skate_mps", s.skate_mps}, {"contact_share", s.contact_share}, {"jerkiness", s.jerkiness}, {"frozen_share", frozen_share}};
        if (name != "real") row["nearest_training"] = nearest;
        rows_.push_back(row);
      } else {
        context.print(fmt::format("{:<28}{:<11}{:>6}{:>8}{:>8.3f}{:>7}{:>15}{:>7.2f}{:>7.3f}{:>7.1f}%{:>9}\n", label, name, s.clips, s.frames, s.energy,
                                  real_energy > 0 ? fmt::format("{:.2f}", s.energy / real_energy) : std::string("-"), fmt::format("{:.2f} - {:.2f}", s.root_height_low, s.root_height_high), s.root_speed, s.skate_mps, 100 * frozen_share,
                                  std::isnan(nearest) ? std::string("-") : fmt::format("{:.3f}", nearest)));
      }
    }
  }

  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  nlohmann::ordered_json spread(cli::Context& context, const std::vector<std::pair<std::string, std::vector<Clip>>>& sets) const {
    nlohmann::ordered_json document;
    if (!context.common().json) context.print(fmt::format("\n{:<16}{:<11}{:>6}{:>10}{:>11}{:>10}{:>10}\n", "over clips", "set", "clips", "mean", "deviation", "smallest", "largest"));
    for (const auto& [name, of] : {std::pair{"speed_mps", &metrics::Gait::speed_mps}, {"turning_dps", &metrics::Gait::turning_dps}, {"step_length_m", &metrics::Gait::step_length_m}})
      for (const auto& [set, clips] : sets) {
        std::vector<double> values;
        for (const Clip& c : clips)
          if (const double v = metrics::gait(c).*of; std::isfinite(v)) values.push_back(v);
        const auto n = static_cast<double>(values.size());
        double sum = 0, squares = 0;
        for (const double v : values) sum += v;
        for (const double v : values) squares += (v - sum / n) * (v - sum / n);
        const double mean = values.empty() ? kNaN : sum / n, deviation = values.size() < 2 ? kNaN : std::sqrt(squares / (n - 1));
        const double low = values.empty() ? kNaN : *std::min_element(values.begin(), values.end()), high = values.empty() ? kNaN : *std::max_element(values.begin(), values.end());
        document[name][set] = {{"clips", values.size()}, {"mean", mean}, {"deviation", deviation}, {"smallest", low}, {"largest", high}};
        if (!context.common().json) context.print(fmt::format("{:<16}{:<11}{:>6}{:>10}{:>11}{:>10}{:>10}\n", name, set, values.size(), text(mean), text(deviation), text(low), text(high)));
      }
    return document;
  }

  static std::string text(double value) { return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-"; }

  // Energy, root's height, speed and share of frames with a foot down, stretch by stretch.
  nlohmann::ordered_json over_time(cli::Context& context, const std::vector<Clip>& real, const std::vector<Clip>& generated) const {
    constexpr std::array kNames = {"energy", "root_height_m", "root_speed_mps", "contact_share"};
    using Row = std::array<double, kNames.size()>;
    const auto row = [](const std::vector<Clip>& clips) {
      const auto s = metrics::motion_statistics(clips);
      double height = 0;
      for (const Clip& c : clips)
        for (const Vector3& p : c.root_position) height += p.z();
      return Row{s.energy, height / static_cast<double>(s.frames), s.root_speed, s.contact_share};
    };
    const auto pieces = [&](const Clip& c) { return metrics::stretches(c, static_cast<std::size_t>(std::max(1.0, std::round(std::min(1e9, *stretch_ * c.frame_rate_hz))))); };
    Row low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const Clip& clip : real)
      for (const Clip& piece : pieces(clip)) {
        if (piece.frames() < 2) continue;
        const Row r = row({piece});
        for (std::size_t k = 0; k < r.size(); ++k) low[k] = std::min(low[k], r[k]), high[k] = std::max(high[k], r[k]);
      }
    std::vector<std::vector<Clip>> at;  // pieces of all clips by their place
    for (const Clip& clip : generated) {
      auto parts = pieces(clip);
      if (parts.size() > at.size()) at.resize(parts.size());
      for (std::size_t i = 0; i < parts.size(); ++i) at[i].push_back(std::move(parts[i]));
    }
    nlohmann::ordered_json document{{"seconds", *stretch_}};
    for (std::size_t k = 0; k < kNames.size(); ++k) document["real"][kNames[k]] = {low[k], high[k]};
    if (!context.common().json) {
      context.print(fmt::format("\n{:<16}{:>7}{:>12}{:>15}{:>16}{:>15}\n", "stretch s", "clips", kNames[0], kNames[1], kNames[2], kNames[3]));
      const auto range = [&](std::size_t k) { return fmt::format("{} .. {}", text(low[k]).substr(0, 5), text(high[k]).substr(0, 5)); };
      context.print(fmt::format("{:<16}{:>7}{:>16}{:>15}{:>16}{:>15}\n", "real", "", range(0), range(1), range(2), range(3)));
    }
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Row r = row(at[i]);
      nlohmann::ordered_json entry{{"start_s", static_cast<double>(i) * *stretch_}, {"clips", at[i].size()}};
      std::vector<std::string> outside;
      for (std::size_t k = 0; k < r.size(); ++k) {
        entry[kNames[k]] = r[k];
        if (r[k] < low[k] || r[k] > high[k]) outside.emplace_back(kNames[k]);
      }
      entry["outside"] = outside;
      document["generated"].push_back(entry);
      if (!context.common().json)
        context.print(fmt::format("{:<16}{:>7}{:>12.3f}{:>15.3f}{:>16.3f}{:>15.3f}{}\n", fmt::format("{:g} - {:g}", static_cast<double>(i) * *stretch_, static_cast<double>(i + 1) * *stretch_), at[i].size(), r[0], r[1],
                                  r[2], r[3], outside.empty() ? "" : "  outside: " + fmt::format("{}", fmt::join(outside, ", "))));
    }
    return document;
  }

  std::string real_, unseen_;
  bool spread_ = false;
  std::optional<double> stretch_;
  std::vector<std::string> by_;
  metrics::NearestOptions nearest_;
  std::vector<Clip> real_clips_;
  std::map<std::string, double> frozen_clips_;
  nlohmann::ordered_json rows_ = nlohmann::ordered_json::array();
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<MotionCompare>(argc, argv); }
