// The motions look human and keep their feet: measured on the finished clips by forward kinematics.
#include "motion.hpp"

#include <gtest/gtest.h>

namespace mocap::corpus {
namespace {

constexpr double kDegree = 3.14159265358979 / 180;

CorpusPlan plan_of(int subjects) {
  CorpusPlan plan;
  plan.subjects = subjects;
  return plan;
}

std::vector<ClipId> ids_of(Action action, int subjects) {
  std::vector<ClipId> ids;
  for (const Gender gender : {Gender::female, Gender::male})
    for (int subject = 1; subject <= subjects; ++subject) ids.push_back({action, gender, subject, 1});
  return ids;
}

class EveryAction : public testing::TestWithParam<Action> {};

INSTANTIATE_TEST_SUITE_P(Corpus, EveryAction,
                         testing::Values(Action::walking, Action::jogging, Action::jumping, Action::lifting,
                                         Action::transition),
                         [](const auto& tested) { return text(tested.param); });

TEST_P(EveryAction, KeepsTheInvariantsOfAClip) {
  for (const ClipId& id : ids_of(GetParam(), 4)) {
    const Clip clip = make_clip(plan_of(4), id);
    EXPECT_NO_THROW(clip.validate(id.stem()));
    EXPECT_EQ(clip.frames(), 960u);
    EXPECT_EQ(clip.contacts.size(), clip.frames());
    EXPECT_EQ(clip.name, id.stem());
  }
}

TEST_P(EveryAction, StanceFeetStandStillAndNothingPenetratesTheGround) {
  double still = 0, frames_planted = 0;
  for (const ClipId& id : ids_of(GetParam(), 20)) {
    const Clip clip = make_clip(plan_of(20), id);
    const Track track(clip);
    for (int side = 0; side < 2; ++side) {
      double travelled = 0, planted = 0, lowest = 1;
      for (std::size_t t = 0; t < track.size(); ++t) {
        lowest = std::min(lowest, track.sole(t, side));
        if (t == 0 || !track.planted(t, side) || !track.planted(t - 1, side)) continue;
        travelled += (track.at(t, kLeftFoot + side) - track.at(t - 1, kLeftFoot + side)).head<2>().norm();
        planted += 1 / clip.frame_rate_hz;
        EXPECT_LT(track.at(t, kLeftFoot + side).z(), kFootSoleHeight * track.scale() + 0.005)
            << id.stem() << " frame " << t;
      }
      EXPECT_LE(travelled / planted, 0.01) << id.stem() << " side " << side;
      EXPECT_GE(lowest, -0.005) << id.stem() << " side " << side;
      EXPECT_LT(lowest, 0.005) << id.stem() << ": never on the ground";
      still += travelled;
      frames_planted += planted;
    }
  }
  EXPECT_LT(still / frames_planted, 0.001);
  RecordProperty("stance_mm_per_s", std::to_string(1000 * still / frames_planted));
}

TEST_P(EveryAction, JointsBendTheHumanWayAndMoveSmoothly) {
  for (const ClipId& id : ids_of(GetParam(), 20)) {
    const Clip clip = make_clip(plan_of(20), id);
    const Track track(clip);
    double fastest = 0;
    for (std::size_t t = 0; t < track.size(); ++t) {
      for (int side = 0; side < 2; ++side) {
        const Vector3 knee = log_map(track.local(t, kLeftKnee + side));
        ASSERT_GT(knee.y(), 5 * kDegree) << id.stem() << " frame " << t;
        ASSERT_LT(knee.y(), 150 * kDegree) << id.stem() << " frame " << t;
        ASSERT_LT(std::hypot(knee.x(), knee.z()), 1e-9) << "a knee is a hinge";
        // The shank swings behind the line of the thigh, the forearm in front of the upper arm.
        const Quaternion& thigh = track.poses[t].rotations[static_cast<std::size_t>(kLeftHip + side)];
        const Vector3 shank = thigh.conjugate() * (track.at(t, kLeftAnkle + side) - track.at(t, kLeftKnee + side));
        ASSERT_LT(shank.x(), 0) << id.stem();
        ASSERT_GT(track.elbow(t, side), 3 * kDegree) << id.stem() << " frame " << t;
        ASSERT_LT(track.elbow(t, side), 150 * kDegree) << id.stem() << " frame " << t;
      }
      ASSERT_LT(std::abs(track.lean(t)), 85 * kDegree) << id.stem();
      ASSERT_GT(track.at(t, kHead).z(), track.at(t, kPelvis).z()) << id.stem() << ": upside down";
      if (t > 0)
        for (int j = 0; j < kJoints; ++j)
          fastest = std::max(fastest, geodesic_distance(track.local(t, j), track.local(t - 1, j)));
    }
    EXPECT_LT(fastest, 20 * kDegree) << id.stem() << ": degrees between frames " << fastest / kDegree;
  }
}

// Maximal runs of frames without contact of a foot, whole ones only.
std::vector<std::pair<std::size_t, std::size_t>> swings(const Track& track, int side) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  std::size_t start = 0;
  for (std::size_t t = 1; t < track.size(); ++t) {
    if (!track.planted(t, side) && track.planted(t - 1, side)) start = t;
    if (track.planted(t, side) && !track.planted(t - 1, side) && start > 0) runs.emplace_back(start, t);
  }
  return runs;
}

struct GaitFigures {
  double double_support = 0, flight = 0, lean = 0, knee_peak = 0, strike_pitch = 0, off_pitch = 0, speed = 0,
         cadence = 0, bob = 0;
};

GaitFigures figures(const Track& track) {
  GaitFigures f;
  double strikes = 0;
  for (std::size_t t = 0; t < track.size(); ++t) {
    f.double_support += track.sole(t, 0) < 0.005 && track.sole(t, 1) < 0.005;
    f.flight += track.sole(t, 0) > 0.01 && track.sole(t, 1) > 0.01;
    f.lean += track.lean(t) / static_cast<double>(track.size());
  }
  for (int side = 0; side < 2; ++side) {
    const auto runs = swings(track, side);
    for (const auto& [a, b] : runs) {
      double peak = 0, strike = -1, off = 1;
      for (std::size_t t = a; t < b; ++t) {
        peak = std::max(peak, track.knee(t, side));
        strike = std::max(strike, track.foot_pitch(t, side));
        off = std::min(off, track.foot_pitch(t, side));
      }
      f.knee_peak += peak, f.strike_pitch += strike, f.off_pitch += off, strikes += 1;
    }
    f.cadence += runs.size() < 2 ? 0
                                 : 0.5 * static_cast<double>(runs.size() - 1) /
                                       (static_cast<double>(runs.back().first - runs.front().first) / 120.0);
  }
  f.knee_peak /= strikes, f.strike_pitch /= strikes, f.off_pitch /= strikes;
  const double seconds = static_cast<double>(track.size()) / 120;
  f.double_support /= 120 * seconds, f.flight /= 120 * seconds;
  for (std::size_t t = 12; t < track.size(); t += 12)
    f.speed += (track.at(t, kPelvis) - track.at(t - 12, kPelvis)).head<2>().norm() / seconds;
  std::vector<double> z;
  for (std::size_t t = 0; t < track.size(); ++t) z.push_back(track.at(t, kPelvis).z());
  f.bob = *std::max_element(z.begin(), z.end()) - *std::min_element(z.begin(), z.end());
  return f;
}

TEST(Walking, HasTheMarksOfWalking) {
  for (const ClipId& id : ids_of(Action::walking, 20)) {
    const Clip clip = make_clip(plan_of(20), id);
    const Track track(clip);
    const GaitFigures f = figures(track);
    EXPECT_EQ(f.flight, 0) << id.stem();
    EXPECT_GT(f.double_support, 0.08) << id.stem();
    EXPECT_GT(f.speed, 0.8) << id.stem();
    EXPECT_LT(f.speed, 1.8) << id.stem();
    EXPECT_GT(f.cadence, 0.75) << id.stem();
    EXPECT_LT(f.cadence, 1.2) << id.stem();
    EXPECT_GT(f.knee_peak, 45 * kDegree) << id.stem();
    EXPECT_LT(f.knee_peak, 80 * kDegree) << id.stem();
    EXPECT_GT(f.strike_pitch, 10 * kDegree) << id.stem() << ": no heel strike";
    EXPECT_LT(f.off_pitch, -40 * kDegree) << id.stem() << ": no toe off";
    EXPECT_GT(f.bob, 0.015) << id.stem();
    EXPECT_LT(f.bob, 0.11) << id.stem();
    EXPECT_LT(std::abs(f.lean), 10 * kDegree) << id.stem();
  }
}

TEST(Jogging, FliesAndBendsMoreThanWalking) {
  double lean_more = 0;
  for (const ClipId& id : ids_of(Action::jogging, 20)) {
    const Clip clip = make_clip(plan_of(20), id);
    const Track track(clip);
    ClipId walking = id;
    walking.action = Action::walking;
    const Clip walk = make_clip(plan_of(20), walking);
    const GaitFigures f = figures(track), w = figures(Track(walk));
    EXPECT_GT(f.flight, 0.06) << id.stem();
    EXPECT_EQ(f.double_support, 0) << id.stem();
    EXPECT_GT(f.speed, 1.9) << id.stem();
    EXPECT_LT(f.speed, 3.6) << id.stem();
    EXPECT_GT(f.cadence, w.cadence) << id.stem();
    EXPECT_GT(f.knee_peak, w.knee_peak + 20 * kDegree) << id.stem();
    EXPECT_GT(f.lean, w.lean) << id.stem();
    lean_more += (f.lean - w.lean) / 40;
  }
  EXPECT_GT(lean_more, 4 * kDegree);
}

TEST(Gait, ArmsSwingAgainstTheLegsAndThePelvisBobsTwiceAStride) {
  for (const Action action : {Action::walking, Action::jogging})
    for (const ClipId& id : ids_of(action, 12)) {
      const Clip clip = make_clip(plan_of(12), id);
      const Track track(clip);
      std::vector<double> legs, arms, height;
      for (std::size_t t = 0; t < track.size(); ++t) {
        const Vector3 f = track.forward(t);
        legs.push_back((track.at(t, kLeftAnkle) - track.at(t, kRightAnkle)).dot(f));
        arms.push_back((track.at(t, kLeftWrist) - track.at(t, kRightWrist)).dot(f));
        height.push_back(track.at(t, kPelvis).z());
      }
      EXPECT_LT(correlation(legs, arms), -0.7) << id.stem();
      // Local maxima of the smooth height per stride.
      double peaks = 0;
      for (std::size_t t = 12; t + 12 < height.size(); ++t)
        peaks += *std::max_element(height.begin() + static_cast<std::ptrdiff_t>(t) - 12,
                                   height.begin() + static_cast<std::ptrdiff_t>(t) + 13) == height[t];
      EXPECT_NEAR(peaks / 8 / figures(track).cadence, 2.0, 0.3) << id.stem();
    }
}

TEST(Gait, SwingingFeetClearTheGround) {
  for (const Action action : {Action::walking, Action::jogging, Action::transition})
    for (const ClipId& id : ids_of(action, 12)) {
      const Clip clip = make_clip(plan_of(12), id);
      const Track track(clip);
      for (int side = 0; side < 2; ++side)
        for (const auto& [a, b] : swings(track, side)) {
          const auto from = a + (b - a) / 4, to = a + (b - a) * 6 / 10;
          for (std::size_t t = from; t < to; ++t) ASSERT_GT(track.sole(t, side), 0.005) << id.stem() << " frame " << t;
        }
    }
}

TEST(Gait, PathsStartAnywhereAndCurveGently) {
  std::vector<double> headings, turns;
  for (const ClipId& id : ids_of(Action::walking, 20)) {
    const Clip clip = make_clip(plan_of(20), id);
    const Track track(clip);
    headings.push_back(track.heading(0));
    double turned = 0;
    for (std::size_t t = 1; t < track.size(); ++t) turned += wrap_angle(track.heading(t) - track.heading(t - 1));
    turns.push_back(turned);
    EXPECT_LT(std::abs(turned), 150 * kDegree) << id.stem();
  }
  EXPECT_GT(deviation(headings), 1.2);
  EXPECT_GT(deviation(turns), 15 * kDegree);
}

TEST(Jumping, FallsFreelyInFlight) {
  for (const ClipId& id : ids_of(Action::jumping, 12)) {
    const Clip clip = make_clip(plan_of(12), id);
    const Track track(clip);
    std::size_t flying = 0, jumps = 0;
    for (std::size_t t = 2; t + 2 < track.size(); ++t) {
      const bool up = track.sole(t, 0) > 0.05 && track.sole(t, 1) > 0.05;
      if (!up) continue;
      ++flying;
      jumps += track.sole(t - 1, 0) <= 0.05 || track.sole(t - 1, 1) <= 0.05;
      const double fall =
          (track.at(t + 1, kPelvis).z() - 2 * track.at(t, kPelvis).z() + track.at(t - 1, kPelvis).z()) * 120 * 120;
      EXPECT_NEAR(fall, -9.81, 0.02) << id.stem() << " frame " << t;
    }
    EXPECT_GE(jumps, 1u) << id.stem();
    EXPECT_GT(flying, 12u) << id.stem();
  }
}

TEST(Jumping, CrouchesFirstAndThrowsTheArmsUp) {
  for (const ClipId& id : ids_of(Action::jumping, 12)) {
    const Clip clip = make_clip(plan_of(12), id);
    const Track track(clip);
    std::size_t top = 0;
    for (std::size_t t = 0; t < track.size(); ++t)
      if (track.at(t, kPelvis).z() > track.at(top, kPelvis).z()) top = t;
    double lowest = 10, arms_back = 0;
    for (std::size_t t = top > 100 ? top - 100 : 0; t < top; ++t) {
      lowest = std::min(lowest, track.at(t, kPelvis).z());
      arms_back = std::min(arms_back, (track.at(t, kLeftWrist) - track.at(t, kLeftShoulder)).dot(track.forward(t)));
    }
    EXPECT_LT(lowest, track.at(0, kPelvis).z() - 0.12) << id.stem();
    EXPECT_LT(arms_back, -0.15) << id.stem();
    EXPECT_GT(track.at(top, kLeftWrist).z(), track.at(top, kLeftShoulder).z() - 0.1) << id.stem();
    EXPECT_GT(track.at(top, kPelvis).z(), track.at(0, kPelvis).z() + 0.10) << id.stem();
  }
}

TEST(Lifting, HandsGraspAtRestLowDownAndCarryUp) {
  for (const ClipId& id : ids_of(Action::lifting, 12)) {
    const Clip clip = make_clip(plan_of(12), id);
    const Track track(clip);
    double lowest = 10, highest = 0;
    std::size_t longest_rest = 0, rest = 0;
    for (std::size_t t = 1; t < track.size(); ++t) {
      const double low = std::max(track.at(t, kLeftWrist).z(), track.at(t, kRightWrist).z());
      lowest = std::min(lowest, low);
      if (track.at(t, kPelvis).z() > 0.97 * track.at(0, kPelvis).z())
        highest = std::max(highest, track.at(t, kLeftWrist).z());
      const bool still =
          low < 0.65 * track.scale() && (track.at(t, kLeftWrist) - track.at(t - 1, kLeftWrist)).norm() < 1e-6;
      rest = still ? rest + 1 : 0;
      longest_rest = std::max(longest_rest, rest);
      EXPECT_TRUE(track.planted(t, 0) && track.planted(t, 1)) << id.stem();
    }
    EXPECT_LT(lowest, 0.62) << id.stem();
    EXPECT_GT(highest, 1.0 * track.scale()) << id.stem() << ": not lifted to the chest";
    EXPECT_GE(longest_rest, 18u) << id.stem() << ": no grasp at rest";
  }
}

TEST(Transition, SegmentsTellWalkingFromJogging) {
  for (const ClipId& id : ids_of(Action::transition, 12)) {
    const Clip clip = make_clip(plan_of(12), id);
    const Track track(clip);
    ASSERT_EQ(clip.segments.size(), 3u) << id.stem();
    EXPECT_FALSE(clip.attributes.contains("action"));
    std::int64_t next = 0;
    std::vector<double> speed;
    for (const Segment& s : clip.segments) {
      EXPECT_EQ(s.start, next);
      next = s.start + s.length;
      const auto a = static_cast<std::size_t>(s.start + s.length / 4),
                 b = static_cast<std::size_t>(s.start + s.length * 3 / 4);
      speed.push_back((track.at(b, kPelvis) - track.at(a, kPelvis)).head<2>().norm() /
                      (static_cast<double>(b - a) / 120));
    }
    EXPECT_EQ(next, static_cast<std::int64_t>(clip.frames()));
    EXPECT_EQ(clip.segments[1].attributes.at("action"), "jogging");
    EXPECT_GT(speed[1], 1.4 * speed[0]) << id.stem();
    EXPECT_GT(speed[1], 1.4 * speed[2]) << id.stem();
  }
}

}  // namespace
}  // namespace mocap::corpus
