// classify - label clips of a motion archive with a trained classifier.
#include <fmt/core.h>

#include <algorithm>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/tool.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmocap/store/archive.hpp"
#include "libmodels/classifier/classifier.hpp"
#include "libmodels/classifier/confusion.hpp"
#include "libmodels/nn/blas.hpp"

namespace {

using namespace mocap;

class Classify final : public cli::Tool {
 public:
  std::string name() const override { return "classify"; }
  std::string synopsis() const override { return "Label the unlabelled clips of a motion archive with a trained classifier, and say how often it is right"; }
  std::string description() const override {
    return "With -o, clips that lack the classifier's attribute get the most probable class, and the probabilities of all clips are kept in the archive "
           "(/clips/attribute_probability); selecting, merging and splitting keep them too. Accuracy and confusion are found over the clips that were labelled before, which "
           "keep their labels unless --all is given. The report goes to standard output unless the archive does.";
  }
  std::vector<cli::Example> examples() const override {
    return {{"classify all.h5 -m action.h5 -o labelled.h5", "labels for what has none"},
            {"classify test.h5 -m action.h5 --json", "accuracy and confusion alone"},
            {"sample -m model.h5 -n 64 -o - | classify - -m action.h5", "does generated motion look like what was asked for?"}};
  }
  std::vector<std::string> references() const override { return {"Ghorbani et al. 2020, sections 3.4 and 4.1"}; }
  cli::Traits traits() const override {
    cli::Traits t;
    t.inputs = cli::Inputs::one;
    t.output = cli::Output::file;
    t.output_required = false;
    t.network = true;
    t.report = true;
    t.input_help = "motion archive; '-' for standard input";
    t.output_help = "motion archive; '-' writes standard output";
    return t;
  }
  std::vector<std::string> version_lines() const override { return {nn::compute_libraries()}; }
  void options(CLI::App& app) override {
    app.add_option("-m,--model", model_, "classifier")->required()->check(cli::path());
    app.add_flag("--all", all_, "label all clips, also those that have a label");
    app.add_option("--min-probability", least_, "leave clips unlabelled whose most probable class is less probable")->check(cli::between(0, 1, "PROBABILITY"))->capture_default_str();
  }

  Exit run(cli::Context& context) override {
    nn::use_one_blas_thread();
    const std::string& output = context.common().output;
    const cli::InputFile& input = context.inputs().at(0);
    if (output == "-" && context.common().json) refuse_usage("--json and -o -: both would go to standard output, expected one of them");
    if (output.empty() && all_) refuse_usage("--all without -o, expected an archive to write labels to");
    if (model_ == "-" && input.path == "-") refuse_usage("-m - and the input -: expected one of them to be a file");
    std::string model_digest;
    const auto trained = classifier::Classifier::load(model_, &model_digest);
    const store::ArchiveReader reader(input.path);
    std::vector<Clip> clips;
    for (std::size_t i = 0; i < reader.size(); ++i) clips.push_back(reader.read(i));
    classifier::Judged judged;
    try {
      judged = trained->judge(clips, context.threads());
    } catch (const Error& e) {
      throw e.in_file(reader.name());
    }
    const auto found = classifier::confusion(*trained, clips, judged);
    if (!found.unknown.empty())
      log::warn("{} clips have a class of {} that the classifier does not know, {} the first of them: they count neither as right nor as wrong", found.unknown.size(), trained->attribute(), found.unknown[0]);

    const std::string& attribute = trained->attribute();
    std::size_t labelled = 0, doubtful = 0;
    for (std::size_t i = 0; i < clips.size(); ++i) {
      const std::size_t c = classifier::found_class(judged, i);
      auto& row = clips[i].attribute_probability[attribute];
      row.clear();
      for (std::size_t k = 0; k < trained->classes().size(); ++k) row[trained->classes()[k]] = static_cast<float>(judged.posteriors(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)));
      std::string& label = clips[i].attributes[attribute];
      if (!label.empty() && !all_) continue;
      if (judged.posteriors(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c)) < least_) {
        ++doubtful;
        continue;
      }
      label = trained->classes()[c];
      ++labelled;
    }
    if (!output.empty()) {
      store::ArchiveHeader header = reader.header();
      header.attributes.insert(attribute);
      header.attribute_classes[attribute] = trained->classes();
      header.history.push_back(context.history_entry({{input.label, reader.file_sha256()}, {model_ == "-" ? "<stdin>" : model_.substr(model_.rfind('/') + 1), model_digest}}));
      store::ArchiveWriter writer(output, context.overwrite(), header);
      for (const Clip& clip : clips) writer.add(clip);
      writer.finish();
      log::info("{} of {} clips labelled{}", labelled, clips.size(), doubtful > 0 ? fmt::format(", {} left: no class is probable enough", doubtful) : std::string());
    }
    if (output == "-") return Exit::ok;
    if (context.common().json) {
      auto document = found.to_json();
      document["attribute"] = attribute;
      if (!output.empty()) document["labelled"] = labelled;
      context.print(document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
    } else {
      context.print(found.to_text());
    }
    return Exit::ok;
  }

 private:
  std::string model_;
  bool all_ = false;
  double least_ = 0;
};

}  // namespace

int main(int argc, char** argv) { return mocap::cli::run<Classify>(argc, argv); }
