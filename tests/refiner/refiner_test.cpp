#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <functional>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/skeleton/forward_kinematics.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/refiner/model.hpp"
#include "libmodels/refiner/training.hpp"
#include "libmodels/train/adam.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/nn/gradient_check.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::refiner {
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

std::vector<Clip> motions(std::size_t count, std::uint64_t seed, std::size_t frames = 60) {
  std::vector<Clip> clips;
  for (std::size_t i = 0; i < count; ++i) clips.push_back(with_contacts(sample_clip(fmt::format("clip{}-{}", seed, i), frames + i, seed + i)));
  return clips;
}

struct Data {
  TemporaryFolder folder;
  std::unique_ptr<train::StateDataset> real, generated;
  Data() {
    mocap::testing::write_archive(folder / "real.h5", motions(6, 1), "preset:default");
    real = std::make_unique<train::StateDataset>(folder / "real.h5");
    generated = std::make_unique<train::StateDataset>("generator", motions(5, 100), real->reference());
  }
};
const Data& data() {
  static const Data d;
  return d;
}

RefinerConfig tiny() {
  RefinerConfig c;
  c.hidden = 6;
  c.width = 5;
  return c;
}

TrainingConfig short_training() {
  TrainingConfig c;
  c.batch = 6;
  c.window = 8;
  c.buffer = 10;
  c.beginning = 2;
  c.steps = 100;
  return c;
}

TEST(EndEffectors, AreWhereForwardKinematicsHasThem) {
  const Clip clip = motions(1, 1)[0];
  const EndEffectors effectors(data().real->reference());
  ASSERT_EQ(effectors.names(), (std::vector<std::string>{"left_foot", "right_foot", "left_ankle", "right_ankle", "left_hand", "right_hand", "head"}));
  const Tensor e = effectors(data().real->clips()[0].rows.unsqueeze(1)).squeeze(1);
  std::vector<std::vector<Vector3>> world;
  std::vector<double> heading;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    Pose pose;
    world_pose(clip, t, pose);
    std::vector<Vector3> points;
    for (const auto& name : effectors.names()) points.push_back(pose.positions[static_cast<std::size_t>(clip.skeleton->find_role(name))]);
    world.push_back(points);
    heading.push_back(yaw_of(clip.rotations[t * 22]));
  }
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t k = 0; k < 7; ++k) {
      const Vector3 below(clip.root_position[t].x(), clip.root_position[t].y(), 0);
      const Vector3 p = yaw_rotation(-heading[t]) * (world[t][k] - below);
      const Vector3 v = t == 0 ? Vector3(0, 0, 0) : Vector3(30 * (yaw_rotation(-heading[t - 1]) * (world[t][k] - world[t - 1][k])));
      for (int i = 0; i < 3; ++i) {
        const auto row = static_cast<std::int64_t>(t), at = static_cast<std::int64_t>(3 * k) + i;
        ASSERT_NEAR(e[row][at].item<double>(), p[i], 1e-5) << t << " " << k;
        ASSERT_NEAR(e[row][21 + at].item<double>(), v[i], 1e-3) << t << " " << k;
      }
    }
}

TEST(EndEffectors, PiecesNeedWhereTheyWere) {
  const EndEffectors effectors(data().real->reference());
  const Tensor rows = data().real->clips()[1].rows.unsqueeze(1), whole = effectors(rows);
  const Tensor first = effectors(rows.narrow(0, 0, 20)), rest = effectors(rows.narrow(0, 20, rows.size(0) - 20), first[19].narrow(1, 0, 21));
  EXPECT_TRUE(torch::equal(whole, torch::cat({first, rest})));
}

TEST(EndEffectors, ABodyWithoutFeetIsRefused) {
  auto s = std::make_shared<Skeleton>(*canonical_body());
  s->roles.erase("left_foot");
  train::Reference r = data().real->reference();
  r.skeleton = s;
  EXPECT_NE(refusal([&] { EndEffectors e(r); }).find("no left_foot"), std::string::npos);
}

TEST(RootPath, IsTheDecodedWay) {
  const Clip clip = motions(1, 1)[0];
  const Tensor path = root_path(data().real->clips()[0].rows.unsqueeze(1), data().real->reference()).squeeze(1);
  const double heading = yaw_of(clip.rotations[0]);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    const Vector3 p = yaw_rotation(-heading) * Vector3(clip.root_position[t].x() - clip.root_position[0].x(), clip.root_position[t].y() - clip.root_position[0].y(), 0);
    EXPECT_NEAR(path[static_cast<std::int64_t>(t)][0].item<double>(), p.x(), 2e-4);
    EXPECT_NEAR(path[static_cast<std::int64_t>(t)][1].item<double>(), p.y(), 2e-4);
    EXPECT_NEAR(path[static_cast<std::int64_t>(t)][2].item<double>(), clip.root_position[t].z(), 1e-5);
  }
}

