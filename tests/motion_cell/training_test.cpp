#include "libmodels/motion_cell/training.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "libmocap/base/error.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/loop.hpp"
#include "tests/motion_cell/reference.hpp"
#include "tests/objective/data.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::motion_cell {
namespace {

using features::RotationRepresentation;
using mocap::testing::slurp;
using mocap::testing::TemporaryFolder;
using torch::Tensor;
using train::MotionDataset;

// A few joints swing; action decides the frequency, side the sign. Lengths in frames.
Clip swinging(const std::string& name, std::size_t frames, int action, int side) {
  Clip clip;
  clip.name = name;
  clip.skeleton = canonical_body();
  const auto joints = static_cast<std::size_t>(clip.joints());
  for (std::size_t t = 0; t < frames; ++t) {
    const double phase = (0.15 + 0.1 * action) * static_cast<double>(t);
    for (std::size_t j = 0; j < joints; ++j)
      clip.rotations.push_back(exp_map(Vector3(0, j % 3 == 1 ? 0.5 * (side ? -1 : 1) * std::sin(phase + static_cast<double>(j)) : 0, j == 0 ? 0.1 * std::sin(phase) : 0)));
    clip.root_position.emplace_back(0.02 * (1 + action) * static_cast<double>(t), 0.02 * std::sin(phase), 0.9 + 0.02 * std::sin(2 * phase));
  }
  clip.attributes = {{"action", action ? "run" : "walk"}, {"side", side ? "left" : "right"}};
  return clip;
}

struct Data {
  TemporaryFolder folder;
  std::unique_ptr<MotionDataset> train, validation;
  // Some clips are shorter than the window, one a frame longer than whole words.
  explicit Data(const std::vector<std::size_t>& lengths = {60, 45, 12, 31}) {
    std::vector<Clip> clips, held_out;
    for (std::size_t i = 0; i < lengths.size(); ++i) clips.push_back(swinging(fmt::format("c{}", i), lengths[i], i / 2 % 2, i % 2));
    held_out.push_back(swinging("v", 40, 0, 0));
    mocap::testing::write_archive(folder / "train.h5", clips);
    mocap::testing::write_archive(folder / "val.h5", held_out);
    train = std::make_unique<MotionDataset>(folder / "train.h5", RotationRepresentation::quaternion, std::vector<std::string>{});
    validation = std::make_unique<MotionDataset>(folder / "val.h5", RotationRepresentation::quaternion, std::vector<std::string>{}, train.get());
  }
};
const Data& data() {
  static const Data d;
  return d;
}

MotionCellConfig tiny_network() {
  MotionCellConfig c;
  c.hidden = 16, c.width = 24, c.word = 12, c.latent = 6, c.control = 3;
  return c;
}

TrainingConfig tiny_training(std::int64_t steps = 40) {
  TrainingConfig c;
  c.steps = steps;
  c.batch = 6;
  c.shards = 2;
  c.objective.velocity_weight = 0.7;
  c.windows = {{0, 30}};
  c.learning_rate.warm_up = 5;
  return c;
}

double total_loss(MotionCellTraining& training, std::int64_t step) {
  training.prepare(step);
  double sum = 0;
  for (int s = 0; s < training.shards(); ++s) {
    train::LossTerms terms;
    sum += training.shard_loss(s, terms).item<double>();
  }
  return sum;
}

double term(MotionCellTraining& training, std::int64_t step, const std::string& name) {
  training.prepare(step);
  double sum = 0;
  bool found = false;
  for (int s = 0; s < training.shards(); ++s) {
    train::LossTerms terms;
    (void)training.shard_loss(s, terms);
    for (const auto& [key, value] : terms)
      if (key == name) sum += value, found = true;
  }
  EXPECT_TRUE(found) << name;
  return sum;
}

// The header's equations in plain double loops over Algorithm 1 in plain operations, on the batch and noise of a step.
// `garbage`: what the masked frames are replaced by on input and target.
double oracle(MotionCellTraining& training, const MotionDataset& set, const TrainingConfig& config, std::int64_t step, std::int64_t count, std::int64_t frames, double kl_weight,
              double own_output, std::optional<double> garbage = {}) {
  const MotionCell& cell = training.network();
  const MotionCellConfig& c = cell.config();
  const Tensor padding = train::identity_padding(set.layout(), set.mean(), set.deviation());
  train::Batch batch = train::draw_batch(set, count, frames, padding, config.seed, stream_of(1, static_cast<std::uint64_t>(step)));
  if (garbage) batch.features = torch::where(batch.mask.unsqueeze(-1) > 0, batch.features, torch::full({}, static_cast<float>(*garbage)));
  const auto alpha = impact_factors(*set.header().skeleton, config.objective.joint_weight_floor);
  const std::int64_t words = frames / c.word_length;
  double loss = 0;
  for (int shard = 0; shard < config.shards; ++shard) {
    const std::int64_t first = count * shard / config.shards, rows = count * (shard + 1) / config.shards - first;
    Random random(config.seed, stream_of(2, static_cast<std::uint64_t>(step), static_cast<std::uint64_t>(shard)));
    CellInput in;
    in.x = batch.features.narrow(0, first, rows);
    in.classes = batch.classes.narrow(0, first, rows);
    in.posterior_noise = nn::normal_tensor({words, rows, c.latent}, random);
    in.initial_noise = nn::normal_tensor({rows, 2 * c.hidden}, random);
    if (own_output > 0) {
      in.replace = torch::zeros({words, rows}, torch::kBool);
      for (std::int64_t i = 0; i < words * rows; ++i) in.replace.data_ptr<bool>()[i] = random.uniform() < own_output;
    }
    const torch::NoGradGuard no_grad;
    const CellOutput out = reference_forward(cell, in);
    const Tensor shard_mask = batch.mask.narrow(0, first, rows);
    const auto mask = shard_mask.accessor<float, 2>();
    const Tensor x = in.x.contiguous(), y = out.y.contiguous();
    const auto value = [&](const Tensor& t, std::int64_t b, std::int64_t frame, int column) {
      return static_cast<double>(t[b][frame][column].item<float>());
    };
    for (std::int64_t b = 0; b < rows; ++b) {
      const auto quaternion = [&](const Tensor& t, std::int64_t frame, int j) {
        Eigen::Vector4d q;
        for (int i = 0; i < 4; ++i) {
          const auto column = static_cast<std::size_t>(4 * j + i);
          q[i] = value(t, b, frame, 4 * j + i) * set.deviation()[column] + set.mean()[column];
        }
        return q;
      };
      for (std::int64_t t = 0; t < frames; ++t) {
        if (mask[b][t] == 0) continue;
        double frame_loss = 0;
        for (int j = 0; j < c.joints; ++j) {
          const Eigen::Vector4d q = quaternion(y, t, j), target = quaternion(x, t, j);
          const double a = alpha[static_cast<std::size_t>(j) + 1];
          frame_loss += a * 2 * std::acos(std::min(1.0, std::abs(q.normalized().dot(target.normalized()))));  // eq. 17, 22
          frame_loss += config.objective.unit_norm_weight * std::abs(q.squaredNorm() - 1);                                // eq. 26
          if (t > 0 && config.objective.velocity_weight > 0) {
            const auto error = [&](std::int64_t frame) {
              const Eigen::Vector4d unit = quaternion(y, frame, j).normalized(), goal = quaternion(x, frame, j);
              return Eigen::Vector4d((unit.dot(goal) < 0 ? -unit : unit) - goal);
            };
            frame_loss += config.objective.velocity_weight * a * 2 * std::sqrt((error(t) - error(t - 1)).squaredNorm() + 1e-8);
          }
        }
        for (int r = 0; r < 6; ++r) {
          const double weight = r == 4 || r == 5 ? *std::max_element(alpha.begin(), alpha.end()) : config.objective.root_weight;
          const auto error = [&](std::int64_t frame) { return value(x, b, frame, 4 * c.joints + r) - value(y, b, frame, 4 * c.joints + r); };
          const auto size = [](double e) { return std::sqrt(e * e + 1e-6) - 1e-3; };
          frame_loss += weight * size(error(t));
          if (t > 0) frame_loss += config.objective.velocity_weight * weight * size(error(t) - error(t - 1));
        }
        loss += config.reconstruction_scale * frame_loss;
      }
      for (std::int64_t n = 0; n < words; ++n)
        if (mask[b][n * c.word_length] > 0) loss += kl_weight * out.kl[b][n].item<double>();
    }
  }
  return loss / static_cast<double>(count);
}

TEST(Objective, EqualsItsEquations) {
  TrainingConfig config = tiny_training();
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr);
  // At the start the KL weight is 0.1; half way it is 1 and 4 of 5 words are the model's own.
  const double start = oracle(training, *data().train, config, 0, 6, 30, 0.1, 0);
  EXPECT_NEAR(total_loss(training, 0), start, 2e-5 * start);
  EXPECT_GT(start, 100);
  const double half = oracle(training, *data().train, config, 20, 6, 30, 1, 0.8);
  EXPECT_NEAR(total_loss(training, 20), half, 2e-5 * half);

