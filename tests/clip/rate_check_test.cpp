#include "libmocap/clip/rate_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

constexpr double kPi = std::numbers::pi, kLeg = 0.8347;  // canonical hip to ankle

// The canonical body in its rest pose, its root at `place(t)` above where it stands, its hips turned fore and aft by +-swing(t).
Clip moving(double rate_hz, double seconds, const std::function<Vector3(double)>& place, const std::function<double(double)>& swing = {}) {
  const auto body = canonical_body();
  Clip clip;
  clip.skeleton = body;
  clip.frame_rate_hz = rate_hz;
  clip.source.frame_rate_hz = 4 * rate_hz;
  for (std::size_t i = 0; i < static_cast<std::size_t>(seconds * rate_hz) + 1; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    clip.root_position.push_back(place(t) + Vector3(0, 0, canonical_pelvis_height()));
    std::vector<Quaternion> pose(22, Quaternion::Identity());
    if (swing)
      for (const int side : {1, -1}) pose[static_cast<std::size_t>(body->find(side > 0 ? "left_hip" : "right_hip"))] = exp_map(Vector3(0, -side * swing(t), 0));
    clip.rotations.insert(clip.rotations.end(), pose.begin(), pose.end());
  }
  return clip;
}

// Leaps of 0.5 s a second apart, recorded at `k` times the rate that the clip has.
Clip leaping(double k, double seconds = 4) {
  return moving(30, seconds * k, [=](double t) {
    const double x = std::fmod(t / k, 1.0) - 0.25;
    return Vector3(0, 0, x > 0 && x < 0.5 ? 9.81 / 2 * x * (0.5 - x) : 0);
  });
}

// Steps of `metres`, `hz` a second, on straight legs: the root sinks so that the feet keep to the ground.
Clip stepping(double hz, double metres, double seconds = 12) {
  const double angle = std::asin(std::min(1.0, metres / 2 / kLeg));
  const auto swing = [=](double t) { return angle * std::sin(kPi * hz * t); };
  return moving(30, seconds, [=](double t) { return Vector3(metres * hz * t, 0, kLeg * (std::cos(swing(t)) - 1)); }, swing);
}

// Standing with bent knees, the root `down(t)` below its height, the feet in their place, all of it `up(t)` above the ground.
Clip squatting(double seconds, const std::function<double(double)>& down, const std::function<double(double)>& up) {
  const auto body = canonical_body();
  Clip clip = moving(30, seconds, [&](double t) { return Vector3(0, 0, up(t) - down(t)); });
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    const double bend = std::acos(1 - down(static_cast<double>(t) / 30) / kLeg);  // thigh and shin are nearly of one length
    for (const std::string side : {"left_", "right_"}) {
      clip.frame(t)[static_cast<std::size_t>(body->find(side + "hip"))] = exp_map(Vector3(0, -bend, 0));
      clip.frame(t)[static_cast<std::size_t>(body->find(side + "knee"))] = exp_map(Vector3(0, 2 * bend, 0));
      clip.frame(t)[static_cast<std::size_t>(body->find(side + "ankle"))] = exp_map(Vector3(0, -bend, 0));
    }
  }
  return clip;
}

std::string doubt(const Clip& clip) { return check_rate(clip).value_or(""); }

TEST(RateCheck, FallsShowGravity) {
  for (const double k : {1.0, 2.0, 4.0, 0.7}) {
    const RateEvidence e = rate_evidence(leaping(k));
    ASSERT_GE(e.flights.size(), 3u) << k;
    for (const auto& f : e.flights) EXPECT_NEAR(f.gravity_mps2 * k * k, 9.81, 0.05) << k;
  }
  EXPECT_EQ(doubt(leaping(1)), "");
  EXPECT_EQ(doubt(leaping(2)), "it falls at 2.5 m/s^2, expected 9.81: as if recorded at about 240 Hz");
  EXPECT_EQ(doubt(leaping(4)), "it falls at 0.61 m/s^2, expected 9.81: as if recorded at about 480 Hz");
  EXPECT_EQ(doubt(leaping(0.6)), "it falls at 27 m/s^2, expected 9.81: as if recorded at about 72 Hz");
}

TEST(RateCheck, FeetThatStandAreNoFlight) {
  // 0.6 s on a block, during which the body rises and sinks as in a slow fall.
  const auto on_block = [](double t) { return t > 2 && t < 2.6 ? 0.08 : 0.0; };
  const auto arc = [](double t) { return t > 2 && t < 2.6 ? 0.15 - 1.2 * (t - 2) * (2.6 - t) : 0.15; };
  EXPECT_TRUE(rate_evidence(squatting(5, arc, on_block)).flights.empty());
  // The same way of the body counts where the feet go along.
  const auto flight = rate_evidence(squatting(5, [](double) { return 0.15; }, [&](double t) { return on_block(t) + 0.15 - arc(t); })).flights;
  ASSERT_EQ(flight.size(), 1u);
  EXPECT_NEAR(flight[0].gravity_mps2, 2.4, 0.01);
}

