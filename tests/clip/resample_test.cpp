#include "libmocap/clip/resample.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

// One joint turning at a constant 1.3 rad/s about a skew axis, the root moving at (1, -2, 0.5) m/s.
Clip steady(double rate_hz, std::size_t frames) {
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"root"};
  s->parents = {-1};
  s->rest_offsets = {Vector3::Zero()};
  Clip clip;
  clip.name = "steady";
  clip.skeleton = s;
  clip.frame_rate_hz = rate_hz;
  for (std::size_t t = 0; t < frames; ++t) {
    const double x = static_cast<double>(t) / rate_hz;
    clip.rotations.push_back(exp_map(1.3 * x * Vector3(1, 2, 2) / 3));
    clip.root_position.push_back(x * Vector3(1, -2, 0.5));
    clip.contacts.push_back({static_cast<std::uint8_t>(x > 1), 0});
  }
  make_sign_continuous(clip);
  return clip;
}

TEST(Resample, SteadyMotionIsExactAtAnyRate) {
  for (const double target : {24.0, 29.97002997002997, 30.0, 60.0, 100.0, 250.0}) {
    const Clip out = resample(steady(59.9999885559082, 200), target);
    EXPECT_EQ(out.frame_rate_hz, target);
    for (std::size_t t = 0; t < out.frames(); ++t) {
      const double x = static_cast<double>(t) / target;
      EXPECT_LT(geodesic_distance(out.rotations[t], exp_map(1.3 * x * Vector3(1, 2, 2) / 3)), 1e-8) << target;
      EXPECT_LT((out.root_position[t] - x * Vector3(1, -2, 0.5)).norm(), 1e-8) << target;
    }
    // The last sample lies within one step of the end of the source, and not behind it.
    const double end = static_cast<double>(out.frames() - 1) / target;
    EXPECT_LE(end, 199 / 59.9999885559082 + 1e-6);
    EXPECT_GT(end, 199 / 59.9999885559082 - 1 / target);
  }
}

TEST(Resample, WholeRatiosPickFramesUnchanged) {
  const Clip clip = steady(120, 41);
  ASSERT_EQ(phase_count(120, 30), 4);
  for (int phase = 0; phase < 4; ++phase) {
    const Clip out = resample(clip, 30, phase);
    EXPECT_EQ(out.frames(), phase == 0 ? 11u : 10u);
    EXPECT_EQ(out.source.phase, phase);
    for (std::size_t t = 0; t < out.frames(); ++t) {
      EXPECT_EQ(out.root_position[t], clip.root_position[t * 4 + static_cast<std::size_t>(phase)]);
      EXPECT_EQ(out.rotations[t].coeffs(), clip.rotations[t * 4 + static_cast<std::size_t>(phase)].coeffs());
    }
  }
  EXPECT_EQ(phase_count(250, 30), 1);
  EXPECT_EQ(phase_count(24, 30), 1);
}

TEST(Resample, SegmentsAndContactsMoveAlong) {
  Clip clip = steady(120, 241);
  clip.segments = {{0, 120, {{"action", "walking"}}}, {120, 121, {{"action", "jogging"}}}};
  const Clip out = resample(clip, 30);
  ASSERT_EQ(out.segments.size(), 2u);
  EXPECT_EQ(out.segments[0].length, 30);
  EXPECT_EQ(out.segments[1].start, 30);
  EXPECT_EQ(out.segments[1].attributes.at("action"), "jogging");
  EXPECT_EQ(out.contacts[30][0], 0);
  EXPECT_EQ(out.contacts[31][0], 1);
}

TEST(Resample, RefusesRatesThatAreNone) {
  const Clip clip = steady(30, 5);
  for (const double rate : {0.0, -30.0, std::nan(""), std::numeric_limits<double>::infinity()}) EXPECT_THROW(resample(clip, rate), Error);
  EXPECT_THROW(resample(clip, 30, -1), Error);
  EXPECT_EQ(resample(clip, 30, 7).frames(), 0u);
}

}  // namespace
}  // namespace mocap