  config.objective.velocity_weight = 0;
  MotionCellTraining still(tiny_network(), config, *data().train, nullptr);
  const double without = oracle(still, *data().train, config, 20, 6, 30, 1, 0.8);
  EXPECT_NEAR(total_loss(still, 20), without, 2e-5 * without);
  EXPECT_LT(without, half);
}

TEST(Objective, OfWordPretraining) {
  TrainingConfig config = tiny_training();
  config.pretraining.steps = 10;
  config.pretraining.batch = 20;
  config.pretraining.kl_weight = 0.3;
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr);
  const double expected = oracle(training, *data().train, config, 9, 20, 3, 0.3, 0);
  EXPECT_NEAR(total_loss(training, 9), expected, 2e-5 * expected);
  const double after = oracle(training, *data().train, config, 10, 6, 30, 0.1, 0);
  EXPECT_NEAR(total_loss(training, 10), after, 2e-5 * after);
}

// Clips of whole words: what stands behind them reaches no term. (A word that is half real is encoded with its padding.)
TEST(Objective, MaskedFramesDoNotCount) {
  const Data short_clips({12, 9, 15, 12});
  const TrainingConfig config = tiny_training();
  MotionCellTraining training(tiny_network(), config, *short_clips.train, nullptr);
  const double plain = total_loss(training, 20);
  EXPECT_NEAR(plain, oracle(training, *short_clips.train, config, 20, 6, 30, 1, 0.8, 7.5), 2e-5 * plain);
  EXPECT_NEAR(plain, oracle(training, *short_clips.train, config, 20, 6, 30, 1, 0.8, -3.0), 2e-5 * plain);
}

