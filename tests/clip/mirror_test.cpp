#include "libmocap/clip/mirror.hpp"

#include <gtest/gtest.h>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/rest_pose.hpp"
#include "motion.hpp"

namespace mocap {
namespace {

Vector3 reflected(const Vector3& v) { return {v.x(), -v.y(), v.z()}; }

// What the mirror shows: every joint where its counterpart's reflection is.
void expect_reflected(const Clip& clip, const Clip& mirrored, double tolerance) {
  const auto pair = counterparts(*clip.skeleton);
  const auto a = test::poses_of(clip), b = test::poses_of(mirrored);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t t = 0; t < a.size(); ++t) {
    for (std::size_t j = 0; j < pair.size(); ++j)
      ASSERT_LT((b[t].positions[j] - reflected(a[t].positions[static_cast<std::size_t>(pair[j])])).norm(), tolerance) << clip.skeleton->joint_names[j] << " frame " << t;
    // End sites as well: twist counts.
    const auto tips = end_site_positions(*clip.skeleton, a[t]), shown = end_site_positions(*clip.skeleton, b[t]);
    for (const Vector3& tip : tips) {
      double nearest = 1e9;
      for (const Vector3& other : shown) nearest = std::min(nearest, (other - reflected(tip)).norm());
      ASSERT_LT(nearest, tolerance);
    }
  }
}

Clip labelled_walk(const std::shared_ptr<const Skeleton>& body, double yaw) {
  Clip clip = test::walk(body, {.seconds = 1, .rate_hz = 30, .yaw = yaw}).clip;
  for (std::size_t t = 0; t < clip.frames(); ++t) clip.contacts.push_back({static_cast<std::uint8_t>(t % 2), static_cast<std::uint8_t>(t % 3 == 0)});
  clip.attributes = {{"action", "walking"}};
  clip.segments = {{0, 10, {{"action", "walking"}}}};
  clip.path = {{0, 1}, {2, -3}};
  return clip;
}

TEST(Mirror, OfTheCanonicalBody) {
  const Clip clip = labelled_walk(canonical_body(), 0.7);
  const Clip once = mirror(clip), twice = mirror(once);
  expect_reflected(clip, once, 1e-12);
  EXPECT_NO_THROW(once.validate());
  EXPECT_TRUE(once.source.mirrored);
  EXPECT_EQ(once.attributes, clip.attributes);
  EXPECT_EQ(once.segments.size(), 1u);
  EXPECT_EQ(once.path[1], Vector2(2, 3));
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    EXPECT_EQ(once.contacts[t][0], clip.contacts[t][1]);
    EXPECT_EQ(once.contacts[t][1], clip.contacts[t][0]);
  }
  EXPECT_FALSE(twice.source.mirrored);
  EXPECT_EQ(twice.contacts, clip.contacts);
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) EXPECT_LT(geodesic_distance(clip.rotations[i], twice.rotations[i]), 1e-12);
  for (std::size_t t = 0; t < clip.frames(); ++t) EXPECT_EQ(twice.root_position[t], clip.root_position[t]);
  // It is not the clip itself.
  double most = 0;
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) most = std::max(most, geodesic_distance(clip.rotations[i], once.rotations[i]));
  EXPECT_GT(most, 0.3);
}

TEST(Mirror, OfARigThatFacesAnotherWayAtRest) {
  for (const double yaw : {0.4, 1.5707963267948966, -2.2}) {
    const Clip clip = test::with_turned_frames(labelled_walk(canonical_body(), 0.3), std::vector<Quaternion>(22, yaw_rotation(yaw)));
    const Clip once = mirror(clip);
    expect_reflected(clip, once, 1e-12);
    const Clip twice = mirror(once);
    for (std::size_t i = 0; i < clip.rotations.size(); ++i) ASSERT_LT(geodesic_distance(clip.rotations[i], twice.rotations[i]), 1e-12);
  }
}

TEST(Mirror, MovesJointsThatMove) {
  Clip clip = test::with_turned_frames(labelled_walk(canonical_body(), 0.3), std::vector<Quaternion>(22, yaw_rotation(0.9)));
  Random random(3, 0);
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t j = 0; j < 22; ++j) clip.translations.push_back(clip.skeleton->rest_offsets[j] + 0.05 * Vector3(random.normal(), random.normal(), random.normal()));
  expect_reflected(clip, mirror(clip), 1e-12);
}

