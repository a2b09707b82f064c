#include "libmocap/clip/foot_pinning.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/skeleton/joint_map.hpp"
#include "motion.hpp"

namespace mocap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const char* const kSides[] = {"left_", "right_"};

std::size_t role(const Clip& clip, const std::string& name) { return static_cast<std::size_t>(clip.skeleton->find_role(name)); }

Clip labelled(Clip clip) {
  clip.contacts = label_contacts(clip, contact_preset("default"));
  return clip;
}

test::Walked labelled_walk(const test::Walk& options = {.seconds = 4, .rate_hz = 30}) {
  test::Walked walked = test::walk(canonical_body(), options);
  walked.clip = labelled(walked.clip);
  return walked;
}

Clip slid(Clip clip, const Vector3& velocity) {
  for (std::size_t t = 0; t < clip.frames(); ++t) clip.root_position[t] += velocity * (static_cast<double>(t) / clip.frame_rate_hz);
  return clip;
}

// Somebody stands with knees bent by `bend`, soles at `height`, both feet down throughout.
Clip standing(std::size_t frames, double bend = 20 * kDegree, double height = 0) {
  Clip clip;
  clip.name = "standing";
  clip.skeleton = canonical_body();
  clip.frame_rate_hz = 30;
  std::vector<Quaternion> local(22, Quaternion::Identity());
  const auto about_y = [](double angle) { return Quaternion(Eigen::AngleAxisd(angle, Vector3::UnitY())); };
  for (const std::string side : kSides) {
    local[role(clip, side + "hip")] = about_y(-bend / 2);
    local[role(clip, side + "knee")] = about_y(bend);
    local[role(clip, side + "ankle")] = about_y(-bend / 2);
  }
  for (std::size_t t = 0; t < frames; ++t) {
    clip.rotations.insert(clip.rotations.end(), local.begin(), local.end());
    clip.root_position.emplace_back(0, 0, 1);
    clip.contacts.push_back({1, 1});
  }
  Pose pose;
  world_pose(clip, 0, pose);
  for (auto& p : clip.root_position) p.z() += height + kAnkleSoleHeight - pose.positions[role(clip, "left_ankle")].z();
  return clip;
}

Vector3 below_ankle(const Clip& clip, const Pose& pose, const std::string& side) {
  const std::size_t ankle = role(clip, side + "ankle");
  return pose.positions[ankle] + pose.rotations[ankle] * Vector3(0, 0, -kAnkleSoleHeight);
}

double knee_bend(const Clip& clip, const Pose& pose, const std::string& side) {
  const auto at = [&](const char* part) { return pose.positions[role(clip, side + part)]; };
  const Vector3 thigh = at("knee") - at("hip"), shank = at("ankle") - at("knee");
  const double angle = std::atan2(thigh.cross(shank).norm(), thigh.dot(shank));
  return thigh.cross(shank).dot(pose.rotations[role(clip, side + "hip")] * Vector3::UnitY()) < 0 ? -angle : angle;
}

double largest_acceleration(const Clip& clip) {
  const auto poses = test::poses_of(clip);
  double most = 0;
  for (std::size_t t = 1; t + 1 < poses.size(); ++t)
    for (std::size_t j = 0; j < poses[t].positions.size(); ++j)
      most = std::max(most, (poses[t + 1].positions[j] - 2 * poses[t].positions[j] + poses[t - 1].positions[j]).norm() * clip.frame_rate_hz * clip.frame_rate_hz);
  return most;
}

double largest_difference(const Clip& a, const Clip& b) {
  const auto p = test::poses_of(a), q = test::poses_of(b);
  double most = 0;
  for (std::size_t t = 0; t < p.size(); ++t)
    for (std::size_t j = 0; j < p[t].positions.size(); ++j) most = std::max(most, (p[t].positions[j] - q[t].positions[j]).norm());
  return most;
}