TEST(RateCheck, NothingIsPulledDown) {
  const auto bobbing = [](double metres, double hz) {
    return squatting(3, [=](double t) { return 0.25 + metres / 2 * std::cos(2 * kPi * hz * t); }, [](double) { return 0.0; });
  };
  EXPECT_EQ(doubt(bobbing(0.1, 2)), "");
  EXPECT_EQ(doubt(bobbing(0.2, 4)).substr(0, 23), "the body goes down at 5");
  // Of a body that moves as one, the acceleration as second differences give it.
  const Clip rigid = moving(30, 3, [](double t) { return Vector3(0, 0, 0.01 * (1 - std::cos(6 * kPi * t))); });
  EXPECT_NEAR(rate_evidence(rigid).drop_mps2, 0.01 * (2 - 2 * std::cos(6 * kPi / 30)) * 900, 1e-6);
}

TEST(RateCheck, StepsAreCountedAndMeasured) {
  const RateEvidence e = rate_evidence(stepping(1.9, 0.7));
  EXPECT_GE(e.steps, 10u);
  EXPECT_NEAR(e.cadence_hz, 1.9, 0.02);
  EXPECT_NEAR(e.step_m, 0.7, 0.05);
  EXPECT_EQ(doubt(stepping(1.9, 0.7)), "");
  EXPECT_EQ(doubt(stepping(2.6, 0.6)), "");
  EXPECT_EQ(doubt(stepping(0.475, 0.7)), "steps at 0.48 a second, expected 0.7 to 4.7");
  EXPECT_EQ(doubt(stepping(5.6, 0.5)), "steps at 5.6 a second, expected 0.7 to 4.7");
  EXPECT_EQ(doubt(stepping(0.95, 1.2)).substr(0, 34), "steps of 1.2 m at 0.95 a second, e");
  EXPECT_EQ(doubt(stepping(3.8, 0.5)), "a walk of 3.8 steps a second, expected at most 3.3");
  // On the spot, and a step or two, there is nothing to count.
  EXPECT_EQ(rate_evidence(moving(30, 8, [](double) { return Vector3(0, 0, 0); }, [](double t) { return 0.4 * std::sin(kPi * 0.5 * t); })).steps, 0u);
  EXPECT_EQ(doubt(stepping(0.475, 0.7, 5)), "");
}

TEST(RateCheck, AWalkTradesHeightForSpeed) {
  // x' = sqrt(v^2 + 2 b g (h - z)): kinetic energy falls by b where potential energy rises by 1.
  const auto walking = [](double b) {
    double x = 0, last = 0;
    return moving(
        30, 10,
        [=](double t) mutable {
          const auto z = [](double u) { return 0.02 * std::cos(2 * kPi * 1.9 * u); };
          for (; last < t - 1e-9; last += 1e-4) x += 1e-4 * std::sqrt(1.7 - 2 * b * 9.81 * z(last));
          return Vector3(x, 0, z(t) - 0.02);
        },
        [](double t) { return 0.4 * std::sin(kPi * 1.9 * t); });
  };
  for (const double b : {0.15, 0.7}) {
    // The legs swing up while the body sinks, so that the whole rises by 1/1.28 of it. Half as fast, a quarter of the energy.
    Clip clip = walking(b);
    const RateEvidence e = rate_evidence(clip);
    EXPECT_NEAR(e.exchange, -1.28 * b, 0.02);
    EXPECT_LT(e.correlation, -0.9);
    clip.frame_rate_hz = 15;
    EXPECT_NEAR(rate_evidence(clip).exchange, e.exchange / 4, 0.01);
  }
  EXPECT_EQ(doubt(walking(0.7)), "");
  EXPECT_EQ(doubt(walking(0.15)).substr(0, 30), "a walk whose speed changes by ");
}

TEST(RateCheck, OthersGiveNoEvidence) {
  EXPECT_EQ(doubt(moving(30, 5, [](double) { return Vector3(0, 0, 0); })), "");
  EXPECT_EQ(doubt(moving(30, 0.2, [](double) { return Vector3(0, 0, 0); })), "");
  Clip clip = leaping(4);
  auto bare = std::make_shared<Skeleton>(*clip.skeleton);
  bare->roles.clear();
  clip.skeleton = bare;
  EXPECT_EQ(doubt(clip), "");
}

}  // namespace
}  // namespace mocap
