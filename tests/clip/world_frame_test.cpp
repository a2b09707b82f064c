#include "libmocap/clip/world_frame.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/canonicalize.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "motion.hpp"

namespace mocap {
namespace {

// The canonical body standing, in another unit, Y up (facing +Z, left at +X) or Z up.
Clip standing(double units_per_metre, bool y_up, std::size_t frames = 4) {
  auto s = std::make_shared<Skeleton>(*canonical_body());
  const auto convert = [&](const Vector3& v) -> Vector3 { return units_per_metre * (y_up ? Vector3(v.y(), v.z(), v.x()) : v); };
  for (auto& v : s->rest_offsets) v = convert(v);
  for (auto& e : s->end_sites) e.offset = convert(e.offset);
  Clip clip;
  clip.name = "standing";
  clip.skeleton = s;
  for (std::size_t t = 0; t < frames; ++t) {
    for (int j = 0; j < 22; ++j) clip.rotations.push_back(Quaternion::Identity());
    clip.root_position.push_back(convert(Vector3(1, 2, canonical_pelvis_height())));
  }
  return clip;
}

TEST(WorldFrame, UnitAndAxisAreFound) {
  const std::pair<Unit, double> units[] = {{Unit::metre, 1}, {Unit::centimetre, 100}, {Unit::millimetre, 1000}, {Unit::inch, 1 / 0.0254}, {Unit::cmu, 0.45 / 0.0254}};
  for (const auto& [unit, per_metre] : units)
    for (const bool y_up : {false, true}) {
      Clip clip = standing(per_metre, y_up);
      const WorldFrame frame = detect_world_frame(clip, Unit::automatic, UpAxis::automatic);
      EXPECT_EQ(text(frame.unit), text(unit));
      EXPECT_EQ(frame.up == UpAxis::y, y_up);
      EXPECT_TRUE(frame.notes.empty());
      to_metres_z_up(clip, frame);
      EXPECT_TRUE(clip.skeleton->same_as(*canonical_body(), 1e-9));
      EXPECT_LT((clip.root_position[0] - Vector3(1, 2, canonical_pelvis_height())).norm(), 1e-9);
    }
}

TEST(WorldFrame, ForcedValuesWin) {
  const WorldFrame frame = detect_world_frame(standing(100, true), Unit::metre, UpAxis::z);
  EXPECT_EQ(frame.unit, Unit::metre);
  EXPECT_EQ(frame.up, UpAxis::z);
}

TEST(WorldFrame, OddSizesAreDoubted) { EXPECT_FALSE(detect_world_frame(standing(400, true), Unit::automatic, UpAxis::automatic).notes.empty()); }

TEST(WorldFrame, AxesTurnRotationsAlong) {
  Clip clip = standing(1, true);
  const Quaternion nod = exp_map(Vector3(0.3, 0.1, -0.2));
  clip.rotations[15] = nod;
  Pose before, after;
  world_pose(clip, 0, before);
  to_metres_z_up(clip, {Unit::metre, UpAxis::y, 0, {}});
  world_pose(clip, 0, after);
  for (std::size_t j = 0; j < 22; ++j) {
    const Vector3& p = before.positions[j];
    EXPECT_LT((after.positions[j] - Vector3(p.z(), p.x(), p.y())).norm(), 1e-12);
  }
}

TEST(WorldFrame, FaceForwardTurnsTheWholeClip) {
  Clip clip = standing(1, false, 3);
  for (std::size_t t = 0; t < 3; ++t) clip.rotations[t * 22] = yaw_rotation(2 + 0.1 * static_cast<double>(t));
  clip.root_position[2] += Vector3(std::cos(2.0), std::sin(2.0), 0);
  face_forward(clip);
  EXPECT_LT((clip.root_position[0] - Vector3(0, 0, canonical_pelvis_height())).norm(), 1e-12);
  EXPECT_LT((clip.root_position[2] - Vector3(1, 0, canonical_pelvis_height())).norm(), 1e-12);
  EXPECT_NEAR(yaw_of(clip.rotations[2 * 22]), 0.2, 1e-12);
}

// Seen in a mirror, names kept: what a file with left-handed axes holds.
Clip reflected(const Clip& clip, int axis) {
  const auto flip = [&](Vector3 v) {
    v[axis] = -v[axis];
    return v;
  };
  Clip out = clip;
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  for (auto& v : s->rest_offsets) v = flip(v);
  for (auto& e : s->end_sites) e.offset = flip(e.offset);
  out.skeleton = s;
  for (auto& p : out.root_position) p = flip(p);
  for (auto& q : out.rotations) q.vec() = -flip(q.vec());
  return out;
}

Clip without_toes(const Clip& clip) {
  Clip out = clip;
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  s->joint_names[10] = "left_shoe", s->joint_names[11] = "right_shoe";
  s->roles.clear();
  out.skeleton = s;
  return out;
}

bool refused(const Clip& clip) {
  try {
    require_right_handed(clip);
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    EXPECT_NE(std::string(e.what()).find("expected a right-handed file"), std::string::npos) << e.what();
    EXPECT_NE(e.hint().find("reflection"), std::string::npos);
    return true;
  }
  return false;
}

// Every frame the same pose: `turn` of the pelvis, then joints by name.
Clip held(const Quaternion& turn, const std::map<std::string, Vector3>& joints, std::size_t frames = 30) {
  Clip clip = standing(1, false, frames);
  for (std::size_t t = 0; t < frames; ++t) {
    clip.rotations[t * 22] = turn;
    for (const auto& [name, angle] : joints) clip.rotations[t * 22 + test::joint(*clip.skeleton, name)] = exp_map(angle);
  }
  return clip;
}

TEST(WorldFrame, ReflectionsAreRefused) {
  const Clip walk = test::walk(canonical_body(), {.yaw = 0.4}).clip;
  EXPECT_FALSE(refused(walk));
  EXPECT_FALSE(refused(without_toes(walk)));
  for (const int axis : {0, 1, 2}) {
    EXPECT_TRUE(refused(reflected(walk, axis))) << axis;
    EXPECT_TRUE(refused(without_toes(reflected(walk, axis)))) << axis;
    EXPECT_FALSE(refused(reflected(reflected(walk, axis), (axis + 1) % 3))) << axis;  // two reflections are a rotation
  }
  // A single frame at rest, with toes: they point where nobody faces.
  EXPECT_TRUE(refused(reflected(standing(1, false, 1), 1)));
  // Left and right exchanged by name is the same defect.
  Clip exchanged = walk;
  auto s = std::make_shared<Skeleton>(*walk.skeleton);
  for (auto& n : s->joint_names) n = n.starts_with("left_") ? "right_" + n.substr(5) : n.starts_with("right_") ? "left_" + n.substr(6) : n;
  s->roles.clear();
  exchanged.skeleton = s;
  EXPECT_TRUE(refused(exchanged));
  EXPECT_THROW(Canonicalizer{CanonicalizeOptions{}}(reflected(walk, 1)), Error);
}

TEST(WorldFrame, WhatPeopleDoIsNoReflection) {
  const double half = std::numbers::pi / 2;
  EXPECT_FALSE(refused(standing(1, false, 1)));
  EXPECT_FALSE(refused(without_toes(standing(1, false, 1))));
  Clip backwards = test::walk(canonical_body()).clip;
  std::reverse(backwards.root_position.begin(), backwards.root_position.end());
  for (std::size_t t = 0; t < backwards.frames() / 2; ++t) std::swap_ranges(backwards.frame(t).begin(), backwards.frame(t).end(), backwards.frame(backwards.frames() - 1 - t).begin());
  EXPECT_FALSE(refused(backwards));
  EXPECT_FALSE(refused(without_toes(backwards)));
  for (const double side : {-half, half, 2 * half})  // lying on the belly, on the back, on the head
    EXPECT_FALSE(refused(held(Quaternion(Eigen::AngleAxisd(side, Vector3::UnitY())), {}))) << side;
  EXPECT_FALSE(refused(held(Quaternion(Eigen::AngleAxisd(half, Vector3::UnitX())), {{"left_knee", {0, 0.5, 0}}})));  // on a side
  const std::map<std::string, Vector3> kneeling = {{"left_knee", {0, half, 0}}, {"right_knee", {0, half, 0}}, {"left_ankle", {0, 1.2, 0}}, {"right_ankle", {0, 1.2, 0}}};
  const std::map<std::string, Vector3> on_heels = {{"left_hip", {0, -half, 0}}, {"right_hip", {0, -half, 0}}, {"left_knee", {0, 2.6, 0}}, {"right_knee", {0, 2.6, 0}}, {"left_ankle", {0, 0.9, 0}}, {"right_ankle", {0, 0.9, 0}}};
  const std::map<std::string, Vector3> sitting = {{"left_hip", {0, -half, 0}}, {"right_hip", {0, -half, 0}}, {"left_knee", {0, half, 0}}, {"right_knee", {0, half, 0}}};
  const std::map<std::string, Vector3> bent_double = {{"left_hip", {0, -2.2, 0}}, {"right_hip", {0, -2.2, 0}}};
  const std::map<std::string, Vector3> overstretched = {{"left_knee", {0, -0.08, 0}}, {"right_knee", {0, -0.08, 0}}};
  const std::map<std::string, Vector3> turned_out = {{"left_hip", {0, 0, 1.2}}, {"right_hip", {0, 0, -1.2}}};
  for (const auto& [name, pose] : std::map<std::string, std::map<std::string, Vector3>>{
           {"kneeling", kneeling}, {"on the heels", on_heels}, {"sitting", sitting}, {"bent double", bent_double}, {"overstretched", overstretched}, {"turned out", turned_out}}) {
    EXPECT_FALSE(refused(held(Quaternion::Identity(), pose))) << name;
    EXPECT_FALSE(refused(without_toes(held(Quaternion::Identity(), pose)))) << name;
  }
  // Skeletons without a body have no say.
  Clip rope = standing(1, false, 3);
  auto s = std::make_shared<Skeleton>(*rope.skeleton);
  for (std::size_t j = 0; j < 22; ++j) s->joint_names[j] = "link" + std::to_string(j);
  s->roles.clear();
  rope.skeleton = s;
  EXPECT_FALSE(refused(rope));
}

TEST(WorldFrame, CalibrationFramesAreFound) {
  // A T-pose, then somebody moving slowly with the arms down.
  Clip clip = standing(1, false, 60);
  const auto l = static_cast<std::size_t>(canonical_body()->find("left_shoulder")), r = static_cast<std::size_t>(canonical_body()->find("right_shoulder"));
  const auto k = static_cast<std::size_t>(canonical_body()->find("left_knee"));
  const auto pose = [&](std::size_t t) {
    clip.rotations[t * 22 + l] = exp_map(Vector3(-1.4, 0, 0));
    clip.rotations[t * 22 + r] = exp_map(Vector3(1.4, 0, 0));
    clip.rotations[t * 22 + k] = exp_map(Vector3(0, 0.4 + 0.01 * static_cast<double>(t), 0));
  };
  for (std::size_t t = 1; t < 60; ++t) pose(t);
  EXPECT_EQ(calibration_frames(clip), 1u);
  Clip zeros = clip;
  for (std::size_t t = 1; t < 4; ++t)
    for (std::size_t j = 0; j < 22; ++j) zeros.rotations[t * 22 + j] = Quaternion::Identity();
  EXPECT_EQ(calibration_frames(zeros), 4u);
  pose(0);
  EXPECT_EQ(calibration_frames(clip), 0u);
}

TEST(WorldFrame, ARestPoseInFrontIsNoMotionWhateverItLooksLike) {
  // Arms hang at rest; nearly nothing turns but the legs, and many fingers never do.
  auto s = std::make_shared<Skeleton>(*canonical_body());
  for (const char* side : {"left", "right"})
    for (const char* joint : {"_elbow", "_wrist"}) {
      auto& v = s->rest_offsets[static_cast<std::size_t>(s->find(std::string(side) + joint))];
      v = Vector3(0, 0, -v.norm());
    }
  for (int k = 0; k < 40; ++k) {
    s->joint_names.push_back("left_finger" + std::to_string(k));
    s->parents.push_back(s->find("left_wrist"));
    s->rest_offsets.emplace_back(0, 0.05, 0);
  }
  const std::size_t n = s->parents.size();
  Clip clip;
  clip.skeleton = s;
  for (std::size_t t = 0; t < 40; ++t) {
    for (std::size_t j = 0; j < n; ++j) clip.rotations.push_back(Quaternion::Identity());
    clip.root_position.emplace_back(0, 0, 0.9);
    if (t == 0) continue;
    for (const char* joint : {"left_hip", "right_knee", "spine1", "left_shoulder"})
      clip.rotations[t * n + static_cast<std::size_t>(s->find(joint))] = exp_map(Vector3(0, 0.5 + 0.01 * static_cast<double>(t), 0));
  }
  EXPECT_EQ(calibration_frames(clip), 1u);
  // Motion that grows out of the rest pose is motion.
  for (std::size_t t = 1; t < 40; ++t)
    for (const char* joint : {"left_hip", "right_knee", "spine1", "left_shoulder"})
      clip.rotations[t * n + static_cast<std::size_t>(s->find(joint))] = exp_map(Vector3(0, 0.02 * static_cast<double>(t), 0));
  EXPECT_EQ(calibration_frames(clip), 0u);
}

TEST(WorldFrame, WhoLiesCrawlsOrStandsOnTheHandsKeepsTheAxis) {
  for (const bool y_up : {false, true}) {
    const Vector3 left = y_up ? Vector3::UnitX() : Vector3::UnitY(), ahead = y_up ? Vector3::UnitZ() : Vector3::UnitX(), up = y_up ? Vector3::UnitY() : Vector3::UnitZ();
    // The head along Y where Z is up and the other way about: nothing but rest pose and floor tells.
    const Quaternion aside = y_up ? Quaternion::Identity() : Quaternion(Eigen::AngleAxisd(std::numbers::pi / 2, up));
    const auto found = [&](const Quaternion& turn, double height, double step) {
      Clip clip = standing(1, y_up, 40);
      for (std::size_t t = 0; t < 40; ++t) {
        clip.rotations[t * 22] = aside * turn;
        clip.root_position[t] = height * up + (aside * ahead) * (5 + step * static_cast<double>(t));
      }
      return detect_world_frame(clip, Unit::automatic, UpAxis::automatic).up;
    };
    const UpAxis truth = y_up ? UpAxis::y : UpAxis::z;
    EXPECT_EQ(found(Quaternion::Identity(), 0.9, 0.01), truth);
    EXPECT_EQ(found(Quaternion(Eigen::AngleAxisd(std::numbers::pi / 2, left)), 0.12, 0), truth) << "prone";
    EXPECT_EQ(found(Quaternion(Eigen::AngleAxisd(-std::numbers::pi / 2, left)), 0.12, 0), truth) << "supine";
    EXPECT_EQ(found(Quaternion(Eigen::AngleAxisd(1.4, left)), 0.5, 0.05), truth) << "crawling";
    EXPECT_EQ(found(Quaternion(Eigen::AngleAxisd(std::numbers::pi, left)), 1.2, 0), truth) << "on the hands";
  }
  // A rig that rests along Y and is turned upright by its root: what it does says more than how it rests.
  Clip clip = standing(1, true, 40);
  for (std::size_t t = 0; t < 40; ++t) {
    clip.rotations[t * 22] = Quaternion(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitX()));
    clip.root_position[t] = Vector3(2, -4 - 0.05 * static_cast<double>(t), 0.9);
  }
  EXPECT_EQ(detect_world_frame(clip, Unit::automatic, UpAxis::automatic).up, UpAxis::z);
}

TEST(Ground, FloorIsFoundDespiteJumps) {
  Clip clip = standing(1, false, 60);
  for (std::size_t t = 0; t < 60; ++t) {
    clip.root_position[t].z() += 0.37;
    if (t > 20 && t < 40) clip.root_position[t].z() += 0.3 * std::sin((static_cast<double>(t) - 20) / 20 * M_PI);
  }
  EXPECT_NEAR(floor_height(clip), 0.37, 1e-9);
  EXPECT_NEAR(set_on_ground(clip), -0.37, 1e-9);
  const auto contacts = label_contacts(clip, contact_preset("default"));
  EXPECT_EQ(contacts[10][0], 1);
  EXPECT_EQ(contacts[30][0], 0);
  EXPECT_EQ(contacts[30][1], 0);
  EXPECT_EQ(contacts[50][1], 1);
}

TEST(Ground, WhoStandsOnTheHandsIsAboveTheFloor) {
  Clip clip;
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 30;
  for (std::size_t t = 0; t < 60; ++t) {
    for (int j = 0; j < 22; ++j) clip.rotations.push_back(j == 0 ? exp_map(Vector3(0, std::numbers::pi, 0)) : Quaternion::Identity());
    clip.root_position.emplace_back(0, 0, 3);
  }
  set_on_ground(clip);
  Pose pose;
  world_pose(clip, 0, pose);
  double low = 1e9;
  for (const auto& p : pose.positions) low = std::min(low, p.z());
  EXPECT_NEAR(low, 0.05, 1e-6);
}

TEST(Ground, HysteresisAndShortRuns) {
  Clip clip = standing(1, false, 90);
  for (std::size_t t = 0; t < 90; ++t) clip.root_position[t].x() = 2.0 * static_cast<double>(t) / 30;  // sliding at 2 m/s
  auto contacts = label_contacts(clip, contact_preset("default"));
  for (const auto& c : contacts) EXPECT_EQ(c[0] + c[1], 0);
  for (std::size_t t = 30; t < 90; ++t) clip.root_position[t].x() = 2.0;
  clip.root_position[60].x() += 0.03;  // a twitch of two frames is no step
  contacts = label_contacts(clip, contact_preset("default"));
  EXPECT_EQ(contacts[20][0], 0);
  for (std::size_t t = 32; t < 90; ++t) EXPECT_EQ(contacts[t][0], 1) << t;
}

}  // namespace
}  // namespace mocap
