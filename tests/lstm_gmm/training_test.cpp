#include "libmodels/lstm_gmm/training.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/features/state.hpp"
#include "libmodels/lstm_gmm/model.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::lstm_gmm {
namespace {

using mocap::testing::refusal;
using mocap::testing::sample_clip;
using mocap::testing::TemporaryFolder;
using mocap::testing::with_contacts;
using torch::Tensor;

struct OneThread : ::testing::Environment {
  void SetUp() override { nn::use_one_blas_thread(); }
};
const auto* const kEnvironment = ::testing::AddGlobalTestEnvironment(new OneThread);

struct Data {
  TemporaryFolder folder;
  std::vector<Clip> clips;
  std::unique_ptr<train::StateDataset> set;
  Data() {
    for (std::uint64_t i = 0; i < 3; ++i) clips.push_back(with_contacts(sample_clip(fmt::format("clip{}", i), 70, 5)));  // one motion, three times
    mocap::testing::write_archive(folder / "train.h5", clips, "preset:default");
    set = std::make_unique<train::StateDataset>(folder / "train.h5");
  }
};
const Data& data() {
  static const Data d;
  return d;
}

LstmGmmConfig tiny() {
  LstmGmmConfig c;
  c.hidden = 24;
  c.width = 24;
  c.mixtures = 2;
  return c;
}

TrainingConfig short_training() {
  TrainingConfig c;
  c.batch = 6;
  c.window = 20;
  c.steps = 200;
  c.rate = 3e-3;
  return c;
}

// Updates as the loop makes them.
void train_steps(LstmGmmTraining& training, std::int64_t steps) {
  auto optimizer = training.optimizer();
  std::vector<Tensor> parameters;
  for (const auto& [name, tensor] : training.parameters()) parameters.push_back(tensor.set_requires_grad(true));
  for (std::int64_t step = 0; step < steps; ++step) {
    training.prepare(step);
    train::LossTerms terms;
    Tensor loss;
    for (int shard = 0; shard < training.shards(); ++shard) {
      const Tensor part = training.shard_loss(shard, terms);
      loss = loss.defined() ? loss + part : part;
    }
    auto gradients = torch::autograd::grad({loss}, parameters);
    train::clip_entries(gradients, training.entry_limit());
    optimizer->step(gradients, training.learning_rate(step));
  }
}

TEST(LstmGmmTraining, LearnsAMotionBetterThanStandingStill) {
  TrainingConfig c = short_training();
  c.steps = 700;
  c.window = 60;
  c.rate = 5e-3;
  c.decay_steps = 70;
  LstmGmmConfig network = tiny();
  network.hidden = network.width = 48;
  LstmGmmTraining training(network, c, *data().set, data().set.get());
  const Prediction before = prediction(training.network(), *data().set);
  EXPECT_EQ(training.validation_loss().value(), before.nats);
  train_steps(training, c.steps);
  const Prediction after = prediction(training.network(), *data().set);
  EXPECT_LT(after.nats, before.nats - 30);
  EXPECT_LT(after.angle_deg, 0.8 * after.persistence_deg);
  EXPECT_LT(after.contact_errors, 0.3);  // a guess has a half
  EXPECT_EQ(after.persistence_deg, before.persistence_deg);
}

TEST(LstmGmmTraining, PredictionCountsAnglesBetweenFrames) {
  const LstmGmmTraining training(tiny(), short_training(), *data().set, nullptr);
  const Clip& clip = data().clips[0];
  double sum = 0;
  for (std::size_t t = 1; t < clip.frames(); ++t)
    for (std::size_t j = 1; j < 22; ++j) sum += geodesic_distance(clip.frame(t)[j], clip.frame(t - 1)[j]);
  EXPECT_NEAR(prediction(training.network(), *data().set).persistence_deg, sum / (21 * 69) * 180 / std::numbers::pi, 1e-3);
}

TEST(LstmGmmTraining, RateFallsInSteps) {
  TrainingConfig c = TrainingConfig::preset("paper");
  EXPECT_EQ(c.steps, 30000);
  const LstmGmmTraining paper(tiny(), c, *data().set, nullptr);
  EXPECT_EQ(paper.learning_rate(199), 1e-3);
  EXPECT_NEAR(paper.learning_rate(200), 0.95e-3, 1e-12);
  const LstmGmmTraining small(tiny(), TrainingConfig::preset("small"), *data().set, nullptr);
  EXPECT_NEAR(small.learning_rate(2999), paper.learning_rate(74 * 200), 1e-12);
}

TEST(LstmGmmTraining, StartsFromAnotherNetwork) {
  LstmGmmTraining one(tiny(), short_training(), *data().set, nullptr);
  TrainingConfig c = short_training();
  c.seed = 2;
  LstmGmmTraining two(tiny(), c, *data().set, nullptr);
  two.start_from(one.network());
  const auto a = one.parameters(), b = two.parameters();
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(torch::equal(a[i].second, b[i].second));
  LstmGmmConfig other = tiny();
  other.hidden = 12;
  LstmGmmTraining three(other, c, *data().set, nullptr);
  EXPECT_THROW(three.start_from(one.network()), Error);
}

TEST(LstmGmmTraining, SettingsThatCannotBeAreRefused) {
  const auto message = [](const std::function<void(TrainingConfig&)>& change) {
    TrainingConfig c = short_training();
    change(c);
    return refusal([&] { c.validate(); });
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_NE(message([](auto& c) { c.steps = 0; }).find("steps"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.decay = 1.5; }).find("decay"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.input_noise = -1; }).find("noise"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.window = 0; }).find("window"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.shards = 7; }).find("shards"), std::string::npos);
  EXPECT_THROW(TrainingConfig::preset("large"), Error);
}

