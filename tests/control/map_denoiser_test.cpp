#include "libmodels/control/map_denoiser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/base/parallel.hpp"
#include "libmodels/nn/blas.hpp"
#include "tests/control/control_support.hpp"

namespace mocap::control {
namespace {

using mocap::testing::refusal;

const lstm_gmm::Model& generator() {
  static const lstm_gmm::Model m = tiny_generator();
  return m;
}

Clip gentle(std::size_t frames, std::uint64_t seed = 1) { return gentle_motions(1, seed, frames)[0]; }

PlanOptions quick() {
  PlanOptions o;
  o.lbfgs = map_lbfgs();
  return o;
}

Terms terms_of(const MotionModel& model) { return {prior(), noise_prior(0.05), contact_term(0.05, 0.1, model.rest_height())}; }

MapDenoised denoised(const Clip& clip, const MapSettings& settings, const lstm_gmm::Model& m = generator(), const refiner::Model* refiner = nullptr, const PlanOptions& options = quick()) {
  const MotionModel model(m, refiner);
  return denoise_map(model, terms_of(model), settings, options, clip);
}

constexpr MapSettings kStrong = {0.001, 0.002, 8};

double most_turned(const Clip& a, const Clip& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.rotations.size(); ++i) most = std::max(most, geodesic_distance(a.rotations[i], b.rotations[i]));
  return most;
}

double most_moved(const Clip& a, const Clip& b) {
  double most = 0;
  for (std::size_t t = 0; t < a.frames(); ++t) most = std::max(most, (a.root_position[t] - b.root_position[t]).norm());
  return most;
}

void turn(Clip& clip, std::size_t joint, std::size_t frame, double degrees) {
  auto& q = clip.rotations[frame * static_cast<std::size_t>(clip.joints()) + joint];
  q = q * exp_map(Vector3(0.6, -0.64, 0.48) * (degrees * 3.14159265358979 / 180));
}

// Joint and all below it hold the values of frame `first` up to `last`.
void hold(Clip& clip, std::size_t joint, std::size_t first, std::size_t last) {
  const auto joints = static_cast<std::size_t>(clip.joints());
  std::vector<bool> below(joints);
  for (std::size_t j = joint; j < joints; ++j) {
    const int parent = clip.skeleton->parents[j];
    below[j] = j == joint || (parent >= 0 && below[static_cast<std::size_t>(parent)]);
    for (std::size_t t = first; below[j] && t <= last; ++t) clip.rotations[t * joints + j] = clip.rotations[first * joints + j];
  }
}

TEST(MapDenoiser, CleanMotionUnderStrongObservationComesBack) {
  const Clip clip = gentle(60);
  const MapDenoised found = denoised(clip, kStrong);
  EXPECT_LT(most_turned(found.clip, clip), 0.01);
  EXPECT_LT(most_moved(found.clip, clip), 0.003);
  EXPECT_TRUE(found.outliers.empty());
  EXPECT_EQ(found.windows, 3u);
  EXPECT_EQ(found.lowered, 3u);
  EXPECT_EQ(found.clip.name, clip.name);
  EXPECT_EQ(found.clip.source.path, clip.source.path);
  EXPECT_EQ(found.clip.contacts.size(), clip.frames());
}

TEST(MapDenoiser, RefinedMotionIsWhatIsHeldToTheMeasurements) {
  const refiner::Model refiner = tiny_refiner();
  const Clip clip = gentle(40);
  const MapDenoised found = denoised(clip, kStrong, generator(), &refiner);
  EXPECT_LT(most_turned(found.clip, clip), 0.03);
  EXPECT_LT(most_moved(found.clip, clip), 0.01);
}

TEST(MapDenoiser, AnyLength) {
  for (const std::size_t frames : {2, 3, 34, 35, 36, 52, 100}) {
    const Clip clip = gentle(frames);
    const MapDenoised found = denoised(clip, kStrong);
    ASSERT_EQ(found.clip.frames(), frames);
    found.clip.validate();
    EXPECT_LT(most_turned(found.clip, clip), 0.02) << frames;
    EXPECT_LT(most_moved(found.clip, clip), 0.005) << frames;
    EXPECT_TRUE(found.outliers.empty()) << frames;
  }
}

TEST(MapDenoiser, WindowsOfAnySize) {
  const Clip clip = gentle(40);
  for (const auto& [window, overlap] : {std::pair{2, 0}, {2, 1}, {10, 0}, {10, 9}, {100, 50}}) {
    PlanOptions o = quick();
    o.window = window;
    o.overlap = overlap;
    const MapDenoised found = denoised(clip, kStrong, generator(), nullptr, o);
    EXPECT_LT(most_turned(found.clip, clip), 0.02) << window;
    EXPECT_LT(most_moved(found.clip, clip), 0.005) << window;
  }
}

TEST(MapDenoiser, PlantedSpikeAndDropoutAreFoundAndNoOther) {
  const Clip clip = gentle(80);
  const auto joint = [&](const char* name) { return std::find(clip.skeleton->joint_names.begin(), clip.skeleton->joint_names.end(), name) - clip.skeleton->joint_names.begin(); };
  Clip noisy = clip;
  turn(noisy, static_cast<std::size_t>(joint("left_knee")), 20, 40);
  turn(noisy, static_cast<std::size_t>(joint("left_knee")), 21, 40);
  noisy.root_position[60] += Vector3(0, 0.1, 0);
  hold(noisy, static_cast<std::size_t>(joint("right_shoulder")), 40, 48);
  const MapDenoised found = denoised(noisy, {0.005, 0.01, 4});
  ASSERT_EQ(found.outliers.size(), 3u);
  const Outlier &spike = found.outliers[0], &dropout = found.outliers[1], &place = found.outliers[2];
  EXPECT_EQ(spike.joint, joint("left_knee"));
  EXPECT_FALSE(spike.dropout);
  EXPECT_EQ(spike.first, 20);
  EXPECT_EQ(spike.last, 21);
  EXPECT_NEAR(spike.largest, 0.7, 0.2);
  EXPECT_EQ(dropout.joint, joint("right_shoulder"));
  EXPECT_TRUE(dropout.dropout);
  EXPECT_EQ(dropout.first, 40);
  EXPECT_EQ(dropout.last, 48);
  EXPECT_EQ(place.joint, -1);
  EXPECT_FALSE(place.dropout);
  EXPECT_EQ(place.first, 60);
  EXPECT_EQ(place.last, 60);
  EXPECT_NEAR(place.largest, 0.1, 0.03);
  EXPECT_LT(most_moved(found.clip, clip), 0.03);
  EXPECT_LT(most_turned(found.clip, clip), 0.3);
}

TEST(MapDenoiser, FirstAndLastFrameMayBeSpikes) {
  const Clip clip = gentle(50);
  Clip noisy = clip;
  turn(noisy, 4, 0, 50);
  turn(noisy, 5, 49, 50);
  const MapDenoised found = denoised(noisy, {0.005, 0.01, 4});
  ASSERT_EQ(found.outliers.size(), 2u);
  EXPECT_EQ(found.outliers[0].joint, 4);
  EXPECT_EQ(found.outliers[0].last, 0);
  EXPECT_EQ(found.outliers[1].joint, 5);
  EXPECT_EQ(found.outliers[1].first, 49);
  EXPECT_LT(most_turned(found.clip, clip), 0.3);
}

TEST(MapDenoiser, NoiseAboutWhatTheGeneratorKnowsGoes) {
  const lstm_gmm::Model walks = walker(0.02);
  Clip clip;
  clip.name = "walk";
  clip.skeleton = walks.reference.skeleton;
  clip.frame_rate_hz = walks.reference.frame_rate_hz;
  features::FeatureMatrix states(60, 69);
  for (Eigen::Index t = 0; t < 60; ++t)
    for (Eigen::Index c = 0; c < 69; ++c) states(t, c) = walks.reference.mean[static_cast<std::size_t>(c)];
  clip = features::decode_state(states, clip.skeleton, clip.frame_rate_hz, {1, {2, 3}});
  Clip noisy = clip;
  Random random(5, 0);
  const auto vector = [&] {
    const double x = random.normal(), y = random.normal(), z = random.normal();
    return Vector3(x, y, z);
  };
  for (auto& q : noisy.rotations) q = q * exp_map(0.02 * vector());
  for (auto& p : noisy.root_position) p += 0.004 * vector();
  const MapDenoised found = denoised(noisy, {0.004, 0.02, 6}, walks);
  const auto mean = [&](const Clip& c) {
    double sum = 0;
    for (std::size_t i = 0; i < c.rotations.size(); ++i) sum += geodesic_distance(c.rotations[i], clip.rotations[i]);
    return sum / static_cast<double>(c.rotations.size());
  };
  EXPECT_LT(mean(found.clip), 0.6 * mean(noisy));
  EXPECT_LT(most_moved(found.clip, clip), most_moved(noisy, clip));
}

TEST(MapDenoiser, WhereTheClipLiesDoesNotMatter) {
  const Clip clip = gentle(50);
  Clip away = clip;
  const Quaternion turned = yaw_rotation(2);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    away.root_position[t] = turned * clip.root_position[t] + Vector3(300, -200, 0);
    auto& q = away.rotations[t * static_cast<std::size_t>(clip.joints())];
    q = turned * q;
  }
  const MapSettings settings = {0.01, 0.02, 8};
  MapDenoised here = denoised(clip, settings), there = denoised(away, settings);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    EXPECT_LT((there.clip.root_position[t] - (turned * here.clip.root_position[t] + Vector3(300, -200, 0))).norm(), 2e-3);
    EXPECT_LT(geodesic_distance(there.clip.frame(t)[0], turned * here.clip.frame(t)[0]), 5e-3);
  }
}

