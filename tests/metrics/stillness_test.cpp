#include "libmocap/metrics/stillness.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::metrics {
namespace {

// The left shoulder turns, for so many steps at so many rad m/s.
Clip at_speeds(const std::vector<std::pair<std::size_t, double>>& phases, double rate_hz = 30) {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = rate_hz;
  const auto shoulder = static_cast<std::size_t>(clip.skeleton->find("left_shoulder"));
  const double alpha = impact_factors(*clip.skeleton)[shoulder];
  double angle = 0;
  const auto add = [&] {
    for (std::size_t j = 0; j < 22; ++j) clip.rotations.push_back(j == shoulder ? exp_map(Vector3(0, 0, angle)) : Quaternion::Identity());
    clip.root_position.emplace_back(0, 0, 0.9);
  };
  add();
  for (const auto& [steps, speed] : phases)
    for (std::size_t t = 0; t < steps; ++t) {
      angle += speed / alpha / rate_hz;
      add();
    }
  return clip;
}

TEST(Stillness, EndsWithAShortTailOnceMotionIsOver) {
  EXPECT_EQ(frames_until_still(at_speeds({{60, 4}, {90, 0.5}})), 60u + 1 + 8);
  EXPECT_EQ(frames_until_still(at_speeds({{120, 4}, {180, 0.5}}, 60)), 120u + 1 + 15);
  // Exactly 1.5 s are enough, a step less is not.
  EXPECT_EQ(frames_until_still(at_speeds({{60, 4}, {45, 0.5}})), 69u);
  EXPECT_EQ(frames_until_still(at_speeds({{60, 4}, {44, 0.5}})), 105u);
}

TEST(Stillness, PausesAndTheBeginningDoNotCount) {
  EXPECT_EQ(frames_until_still(at_speeds({{70, 0.5}, {30, 4}, {40, 0.5}, {30, 4}, {90, 0.5}})), 170u + 1 + 8);
  EXPECT_EQ(frames_until_still(at_speeds({{30, 4}, {44, 0.5}, {1, 1.1}, {44, 0.5}})), 120u) << "one step of motion begins the count anew";
  EXPECT_EQ(frames_until_still(at_speeds({{90, 1.5}, {90, 0.5}})), 181u) << "nothing was ever twice the threshold";
}

TEST(Stillness, WhatNeverMovesOrNeverRestsIsKept) {
  EXPECT_EQ(frames_until_still(at_speeds({{120, 0}})), 121u);
  EXPECT_EQ(frames_until_still(at_speeds({{120, 4}})), 121u);
  EXPECT_EQ(frames_until_still(at_speeds({})), 1u);
}

TEST(Stillness, ThresholdsAreOptions) {
  const Clip clip = at_speeds({{15, 4}, {30, 0.5}, {60, 0.05}});
  EXPECT_EQ(frames_until_still(clip, {0.1, 1, 0, 0}), 46u);
  EXPECT_EQ(frames_until_still(clip, {1, 1, 0, 0}), 16u);
  EXPECT_EQ(frames_until_still(clip, {1, 1, 0, 2}), 60u) << "the least length";
  EXPECT_EQ(frames_until_still(clip, {1, 1, 0, 60}), 106u) << "never more than there is";
}

}  // namespace
}  // namespace mocap::metrics