// Along its own gradient every parameter tensor must change the loss as fast as the gradient is long.
TEST(Objective, GradientAgainstFiniteDifferences) {
  TrainingConfig config = tiny_training();
  config.shards = 1;
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr);
  const auto parameters = training.parameters();
  std::vector<Tensor> tensors;
  for (const auto& [name, p] : parameters) tensors.push_back(p);
  training.prepare(20);
  train::LossTerms terms;
  const auto gradients = torch::autograd::grad({training.shard_loss(0, terms)}, tensors);
  const torch::NoGradGuard no_grad;
  int checked = 0;
  for (std::size_t i = 0; i < tensors.size(); ++i) {
    const double length = gradients[i].norm().item<double>();
    if (length < 0.3) continue;  // in float the loss has no more digits than that
    const Tensor before = tensors[i].clone(), direction = gradients[i] / length;
    const double step = std::min(2e-2, 0.3 / length);
    const auto at = [&](double s) {
      tensors[i].copy_(before + s * direction);
      return total_loss(training, 20);
    };
    const double numeric = (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step);
    tensors[i].copy_(before);
    EXPECT_NEAR(numeric, length, 0.02 * length) << parameters[i].first;
    ++checked;
  }
  EXPECT_GE(checked, 30) << "of " << tensors.size();
}

