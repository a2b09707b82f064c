#include "libmocap/clip/retarget.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/clip/canonicalize.hpp"
#include "libmocap/clip/retarget_report.hpp"
#include "libmocap/clip/ground.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/skeleton/rest_pose.hpp"
#include "motion.hpp"

namespace mocap {
namespace {

// The canonical body under other names, with other proportions, joint frames turned by `local` in every joint (a rig
// whose axes are its own), facing `yaw` at rest.
std::shared_ptr<Skeleton> rig(double scale, double yaw, bool arms_down, const std::map<std::string, std::string>& names) {
  auto s = std::make_shared<Skeleton>(*canonical_body());
  s->roles.clear();
  for (auto& n : s->joint_names)
    if (names.contains(n)) n = names.at(n);
  const Quaternion turn = yaw_rotation(yaw);
  for (std::size_t j = 0; j < s->rest_offsets.size(); ++j) {
    Vector3 v = s->rest_offsets[j];
    const std::string& c = canonical_body()->joint_names[j];
    const bool arm = c.ends_with("_elbow") || c.ends_with("_wrist");
    if (arms_down && arm) v = Vector3(0, 0, -v.norm());
    s->rest_offsets[j] = scale * (turn * v);
  }
  return s;
}

const std::map<std::string, std::string> kMixamo = {
    {"pelvis", "mixamorig:Hips"},          {"left_hip", "mixamorig:LeftUpLeg"},     {"right_hip", "mixamorig:RightUpLeg"},   {"left_knee", "mixamorig:LeftLeg"},
    {"right_knee", "mixamorig:RightLeg"},  {"left_ankle", "mixamorig:LeftFoot"},    {"right_ankle", "mixamorig:RightFoot"},  {"left_foot", "mixamorig:LeftToeBase"},
    {"right_foot", "mixamorig:RightToeBase"}, {"spine1", "mixamorig:Spine"},        {"spine2", "mixamorig:Spine1"},          {"spine3", "mixamorig:Spine2"},
    {"neck", "mixamorig:Neck"},            {"head", "mixamorig:Head"},              {"left_collar", "mixamorig:LeftShoulder"}, {"right_collar", "mixamorig:RightShoulder"},
    {"left_shoulder", "mixamorig:LeftArm"}, {"right_shoulder", "mixamorig:RightArm"}, {"left_elbow", "mixamorig:LeftForeArm"}, {"right_elbow", "mixamorig:RightForeArm"},
    {"left_wrist", "mixamorig:LeftHand"},  {"right_wrist", "mixamorig:RightHand"}};

// Any pose, but knees that bend as knees do: legs are reached for (leg_reach.hpp), and a knee bent backwards would be put right.
Clip random_pose_clip(const std::shared_ptr<const Skeleton>& s, std::uint64_t seed, double amount) {
  Random random(seed, 0);
  const JointMap map = map_to_canonical(*s);
  const auto t_pose = t_pose_orientations(*s, map);
  Clip clip;
  clip.name = "c";
  clip.skeleton = s;
  clip.frame_rate_hz = 30;
  for (int t = 0; t < 5; ++t) {
    for (int j = 0; j < s->joint_count(); ++j) clip.rotations.push_back(exp_map(amount * Vector3(random.normal(), random.normal(), random.normal())));
    if (amount > 0 && t_pose)
      for (const char* knee : {"left_knee", "right_knee"}) {
        const auto j = static_cast<std::size_t>(map.source_of(knee));
        const Quaternion bend = exp_map(Vector3(0.1 * random.normal(), 0.3 + amount * std::abs(random.normal()), 0.1 * random.normal()));
        clip.frame(static_cast<std::size_t>(t))[j] = (*t_pose)[j].conjugate() * bend * (*t_pose)[j];
      }
    clip.root_position.emplace_back(random.normal(), random.normal(), 1.0);
  }
  make_sign_continuous(clip);
  return clip;
}

Vector3 bone(const Skeleton& s, const Pose& p, const char* a, const char* b) {
  return (p.positions[static_cast<std::size_t>(s.find(b))] - p.positions[static_cast<std::size_t>(s.find(a))]).normalized();
}

// Every limb bone of the retargeted clip points where the source's points.
void expect_same_directions(const Clip& source, const Clip& result, const std::map<std::string, std::string>& names, double tolerance) {
  const std::pair<const char*, const char*> bones[] = {{"left_hip", "left_knee"},   {"right_knee", "right_ankle"}, {"left_shoulder", "left_elbow"},
                                                       {"right_elbow", "right_wrist"}, {"neck", "head"},           {"right_collar", "right_shoulder"}};
  Pose a, b;
  for (std::size_t t = 0; t < source.frames(); ++t) {
    world_pose(source, t, a);
    world_pose(result, t, b);
    for (const auto& [from, to] : bones)
      EXPECT_NEAR((bone(*source.skeleton, a, names.at(from).c_str(), names.at(to).c_str()) - bone(*result.skeleton, b, from, to)).norm(), 0, tolerance) << from << " frame " << t;
  }
}

TEST(Retarget, SameBodyUnderOtherNamesIsUnchanged) {
  const Clip clip = random_pose_clip(rig(1, 0, false, kMixamo), 1, 0.5);
  const Clip out = Retargeter(clip.skeleton).apply(clip);
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) EXPECT_LT(geodesic_distance(clip.rotations[i], out.rotations[i]), 1e-7) << i;
  for (std::size_t t = 0; t < clip.frames(); ++t) EXPECT_LT((clip.root_position[t] - out.root_position[t]).norm(), 1e-9);
}

// What an exported archive holds: the canonical joints, depth first.
TEST(Retarget, TheCanonicalBodyInAnotherOrderIsUnchanged) {
  std::vector<std::size_t> order;
  const auto children = canonical_body()->children();
  const auto visit = [&](const auto& self, std::size_t j) -> void {
    order.push_back(j);
    for (const int c : children[j]) self(self, static_cast<std::size_t>(c));
  };
  visit(visit, 0);
  auto s = std::make_shared<Skeleton>();
  for (const std::size_t j : order) {
    s->joint_names.push_back(canonical_body()->joint_names[j]);
    const int p = canonical_body()->parents[j];
    s->parents.push_back(p < 0 ? -1 : s->find(canonical_body()->joint_names[static_cast<std::size_t>(p)]));
    s->rest_offsets.push_back(canonical_body()->rest_offsets[j]);
  }
  for (const auto& e : canonical_body()->end_sites) s->end_sites.push_back({s->find(canonical_body()->joint_names[static_cast<std::size_t>(e.parent)]), e.offset});
  // Knees from straight to bent: straight ones as well.
  Clip clip = test::walk(canonical_body(), {.seconds = 2}).clip;
  const auto knee = static_cast<std::size_t>(canonical_body()->find("left_knee"));
  for (std::size_t t = 0; t < clip.frames(); ++t) clip.frame(t)[knee] = exp_map(Vector3(0, 0.001 * static_cast<double>(t % 100), 0));
  make_sign_continuous(clip);
  Clip ordered = clip;
  ordered.skeleton = s;
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t k = 0; k < 22; ++k) ordered.frame(t)[k] = clip.frame(t)[order[k]];
  const Clip out = Retargeter(s).apply(ordered);
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) ASSERT_LT(geodesic_distance(clip.rotations[i], out.rotations[i]), 5e-6) << i;
}

