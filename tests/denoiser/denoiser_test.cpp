#include "libmodels/denoiser/denoiser.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmodels/denoiser/training.hpp"
#include "libmodels/nn/blas.hpp"
#include "libmodels/nn/mlp.hpp"
#include "libmodels/train/loop.hpp"
#include "libmodels/train/tensors.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::denoiser {
namespace {

using mocap::testing::refusal;
using mocap::testing::slurp;
using mocap::testing::TemporaryFolder;
using mocap::testing::write_archive;
using torch::Tensor;

// Swings of all joints while walking on a circle.
Clip swinging(const std::string& name, std::size_t frames, double phase) {
  Clip clip;
  clip.name = name;
  clip.skeleton = canonical_body();
  const auto joints = static_cast<std::size_t>(clip.joints());
  for (std::size_t t = 0; t < frames; ++t) {
    const double p = 0.3 * static_cast<double>(t) + phase, yaw = 0.02 * static_cast<double>(t);
    clip.rotations.push_back(yaw_rotation(yaw) * exp_map(Vector3(0.05 * std::sin(p), 0.05 * std::cos(p), 0)));
    for (std::size_t j = 1; j < joints; ++j) clip.rotations.push_back(exp_map(Vector3(0.1, 0.4 * std::sin(p + static_cast<double>(j)), 0)));
    clip.root_position.emplace_back(2 * std::sin(yaw), 2 - 2 * std::cos(yaw), 0.9 + 0.02 * std::sin(2 * p));
  }
  make_sign_continuous(clip);
  clip.attributes = {{"action", "walk"}};
  clip.source.path = name + ".bvh";
  clip.source.sha256 = to_hex(sha256(name));
  return clip;
}

std::vector<Clip> motions() {
  std::vector<Clip> clips;
  for (std::size_t i = 0; i < 6; ++i) clips.push_back(swinging(fmt::format("c{}", i), i == 0 ? 20 : 90 + i, 0.9 * static_cast<double>(i)));  // one shorter than the window
  return clips;
}

TrainingConfig tiny(std::int64_t epochs) {
  TrainingConfig c;
  c.epochs = epochs;
  c.batch = 6;
  c.window = 32;
  c.shards = 3;
  c.learning_rate = 3e-3;
  return c;
}

struct Files {
  TemporaryFolder folder;
  std::string train = folder / "train.h5", untrained = folder / "u.h5", model = folder / "m.h5";
  double before = 0, after = 0;
  Files() {
    nn::use_one_blas_thread();
    write_archive(train, motions());
    const Data data(train);
    DenoiserTraining training(tiny(120), {&data, nullptr, &data, nullptr});
    store::ModelFile fresh = training.describe();
    fresh.weights = train::to_stored(training.parameters());
    store::write_model(untrained, Overwrite::refuse, fresh);
    before = *training.validation_loss();
    train::LoopOptions options;
    options.output = model;
    options.threads = 2;
    train::train(training, options, {});
    after = *training.validation_loss();
  }
};
const Files& files() {
  static const Files f;
  return f;
}

std::string trained(int threads) {
  const TemporaryFolder folder;
  const Data data(files().train);
  DenoiserTraining training(tiny(3), {&data});
  train::LoopOptions options;
  options.output = folder / "m.h5";
  options.threads = threads;
  options.weights_only = true;
  train::train(training, options, {});
  return slurp(options.output);
}

TEST(Training, LossFallsBelowThatOfDoingNothing) {
  EXPECT_LT(files().before, 0.1 * 0.25);  // the corruption itself: share times variance
  EXPECT_LT(files().after, 0.3 * files().before);
}

TEST(Training, TwinsAreOnTheSideOfTheCleanQuaternions) {
  const TemporaryFolder folder;
  auto half = motions();
  for (auto& clip : half)  // a joint at a half turn, where noise decides the sign
    for (std::size_t t = 0; t < clip.frames(); ++t) clip.rotations[t * static_cast<std::size_t>(clip.joints()) + 3] = exp_map(Vector3(3.14 + 0.01 * std::sin(0.3 * static_cast<double>(t)), 0, 0));
  write_archive(folder / "clean.h5", half);
  for (auto& clip : half)
    for (std::size_t t = 0; t < clip.frames(); ++t) {
      auto& q = clip.rotations[t * static_cast<std::size_t>(clip.joints()) + 3];
      q = q * exp_map(Vector3(0.02, 0, 0));
    }
  std::reverse(half.begin(), half.end());
  write_archive(folder / "noisy.h5", half);
  const Data clean(folder / "clean.h5");
  Data noisy(folder / "noisy.h5", &clean);
  noisy.match(clean);
  for (std::size_t i = 0; i < clean.clips().size(); ++i) {
    const auto difference = (clean.clips()[i] - noisy.clips()[i]).narrow(1, 8, 4).abs().max().item<double>();  // of that joint; 0.02 is the least deviation
    EXPECT_LT(difference * 0.02, 0.02) << i;
  }
}

TEST(Training, SameBitsOnASecondRunForAnyThreads) {
  const std::string once = trained(1);
  EXPECT_TRUE(trained(1) == once);
  EXPECT_TRUE(trained(2) == once);
  EXPECT_TRUE(trained(4) == once);
}

TEST(Training, RateFallsByAHundredthEveryTenEpochs) {
  const Data data(files().train);
  const DenoiserTraining training(tiny(30), {&data});
  const std::int64_t epoch = training.steps_per_epoch();
  EXPECT_EQ(training.steps(), 30 * epoch);
  EXPECT_EQ(training.learning_rate(10 * epoch - 1), 3e-3);
  EXPECT_DOUBLE_EQ(training.learning_rate(10 * epoch), 0.99 * 3e-3);
  EXPECT_DOUBLE_EQ(training.learning_rate(20 * epoch), 0.99 * 0.99 * 3e-3);
  EXPECT_EQ(TrainingConfig().learning_rate, 1e-4);
  EXPECT_EQ(TrainingConfig().epochs, 300);
  auto odd = tiny(1);
  odd.window = 0;
  EXPECT_NE(refusal([&] { DenoiserTraining(odd, {&data}); }).find("at least 1"), std::string::npos);
}

TEST(Network, EdgesRepeatTheFirstAndLastFrame) {
  const Tensor x = torch::arange(5).to(torch::kFloat32).view({5, 1});
  const Tensor all = with_edges(x, 0, 6), middle = with_edges(x, 2, 2);
  ASSERT_EQ(all.size(0), 6 + 2 * kReach);
  for (std::int64_t t = 0; t < all.size(0); ++t) EXPECT_EQ(all[t][0].item<float>(), static_cast<float>(std::clamp<std::int64_t>(t - kReach, 0, 4)));
  for (std::int64_t t = 0; t < middle.size(0); ++t) EXPECT_EQ(middle[t][0].item<float>(), static_cast<float>(std::clamp<std::int64_t>(t - kReach + 2, 0, 4)));
}

TEST(Network, PartsOfAClipAreWhatTheWholeIs) {
  Random random(5, 0);
  const NetworkConfig config{2};
  Network network(config);
  const torch::NoGradGuard no_grad;
  for (auto& [name, parameter] : nn::parameters_by_path(network))
    Tensor(parameter).copy_(nn::normal_tensor(parameter.sizes(), random) * 0.3);
  const Tensor x = nn::normal_tensor({60, config.columns()}, random);
  const Tensor whole = network.forward(with_edges(x, 0, 60).unsqueeze(0))[0].narrow(0, kReach, 60);
  for (const std::int64_t first : {0, 20, 40}) {
    const Tensor part = network.forward(with_edges(x, first, 20).unsqueeze(0))[0].narrow(0, kReach, 20);
    EXPECT_LT((part - whole.narrow(0, first, 20)).abs().max().item<double>(), 1e-4) << first;
  }
  EXPECT_GT((whole - x).abs().max().item<double>(), 0.1);
}

double worst_angle(const Clip& a, const Clip& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.rotations.size(); ++i) worst = std::max(worst, geodesic_distance(a.rotations[i], b.rotations[i]));
  return worst;
}
double worst_distance(const Clip& a, const Clip& b) {
  double worst = 0;
  for (std::size_t t = 0; t < a.frames(); ++t) worst = std::max(worst, (a.root_position[t] - b.root_position[t]).norm());
  return worst;
}

