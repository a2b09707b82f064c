#include "libmocap/clip/resample.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

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
  clip.attribute_probability = {{"action", {{"walking", 0.5f}}}};
  const Clip out = resample(clip, 30);
  EXPECT_EQ(out.attribute_probability, clip.attribute_probability);
  ASSERT_EQ(out.segments.size(), 2u);
  EXPECT_EQ(out.segments[0].length, 30);
  EXPECT_EQ(out.segments[1].start, 30);
  EXPECT_EQ(out.segments[1].attributes.at("action"), "jogging");
  // Whatever the phase, segments that cover the clip cover it still, and a frame is in the segment that its source frame is in.
  clip.segments = {{0, 122, {{"action", "walking"}}}, {122, 119, {{"action", "jogging"}}}};
  for (int phase = 0; phase < 4; ++phase) {
    const Clip shifted = resample(clip, 30, phase);
    ASSERT_EQ(shifted.segments.size(), 2u) << phase;
    EXPECT_EQ(shifted.segments[0].start, 0) << phase;
    EXPECT_EQ(shifted.segments[0].length, phase < 2 ? 31 : 30) << phase;  // frame 30 is source frame 120 + phase
    EXPECT_EQ(shifted.segments[1].start, shifted.segments[0].length) << phase;
    EXPECT_EQ(shifted.segments[1].start + shifted.segments[1].length, static_cast<std::int64_t>(shifted.frames())) << phase;
  }
  EXPECT_EQ(out.contacts[30][0], 0);
  EXPECT_EQ(out.contacts[31][0], 1);
}

// One joint swinging by +-0.4 rad about a skew axis and the root by +-1 m, at `hz`.
Clip swinging(double rate_hz, double hz, double seconds) {
  Clip clip = steady(rate_hz, 0);
  for (std::size_t t = 0; t < static_cast<std::size_t>(seconds * rate_hz) + 1; ++t) {
    const double x = std::sin(2 * std::numbers::pi * hz * static_cast<double>(t) / rate_hz + 0.3);
    clip.rotations.push_back(exp_map(0.4 * x * Vector3(1, 2, 2) / 3));
    clip.root_position.push_back(x * Vector3(0, 1, 0));
  }
  return clip;
}

// Amplitude at the output, away from the ends, as a share of the input's: root and joint. The output is fitted by the
// frequency it appears at, so that any phase counts.
std::pair<double, double> gain(double source_hz, double target_hz, double hz) {
  const Clip out = resample(swinging(source_hz, hz, 10), target_hz, 0, AntiAlias::sinc);
  Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
  Vector2 root = Vector2::Zero(), joint = Vector2::Zero();
  for (std::size_t t = 0; t < out.frames(); ++t) {
    const double x = static_cast<double>(t) / target_hz;
    if (x < 1 || x > 9) continue;
    const Vector2 row(std::sin(2 * std::numbers::pi * hz * x), std::cos(2 * std::numbers::pi * hz * x));
    a += row * row.transpose();
    root += row * out.root_position[t].y();
    joint += row * log_map(out.rotations[t]).dot(Vector3(1, 2, 2) / 3) / 0.4;
  }
  return {a.ldlt().solve(root).norm(), a.ldlt().solve(joint).norm()};
}

TEST(AntiAlias, KeepsWhatIsBelowAndDampsWhatIsAboveTheNewNyquistFrequency) {
  for (const auto& [source, target] : {std::pair{120.0, 30.0}, {120.0, 25.0}, {240.0, 20.0}, {100.0, 60.0}}) {
    const double nyquist = target / 2;
    for (const double f : {0.02, 0.2, 0.4, 0.6, 0.7}) {
      const auto [root, joint] = gain(source, target, f * nyquist);
      EXPECT_NEAR(root, 1, 0.01) << source << " to " << target << " at " << f;
      EXPECT_NEAR(joint, 1, 0.01) << source << " to " << target << " at " << f;
    }
    EXPECT_NEAR(gain(source, target, 0.9 * nyquist).first, 0.5, 0.02) << source << " to " << target;
    for (const double f : {1.11, 1.3, 1.55}) {
      if (f * nyquist >= 0.98 * source / 2) continue;
      const auto [root, joint] = gain(source, target, f * nyquist);
      EXPECT_LT(root, 0.01) << source << " to " << target << " at " << f;
      EXPECT_LT(joint, 0.01) << source << " to " << target << " at " << f;
    }
  }
  // Without, all of it comes through at a frequency that nobody moved with.
  const Clip folded = resample(swinging(120, 28, 10), 30);
  double most = 0;
  for (const auto& p : folded.root_position) most = std::max(most, std::abs(p.y()));
  EXPECT_GT(most, 0.95);
}

TEST(AntiAlias, LeavesSteadyMotionAndRisingRatesAlone) {
  const Clip clip = steady(120, 600);
  const Clip out = resample(clip, 30, 2, AntiAlias::sinc), plain = resample(clip, 30, 2);
  ASSERT_EQ(out.frames(), plain.frames());
  EXPECT_EQ(out.source.phase, 2);
  EXPECT_EQ(out.contacts, plain.contacts);
  for (std::size_t t = 8; t + 8 < out.frames(); ++t) {  // the kernel is one-sided at the ends
    EXPECT_LT(geodesic_distance(out.rotations[t], plain.rotations[t]), 1e-9);
    EXPECT_LT((out.root_position[t] - plain.root_position[t]).norm(), 1e-9);
  }
  for (const double rate : {120.0, 200.0}) {
    const Clip same = resample(clip, rate, 0, AntiAlias::sinc), as_none = resample(clip, rate);
    EXPECT_EQ(same.root_position, as_none.root_position);
  }
  EXPECT_EQ(resample(steady(120, 1), 30, 0, AntiAlias::sinc).frames(), 1u);
}

TEST(AntiAlias, AgreesWithSciPy) {
  std::ifstream in(std::string(TEST_DATA) + "/clip/anti_alias.tsv");
  const auto number = [&] {
    double v = std::nan("");
    in >> v;
    return v;
  };
  const auto vector = [&] {
    const double x = number(), y = number();
    return Vector3(x, y, number());
  };
  const auto quaternion = [&] {
    const double w = number(), x = number(), y = number();
    return Quaternion(w, x, y, number());
  };
  Clip clip = steady(number(), 0);
  for (auto n = static_cast<std::size_t>(number()); n > 0; --n) {
    clip.root_position.push_back(vector());
    clip.rotations.push_back(quaternion());
  }
  make_sign_continuous(clip);
  for (int k = 0; k < 4; ++k) {
    const int phase = static_cast<int>(number());
    const double rate = number();
    const auto count = static_cast<std::size_t>(number());
    ASSERT_TRUE(in.good());
    const Clip out = resample(clip, rate, phase, AntiAlias::sinc);
    ASSERT_EQ(out.frames(), count);
    for (std::size_t t = 0; t < count; ++t) {
      EXPECT_LT((out.root_position[t] - vector()).norm(), 1e-9) << rate << " Hz, frame " << t;
      EXPECT_LT(geodesic_distance(out.rotations[t], quaternion()), 1e-8) << rate << " Hz, frame " << t;
    }
  }
}

TEST(Resample, RefusesRatesThatAreNone) {
  const Clip clip = steady(30, 5);
  for (const double rate : {0.0, -30.0, std::nan(""), std::numeric_limits<double>::infinity()}) EXPECT_THROW(resample(clip, rate), Error);
  EXPECT_THROW(resample(clip, 30, -1), Error);
  EXPECT_EQ(resample(clip, 30, 7).frames(), 0u);
}

}  // namespace
}  // namespace mocap