TEST(FootPinning, FeetThatSlideStandStill) {
  const test::Walked walked = labelled_walk();
  for (const Vector3& velocity : {Vector3(0.15, -0.08, 0), Vector3(-0.2, 0, 0), Vector3(0, 0.2, 0)}) {
    const Clip before = slid(walked.clip, velocity);
    Clip after = before;
    const PinningReport report = pin_feet(after);
    EXPECT_NO_THROW(after.validate());
    EXPECT_EQ(report.unreached, 0u);
    EXPECT_LT(report.largest_miss, 1e-9);
    EXPECT_GE(report.runs, 6u);
    EXPECT_GT(report.largest_correction, 0.03);
    EXPECT_LT(report.largest_correction, 0.12);
    EXPECT_LT(report.largest_root, 0.06);
    const auto a = test::poses_of(before), b = test::poses_of(after);
    std::size_t checked = 0;
    for (std::size_t t = 0; t + 1 < a.size(); ++t)
      for (const std::size_t f : {0, 1}) {
        const std::string side = kSides[f];
        if (!after.contacts[t][f] || !after.contacts[t + 1][f]) continue;
        const std::size_t toe = role(after, side + "foot");
        // Some point of the foot, between the sole below the ankle and the toe base, does not move: the nearest of the line to 0.
        const Vector2 toe_moves = (b[t + 1].positions[toe] - b[t].positions[toe]).head<2>();
        const Vector2 heel_moves = (below_ankle(after, b[t + 1], side) - below_ankle(after, b[t], side)).head<2>(), differ = toe_moves - heel_moves;
        const double share = differ.norm() < 1e-12 ? 0 : std::clamp(-heel_moves.dot(differ) / differ.squaredNorm(), 0.0, 1.0);
        EXPECT_LT((heel_moves + share * differ).norm(), 1e-9) << t << ' ' << side;
        if (walked.on_toes[t][f] && walked.on_toes[t + 1][f]) {
          ++checked;
          EXPECT_LT(toe_moves.norm(), 1e-3) << t << ' ' << side;
        }
      }
    EXPECT_GT(checked, 80u);
    EXPECT_LT(largest_acceleration(after), 1.6 * largest_acceleration(before));
  }
}

TEST(FootPinning, OnlyLegsAndRootHeightChange) {
  const Clip before = slid(labelled_walk().clip, Vector3(0.15, -0.08, 0));
  Clip after = before;
  pin_feet(after);
  std::vector<bool> leg(22, false);
  for (const std::string side : kSides)
    for (const char* part : {"hip", "knee", "ankle"}) leg[role(before, side + part)] = true;
  for (std::size_t i = 0; i < before.rotations.size(); ++i)
    if (!leg[i % 22]) { ASSERT_EQ(before.rotations[i].coeffs(), after.rotations[i].coeffs()); }
  for (std::size_t t = 0; t < before.frames(); ++t) ASSERT_EQ(before.root_position[t].head<2>(), after.root_position[t].head<2>());
  EXPECT_EQ(before.contacts, after.contacts);
  // The feet keep how they are turned, rotations their signs and length.
  const auto a = test::poses_of(before), b = test::poses_of(after);
  for (std::size_t t = 0; t < a.size(); ++t)
    for (const char* foot : {"left_ankle", "right_ankle", "left_foot", "right_foot"}) EXPECT_LT(geodesic_distance(a[t].rotations[role(before, foot)], b[t].rotations[role(after, foot)]), 1e-9);
  for (std::size_t i = 0; i < after.rotations.size(); ++i) {
    EXPECT_NEAR(after.rotations[i].norm(), 1, 1e-12);
    if (i >= 22) { EXPECT_GE(after.rotations[i].dot(after.rotations[i - 22]), 0); }
  }
}

TEST(FootPinning, FramesFarFromContactsAreTheSameBits) {
  Clip before = slid(labelled_walk().clip, Vector3(0.15, -0.08, 0));
  for (std::size_t t = 40; t < before.frames(); ++t) before.contacts[t] = {0, 0};
  Clip after = before;
  pin_feet(after, {.blend_seconds = 0.2});
  EXPECT_NE(before.rotations[22 * 41 + 1].coeffs(), after.rotations[22 * 41 + 1].coeffs());
  for (std::size_t t = 40 + 3 * 6; t < before.frames(); ++t) {
    ASSERT_EQ(before.root_position[t], after.root_position[t]);
    for (std::size_t j = 0; j < 22; ++j) ASSERT_EQ(before.frame(t)[j].coeffs(), after.frame(t)[j].coeffs());
  }
  before.contacts.assign(before.frames(), {0, 0});
  after = before;
  const PinningReport report = pin_feet(after);
  EXPECT_EQ(report.runs + report.frames, 0u);
  for (std::size_t i = 0; i < before.rotations.size(); ++i) ASSERT_EQ(before.rotations[i].coeffs(), after.rotations[i].coeffs());
}