TEST(Network, UntrainedIsASavitzkyGolayFilterTwice) {
  const NetworkConfig config{2};
  const Network network(config);
  const torch::NoGradGuard no_grad;
  Random random(6, 0);
  const Tensor x = nn::normal_tensor({1, 40, config.columns()}, random);
  const double taps[] = {-3.0 / 35, 12.0 / 35, 17.0 / 35, 12.0 / 35, -3.0 / 35};
  const auto filtered = [&](const Tensor& in) {
    Tensor out = torch::zeros_like(in);
    for (std::int64_t t = 2; t < 38; ++t)
      for (std::int64_t k = 0; k < 5; ++k) out[0][t] += taps[k] * in[0][t + k - 2];
    return out;
  };
  const Tensor expected = filtered(filtered(x)), found = network.forward(x);
  EXPECT_LT((expected - found).narrow(1, 8, 24).abs().max().item<double>(), 1e-5);
}

TEST(Denoising, WithoutTrainingSmoothMotionStaysAsItIs) {
  const auto model = Denoiser::load(files().untrained);
  for (const std::size_t frames : {1, 2, 3, 25, 4200}) {
    Clip clip = swinging("still", frames, 0.2);  // on its circle, at an even speed
    const auto joints = static_cast<std::size_t>(clip.joints());
    for (std::size_t t = 0; t < frames; ++t) {
      clip.root_position[t].z() = 0.9;
      clip.rotations[t * joints] = yaw_rotation(0.02 * static_cast<double>(t));
      for (std::size_t j = 1; j < joints; ++j) clip.rotations[t * joints + j] = clip.rotations[j];
    }
    make_sign_continuous(clip);
    const Clip out = model->apply(clip);
    ASSERT_EQ(out.frames(), frames);
    EXPECT_LT(worst_angle(clip, out), 2e-5) << frames;
    EXPECT_LT(worst_distance(clip, out), 2e-5) << frames;
  }
}

