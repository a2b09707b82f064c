#include "libmocap/corpus/leg_ik.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/random.hpp"
#include "libmocap/corpus/body_state.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/skeleton/forward_kinematics.hpp"

namespace mocap::corpus {
namespace {

TEST(TwoBones, ReachEveryPointInReachWithOneHinge) {
  Random random(5, 1);
  const Vector3 upper(0, 0, -0.42), lower(0, 0, -0.40), hinge(0, 1, 0);
  for (int k = 0; k < 2000; ++k) {
    const Vector3 target =
        Vector3(random.normal(), 0.5 * random.normal(), random.normal()).normalized() * random.uniform(0.15, 0.815);
    const Vector3 across = Vector3(0.3 * random.normal(), 1, 0.3 * random.normal());
    const TwoBone bones = solve_two_bones(upper, lower, hinge, target, across, 0.05, 2.9);
    const Quaternion knee = exp_map(bones.flexion * hinge);
    EXPECT_TRUE(bones.reached);
    EXPECT_LT((bones.upper_world * (upper + knee * lower) - target).norm(), 1e-9);
    // The hinge is the direction nearest to the wanted one that is perpendicular to the reach.
    const Vector3 axis = bones.upper_world * hinge,
                  ideal = (across - target * target.dot(across) / target.squaredNorm()).normalized();
    EXPECT_LT((axis - ideal).norm(), 1e-9);
    EXPECT_NEAR(bones.upper_world.norm(), 1, 1e-12);
  }
}

TEST(TwoBones, KeepTheDirectionOfWhatIsOutOfReach) {
  const Vector3 upper(0, 0, -0.4), lower(0, 0, -0.4);
  for (const double distance : {1.0, 0.05}) {
    const Vector3 target = distance * Vector3(0.6, 0, -0.8);
    const TwoBone bones = solve_two_bones(upper, lower, Vector3::UnitY(), target, Vector3::UnitY(), 0.1, 2.6);
    EXPECT_FALSE(bones.reached);
    EXPECT_DOUBLE_EQ(bones.flexion, distance > 0.5 ? 0.1 : 2.6);
    const Vector3 end = bones.upper_world * (upper + exp_map(bones.flexion * Vector3::UnitY()) * lower);
    EXPECT_LT((end.normalized() - target.normalized()).norm(), 1e-9);
  }
}

TEST(BodyState, FeetAreWhereThePlanPutsThem) {
  const BodyPlan body = make_body(1.8, 1.02, 0.99, 1.01, 1.05, 0.95);
  BodyState s;
  s.pelvis = Vector3(1, -2, 0.9);
  s.yaw = 2.2, s.tilt = 0.2, s.roll = -0.1;
  const Vector2 under(1 - 0.05, -2 + 0.08);
  s.feet[0] = standing_foot(body, under + Vector2(0.1, -0.1), 2.3, 0.3);
  s.feet[1] = standing_foot(body, under - Vector2(0.1, -0.1), 2.1, -0.5);
  s.arms[0].reach = 1;
  s.arms[0].hand = Vector3(0.75, -1.8, 1.1);
  std::vector<Quaternion> local(kJoints);
  Pose pose;
  pose_body(body, s, local);
  forward_kinematics(*body.skeleton, local, s.pelvis, pose);
  EXPECT_LT((pose.positions[kLeftFoot] - s.feet[0].ball).norm(), 1e-9);
  EXPECT_LT((pose.positions[kRightFoot] - s.feet[1].ball).norm(), 1e-9);
  EXPECT_LT((pose.positions[kLeftWrist] - s.arms[0].hand).norm(), 1e-9);
  EXPECT_NEAR(pose.positions[kRightFoot].z(), body.ball_height, 1e-9);
  // A foot on its heel: the heel touches the ground, the ball is up. Toes bent back lie flat behind a raised heel.
  const Vector3 heel =
      pose.positions[kLeftAnkle] + pose.rotations[kLeftAnkle] * Vector3(-body.heel_back, 0, -body.ankle_height);
  EXPECT_NEAR(heel.z(), 0, 1e-9);
  EXPECT_GT(pose.positions[kLeftFoot].z(), body.ball_height + 0.03);
  EXPECT_NEAR((pose.rotations[kRightFoot] * Vector3::UnitX()).z(), 0, 1e-9);
}

TEST(BodyState, StandingStraightIsTheRestPoseOfTheLegs) {
  const BodyPlan body = make_body(1.70, 1, 1, 1, 1, 1);
  EXPECT_TRUE(body.skeleton->same_as(*canonical_body()));
  BodyState s;
  s.pelvis = Vector3(0, 0, canonical_pelvis_height() - 0.02);
  for (int side = 0; side < 2; ++side)
    s.feet[static_cast<std::size_t>(side)] =
        standing_foot(body, {body.ankle_to_ball.x(), (side == 0 ? 1 : -1) * body.hip_half_width}, 0, 0);
  EXPECT_EQ(reach_deficit(body, s), 0);
  s.pelvis.z() = canonical_pelvis_height() + 0.01;
  EXPECT_NEAR(reach_deficit(body, s),
              0.01 + body.leg() - two_bone_reach(body.thigh, body.shank, kMinKneeFlexion + 0.002), 1e-9);
}

}  // namespace
}  // namespace mocap::corpus
