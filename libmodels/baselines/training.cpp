#include "libmodels/baselines/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"

namespace mocap::baselines {
namespace {

using Json = nlohmann::json;

// What a step draws, each kind from a stream of its own; the batches are those of a Motion Cell of the same seed.
enum Draw : std::uint64_t { kBatch = 1, kNoise = 2, kValidation = 3 };

constexpr std::int64_t kMostBatchFrames = 1 << 20;  // some gigabytes at the papers' sizes

}  // namespace

double InputNoise::at(double progress) const {
  const double full = ramp.at(progress);
  return ramp.to > 0 ? ramp.to * std::floor(levels * full / ramp.to + 1e-9) / levels : 0;
}

TrainingConfig TrainingConfig::of(Arch arch) {
  TrainingConfig c;
  if (arch == Arch::erd) {
    c.own_output.to = 0.5;
    c.input_noise.ramp.to = 0.2;
  }
  return c;
}

void TrainingConfig::validate() const {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("steps", static_cast<double>(steps));
  positive("batch", static_cast<double>(batch));
  positive("learning rate", learning_rate.rate);
  positive("gradient limit", gradient_limit);
  positive("input noise levels", input_noise.levels);
  if (!(std::isfinite(input_noise.ramp.to) && input_noise.ramp.to >= 0)) refuse_usage(fmt::format("input noise is {}, expected a deviation of 0 or more", input_noise.ramp.to));
  if (!(own_output.to >= 0 && own_output.to <= 1)) refuse_usage(fmt::format("own output is {}, expected a share in 0..1", own_output.to));
  if (shards < 1 || shards > batch) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and the batch", shards, batch));
  if (windows.empty() || windows.front().begin > 0) refuse_usage("no window length at the start of the training");
  for (const auto& w : windows) {
    if (w.frames < 1) refuse_usage(fmt::format("a window of {} frames, expected at least 1", w.frames));
    if (w.frames > kMostBatchFrames / batch)
      refuse_usage(fmt::format("{} clips of {} frames in a batch, expected at most {} frames in all", batch, w.frames, kMostBatchFrames));
  }
}

Json to_json(const TrainingConfig& c) {
  return Json{{"steps", c.steps},
              {"batch", c.batch},
              {"shards", c.shards},
              {"objective", objective::to_json(c.objective)},
              {"gradient_limit", c.gradient_limit},
              {"learning_rate", c.learning_rate},
              {"own_output", c.own_output},
              {"input_noise", c.input_noise},
              {"windows", c.windows},
              {"seed", c.seed}};
}

TrainingConfig training_config_from_json(const Json& j) {
  TrainingConfig c;
  try {
    j.at("steps").get_to(c.steps);
    j.at("batch").get_to(c.batch);
    j.at("shards").get_to(c.shards);
    c.objective = objective::objective_config_from_json(j.at("objective"));
    j.at("gradient_limit").get_to(c.gradient_limit);
    j.at("learning_rate").get_to(c.learning_rate);
    j.at("own_output").get_to(c.own_output);
    j.at("input_noise").get_to(c.input_noise);
    j.at("windows").get_to(c.windows);
    j.at("seed").get_to(c.seed);
  } catch (const Json::exception& e) {
    refuse({{}, 0, "config/training"}, std::string("not the settings of a training: ") + e.what());
  }
  return c;
}

BaselineTraining::BaselineTraining(BaselineConfig network, TrainingConfig config, const train::MotionDataset& data, const train::MotionDataset* validation)
    : config_(std::move(config)), data_(data), validation_(validation) {
  if (data.layout().representation != features::RotationRepresentation::quaternion)
    refuse_usage(fmt::format("{} with {}, expected quaternions, the only rotations it predicts", text(network.arch), features::text(data.layout().representation)));
  network.joints = data.layout().joints;
  network.attribute_classes.clear();
  for (const auto& [name, values] : data.vocabulary()) network.attribute_classes.push_back(static_cast<int>(values.size()));
  network.validate();
  config_.validate();
  network_ = std::make_unique<Network>(network, data.mean(), data.deviation(), config_.seed);
  objective_ = std::make_unique<objective::MotionObjective>(config_.objective, data);
  padding_ = train::identity_padding(data.layout(), data.mean(), data.deviation());
}

store::ModelFile BaselineTraining::describe() const {
  store::ModelFile file;
  file.kind = text(network_->config().arch);
  const auto& header = data_.header();
  // Initial states of combinations that never occurred are untrained: the model says which did.
  Json combinations = Json::array();
  for (const auto& [classes, clips] : data_.combinations()) combinations.push_back(classes);
  file.config = Json{{"network", baselines::to_json(network_->config())},
                     {"training", baselines::to_json(config_)},
                     {"representation", features::text(data_.layout().representation)},
                     {"frame_rate_hz", header.frame_rate_hz},
                     {"contacts", header.contacts_rule},
                     {"combinations", combinations},
                     {"default_frames", 140}}
                    .dump();
  file.skeleton = header.skeleton;
  file.mean = data_.mean();
  file.deviation = data_.deviation();
  file.train_sources = data_.sources();
  file.vocabulary = data_.vocabulary();
  return file;
}

std::string BaselineTraining::identity() const {
  return Json{{"kind", text(network_->config().arch)},
              {"data", data_.digest()},
              {"validation", validation_ ? validation_->digest() : ""},
              {"network", baselines::to_json(network_->config())},
              {"training", baselines::to_json(config_)}}
      .dump();
}

train::NamedTensors BaselineTraining::parameters() { return nn::parameters_by_path(*network_); }

std::int64_t BaselineTraining::steps_per_epoch() const { return (static_cast<std::int64_t>(data_.clips().size()) + config_.batch - 1) / config_.batch; }

void BaselineTraining::prepare(std::int64_t step) {
  step_ = step;
  const double progress = static_cast<double>(step) / static_cast<double>(config_.steps);
  own_output_ = config_.own_output.at(progress);
  input_noise_ = config_.input_noise.at(progress);
  std::int64_t frames = config_.windows.front().frames;
  for (const auto& stage : config_.windows)
    if (progress >= stage.begin) frames = stage.frames;
  batch_ = train::draw_batch(data_, config_.batch, frames, padding_, config_.seed, stream_of(kBatch, static_cast<std::uint64_t>(step)));
  real_frames_ = batch_.mask.sum().item<double>();
  packed_ = network_->pack();
}

torch::Tensor BaselineTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto& network = network_->config();
  const std::int64_t count = batch_.features.size(0), frames = batch_.features.size(1);
  const auto [first, last] = nn::shard_range(count, config_.shards, shard);
  const std::int64_t rows = last - first;
  const train::Batch part = train::rows(batch_, first, rows);
  Random random(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step_), static_cast<std::uint64_t>(shard)));
  NetworkInput input;
  input.x = part.features;
  input.classes = train::word_classes(part, 1);
  input.initial_noise = nn::normal_tensor({rows, network.state()}, random);
  if (own_output_ > 0) {
    input.replace = torch::empty({frames, rows}, torch::kBool);
    bool* replace = input.replace.data_ptr<bool>();
    for (std::int64_t i = 0; i < frames * rows; ++i) replace[i] = random.uniform() < own_output_;
  }
  if (input_noise_ > 0) input.input_noise = nn::normal_tensor({frames, rows, network.features()}, random).mul_(input_noise_);
  objective::Figures figures;
  const torch::Tensor loss = (*objective_)(network_->forward(input, packed_), part, figures).sum();
  const double real = std::max(1.0, real_frames_);
  terms = {{"loss_per_frame", loss.item<double>() / real},
           {"rotation_deg", figures.angle / real * 180 / std::numbers::pi},
           {"root", figures.root / real},
           {"velocity", figures.velocity / real},
           {"own_output", own_output_ / config_.shards},
           {"input_noise", input_noise_ / config_.shards}};
  return loss / static_cast<double>(count);
}