TEST(Denoising, APoseThatLastsIsNoSpike) {
  const auto model = Denoiser::load(files().untrained);
  Clip clip = swinging("far", 60, 0.2);
  const auto joints = static_cast<std::size_t>(clip.joints());
  for (std::size_t t = 0; t < 60; ++t) {
    clip.root_position[t].z() = 1.6;  // on a platform; the height trained on varies by 2 cm
    clip.rotations[t * joints + 4] = exp_map(Vector3(0, 0, 1.5));  // an axis that nothing turned about
  }
  const Clip out = model->apply(clip);
  for (std::size_t t = 0; t < 60; ++t) {
    EXPECT_NEAR(out.root_position[t].z(), 1.6, 1e-4) << t;
    EXPECT_LT(geodesic_distance(out.rotations[t * joints + 4], clip.rotations[t * joints + 4]), 1e-3) << t;
  }
}

TEST(Denoising, BringsNoisyMotionNearerToTheTruthWithoutDrift) {
  const auto model = Denoiser::load(files().model);
  const Clip truth = swinging("t", 900, 0.5);
  Clip noisy = truth;
  Random random(8, 0);
  for (auto& q : noisy.rotations)
    if (random.uniform() < 0.1) q = (q * exp_map(0.25 * Vector3(random.normal(), random.normal(), random.normal()))).normalized();
  noisy.attributes["mood"] = "calm";
  noisy.segments.push_back({3, 9, {{"action", "turn"}}});
  const Clip out = model->apply(noisy);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < truth.rotations.size(); ++i) {
    before += std::pow(geodesic_distance(truth.rotations[i], noisy.rotations[i]), 2);
    after += std::pow(geodesic_distance(truth.rotations[i], out.rotations[i]), 2);
  }
  EXPECT_LT(after, 0.5 * before);
  EXPECT_LT(worst_distance(truth, out), 0.15);
  EXPECT_EQ(out.name, "t");
  EXPECT_EQ(out.attributes, noisy.attributes);
  EXPECT_EQ(out.segments.size(), 1U);
  EXPECT_EQ(out.source.sha256, truth.source.sha256);
  for (const auto& q : out.rotations) ASSERT_NEAR(q.norm(), 1, 1e-12);
  out.validate();
  const Clip again = model->apply(noisy);
  EXPECT_EQ(worst_angle(again, out), 0);
}

