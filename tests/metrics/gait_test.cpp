#include "libmocap/metrics/gait.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/math/rotation.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::metrics {
namespace {

// A stiff figure on a circle of radius r about the origin, `rate` rad/s to the left, which labels its feet down in turn for 10 frames each.
Clip circling(double r, double rate, std::size_t frames) {
  Clip clip;
  clip.name = "circling";
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 30;
  for (std::size_t t = 0; t < frames; ++t) {
    const double a = rate * static_cast<double>(t) / 30;
    for (std::size_t j = 0; j < 22; ++j) clip.rotations.push_back(j == 0 ? exp_map(Vector3(0, 0, a + std::numbers::pi / 2)) : Quaternion::Identity());
    clip.root_position.emplace_back(r * std::cos(a), r * std::sin(a), canonical_pelvis_height());
    const bool left = t / 10 % 2 == 0;
    clip.contacts.push_back({static_cast<std::uint8_t>(left), static_cast<std::uint8_t>(!left)});
  }
  return clip;
}

TEST(Gait, SpeedTurningAndStepsOfACircle) {
  const double rate = 1.3;
  const Clip clip = circling(2, rate, 301);  // more than two turns: headings wrap
  const Gait g = gait(clip);
  EXPECT_NEAR(g.speed_mps, 2 * 2 * std::sin(rate / 60) * 30, 1e-9);
  EXPECT_NEAR(g.turning_dps, rate * 180 / std::numbers::pi, 1e-9);
  EXPECT_NEAR(gait(circling(2, -rate, 301)).turning_dps, -rate * 180 / std::numbers::pi, 1e-9);
  // The feet ride along: by forward kinematics at frames 10 and 20.
  Pose pose;
  world_pose(clip, 10, pose);
  const Vector3 right = pose.positions[static_cast<std::size_t>(clip.skeleton->find_role("right_foot"))];
  world_pose(clip, 20, pose);
  const Vector3 left = pose.positions[static_cast<std::size_t>(clip.skeleton->find_role("left_foot"))];
  Clip one = cut(clip, 0, 25);
  EXPECT_NEAR(gait(one).step_length_m, (left - right).head<2>().norm(), 1e-9);
}

TEST(Gait, WhatIsNotThereIsNotANumber) {
  Clip clip = circling(1, 1, 60);
  clip.contacts.clear();
  EXPECT_TRUE(std::isnan(gait(clip).step_length_m));
  EXPECT_FALSE(std::isnan(gait(clip).speed_mps));
  EXPECT_TRUE(std::isnan(gait(cut(circling(1, 1, 60), 0, 15)).step_length_m));  // one step alone
  EXPECT_TRUE(std::isnan(gait(cut(clip, 0, 1)).speed_mps) && std::isnan(gait(cut(clip, 0, 1)).turning_dps));
}

TEST(Stretches, CoverAClipInOrder) {
  const Clip clip = circling(1, 1, 70);
  const auto parts = stretches(clip, 30);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[1].frames(), 30u);
  EXPECT_EQ(parts[1].root_position[0], clip.root_position[30]);
  ASSERT_EQ(stretches(clip, 71).size(), 1u);
  EXPECT_EQ(stretches(clip, 71)[0].frames(), 70u);
  EXPECT_THROW(stretches(clip, 0), Error);
}

}  // namespace
}  // namespace mocap::metrics
