#include "libmodels/train/loop.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/base/log.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/checkpoint.hpp"
#include "libmodels/train/log_file.hpp"
#include "libmodels/train/signals.hpp"

namespace mocap::train {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::json;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// A term that is not finite, or "the gradient".
std::string culprit(const LossTerms& terms, double loss) {
  for (const auto& [name, value] : terms)
    if (!std::isfinite(value)) return name;
  return std::isfinite(loss) ? "the gradient" : "the loss";
}

bool finished_before(Trainable& model, const std::string& output) {
  if (::access(output.c_str(), F_OK) != 0) return false;
  const store::ModelFile done = store::read_model(output);
  if (done.has_training) {
    const Json state = training_state_of(done, output);
    require_same_identity(model.identity(), state["identity"].dump(), output);
    return state["step"].get<std::int64_t>() >= model.steps();  // not a checkpoint copied to the output's name
  }
  const store::ModelFile expected = model.describe();
  const auto content = [](const store::ModelFile& m) {
    const Json config = Json::parse(m.config, [](int depth, Json::parse_event_t, Json&) { return depth < 32; }, false);
    return Json{{"kind", m.kind}, {"config", config.is_discarded() ? Json() : config}, {"data", m.train_sources}}.dump();
  };
  require_same_identity(content(expected), content(done), output);
  return true;
}

LoopResult run(Trainable& model, const LoopOptions& options, const std::function<void(const Progress&)>& on_progress) {
  if (options.output == "-") refuse_usage("a training writes a model, checkpoints and a log side by side, expected -o FILE, not '-'");
  Checkpoints checkpoints(options.output);
  const std::int64_t steps = model.steps(), per_epoch = std::max<std::int64_t>(1, model.steps_per_epoch());
  LoopResult result;
  if (options.resume && finished_before(model, options.output)) {
    log::info("{} is finished already", options.output);
    result.finished = true;
    result.step = steps;
    return result;
  }
  check_output(options.output, options.overwrite);
  if (!options.resume && checkpoints.exist()) {
    if (options.overwrite == Overwrite::refuse)
      throw Error(Exit::io, {checkpoints.path(1), 0, {}}, "a checkpoint of an earlier training exists", "continue it with --resume, or start over with -f");
    checkpoints.remove();
  }

  const NamedTensors named = model.parameters();
  std::vector<torch::Tensor> parameters;
  for (const auto& [name, tensor] : named) parameters.push_back(tensor);
  const auto optimizer = model.optimizer();
  std::int64_t step = 0;
  if (options.resume)
    if (const auto restored = checkpoints.restore(model, *optimizer)) {
      step = restored->state.at("step").get<std::int64_t>();
      log::info("continuing from {} at step {} of {}", restored->path, step, steps);
    }
  LogFile log_file(options.output + ".log.tsv", step);
  nn::ShardedGradient sharded(model.shards(), options.threads);
  const auto state = [&] { return Json{{"step", step}}; };
  const auto checkpoint = [&] {
    log_file.flush();
    checkpoints.write(model, *optimizer, state());
  };

  const std::int64_t begin = step;
  const auto start = Clock::now();
  auto last_checkpoint = start;
  while (step < steps) {
    if (stop_requested()) {
      checkpoint();
      result.step = step;
      return result;
    }
    model.prepare(step);
    std::vector<LossTerms> terms(static_cast<std::size_t>(model.shards()));
    const auto [first, count] = model.trained();
    const std::vector<torch::Tensor> trained(parameters.begin() + static_cast<std::ptrdiff_t>(first), parameters.begin() + static_cast<std::ptrdiff_t>(first + count));
    auto gradient = sharded.compute(trained, [&](int shard) {
      nn::ShardedGradient::Share share;
      LossTerms& mine = terms[static_cast<std::size_t>(shard)];
      share.loss = model.shard_loss(shard, mine);
      for (const auto& [name, value] : mine) share.figures.push_back(value);
      return share;
    });
    LossTerms sums = terms[0];
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i].second = gradient.figures[i];
    const bool by_entry = std::isfinite(model.entry_limit());
    const double norm = clip_gradients(gradient.gradients, by_entry ? std::numeric_limits<double>::infinity() : model.gradient_limit());
    if (by_entry) {
      clip_entries(gradient.gradients, model.entry_limit());
      clip_gradients(gradient.gradients, model.gradient_limit());
    }
    if (!std::isfinite(gradient.loss) || !std::isfinite(norm))
      throw Error(Exit::data, {options.output, 0, {}}, fmt::format("the training diverged at step {}: {} is not finite", step + 1, culprit(sums, gradient.loss)),
                  checkpoints.last().empty() ? "no checkpoint was written yet; try a smaller --learning-rate" : "last good checkpoint: " + checkpoints.last());
    const double rate = model.learning_rate(step);
    optimizer->step(gradient.gradients, rate, first);
    model.updated(sums);
    ++step;

    std::optional<double> validation;
    const bool epoch_end = step % per_epoch == 0;
    const std::int64_t epoch = (step + per_epoch - 1) / per_epoch;
    if (step == steps || (epoch_end && options.validate_epochs > 0 && epoch % options.validate_epochs == 0)) validation = model.validation_loss();
    log_file.write({step, epoch, rate, norm, gradient.loss, sums, validation});
    if (on_progress) on_progress({step, steps, gradient.loss, static_cast<double>(step - begin) / std::max(1e-9, seconds_since(start))});
    const bool due = seconds_since(last_checkpoint) > 60 * options.checkpoint_minutes ||
                     (epoch_end && options.checkpoint_epochs > 0 && epoch % options.checkpoint_epochs == 0);
    if (due && step < steps) {
      checkpoint();
      last_checkpoint = Clock::now();
    }
  }
  log_file.close();
  Json final_state = state();
  final_state["identity"] = Json::parse(model.identity());
  store::ModelFile file = assemble(model, options.weights_only ? nullptr : optimizer.get(), final_state);
  file.history = options.history;
  store::write_model(options.output, options.overwrite, file);
  checkpoints.remove();
  result.finished = true;
  result.step = step;
  return result;
}

}  // namespace

LoopResult train(Trainable& model, const LoopOptions& options, const std::function<void(const Progress&)>& on_progress) {
  try {
    return run(model, options, on_progress);
  } catch (const c10::Error& e) {  // LibTorch's own text carries a stack trace
    const std::string text = e.what_without_backtrace();
    throw Error(Exit::internal, {options.output, 0, {}}, text.substr(0, text.find('\n')));
  }
}

}  // namespace mocap::train
