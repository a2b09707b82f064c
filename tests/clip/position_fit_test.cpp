#include "libmocap/clip/position_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

const std::vector<std::string> kGiven = {"pelvis", "left_hip", "left_knee", "left_ankle", "left_foot", "right_hip", "right_knee", "right_ankle", "right_foot", "spine1", "spine3", "neck", "head", "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist"};

std::vector<int> given(const Skeleton& s = *canonical_body()) {
  std::vector<int> joints;
  for (const auto& name : kGiven) joints.push_back(s.find(name));
  return joints;
}

// A clip of one pose a frame; each joint is set by name, the rest is the T-pose.
struct Posed {
  Clip clip;
  Posed() {
    clip.skeleton = canonical_body();
    clip.frame_rate_hz = 30;
  }
  void add(const Vector3& root, const std::map<std::string, Quaternion>& turns) {
    std::vector<Quaternion> q(22, Quaternion::Identity());
    for (const auto& [name, turn] : turns) q[static_cast<std::size_t>(clip.skeleton->find(name))] = turn;
    clip.rotations.insert(clip.rotations.end(), q.begin(), q.end());
    clip.root_position.push_back(root);
  }
};

JointPositions positions(const Clip& clip) {
  const auto joints = given();
  JointPositions p(static_cast<Eigen::Index>(clip.frames()), 3 * static_cast<Eigen::Index>(joints.size()));
  Pose pose;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    for (std::size_t k = 0; k < joints.size(); ++k) p.row(static_cast<Eigen::Index>(t)).segment<3>(3 * static_cast<Eigen::Index>(k)) = pose.positions[static_cast<std::size_t>(joints[k])].transpose();
  }
  return p;
}

PositionFit fitted(const JointPositions& p) { return PositionFitter(canonical_body(), given())(p, 30); }

Quaternion about(const Vector3& axis, double angle) { return exp_map(axis.normalized() * angle); }
Quaternion local(const Clip& clip, std::size_t t, const std::string& joint) { return clip.frame(t)[static_cast<std::size_t>(clip.skeleton->find(joint))]; }

// Poses that people have: knees and elbows bent by 20 to 120 degrees about their hinge, the spine a little, hips, shoulders and collars anyhow.
Clip people(std::size_t frames, std::uint64_t seed) {
  Random random(seed, 0);
  const auto any = [&](double most) { return about({random.normal(), random.normal(), random.normal()}, random.uniform(0, most)); };
  Posed posed;
  for (std::size_t t = 0; t < frames; ++t) {
    const Quaternion bend = any(0.1);
    posed.add({random.normal(), random.normal(), random.uniform(0.4, 1.2)},
              {{"pelvis", any(3)},
               {"spine1", bend},
               {"spine2", bend},
               {"spine3", bend},
               {"neck", any(0.4)},
               {"left_hip", any(1.2)},
               {"right_hip", any(1.2)},
               {"left_knee", about(Vector3::UnitY(), random.uniform(0.35, 2.1))},
               {"right_knee", about(Vector3::UnitY(), random.uniform(0.35, 2.1))},
               {"left_ankle", any(0.3)},
               {"right_ankle", any(0.3)},
               {"left_collar", any(0.15)},
               {"right_collar", any(0.15)},
               {"left_shoulder", any(1.2)},
               {"right_shoulder", any(1.2)},
               {"left_elbow", about(-Vector3::UnitZ(), random.uniform(0.35, 2.1))},
               {"right_elbow", about(Vector3::UnitZ(), random.uniform(0.35, 2.1))}});
  }
  return posed.clip;
}

