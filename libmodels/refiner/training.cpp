#include "libmodels/refiner/training.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmodels/nn/sharded.hpp"
#include "libmodels/train/rmsprop.hpp"
#include "libmodels/train/tensors.hpp"

namespace mocap::refiner {
namespace {

using Json = nlohmann::json;
using torch::Tensor;

enum Draw : std::uint64_t { kReal = 101, kGenerated = 102, kNoise = 103, kBuffer = 104, kFill = 105 };  // the networks draw their weights from the streams below
enum Balance : std::int64_t { kRatio = 0, kSince = 1, kLoss = 2, kFigures = 3 };

// The log's columns: those of the other network keep what they were.
constexpr std::array kTerms = {"adversarial", "root", "contact", "discriminator", "accuracy_refined", "accuracy_real", "ratio"};

constexpr std::int64_t kMostBatchFrames = 1 << 20;
constexpr double kRemembered = 0.9;  // of the discriminator's mean loss from one of its updates to the next
const double kUndecided = std::log(2.0);

Tensor soft_plus(const Tensor& x) { return torch::nn::functional::softplus(x); }

}  // namespace

TrainingConfig TrainingConfig::preset(const std::string& name) {
  TrainingConfig c;
  if (name == "small") {
    c.steps = 6000;
    c.ratio = 1;
    c.contact_weight = 10;
    c.full_rate = 0.5;
    c.gradient_limit = 5;
    c.refiner_rate = 3e-4;
    c.discriminator_rate = 1e-3;
  } else if (name != "paper") {
    refuse_usage(fmt::format("preset '{}', expected paper or small", name));
  }
  return c;
}

void TrainingConfig::validate() const {
  const auto positive = [](const char* name, double v) {
    if (!(std::isfinite(v) && v > 0)) refuse_usage(fmt::format("{} is {}, expected a number above 0", name, v));
  };
  positive("steps", static_cast<double>(steps));
  positive("buffer", static_cast<double>(buffer));
  positive("refiner's learning rate", refiner_rate);
  positive("discriminator's learning rate", discriminator_rate);
  if (batch < 2 || batch % 2) refuse_usage(fmt::format("a batch of {}, expected an even number: a half comes from the buffer", batch));
  if (buffer < batch / 2) refuse_usage(fmt::format("a buffer of {} motions, expected at least half of the batch of {}", buffer, batch));
  if (window < 2) refuse_usage(fmt::format("a window of {} frames, expected at least 2", window));
  if (window > kMostBatchFrames / std::max(batch, buffer)) refuse_usage(fmt::format("{} windows of {} frames, expected at most {} frames in all", std::max(batch, buffer), window, kMostBatchFrames));
  if (beginning < 0) refuse_usage(fmt::format("{} updates in the beginning, expected 0 or more", beginning));
  if (!(root_weight >= 0 && std::isfinite(root_weight))) refuse_usage(fmt::format("root weight is {}, expected 0 or more", root_weight));
  if (!(contact_weight >= 0 && std::isfinite(contact_weight))) refuse_usage(fmt::format("contact weight is {}, expected 0 or more", contact_weight));
  if (!(full_rate >= 0 && full_rate <= 1)) refuse_usage(fmt::format("rates that fall from {} of the updates on, expected a share from 0 to 1", full_rate));
  if (!(gradient_limit >= 0 && std::isfinite(gradient_limit))) refuse_usage(fmt::format("gradient limit is {}, expected 0 or more", gradient_limit));
  if (!(contact_noise >= 0 && std::isfinite(contact_noise))) refuse_usage(fmt::format("contact noise is {}, expected 0 or more", contact_noise));
  if (!(ratio >= 1 && ratio <= most_ratio)) refuse_usage(fmt::format("{} refiner updates for one of the discriminator, expected 1 to {}", ratio, most_ratio));
  if (shards < 1 || shards > batch / 2) refuse_usage(fmt::format("{} shards of a batch of {}, expected between 1 and half of the batch", shards, batch));
}

Json to_json(const TrainingConfig& c) {
  return Json{{"steps", c.steps},
              {"batch", c.batch},
              {"window", c.window},
              {"buffer", c.buffer},
              {"beginning", c.beginning},
              {"ratio", Json{{"begin", c.ratio}, {"most", c.most_ratio}, {"low_loss", c.low_loss}, {"high_loss", c.high_loss}}},
              {"root_weight", c.root_weight},
              {"contact_weight", c.contact_weight},
              {"contact_noise", c.contact_noise},
              {"learning_rate", Json{{"refiner", c.refiner_rate}, {"discriminator", c.discriminator_rate}, {"full", c.full_rate}}},
              {"rmsprop_decay", c.rmsprop_decay},
              {"gradient_limit", c.gradient_limit},
              {"shards", c.shards},
              {"seed", c.seed}};
}

RefinerTraining::RefinerTraining(RefinerConfig network, TrainingConfig config, const train::StateDataset& real, const train::StateDataset& generated, Json generator)
    : network_(network), config_(config), real_(real), generated_(generated), generator_(std::move(generator)), end_effectors_(real.reference()) {
  config_.validate();
  if (generated.mean() != real.mean() || generated.deviation() != real.deviation()) throw Error(Exit::internal, {}, "refiner: generated motion standardised by other statistics than the real");
  network_.features = real.columns();
  network_.effectors = end_effectors_.count();
  refiner_ = std::make_unique<RefinerNetwork>(network_, config_.seed);
  discriminator_ = std::make_unique<Discriminator>(network_, config_.seed);
  // Statistics of the end effectors over all real frames that have one before them.
  Tensor sum = torch::zeros({6 * end_effectors_.count()}, torch::kDouble), squares = sum.clone();
  double frames = 0;
  for (const auto& clip : real.clips()) {
    const Tensor e = end_effectors_(clip.rows.unsqueeze(1)).squeeze(1).narrow(0, 1, clip.rows.size(0) - 1).to(torch::kDouble);
    sum += e.sum(0);
    squares += e.square().sum(0);
    frames += static_cast<double>(e.size(0));
  }
  effector_mean_ = (sum / frames).to(torch::kFloat);
  effector_deviation_ = (squares / frames - (sum / frames).square()).clamp_min(0).sqrt().clamp_min(1e-2).to(torch::kFloat);  // a centimetre, or a centimetre a second
  balance_ = torch::zeros({kFigures + static_cast<std::int64_t>(kTerms.size())});
  balance_[kRatio] = config_.ratio;
  balance_[kLoss] = kUndecided;
  const torch::NoGradGuard no_grad;
  const Tensor first = windows(generated_, config_.buffer, stream_of(kFill, 0));
  buffer_ = torch::empty({config_.buffer, config_.window, network_.columns()});
  const auto packed = std::make_shared<nn::PackedLstmCell>(*refiner_->lstm, false);
  for (std::int64_t at = 0; at < config_.buffer; at += config_.batch) {
    const std::int64_t count = std::min(config_.batch, config_.buffer - at);
    buffer_.narrow(0, at, count).copy_(refined(first.narrow(1, at, count), packed).transpose(0, 1));
  }
  (void)windows(real_, 1, 0);  // refused now rather than in the first step
}

// A padded window would show a pose that glides on, which is what the discriminator has to find: only whole ones are drawn.
Tensor RefinerTraining::windows(const train::StateDataset& data, std::int64_t count, std::uint64_t stream) const {
  return train::draw_states(data, count, config_.window, config_.seed, stream, train::ShortClips::left_out).rows;
}

Tensor RefinerTraining::standardised(const Tensor& effectors) const { return (effectors - effector_mean_) / effector_deviation_; }

Tensor RefinerTraining::effectors(const Tensor& rows) const { return standardised(end_effectors_(rows)); }

Tensor RefinerTraining::refined(const Tensor& rows, std::shared_ptr<const nn::PackedLstmCell> packed) const {
  return refiner_->forward(rows, effectors(rows), torch::zeros({rows.size(1), 2 * network_.hidden}), std::move(packed)).rows;
}

store::ModelFile RefinerTraining::describe() const {
  store::ModelFile file;
  file.kind = "refiner";
  file.config = Json{{"network", refiner::to_json(network_)},
                     {"training", refiner::to_json(config_)},
                     {"features", "state"},
                     {"frame_rate_hz", real_.header().frame_rate_hz},
                     {"contacts", real_.contacts_rule()},
                     {"effectors", end_effectors_.names()},
                     {"generator", generator_}}
                    .dump();
  file.skeleton = real_.header().skeleton;
  file.mean = real_.mean();
  file.deviation = real_.deviation();
  file.train_sources = real_.sources();
  file.weights["effectors/mean"] = train::to_stored(effector_mean_);
  file.weights["effectors/deviation"] = train::to_stored(effector_deviation_);
  return file;
}

std::string RefinerTraining::identity() const {
  return Json{{"kind", "refiner"}, {"data", real_.digest()}, {"generated", generated_.digest()}, {"generator", generator_}, {"network", refiner::to_json(network_)}, {"training", refiner::to_json(config_)}}.dump();
}

train::NamedTensors RefinerTraining::parameters() {
  train::NamedTensors all;
  for (auto& [name, tensor] : nn::parameters_by_path(*refiner_)) all.emplace_back("refiner/" + name, tensor);
  for (auto& [name, tensor] : nn::parameters_by_path(*discriminator_)) all.emplace_back("discriminator/" + name, tensor);
  return all;
}

std::unique_ptr<train::Optimizer> RefinerTraining::optimizer() { return std::make_unique<train::RmsProp>(parameters(), train::RmsProp::Options{config_.rmsprop_decay, 1e-8}); }

double RefinerTraining::learning_rate(std::int64_t step) const {
  const double rate = discriminating_ ? config_.discriminator_rate : config_.refiner_rate, falls = config_.full_rate * static_cast<double>(config_.steps);
  if (static_cast<double>(step) < falls) return rate;
  return rate * static_cast<double>(config_.steps - step) / (static_cast<double>(config_.steps) - falls);
}

std::pair<std::size_t, std::size_t> RefinerTraining::trained() {
  const std::size_t first = refiner_->parameters().size(), second = discriminator_->parameters().size();
  return discriminating_ ? std::pair{first, second} : std::pair{std::size_t{0}, first};
}

train::NamedTensors RefinerTraining::memory() { return {{"buffer", buffer_}, {"balance", balance_}}; }

void RefinerTraining::prepare(std::int64_t step) {
  step_ = step;
  const auto stream = [&](Draw kind) { return stream_of(kind, static_cast<std::uint64_t>(step)); };
  discriminating_ = step < 2 * config_.beginning ? step % 2 == 0 : balance_[kSince].item<float>() >= balance_[kRatio].item<float>();
  packed_refiner_ = std::make_shared<nn::PackedLstmCell>(*refiner_->lstm);
  packed_discriminator_ = std::make_unique<Discriminator::Packed>(*discriminator_);
  if (!discriminating_) {
    fake_ = windows(generated_, config_.batch, stream(kGenerated));
    return;
  }
  const torch::NoGradGuard no_grad;
  const std::int64_t half = config_.batch / 2;
  const Tensor fresh = refined(windows(generated_, half, stream(kGenerated)), packed_refiner_);
  // Other motions of the buffer than those that the fresh ones replace would do as well: it is the same draw.
  Random random(config_.seed, stream(kBuffer));
  std::vector<std::int64_t> places(static_cast<std::size_t>(config_.buffer));
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<std::int64_t>(i);
  for (std::size_t i = 0; i < static_cast<std::size_t>(half); ++i) std::swap(places[i], places[i + random.below(places.size() - i)]);
  places.resize(static_cast<std::size_t>(half));
  const Tensor chosen = torch::tensor(places, torch::kLong);
  const Tensor old = buffer_.index_select(0, chosen).transpose(0, 1);
  fake_ = torch::stack({fresh, old}, 2).flatten(1, 2).contiguous();  // in turns, so that every shard has as many of both
  buffer_.index_copy_(0, chosen, fresh.transpose(0, 1).contiguous());
  truth_ = windows(real_, config_.batch, stream(kReal));
}

Tensor RefinerTraining::shard_loss(int shard, train::LossTerms& terms) {
  const auto [first, last] = nn::shard_range(config_.batch, config_.shards, shard);
  const std::int64_t count = last - first;
  const double all = static_cast<double>(config_.batch * config_.window);
  Random random(config_.seed, stream_of(kNoise, static_cast<std::uint64_t>(step_), static_cast<std::uint64_t>(shard)));
  const auto judged = [&](const Tensor& rows, const Tensor& effectors) {
    Tensor contacts = rows.narrow(2, network_.features, train::kContactBits);
    if (config_.contact_noise > 0) contacts = contacts + config_.contact_noise * nn::normal_tensor(contacts.sizes(), random);
    return discriminator_->forward(contacts, standardised(effectors), packed_discriminator_.get());
  };
  std::array<double, kTerms.size()> figures{};
  for (std::size_t i = 0; i < figures.size(); ++i) figures[i] = balance_[kFigures + static_cast<std::int64_t>(i)].item<float>() / static_cast<double>(config_.shards);
  figures[6] = balance_[kRatio].item<float>() / static_cast<double>(config_.shards);
  Tensor loss;
  const Tensor fake = fake_.narrow(1, first, count);
  if (discriminating_) {
    const Tensor real = truth_.narrow(1, first, count);
    const Tensor of_fake = judged(fake, end_effectors_(fake)), of_real = judged(real, end_effectors_(real));
    loss = (soft_plus(of_fake).sum() + soft_plus(-of_real).sum()) / (2 * all);
    figures[3] = loss.item<double>();
    figures[4] = (of_fake < 0).sum().item<double>() / all;
    figures[5] = (of_real > 0).sum().item<double>() / all;
  } else {
    const Tensor out = refiner_->forward(fake, effectors(fake), torch::zeros({count, 2 * network_.hidden}), packed_refiner_).rows;
    const Tensor points = end_effectors_(out);
    const Tensor adversarial = soft_plus(-judged(out, points)).sum() / all;
    const Tensor root = (root_path(out, real_.reference()) - root_path(fake, real_.reference())).square().sum() / all;
    loss = adversarial + config_.root_weight * root;
    figures[0] = adversarial.item<double>();
    figures[1] = root.item<double>();
    if (network_.contacts) {
      // The feet come first among the end effectors, left before right as the bits.
      const Tensor velocities = points.narrow(2, 3 * end_effectors_.count(), 3 * train::kContactBits).unflatten(2, {train::kContactBits, 3});
      const Tensor down = (out.detach().narrow(2, network_.features, train::kContactBits) >= 0.5).to(torch::kFloat);
      const Tensor contact = (down * velocities.square().sum(3)).sum() / (train::kContactBits * all);
      loss = loss + config_.contact_weight * contact;
      figures[2] = contact.item<double>();
    }
  }
  terms.clear();
  for (std::size_t i = 0; i < figures.size(); ++i) terms.emplace_back(kTerms[i], figures[i]);
  return loss;
}

void RefinerTraining::updated(const train::LossTerms& terms) {
  for (std::size_t i = 0; i < terms.size(); ++i) balance_[kFigures + static_cast<std::int64_t>(i)] = terms[i].second;
  if (step_ < 2 * config_.beginning) return;
  if (!discriminating_) {
    balance_[kSince] += 1;
    return;
  }
  balance_[kSince] = 0;
  const double loss = kRemembered * balance_[kLoss].item<float>() + (1 - kRemembered) * terms[3].second, ratio = balance_[kRatio].item<float>();
  balance_[kLoss] = loss;
  if (loss >= config_.low_loss && loss <= config_.high_loss) return;
  balance_[kRatio] = loss < config_.low_loss ? std::min(config_.most_ratio, 2 * ratio) : std::max(1.0, std::floor(ratio / 2));
  balance_[kLoss] = kUndecided;
}

}  // namespace mocap::refiner
