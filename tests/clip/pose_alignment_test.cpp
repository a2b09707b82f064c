#include "libmocap/clip/pose_alignment.hpp"

#include <gtest/gtest.h>

#include "libmocap/clip/canonicalize.hpp"
#include "motion.hpp"

namespace mocap {
namespace {

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

// A walk on the canonical body, on a rig every joint of which has a frame of its own: A_c must undo it.
TEST(PoseAlignment, FindsTheFramesOfARigFromItsMotion) {
  const Clip walk = test::walk(canonical_body(), {.yaw = 0.8}).clip;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto turn = test::random_turns(seed, 22);
    const Clip clip = test::with_turned_frames(walk, turn);
    const JointMap map = map_to_canonical(*clip.skeleton);
    ASSERT_TRUE(map.missing().empty());
    const auto found = alignment_from_motion(clip, map);
    ASSERT_EQ(found.size(), 22u);
    for (std::size_t c = 0; c < 22; ++c) {
      const std::string& name = canonical_body()->joint_names[c];
      const Quaternion error = turn[c] * found[c];  // of A_c, in the canonical joint's frame
      // Toes and hands are as foot and forearm on average: these toes bend by 13 degrees on average.
      const double twist = name.ends_with("_foot") || name.ends_with("_wrist") ? 15 : 4;
      EXPECT_LT(degrees(geodesic_distance(error, Quaternion::Identity())), twist) << name << " seed " << seed;
      // The bone, exactly: to the child whose direction the header names.
      for (const auto& [from, to] : {std::pair<std::string, std::string>{"left_hip", "left_knee"}, {"right_knee", "right_ankle"}, {"left_shoulder", "left_elbow"}, {"right_elbow", "right_wrist"},
                                     {"right_collar", "right_shoulder"}, {"spine1", "spine2"}, {"neck", "head"}})
        if (from == name) {
          const Vector3 bone = clip.skeleton->rest_offsets[test::joint(*clip.skeleton, to)].normalized();
          const Vector3 canonical = canonical_body()->rest_offsets[test::joint(*canonical_body(), to)].normalized();
          EXPECT_LT((found[c] * canonical - bone).norm(), 1e-6) << name;
        }
    }
  }
}

TEST(PoseAlignment, CanonicalizerGivesTheMotionBack) {
  const Clip walk = test::walk(canonical_body(), {.yaw = -2.1}).clip;
  const Clip clip = test::with_turned_frames(walk, test::random_turns(7, 22));
  ASSERT_FALSE(Retargeter::rest_pose_stands(*clip.skeleton));
  const Canonicalizer canonicalize{CanonicalizeOptions{}};
  const auto result = canonicalize(clip);
  ASSERT_EQ(result.clips.size(), 1u);
  ASSERT_FALSE(result.notes.empty());
  EXPECT_NE(result.notes[0].find("from the motion"), std::string::npos);
  const Clip expected = canonicalize(walk).clips.at(0), &got = result.clips[0];
  ASSERT_EQ(got.frames(), expected.frames());
  const auto a = test::poses_of(expected), b = test::poses_of(got);
  double worst = 0, sum = 0;
  for (std::size_t t = 0; t < a.size(); ++t)
    for (std::size_t j = 0; j < 22; ++j) {
      const double d = (a[t].positions[j] - b[t].positions[j]).norm();
      worst = std::max(worst, d), sum += d;
    }
  EXPECT_LT(sum / static_cast<double>(22 * a.size()), 0.01);
  EXPECT_LT(worst, 0.04);
  EXPECT_EQ(got.contacts, expected.contacts);
}

TEST(PoseAlignment, LimbsThatNeverBendAndSingleFramesGetSomething) {
  Clip standing = test::walk(canonical_body(), {.seconds = 0}).clip;
  for (auto& q : standing.rotations) q.setIdentity();
  for (const Clip& c : {test::with_turned_frames(standing, test::random_turns(9, 22)), test::with_turned_frames(test::walk(canonical_body(), {.seconds = 0.02}).clip, test::random_turns(9, 22))}) {
    const auto found = alignment_from_motion(c, map_to_canonical(*c.skeleton));
    const auto turn = test::random_turns(9, 22);
    for (std::size_t k = 0; k < 22; ++k) {
      EXPECT_NEAR(found[k].norm(), 1, 1e-9);
      const std::string& name = canonical_body()->joint_names[k];
      if (c.frames() == 1 && !name.ends_with("_foot")) { EXPECT_LT(degrees(geodesic_distance(turn[k] * found[k], Quaternion::Identity())), 5) << name; }
    }
  }
}

TEST(PoseAlignment, RigsWithoutToesHandsAndClavicles) {
  Clip walk = test::walk(canonical_body()).clip;
  const auto turn = test::random_turns(11, 22);
  const Clip clip = test::with_turned_frames(walk, turn);
  JointMap map = map_to_canonical(*clip.skeleton);
  for (const char* gone : {"left_foot", "right_foot", "left_wrist", "right_wrist", "left_collar", "right_collar", "neck", "head", "spine2"}) map.source[test::joint(*canonical_body(), gone)] = -1;
  const auto found = alignment_from_motion(clip, map);
  for (std::size_t c = 0; c < 22; ++c) {
    const std::string& name = canonical_body()->joint_names[c];
    if (map.source[c] < 0) { EXPECT_TRUE(found[c].isApprox(Quaternion::Identity())) << name; }
    EXPECT_NEAR(found[c].norm(), 1, 1e-9) << name;
    if (name.ends_with("_hip") || name.ends_with("_knee") || name == "pelvis") { EXPECT_LT(degrees(geodesic_distance(turn[c] * found[c], Quaternion::Identity())), 4) << name; }
  }
}

}  // namespace
}  // namespace mocap
