#include "libmocap/clip/leg_reach.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "libmocap/base/random.hpp"

namespace mocap {
namespace {

constexpr double kThigh = 0.42, kShank = 0.41, kFull = kThigh + kShank;

struct LegPose {
  Quaternion hip = Quaternion::Identity(), knee = Quaternion::Identity();
  static LegPose bent(double angle, const Quaternion& hip = Quaternion::Identity()) {
    LegPose leg{hip, hip * Quaternion(Eigen::AngleAxisd(angle, Vector3::UnitY()))};
    return leg;
  }
  Vector3 ankle(const Vector3& at = Vector3::Zero()) const { return at + hip * Vector3(0, 0, -kThigh) + knee * Vector3(0, 0, -kShank); }
  double flexion() const { return 2 * std::atan2((hip.conjugate() * knee).y(), (hip.conjugate() * knee).w()); }
  bool finite() const { return hip.coeffs().allFinite() && knee.coeffs().allFinite(); }
};

TEST(LegReach, BringsTheAnkleWhereItShouldBe) {
  Random random(1, 0);
  for (int k = 0; k < 500; ++k) {
    const Quaternion turn = exp_map(Vector3(random.normal(), random.normal(), random.normal()));
    LegPose leg = LegPose::bent(random.uniform(0.05, 2.0), turn);
    const Vector3 at(random.normal(), random.normal(), 1), direction = (leg.ankle() + 0.3 * Vector3(random.normal(), random.normal(), random.normal())).normalized();
    const Vector3 target = at + random.uniform(0.2, 0.994) * kFull * direction;
    reach(at, kThigh, kShank, target, leg.hip, leg.knee);
    EXPECT_LT((leg.ankle(at) - target).norm(), 1e-9);
    EXPECT_NEAR(leg.hip.norm(), 1, 1e-12);
    EXPECT_NEAR(leg.knee.norm(), 1, 1e-12);
    EXPECT_GT(leg.flexion(), -1e-9);  // the knee bends forward, about its own axis alone
    const Quaternion bend = leg.hip.conjugate() * leg.knee;
    EXPECT_LT(std::hypot(bend.x(), bend.z()), 1e-9);
  }
}

TEST(LegReach, WhatIsReachedAlreadyIsLeftAlone) {
  LegPose leg = LegPose::bent(0.7, exp_map(Vector3(0.2, -0.4, 0.3)));
  const LegPose before = leg;
  reach(Vector3::Zero(), kThigh, kShank, leg.ankle(), leg.hip, leg.knee);
  EXPECT_LT(geodesic_distance(leg.hip, before.hip), 1e-7);
  EXPECT_LT(geodesic_distance(leg.knee, before.knee), 1e-7);
}

TEST(LegReach, ASideTwistedKneeKeepsItsAxis) {
  LegPose leg;
  leg.hip = exp_map(Vector3(0.1, -0.5, 0.2));
  leg.knee = leg.hip * exp_map(Vector3(0.1, 0.8, 0.15));  // tibial twist and a knocked knee
  const Vector3 target(0.1, 0.05, -0.7);
  reach(Vector3::Zero(), kThigh, kShank, target, leg.hip, leg.knee);
  EXPECT_LT((leg.ankle() - target).norm(), 1e-9);
}

TEST(LegReach, TheLimitIsSoft) {
  double last = 0, last_flexion = 10;
  Vector3 before = Vector3::Zero();
  for (double d = 0.90 * kFull; d < 1.2 * kFull; d += 1e-4 * kFull) {
    LegPose leg = LegPose::bent(0.3);
    reach(Vector3::Zero(), kThigh, kShank, Vector3(0, 0, -d), leg.hip, leg.knee);
    const double reached = leg.ankle().norm();
    ASSERT_TRUE(leg.finite());
    EXPECT_GE(reached, last - 1e-12);      // monotone
    EXPECT_LT(reached, kFull + 1e-12);
    EXPECT_LE(leg.flexion(), last_flexion + 1e-9);
    EXPECT_GT(leg.flexion(), -1e-9);
    if (d <= 0.995 * kFull) { EXPECT_NEAR(reached, d, 1e-9); }
    if (last > 0) {
      EXPECT_LT(reached - last, 1.01e-4 * kFull);                   // continuous, never faster than the target
      EXPECT_LT((leg.ankle() - before).norm(), 1.1e-4 * kFull);
    }
    last = reached, last_flexion = leg.flexion(), before = leg.ankle();
  }
  EXPECT_GT(last, 0.9999 * kFull);
  // 63 % of what is left at one more softness beyond it.
  LegPose leg = LegPose::bent(0.3);
  reach(Vector3::Zero(), kThigh, kShank, Vector3(0, 0, -kFull), leg.hip, leg.knee);
  EXPECT_NEAR(leg.ankle().norm(), kFull * (1 - 0.005 * std::exp(-1)), 1e-9);
}

TEST(LegReach, ALegThatComesStraightStaysStraight) {
  for (const double bend : {0.0, 1e-4, 0.01, 0.05, 0.1, 0.2}) {
    LegPose leg = LegPose::bent(bend, exp_map(Vector3(0.2, -0.4, 0.3)));
    const LegPose before = leg;
    reach(Vector3::Zero(), kThigh, kShank, leg.ankle(), leg.hip, leg.knee);
    EXPECT_LT(geodesic_distance(leg.hip, before.hip), 2e-6) << bend;
    EXPECT_LT(geodesic_distance(leg.knee, before.knee), 2e-6) << bend;
    // And reaches for what lies beyond no faster than it comes nearer.
    double last = before.ankle().norm();
    for (double d = last; d < 1.05 * kFull; d += 1e-4) {
      LegPose further = before;
      reach(Vector3::Zero(), kThigh, kShank, d * before.ankle().normalized(), further.hip, further.knee);
      EXPECT_GE(further.ankle().norm(), last - 1e-12);
      EXPECT_LT(further.ankle().norm(), std::min(last + 1.01e-4, kFull + 1e-12));
      last = further.ankle().norm();
    }
  }
}

TEST(LegReach, OddTargetsStayFinite) {
  const LegPose starts[] = {LegPose::bent(0), LegPose::bent(1e-9), LegPose::bent(1), LegPose::bent(std::numbers::pi), LegPose::bent(-0.2), LegPose::bent(0.5, exp_map(Vector3(3, 0, 0)))};
  const Vector3 targets[] = {{0, 0, 0}, {0, 0, -1e-9}, {0, 0, -1e-5}, {0, 0, -0.01}, {0, 0, 0.83}, {0, 0, -1e6}, {1e6, -1e6, 1e6}, {0, 0.5, 0}, {0, 0, -kFull}, {0, 0, -(kThigh - kShank)}};
  for (const LegPose& start : starts)
    for (const Vector3& target : targets) {
      LegPose leg = start;
      reach(Vector3::Zero(), kThigh, kShank, target, leg.hip, leg.knee);
      EXPECT_TRUE(leg.finite()) << target.transpose();
      EXPECT_NEAR(leg.hip.norm(), 1, 1e-9);
      EXPECT_NEAR(leg.knee.norm(), 1, 1e-9);
      if (target.norm() > 1e-3) {
        const double aim = leg.ankle().norm() > 1e-6 ? leg.ankle().normalized().dot(target.normalized()) : 1;
        EXPECT_GT(aim, 1 - 1e-9) << target.transpose();
      }
    }
}

TEST(LegReach, AKneeBentBackwardsIsPutRight) {
  LegPose leg = LegPose::bent(-0.3);
  const Vector3 ankle = leg.ankle();
  reach(Vector3::Zero(), kThigh, kShank, ankle, leg.hip, leg.knee);
  EXPECT_LT((leg.ankle() - ankle).norm(), 1e-9);
  EXPECT_NEAR(leg.flexion(), 0.3, 1e-9);
}

}  // namespace
}  // namespace mocap