TEST(LstmGmmModel, WhatIsNoGeneratorIsRefused) {
  LstmGmmTraining training(tiny(), short_training(), *data().set, nullptr);
  store::ModelFile whole = training.describe();
  for (const auto& [name, tensor] : train::to_stored(training.parameters())) whole.weights[name] = tensor;
  const Model model = read(whole, "m.h5");
  EXPECT_EQ(model.starts.sizes(), at::IntArrayRef({64, 2, 71}));
  EXPECT_EQ(model.reference.mean, data().set->mean());
  const auto spoilt = [&](const std::function<void(store::ModelFile&)>& spoil) {
    store::ModelFile file = whole;
    spoil(file);
    return refusal([&] { (void)read(file, "m.h5"); });
  };
  const auto config = [&](const std::string& from, const std::string& to) {
    return spoilt([&](auto& f) {
      const auto at = f.config.find(from);
      ASSERT_NE(at, std::string::npos) << from;
      f.config.replace(at, from.size(), to);
    });
  };
  EXPECT_NE(spoilt([](auto& f) { f.kind = "refiner"; }).find("expected lstm-gmm"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.config = "{}"; }).find("config"), std::string::npos);
  EXPECT_NE(config("\"frame_rate_hz\":30.0", "\"frame_rate_hz\":-1").find("frame_rate_hz"), std::string::npos);
  EXPECT_NE(config("\"default_frames\":300", "\"default_frames\":0").find("default_frames"), std::string::npos);
  EXPECT_NE(config("\"mixtures\":2", "\"mixtures\":65536").find("m.h5"), std::string::npos);
  EXPECT_NE(config("\"hidden\":24", "\"hidden\":65536").find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("start"); }).find("weights/start"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("start").values[7] = std::nanf(""); }).find("not finite"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("lstm_1/bias"); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.mean.pop_back(); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.skeleton = mocap::testing::one_joint(); }).find("skeleton"), std::string::npos);
  LstmGmmConfig huge;
  huge.features = 40290;
  huge.mixtures = 53300;
  EXPECT_NE(refusal([&] { huge.validate(); }).find("outputs"), std::string::npos);
}

}  // namespace
}  // namespace mocap::lstm_gmm