TEST(FootPinning, CleanMotionStays) {
  Clip before = standing(60), after = before;
  pin_feet(after);
  EXPECT_LT(largest_difference(before, after), 1e-9);
  // Knees quite straight do not jump about either.
  before = standing(60, 1e-3), after = before;
  pin_feet(after);
  EXPECT_LT(largest_difference(before, after), 1e-5);
  // A walk whose feet stand where they stand; only where they come down and rise, still labelled, they are held a little longer.
  const test::Walked walked = labelled_walk();
  after = walked.clip;
  const PinningReport report = pin_feet(after);
  EXPECT_LT(report.largest_correction, 0.03);
  const auto a = test::poses_of(walked.clip), b = test::poses_of(after);
  for (std::size_t t = 0; t < a.size(); ++t)
    for (const std::size_t f : {0, 1})
      if (walked.flat[t][f]) { EXPECT_LT((a[t].positions[role(after, kSides[f] + std::string("ankle"))] - b[t].positions[role(after, kSides[f] + std::string("ankle"))]).norm(), 0.004) << t; }
}

TEST(FootPinning, WhatIsOutOfReachIsNotStretchedFor) {
  for (const double speed : {0.3, 1.0}) {
    const Clip before = slid(standing(90), Vector3(speed, 0, 0));
    Clip after = before;
    const PinningReport report = pin_feet(after);
    EXPECT_NO_THROW(after.validate());
    EXPECT_GT(report.unreached, 30u);
    EXPECT_LT(report.unreached, report.frames);
    EXPECT_GT(report.largest_miss, 1.5 * speed - 0.35);
    EXPECT_LE(report.largest_root, 0.06);
    const auto a = test::poses_of(before), b = test::poses_of(after);
    for (std::size_t t = 0; t < b.size(); ++t)
      for (const std::string side : kSides) {
        EXPECT_GT(knee_bend(after, b[t], side), 0);
        EXPECT_LT((a[t].positions[role(after, side + "ankle")] - b[t].positions[role(after, side + "ankle")]).norm(), 0.31);
        // It lets go gently: no faster than it slid.
        if (t > 0) { EXPECT_LT((b[t].positions[role(after, side + "foot")] - b[t - 1].positions[role(after, side + "foot")]).norm(), 1.05 * speed / 30); }
      }
  }
  // As far as the root sinks, legs reach; without it they do not.
  Clip low = slid(standing(60, 4 * kDegree), Vector3(0.1, 0, 0)), high = low;
  const PinningReport sinks = pin_feet(low), stays = pin_feet(high, {.most_root = 0});
  EXPECT_EQ(sinks.unreached, 0u);
  EXPECT_GT(sinks.largest_root, 0.005);
  EXPECT_GT(stays.unreached, 10u);
  EXPECT_EQ(stays.largest_root, 0);
}

TEST(FootPinning, FeetStayAboveTheGround) {
  // Two centimetres deep, with a tremble: at the ground and still. Straight legs keep their knees: the root rises.
  for (const double bend : {20 * kDegree, 3 * kDegree}) {
    Clip before = standing(60, bend, -0.02);
    for (std::size_t t = 0; t < before.frames(); ++t) before.root_position[t].z() += 0.003 * std::sin(static_cast<double>(t));
    Clip after = before;
    pin_feet(after);
    const auto a = test::poses_of(before), b = test::poses_of(after);
    for (std::size_t t = 0; t < b.size(); ++t)
      for (const std::string side : kSides) {
        EXPECT_NEAR(b[t].positions[role(after, side + "foot")].z(), kFootSoleHeight, 2e-4) << t;
        EXPECT_LT(std::abs(knee_bend(after, b[t], side) - knee_bend(before, a[t], side)), 13 * kDegree) << t;
      }
  }
  // Where the floor is a step lower than the ground, feet are not drawn up to it.
  Clip before = standing(60, 20 * kDegree, -0.2), after = before;
  pin_feet(after);
  EXPECT_LT(largest_difference(before, after), 0.06);
  // Neither do they hover by what they tremble, nor come down from where they stand.
  before = standing(60, 20 * kDegree, 0.03);
  for (std::size_t t = 0; t < before.frames(); ++t) before.root_position[t].z() += 0.001 * std::sin(static_cast<double>(t));
  after = before;
  pin_feet(after);
  for (const Pose& pose : test::poses_of(after)) EXPECT_NEAR(pose.positions[role(after, "left_foot")].z(), kFootSoleHeight + 0.03, 2e-4);
}

