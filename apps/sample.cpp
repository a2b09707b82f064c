// sample - generate motion with a trained model.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/formats/attribute_schedule.hpp"
#include "libmocap/metrics/stillness.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/generators/generator.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/tools/history_input.hpp"

namespace {

using namespace mocap;

class Sample final : public cli::Tool {
 public:
  std::string name() const override { return "sample"; }
  std::string synopsis() const override { return "Generate motions with any trained generator, into a motion archive"; }
  std::string description() const override {
    return "The model file says which kind of generator it holds, on which body and at which rate. Each clip has a random stream of its own: clip 7 of a seed is the same "
           "motion whether 8 or 8,000 are asked for, and whatever the number of threads. Contacts are labelled by the rule of the archive the model was trained on, or by the model where it knows about them. A --schedule is a tab-separated table with a "
           "header line: `start` in seconds, a column for each attribute that it sets, optional `end`, and `clip` for several schedules in one file; the clips carry it as segments.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"sample -m model.h5 -n 64 -o samples.h5", "64 motions, all combinations of attributes equally"},
            {"sample -m model.h5 -n 10 --attr action=walking --attr gender=female --frames 600 -o walks.h5", "ten long walks"},
            {"sample -m model.h5 -n 8 --schedule walk-jog-walk.tsv -o changes.h5", "attributes that change at the table's times"},
            {"sample -m model.h5 -n 40 --attr action=lifting --frames 300 --stop-when-still -o lifts.h5", "each ends when it has come to rest"},
            {"sample -m lstm.h5 --init walk.h5 --frames 9000 -o long.h5", "five minutes from the first frame of a clip (train-lstm)"},
            {"sample -m model.h5 -n 8 -o - | render - -o strips.png", "straight to a picture"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, sections 3.3.2 and 5.1, Algorithm 2", "Wang, Chai, Xia 2018, sections 4.1.4, 5.1 and 5.4"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::none;
    t.output = cli::Output::file;
    t.random = true;
    t.network = true;
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }

  void options(CLI::App& app) override {
    app.add_option("-m,--model", model_, "trained model; '-' reads standard input")->required()->check(cli::path());
    app.add_option("-n,--count", count_, "motions in all; they take the schedules, then the combinations of attributes, in turn (default: 1, or one of each schedule)")->check(cli::whole(1, 100000000, "COUNT"));
    app.add_option("--frames", frames_, "frames of each motion (default: the model's)")->check(cli::whole(1, 1000000, "FRAMES"));
    app.add_option("--attr", attributes_, "NAME=VALUE to generate (repeatable; several values of a name are all used; default: all combinations trained on, equally)");
    app.add_option("--schedule", schedule_, "table of attributes over time; what it leaves open is as without it. Changes are moved to the model's nearest word")->check(cli::path("FILE.tsv"));
    CLI::Option* stop = app.add_flag("--stop-when-still", stop_, "end each motion where it comes to rest after having moved");
    app.add_option("--still-speed", stillness_.speed, "with --stop-when-still: impact-weighted joint speed under which a step is still, rad m/s")->needs(stop)->check(cli::positive("SPEED"))->capture_default_str();
    app.add_option("--still-seconds", stillness_.seconds, "with --stop-when-still: how long all steps have to be still; a quarter of a second of it is kept")->needs(stop)->check(cli::positive("SECONDS"))->capture_default_str();
    app.add_option("--init", init_, "archive whose clips' first frames to start from, in turn (lstm-gmm; default: frames of its training data)")->check(cli::path("ARCHIVE"));
    app.add_option("--init-state", init_state_, "the network's hidden state before the first frame: found from the first two frames by gradient descent, or zero, which makes the second frame jump (lstm-gmm)")
        ->check(cli::one_of({"estimate", "zero"}))->capture_default_str();
    app.add_option("--network-noise", network_noise_, "deviation of noise on the network's standardised input (lstm-gmm)")->check(cli::non_negative("DEVIATION"))->capture_default_str();
    app.add_option("--noise-scale", noise_scale_, "factor on the latent noise, or on the spread of a mixture: 1 samples the model, 0 follows its mean")->check(cli::non_negative("FACTOR"))->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    std::string digest;
    const store::ModelFile model = store::read_model(model_, &digest);
    const auto generator = generators::make_generator(model, model_);
    std::vector<HistoryInput> inputs = {tools::history_input(model_, digest)};
    generators::SampleSettings settings;
    settings.seed = context.seed();
    settings.threads = context.threads();
    settings.noise_scale = noise_scale_;
    if (!generator->starts_from_frames() && (!init_.empty() || init_state_ != "estimate" || network_noise_ > 0))
      refuse_usage("--init, --init-state and --network-noise, expected a generator that starts from frames (lstm-gmm); " + model_ + " holds a model of kind " + generator->kind());
    if (!init_.empty()) {
      if (init_ == "-" && model_ == "-") refuse_usage("-m - and --init -: expected one of them to be a file");
      const store::ArchiveReader reader(init_, store::Caching::in_order);
      inputs.push_back(tools::history_input(init_, reader.file_sha256()));
      for (std::size_t i = 0; i < reader.size() && settings.init.size() < static_cast<std::size_t>(count_.value_or(1)); ++i) {
        Clip clip = reader.read(i);
        settings.init.push_back(clip.frames() > 2 && !clip.contacts.empty() ? cut(clip, 0, 2) : std::move(clip));  // contacts are found in all of a clip
      }
      if (settings.init.empty()) refuse({init_, 0, {}}, "0 clips, expected at least one to start from");
    }
    settings.estimate_state = init_state_ == "estimate";
    settings.network_noise = network_noise_;
    std::vector<Plan> plans;
    if (schedule_.empty()) {
      for (auto& attributes : chosen_combinations(*generator, {})) plans.push_back({{}, std::move(attributes), {}, frames_.value_or(generator->default_frames())});
    } else {
      if (schedule_ == "-" && model_ == "-") refuse_usage("-m - and --schedule -: expected one of them to be a file");
      const auto schedules = formats::AttributeSchedules::read(schedule_);
      inputs.push_back(tools::history_input(schedule_, schedules.sha256()));
      plans = scheduled(*generator, schedules);
    }
    const std::int64_t count = count_.value_or(static_cast<std::int64_t>(schedules_));
    std::int64_t longest = 1;
    for (const Plan& plan : plans) longest = std::max(longest, plan.frames);

    store::ArchiveHeader header;
    header.skeleton = generator->skeleton();
    header.frame_rate_hz = generator->frame_rate_hz();
    header.contacts_rule = generator->contacts_rule().starts_with("preset:") || generator->contacts_rule() == "model" ? generator->contacts_rule() : "";
    header.history = model.history;
    header.history.push_back(context.history_entry(std::move(inputs)));
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);

    const int digits = static_cast<int>(std::to_string(count - 1).size());
    std::int64_t stopped = 0;
    // Bounded memory: about a million frames at a time, or one motion where it alone has more.
    const std::int64_t portion = std::max<std::int64_t>(1, 1000000 / longest);
    for (std::int64_t first = 0; first < count; first += portion) {
      std::vector<generators::ClipOrder> orders;
      for (std::int64_t i = first; i < std::min(first + portion, count); ++i) {
        const Plan& plan = plans[static_cast<std::size_t>(i) % plans.size()];
        generators::ClipOrder order;
        order.attributes = plan.attributes;
        if (plan.name.empty())
          for (const auto& [key, value] : order.attributes) order.name += value + "-";
        else
          order.name = plan.name + "-";
        if (order.name.empty()) order.name = "motion-";  // of a model without attributes
        order.name += fmt::format("{:0{}}", i, digits);
        order.frames = plan.frames;
        order.stream = static_cast<std::uint64_t>(i);
        order.schedule = plan.changes;
        orders.push_back(std::move(order));
      }
      std::vector<Clip> made;
      try {
        made = generator->sample(orders, settings);
      } catch (const Error& e) {
        if (settings.init.empty() || e.status() != Exit::data) throw;
        throw e.in_file(init_ == "-" ? "<stdin>" : init_);
      }
      for (const Clip& clip : made) {
        const std::size_t kept = stop_ ? metrics::frames_until_still(clip, stillness_) : clip.frames();
        if (kept == clip.frames()) {
          writer.add(clip);
          continue;
        }
        Clip ended = cut(clip, 0, kept);
        ended.source = clip.source;  // there is no file that it is a part of
        writer.add(ended);
        ++stopped;
      }
      context.progress(static_cast<std::size_t>(std::min(first + portion, count)), static_cast<std::size_t>(count), "motions");
    }
    writer.finish();
    if (stop_) log::info("{} of {} motions came to rest and end there", stopped, count);
    return Exit::ok;
  }