TEST(Retarget, BoneDirectionsFollowAnyRestPose) {
  for (const double yaw : {0.0, 1.0, -2.5})
    for (const bool arms_down : {false, true}) {
      const Clip clip = random_pose_clip(rig(1.1, yaw, arms_down, kMixamo), 2, 0.6);
      const Retargeter retargeter(clip.skeleton);
      EXPECT_NEAR(retargeter.scale(), 1 / 1.1, 1e-9);
      expect_same_directions(clip, retargeter.apply(clip), kMixamo, 1e-6);
    }
}

TEST(Retarget, RestPoseFacesForwardWhateverItsRigFaces) {
  Clip clip = random_pose_clip(rig(1, 2.0, false, kMixamo), 3, 0.0);
  // The rig stands at rest, so it faces yaw 2; retargeted it must face there too, upright.
  const Clip out = Retargeter(clip.skeleton).apply(clip);
  Pose p;
  world_pose(out, 0, p);
  EXPECT_NEAR(*facing_yaw(*out.skeleton, p), 2.0, 1e-9);
  EXPECT_GT((p.rotations[0] * Vector3::UnitZ()).z(), 1 - 1e-12);
}

TEST(Retarget, NamesWhatIsMissing) {
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"Hips", "LeftUpLeg"};
  s->parents = {-1, 0};
  s->rest_offsets = {Vector3::Zero(), Vector3(0, 0.1, -0.1)};
  try {
    Retargeter r(s);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.status(), Exit::data);
    EXPECT_NE(std::string(e.what()).find("left_knee"), std::string::npos);
    EXPECT_EQ(std::string(e.what()).find("left_hip,"), std::string::npos);
  }
}