TEST(PositionFit, PosesComeBack) {
  const Clip clip = people(300, 1);
  const PositionFit fit = fitted(positions(clip));
  EXPECT_EQ(fit.frames, 300u);
  EXPECT_LT(fit.mean_mm, 1.5);
  for (std::size_t k = 0; k < kGiven.size(); ++k) EXPECT_LT(fit.joints[k].mean_mm, kGiven[k].ends_with("elbow") || kGiven[k].ends_with("knee") ? 8 : 1.5) << kGiven[k];
  // Bent limbs tell how the bone above them is turned about itself, and how far they are bent.
  for (const auto& [name, mean] : std::map<std::string, double>{{"pelvis", 0.1}, {"left_hip", 4}, {"right_hip", 4}, {"left_knee", 0.1}, {"right_knee", 0.1}, {"left_elbow", 0.5}, {"right_elbow", 0.5}}) {
    double sum = 0;
    for (std::size_t t = 0; t < 300; ++t) sum += geodesic_distance(local(clip, t, name), local(fit.clip, t, name)) * 180 / std::numbers::pi;
    EXPECT_LT(sum / 300, mean) << name;
  }
  // By forward kinematics of what was returned.
  const JointPositions again = positions(fit.clip), wanted = positions(clip);
  double sum = 0;
  for (Eigen::Index t = 0; t < 300; ++t)
    for (Eigen::Index k = 0; k < 19; ++k) sum += 1000 * (again.row(t).segment<3>(3 * k) - wanted.row(t).segment<3>(3 * k)).norm();
  EXPECT_NEAR(sum / (300 * 19), fit.mean_mm, 1e-6);
}

TEST(PositionFit, TheTPoseIsTheIdentity) {
  Posed posed;
  posed.add({0.5, -1, 1}, {});
  const PositionFit fit = fitted(positions(posed.clip));
  EXPECT_LT(fit.mean_mm, 1e-3);
  for (const Quaternion& q : fit.clip.rotations) EXPECT_LT(geodesic_distance(q, Quaternion::Identity()), 1e-6);
}

TEST(PositionFit, LeftIsLeftAndJointsBendAsTheyDo) {
  Posed posed;
  posed.add({0, 0, 0.9}, {{"left_knee", about(Vector3::UnitY(), 1)}, {"right_elbow", about(Vector3::UnitZ(), 0.8)}});
  const PositionFit fit = fitted(positions(posed.clip));
  EXPECT_LT(geodesic_distance(local(fit.clip, 0, "left_knee"), about(Vector3::UnitY(), 1)), 1e-6);
  EXPECT_LT(geodesic_distance(local(fit.clip, 0, "right_elbow"), about(Vector3::UnitZ(), 0.8)), 1e-6);
  EXPECT_LT(geodesic_distance(local(fit.clip, 0, "right_knee"), Quaternion::Identity()), 1e-6);
  EXPECT_LT(geodesic_distance(local(fit.clip, 0, "left_hip"), Quaternion::Identity()), 1e-3);
}

TEST(PositionFit, TurnsAndMovesWithTheWorld) {
  const Clip clip = people(20, 2);
  const Quaternion turn = about({1, 2, 3}, 1.1);
  const Vector3 by(3, -1, 2);
  const JointPositions p = positions(clip);
  JointPositions moved = p;
  for (Eigen::Index t = 0; t < p.rows(); ++t)
    for (Eigen::Index k = 0; k < 19; ++k) moved.row(t).segment<3>(3 * k) = (turn * Vector3(p.row(t).segment<3>(3 * k)) + by).transpose();
  const PositionFit a = fitted(p), b = fitted(moved);
  for (std::size_t t = 0; t < 20; ++t)
    for (std::size_t j = 0; j < 22; ++j) EXPECT_LT(geodesic_distance(j == 0 ? turn * a.clip.frame(t)[j] : a.clip.frame(t)[j], b.clip.frame(t)[j]), 1e-6);
}

