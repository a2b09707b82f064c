#include "libmodels/lstm_gmm/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/features/state.hpp"
#include "libmodels/nn/losses.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/nn/rotations.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/rmsprop.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::lstm_gmm {
namespace {

using Json = nlohmann::json;
using torch::Tensor;

enum Draw : std::uint64_t { kBatch = 101, kNoise = 102, kStart = 103 };  // the network draws its weights from the streams below

constexpr std::int64_t kMostBatchFrames = 1 << 20;
constexpr std::int64_t kPiece = 4096;  // frames predicted at a time
constexpr std::int64_t kStarts = 64;  // pairs of frames that `sample` starts from where no clip is given

// What every frame but the first should be: (T - 1) B rows.
struct Pairs {
  Tensor input, next, contacts, mask;
};
Pairs pairs(const Tensor& rows, const Tensor& mask, std::int64_t features) {
  const std::int64_t t = rows.size(0) - 1, d = rows.size(2);
  const Tensor next = rows.narrow(0, 1, t).reshape({-1, d});
  return {rows.narrow(0, 0, t).reshape({-1, d}), next.narrow(1, 0, features), next.narrow(1, features, d - features), mask.narrow(0, 1, t).reshape({-1})};
}

}  // namespace

TrainingConfig TrainingConfig::preset(const std::string& name) {
  TrainingConfig c;
  if (name == "paper") {
    c.steps = 30000;
    c.decay_steps = 200;  // converged after 150 epochs
  } else if (name != "small") {
    refuse_usage(fmt::format("preset '{}', expected paper or small", name));
  }
  return c;
}

void TrainingConfig::validate() const {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("steps", static_cast<double>(steps));
  positive("batch", static_cast<double>(batch));
  positive("learning rate", rate);
  positive("decay steps", static_cast<double>(decay_steps));
  positive("derivative limit", derivative_limit);
  if (!(decay > 0 && decay <= 1)) refuse_usage(fmt::format("decay is {}, expected a factor above 0, at most 1", decay));
  if (!(std::isfinite(input_noise) && input_noise >= 0)) refuse_usage(fmt::format("input noise is {}, expected a deviation of 0 or more", input_noise));
  if (window < 1) refuse_usage(fmt::format("a window of {} frames, expected at least 1", window));
  if (window > kMostBatchFrames / batch) refuse_usage(fmt::format("{} clips of {} frames in a batch, expected at most {} frames in all", batch, window, kMostBatchFrames));
  if (shards < 1 || shards > batch) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and the batch", shards, batch));
}

Json to_json(const TrainingConfig& c) {
  return Json{{"steps", c.steps},
              {"batch", c.batch},
              {"window", c.window},
              {"input_noise", c.input_noise},
              {"learning_rate", Json{{"rate", c.rate}, {"decay", c.decay}, {"decay_steps", c.decay_steps}}},
              {"rmsprop_decay", c.rmsprop_decay},
              {"derivative_limit", c.derivative_limit},
              {"shards", c.shards},
              {"seed", c.seed},
              {"init_from", c.init_digest}};
}

LstmGmmTraining::LstmGmmTraining(LstmGmmConfig network, TrainingConfig config, const train::StateDataset& data, const train::StateDataset* validation)
    : config_(std::move(config)), data_(data), validation_(validation) {
  network.features = data.columns();
  network.contacts = train::kContactBits;
  config_.validate();
  network_ = std::make_unique<Network>(network, config_.seed);
}

void LstmGmmTraining::start_from(const Network& other) {
  if (!(other.config() == network_->config())) throw Error(Exit::internal, {}, "lstm-gmm: weights of another network's sizes");
  const torch::NoGradGuard no_grad;
  const auto from = other.parameters();
  auto to = network_->parameters();
  for (std::size_t i = 0; i < to.size(); ++i) to[i].copy_(from[i]);
}

store::ModelFile LstmGmmTraining::describe() const {
  store::ModelFile file;
  file.kind = "lstm-gmm";
  const auto& header = data_.header();
  file.config = Json{{"network", lstm_gmm::to_json(network_->config())},
                     {"training", lstm_gmm::to_json(config_)},
                     {"features", "state"},
                     {"frame_rate_hz", header.frame_rate_hz},
                     {"contacts", data_.contacts_rule()},
                     {"default_frames", 300}}
                    .dump();
  file.skeleton = header.skeleton;
  file.mean = data_.mean();
  file.deviation = data_.deviation();
  file.train_sources = data_.sources();
  const train::StateBatch starts = train::draw_states(data_, kStarts, 2, config_.seed, stream_of(kStart, 0));
  file.weights["start"] = train::to_stored(starts.rows.transpose(0, 1).contiguous());
  return file;
}