TEST(Training, LossFalls) {
  TrainingConfig config = tiny_training(200);
  config.batch = 8;
  config.gradient_limit = 10;
  config.learning_rate.rate = 5e-3;
  config.own_output.to = 0.3;
  const TemporaryFolder folder;
  train::LoopOptions options;
  options.output = folder / "m.h5";
  options.threads = 2;
  MotionCellTraining training(tiny_network(), config, *data().train, data().validation.get());
  const double before = *training.validation_loss();
  double first = 0, last = 0;
  train::train(training, options, [&](const train::Progress& p) {
    if (p.step <= 10) first += p.loss / 10;
    if (p.step > 190) last += p.loss / 10;
  });
  EXPECT_LT(last, 0.3 * first) << "first ten steps " << first << ", last ten " << last;
  EXPECT_LT(*training.validation_loss(), 0.5 * before);
}

std::string trained(const MotionDataset* validation, int threads, std::int64_t steps = 12) {
  TrainingConfig config = tiny_training(steps);
  config.shards = 3;
  config.pretraining.steps = 4;
  config.windows = {{0, 15}, {0.5, 30}};
  const TemporaryFolder folder;
  train::LoopOptions options;
  options.output = folder / "m.h5";
  options.threads = threads;
  options.weights_only = true;
  MotionCellTraining training(tiny_network(), config, *data().train, validation);
  train::train(training, options, {});
  return slurp(options.output);
}

TEST(Training, SameBitsOnASecondRunForAnyThreadsAndWithValidation) {
  const std::string once = trained(nullptr, 1);
  EXPECT_TRUE(trained(nullptr, 1) == once);
  EXPECT_TRUE(trained(nullptr, 2) == once);
  EXPECT_TRUE(trained(nullptr, 5) == once);
  EXPECT_TRUE(trained(data().validation.get(), 2) == once) << "held-out data reach the weights";
  EXPECT_FALSE(trained(nullptr, 1, 13) == once);
}

TEST(Training, ModelFileRebuildsTheNetwork) {
  MotionCellTraining training(tiny_network(), tiny_training(), *data().train, nullptr);
  const store::ModelFile file = training.describe();
  EXPECT_EQ(file.kind, "motion-cell");
  const auto json = nlohmann::json::parse(file.config);
  const MotionCellConfig network = config_from_json(json.at("network"));
  EXPECT_EQ(network, training.network().config());
  EXPECT_EQ(network.joints, 21);
  EXPECT_EQ(network.attribute_classes, (std::vector<int>{2, 2}));
  EXPECT_EQ(json.at("representation"), "quaternion");
  EXPECT_EQ(json.at("frame_rate_hz"), 30);
  EXPECT_EQ(file.vocabulary, (train::Vocabulary{{"action", {"run", "walk"}}, {"side", {"left", "right"}}}));
  EXPECT_EQ(file.mean.size(), 90u);
  EXPECT_FALSE(file.has_training);
}

TEST(Training, IdentityHoldsDataValidationAndSettings) {
  const auto identity = [](const TrainingConfig& c, const MotionDataset* validation) { return MotionCellTraining(tiny_network(), c, *data().train, validation).identity(); };
  const std::string base = identity(tiny_training(), nullptr);
  EXPECT_EQ(identity(tiny_training(), nullptr), base);
  EXPECT_NE(identity(tiny_training(), data().validation.get()), base);
  TrainingConfig c = tiny_training();
  c.seed = 2;
  EXPECT_NE(identity(c, nullptr), base);
  c = tiny_training();
  c.windows.push_back({0.5, 60});
  EXPECT_NE(identity(c, nullptr), base);
}

TEST(Training, OneCombinationAndOneFrame) {
  const TemporaryFolder folder;
  Clip clip = swinging("a", 1, 0, 0);
  mocap::testing::write_archive(folder / "a.h5", {clip});
  const MotionDataset one(folder / "a.h5", RotationRepresentation::quaternion, {});
  MotionCellTraining training(tiny_network(), tiny_training(), one, nullptr);
  EXPECT_EQ(training.network().config().attribute_combinations(), 1);
  for (const std::int64_t step : {0, 39}) EXPECT_TRUE(std::isfinite(total_loss(training, step)));
}