// The one family whose joint frames are turned and known: local X along the bones (skeleton/rest_pose.cpp).
TEST(Mirror, OfARigWithTurnedFrames) {
  const std::map<std::string, std::string> names = {
      {"pelvis", "Hips"},          {"spine1", "Spine"},         {"spine2", "Spine2"},       {"spine3", "Chest"},      {"neck", "Neck"},          {"head", "Head"},
      {"left_hip", "UpperLeg_L"},  {"left_knee", "LowerLeg_L"}, {"left_ankle", "Foot_L"},   {"left_foot", "Toes_L"},  {"left_collar", "Shoulder_L"}, {"left_shoulder", "UpperArm_L"},
      {"left_elbow", "LowerArm_L"}, {"left_wrist", "Hand_L"},   {"right_hip", "UpperLeg_R"}, {"right_knee", "LowerLeg_R"}, {"right_ankle", "Foot_R"},  {"right_foot", "Toes_R"},
      {"right_collar", "Shoulder_R"}, {"right_shoulder", "UpperArm_R"}, {"right_elbow", "LowerArm_R"}, {"right_wrist", "Hand_R"}};
  // The canonical body below a carrier, named like that rig.
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"joint_Root"};
  s->parents = {-1};
  s->rest_offsets = {Vector3::Zero()};
  for (std::size_t j = 0; j < 22; ++j) {
    s->joint_names.push_back(names.at(canonical_body()->joint_names[j]));
    s->parents.push_back(canonical_body()->parents[j] + 1);
    s->rest_offsets.push_back(canonical_body()->rest_offsets[j]);
  }
  for (const auto& e : canonical_body()->end_sites) s->end_sites.push_back({e.parent + 1, e.offset});
  const Clip walk = labelled_walk(canonical_body(), 0.3);
  Clip clip = walk;
  clip.skeleton = s;
  clip.rotations.clear();
  for (std::size_t t = 0; t < walk.frames(); ++t) {
    clip.rotations.push_back(Quaternion::Identity());
    for (const Quaternion& q : walk.frame(t)) clip.rotations.push_back(q);
  }
  // The table needs the names, and shanks and forearms along that rig's X, the right ones backwards; then frames are turned by it.
  Skeleton probe = *s;
  for (const char* bone : {"LowerLeg_", "LowerArm_"})
    for (const char* side : {"L", "R"}) probe.rest_offsets[static_cast<std::size_t>(probe.find(std::string(bone) + side))] = Vector3(0, *side == 'L' ? 0.4 : -0.4, 0);
  const auto turn = t_pose_orientations(probe, map_to_canonical(probe));
  ASSERT_TRUE(turn);
  EXPECT_GT(geodesic_distance(turn->at(17), turn->at(2)), 1);
  const Clip turned = test::with_turned_frames(clip, *turn);
  const auto found = t_pose_orientations(*turned.skeleton, map_to_canonical(*turned.skeleton));
  ASSERT_TRUE(found);
  for (std::size_t j = 0; j < found->size(); ++j) ASSERT_LT(geodesic_distance((*found)[j], (*turn)[j]), 1e-12);
  expect_reflected(turned, mirror(turned), 1e-9);
}

TEST(Mirror, NamesWhatHasNoCounterpart) {
  const auto message = [](const Clip& clip) {
    try {
      mirror(clip);
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const Clip clip = labelled_walk(canonical_body(), 0);
  auto odd = std::make_shared<Skeleton>(*canonical_body());
  odd->joint_names[test::joint(*odd, "right_elbow")] = "right_hook";
  Clip other = clip;
  odd->roles.clear();
  other.skeleton = odd;
  EXPECT_NE(message(other).find("left_elbow"), std::string::npos) << message(other);
  EXPECT_NE(message(other).find("no counterpart"), std::string::npos);
  EXPECT_NE(message(test::with_turned_frames(clip, test::random_turns(4, 22))).find("does not stand"), std::string::npos);
}

TEST(Mirror, CounterpartsByNameAndNumber) {
  Skeleton s;
  const auto add = [&](const char* name, int parent) {
    s.joint_names.emplace_back(name);
    s.parents.push_back(parent);
    s.rest_offsets.emplace_back(0, 0, 0.1);
    return s.joint_count() - 1;
  };
  const int hips = add("Hips", -1), spine = add("L5", hips), left = add("LeftHand", spine), right = add("RightHand", spine);
  const int l1 = add("LeftFinger1", left), l2 = add("LeftFinger2", left), r2 = add("RightFinger2", right), r1 = add("RightFinger1", right);
  const auto pair = counterparts(s);
  EXPECT_EQ(pair[static_cast<std::size_t>(hips)], hips);
  EXPECT_EQ(pair[static_cast<std::size_t>(spine)], spine);
  EXPECT_EQ(pair[static_cast<std::size_t>(left)], right);
  EXPECT_EQ(pair[static_cast<std::size_t>(l1)], r1);
  EXPECT_EQ(pair[static_cast<std::size_t>(r2)], l2);
}

}  // namespace
}  // namespace mocap