TEST(Denoising, RefusesWhatItWasNotTrainedOn) {
  const auto model = Denoiser::load(files().untrained);
  Clip clip = swinging("odd", 20, 0);
  clip.frame_rate_hz = 60;
  EXPECT_NE(refusal([&] { model->apply(clip); }).find("clip odd: 60 Hz"), std::string::npos);
  clip.frame_rate_hz = 30;
  clip.root_position[3].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal([&] { model->apply(clip); }).find("not finite"), std::string::npos);
  clip = swinging("odd", 20, 0);
  auto longer = std::make_shared<Skeleton>(*canonical_body());
  longer->rest_offsets[5].z() += 0.01;
  clip.skeleton = longer;
  EXPECT_NE(refusal([&] { model->apply(clip); }).find("another skeleton"), std::string::npos);
  const TemporaryFolder folder;
  const auto altered = [&](const std::function<void(store::ModelFile&)>& alter) {
    store::ModelFile m = store::read_model(files().untrained);
    alter(m);
    store::write_model(folder / "x.h5", Overwrite::allow, m);
    return refusal([&] { Denoiser::load(folder / "x.h5"); });
  };
  EXPECT_NE(altered([](auto& m) { m.kind = "classifier"; }).find("expected a denoiser"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.config = "{}"; }).find("config"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.mean.pop_back(), m.deviation.pop_back(); }).find("normalization"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.deviation[0] = 0; }).find("above 0"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.weights.begin()->second.values[0] = NAN; }).find("not finite"), std::string::npos);
  EXPECT_NE(altered([](auto& m) { m.weights.erase(m.weights.begin()); }).find("weights"), std::string::npos);
}

TEST(Changes, SayWhatWhereAndWhatIsLeftOfTheSpeed) {
  const Clip before = swinging("a", 30, 0);
  Clip after = before;
  const int knee = before.skeleton->find_role("left_foot");
  ASSERT_GT(knee, 0);
  const auto j = static_cast<std::size_t>(knee), joints = static_cast<std::size_t>(before.joints());
  auto& q = after.rotations[12 * joints + j];
  q = q * exp_map(Vector3(0.1, 0, 0));
  auto same = changes(before, before), turned = changes(before, after);
  EXPECT_EQ(same[j].worst_mm, 0);
  EXPECT_EQ(same[j].peak_speed_kept, 1);
  EXPECT_GT(same[j].peak_speed_mps, 0);
  EXPECT_NEAR(turned[j].worst_deg, 5.7296, 1e-3);
  EXPECT_NEAR(turned[j].mean_deg, 5.7296 / 30, 1e-4);
  EXPECT_EQ(turned[j].worst_deg_frame, 12U);
  EXPECT_EQ(turned[0].worst_deg, 0);
  after = before;
  for (auto& p : after.root_position) p = before.root_position[0];
  after.root_position[7] += Vector3(0, 0.003, 0);
  turned = changes(before, after);
  EXPECT_LT(turned[0].peak_speed_kept, 0.2);
  EXPECT_EQ(turned[0].worst_mm_frame, 29U);
  EXPECT_GT(turned[0].mean_mm, 1);
}

}  // namespace
}  // namespace mocap::denoiser