// --- a walk on bodies of other proportions -------------------------------------------------------------------------

// 2 asin(|a - b| / 2), in degrees, of unit vectors.
double between_deg(const Vector3& a, const Vector3& b) { return 2 * std::asin(std::min(1.0, (a.normalized() - b.normalized()).norm() / 2)) * 180 / std::numbers::pi; }

struct Proportions {
  const char* name;
  test::Legs legs;
  double size;
};
const Proportions kProportions[] = {{"the same", {}, 1},
                                    {"larger", {}, 1.3},
                                    {"long shanks", {.thigh = 0.93, .shank = 1.07}, 0.9},
                                    {"long thighs", {.thigh = 1.08, .shank = 0.92}, 1.1},
                                    {"long feet", {.foot = 1.4}, 1},
                                    {"high ankles", {.ankle_height = 0.11}, 1},
                                    {"short feet, low ankles", {.foot = 0.7, .ankle_height = 0.05}, 1.2},
                                    {"unequal legs", {.right_thigh = 0.97}, 1},
                                    {"all of it", {.thigh = 0.95, .shank = 1.05, .foot = 1.2, .ankle_height = 0.09, .right_thigh = 1.02}, 0.8}};

TEST(Retarget, TrunkAndArmsPointWhereTheSourcePoints) {
  for (const auto& p : kProportions) {
    SCOPED_TRACE(p.name);
    const Clip source = test::walk(test::body_with(p.legs, p.size), {.yaw = 0.7}).clip;
    const Clip out = Retargeter(source.skeleton).apply(source);
    const auto a = test::poses_of(source), b = test::poses_of(out);
    double leg_sum = 0;
    for (std::size_t t = 0; t < a.size(); ++t) {
      const auto angle = [&](const char* from, const char* to) { return between_deg(bone(*source.skeleton, a[t], from, to), bone(*out.skeleton, b[t], from, to)); };
      for (const auto& [from, to] : {std::pair{"spine1", "spine2"}, {"spine2", "spine3"}, {"spine3", "neck"}, {"neck", "head"}, {"left_collar", "left_shoulder"}, {"left_shoulder", "left_elbow"},
                                     {"left_elbow", "left_wrist"}, {"right_shoulder", "right_elbow"}, {"right_elbow", "right_wrist"}, {"left_hip", "right_hip"}})
        ASSERT_LT(angle(from, to), 1e-4) << from << " frame " << t;
      for (const auto& [from, to] : {std::pair{"left_hip", "left_knee"}, {"right_hip", "right_knee"}, {"left_knee", "left_ankle"}, {"right_knee", "right_ankle"}}) leg_sum += angle(from, to) / 4;
    }
    // Legs bend where feet stand: within what is asked of retargeting, and not at all where the legs are the canonical ones.
    EXPECT_LT(leg_sum / static_cast<double>(a.size()), 3.0);
    if (std::string(p.name) == "the same" || std::string(p.name) == "larger") { EXPECT_LT(leg_sum / static_cast<double>(a.size()), 1e-3); }
  }
}