 private:
  struct Plan {  // what every so many motions are made by
    std::string name;
    Attributes attributes;
    std::vector<generators::AttributeChange> changes;
    std::int64_t frames = 0;
  };

  static std::string text(const Attributes& attributes) {
    std::string list;
    for (const auto& [name, value] : attributes) list += (list.empty() ? "" : " ") + name + "=" + value;
    return list;
  }

  // The schedules in turn, each with the first choice of what it leaves open, then each with the second, and so on.
  std::vector<Plan> scheduled(const generators::Generator& generator, const formats::AttributeSchedules& schedules) {
    const std::string file = schedule_ == "-" ? "<stdin>" : schedule_;
    const auto& vocabulary = generator.vocabulary();
    for (const auto& name : schedules.attributes())
      if (!vocabulary.contains(name)) refuse({file, schedules.header_line(), name}, "the model knows no attribute '" + name + "', expected " + listed(vocabulary));
    const std::int64_t step = generator.schedule_step();
    const double rate = generator.frame_rate_hz();
    schedules_ = schedules.all().size();
    std::vector<std::vector<Plan>> of_schedule;
    std::set<Attributes> warned;
    std::size_t most = 0;
    for (const auto& schedule : schedules.all()) {
      for (const auto& row : schedule.rows)
        for (const auto& [name, value] : row.attributes) {
          const auto& known = vocabulary.at(name);
          if (std::find(known.begin(), known.end(), value) == known.end()) refuse({file, row.line, name}, "the model was not trained on '" + value + "', expected " + listed(known));
        }
      const Attributes& given = schedule.rows[0].attributes;
      if (schedule.end_s && frames_) refuse_usage("--frames and a schedule whose last row has an end, expected one of them");
      const double length = schedule.end_s ? std::round(*schedule.end_s * rate) : static_cast<double>(frames_.value_or(generator.default_frames()));
      if (!(length >= 1 && length <= 1000000)) refuse({file, schedule.rows.back().line, "end"}, fmt::format("{} frames, expected between 1 and 1000000", length));
      const auto frames = static_cast<std::int64_t>(length);
      std::vector<std::int64_t> starts;
      for (const auto& row : schedule.rows) {
        if (row.start_s * rate >= length)
          refuse({file, row.line, "start"}, fmt::format("{} s, expected a time within the {} frames ({:.6g} s) of the motion", row.start_s, frames, length / rate), "--frames makes it longer, or an end in the last row");
        starts.push_back(std::llround(row.start_s * rate / static_cast<double>(step)) * step);
        if (starts.size() > 1 && starts.back() <= starts[starts.size() - 2])
          refuse({file, row.line, "start"}, fmt::format("{} s falls on the same word of the model as the row before, expected a step of {:.6g} s or more", row.start_s, static_cast<double>(step) / rate));
      }
      std::vector<Plan> plans;
      for (const Attributes& first : chosen_combinations(generator, given)) {
        Plan plan{schedule.clip.empty() ? "schedule" : schedule.clip, first, {}, frames};
        for (std::size_t k = 0; k < schedule.rows.size(); ++k) {
          Attributes now = first;
          for (const auto& [name, value] : schedule.rows[k].attributes) now[name] = value;
          const auto& trained = generator.combinations();
          if (std::find(trained.begin(), trained.end(), now) == trained.end() && warned.insert(now).second)
            log::warn("{}:{}: no motion with {} together was trained on: what the model makes of it is a guess", file, schedule.rows[k].line, text(now));
          if (k == 0)
            plan.attributes = now;
          else if (starts[k] < frames)
            plan.changes.push_back({starts[k], std::move(now)});
          else if (plans.empty())
            log::warn("{}:{}: {} s is less than half a word of the model before the motion's end: the row changes nothing", file, schedule.rows[k].line, schedule.rows[k].start_s);
        }
        plans.push_back(std::move(plan));
      }
      most = std::max(most, plans.size());
      of_schedule.push_back(std::move(plans));
    }
    std::vector<Plan> all;
    for (std::size_t k = 0; k < most; ++k)
      for (const auto& plans : of_schedule) all.push_back(plans[k % plans.size()]);
    return all;
  }