// Bones 3 % too long or short, and 5 mm of noise: what a network makes.
TEST(PositionFit, BonesOfAnotherLengthDoNotTurnJointsRound) {
  const Clip clip = people(300, 3);
  Clip other = clip;
  auto body = std::make_shared<Skeleton>(*clip.skeleton);
  Random random(7, 0);
  for (auto& offset : body->rest_offsets) offset *= random.uniform(0.97, 1.03);
  other.skeleton = body;
  JointPositions p = positions(other);
  for (Eigen::Index i = 0; i < p.size(); ++i) p.data()[i] += 0.005 / std::sqrt(3.0) * random.normal();
  const PositionFit fit = fitted(p);
  EXPECT_LT(fit.mean_mm, 12);
  for (std::size_t k = 0; k < kGiven.size(); ++k)
    if (kGiven[k].ends_with("ankle") || kGiven[k].ends_with("wrist")) {
      EXPECT_LT(fit.joints[k].mean_mm, 3) << kGiven[k];
    }
  for (std::size_t t = 0; t < 300; ++t)
    for (const auto& [joint, axis] : {std::pair<std::string, Vector3>{"left_knee", Vector3::UnitY()}, {"right_knee", Vector3::UnitY()}, {"left_elbow", -Vector3::UnitZ()}, {"right_elbow", Vector3::UnitZ()}}) {
      const Vector3 v = log_map(local(fit.clip, t, joint));
      EXPECT_GT(v.dot(axis), -1e-6) << joint << " " << t;
      EXPECT_LT(v.cross(axis).norm(), 1e-6) << joint << " " << t;
      EXPECT_LT(geodesic_distance(local(fit.clip, t, joint), local(clip, t, joint)), 0.45) << joint << " " << t;
    }
}

// A leg and an arm that straighten, go 3 degrees too far, and bend again: nothing jumps.
TEST(PositionFit, LimbsPassThroughStraight) {
  Posed posed;
  for (int t = 0; t <= 100; ++t) {
    const double bend = 0.6 * std::abs(t - 50) / 50.0 - 0.05;
    posed.add({0, 0, 0.9}, {{"left_hip", about({0.3, 1, 0.2}, -0.4)}, {"left_knee", about(Vector3::UnitY(), bend)}, {"left_shoulder", about({1, 0, 0.2}, -1.2)}, {"left_elbow", about(-Vector3::UnitZ(), bend)}});
  }
  const PositionFit fit = fitted(positions(posed.clip));
  EXPECT_LT(fit.mean_mm, 2);
  for (std::size_t t = 1; t <= 100; ++t)
    for (std::size_t j = 0; j < 22; ++j) EXPECT_LT(geodesic_distance(fit.clip.frame(t)[j], fit.clip.frame(t - 1)[j]), 0.15) << fit.clip.skeleton->joint_names[j] << " " << t;
}

// What positions do not tell is that of a natural pose; where joints come to does not change.
TEST(PositionFit, WhatIsNotSeenIsNatural) {
  Clip clip = people(30, 6);
  for (std::size_t t = 0; t < 30; ++t) {
    for (const char* name : {"head", "left_wrist", "right_wrist", "left_foot"}) clip.frame(t)[static_cast<std::size_t>(clip.skeleton->find(name))] = about({0.2, 1, -0.4}, 0.6);
    clip.frame(t)[static_cast<std::size_t>(clip.skeleton->find("left_elbow"))] = local(clip, t, "left_elbow") * about(Vector3::UnitY(), 0.5);
  }
  MeanPose pose;
  pose.add(clip);
  ASSERT_EQ(pose.rotations().size(), 22u);
  const PositionFit plain = fitted(positions(clip)), fit = PositionFitter(canonical_body(), given(), pose.rotations())(positions(clip), 30);
  EXPECT_NEAR(plain.mean_mm, fit.mean_mm, 1e-6);
  double twist = 0;
  for (std::size_t t = 0; t < 30; ++t) {
    for (const char* name : {"head", "left_wrist", "right_wrist", "left_foot"}) EXPECT_LT(geodesic_distance(local(fit.clip, t, name), about({0.2, 1, -0.4}, 0.6)), 1e-6) << name;
    EXPECT_LT(geodesic_distance(local(plain.clip, t, "head"), Quaternion::Identity()), 1e-6);
    twist += geodesic_distance(local(fit.clip, t, "left_elbow"), local(clip, t, "left_elbow")) / 30;
  }
  EXPECT_LT(twist, 0.15);
  EXPECT_THROW(PositionFitter(canonical_body(), given(), {Quaternion::Identity()}), Error);
}