TEST(Retarget, FeetThatStandStandStill) {
  for (const auto& p : kProportions) {
    SCOPED_TRACE(p.name);
    const auto walked = test::walk(test::body_with(p.legs, p.size), {.yaw = -1.1});
    const Clip out = Retargeter(walked.clip.skeleton).apply(walked.clip);
    const auto a = test::poses_of(walked.clip), b = test::poses_of(out);
    for (const std::size_t k : {0, 1}) {
      const std::size_t ankle = test::joint(*out.skeleton, k == 0 ? "left_ankle" : "right_ankle"), toe = test::joint(*out.skeleton, k == 0 ? "left_foot" : "right_foot");
      const auto moved = [&](const std::vector<Pose>& poses, std::size_t t, std::size_t j) { return (poses[t].positions[j] - poses[t - 1].positions[j]).head<2>().norm() * out.frame_rate_hz; };
      double ankle_sum = 0, toe_sum = 0, source_sum = 0, lowest = 1e9, highest = -1e9;
      std::size_t flat = 0, standing = 0;
      for (std::size_t t = 1; t < a.size(); ++t) {
        if (walked.flat[t][k] && walked.flat[t - 1][k]) {
          ++flat, ankle_sum += moved(b, t, ankle);
          lowest = std::min(lowest, b[t].positions[toe].z()), highest = std::max(highest, b[t].positions[toe].z());
        }
        if (walked.on_toes[t][k] && walked.on_toes[t - 1][k]) ++standing, toe_sum += moved(b, t, toe), source_sum += moved(a, t, toe);
      }
      ASSERT_GT(flat, 100u);
      ASSERT_GT(standing, flat + 50);
      EXPECT_LT(source_sum / static_cast<double>(standing), 1e-9);
      EXPECT_LT(ankle_sum / static_cast<double>(flat), 0.005) << "flat, side " << k;
      EXPECT_LT(toe_sum / static_cast<double>(standing), 0.005) << "heel rising, side " << k;
      EXPECT_LT(highest - lowest, 0.005) << "side " << k;
    }
  }
}

TEST(Retarget, KneesBendForwardsAndTravelFitsTheLegs) {
  for (const auto& p : kProportions) {
    SCOPED_TRACE(p.name);
    const Clip source = test::walk(test::body_with(p.legs, p.size)).clip;
    const Retargeter retargeter(source.skeleton);
    const Clip out = retargeter.apply(source);
    EXPECT_NO_THROW(out.validate());
    EXPECT_NEAR(out.source.scale, retargeter.scale(), 1e-15);
    for (std::size_t t = 0; t < out.frames(); ++t)
      for (const char* knee : {"left_knee", "right_knee"}) EXPECT_GT(log_map(out.frame(t)[test::joint(*out.skeleton, knee)]).y(), -1e-9);
    const double there = (source.root_position.back() - source.root_position.front()).x(), ours = (out.root_position.back() - out.root_position.front()).x();
    EXPECT_NEAR(ours, retargeter.scale() * there, 0.01 * std::abs(ours));
  }
}

TEST(Retarget, LegsOfUnequalLengthBendAsTheyDid) {
  const Clip source = test::walk(test::body_with({.right_thigh = 0.94})).clip;
  const Clip out = Retargeter(source.skeleton).apply(source);
  for (const char* knee : {"left_knee", "right_knee"}) {
    double sum = 0;
    const std::size_t j = test::joint(*out.skeleton, knee);
    for (std::size_t t = 0; t < out.frames(); ++t) sum += log_map(out.frame(t)[j]).y() - log_map(source.frame(t)[j]).y();
    EXPECT_NEAR(sum / static_cast<double>(out.frames()) * 180 / std::numbers::pi, 0, 1) << knee;
  }
}

