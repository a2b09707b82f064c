#include "libmocap/skeleton/rest_pose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

std::size_t at(const Skeleton& s, const std::string& name) { return static_cast<std::size_t>(s.find(name)); }

// The canonical body with its bones laid elsewhere at rest: `place` gives the turn of each joint's bones from T-pose, in the canonical frame.
Skeleton posed(const std::function<Quaternion(const std::string&)>& place, const Quaternion& whole = Quaternion::Identity()) {
  Skeleton s = *canonical_body();
  std::vector<Quaternion> world(s.parents.size(), Quaternion::Identity());
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    if (j > 0) {
      const auto p = static_cast<std::size_t>(s.parents[j]);
      s.rest_offsets[j] = whole * world[p] * s.rest_offsets[j];
      world[j] = world[p];
    }
    world[j] = world[j] * place(s.joint_names[j]);
  }
  for (auto& e : s.end_sites) e.offset = whole * world[static_cast<std::size_t>(e.parent)] * e.offset;
  return s;
}

const auto kStraight = [](const std::string&) { return Quaternion::Identity(); };
// Arms lowered by an angle, legs spread by another.
std::function<Quaternion(const std::string&)> arms_down(double angle, double spread = 0) {
  return [=](const std::string& name) {
    const double side = name.starts_with("left_") ? 1 : -1;
    if (name.ends_with("_shoulder")) return Quaternion(Eigen::AngleAxisd(-side * angle, Vector3::UnitX()));
    if (name.ends_with("_hip")) return Quaternion(Eigen::AngleAxisd(side * spread, Vector3::UnitX()));
    return Quaternion::Identity();
  };
}

void expect_upright(const Skeleton& s, const std::string& what) {
  SCOPED_TRACE(what);
  const auto t_pose = t_pose_orientations(s, map_to_canonical(s));
  ASSERT_TRUE(t_pose);
  const auto p = t_pose_positions(s, *t_pose);
  const Vector3 across = p[at(s, "left_hip")] - p[at(s, "right_hip")], up = p[at(s, "neck")] - p[0], toes = p[at(s, "left_foot")] - p[at(s, "left_ankle")];
  EXPECT_GT(across.normalized().y(), 1 - 1e-9);
  EXPECT_GT(up.normalized().z(), 0.99);
  EXPECT_GT(toes.normalized().x(), 0.9);
  for (const auto& q : *t_pose) EXPECT_LT(geodesic_distance(q, t_pose->front()), 1e-12);  // one rotation for all
}

TEST(RestPose, RigsThatStandAlongAnyAxisFacingAnyWay) {
  const double half = std::numbers::pi / 2;
  const std::pair<const char*, Quaternion> frames[] = {{"z up", Quaternion::Identity()},
                                                       {"y up", Quaternion(Eigen::AngleAxisd(-half, Vector3::UnitX()))},
                                                       {"y down", Quaternion(Eigen::AngleAxisd(half, Vector3::UnitX()))},
                                                       {"x up", Quaternion(Eigen::AngleAxisd(half, Vector3::UnitY()))},
                                                       {"x down", Quaternion(Eigen::AngleAxisd(-half, Vector3::UnitY()))},
                                                       {"z down", Quaternion(Eigen::AngleAxisd(2 * half, Vector3::UnitX()))}};
  for (const auto& [name, frame] : frames)
    for (double yaw = -3; yaw <= 3; yaw += 0.5) expect_upright(posed(kStraight, frame * yaw_rotation(yaw)), std::string(name) + ", yaw " + std::to_string(yaw));
  const auto same = t_pose_orientations(*canonical_body(), map_to_canonical(*canonical_body()));
  for (const auto& q : *same) EXPECT_LT(geodesic_distance(q, Quaternion::Identity()), 1e-12);
}

TEST(RestPose, ArmsOutOrDownAndLegsSpread) {
  for (const double arms : {0.0, 0.4, 0.8, 1.2, 1.5})
    for (const double legs : {-0.1, 0.0, 0.15, 0.3}) expect_upright(posed(arms_down(arms, legs), yaw_rotation(1.1)), "arms " + std::to_string(arms) + ", legs " + std::to_string(legs));
}