TEST(FootPinning, AFlatFootThatTurnsIsHeldWhereItTurns) {
  // On the heels: neither heel nor body should be moved to keep the toes where they are.
  Clip before = standing(20);
  for (std::size_t t = 0; t < before.frames(); ++t) {
    const double angle = 60 * kDegree * static_cast<double>(t) / 20;
    for (const char* ankle : {"left_ankle", "right_ankle"}) before.frame(t)[role(before, ankle)] = exp_map(Vector3(0, -10 * kDegree, 0)) * exp_map(Vector3(0, 0, angle));
  }
  Clip after = before;
  pin_feet(after);
  const auto a = test::poses_of(before), b = test::poses_of(after);
  for (std::size_t t = 0; t < a.size(); ++t) EXPECT_LT((a[t].positions[role(after, "left_ankle")] - b[t].positions[role(after, "left_ankle")]).norm(), 0.02) << t;
  EXPECT_GT((b[19].positions[role(after, "left_foot")] - b[0].positions[role(after, "left_foot")]).norm(), 0.09);
}

TEST(FootPinning, RunsCloseToEachOtherJoin) {
  // A label that flickers while the foot slides: each run alone would be centred, with a jump between them.
  Clip before = slid(standing(61), Vector3(0.1, 0, 0));
  before.contacts[30] = before.contacts[31] = {0, 0};
  Clip after = before;
  EXPECT_EQ(pin_feet(after).runs, 4u);
  const auto b = test::poses_of(after);
  const std::size_t toe = role(after, "left_foot");
  EXPECT_LT((b[29].positions[toe] - b[0].positions[toe]).norm(), 1e-9);
  EXPECT_LT((b[60].positions[toe] - b[32].positions[toe]).norm(), 1e-9);
  EXPECT_LT((b[32].positions[toe] - b[29].positions[toe]).norm(), 0.02);  // 0.1 m, each run alone; 0.01 m, not pinned
}

TEST(FootPinning, NothingPopsWhereARunBegins) {
  // Knees bent backwards a little, on and off the ground: put right while down, and gently.
  Clip before = slid(standing(90, -4 * kDegree), Vector3(0.1, 0, 0));
  for (std::size_t t = 0; t < before.frames(); ++t)
    if (t < 30 || t >= 60) before.contacts[t] = {0, 0};
  Clip after = before;
  pin_feet(after);
  const auto a = test::poses_of(before), b = test::poses_of(after);
  EXPECT_GT(knee_bend(after, b[45], "left_"), 0);
  EXPECT_NEAR(knee_bend(after, b[10], "left_"), -4 * kDegree, 1e-9);
  for (std::size_t t = 1; t < b.size(); ++t) {
    const std::size_t knee = role(after, "left_knee"), toe = role(after, "left_foot");
    EXPECT_LT((b[t].positions[knee] - b[t - 1].positions[knee]).norm(), 0.025) << t;
    // Corrections of 5 cm come and go as a foot steps.
    EXPECT_LT((b[t].positions[toe] - b[t - 1].positions[toe]).norm(), 0.02) << t;
  }
  EXPECT_LT(largest_acceleration(after), 12);
}

