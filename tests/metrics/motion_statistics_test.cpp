#include "libmocap/metrics/motion_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libmocap/base/random.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::metrics {
namespace {

// A figure whose left elbow turns at `rate` rad/s while the whole slides forward at `speed` m/s, both feet labelled down.
Clip turning(double rate, double speed, std::size_t frames, const std::string& action = "a") {
  Clip clip;
  clip.name = "turning";
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 30;
  const auto elbow = static_cast<std::size_t>(canonical_body()->find("left_elbow"));
  for (std::size_t t = 0; t < frames; ++t) {
    const double s = static_cast<double>(t) / 30;
    for (std::size_t j = 0; j < 22; ++j) clip.rotations.push_back(j == elbow ? exp_map(Vector3(0, 0, rate * s)) : Quaternion::Identity());
    clip.root_position.emplace_back(speed * s, 0, canonical_pelvis_height());
    clip.contacts.push_back({1, 1});
  }
  clip.attributes["action"] = action;
  return clip;
}

TEST(MotionStatistics, EnergyIsWeightedJointSpeed) {
  const Clip clip = turning(0.7, 0, 31);
  const auto alpha = impact_factors(*canonical_body());
  const double expected = 0.7 * alpha[static_cast<std::size_t>(canonical_body()->find("left_elbow"))];
  for (const double e : joint_energy(clip)) EXPECT_NEAR(e, expected, 1e-9);
  const auto s = motion_statistics({clip});
  EXPECT_NEAR(s.energy, expected, 1e-9);
  EXPECT_EQ(s.frames, 31u);
  EXPECT_NEAR(s.jerkiness, 0, 1e-6);
  EXPECT_NEAR(s.root_height_low, canonical_pelvis_height(), 1e-12);
}

TEST(MotionStatistics, FeetThatSlideInContactSkate) {
  const auto s = motion_statistics({turning(0, 0.25, 20)});
  EXPECT_NEAR(s.skate_mps, 0.25, 1e-9);
  EXPECT_NEAR(s.root_speed, 0.25, 1e-9);
  EXPECT_EQ(s.contact_share, 1);
  Clip airborne = turning(0, 0.25, 20);
  for (auto& c : airborne.contacts) c = {0, 0};
  EXPECT_EQ(motion_statistics({airborne}).skate_mps, 0);
}

TEST(MotionStatistics, AFigureThatStopsIsFrozen) {
  Clip stops = turning(0.7, 0, 60);
  for (std::size_t t = 35; t < 60; ++t)
    for (std::size_t j = 0; j < 22; ++j) stops.rotations[t * 22 + j] = stops.rotations[34 * 22 + j];
  const Clip goes_on = turning(0.7, 0, 60);
  const double real = motion_statistics({goes_on}).energy;
  EXPECT_EQ(motion_statistics({goes_on, stops}, real).frozen_share, 0.5);
  // Noise is seen: white noise on top multiplies the second differences.
  Clip noisy = goes_on;
  Random random(3, 0);
  for (auto& q : noisy.rotations) q = q * exp_map(0.02 * Vector3(random.normal(), random.normal(), random.normal()));
  EXPECT_GT(motion_statistics({noisy}).jerkiness, 1.2);
}

TEST(NearestTraining, CopiesAreNearAndLabelsKeepApart) {
  std::vector<Clip> training = {turning(0.5, 0.2, 90, "a"), turning(1.5, 0.6, 90, "b")};
  NearestOptions o;
  o.window = 30;
  o.stride = 30;
  o.training_stride = 1;
  o.match = {"action"};
  const auto copies = nearest_training_distances(training, training, o);
  ASSERT_EQ(copies.size(), 6u);
  for (const double d : copies) EXPECT_NEAR(d, 0, 1e-6);
  // The same motion under the other label has to be compared with the other clip.
  const auto apart = nearest_training_distances({turning(0.5, 0.2, 90, "b")}, training, o);
  EXPECT_GT(median(apart), 0.1);
  EXPECT_TRUE(nearest_training_distances({turning(0.5, 0.2, 90, "c")}, training, o).empty());
  EXPECT_TRUE(nearest_training_distances({turning(0.5, 0.2, 20, "a")}, training, o).empty());
  o.threads = 2;
  EXPECT_EQ(nearest_training_distances(training, training, o), copies);
  EXPECT_TRUE(std::isnan(median({})));
  EXPECT_EQ(median({3, 1, 2}), 2);
}

}  // namespace
}  // namespace mocap::metrics