TEST(Schedules, OfPretrainingAndOfTheRest) {
  TrainingConfig c = tiny_training(110);
  c.pretraining.steps = 10;
  c.learning_rate = {1e-3, 0.5, 0.1, 5};
  c.windows = {{0, 15}, {0.4, 30}};
  MotionCellTraining training(tiny_network(), c, *data().train, nullptr);
  EXPECT_NEAR(training.learning_rate(0), 2e-3 / 5, 1e-12);
  EXPECT_NEAR(training.learning_rate(9), 2e-3 * std::pow(0.2, 0.9), 1e-12);
  EXPECT_NEAR(training.learning_rate(10), 1e-3 / 5, 1e-12);
  EXPECT_NEAR(training.learning_rate(60), 1e-3, 1e-12);
  EXPECT_NEAR(training.learning_rate(85), 1e-3 * std::sqrt(0.1), 1e-12);

  EXPECT_NEAR(term(training, 0, "kl_weight"), 0.1, 1e-12);
  EXPECT_EQ(term(training, 9, "exposure"), 0);
  EXPECT_NEAR(term(training, 10, "kl_weight"), 0.1, 1e-12);
  EXPECT_NEAR(term(training, 30, "kl_weight"), 0.1 + 0.9 * 0.2 / 0.4, 1e-12);
  EXPECT_EQ(term(training, 50, "kl_weight"), 1);
  EXPECT_EQ(term(training, 20, "exposure"), 0);
  EXPECT_NEAR(term(training, 45, "exposure"), 0.5, 1e-12);
  EXPECT_EQ(term(training, 70, "exposure"), 1);
  // The window grows: from the batch the loss is made of.
  const double before = oracle(training, *data().train, c, 49, 6, 15, 0.1 + 0.9 * 0.39 / 0.4, 0.58);
  EXPECT_NEAR(total_loss(training, 49), before, 2e-5 * before);
  const double after = oracle(training, *data().train, c, 50, 6, 30, 1, 0.6);
  EXPECT_NEAR(total_loss(training, 50), after, 2e-5 * after);
}

TEST(Schedules, StepsFromEpochs) {
  TrainingConfig c = tiny_training(0);
  c.epochs = 7;
  c.batch = 3;
  MotionCellTraining training(tiny_network(), c, *data().train, nullptr);  // 4 clips: 2 steps an epoch
  EXPECT_EQ(training.steps_per_epoch(), 2);
  EXPECT_EQ(training.steps(), 14);
}

TEST(TrainingConfig, JsonRoundTrip) {
  for (const char* name : {"paper", "small"}) {
    TrainingConfig c = TrainingConfig::preset(name);
    c.seed = ~std::uint64_t{0};
    c.windows = {{0, 45}, {1.0 / 3, 90}};
    c.learning_rate = {0.1, 0.2, 0.3, 4};
    c.pretraining = {5, 6, 0.7, 0.8, 0.9};
    c.exposure = Exposure::joint_dropout;
    c.objective.distance = objective::Distance::fk;
    const auto json = nlohmann::json::parse(to_json(c).dump());
    const TrainingConfig back = training_config_from_json(json);
    EXPECT_EQ(to_json(back), json);
    EXPECT_EQ(back.seed, c.seed);
    EXPECT_EQ(back.windows[1].begin, 1.0 / 3);
    for (const auto& [key, value] : json.items()) {
      auto without = json;
      without.erase(key);
      EXPECT_THROW(training_config_from_json(without), Error) << key;
      without[key] = "text";
      EXPECT_THROW(training_config_from_json(without), Error) << key;
    }
  }
}

TEST(TrainingConfig, Presets) {
  const TrainingConfig paper = TrainingConfig::preset("paper");
  EXPECT_EQ(paper.epochs, 1600);
  EXPECT_EQ(paper.learning_rate.rate, 1e-3);
  EXPECT_EQ(paper.gradient_limit, 0.1);
  EXPECT_EQ(paper.objective.velocity_weight, 0);
  EXPECT_EQ(paper.pretraining.steps, 0);
  EXPECT_NO_THROW(TrainingConfig::preset("small").validate(3));
  EXPECT_THROW(TrainingConfig::preset("large"), Error);
}