TEST(FootPinning, TheSameOnARigWithOtherAxes) {
  Clip clip = slid(labelled_walk().clip, Vector3(0.15, -0.08, 0));
  Clip turned = test::with_turned_frames(clip, test::random_turns(7, 22));
  const PinningReport report = pin_feet(clip), other = pin_feet(turned);
  EXPECT_LT(largest_difference(clip, turned), 1e-6);
  EXPECT_NEAR(report.largest_correction, other.largest_correction, 1e-9);
  EXPECT_NO_THROW(turned.validate());
}

// The rig with one more joint halfway down each thigh, which turns along, and joint positions in every frame.
Clip with_twist_joints(const Clip& clip) {
  const Skeleton& s = *clip.skeleton;
  auto rig = std::make_shared<Skeleton>();
  std::vector<int> now(s.parents.size(), -1), from;
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    int parent = s.parents[j] < 0 ? -1 : now[static_cast<std::size_t>(s.parents[j])];
    const bool knee = s.joint_names[j].ends_with("_knee");
    if (knee) {
      rig->joint_names.push_back(s.joint_names[j] + "_twist");
      rig->parents.push_back(parent);
      rig->rest_offsets.emplace_back(s.rest_offsets[j] / 2);
      from.push_back(-1);
      parent = static_cast<int>(rig->parents.size()) - 1;
    }
    now[j] = static_cast<int>(rig->parents.size());
    rig->joint_names.push_back(s.joint_names[j]);
    rig->parents.push_back(parent);
    rig->rest_offsets.emplace_back(knee ? Vector3(s.rest_offsets[j] / 2) : s.rest_offsets[j]);
    from.push_back(static_cast<int>(j));
  }
  for (const auto& e : s.end_sites) rig->end_sites.push_back({now[static_cast<std::size_t>(e.parent)], e.offset});
  rig->roles = s.roles;
  Clip out = clip;
  out.rotations.clear();
  const Quaternion twist = exp_map(Vector3(0, 0, 0.1));
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t j = 0; j < from.size(); ++j) {
      out.rotations.push_back(from[j] < 0 ? twist : clip.frame(t)[static_cast<std::size_t>(from[j])]);
      if (from[j] >= 0 && j > 0 && from[j - 1] < 0) out.rotations.back() = twist.conjugate() * out.rotations.back();
      out.translations.push_back(rig->rest_offsets[j]);
    }
  // Where joints are says `translations`, no longer the rest pose.
  for (std::size_t j = 0; j < from.size(); ++j)
    if (rig->joint_names[j].ends_with("_knee_twist") || rig->joint_names[j].ends_with("_knee")) rig->rest_offsets[j] *= 1.01;
  out.skeleton = rig;
  make_sign_continuous(out);
  return out;
}

TEST(FootPinning, JointsInBetweenAndJointsThatMove) {
  Clip clip = slid(labelled_walk().clip, Vector3(0.15, -0.08, 0));
  Clip rig = with_twist_joints(clip);
  const Clip before = rig;
  pin_feet(clip);
  pin_feet(rig);
  EXPECT_NO_THROW(rig.validate());
  EXPECT_EQ(rig.translations, before.translations);
  const auto a = test::poses_of(clip), b = test::poses_of(rig);
  for (std::size_t t = 0; t < a.size(); ++t)
    for (const auto& [name, joint] : clip.skeleton->roles) EXPECT_LT((a[t].positions[role(clip, name)] - b[t].positions[role(rig, name)]).norm(), 1e-6) << t << ' ' << name;
}

TEST(FootPinning, TheRootStaysWhereLegsLieAlongTheFloor) {
  // On the back with straight legs, heels on the ground and sliding: a higher or lower pelvis would help nobody.
  Clip before = standing(40, 1 * kDegree);
  for (std::size_t t = 0; t < before.frames(); ++t) {
    before.frame(t)[0] = exp_map(Vector3(0, -88 * kDegree, 0));
    before.root_position[t] = Vector3(0.05 * std::sin(static_cast<double>(t) / 5), 0, 0.1);
  }
  Clip after = before;
  const PinningReport report = pin_feet(after);
  EXPECT_EQ(report.largest_root, 0);
  EXPECT_NO_THROW(after.validate());
}

