#include "libmodels/cae_vae/training.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "libmocap/base/error.hpp"
#include "libmodels/cae_vae/model.hpp"
#include "libmodels/cae_vae/reconstruction.hpp"
#include "tests/cae_vae/data.hpp"

namespace mocap::cae_vae {
namespace {

using mocap::testing::refusal;
using torch::Tensor;

TEST(CaeVaeWindows, AreCutFromEveryClipThatIsLongEnough) {
  const WindowDataset& set = *sample_data().set;
  EXPECT_EQ(set.clips(), 3u);
  EXPECT_EQ(set.left_out(), 1u);
  ASSERT_EQ(set.windows().size(), 3u * 6);  // begin at 0, 10, ..., 50
  EXPECT_EQ(set.windows()[7].clip, 1u);
  EXPECT_EQ(set.windows()[7].first, 10);
  EXPECT_EQ(set.sources().size(), 1u);
  // A window's rows are the clip's features, whatever the window.
  const Clip& clip = sample_data().clips[1];
  const Tensor rows = set.batch({7})[0], expected = standardised(features::encode_motegi(features::motegi_positions(clip), clip.frame_rate_hz), set.reference()).narrow(0, 10, 20);
  EXPECT_TRUE(torch::allclose(rows, expected, 1e-4, 1e-4));  // the archive keeps single precision
  std::vector<std::size_t> all(18);
  for (std::size_t i = 0; i < 18; ++i) all[i] = i;
  const Tensor x = set.batch(all).reshape({-1, 58});
  EXPECT_LT(x.mean(0).abs().max().item<double>(), 0.5);
  EXPECT_NEAR(x.std(0).mean().item<double>(), 1, 0.2);
  const auto back = restored(rows.contiguous().data_ptr<float>(), 20, set.reference());
  EXPECT_NEAR(back(3, 0), features::motegi_positions(clip)(13, 2) - features::motegi_placement(features::motegi_positions(clip)).floor, 1e-4);
}

TEST(CaeVaeWindows, WhatCannotBeUsedIsRefused) {
  const auto& folder = sample_data().folder;
  EXPECT_NE(refusal([&] { WindowDataset(folder / "train.h5", 80, 40); }).find("4 clips, none as long as a window of 80 frames"), std::string::npos);
  EXPECT_NE(refusal([&] { WindowDataset(folder / "train.h5", 20, 20); }).find("expected an overlap from 0 to 19"), std::string::npos);
  Reference like = sample_data().set->reference();
  like.frame_rate_hz = 60;
  EXPECT_NE(refusal([&] { WindowDataset(folder / "train.h5", 20, 10, &like); }).find("30 Hz, expected the training data's 60 Hz"), std::string::npos);
  mocap::testing::write_archive(folder / "one.h5", {mocap::testing::sample_clip("a", 30, 1, mocap::testing::one_joint())});
  EXPECT_NE(refusal([&] { WindowDataset(folder / "one.h5", 20, 10); }).find("one.h5"), std::string::npos);
}

// The second stage's gradient by backpropagation against differences: z depends on the encoder through mean and deviation.
TEST(CaeVaeTraining, GradientsAreThoseOfTheLoss) {
  TrainingConfig c = short_training();
  c.shards = 1;
  CaeVaeTraining training(tiny(2), c, *sample_data().set, nullptr);
  for (const std::int64_t step : {std::int64_t{0}, c.epochs * training.steps_per_epoch()}) {
    training.prepare(step);
    train::LossTerms terms;
    const auto [first, count] = training.trained();
    const auto named = training.parameters();
    std::vector<Tensor> trained;
    for (std::size_t i = first; i < first + count; ++i) trained.push_back(named[i].second);
    const auto gradients = torch::autograd::grad({training.shard_loss(0, terms)}, trained);
    const torch::NoGradGuard no_grad;
    for (std::size_t i = 0; i < trained.size(); ++i) {
      const Tensor direction = gradients[i] / (gradients[i].norm() + 1e-12);
      const auto at = [&](double by) {
        const Tensor kept = trained[i].clone();
        trained[i].add_(direction, by);
        const double loss = training.shard_loss(0, terms).item<double>();
        trained[i].copy_(kept);
        return loss;
      };
      const double h = 3e-3, slope = (at(h) - at(-h)) / (2 * h), expected = gradients[i].norm().item<double>();
      EXPECT_NEAR(slope, expected, 0.03 * expected + 2e-3) << named[first + i].first;
    }
  }
}

TEST(CaeVaeTraining, EveryWindowIsSeenOnceAnEpoch) {
  TrainingConfig c = short_training();
  c.batch = 7;  // 18 windows: the third batch is filled up
  c.shards = 1;
  CaeVaeTraining training(tiny(), c, *sample_data().set, nullptr);
  EXPECT_EQ(training.steps_per_epoch(), 3);
  EXPECT_EQ(training.steps(), 3 * 120);
}

TEST(CaeVaeTraining, LearnsBothStagesOneAfterTheOther) {
  TrainingConfig c = short_training();
  c.epochs = c.vae_epochs = 250;
  CaeVaeTraining training(tiny(), c, *sample_data().set, sample_data().set.get());
  const auto optimizer = training.optimizer();
  const std::int64_t first = c.epochs * training.steps_per_epoch();
  const auto cae = [&] { return training.network().cae->parameters()[0].clone(); };
  const auto vae = [&] { return training.network().vae->parameters()[0].clone(); };
  training.prepare(0);
  const double untrained = *training.validation_loss();
  const Tensor vae_before = vae();
  train_steps(training, *optimizer, 0, first);
  EXPECT_LT(*training.validation_loss(), 0.5 * untrained);
  EXPECT_TRUE(torch::equal(vae(), vae_before));
  const Tensor cae_before = cae();
  training.prepare(first);
  const double before = *training.validation_loss();
  train_steps(training, *optimizer, first, training.steps());
  EXPECT_LT(*training.validation_loss(), before - 10);
  EXPECT_TRUE(torch::equal(cae(), cae_before));  // no momentum left from the first stage
  EXPECT_GT(training.network().scale_deviation.max().item<double>(), 0);
  EXPECT_FALSE(torch::equal(training.network().scale_deviation, torch::ones({8})));

  const ReconstructionError e = reconstruction_error(training.network(), *sample_data().set);
  EXPECT_EQ(e.windows, 18u);
  EXPECT_LT(e.autoencoder.pose_mm, 0.6 * e.mean_pose_mm);
  EXPECT_LT(e.both.pose_mm, e.mean_pose_mm);
  EXPECT_GT(e.both.pose_mm, e.autoencoder.pose_mm);
  EXPECT_GT(e.autoencoder.world_mm, e.autoencoder.pose_mm);  // velocities add up
}

// Stopped between any two steps and continued with what a checkpoint holds, both stages give the same weights.
TEST(CaeVaeTraining, ContinuesToTheSameBits) {
  TrainingConfig c = short_training();
  c.epochs = c.vae_epochs = 3;
  CaeVaeTraining whole(tiny(2), c, *sample_data().set, nullptr);
  const auto optimizer = whole.optimizer();
  train_steps(whole, *optimizer, 0, whole.steps());
  for (const std::int64_t stop : {std::int64_t{4}, std::int64_t{9}, std::int64_t{10}, std::int64_t{14}}) {  // 9: between the stages
    CaeVaeTraining begun(tiny(2), c, *sample_data().set, nullptr), continued(tiny(2), c, *sample_data().set, nullptr);
    const auto one = begun.optimizer(), two = continued.optimizer();
    train_steps(begun, *one, 0, stop);
    {
      const torch::NoGradGuard no_grad;
      const auto from = begun.parameters(), to = continued.parameters();
      for (std::size_t i = 0; i < to.size(); ++i) to[i].second.copy_(from[i].second);
      two->set_state(one->state(), stop);
    }
    train_steps(continued, *two, stop, continued.steps());
    const auto a = whole.parameters(), b = continued.parameters();
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(torch::equal(a[i].second, b[i].second)) << a[i].first << " " << stop;
  }
}

TEST(CaeVaeTraining, RatesFallInEachStage) {
  TrainingConfig c = short_training();
  CaeVaeTraining training(tiny(), c, *sample_data().set, nullptr);
  const std::int64_t stage = 60 * training.steps_per_epoch();
  for (const std::int64_t begin : {std::int64_t{0}, stage}) {
    EXPECT_EQ(training.learning_rate(begin), 1e-3);
    EXPECT_EQ(training.learning_rate(begin + stage / 2 - 1), 1e-3);
    EXPECT_NEAR(training.learning_rate(begin + stage * 3 / 4), 0.5e-3, 1e-9);
    EXPECT_GT(training.learning_rate(begin + stage - 1), 0);
  }
  training.prepare(0);
  EXPECT_EQ(training.gradient_limit(), 5);
  training.prepare(stage);
  EXPECT_NEAR(training.gradient_limit(), 5 * std::sqrt(80), 1e-9);
  c.full_rate = 1;
  EXPECT_EQ(CaeVaeTraining(tiny(), c, *sample_data().set, nullptr).learning_rate(2 * stage - 1), 1e-3);
}

TEST(CaeVaeTraining, WindowsAreShiftedWithinTheirClips) {
  const WindowDataset& set = *sample_data().set;
  Random random(1, 1);
  const Tensor whole = set.batch({5}), moved = set.batch(std::vector<std::size_t>(40, 5), set.step() - 1, random);  // the last window of a clip of 75: it may begin at 50 to 55
  std::set<std::int64_t> shifts;
  const Tensor clip = standardised(features::encode_motegi(features::motegi_positions(sample_data().clips[0]), 30), set.reference());
  for (std::int64_t i = 0; i < 40; ++i) {
    std::int64_t found = -1;
    for (std::int64_t first = 50; first <= 55; ++first)
      if (torch::allclose(clip.narrow(0, first, 20), moved[i], 1e-4, 1e-4)) found = first;
    ASSERT_GE(found, 0);
    shifts.insert(found);
  }
  EXPECT_EQ(shifts.size(), 6u);
}

TEST(CaeVaeTraining, APriorIsFittedAtTheEnd) {
  TrainingConfig c = short_training();
  c.epochs = c.vae_epochs = 1;
  c.prior_components = 5;
  CaeVaeTraining training(tiny(), c, *sample_data().set, nullptr);
  const auto optimizer = training.optimizer();
  train_steps(training, *optimizer, 0, training.steps() - 1);
  training.updated({});
  EXPECT_FALSE(training.describe().weights.contains("prior/mean"));
  train_steps(training, *optimizer, training.steps() - 1, training.steps());
  training.updated({});
  const auto file = training.describe();
  EXPECT_EQ(file.weights.at("prior/mean").shape, (std::vector<std::int64_t>{1, 4}));  // 18 windows are enough for one
}

TEST(CaeVaeTraining, SettingsThatCannotBeAreRefused) {
  const auto message = [](const std::function<void(TrainingConfig&)>& change) {
    TrainingConfig c = short_training();
    change(c);
    return refusal([&] { c.validate(); });
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_NE(message([](auto& c) { c.epochs = 0; }).find("epochs"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.vae_epochs = 0; }).find("epochs of the variational"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.learning_rate = std::nan(""); }).find("learning rate"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.full_rate = 1.5; }).find("whole rate"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.gradient_limit = 0; }).find("gradient limit"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.least_deviation = -1; }).find("least deviation"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.kl_weight = -1; }).find("KL"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.shards = 7; }).find("shards"), std::string::npos);
}