std::optional<double> BaselineTraining::validation_loss() {
  if (!validation_) return std::nullopt;
  const torch::NoGradGuard no_grad;
  const std::int64_t frames = config_.windows.back().frames;
  const auto packed = network_->pack();
  // Clips spread evenly over the set, at most 256 of them: the same ones every time.
  const std::size_t n = validation_->clips().size(), used = std::min<std::size_t>(n, 256);
  double loss = 0, counted = 0;
  for (std::size_t begin = 0; begin < used; begin += 64) {
    std::vector<std::size_t> indices;
    for (std::size_t i = begin; i < std::min(begin + 64, used); ++i) indices.push_back(i * n / used);
    const train::Batch batch = train::fixed_batch(*validation_, indices, frames, padding_);
    Random random(config_.seed, stream_of(kValidation, begin));
    NetworkInput input;
    input.x = batch.features;
    input.classes = train::word_classes(batch, 1);
    input.initial_noise = nn::normal_tensor({batch.features.size(0), network_->config().state()}, random);
    objective::Figures figures;
    loss += (*objective_)(network_->forward(input, packed), batch, figures).sum().item<double>();
    counted += batch.mask.sum().item<double>();
  }
  return counted > 0 ? std::optional(loss / counted) : std::nullopt;
}

}  // namespace mocap::baselines