TEST(Retarget, JointsBetweenPartsDoNotHideWhereTheNextOneIs) {
  // A divided thigh whose halves turn against each other, and a second neck joint.
  const Clip walk = test::walk(canonical_body()).clip;
  auto s = std::make_shared<Skeleton>();
  std::vector<int> of(22);
  std::vector<std::pair<int, int>> extra;  // joint, the one above
  for (std::size_t j = 0; j < 22; ++j) {
    const std::string& name = canonical_body()->joint_names[j];
    int parent = canonical_body()->parents[j] < 0 ? -1 : of[static_cast<std::size_t>(canonical_body()->parents[j])];
    Vector3 offset = canonical_body()->rest_offsets[j];
    if (name.ends_with("_knee") || name == "head") {
      s->joint_names.push_back((name == "head" ? std::string("neck") : name.substr(0, name.find('_')) + "_hip") + "_twist");
      s->parents.push_back(parent);
      s->rest_offsets.push_back(offset *= 0.5);
      extra.emplace_back(s->joint_count() - 1, parent);
      parent = s->joint_count() - 1;
    }
    s->joint_names.push_back(name);
    s->parents.push_back(parent);
    s->rest_offsets.push_back(offset);
    of[j] = s->joint_count() - 1;
  }
  Clip clip = walk;
  clip.skeleton = s;
  clip.rotations.assign(walk.frames() * s->parents.size(), Quaternion::Identity());
  for (std::size_t t = 0; t < walk.frames(); ++t) {
    for (std::size_t j = 0; j < 22; ++j) clip.frame(t)[static_cast<std::size_t>(of[j])] = walk.frame(t)[j];
    for (const auto& [joint, above] : extra) clip.frame(t)[static_cast<std::size_t>(joint)] = exp_map(Vector3(0, 0.15 * std::sin(0.1 * static_cast<double>(t)), 0));
  }
  const Clip out = Retargeter(clip.skeleton).apply(clip);
  const auto a = test::poses_of(clip), b = test::poses_of(out);
  for (std::size_t t = 0; t < a.size(); ++t) EXPECT_LT(between_deg(bone(*clip.skeleton, a[t], "neck", "head"), bone(*out.skeleton, b[t], "neck", "head")), 1e-4);
  double sum = 0;
  for (std::size_t t = 0; t < a.size(); ++t) sum += between_deg(bone(*clip.skeleton, a[t], "left_hip", "left_knee"), bone(*out.skeleton, b[t], "left_hip", "left_knee"));
  EXPECT_LT(sum / static_cast<double>(a.size()), 3);
}

TEST(Retarget, TheReportIsWhatOneMeasures) {
  const Clip source = test::walk(test::body_with({.thigh = 0.9, .shank = 1.1, .foot = 1.3, .right_thigh = 1.05}, 1.1), {.yaw = 0.6}).clip;
  const Retargeter retargeter(source.skeleton);
  Clip out = retargeter.apply(source);
  set_on_ground(out);
  face_forward(out);
  const RetargetReport report = report_retargeting(retargeter, source, out);
  const auto a = test::poses_of(source), b = test::poses_of(out);
  const Quaternion back = yaw_rotation(out.source.yaw);
  ASSERT_EQ(report.bones.size(), 21u);
  for (const auto& r : report.bones) {
    double sum = 0, worst = 0;
    for (std::size_t t = 0; t < a.size(); ++t) {
      const double angle = between_deg(bone(*source.skeleton, a[t], r.joint.c_str(), r.child.c_str()), back * bone(*out.skeleton, b[t], r.joint.c_str(), r.child.c_str()));
      sum += angle, worst = std::max(worst, angle);
      if (t == r.worst_frame) { EXPECT_NEAR(angle, r.worst_deg, 1e-6); }
    }
    EXPECT_NEAR(r.mean_deg, sum / static_cast<double>(a.size()), 1e-6) << r.joint;
    EXPECT_NEAR(r.worst_deg, worst, 1e-6) << r.joint;
    EXPECT_EQ(r.source_joint, r.joint);
  }
  for (const auto& foot : report.feet) {
    const std::size_t j = test::joint(*out.skeleton, foot.joint), i = test::joint(*source.skeleton, foot.joint);
    double sum = 0;
    std::size_t still = 0;
    for (std::size_t t = 1; t < a.size(); ++t) {
      const Vector3 theirs = retargeter.scale() * (a[t].positions[i] - a[t - 1].positions[i]) * source.frame_rate_hz;
      if (theirs.norm() >= RetargetReport::kStillFoot) continue;
      ++still;
      sum += (back * (b[t].positions[j] - b[t - 1].positions[j]) * source.frame_rate_hz - theirs).head<2>().norm();
    }
    EXPECT_EQ(foot.still_frames, still);
    EXPECT_GT(still, 200u);
    EXPECT_NEAR(foot.added_slide_mps, sum / static_cast<double>(still), 1e-9);
  }
  // A foot dragged along is seen.
  for (std::size_t t = 0; t < out.frames(); ++t) out.root_position[t].x() += 0.05 * static_cast<double>(t) / out.frame_rate_hz;
  EXPECT_NEAR(report_retargeting(retargeter, source, out).feet[0].added_slide_mps, 0.05, 0.005);
}