TEST(TrainingConfig, ValidateNamesTheField) {
  const auto refusal = [](const std::function<void(TrainingConfig&)>& change) {
    TrainingConfig c = tiny_training();
    change(c);
    try {
      c.validate(3);
    } catch (const Error& e) {
      return e.status() == Exit::usage ? std::string(e.what()) : std::string("another status");
    }
    return std::string();
  };
  const auto expect = [&](const char* word, const std::function<void(TrainingConfig&)>& change) {
    EXPECT_NE(refusal(change).find(word), std::string::npos) << word << ": '" << refusal(change) << "'";
  };
  EXPECT_EQ(refusal([](TrainingConfig&) {}), "");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect("steps", [](auto& c) { c.steps = 0; });
  expect("batch", [](auto& c) { c.batch = 0; });
  expect("reconstruction scale", [&](auto& c) { c.reconstruction_scale = nan; });
  expect("learning rate", [](auto& c) { c.learning_rate.rate = -1; });
  expect("gradient limit", [](auto& c) { c.gradient_limit = 0; });
  expect("shards", [](auto& c) { c.shards = 7; });
  expect("shards", [](auto& c) { c.shards = 0; });
  expect("window", [](auto& c) { c.windows.clear(); });
  expect("window", [](auto& c) { c.windows = {{0.1, 30}}; });
  expect("window", [](auto& c) { c.windows = {{0, 31}}; });
  expect("window", [](auto& c) { c.windows = {{0, 0}}; });
  expect("pretraining", [](auto& c) { c.pretraining.steps = c.steps + 1; });
  expect("pretraining", [](auto& c) { c.pretraining.steps = -1; });
  expect("classifier weight", [&](auto& c) { c.classifier_weight.to = nan; });
  expect("own output", [](auto& c) { c.own_output.to = 1.5; });
  expect("input noise", [](auto& c) { c.noise.to = -0.1; });
  expect("joint dropout", [](auto& c) { c.joint_dropout.to = 1.1; });
  expect("frames in all", [](auto& c) { c.batch = 65536, c.windows = {{0, 30}, {0.5, 99999}}; });
}

TEST(TrainingConfig, Exposures) {
  for (const auto e : {Exposure::none, Exposure::own_output, Exposure::noise, Exposure::joint_dropout}) EXPECT_EQ(parse_exposure(text(e)), e);
  EXPECT_THROW(parse_exposure("prayer"), Error);
}

// The objective's value for the step's own batch, with what the encoder read given by `corrupt`.
double with_input(MotionCellTraining& training, const TrainingConfig& config, std::int64_t step, const std::function<void(Tensor&, Random&)>& corrupt) {
  const MotionDataset& set = *data().train;
  const MotionCellConfig& c = training.network().config();
  const train::Batch batch = train::draw_batch(set, config.batch, 30, train::identity_padding(set.layout(), set.mean(), set.deviation()), config.seed, stream_of(1, static_cast<std::uint64_t>(step)));
  Random random(config.seed, stream_of(2, static_cast<std::uint64_t>(step), 0)), damage(config.seed, stream_of(4, static_cast<std::uint64_t>(step), 0));
  CellInput in;
  in.x = batch.features.clone();
  corrupt(in.x, damage);
  in.classes = batch.classes;
  in.posterior_noise = nn::normal_tensor({30 / c.word_length, config.batch, c.latent}, random);
  in.initial_noise = nn::normal_tensor({config.batch, 2 * c.hidden}, random);
  const torch::NoGradGuard no_grad;
  const CellOutput out = reference_forward(training.network(), in);
  objective::Figures figures;
  const Tensor words = batch.mask.view({config.batch, -1, c.word_length}).amax(-1);
  const Tensor loss = config.reconstruction_scale * objective::MotionObjective(config.objective, set)(out.y, batch, figures).sum() + (out.kl * words).sum();
  return loss.item<double>() / static_cast<double>(config.batch);
}