  static std::string listed(const std::vector<std::string>& values) {
    std::string list;
    for (const auto& v : values) list += (list.empty() ? "" : ", ") + v;
    return list;
  }
  static std::string listed(const std::map<std::string, std::vector<std::string>>& vocabulary) {
    if (vocabulary.empty()) return "none: it was trained without attributes";
    std::vector<std::string> names;
    for (const auto& [name, values] : vocabulary) names.push_back(name);
    return listed(names);
  }

  // Every combination that was trained on, or those of them that --attr names. A schedule gives some from the start on: where no
  // combination trained on has them, they replace the values of those that there are.
  std::vector<Attributes> chosen_combinations(const generators::Generator& generator, const Attributes& given) const {
    std::map<std::string, std::vector<std::string>> chosen;
    for (const auto& pair : attributes_) {
      const auto equals = pair.find('=');
      if (equals == std::string::npos || equals == 0) refuse_usage("--attr " + pair + ", expected NAME=VALUE");
      const std::string key = pair.substr(0, equals), value = pair.substr(equals + 1);
      const auto known = generator.vocabulary().find(key);
      if (known == generator.vocabulary().end()) refuse_usage("--attr " + pair + ": the model knows no attribute '" + key + "', expected " + listed(generator.vocabulary()));
      if (std::find(known->second.begin(), known->second.end(), value) == known->second.end())
        refuse_usage("--attr " + pair + ": the model was not trained on '" + value + "', expected " + listed(known->second));
      if (given.contains(key)) refuse_usage("--attr " + pair + ": the schedule sets " + key + " from the start on, expected it from one of them");
      chosen[key].push_back(value);
    }
    const auto matching = [&](bool also_given) {
      std::vector<Attributes> all;
      for (const auto& combination : generator.combinations()) {
        const auto wanted = [&](const auto& item) {
          if (const auto at = given.find(item.first); at != given.end()) return !also_given || at->second == item.second;
          const auto it = chosen.find(item.first);
          return it == chosen.end() || std::find(it->second.begin(), it->second.end(), item.second) != it->second.end();
        };
        if (!std::all_of(combination.begin(), combination.end(), wanted)) continue;
        Attributes attributes = combination;
        for (const auto& [name, value] : given) attributes[name] = value;
        if (std::find(all.begin(), all.end(), attributes) == all.end()) all.push_back(std::move(attributes));
      }
      return all;
    };
    std::vector<Attributes> all = matching(true);
    if (all.empty() && !given.empty()) all = matching(false);
    if (all.empty()) {
      std::string list;
      for (const auto& combination : generator.combinations()) list += (list.empty() ? "" : "; ") + text(combination);
      refuse_usage("no motion with these attributes together was trained on, expected one of " + list);
    }
    return all;
  }

  std::string model_, schedule_, init_, init_state_ = "estimate";
  double network_noise_ = 0;
  std::optional<std::int64_t> count_, frames_;
  std::size_t schedules_ = 1;
  bool stop_ = false;
  metrics::Stillness stillness_;
  std::vector<std::string> attributes_;
  double noise_scale_ = 1;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Sample>(argc, argv); }