TEST(Refiner, FiniteDifferencesThroughRefinerKinematicsAndDiscriminator) {
  RefinerNetwork network(tiny(), 1);
  Discriminator discriminator(tiny(), 1);
  network.to(torch::kDouble);
  discriminator.to(torch::kDouble);
  {
    const torch::NoGradGuard guard;
    network.output->weight(0).mul_(20);
  }
  const EndEffectors effectors(data().real->reference());
  const Tensor rows = data().real->clips()[0].rows.narrow(0, 0, 10).reshape({5, 2, 71}).to(torch::kDouble);
  const Tensor zero = torch::zeros({2, 12}, torch::kDouble);
  const auto loss = [&](const std::vector<Tensor>& in) {
    const Tensor out = network.forward(in[0], 0.1 * effectors(in[0]), zero).rows;
    const Tensor logits = discriminator.forward(out.narrow(2, 69, 2), 0.1 * effectors(out));
    return torch::nn::functional::softplus(-logits).sum() + (root_path(out, data().real->reference()) - root_path(in[0], data().real->reference())).square().sum();
  };
  expect_gradients(loss, {rows}, 1e-5, 40);
  const auto parameters = network.parameters();
  const auto gradients = torch::autograd::grad({loss({rows})}, parameters);
  const torch::NoGradGuard guard;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Tensor flat = parameters[i].view({-1});
    const std::int64_t e = flat.numel() / 3;
    const double before = flat[e].item<double>(), step = 1e-6;
    flat[e] = before + step;
    const double up = loss({rows}).item<double>();
    flat[e] = before - step;
    const double down = loss({rows}).item<double>();
    flat[e] = before;
    EXPECT_NEAR(gradients[i].reshape({-1})[e].item<double>(), (up - down) / (2 * step), 1e-5) << i;
  }
}

TEST(Discriminator, EveryFrameIsJudgedInViewOfTheWholeMotion) {
  const Discriminator discriminator(tiny(), 1);
  const EndEffectors effectors(data().real->reference());
  const Tensor rows = data().real->clips()[0].rows.narrow(0, 0, 12).unsqueeze(1).clone();
  const auto judged = [&] { return discriminator.forward(rows.narrow(2, 69, 2), effectors(rows)); };
  const Tensor before = judged();
  rows[11][0][20] += 1;  // of the last frame
  const Tensor after = judged();
  for (int t = 0; t < 12; ++t) EXPECT_NE(before[t][0].item<float>(), after[t][0].item<float>()) << t;
}

TEST(Discriminator, WithoutContactsTheyAreNotSeen) {
  RefinerConfig c = tiny();
  c.contacts = false;
  const Discriminator discriminator(c, 1);
  const RefinerNetwork network(c, 1);
  const EndEffectors effectors(data().real->reference());
  Tensor rows = data().real->clips()[0].rows.narrow(0, 0, 12).unsqueeze(1).clone();
  const Tensor d = discriminator.forward(rows.narrow(2, 69, 2), effectors(rows)), r = network.forward(rows, effectors(rows), torch::zeros({1, 12})).rows;
  rows.narrow(2, 69, 2).fill_(0.5);
  EXPECT_TRUE(torch::equal(d, discriminator.forward(rows.narrow(2, 69, 2), effectors(rows))));
  const Tensor again = network.forward(rows, effectors(rows), torch::zeros({1, 12})).rows;
  EXPECT_TRUE(torch::equal(r.narrow(2, 0, 69), again.narrow(2, 0, 69)));
  EXPECT_TRUE(torch::equal(again.narrow(2, 69, 2), rows.narrow(2, 69, 2)));
}

Model model_of(RefinerTraining& training) {
  store::ModelFile file = training.describe();
  for (const auto& [name, tensor] : train::to_stored(training.parameters())) file.weights[name] = tensor;
  return read(file, "model.h5");
}

TEST(Refining, WithoutAChangeTheMotionStays) {
  RefinerTraining training(tiny(), short_training(), *data().real, *data().generated, {});
  {
    const torch::NoGradGuard guard;
    training.refiner().output->weight(0).zero_();
  }
  const Clip clip = motions(1, 50)[0], out = refine(model_of(training), clip);
  EXPECT_EQ(out.name, clip.name);
  EXPECT_EQ(out.contacts, clip.contacts);
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) ASSERT_LT(geodesic_distance(clip.rotations[i], out.rotations[i]), 1e-5);
  for (std::size_t t = 0; t < clip.frames(); ++t) ASSERT_LT((clip.root_position[t] - out.root_position[t]).norm(), 1e-4);
}