TEST(Exposure, NoiseReachesTheEncoderAlone) {
  TrainingConfig config = tiny_training();
  config.shards = 1;
  config.exposure = Exposure::noise;
  config.noise.to = 0.25;
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr);
  EXPECT_NEAR(term(training, 14, "exposure"), 0.125, 1e-12);  // half way up the ramp
  EXPECT_NEAR(term(training, 30, "exposure"), 0.25, 1e-12);
  const double expected = with_input(training, config, 30, [](Tensor& x, Random& random) { x += 0.25 * nn::normal_tensor(x.sizes(), random); });
  EXPECT_NEAR(total_loss(training, 30), expected, 2e-5 * expected);
  const double clean = with_input(training, config, 30, [](Tensor&, Random&) {});
  EXPECT_GT(std::abs(expected - clean), 1e-4 * clean);
}

TEST(Exposure, JointDropoutPutsWholeJointsToTheirMean) {
  TrainingConfig config = tiny_training();
  config.shards = 1;
  config.exposure = Exposure::joint_dropout;
  config.joint_dropout.to = 0.3;
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr);
  double dropped = 0, all = 0;
  const double expected = with_input(training, config, 30, [&](Tensor& x, Random& random) {
    for (std::int64_t b = 0; b < x.size(0); ++b)
      for (std::int64_t t = 0; t < x.size(1); ++t)
        for (int j = 0; j < 21; ++j, ++all)
          if (random.uniform() < 0.3) x[b][t].narrow(0, 4 * j, 4).zero_(), ++dropped;
  });
  EXPECT_NEAR(dropped / all, 0.3, 0.03);
  EXPECT_NEAR(total_loss(training, 30), expected, 2e-5 * expected);
}

TEST(Exposure, NoneIsTeacherForcing) {
  TrainingConfig config = tiny_training();
  config.shards = 1;
  config.exposure = Exposure::none;
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr);
  const double expected = with_input(training, config, 39, [](Tensor&, Random&) {});
  EXPECT_NEAR(total_loss(training, 39), expected, 2e-5 * expected);
  EXPECT_EQ(term(training, 39, "exposure"), 0);
}

struct Classifiers {
  TemporaryFolder folder;
  std::unique_ptr<objective::ClassifierLoss> good, overflowing;
  Classifiers() {
    const std::vector<Clip> clips = {swinging("a", 60, 0, 0), swinging("b", 45, 1, 1)};
    mocap::testing::write_classifier(folder / "good.h5", clips, "action", {"run", "walk"}, 1);
    mocap::testing::write_classifier(folder / "bad.h5", clips, "action", {"run", "walk"}, 1, 1e20);
    good = std::make_unique<objective::ClassifierLoss>(std::vector<std::string>{folder / "good.h5"}, *data().train);
    overflowing = std::make_unique<objective::ClassifierLoss>(std::vector<std::string>{folder / "bad.h5"}, *data().train);
  }
};
const Classifiers& classifiers() {
  static const Classifiers c;
  return c;
}

TEST(ClassifierTerm, GrowsAfterATenthAndIsScaledByWords) {
  TrainingConfig config = tiny_training(110);
  config.pretraining.steps = 10;
  config.shards = 1;
  config.exposure = Exposure::none;
  MotionCellTraining with(tiny_network(), config, *data().train, nullptr, classifiers().good.get()), without(tiny_network(), config, *data().train, nullptr);
  for (const auto& [step, weight] : {std::pair<std::int64_t, double>{5, 0}, {10, 0}, {20, 0}, {35, 0.015}, {50, 0.03}, {109, 0.03}}) {
    EXPECT_NEAR(term(with, step, "classifier_weight"), weight, 1e-12) << step;
    const double difference = total_loss(with, step) - total_loss(without, step);
    with.prepare(step);
    double words = 0;  // of the batch
    if (weight > 0) {
      const MotionDataset& set = *data().train;
      const train::Batch batch = train::draw_batch(set, 6, 30, train::identity_padding(set.layout(), set.mean(), set.deviation()), config.seed, stream_of(1, static_cast<std::uint64_t>(step)));
      words = batch.mask.view({6, 10, 3}).amax(-1).sum().item<double>();
    }
    const double expected = config.reconstruction_scale * weight * term(with, step, "classifiers") * words / 6;
    EXPECT_NEAR(difference, expected, 1e-3 * expected + 1e-9 + 1e-6 * total_loss(without, step)) << step;
    if (weight > 0) {
      EXPECT_GT(expected, 0.01);
    }
  }
  EXPECT_EQ(term(without, 109, "classifiers"), 0);
  EXPECT_EQ(nlohmann::json::parse(with.describe().config).at("classifiers"), classifiers().good->to_json());
  EXPECT_EQ(nlohmann::json::parse(without.describe().config).at("classifiers"), nlohmann::json::array());
  EXPECT_NE(with.identity(), without.identity());
}