TEST(FootPinning, RigsWithoutToes) {
  Clip before = slid(standing(40), Vector3(0.1, 0, 0));
  auto s = std::make_shared<Skeleton>(*before.skeleton);
  s->roles["left_foot"] = "left_ankle", s->roles["right_foot"] = "right_ankle";
  before.skeleton = s;
  Clip after = before;
  EXPECT_EQ(pin_feet(after).unreached, 0u);
  const auto b = test::poses_of(after);
  for (std::size_t t = 1; t < b.size(); ++t) EXPECT_LT((b[t].positions[role(after, "left_ankle")] - b[0].positions[role(after, "left_ankle")]).norm(), 1e-9);
}

TEST(FootPinning, DoesNotGoByTheWorldsAxes) {
  Clip clip = slid(labelled_walk().clip, Vector3(0.15, -0.08, 0));
  Clip turned = clip;
  const Quaternion turn = yaw_rotation(2.1);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    turned.root_position[t] = turn * clip.root_position[t] + Vector3(3, -4, 0);
    turned.frame(t)[0] = turn * clip.frame(t)[0];
  }
  pin_feet(clip);
  pin_feet(turned);
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    EXPECT_NEAR(clip.root_position[t].z(), turned.root_position[t].z(), 1e-9);
    for (std::size_t j = 1; j < 22; ++j) EXPECT_LT(geodesic_distance(clip.frame(t)[j], turned.frame(t)[j]), 1e-6);
  }
}

TEST(FootPinning, ShortClipsAndOddLegs) {
  for (const std::size_t frames : {1, 2, 3}) {
    Clip clip = slid(standing(frames, 20 * kDegree, -0.01), Vector3(1, 0, 0));
    EXPECT_EQ(pin_feet(clip).frames, 2 * frames);
    EXPECT_NO_THROW(clip.validate());
    Pose pose;
    world_pose(clip, 0, pose);
    EXPECT_NEAR(pose.positions[role(clip, "left_foot")].z(), kFootSoleHeight, 1e-9);
  }
  // One frame at a time, legs without length, thighs pointing up, no time to blend in.
  Clip clip = slid(standing(30, 0, -0.01), Vector3(1, 0, 0));
  for (std::size_t t = 0; t < 30; ++t) clip.contacts[t] = {static_cast<std::uint8_t>(t % 2), static_cast<std::uint8_t>(t % 3 == 0)};
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  for (const char* part : {"left_knee", "left_ankle", "left_foot", "right_foot"}) s->rest_offsets[test::joint(*s, part)].setZero();
  for (const auto& skeleton : {clip.skeleton, std::shared_ptr<const Skeleton>(s)})
    for (const double blend : {0.0, 0.2, 100.0})
      for (const double bend : {0.0, 3.14159, -3.14159, 6.0}) {
        Clip odd = clip;
        odd.skeleton = skeleton;
        for (std::size_t t = 0; t < 30; ++t) odd.frame(t)[role(odd, "left_knee")] = odd.frame(t)[role(odd, "right_hip")] = exp_map(Vector3(0, bend, 0));
        EXPECT_NO_THROW(pin_feet(odd, {.blend_seconds = blend}));
        EXPECT_NO_THROW(odd.validate());
      }
}

TEST(FootPinning, Refusals) {
  const auto refused = [](Clip clip, const std::string& text, Exit status = Exit::data, const PinningOptions& options = {}) {
    try {
      pin_feet(clip, options);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), status);
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
  };
  const Clip clip = standing(5);
  Clip other = clip;
  other.contacts.clear();
  refused(other, "clip standing: no contact labels, expected them for 5 frames");
  other.contacts = {{1, 1}};
  refused(other, "1 frames of contact labels, expected them for 5 frames");
  other = clip;
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  s->roles.erase("right_ankle");
  other.skeleton = s;
  refused(other, "clip standing: a skeleton without the role right_ankle");
  s->roles["right_ankle"] = "left_ankle";
  refused(other, "joint left_ankle as right_ankle, expected it below right_knee");
  const double inf = std::numeric_limits<double>::infinity();
  for (const double x : {-0.1, inf, std::nan("")}) {
    refused(clip, "blend of", Exit::usage, {.blend_seconds = x});
    refused(clip, "root shift of", Exit::usage, {.most_root = x});
  }
}

}  // namespace
}  // namespace mocap