TEST(Refining, PiecesGiveTheBitsOfTheWhole) {
  RefinerTraining training(tiny(), short_training(), *data().real, *data().generated, {});
  {
    const torch::NoGradGuard guard;
    training.refiner().output->weight(0).mul_(30);
  }
  const Model model = model_of(training);
  const Clip clip = motions(1, 50, 101)[0], whole = refine(model, clip);
  double changed = 0;
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) changed = std::max(changed, geodesic_distance(clip.rotations[i], whole.rotations[i]));
  EXPECT_GT(changed, 0.05);
  for (const std::size_t piece : {1, 2, 7, 50, 100}) {
    const Clip other = refine(model, clip, piece);
    for (std::size_t i = 0; i < whole.rotations.size(); ++i) ASSERT_EQ(whole.rotations[i].coeffs(), other.rotations[i].coeffs()) << piece;
    for (std::size_t t = 0; t < whole.frames(); ++t) ASSERT_EQ(whole.root_position[t], other.root_position[t]) << piece;
    ASSERT_EQ(whole.contacts, other.contacts);
  }
}

TEST(Refining, OtherBodiesAndRatesAreRefused) {
  RefinerTraining training(tiny(), short_training(), *data().real, *data().generated, {});
  const Model model = model_of(training);
  Clip clip = motions(1, 50)[0];
  clip.frame_rate_hz = 60;
  EXPECT_NE(refusal([&] { (void)refine(model, clip); }).find("60 Hz, expected the refiner's 30 Hz"), std::string::npos);
  clip = motions(1, 50)[0];
  auto longer = std::make_shared<Skeleton>(*clip.skeleton);
  longer->rest_offsets[4] *= 1.1;
  clip.skeleton = longer;
  EXPECT_NE(refusal([&] { (void)refine(model, clip); }).find("another skeleton"), std::string::npos);
}

TEST(Model, WhatIsNotARefinerIsRefused) {
  RefinerTraining training(tiny(), short_training(), *data().real, *data().generated, {});
  store::ModelFile whole = training.describe();
  for (const auto& [name, tensor] : train::to_stored(training.parameters())) whole.weights[name] = tensor;
  EXPECT_NO_THROW(read(whole, "m.h5"));
  const auto spoilt = [&](const std::function<void(store::ModelFile&)>& spoil) {
    store::ModelFile file = whole;
    spoil(file);
    return refusal([&] { (void)read(file, "m.h5"); });
  };
  EXPECT_NE(spoilt([](auto& f) { f.kind = "denoiser"; }).find("expected refiner"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.config = "{}"; }).find("config"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("effectors/mean"); }).find("effectors/mean"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.at("effectors/deviation").values[3] = 0; }).find("effectors/deviation"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.weights.erase("refiner/output/0/bias"); }).find("m.h5"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.mean.pop_back(); }).find("normalization"), std::string::npos);
  EXPECT_NE(spoilt([](auto& f) {
              auto s = std::make_shared<Skeleton>(*f.skeleton);
              s->roles.erase("right_foot");
              f.skeleton = s;
            }).find("m.h5:skeleton/roles: no right_foot"),
            std::string::npos);
  EXPECT_NE(spoilt([](auto& f) { f.config.replace(f.config.find("preset:default"), 14, "preset:unknown"); }).find("m.h5:config"), std::string::npos);
}

// Runs steps by hand, as the loop does; one update of size 0, so that only the schedule is seen.
struct Steps {
  RefinerTraining training;
  std::int64_t step = 0;
  explicit Steps(const TrainingConfig& c) : training(tiny(), c, *data().real, *data().generated, {}) {}
  bool discriminates() {
    training.prepare(step);
    return training.trained().first > 0;
  }
  void updated(double discriminator_loss) {
    train::LossTerms terms, ignored;
    (void)training.shard_loss(0, terms);
    terms[3].second = discriminator_loss;
    training.updated(terms);
    ++step;
  }
};