TEST(Retarget, TheReportNamesAnklesWhereThereAreNoToes) {
  auto s = std::make_shared<Skeleton>(*canonical_body());
  s->joint_names[test::joint(*s, "left_foot")] = "left_tip";
  s->joint_names[test::joint(*s, "right_foot")] = "right_tip";
  s->roles.clear();
  Clip source = test::walk(canonical_body()).clip;
  source.skeleton = s;
  const Retargeter retargeter(source.skeleton);
  EXPECT_EQ(retargeter.map().source_of("left_foot"), -1);
  const RetargetReport report = report_retargeting(retargeter, source, retargeter.apply(source));
  EXPECT_EQ(report.feet[0].joint, "left_ankle");
  EXPECT_EQ(report.bones.size(), 19u);
  EXPECT_GT(report.feet[1].still_frames, 50u);
  EXPECT_LT(report.feet[1].added_slide_mps, 0.005);
}

TEST(Retarget, PointsFindTheirWayBackIntoTheSourcesWorld) {
  const Clip source = test::walk(test::body_with({}, 1.25), {.yaw = 2.2}).clip;
  Clip out = Retargeter(source.skeleton).apply(source);
  for (const int stage : {0, 1, 2}) {
    if (stage == 1) set_on_ground(out);
    if (stage == 2) face_forward(out);
    const auto a = test::poses_of(source), b = test::poses_of(out);
    for (std::size_t t = 0; t < a.size(); t += 7)
      for (std::size_t j = 0; j < 22; ++j)
        ASSERT_LT((out.source.scale * a[t].positions[j] - (yaw_rotation(out.source.yaw) * b[t].positions[j] + out.source.origin)).norm(), 1e-6) << stage << " " << j;
  }
  EXPECT_NEAR(out.source.scale, 0.8, 1e-12);
  EXPECT_NEAR(std::abs(out.source.yaw), 2.2, 0.1);
  // The same through the whole chain, and once more over what came out.
  const Canonicalizer canonicalize{CanonicalizeOptions{}};
  Clip whole = canonicalize(source).clips.at(0);
  for (const int round : {0, 1}) {
    if (round == 1) {
      for (std::size_t t = 0; t < whole.frames(); ++t) {
        whole.root_position[t] = yaw_rotation(0.5) * whole.root_position[t] + Vector3(1, 2, 0.2);
        whole.rotations[t * 22] = yaw_rotation(0.5) * whole.rotations[t * 22];
      }
      // The clip was turned by 0.5 and moved: source.yaw and origin are to say so before it is canonicalised again.
      whole.source.yaw -= 0.5;
      whole.source.origin -= yaw_rotation(whole.source.yaw) * Vector3(1, 2, 0.2);
      whole = canonicalize(whole).clips.at(0);
    }
    const auto a = test::poses_of(source), b = test::poses_of(whole);
    for (std::size_t t = 0; t < b.size(); ++t)
      for (std::size_t j = 0; j < 22; ++j)
        ASSERT_LT((whole.source.scale * a[4 * t].positions[j] - (yaw_rotation(whole.source.yaw) * b[t].positions[j] + whole.source.origin)).norm(), 1e-6) << round;
  }
}

TEST(Retarget, RestPosesThatDoNotStandAreRefused) {
  const Clip walk = test::walk(canonical_body(), {.seconds = 0.1}).clip;
  const Clip clip = test::with_turned_frames(walk, test::random_turns(5, 22));
  EXPECT_FALSE(Retargeter::rest_pose_stands(*clip.skeleton));
  EXPECT_TRUE(Retargeter::rest_pose_stands(*canonical_body()));
  EXPECT_THROW(Retargeter{clip.skeleton}, Error);
  EXPECT_NO_THROW(Retargeter(clip.skeleton, clip));
  CanonicalizeOptions options;
  options.alignment = Alignment::rest;
  EXPECT_THROW(Canonicalizer{options}(clip), Error);
  options.alignment = Alignment::motion;
  EXPECT_NO_THROW(Canonicalizer{options}(clip));
  auto flat = std::make_shared<Skeleton>(*canonical_body());
  for (const char* j : {"left_knee", "right_knee", "left_ankle", "right_ankle"}) flat->rest_offsets[test::joint(*flat, j)].setZero();
  EXPECT_THROW(Retargeter(flat, walk), Error);
}

