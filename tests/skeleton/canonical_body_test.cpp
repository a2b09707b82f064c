#include "libmocap/skeleton/canonical_body.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libmocap/skeleton/forward_kinematics.hpp"

namespace mocap {
namespace {

std::string other_side(std::string name) {
  if (name.rfind("left", 0) == 0) return "right" + name.substr(4);
  if (name.rfind("right", 0) == 0) return "left" + name.substr(5);
  return name;
}

Vector3 mirrored(const Vector3& v) { return {v.x(), -v.y(), v.z()}; }

TEST(CanonicalBody, HasTheSmplJointNamesInTheirOrder) {
  const std::vector<std::string> names = {"pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
                                          "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
                                          "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist"};
  EXPECT_EQ(canonical_body()->joint_names, names);
  EXPECT_EQ(canonical_body()->parents, (std::vector<int>{-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19}));
  EXPECT_EQ(canonical_body()->end_sites.size(), 5u);
  EXPECT_NO_THROW(canonical_body()->validate());
  EXPECT_EQ(canonical_body().get(), canonical_body().get());
}

TEST(CanonicalBody, IsSymmetric) {
  const Skeleton& s = *canonical_body();
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    const int o = s.find(other_side(s.joint_names[j]));
    ASSERT_GE(o, 0);
    EXPECT_EQ(s.rest_offsets[static_cast<std::size_t>(o)], mirrored(s.rest_offsets[j])) << s.joint_names[j];
  }
  for (const auto& e : s.end_sites) {
    const int o = s.find(other_side(s.joint_names[static_cast<std::size_t>(e.parent)]));
    EXPECT_TRUE(std::any_of(s.end_sites.begin(), s.end_sites.end(), [&](const auto& f) { return f.parent == o && f.offset == mirrored(e.offset); }));
  }
  for (const auto& [role, joint] : s.roles) EXPECT_EQ(s.find_role(other_side(role)), s.find(other_side(joint))) << role;
}

TEST(CanonicalBody, StandsOnItsSolesAndIsAsTallAsItSays) {
  const Skeleton& s = *canonical_body();
  const std::vector<Quaternion> rest(s.parents.size(), Quaternion::Identity());
  Pose pose;
  forward_kinematics(s, rest, {0, 0, canonical_pelvis_height()}, pose);
  double top = 0, lowest = 1, leftmost = 0;
  for (const Vector3& p : end_site_positions(s, pose)) {
    top = std::max(top, p.z());
    lowest = std::min(lowest, p.z());
    leftmost = std::max(leftmost, p.y());
  }
  for (const Vector3& p : pose.positions) lowest = std::min(lowest, p.z());
  EXPECT_NEAR(top, 1.70, 1e-12);
  EXPECT_GT(lowest, 0);
  EXPECT_LT(lowest, kFootSoleHeight);
  EXPECT_NEAR(2 * leftmost, 1.70, 0.15);  // arm span is about stature
  for (const char* side : {"left", "right"}) {
    EXPECT_NEAR(pose.positions[static_cast<std::size_t>(s.find(side + std::string("_foot")))].z(), kFootSoleHeight, 1e-15);
    EXPECT_NEAR(pose.positions[static_cast<std::size_t>(s.find(side + std::string("_ankle")))].z(), kAnkleSoleHeight, 1e-15);
  }
  EXPECT_GT(pose.positions[static_cast<std::size_t>(s.find("left_foot"))].x(), 0.1);   // faces +X
  EXPECT_GT(pose.positions[static_cast<std::size_t>(s.find("left_wrist"))].y(), 0.5);  // left is +Y
}

// Worked out by hand from the proportions of stature h in the header.
TEST(CanonicalBody, ImpactFactors) {
  const Skeleton& s = *canonical_body();
  const auto alpha = impact_factors(s);
  const auto of = [&](const char* name) { return alpha[static_cast<std::size_t>(s.find(name))]; };
  const double h = 1.70, wrist = 0.107 * h, elbow = wrist + 0.155 * h, shoulder = elbow + 0.162 * h, collar = shoulder + 0.076 * h;
  EXPECT_NEAR(of("left_wrist"), wrist, 1e-12);
  EXPECT_NEAR(of("right_elbow"), elbow, 1e-12);
  EXPECT_NEAR(of("left_shoulder"), shoulder, 1e-12);
  EXPECT_NEAR(of("left_collar"), collar, 1e-12);
  const double spine3 = collar + std::hypot(0.030 * h, 0.073 * h);  // the arm is longer than neck and head
  EXPECT_NEAR(of("spine3"), spine3, 1e-12);
  EXPECT_NEAR(of("spine1"), spine3 + 0.050 * h + 0.075 * h, 1e-12);
  const double foot = std::hypot(0.041 * h, 0.015), ankle = foot + std::hypot(0.075 * h, kAnkleSoleHeight - kFootSoleHeight);
  const double knee = ankle + 0.246 * h, hip = knee + 0.245 * h;
  EXPECT_NEAR(of("left_foot"), foot, 1e-12);
  EXPECT_NEAR(of("right_ankle"), ankle, 1e-12);
  EXPECT_NEAR(of("left_hip"), hip, 1e-12);
  EXPECT_NEAR(of("pelvis"), std::max(hip + std::hypot(0.052 * h, 0.030 * h), of("spine1") + 0.060 * h), 1e-12);
  for (std::size_t j = 1; j < alpha.size(); ++j) EXPECT_LT(alpha[j], alpha[static_cast<std::size_t>(s.parents[j])]);
}

}  // namespace
}  // namespace mocap