TEST(Training, BeginsInTurnsThenFiveToOneAndAdapts) {
  Steps steps(short_training());
  std::string seen;
  const auto run = [&](int count, double loss) {
    for (int i = 0; i < count; ++i) {
      const bool d = steps.discriminates();
      seen += d ? 'd' : 'r';
      steps.updated(loss);
    }
  };
  run(4, 0.5);  // the beginning, twice each
  EXPECT_EQ(seen, "drdr");
  seen.clear();
  run(12, 0.5);
  EXPECT_EQ(seen, "rrrrrdrrrrrd");
  // `count` updates of the discriminator with this loss; how many of the refiner lie between the last two.
  const auto between = [&](int count, double loss) {
    int since = 0, last = 0;
    while (count > 0) {
      if (steps.discriminates()) {
        last = std::exchange(since, 0);
        --count;
      } else {
        ++since;
      }
      steps.updated(loss);
    }
    return last;
  };
  EXPECT_EQ(between(1, 30), 5);  // the mean is 3.6: halved, and begins at log 2 again
  EXPECT_EQ(between(2, 0.5), 2);
  EXPECT_EQ(between(1, 1.5), 2);  // one bad batch: 0.75
  EXPECT_EQ(between(5, 0.5), 2);
  EXPECT_EQ(between(50, 1e-4), 4);  // the mean is below 0.01 after some 40 updates
  EXPECT_EQ(between(50, 1e-4), 8);
}

TEST(Training, HalfOfTheBatchIsOldAndGoesOutOfTheBuffer) {
  Steps steps(short_training());
  const Tensor buffer = steps.training.memory()[0].second, before = buffer.clone();
  ASSERT_EQ(buffer.sizes(), at::IntArrayRef({10, 8, 71}));
  ASSERT_TRUE(steps.discriminates());
  int replaced = 0;
  for (std::int64_t i = 0; i < 10; ++i) replaced += !torch::equal(before[i], buffer[i]);
  EXPECT_EQ(replaced, 3);
}

TEST(Training, TheDiscriminatorLearnsToTellRealFromGenerated) {
  RefinerConfig network = tiny();
  network.hidden = network.width = 24;
  TrainingConfig c = short_training();
  c.beginning = 0;
  c.ratio = 1;
  c.batch = 16;
  c.window = 16;
  c.buffer = 32;
  RefinerTraining training(network, c, *data().real, *data().generated, {});
  auto optimizer = training.optimizer();
  const auto parameters = training.parameters();
  double first = 0, last = 0;
  for (std::int64_t step = 0; step < 120; ++step) {
    training.prepare(step);
    const auto [begin, count] = training.trained();
    std::vector<Tensor> trained;
    for (std::size_t i = begin; i < begin + count; ++i) trained.push_back(parameters[i].second);
    train::LossTerms terms, sums;
    Tensor loss;
    for (int shard = 0; shard < 2; ++shard) {
      const Tensor part = training.shard_loss(shard, terms);
      loss = loss.defined() ? loss + part : part;
      if (sums.empty())
        sums = terms;
      else
        for (std::size_t i = 0; i < sums.size(); ++i) sums[i].second += terms[i].second;
    }
    if (begin > 0) optimizer->step(torch::autograd::grad({loss}, trained), 0.003, begin);  // the refiner stays as it is
    training.updated(sums);
    if (begin > 0) (first == 0 ? first : last) = sums[3].second;
  }
  EXPECT_NEAR(first, std::log(2.0), 0.1);
  EXPECT_LT(last, 0.2);
}

TEST(Training, ShortClipsAreNotShownPadded) {
  std::vector<Clip> clips = motions(2, 300, 5);  // 5 and 6 frames
  clips.push_back(motions(1, 7)[0]);
  const train::StateDataset mixed("generator", clips, data().real->reference());
  EXPECT_EQ(mixed.shorter_than(8), 2u);
  RefinerTraining training(tiny(), short_training(), *data().real, mixed, {});
  const train::StateBatch batch = train::draw_states(mixed, 50, 8, 1, 2, train::ShortClips::left_out);
  EXPECT_EQ(batch.mask.sum().item<double>(), 400);
  const train::StateDataset brief("brief.h5", motions(2, 300, 5), data().real->reference());
  EXPECT_NE(refusal([&] { RefinerTraining(tiny(), short_training(), *data().real, brief, {}); }).find("brief.h5: no clip of 8 frames"), std::string::npos);
  EXPECT_NE(refusal([&] { RefinerTraining(tiny(), short_training(), brief, *data().generated, {}); }).find("no clip of 8 frames"), std::string::npos);
}

