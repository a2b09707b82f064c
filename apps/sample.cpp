// sample - generate motion with a trained model.
#include <fmt/core.h>

#include <algorithm>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/generators/generator.hpp"
#include "libmodels/nn/blas.hpp"

namespace {

using namespace mocap;

class Sample final : public cli::Tool {
 public:
  std::string name() const override { return "sample"; }
  std::string synopsis() const override { return "Generate motions with any trained generator, into a motion archive"; }
  std::string description() const override {
    return "The model file says which kind of generator it holds, on which body and at which rate. Each clip has a random stream of its own: clip 7 of a seed is the same "
           "motion whether 8 or 8,000 are asked for, and whatever the number of threads. Contacts are labelled by the rule of the archive the model was trained on.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"sample -m model.h5 -n 64 -o samples.h5", "64 motions, all combinations of attributes equally"},
            {"sample -m model.h5 -n 10 --attr action=walking --attr gender=female --frames 600 -o walks.h5", "ten long walks"},
            {"sample -m model.h5 -n 8 -o - | render - -o strips.png", "straight to a picture"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, section 3.3.2 and Algorithm 2"}; }
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
    app.add_option("-n,--count", count_, "motions in all")->check(cli::whole(1, 100000000, "COUNT"))->capture_default_str();
    app.add_option("--frames", frames_, "frames of each motion (default: the model's)")->check(cli::whole(1, 1000000, "FRAMES"));
    app.add_option("--attr", attributes_, "NAME=VALUE to generate (repeatable; several values of a name are all used; default: all combinations trained on, equally)");
    app.add_option("--noise-scale", noise_scale_, "factor on the latent noise: 1 samples the model, 0 follows its mean")->check(cli::non_negative("FACTOR"))->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    std::string digest;
    const store::ModelFile model = store::read_model(model_, &digest);
    const auto generator = generators::make_generator(model, model_);
    const auto combinations = chosen_combinations(*generator);
    const std::int64_t frames = frames_.value_or(generator->default_frames());

    store::ArchiveHeader header;
    header.skeleton = generator->skeleton();
    header.frame_rate_hz = generator->frame_rate_hz();
    header.contacts_rule = generator->contacts_rule().starts_with("preset:") ? generator->contacts_rule() : "";
    header.history = model.history;
    header.history.push_back(context.history_entry({{model_ == "-" ? "<stdin>" : model_.substr(model_.rfind('/') + 1), digest}}));
    store::ArchiveWriter writer(context.common().output, context.overwrite(), header);

    generators::SampleSettings settings;
    settings.seed = context.seed();
    settings.threads = context.threads();
    settings.noise_scale = noise_scale_;
    const int digits = static_cast<int>(std::to_string(count_ - 1).size());
    // Bounded memory: about a million frames at a time, or one motion where it alone has more.
    const std::int64_t portion = std::max<std::int64_t>(1, 1000000 / frames);
    for (std::int64_t first = 0; first < count_; first += portion) {
      std::vector<generators::ClipOrder> orders;
      for (std::int64_t i = first; i < std::min(first + portion, count_); ++i) {
        generators::ClipOrder order;
        order.attributes = combinations[static_cast<std::size_t>(i) % combinations.size()];
        for (const auto& [key, value] : order.attributes) order.name += value + "-";
        order.name += fmt::format("{:0{}}", i, digits);
        order.frames = frames;
        order.stream = static_cast<std::uint64_t>(i);
        orders.push_back(std::move(order));
      }
      for (const Clip& clip : generator->sample(orders, settings)) writer.add(clip);
      context.progress(static_cast<std::size_t>(std::min(first + portion, count_)), static_cast<std::size_t>(count_), "motions");
    }
    writer.finish();
    return Exit::ok;
  }

 private:
  // Every combination that was trained on, or those of them that --attr names.
  std::vector<Attributes> chosen_combinations(const generators::Generator& generator) const {
    std::map<std::string, std::vector<std::string>> chosen;
    for (const auto& pair : attributes_) {
      const auto equals = pair.find('=');
      if (equals == std::string::npos || equals == 0) refuse_usage("--attr " + pair + ", expected NAME=VALUE");
      const std::string key = pair.substr(0, equals), value = pair.substr(equals + 1);
      const auto known = generator.vocabulary().find(key);
      std::string list;
      if (known == generator.vocabulary().end()) {
        for (const auto& [name, values] : generator.vocabulary()) list += (list.empty() ? "" : ", ") + name;
        refuse_usage("--attr " + pair + ": the model knows no attribute '" + key + "', expected " + list);
      }
      if (std::find(known->second.begin(), known->second.end(), value) == known->second.end()) {
        for (const auto& v : known->second) list += (list.empty() ? "" : ", ") + v;
        refuse_usage("--attr " + pair + ": the model was not trained on '" + value + "', expected " + list);
      }
      chosen[key].push_back(value);
    }
    std::vector<Attributes> all;
    for (const auto& combination : generator.combinations()) {
      const auto wanted = [&](const auto& item) {
        const auto it = chosen.find(item.first);
        return it == chosen.end() || std::find(it->second.begin(), it->second.end(), item.second) != it->second.end();
      };
      if (std::all_of(combination.begin(), combination.end(), wanted)) all.push_back(combination);
    }
    if (all.empty()) {
      std::string list;
      for (const auto& combination : generator.combinations()) {
        list += list.empty() ? "" : "; ";
        for (const auto& [name, value] : combination) list += (list.ends_with("; ") || list.empty() ? "" : " ") + name + "=" + value;
      }
      refuse_usage("no motion with these attributes together was trained on, expected one of " + list);
    }
    return all;
  }

  std::string model_;
  std::int64_t count_ = 1;
  std::optional<std::int64_t> frames_;
  std::vector<std::string> attributes_;
  double noise_scale_ = 1;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Sample>(argc, argv); }