// By hand: two turns about one axis, one of them written with the other sign.
TEST(MeanPose, IsBetween) {
  Posed posed;
  posed.add({0, 0, 1}, {{"head", about(Vector3::UnitX(), 0.2)}});
  posed.add({0, 0, 1}, {{"head", about(Vector3::UnitX(), 0.6)}});
  posed.clip.frame(1)[static_cast<std::size_t>(posed.clip.skeleton->find("head"))].coeffs() *= -1;
  MeanPose pose;
  pose.add(posed.clip);
  EXPECT_LT(geodesic_distance(pose.rotations()[static_cast<std::size_t>(posed.clip.skeleton->find("head"))], about(Vector3::UnitX(), 0.4)), 1e-9);
  EXPECT_TRUE(MeanPose().rotations().empty());
}

TEST(PositionFit, EndsOutOfReachAreReachedFor) {
  Posed posed;
  posed.add({0, 0, 0.9}, {{"left_knee", about(Vector3::UnitY(), 0.5)}});
  JointPositions p = positions(posed.clip);
  const Eigen::Index ankle = 3 * 3;
  p.row(0).segment<3>(ankle) = Vector3(0.9, 0.1, -0.4).transpose();
  const PositionFit fit = fitted(p);
  const Vector3 hip = p.row(0).segment<3>(3), end = positions(fit.clip).row(0).segment<3>(ankle), wanted = p.row(0).segment<3>(ankle);
  EXPECT_NEAR((end - hip).norm(), 0.4165 + 0.4182, 1e-3);
  EXPECT_LT((end - hip).cross(wanted - hip).norm(), 1e-6);
  EXPECT_EQ(fit.joints[3].worst_frame, 0u);
  EXPECT_NEAR(fit.joints[3].worst_mm, 1000 * (end - wanted).norm(), 1e-6);
}

TEST(PositionFit, PointsOnTopOfEachOtherGiveFiniteRotations) {
  const PositionFit fit = fitted(JointPositions::Zero(3, 57));
  for (const Quaternion& q : fit.clip.rotations) EXPECT_NEAR(q.norm(), 1, 1e-9);
  EXPECT_TRUE(std::isfinite(fit.mean_mm));
}

TEST(PositionFit, WhatCannotBeFittedIsRefused) {
  const auto refused = [](const std::function<void()>& body) {
    try {
      body();
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  JointPositions p = positions(people(4, 5));
  EXPECT_NE(refused([&] { fitted(p.leftCols(54)); }).find("54 numbers in a frame, expected 57"), std::string::npos);
  EXPECT_NE(refused([&] { fitted(JointPositions(0, 57)); }).find("0 frames"), std::string::npos);
  EXPECT_NE(refused([&] { PositionFitter(canonical_body(), given())(p, 0); }).find("0 Hz"), std::string::npos);
  p(2, 3 * 7) = std::nan("");
  EXPECT_NE(refused([&] { fitted(p); }).find("right_ankle: frame 2"), std::string::npos);
  auto few = given();
  few.pop_back();
  EXPECT_NE(refused([&] { PositionFitter(canonical_body(), few); }).find("right_wrist: no positions"), std::string::npos);
  auto renamed = std::make_shared<Skeleton>(*canonical_body()), rehung = std::make_shared<Skeleton>(*canonical_body());
  renamed->joint_names[5] = "knee";
  EXPECT_NE(refused([&] { PositionFitter(renamed, given()); }).find("no joint right_knee"), std::string::npos);
  rehung->parents[static_cast<std::size_t>(rehung->find("neck"))] = rehung->find("spine2");
  EXPECT_NE(refused([&] { PositionFitter(rehung, given()); }).find("neck does not hang on spine3"), std::string::npos);
}

}  // namespace
}  // namespace mocap