TEST(RestPose, LyingAskewStandsAlongItsOwnLegsAndTrunk) {
  const double half = std::numbers::pi / 2;
  for (const double yaw : {0.1, 0.2, 0.34, 0.7}) {
    const Skeleton s = posed(kStraight, yaw_rotation(yaw) * Quaternion(Eigen::AngleAxisd(half, Vector3::UnitY())));
    const auto up = rest_up(s, map_to_canonical(s));
    ASSERT_TRUE(up);
    const Vector3 along(std::cos(yaw), std::sin(yaw), 0);
    EXPECT_LT(std::acos(std::min(1.0, up->dot(along))), yaw < 0.14 ? 0.14 : 0.03) << yaw;
  }
}

TEST(RestPose, ToesThatHang) {
  EXPECT_TRUE(foot_hangs(Vector3(0, 0, -0.1)));
  EXPECT_TRUE(foot_hangs(Vector3(0.03, 0.01, -0.1)));
  EXPECT_FALSE(foot_hangs(Vector3(0.1, 0, -0.1)));
  EXPECT_FALSE(foot_hangs(Vector3::Zero()));
  const auto hanging = posed([](const std::string& name) { return name.ends_with("_ankle") ? exp_map(Vector3(0, 1.25, 0)) : Quaternion::Identity(); });
  const SoleHeights sole = sole_heights(hanging);
  EXPECT_NEAR(sole.ankle, kAnkleSoleHeight, 1e-9);
}

TEST(RestPose, TheTableIsForBandaiNamcosBonesNotForItsNames) {
  Skeleton s = *canonical_body();
  const std::pair<const char*, const char*> names[] = {{"pelvis", "Hips"}, {"left_hip", "UpperLeg_L"}, {"left_knee", "LowerLeg_L"}, {"left_ankle", "Foot_L"}, {"left_foot", "Toes_L"}, {"right_hip", "UpperLeg_R"},
                                                       {"right_knee", "LowerLeg_R"}, {"right_ankle", "Foot_R"}, {"right_foot", "Toes_R"}, {"spine1", "Spine"}, {"neck", "Neck"}, {"head", "Head"}, {"spine3", "joint_Root"},
                                                       {"left_shoulder", "UpperArm_L"}, {"left_elbow", "LowerArm_L"}, {"left_wrist", "Hand_L"}, {"right_shoulder", "UpperArm_R"}, {"right_elbow", "LowerArm_R"}, {"right_wrist", "Hand_R"}};
  s.roles.clear();
  for (const auto& [from, to] : names) s.joint_names[static_cast<std::size_t>(s.find(from))] = to;
  const auto stands = t_pose_orientations(s, map_to_canonical(s));
  ASSERT_TRUE(stands);
  for (const auto& q : *stands) EXPECT_LT(geodesic_distance(q, Quaternion::Identity()), 1e-9);
}

TEST(RestPose, WhatDoesNotStandHasNone) {
  const auto none = [](const Skeleton& s) { return !t_pose_orientations(s, map_to_canonical(s)).has_value(); };
  const auto bent = [](const std::vector<std::string>& parts, const Vector3& turn) {
    return [=](const std::string& name) {
      for (const auto& part : parts)
        if (name.ends_with(part)) return exp_map(turn);
      return Quaternion::Identity();
    };
  };
  EXPECT_FALSE(none(posed(bent({"pelvis"}, Vector3::Zero()))));                                    // the body itself stands
  EXPECT_TRUE(none(posed(bent({"_hip"}, Vector3(0, -1.5, 0)))));                                   // sitting, legs straight ahead
  const auto chair = [](const std::string& name) { return name.ends_with("_hip") ? exp_map(Vector3(0, -1.5, 0)) : name.ends_with("_knee") ? exp_map(Vector3(0, 1.5, 0)) : Quaternion::Identity(); };
  EXPECT_TRUE(none(posed(chair)));                                                                 // sitting on a chair
  EXPECT_TRUE(none(posed(bent({"left_hip"}, Vector3(0, -1.5, 0)))));                               // a kick
  EXPECT_TRUE(none(posed(bent({"spine1"}, Vector3(0, 1.6, 0)))));                                  // bent double
  EXPECT_TRUE(none(posed(bent({"left_hip", "left_knee"}, Vector3(0, 1.2, 0)))));                   // on one leg, heel to the seat
  // Every bone along one axis; no legs at all; every joint in one place.
  Skeleton line = *canonical_body();
  for (auto& v : line.rest_offsets) v = Vector3(v.norm(), 0, 0);
  EXPECT_TRUE(none(line));
  for (auto& v : line.rest_offsets) v.setZero();
  EXPECT_TRUE(none(line));
  Skeleton hands;
  hands.joint_names = {"Hands", "LeftHand", "RightHand"};
  hands.parents = {-1, 0, 0};
  hands.rest_offsets.assign(3, Vector3(0, 0.2, 0));
  EXPECT_TRUE(none(hands));
  // Lying along an axis of the file is standing along that axis; lying askew is not upright either, but nothing in the rig says so.
  EXPECT_FALSE(none(posed(kStraight, Quaternion(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitY())))));
}