TEST(Canonicalize, PutsAnyClipInItsPlace) {
  Clip clip = random_pose_clip(rig(1.2, 0.7, false, kMixamo), 5, 0.1);
  for (auto& p : clip.root_position) p += Vector3(3, 4, 0.3);
  clip.frame_rate_hz = 60;
  clip.attribute_probability = {{"action", {{"walking", 0.5f}}}};
  const Canonicalizer canonicalize{CanonicalizeOptions{}};
  const Clip out = canonicalize(clip).clips.at(0);
  EXPECT_EQ(out.attribute_probability, clip.attribute_probability) << "through retargeting and resampling";
  EXPECT_EQ(out.frame_rate_hz, 30);
  EXPECT_LT(out.root_position[0].head<2>().norm(), 1e-12);
  Pose p;
  world_pose(out, 0, p);
  EXPECT_NEAR(*facing_yaw(*out.skeleton, p), 0, 1e-9);
  EXPECT_NEAR(floor_height(out), 0, 1e-9);
  EXPECT_EQ(out.contacts.size(), out.frames());
  EXPECT_NO_THROW(out.validate());
  // Canonicalising twice changes nothing.
  const Clip again = canonicalize(out).clips.at(0);
  for (std::size_t i = 0; i < out.rotations.size(); ++i) EXPECT_LT(geodesic_distance(out.rotations[i], again.rotations[i]), 1e-9);
}

TEST(Canonicalize, AllPhasesAreClipsOfTheirOwn) {
  Clip clip = random_pose_clip(canonical_body(), 6, 0.1);
  clip.frame_rate_hz = 60;
  CanonicalizeOptions options;
  options.all_phases = true;
  const auto out = Canonicalizer(options)(clip).clips;
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[1].name, "c@1");
  EXPECT_EQ(out[0].frames(), 3u);
  EXPECT_EQ(out[1].frames(), 2u);
  options.min_seconds = 1;
  EXPECT_THROW(Canonicalizer{options}(clip), Error);
  options.contacts = "nonsense";
  EXPECT_THROW(Canonicalizer{options}, Error);
}

TEST(Canonicalize, MirroredCopiesFollowTheirClips) {
  CanonicalizeOptions options;
  options.mirror = true;
  options.all_phases = true;
  Clip walk = test::walk(canonical_body(), {.seconds = 1, .rate_hz = 60}).clip;
  const auto out = Canonicalizer(options)(walk).clips;
  ASSERT_EQ(out.size(), 4u);
  EXPECT_EQ(out[0].name, "walk");
  EXPECT_EQ(out[1].name, "walk@m");
  EXPECT_EQ(out[3].name, "walk@1@m");
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(out[k].source.mirrored, k % 2 == 1);
  for (std::size_t t = 0; t < out[0].frames(); ++t) EXPECT_EQ(out[1].contacts[t][0], out[0].contacts[t][1]);
  EXPECT_LT(out[1].root_position[0].head<2>().norm(), 1e-12);
  Pose pose;
  world_pose(out[1], 0, pose);
  EXPECT_NEAR(*facing_yaw(*out[1].skeleton, pose), 0, 1e-9);
}

TEST(Canonicalize, ReportsWhatRetargetingDid) {
  const Canonicalizer canonicalize{CanonicalizeOptions{}};
  const Clip walk = test::walk(test::body_with({.thigh = 1.05}), {}).clip;
  EXPECT_FALSE(canonicalize(walk).report);
  const auto result = canonicalize(walk, true);
  ASSERT_TRUE(result.report);
  EXPECT_EQ(result.report->bones.size(), 21u);
  EXPECT_LT(result.report->feet[0].added_slide_mps, 0.005);
  EXPECT_FALSE(canonicalize(test::walk(canonical_body()).clip, true).report);  // nothing was retargeted
}

}  // namespace
}  // namespace mocap
