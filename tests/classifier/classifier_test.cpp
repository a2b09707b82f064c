#include "libmodels/classifier/classifier.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmodels/classifier/confusion.hpp"
#include "libmodels/classifier/training.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/loop.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::classifier {
namespace {

using mocap::testing::refusal;
using mocap::testing::slurp;
using mocap::testing::TemporaryFolder;
using mocap::testing::write_archive;
using torch::Tensor;

// The two actions swing through the same poses, one twice as fast: a single frame does not tell them apart.
Clip swinging(const std::string& name, std::size_t frames, bool fast, double phase) {
  Clip clip;
  clip.name = name;
  clip.skeleton = canonical_body();
  const auto joints = static_cast<std::size_t>(clip.joints());
  for (std::size_t t = 0; t < frames; ++t) {
    const double p = (fast ? 0.5 : 0.25) * static_cast<double>(t) + phase;
    for (std::size_t j = 0; j < joints; ++j) clip.rotations.push_back(exp_map(Vector3(0, j % 3 == 1 ? 0.4 * std::sin(p) : 0, 0)));
    clip.root_position.emplace_back(0.02 * static_cast<double>(t), 0, 0.9);
  }
  clip.attributes = {{"action", fast ? "run" : "walk"}};
  clip.source.path = name + ".bvh";
  clip.source.sha256 = to_hex(sha256(name));
  return clip;
}

std::vector<Clip> motions(std::size_t first, std::size_t count, std::size_t walk_frames = 80, std::size_t run_frames = 50) {
  std::vector<Clip> clips;
  for (std::size_t i = first; i < first + count; ++i) clips.push_back(swinging(fmt::format("c{:02}", i), i % 2 ? run_frames : walk_frames, i % 2 == 1, 0.7 * static_cast<double>(i)));
  return clips;
}

struct Files {
  TemporaryFolder folder;
  std::string train = folder / "train.h5", val = folder / "val.h5", model = folder / "m.h5";
  Files() {
    nn::use_one_blas_thread();
    write_archive(train, motions(0, 12));
    write_archive(val, motions(20, 6));
    const Data data(train, "action", Half::all, 1), held_out(val, "action", Half::all, 1, &data);
    TrainingConfig config;
    config.batch = 8;
    ClassifierTraining training(config, data, &held_out);
    train::LoopOptions options;
    options.output = model;
    train::train(training, options, [&](const train::Progress& p) {
      if (p.step <= 5) before += p.loss / 5;
      if (p.step > p.steps - 5) after += p.loss / 5;
    });
    held_out_loss = *training.validation_loss();
  }
  double before = 0, after = 0, held_out_loss = 0;
};
const Files& files() {
  static const Files f;
  return f;
}

std::string trained(int threads, std::uint64_t seed = 1, const Data* validation = nullptr) {
  const TemporaryFolder folder;
  const Data data(files().train, "action", Half::all, 1);
  TrainingConfig config;
  config.epochs = 3;
  config.batch = 7;
  config.shards = 3;
  config.seed = seed;
  ClassifierTraining training(config, data, validation);
  train::LoopOptions options;
  options.output = folder / "m.h5";
  options.threads = threads;
  options.weights_only = true;
  train::train(training, options, {});
  return slurp(options.output);
}

TEST(Training, LearnsFromMovementAlone) {
  EXPECT_GT(files().before, 0.4);
  EXPECT_LT(files().after, 0.1);
  EXPECT_LT(files().held_out_loss, 0.1);
  const auto model = Classifier::load(files().model);
  const auto clips = motions(20, 6);
  const auto found = confusion(*model, clips, model->judge(clips, 1));
  EXPECT_EQ(found.accuracy(), 1.0);
  EXPECT_EQ(found.counts, (std::vector<std::vector<std::size_t>>{{3, 0}, {0, 3}}));
}

TEST(Training, SameBitsOnASecondRunForAnyThreads) {
  const std::string once = trained(1);
  EXPECT_TRUE(trained(1) == once);
  EXPECT_TRUE(trained(2) == once);
  EXPECT_TRUE(trained(5) == once);
  EXPECT_FALSE(trained(1, 2) == once);
}

TEST(Training, DrawsTheSameLengthsAndNumbersOfEveryClass) {
  const TemporaryFolder folder;
  auto clips = motions(0, 12, 200, 60);
  for (std::size_t i = 12; i < 40; ++i) clips.push_back(swinging(fmt::format("more{}", i), 150, false, 0));  // walking is common, and long
  write_archive(folder / "a.h5", clips);
  const Data data(folder / "a.h5", "action", Half::all, 1);
  TrainingConfig config;
  config.batch = 64;
  const ClassifierTraining training(config, data, nullptr);
  EXPECT_EQ(training.longest(), 60);
  EXPECT_EQ(training.shortest(), 24);
  double sum[2] = {}, count[2] = {};
  std::int64_t least = 1000, most = 0;
  for (std::int64_t step = 0; step < 100; ++step) {
    const Rows rows = training.draw(step);
    for (std::int64_t b = 0; b < 64; ++b) {
      const auto label = rows.labels[b].item<std::int64_t>();
      const std::int64_t length = rows.lengths[static_cast<std::size_t>(b)];
      sum[label] += static_cast<double>(length);
      ++count[label];
      least = std::min(least, length), most = std::max(most, length);
      if (step == 0) {
        EXPECT_EQ(rows.x[b].abs().sum(1).gt(0).sum().item<std::int64_t>(), length);  // the rest is padding
      }
    }
  }
  EXPECT_EQ(least, 24);
  EXPECT_EQ(most, 60);
  EXPECT_NEAR(count[0] / 6400, 0.5, 0.03);                      // four standard errors: 0.025
  EXPECT_NEAR(sum[0] / count[0], sum[1] / count[1], 1.1);       // 4 * 10.7 * sqrt(2 / 3200)
}

TEST(Network, PaddingDoesNotReachTheResult) {
  const auto model = NetworkConfig{3, {8, 8, 6}, {1, 2, 2}, 5, 2};
  Random random(4, 0);
  const Network network(model, random);
  const torch::NoGradGuard no_grad;
  const Tensor x = nn::normal_tensor({1, 30, model.inputs()}, random);
  Tensor garbage = torch::full({1, 41, model.inputs()}, 1e3f);
  for (const std::int64_t length : {1, 2, 13, 30}) {
    garbage.narrow(1, 0, length).copy_(x.narrow(1, 0, length));
    const Tensor alone = network.features(x.narrow(1, 0, length), {length}), padded = network.features(garbage, {length});
    EXPECT_LT((alone - padded).abs().max().item<double>(), 1e-5) << length;
    EXPECT_GT(alone.abs().max().item<double>(), 1e-3);
    garbage.fill_(1e3f);
  }
}

TEST(Network, SeesChangeFromFrameToFrame) {
  Clip clip = swinging("a", 10, true, 0.3);
  const auto moving = encode(clip);
  const Eigen::Index d = moving.cols() / 2;
  EXPECT_LT((moving.block(0, d, 9, d) - (moving.block(1, 0, 9, d) - moving.block(0, 0, 9, d))).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_EQ(moving.row(9).tail(d), moving.row(8).tail(d));
  for (std::size_t t = 1; t < 10; ++t) {
    std::copy_n(clip.rotations.begin(), 22, clip.rotations.begin() + static_cast<std::ptrdiff_t>(22 * t));
    clip.root_position[t] = clip.root_position[0];
  }
  EXPECT_EQ(encode(clip).rightCols(d).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(encode(cut(clip, 0, 1)).rightCols(d).cwiseAbs().maxCoeff(), 0);
}

TEST(Halves, ShareNoSourceAndHoldEveryClass) {
  std::vector<std::string> sources, labels;
  for (int i = 0; i < 40; ++i) {
    sources.push_back(fmt::format("s{}", i / 2));  // two clips of each source
    labels.push_back(i % 8 < 4 ? "walk" : "run");
  }
  const auto first = halves(sources, labels, 1);
  EXPECT_EQ(std::count(first.begin(), first.end(), Half::a), 20);
  for (int i = 0; i < 40; i += 2) EXPECT_EQ(first[static_cast<std::size_t>(i)], first[static_cast<std::size_t>(i + 1)]);
  std::size_t walks = 0;
  for (std::size_t i = 0; i < 40; ++i) walks += labels[i] == "walk" && first[i] == Half::a;
  EXPECT_EQ(walks, 10U);
  EXPECT_NE(halves(sources, labels, 2), first);
  auto turned = sources, turned_labels = labels;
  std::reverse(turned.begin(), turned.end());
  std::reverse(turned_labels.begin(), turned_labels.end());
  auto second = halves(turned, turned_labels, 1);
  std::reverse(second.begin(), second.end());
  EXPECT_EQ(second, first);
}

TEST(Halves, TogetherAreTheWholeData) {
  const Data a(files().train, "action", Half::a, 1), b(files().train, "action", Half::b, 1), all(files().train, "action", Half::all, 1);
  std::vector<std::string> together = a.sources();
  together.insert(together.end(), b.sources().begin(), b.sources().end());
  std::sort(together.begin(), together.end());
  EXPECT_EQ(together, all.sources());
  EXPECT_EQ(all.sources().size(), 12U);
  EXPECT_EQ(a.items().size(), 6U);
  EXPECT_EQ(a.classes(), all.classes());
}

TEST(Halves, AreThoseOfEveryAttribute) {
  const TemporaryFolder folder;
  std::vector<Clip> clips;
  for (int i = 0; i < 30; ++i) {
    clips.push_back(swinging(fmt::format("c{}", i), 9, i % 3 == 0, 0));
    if (i % 7 != 0) clips.back().attributes["mood"] = i % 2 ? "glad" : "calm";  // some have none
    clips.back().attributes["subject"] = fmt::format("s{}", i);
  }
  write_archive(folder / "m.h5", clips);
  const Data action(folder / "m.h5", "action", Half::a, 1), mood(folder / "m.h5", "mood", Half::b, 1);
  std::vector<std::string> shared;
  std::set_intersection(action.sources().begin(), action.sources().end(), mood.sources().begin(), mood.sources().end(), std::back_inserter(shared));
  EXPECT_TRUE(shared.empty()) << shared.size();
  EXPECT_EQ(action.sources().size(), 15U);
}

TEST(Data, RefusesWhatCannotBeLearnt) {
  const TemporaryFolder folder;
  write_archive(folder / "one.h5", {swinging("a", 9, true, 0), swinging("b", 9, true, 0)});
  write_archive(folder / "few.h5", {swinging("a", 9, true, 0), swinging("b", 9, false, 0), swinging("c", 9, false, 0)});
  EXPECT_NE(refusal([&] { Data(folder / "one.h5", "action", Half::all, 1); }).find("at least two classes"), std::string::npos);
  EXPECT_NE(refusal([&] { Data(folder / "one.h5", "mood", Half::all, 1); }).find("no clip has an attribute 'mood'"), std::string::npos);
  EXPECT_NE(refusal([&] { Data(folder / "few.h5", "action", Half::a, 1), Data(folder / "few.h5", "action", Half::b, 1); }).find("is in half"), std::string::npos);
  Clip other = swinging("a", 9, true, 0);
  other.attributes["action"] = "dance";
  write_archive(folder / "dance.h5", {other});
  const Data data(folder / "few.h5", "action", Half::all, 1);
  EXPECT_NE(refusal([&] { Data(folder / "dance.h5", "action", Half::all, 1, &data); }).find("dance"), std::string::npos);
  other.attributes["action"] = "run";
  other.frame_rate_hz = 60;
  write_archive(folder / "fast.h5", {other});
  EXPECT_NE(refusal([&] { Data(folder / "fast.h5", "action", Half::all, 1, &data); }).find("60 Hz"), std::string::npos);
}

TEST(Judging, IsTheSameForAnyThreadsAndCompany) {
  const auto model = Classifier::load(files().model);
  const auto clips = motions(20, 6);
  const Judged all = model->judge(clips, 1), threaded = model->judge(clips, 3), alone = model->judge({clips[4]}, 1);
  EXPECT_EQ(all.features, threaded.features);
  EXPECT_EQ(all.posteriors, threaded.posteriors);
  EXPECT_EQ(alone.features.row(0), all.features.row(4));
  EXPECT_EQ(all.features.cols(), model->feature_size());
  EXPECT_LE(model->feature_size(), 64);
  for (Eigen::Index i = 0; i < 6; ++i) EXPECT_NEAR(all.posteriors.row(i).sum(), 1, 1e-12);
  EXPECT_EQ(model->attribute(), "action");
  EXPECT_EQ(model->classes(), (std::vector<std::string>{"run", "walk"}));
  EXPECT_EQ(model->train_sources().size(), 12U);
  EXPECT_TRUE(model->train_sources().contains(to_hex(sha256("c03"))));
  EXPECT_EQ(model->frame_rate_hz(), 30);
  EXPECT_EQ(model->judge({}, 1).features.rows(), 0);
}

TEST(Judging, RefusesWhatItWasNotTrainedOn) {
  const auto model = Classifier::load(files().model);
  Clip clip = swinging("odd", 20, true, 0);
  clip.frame_rate_hz = 60;
  EXPECT_NE(refusal([&] { model->judge({clip}, 1); }).find("clip odd: 60 Hz"), std::string::npos);
  clip.frame_rate_hz = 30;
  clip.root_position[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal([&] { model->judge({clip}, 2); }).find("not finite"), std::string::npos);
  auto longer = std::make_shared<Skeleton>(*canonical_body());
  longer->rest_offsets[5].z() += 0.01;
  clip = swinging("odd", 20, true, 0);
  clip.skeleton = longer;
  EXPECT_NE(refusal([&] { model->judge({clip}, 1); }).find("another skeleton"), std::string::npos);
  EXPECT_EQ(model->judge({swinging("one", 1, true, 0)}, 1).posteriors.rows(), 1);
}

TEST(Judging, RefusesModelsThatDoNotFit) {
  const TemporaryFolder folder;
  const auto altered = [&](const std::function<void(store::ModelFile&)>& alter) {
    store::ModelFile m = store::read_model(files().model);
    alter(m);
    store::write_model(folder / "x.h5", Overwrite::allow, m);
    return refusal([&] { Classifier::load(folder / "x.h5"); });
  };
  EXPECT_NE(altered([](auto& m) { m.kind = "denoiser"; }).find("expected a classifier"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.config = "{}"; }).find("config"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.config = "[1]"; }).find("config"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.vocabulary["action"].push_back("fly"); }).find("vocabulary"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.mean.pop_back(), m.deviation.pop_back(); }).find("normalization"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.deviation[0] = 0; }).find("above 0"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.weights.begin()->second.values[0] = NAN; }).find("not finite"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.weights.erase(m.weights.begin()); }).find("weights"), std::string::npos);
  EXPECT_EQ(altered([](auto&) {}), "");
}

TEST(Confusion, CountsTheUnlabelledAndTheUnknown) {
  const auto model = Classifier::load(files().model);
  auto clips = motions(20, 4);
  clips[0].attributes.clear();
  clips[1].attributes["action"] = "dance";
  clips[2].attributes["action"] = "run";  // it walks
  const auto found = confusion(*model, clips, model->judge(clips, 1));
  EXPECT_EQ(found.unlabelled, 1U);
  EXPECT_EQ(found.unknown, std::vector<std::string>{"c21"});
  EXPECT_EQ(found.clips(), 2U);
  EXPECT_EQ(found.accuracy(), 0.5);
  EXPECT_EQ(found.balanced_accuracy(), 0.5);
  EXPECT_EQ(found.counts[0], (std::vector<std::size_t>{1, 1}));
}

}  // namespace
}  // namespace mocap::classifier