// The first update of the refiner, whose change is small but not nothing: what the term says is checked against the feet of the refined motion, decoded.
TEST(Training, TheContactTermIsTheSquaredSpeedOfFeetThatAreDown) {
  TrainingConfig c = short_training();
  c.shards = 1;
  c.contact_weight = 4;
  RefinerTraining training(tiny(), c, *data().real, *data().generated, {});
  training.prepare(1);  // in the beginning the second is the refiner's
  ASSERT_EQ(training.trained().first, 0u);
  train::LossTerms terms;
  const Tensor loss = training.shard_loss(0, terms);
  ASSERT_EQ(terms[2].first, "contact");
  EXPECT_NEAR(loss.item<double>(), terms[0].second + c.root_weight * terms[1].second + 4 * terms[2].second, 1e-5 * std::abs(loss.item<double>()));
  const auto reference = data().real->reference();
  const EndEffectors end_effectors(reference);
  const Tensor given = train::draw_states(*data().generated, c.batch, c.window, c.seed, stream_of(102, 1), train::ShortClips::left_out).rows;
  const store::ModelFile described = training.describe();
  const Tensor mean = train::from_stored(described.weights.at("effectors/mean")), deviation = train::from_stored(described.weights.at("effectors/deviation"));
  const Tensor out = training.refiner().forward(given, (end_effectors(given) - mean) / deviation, torch::zeros({c.batch, 2 * tiny().hidden})).rows.detach().contiguous();
  const auto place = [](const Clip& clip, std::size_t t, int joint) {
    const auto joints = static_cast<std::size_t>(clip.skeleton->joint_count());
    Pose pose;
    forward_kinematics(*clip.skeleton, std::span(clip.rotations).subspan(t * joints, joints), clip.root_position[t], pose);
    return pose.positions[static_cast<std::size_t>(joint)];
  };
  double sum = 0;
  std::int64_t down = 0;
  for (std::int64_t b = 0; b < c.batch; ++b) {
    const Tensor rows = out.select(1, b).contiguous();
    auto [features, contacts] = train::raw_states(rows.data_ptr<float>(), c.window, reference);
    const Clip clip = features::decode_state(features, reference.skeleton, reference.frame_rate_hz);
    for (std::size_t t = 1; t < clip.frames(); ++t)
      for (int side = 0; side < 2; ++side) {
        if (!contacts[t][static_cast<std::size_t>(side)]) continue;
        const int foot = clip.skeleton->find_role(side == 0 ? "left_foot" : "right_foot");
        sum += ((place(clip, t, foot) - place(clip, t - 1, foot)) * clip.frame_rate_hz).squaredNorm();
        ++down;
      }
  }
  ASSERT_GT(down, 20);
  EXPECT_NEAR(terms[2].second, sum / static_cast<double>(2 * c.batch * c.window), 1e-4 * terms[2].second);
}

TEST(Training, RatesFallToNothing) {
  TrainingConfig c = short_training();
  c.full_rate = 0.5;
  Steps steps(c);
  const bool d = steps.discriminates();
  const double full = d ? c.discriminator_rate : c.refiner_rate;
  EXPECT_EQ(steps.training.learning_rate(0), full);
  EXPECT_EQ(steps.training.learning_rate(49), full);
  EXPECT_NEAR(steps.training.learning_rate(75), full / 2, 1e-12);
  EXPECT_NEAR(steps.training.learning_rate(99), full / 50, 1e-12);
  c.full_rate = 1;
  EXPECT_EQ(Steps(c).training.learning_rate(99), c.refiner_rate);
}

TEST(Training, MotionThatHasBlownUpIsNamed) {
  std::vector<Clip> clips = motions(2, 300);
  clips[1].root_position[3].x() = std::nan("");
  EXPECT_NE(refusal([&] { train::StateDataset("generator.h5", clips, data().real->reference()); }).find("generator.h5"), std::string::npos);
}

TEST(Training, SettingsThatCannotBeAreRefused) {
  const auto message = [](const std::function<void(TrainingConfig&)>& change) {
    TrainingConfig c = short_training();
    change(c);
    return refusal([&] { c.validate(); });
  };
  EXPECT_EQ(message([](auto&) {}), "");
  EXPECT_NE(message([](auto& c) { c.batch = 7; }).find("even"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.buffer = 2; }).find("buffer"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.window = 1; }).find("window"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.ratio = 0; }).find("refiner updates"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.contact_weight = -1; }).find("contact weight is -1"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.full_rate = 1.5; }).find("1.5 of the updates"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.gradient_limit = std::nan(""); }).find("gradient limit"), std::string::npos);
  EXPECT_NE(message([](auto& c) { c.shards = 5; }).find("shards"), std::string::npos);
}

}  // namespace
}  // namespace mocap::refiner
