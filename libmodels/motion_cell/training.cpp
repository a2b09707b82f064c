#include "libmodels/motion_cell/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/sharded.hpp"

namespace mocap::motion_cell {
namespace {

using Json = nlohmann::json;

// What a step draws, each kind from a stream of its own.
enum Draw : std::uint64_t { kBatch = 1, kNoise = 2, kValidation = 3, kCorruption = 4 };

constexpr double kPaperWord = 3;                   // frames that the classifiers' loss counts once for
constexpr std::int64_t kMostBatchFrames = 1 << 20;  // some gigabytes at the paper's sizes

// (B, T) frame mask -> (B, N): a word counts while any of its frames is real.
torch::Tensor word_mask(const torch::Tensor& mask, std::int64_t word_length) { return mask.view({mask.size(0), -1, word_length}).amax(-1); }

constexpr std::array<std::pair<Exposure, const char*>, 4> kExposures = {
    {{Exposure::none, "none"}, {Exposure::own_output, "own-output"}, {Exposure::noise, "noise"}, {Exposure::joint_dropout, "joint-dropout"}}};

}  // namespace

Exposure parse_exposure(const std::string& name) {
  for (const auto& [e, known] : kExposures)
    if (name == known) return e;
  refuse_usage("exposure '" + name + "', expected none, own-output, noise or joint-dropout");
}

std::string text(Exposure exposure) {
  for (const auto& [e, name] : kExposures)
    if (exposure == e) return name;
  return {};
}

TrainingConfig TrainingConfig::preset(const std::string& name) {
  TrainingConfig c;
  c.objective.root_weight = 0.25;
  if (name == "paper") return c;
  if (name != "small") refuse_usage("preset '" + name + "', expected paper or small");
  c.epochs = 0;
  c.steps = 4000;
  c.batch = 32;
  c.objective.velocity_weight = 0.7;
  c.windows = {{0, 45}, {0.4, 90}, {0.7, 120}};
  c.pretraining.steps = 800;
  return c;
}

void TrainingConfig::validate(int word_length) const {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("steps", static_cast<double>(steps));
  positive("batch", static_cast<double>(batch));
  positive("reconstruction scale", reconstruction_scale);
  positive("learning rate", learning_rate.rate);
  positive("gradient limit", gradient_limit);
  const auto share = [](const char* name, double v, double most) {
    if (!(v >= 0 && v <= most)) refuse_usage(fmt::format("{} is {}, expected a number in 0..{}", name, v, most));
  };
  share("classifier weight", classifier_weight.to, 1e30);
  share("share of own output", own_output.to, 1);
  share("input noise", noise.to, 1e6);
  share("joint dropout", joint_dropout.to, 1);
  if (shards < 1 || shards > batch) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and the batch", shards, batch));
  if (windows.empty() || windows.front().begin > 0) refuse_usage("no window length at the start of the training");
  for (const auto& w : windows) {
    if (w.frames > kMostBatchFrames / batch)
      refuse_usage(fmt::format("{} clips of {} frames in a batch, expected at most {} frames in all", batch, w.frames, kMostBatchFrames));
    if (w.frames < word_length || w.frames % word_length != 0) refuse_usage(fmt::format("a window of {} frames, expected a multiple of the {} frames of a word", w.frames, word_length));
  }
  if (pretraining.steps < 0 || pretraining.steps > steps) refuse_usage(fmt::format("{} steps of word pretraining of {} in all", pretraining.steps, steps));
}

Json to_json(const TrainingConfig& c) {
  return Json{{"steps", c.steps},
              {"epochs", c.epochs},
              {"batch", c.batch},
              {"shards", c.shards},
              {"reconstruction_scale", c.reconstruction_scale},
              {"objective", objective::to_json(c.objective)},
              {"gradient_limit", c.gradient_limit},
              {"learning_rate", c.learning_rate},
              {"kl_weight", c.kl_weight},
              {"classifier_weight", c.classifier_weight},
              {"exposure", text(c.exposure)},
              {"own_output", c.own_output},
              {"noise", c.noise},
              {"joint_dropout", c.joint_dropout},
              {"windows", c.windows},
              {"pretraining", c.pretraining},
              {"seed", c.seed}};
}

TrainingConfig training_config_from_json(const Json& j) {
  TrainingConfig c;
  try {
    j.at("steps").get_to(c.steps);
    j.at("epochs").get_to(c.epochs);
    j.at("batch").get_to(c.batch);
    j.at("shards").get_to(c.shards);
    j.at("reconstruction_scale").get_to(c.reconstruction_scale);
    c.objective = objective::objective_config_from_json(j.at("objective"));
    j.at("gradient_limit").get_to(c.gradient_limit);
    j.at("learning_rate").get_to(c.learning_rate);
    j.at("kl_weight").get_to(c.kl_weight);
    j.at("classifier_weight").get_to(c.classifier_weight);
    const auto exposure = j.at("exposure").get<std::string>();
    const auto known = std::find_if(kExposures.begin(), kExposures.end(), [&](const auto& e) { return exposure == e.second; });
    if (known == kExposures.end()) refuse({{}, 0, "config/training"}, "exposure is '" + exposure + "', expected none, own-output, noise or joint-dropout");
    c.exposure = known->first;
    j.at("own_output").get_to(c.own_output);
    j.at("noise").get_to(c.noise);
    j.at("joint_dropout").get_to(c.joint_dropout);
    j.at("windows").get_to(c.windows);
    j.at("pretraining").get_to(c.pretraining);
    j.at("seed").get_to(c.seed);
  } catch (const Json::exception& e) {
    refuse({{}, 0, "config/training"}, std::string("not the settings of a training: ") + e.what());
  }
  return c;
}

MotionCellTraining::MotionCellTraining(MotionCellConfig network, TrainingConfig config, const train::MotionDataset& data, const train::MotionDataset* validation,
                                       const objective::ClassifierLoss* classifiers)
    : config_(std::move(config)), data_(data), validation_(validation), classifiers_(classifiers) {
  if (config_.steps == 0) config_.steps = config_.epochs * ((static_cast<std::int64_t>(data.clips().size()) + config_.batch - 1) / config_.batch);
  network.joints = data.layout().joints;
  network.rotation_values = data.layout().rotation_values();
  network.attribute_classes.clear();
  for (const auto& [name, values] : data.vocabulary()) network.attribute_classes.push_back(static_cast<int>(values.size()));
  network.validate();
  config_.validate(network.word_length);
  objective_ = std::make_unique<objective::MotionObjective>(config_.objective, data);
  cell_ = std::make_unique<MotionCell>(network, config_.seed);
  padding_ = train::identity_padding(data.layout(), data.mean(), data.deviation());
}

store::ModelFile MotionCellTraining::describe() const {
  store::ModelFile file;
  file.kind = "motion-cell";
  const auto& header = data_.header();
  // Initial states of combinations that never occurred are untrained: the model says which did.
  Json combinations = Json::array();
  for (const auto& [classes, clips] : data_.combinations()) combinations.push_back(classes);
  file.config = Json{{"network", motion_cell::to_json(cell_->config())},
                     {"training", motion_cell::to_json(config_)},
                     {"classifiers", classifiers_ ? classifiers_->to_json() : Json::array()},
                     {"representation", text(data_.layout().representation)},
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

std::string MotionCellTraining::identity() const {
  return Json{{"kind", "motion-cell"},
              {"data", data_.digest()},
              {"validation", validation_ ? validation_->digest() : ""},
              {"network", motion_cell::to_json(cell_->config())},
              {"representation", text(data_.layout().representation)},
              {"classifiers", classifiers_ ? classifiers_->to_json() : Json::array()},
              {"training", motion_cell::to_json(config_)}}
      .dump();
}

train::NamedTensors MotionCellTraining::parameters() { return nn::parameters_by_path(*cell_); }

std::int64_t MotionCellTraining::steps_per_epoch() const { return (static_cast<std::int64_t>(data_.clips().size()) + config_.batch - 1) / config_.batch; }

double MotionCellTraining::learning_rate(std::int64_t step) const {
  const auto& p = config_.pretraining;
  if (!pretraining(step)) return config_.learning_rate.at(step - p.steps, config_.steps - p.steps);
  return train::LearningRate{p.learning_rate, 0, p.final_factor, config_.learning_rate.warm_up}.at(step, p.steps);
}

MotionCellTraining::Weights MotionCellTraining::weights(std::int64_t step) const {
  if (pretraining(step)) return {config_.pretraining.kl_weight, 0, 0, 0};
  const double progress = static_cast<double>(step - config_.pretraining.steps) / static_cast<double>(config_.steps - config_.pretraining.steps);
  const auto exposure = [&] {
    switch (config_.exposure) {
      case Exposure::none: return 0.0;
      case Exposure::own_output: return config_.own_output.at(progress);
      case Exposure::noise: return config_.noise.at(progress);
      case Exposure::joint_dropout: return config_.joint_dropout.at(progress);
    }
    return 0.0;
  };
  return {config_.kl_weight.at(progress), classifiers_ ? config_.classifier_weight.at(progress) : 0, exposure(), progress};
}

void MotionCellTraining::prepare(std::int64_t step) {
  step_ = step;
  const Weights w = weights(step);
  std::int64_t frames = config_.windows.front().frames, count = config_.batch;
  for (const auto& stage : config_.windows)
    if (w.progress >= stage.begin) frames = stage.frames;
  if (pretraining(step)) {
    frames = cell_->config().word_length;
    count = std::max<std::int64_t>(config_.pretraining.batch, config_.shards);
  }
  batch_ = train::draw_batch(data_, count, frames, padding_, config_.seed, stream_of(kBatch, static_cast<std::uint64_t>(step)));
  real_frames_ = batch_.mask.sum().item<double>();
  real_words_ = word_mask(batch_.mask, cell_->config().word_length).sum().item<double>();
  packed_ = cell_->pack();
}

// What the encoder reads of a shard's features under `noise` and `joint_dropout`.
torch::Tensor MotionCellTraining::corrupted(const torch::Tensor& features, double amount, int shard) const {
  Random random(config_.seed, stream_of(kCorruption, static_cast<std::uint64_t>(step_), static_cast<std::uint64_t>(shard)));
  if (config_.exposure == Exposure::noise) return features + amount * nn::normal_tensor(features.sizes(), random);
  const auto& layout = data_.layout();
  torch::Tensor x = features.clone(torch::MemoryFormat::Contiguous);  // standardised: the mean is 0
  float* row = x.data_ptr<float>();
  for (std::int64_t frame = x.size(0) * x.size(1); frame-- > 0; row += layout.columns())
    for (int j = 0; j < layout.joints; ++j)
      if (random.uniform() < amount) std::fill_n(row + j * layout.rotation_values(), layout.rotation_values(), 0.0f);
  return x;
}

MotionCellTraining::Parts MotionCellTraining::objective(const train::Batch& batch, const CellInput& input, const Weights& w, std::shared_ptr<const PackedCell> packed) const {
  const auto& network = cell_->config();
  const CellOutput out = cell_->forward(input, std::move(packed));
  Parts parts;
  const torch::Tensor frames = (*objective_)(out.y, batch, parts.figures);
  const torch::Tensor words = word_mask(batch.mask, network.word_length), kl = (out.kl * words).sum();
  parts.loss = config_.reconstruction_scale * frames.sum() + w.kl * kl;
  parts.kl = kl.item<double>();
  parts.classifiers = 0;
  if (w.classifiers > 0) {
    const torch::Tensor seen = (*classifiers_)(out.y, batch) * words.sum();
    parts.loss = parts.loss + config_.reconstruction_scale * w.classifiers * network.word_length / kPaperWord * seen;
    parts.classifiers = seen.item<double>();
  }
  return parts;
}

torch::Tensor MotionCellTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto& network = cell_->config();
  const std::int64_t count = batch_.features.size(0), words = batch_.features.size(1) / network.word_length;
  const auto [first, last] = nn::shard_range(count, config_.shards, shard);
  const std::int64_t rows = last - first;
  const train::Batch part = train::rows(batch_, first, rows);
  const Weights w = weights(step_);
  Random random(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step_), static_cast<std::uint64_t>(shard)));
  CellInput input;
  const bool own = config_.exposure == Exposure::own_output;
  input.x = w.exposure > 0 && !own ? corrupted(part.features, w.exposure, shard) : part.features;
  input.classes = train::word_classes(part, network.word_length);
  input.posterior_noise = nn::normal_tensor({words, rows, network.latent}, random);
  input.initial_noise = nn::normal_tensor({rows, 2 * network.hidden}, random);
  if (w.exposure > 0 && own) {
    input.replace = torch::empty({words, rows}, torch::kBool);
    bool* replace = input.replace.data_ptr<bool>();
    for (std::int64_t i = 0; i < words * rows; ++i) replace[i] = random.uniform() < w.exposure;
  }
  const Parts parts = objective(part, input, w, packed_);
  const double frames = std::max(1.0, real_frames_);
  // The loop names the first that is not finite: what is made of the others comes last.
  terms = {{"rotation_deg", parts.figures.angle / frames * 180 / std::numbers::pi},
           {"distance", parts.figures.distance / frames},
           {"constraint", parts.figures.constraint / frames},
           {"root", parts.figures.root / frames},
           {"velocity", parts.figures.velocity / frames},
           {"kl_nats_per_word", parts.kl / std::max(1.0, real_words_)},
           {"classifiers", parts.classifiers / std::max(1.0, real_words_)},
           {"kl_weight", w.kl / config_.shards},
           {"classifier_weight", w.classifiers / config_.shards},
           {"exposure", w.exposure / config_.shards},
           {"loss_per_word", parts.loss.item<double>() / std::max(1.0, real_words_)}};
  return parts.loss / static_cast<double>(count);
}

