#include "libmocap/clip/retarget.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "libmocap/base/error.hpp"
#include "libmocap/base/random.hpp"
#include "libmocap/clip/canonicalize.hpp"
#include "libmocap/clip/world_frame.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

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

Clip random_pose_clip(const std::shared_ptr<const Skeleton>& s, std::uint64_t seed, double amount) {
  Random random(seed, 0);
  Clip clip;
  clip.name = "c";
  clip.skeleton = s;
  clip.frame_rate_hz = 30;
  for (int t = 0; t < 5; ++t) {
    for (int j = 0; j < s->joint_count(); ++j) clip.rotations.push_back(exp_map(amount * Vector3(random.normal(), random.normal(), random.normal())));
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

TEST(JointMap, KnowsTheNamesOfTheField) {
  const auto check = [](const std::vector<const char*>& names, const std::vector<int>& parents, const std::map<std::string, std::string>& expected) {
    Skeleton s;
    for (const char* n : names) s.joint_names.emplace_back(n);
    s.parents = parents;
    s.rest_offsets.assign(names.size(), Vector3::UnitX());
    const JointMap map = map_to_canonical(s);
    for (const auto& [canonical, name] : expected) {
      const int j = map.source_of(canonical);
      EXPECT_EQ(j < 0 ? std::string("-") : s.joint_names[static_cast<std::size_t>(j)], name) << canonical;
    }
  };
  // cgspeed's CMU: a dummy LHipJoint, three neck joints, LeftShoulder the clavicle.
  check({"Hips", "LHipJoint", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "LowerBack", "Spine", "Spine1", "Neck", "Neck1", "Head", "LeftShoulder", "LeftArm", "LeftForeArm", "LeftHand"},
        {-1, 0, 1, 2, 3, 4, 0, 6, 7, 8, 9, 10, 8, 12, 13, 14},
        {{"left_hip", "LeftUpLeg"}, {"left_knee", "LeftLeg"}, {"left_ankle", "LeftFoot"}, {"left_foot", "LeftToeBase"}, {"left_collar", "LeftShoulder"},
         {"left_shoulder", "LeftArm"}, {"left_elbow", "LeftForeArm"}, {"left_wrist", "LeftHand"}, {"spine1", "LowerBack"}, {"spine2", "Spine"}, {"spine3", "Spine1"}, {"neck", "Neck"}, {"head", "Head"}});
  // Biovision: LeftHip is the thigh, LeftShoulder the upper arm.
  check({"Hips", "LeftHip", "LeftKnee", "LeftAnkle", "Chest", "LeftCollar", "LeftShoulder", "LeftElbow", "LeftWrist", "Neck", "Head"}, {-1, 0, 1, 2, 0, 4, 5, 6, 7, 4, 9},
        {{"left_hip", "LeftHip"}, {"left_knee", "LeftKnee"}, {"left_ankle", "LeftAnkle"}, {"left_foot", "-"}, {"left_collar", "LeftCollar"}, {"left_shoulder", "LeftShoulder"},
         {"left_elbow", "LeftElbow"}, {"left_wrist", "LeftWrist"}, {"spine3", "Chest"}});
  check({"Pelvis", "l_thigh", "l_calf", "l_foot", "l_toe"}, {-1, 0, 1, 2, 3}, {{"left_hip", "l_thigh"}, {"left_knee", "l_calf"}, {"left_ankle", "l_foot"}, {"left_foot", "l_toe"}});
}

TEST(Canonicalize, PutsAnyClipInItsPlace) {
  Clip clip = random_pose_clip(rig(1.2, 0.7, false, kMixamo), 5, 0.1);
  for (auto& p : clip.root_position) p += Vector3(3, 4, 0.3);
  clip.frame_rate_hz = 60;
  const Canonicalizer canonicalize{CanonicalizeOptions{}};
  const Clip out = canonicalize(clip).at(0);
  EXPECT_EQ(out.frame_rate_hz, 30);
  EXPECT_LT(out.root_position[0].head<2>().norm(), 1e-12);
  Pose p;
  world_pose(out, 0, p);
  EXPECT_NEAR(*facing_yaw(*out.skeleton, p), 0, 1e-9);
  EXPECT_NEAR(floor_height(out), 0, 1e-9);
  EXPECT_EQ(out.contacts.size(), out.frames());
  EXPECT_NO_THROW(out.validate());
  // Canonicalising twice changes nothing.
  const Clip again = canonicalize(out).at(0);
  for (std::size_t i = 0; i < out.rotations.size(); ++i) EXPECT_LT(geodesic_distance(out.rotations[i], again.rotations[i]), 1e-9);
}

TEST(Canonicalize, AllPhasesAreClipsOfTheirOwn) {
  Clip clip = random_pose_clip(canonical_body(), 6, 0.1);
  clip.frame_rate_hz = 60;
  CanonicalizeOptions options;
  options.all_phases = true;
  const auto out = Canonicalizer(options)(clip);
  ASSERT_EQ(out.size(), 2u);
  EXPECT_EQ(out[1].name, "c@1");
  EXPECT_EQ(out[0].frames(), 3u);
  EXPECT_EQ(out[1].frames(), 2u);
  options.min_seconds = 1;
  EXPECT_THROW(Canonicalizer{options}(clip), Error);
  options.contacts = "nonsense";
  EXPECT_THROW(Canonicalizer{options}, Error);
}

}  // namespace
}  // namespace mocap
