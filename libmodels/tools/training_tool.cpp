#include "libmodels/tools/training_tool.hpp"

#include <fmt/core.h>

#include <filesystem>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmocap/cli/validators.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/train/signals.hpp"

namespace mocap::tools {

cli::Traits TrainingTool::traits() const {
  cli::Traits t;
  t.inputs = cli::Inputs::one;
  t.output = cli::Output::file;
  t.random = true;
  t.network = true;
  t.input_help = "motion archive to train on";
  t.output_help = "model file";
  return t;
}

std::vector<std::string> TrainingTool::version_lines() const { return {nn::compute_libraries()}; }

void TrainingTool::add_loop_options(CLI::App& app) {
  app.add_option("--shards", shards_, "parts of a batch computed side by side; part of the configuration, so that -j never changes the result")
      ->check(cli::whole(1, 1024, "PARTS"))->capture_default_str();
  app.add_flag("--resume", resume_, "continue from the newest checkpoint; start afresh where there is none");
  app.add_flag("--weights-only", weights_only_, "leave the optimiser's state out of the finished model (a third of the size)");
  app.add_option("--checkpoint-minutes", checkpoint_minutes_, "between checkpoints")->check(cli::positive("MINUTES"))->capture_default_str();
  app.add_option("--checkpoint-epochs", checkpoint_epochs_, "between checkpoints, besides the minutes; 0: by minutes alone")->check(cli::whole(0, 1000000000, "EPOCHS"))->capture_default_str();
  app.add_option("--val-epochs", val_epochs_, "between validations")->check(cli::whole(1, 1000000000, "EPOCHS"))->capture_default_str();
}

std::string TrainingTool::begin(cli::Context& context, const std::vector<std::string>& read) const {
  nn::use_one_blas_thread();
  const std::string &input = context.inputs().at(0).path, &output = context.common().output;
  std::error_code ignored;
  if (std::filesystem::equivalent(input, output, ignored)) refuse_usage("-o " + output + " is the archive to train on, expected another file");
  for (const std::string& path : read)
    if (!path.empty() && std::filesystem::equivalent(path, output, ignored)) refuse_usage("-o " + output + " is a file that the training reads, expected another file");
  return input;
}

Exit TrainingTool::train(cli::Context& context, train::Trainable& training, History history, std::vector<HistoryInput> inputs) const {
  train::LoopOptions loop;
  loop.output = context.common().output;
  loop.overwrite = context.overwrite();
  loop.resume = resume_;
  loop.weights_only = weights_only_;
  loop.threads = context.threads();
  loop.checkpoint_minutes = checkpoint_minutes_;
  loop.checkpoint_epochs = checkpoint_epochs_;
  loop.validate_epochs = val_epochs_;
  loop.history = std::move(history);
  loop.history.push_back(context.history_entry(std::move(inputs)));
  train::catch_stop_signals();
  const auto result = train::train(training, loop, [&](const train::Progress& p) {
    context.progress(static_cast<std::size_t>(p.step), static_cast<std::size_t>(p.steps), fmt::format("steps, loss {:.4g}", p.loss));
  });
  if (result.finished) return Exit::ok;
  log::info("stopped at step {} of {} with a checkpoint; run the same line with --resume to continue", result.step, training.steps());
  return Exit::interrupted;
}

}  // namespace mocap::tools