TEST(CaeVaeModel, WhatIsNoSuchModelIsRefused) {
  CaeVaeTraining training(tiny(2), short_training(), *sample_data().set, nullptr);
  const store::ModelFile whole = model_file(training);
  const Model model = read(whole, "m.h5");
  EXPECT_EQ(model.network->config(), tiny(2));
  EXPECT_EQ(model.contacts_rule, "preset:default");
  EXPECT_EQ(model.reference.mean, sample_data().set->reference().mean);
  EXPECT_EQ(model.floor_m, sample_data().set->floor_m());
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
  EXPECT_NE(spoilt([](auto& f) { f.kind = "refiner"; }).find("expected cae-vae"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.config = "{}"; }).find("m.h5:config"), std::string::npos);
  EXPECT_NE(config("\"features\":\"motegi\"", "\"features\":\"state\"").find("motegi"), std::string::npos);
  EXPECT_NE(config("\"frame_rate_hz\":30.0", "\"frame_rate_hz\":0").find("frame_rate_hz"), std::string::npos);
  EXPECT_NE(config("preset:default", "preset:none").find("m.h5:config"), std::string::npos);
  EXPECT_NE(config("\"latent\":4", "\"latent\":4096").find("m.h5"), std::string::npos);
  EXPECT_NE(config("\"window\":20", "\"window\":22").find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("vae/decoder_0_bias"); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("cae/encoder_weight").values[3] = std::nanf(""); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("scale_deviation").values[3] = 0; }).find("scale_deviation"), std::string::npos);
  EXPECT_EQ(model.natural.size(), 22u);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("natural"); }).find("m.h5:weights/natural"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("natural").values[5] = 2; }).find("not unit"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("prior/mean"); }).find("m.h5:weights/prior/mean"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("prior/weight").values[0] = 0.5F; }).find("add up to 0.5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("prior/root").values[0] = 0; }).find("a deviation of 0"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("prior/weight").shape = {1, 1}; }).find("prior/weight"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.mean.pop_back(); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.skeleton = mocap::testing::one_joint(); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.skeleton = nullptr; }).find("m.h5:skeleton"), std::string::npos);
}

}  // namespace
}  // namespace mocap::cae_vae