TEST(MapDenoiser, EqualForAnyThreads) {
  const auto clips = gentle_motions(3, 4, 40);
  const auto all = [&](int threads) {
    std::vector<MapDenoised> found(clips.size());
    parallel_for(clips.size(), threads, [&](std::size_t i) {
      nn::initialize_worker_thread();
      found[i] = denoised(clips[i], {});
    });
    return found;
  };
  const auto one = all(1), three = all(3);
  for (std::size_t i = 0; i < clips.size(); ++i) {
    EXPECT_EQ(most_turned(one[i].clip, three[i].clip), 0);
    EXPECT_EQ(most_moved(one[i].clip, three[i].clip), 0);
    EXPECT_EQ(one[i].clip.contacts, three[i].clip.contacts);
  }
}

TEST(MapDenoiser, Refusals) {
  EXPECT_NE(refusal([] { (void)denoised(gentle(1), {}); }).find("clip clip0: 1 frames, expected at least 2"), std::string::npos);
  Clip fast = gentle(10);
  fast.frame_rate_hz = 60;
  EXPECT_NE(refusal([&] { (void)denoised(fast, {}); }).find("60 Hz"), std::string::npos);
  EXPECT_NE(refusal([] { (void)denoised(mocap::testing::sample_clip("dot", 10, 1, mocap::testing::one_joint()), {}); }).find("another skeleton"), std::string::npos);
  Clip broken = gentle(10);
  broken.root_position[3].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal([&] { (void)denoised(broken, {}); }).find("not finite"), std::string::npos);
  Clip moving = gentle(10);
  moving.translations.resize(moving.rotations.size());
  EXPECT_NE(refusal([&] { (void)denoised(moving, {}); }).find("rotations only"), std::string::npos);
  for (const MapSettings& s : {MapSettings{0, 0.1, 4}, MapSettings{0.1, -1, 4}, MapSettings{0.1, 0.1, 0}}) EXPECT_NE(refusal([&] { (void)denoised(gentle(10), s); }).find("expected a number above 0"), std::string::npos);
  PlanOptions o = quick();
  o.overlap = o.window;
  EXPECT_NE(refusal([&] { (void)denoised(gentle(10), {}, generator(), nullptr, o); }).find("an overlap of"), std::string::npos);
}

}  // namespace
}  // namespace mocap::control