TEST(RestPose, SolesOfTheCanonicalBody) {
  const SoleHeights sole = sole_heights(*canonical_body());
  EXPECT_NEAR(sole.toe, kFootSoleHeight, 1e-12);
  EXPECT_NEAR(sole.ankle, kAnkleSoleHeight, 1e-12);
  // Turned and named otherwise it has the same soles; twice the size puts the tip's own height on top.
  const SoleHeights turned = sole_heights(posed(arms_down(1), Quaternion(Eigen::AngleAxisd(1.2, Vector3::UnitZ()))));
  EXPECT_NEAR(turned.toe, kFootSoleHeight, 1e-12);
  EXPECT_NEAR(turned.ankle, kAnkleSoleHeight, 1e-12);
  Skeleton big = *canonical_body();
  for (auto& v : big.rest_offsets) v *= 2;
  for (auto& e : big.end_sites) e.offset *= 2;
  EXPECT_NEAR(sole_heights(big).toe, 2 * (kFootSoleHeight - kToeTipHeight) + kToeTipHeight, 1e-12);
  EXPECT_NEAR(sole_heights(big).ankle, 2 * (kAnkleSoleHeight - kToeTipHeight) + kToeTipHeight, 1e-12);
}

TEST(RestPose, SolesOfRigsWithoutFeetAreScaled) {
  // No end sites, toes level with the ankles: nothing lies below the ankle.
  Skeleton s = *canonical_body();
  s.end_sites.clear();
  for (auto& v : s.rest_offsets) v *= 1.5;
  for (const char* foot : {"left_foot", "right_foot"}) s.rest_offsets[at(s, foot)].z() = 0;
  EXPECT_NEAR(sole_heights(s).toe, 1.5 * kFootSoleHeight, 1e-12);
  EXPECT_NEAR(sole_heights(s).ankle, 1.5 * kAnkleSoleHeight, 1e-12);
  // A rig that does not stand.
  for (auto& v : s.rest_offsets) v = Vector3(v.norm(), 0, 0);
  EXPECT_NEAR(sole_heights(s).ankle, 1.5 * kAnkleSoleHeight, 1e-12);
  Skeleton none;
  none.joint_names = {"root"};
  none.parents = {-1};
  none.rest_offsets = {Vector3::Zero()};
  EXPECT_TRUE(std::isfinite(sole_heights(none).toe));
  EXPECT_EQ(sole_heights(none).toe, sole_heights(none).ankle);
}

TEST(RestPose, LegLength) {
  Skeleton s = *canonical_body();
  const double leg = 0.491 * 1.70;
  EXPECT_NEAR(leg_length(s, map_to_canonical(s)), leg, 1e-12);
  s.rest_offsets[at(s, "left_knee")] *= 1.2;
  EXPECT_NEAR(leg_length(s, map_to_canonical(s)), leg + 0.1 * 0.245 * 1.70, 1e-12);
  JointMap one = map_to_canonical(s);
  one.source[at(*canonical_body(), "left_ankle")] = -1;
  EXPECT_NEAR(leg_length(s, one), leg, 1e-12);
  one.source[at(*canonical_body(), "right_hip")] = -1;
  EXPECT_EQ(leg_length(s, one), 0);
}

}  // namespace
}  // namespace mocap
