#include "libmodels/control/steering.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/math/rotation.hpp"
#include "tests/store/sample_clips.hpp"

namespace mocap::control {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// A figure that goes at `speed` along `heading` from frame to frame, standing upright.
Clip going(const std::vector<std::pair<double, double>>& steps) {
  Clip clip = mocap::testing::sample_clip("going", steps.size(), 1);
  const double rate = clip.frame_rate_hz;
  const auto joints = static_cast<std::size_t>(clip.skeleton->joint_count());
  Vector3 place(0, 0, 0.9);
  for (std::size_t t = 0; t < steps.size(); ++t) {
    clip.rotations[t * joints] = Quaternion(std::cos(steps[t].second / 2), 0, 0, std::sin(steps[t].second / 2));
    clip.root_position[t] = place;
    place += steps[t].first / rate * Vector3(std::cos(steps[t].second), std::sin(steps[t].second), 0);
  }
  return clip;
}

TEST(Obeyed, SaysWhenACommandIsSettledAndWhenItNeverIs) {
  std::vector<std::pair<double, double>> steps;
  for (int t = 0; t < 90; ++t) steps.emplace_back(1.2, 0.0);
  for (int t = 0; t < 30; ++t) steps.emplace_back(1.2, (3 * t) * kDegree);   // a second of turning by 90 degrees
  for (int t = 0; t < 60; ++t) steps.emplace_back(1.2, 90 * kDegree);
  for (int t = 0; t < 90; ++t) steps.emplace_back(1.2, 90 * kDegree);        // never any faster
  const Clip clip = going(steps);
  ASSERT_EQ(clip.frame_rate_hz, 30);
  const auto all = obeyed(clip, {{0, 1.2, 0}, {3, 1.2, 90 * kDegree}, {6, 2.5, 90 * kDegree}});
  ASSERT_EQ(all.size(), 3u);
  ASSERT_TRUE(all[0].settled_s);
  EXPECT_EQ(*all[0].settled_s, 0);
  ASSERT_TRUE(all[1].settled_s);
  EXPECT_NEAR(*all[1].settled_s, 1 - 0.2 / (90 * kDegree), 0.1);  // within 0.2 rad of the end of the turn
  EXPECT_FALSE(all[2].settled_s);
  EXPECT_NEAR(all[2].speed, 1.2, 1e-6);
  EXPECT_NEAR(all[2].heading, 90 * kDegree, 1e-6);
}

TEST(Obeyed, ToleratesGaitsSwayAcrossTheHalfTurn) {
  std::vector<std::pair<double, double>> steps;
  for (int t = 0; t < 120; ++t) steps.emplace_back(1.2 + 0.3 * std::sin(t * 2 * std::numbers::pi / 15), std::numbers::pi + 0.15 * std::sin(t * 2 * std::numbers::pi / 15));
  const auto all = obeyed(going(steps), {{0, 1.2, -std::numbers::pi}});
  ASSERT_TRUE(all[0].settled_s);
  EXPECT_LT(*all[0].settled_s, 0.3);
}

TEST(Obeyed, CommandsBeyondTheEndAreNotSettled) {
  const auto all = obeyed(going(std::vector<std::pair<double, double>>(30, {1.2, 0.0})), {{0, 1.2, 0}, {5, 1.2, 0}});
  EXPECT_TRUE(all[0].settled_s);
  EXPECT_FALSE(all[1].settled_s);
}

}  // namespace
}  // namespace mocap::control