std::string LstmGmmTraining::identity() const {
  return Json{{"kind", "lstm-gmm"},
              {"data", data_.digest()},
              {"validation", validation_ ? validation_->digest() : ""},
              {"network", lstm_gmm::to_json(network_->config())},
              {"training", lstm_gmm::to_json(config_)}}
      .dump();
}

train::NamedTensors LstmGmmTraining::parameters() { return nn::parameters_by_path(*network_); }

std::unique_ptr<train::Optimizer> LstmGmmTraining::optimizer() { return std::make_unique<train::RmsProp>(parameters(), train::RmsProp::Options{config_.rmsprop_decay, 1e-8}); }

std::int64_t LstmGmmTraining::steps_per_epoch() const { return std::max<std::int64_t>(1, (data_.frames() + config_.batch * config_.window - 1) / (config_.batch * config_.window)); }

double LstmGmmTraining::learning_rate(std::int64_t step) const { return config_.rate * std::pow(config_.decay, static_cast<double>(step / config_.decay_steps)); }

void LstmGmmTraining::prepare(std::int64_t step) {
  step_ = step;
  batch_ = train::draw_states(data_, config_.batch, config_.window + 1, config_.seed, stream_of(kBatch, static_cast<std::uint64_t>(step)));
  real_ = batch_.mask.narrow(0, 1, config_.window).sum().item<double>();
  packed_ = std::make_unique<PackedNetwork>(*network_);
}

Tensor LstmGmmTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto& c = network_->config();
  const auto [first, last] = nn::shard_range(config_.batch, config_.shards, shard);
  const Pairs p = pairs(batch_.rows.narrow(1, first, last - first), batch_.mask.narrow(1, first, last - first), c.features);
  Random random(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step_), static_cast<std::uint64_t>(shard)));
  Tensor input = p.input.clone();
  if (config_.input_noise > 0) input.narrow(1, 0, c.features).add_(nn::normal_tensor({input.size(0), c.features}, random), config_.input_noise);
  const Mixture next = network_->mixture(network_->forward(input, torch::zeros({last - first, c.state()}), packed_.get()).y, input);
  const Tensor features = (feature_loss(next, p.next) * p.mask).sum() / real_, contacts = (contact_loss(next, p.contacts) * p.mask).sum() / real_;
  terms = {{"features_nats", features.item<double>()}, {"contacts_nats", contacts.item<double>()}};
  return features + contacts;
}

std::optional<double> LstmGmmTraining::validation_loss() {
  if (!validation_) return std::nullopt;
  return prediction(*network_, *validation_).nats;
}

Prediction prediction(const Network& network, const train::StateDataset& data) {
  const torch::NoGradGuard no_grad;
  const auto& c = network.config();
  const PackedNetwork packed(network, false);
  const std::int64_t joints = (c.features - features::kStateRootValues) / 3;
  const Tensor mean = torch::tensor(data.mean()), deviation = torch::tensor(data.deviation());
  const auto rotations = [&](const Tensor& x) {
    return nn::quaternions_of_vectors((x * deviation + mean).narrow(1, features::kStateRootValues, 3 * joints).reshape({-1, joints, 3}));
  };
  Prediction sums;
  double frames = 0;
  for (const auto& clip : data.clips()) {
    Tensor state = torch::zeros({1, c.state()});
    for (std::int64_t first = 0; first + 1 < clip.rows.size(0); first += kPiece) {  // memory does not grow with the clip
      const std::int64_t rows = std::min(kPiece + 1, clip.rows.size(0) - first);
      const Pairs p = pairs(clip.rows.narrow(0, first, rows).unsqueeze(1), torch::ones({rows, 1}), c.features);
      const auto out = network.forward(p.input, state, &packed);
      state = out.state;
      const Mixture next = network.mixture(out.y, p.input);
      const Tensor contacts = contact_loss(next, p.contacts), best = next.log_weights.argmax(1).view({-1, 1, 1}).expand({-1, 1, c.features});
      const Tensor real = rotations(p.next);
      const auto angle = [&](const Tensor& x) { return nn::geodesic_distance(rotations(x), real).mean(1).sum().item<double>(); };
      sums.nats += (feature_loss(next, p.next) + contacts).sum().item<double>();
      sums.contact_nats += contacts.sum().item<double>();
      sums.angle_deg += angle(next.means.gather(1, best).squeeze(1));
      sums.persistence_deg += angle(p.input.narrow(1, 0, c.features));
      sums.contact_errors += ((next.contact_logits > 0).to(torch::kFloat) - p.contacts).abs().sum().item<double>() / c.contacts;
      frames += static_cast<double>(p.next.size(0));
    }
  }
  const double degrees = 180 / std::numbers::pi;
  return {sums.nats / frames, sums.contact_nats / frames, sums.angle_deg / frames * degrees, sums.persistence_deg / frames * degrees, sums.contact_errors / frames};
}

}  // namespace mocap::lstm_gmm