std::optional<double> MotionCellTraining::validation_loss() {
  if (!validation_) return std::nullopt;
  const torch::NoGradGuard no_grad;
  const auto& network = cell_->config();
  const std::int64_t frames = config_.windows.back().frames, words = frames / network.word_length;
  const auto packed = cell_->pack();
  // Clips spread evenly over the set, at most 256 of them: the same ones every time.
  const std::size_t n = validation_->clips().size(), used = std::min<std::size_t>(n, 256);
  double loss = 0, counted = 0;
  for (std::size_t begin = 0; begin < used; begin += 64) {
    std::vector<std::size_t> indices;
    for (std::size_t i = begin; i < std::min(begin + 64, used); ++i) indices.push_back(i * n / used);
    const train::Batch batch = train::fixed_batch(*validation_, indices, frames, padding_);
    Random random(config_.seed, stream_of(kValidation, begin));
    CellInput input;
    input.x = batch.features;
    input.classes = train::word_classes(batch, network.word_length);
    input.posterior_noise = nn::normal_tensor({words, batch.features.size(0), network.latent}, random);
    input.initial_noise = nn::normal_tensor({batch.features.size(0), 2 * network.hidden}, random);
    const Parts parts = objective(batch, input, {1, 0, 0, 1}, packed);
    loss += parts.loss.item<double>();
    counted += word_mask(batch.mask, network.word_length).sum().item<double>();
  }
  return counted > 0 ? std::optional(loss / counted) : std::nullopt;  // per word
}

}  // namespace mocap::motion_cell