std::string divergence(MotionCellTraining& training) {
  const TemporaryFolder folder;
  train::LoopOptions options;
  options.output = folder / "m.h5";
  options.checkpoint_epochs = 1;
  try {
    train::train(training, options, {});
  } catch (const Error& e) {
    return std::string(e.what()) + " / " + e.hint();
  }
  return "none";
}

TEST(Divergence, NamesTheClassifiersTermAndTheCheckpoint) {
  TrainingConfig config = tiny_training();
  MotionCellTraining training(tiny_network(), config, *data().train, nullptr, classifiers().overflowing.get());
  const std::string said = divergence(training);
  EXPECT_NE(said.find("diverged at step 6: classifiers is not finite"), std::string::npos) << said;  // the first with a weight
  EXPECT_NE(said.find("last good checkpoint: "), std::string::npos) << said;
}

TEST(Divergence, NamesTheTermsOfTheObjective) {
  // A decoder that gives numbers whose fourth power is beyond float: of the terms, the matrices' constraint alone overflows.
  const MotionDataset matrices(data().folder / "train.h5", RotationRepresentation::rotation_matrix, {});
  TrainingConfig config = tiny_training();
  config.objective.distance = objective::Distance::geodesic;
  config.objective.velocity_weight = 0;
  MotionCellTraining training(tiny_network(), config, matrices, nullptr);
  {
    const torch::NoGradGuard no_grad;
    training.network().word_decoder->bias(2).slice(0, 0, 9).add_(1e12);
  }
  const std::string said = divergence(training);
  EXPECT_NE(said.find("diverged at step 1: constraint is not finite"), std::string::npos) << said;
}

TEST(Representations, LossFallsInEach) {
  for (const auto& [r, d] : {std::pair{RotationRepresentation::rotation_matrix, objective::Distance::geodesic}, {RotationRepresentation::axis_angle, objective::Distance::l2}, {RotationRepresentation::axis_angle, objective::Distance::d1},
                             {RotationRepresentation::quaternion, objective::Distance::fk}}) {
    const MotionDataset set(data().folder / "train.h5", r, {});
    TrainingConfig config = tiny_training(60);
    config.gradient_limit = 10;
    config.learning_rate.rate = 5e-3;
    config.kl_weight.to = 0;
    config.objective.distance = d;
    MotionCellConfig network = tiny_network();
    network.single_layer = d == objective::Distance::d1;
    if (network.single_layer) network.word_length = 1;
    MotionCellTraining training(network, config, set, nullptr);
    EXPECT_EQ(training.network().config().rotation_values, static_cast<int>(r));
    const TemporaryFolder folder;
    train::LoopOptions options;
    options.output = folder / "m.h5";
    double first = 0, last = 0;
    train::train(training, options, [&](const train::Progress& p) { (p.step <= 5 ? first : last) += p.step <= 5 || p.step > 55 ? p.loss / 5 : 0; });
    EXPECT_LT(last, 0.75 * first) << features::text(r) << " " << objective::text(d);
    EXPECT_EQ(nlohmann::json::parse(store::read_model(folder / "m.h5").config).at("representation"), features::text(r));
  }
}

TEST(Representations, ImpossibleDistancesAreRefused) {
  const MotionDataset matrices(data().folder / "train.h5", RotationRepresentation::rotation_matrix, {});
  EXPECT_THROW(MotionCellTraining(tiny_network(), tiny_training(), matrices, nullptr), Error);
}

}  // namespace
}  // namespace mocap::motion_cell
