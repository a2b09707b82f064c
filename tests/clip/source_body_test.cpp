#include "libmocap/clip/source_body.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/canonicalize.hpp"
#include "libmocap/skeleton/joint_map.hpp"
#include "motion.hpp"

namespace mocap {
namespace {

using Notes = std::vector<std::string>;

Clip with_roles(Clip clip) {
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  s->roles = roles_of(*s, map_to_canonical(*s));
  clip.skeleton = s;
  return clip;
}

Clip walk_with_translations(double yaw = 0.4) {
  Clip clip = with_roles(test::walk(canonical_body(), {.seconds = 1, .rate_hz = 30, .yaw = yaw}).clip);
  for (std::size_t t = 0; t < clip.frames(); ++t)
    for (std::size_t j = 0; j < 22; ++j) clip.translations.push_back(clip.skeleton->rest_offsets[j]);
  return clip;
}

// The walk below a root that stays at the origin: its place and heading are the pelvis' own.
Clip carried_walk() {
  const Clip walk = test::walk(canonical_body(), {.seconds = 1, .rate_hz = 30, .yaw = 0.4}).clip;
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"Reference"};
  s->parents = {-1};
  s->rest_offsets = {Vector3::Zero()};
  for (std::size_t j = 0; j < 22; ++j) {
    s->joint_names.push_back(canonical_body()->joint_names[j]);
    s->parents.push_back(canonical_body()->parents[j] + 1);
    s->rest_offsets.push_back(canonical_body()->rest_offsets[j]);
  }
  s->rest_offsets[1] = Vector3(0, 0, 0.9);
  for (const auto& e : canonical_body()->end_sites) s->end_sites.push_back({e.parent + 1, e.offset});
  s->roles = roles_of(*s, map_to_canonical(*s));
  Clip clip;
  clip.name = "carried";
  clip.skeleton = s;
  clip.frame_rate_hz = 30;
  for (std::size_t t = 0; t < walk.frames(); ++t) {
    clip.rotations.push_back(Quaternion::Identity());
    for (const Quaternion& q : walk.frame(t)) clip.rotations.push_back(q);
    clip.root_position.emplace_back(0, 0, 0);
    for (std::size_t j = 0; j < 23; ++j) clip.translations.push_back(j == 1 ? walk.root_position[t] : s->rest_offsets[j]);
  }
  return clip;
}

TEST(SourceBody, OffsetsThatStayBecomeTheRestPose) {
  Clip clip = walk_with_translations();
  // Positions that replace the offsets of the file.
  auto s = std::make_shared<Skeleton>(*clip.skeleton);
  for (auto& v : s->rest_offsets) v *= 0.5;
  clip.skeleton = s;
  Notes notes;
  const Clip out = without_translations(clip, notes);
  EXPECT_TRUE(notes.empty());
  EXPECT_TRUE(out.translations.empty());
  const auto a = test::poses_of(clip), b = test::poses_of(out);
  for (std::size_t t = 0; t < a.size(); ++t)
    for (std::size_t j = 0; j < 22; ++j) EXPECT_LT((a[t].positions[j] - b[t].positions[j]).norm(), 1e-9);
  // Nothing to do is nothing done.
  const Clip same = without_translations(out, notes);
  EXPECT_EQ(same.skeleton, out.skeleton);
}

TEST(SourceBody, AJointThatMovesComesToRestAndOthersStay) {
  Clip clip = walk_with_translations();
  const std::size_t wrist = test::joint(*clip.skeleton, "left_wrist");
  for (std::size_t t = 0; t < clip.frames(); ++t) clip.translations[t * 22 + wrist].y() += 0.02 * (t % 2 == 0 ? 1 : -1);
  Notes notes;
  const Clip out = without_translations(clip, notes);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("joint left_wrist moves by 0.04 m"), std::string::npos) << notes[0];
  const auto a = test::poses_of(clip), b = test::poses_of(out);
  for (std::size_t t = 0; t < a.size(); ++t)
    for (std::size_t j = 0; j < 22; ++j) EXPECT_LT((a[t].positions[j] - b[t].positions[j]).norm(), j == wrist ? 0.021 : 1e-9);
}

TEST(SourceBody, ACarrierIsBroughtAlong) {
  const Clip clip = carried_walk();
  Notes notes;
  const Clip out = without_translations(clip, notes);
  EXPECT_TRUE(notes.empty());
  EXPECT_NO_THROW(out.validate());
  const auto a = test::poses_of(clip), b = test::poses_of(out);
  for (std::size_t t = 0; t < a.size(); ++t) {
    for (std::size_t j = 1; j < 23; ++j) ASSERT_LT((a[t].positions[j] - b[t].positions[j]).norm(), 1e-9) << j;
    // The root tells where the body faces, upright and below it.
    EXPECT_LT((b[t].rotations[0] * Vector3::UnitZ() - Vector3::UnitZ()).norm(), 1e-12);
    EXPECT_NEAR(yaw_of(b[t].rotations[0]), yaw_of(a[t].rotations[1]), 1e-9);
    EXPECT_LT((b[t].positions[0] - b[t].positions[1]).head<2>().norm(), 1e-9);
  }
  EXPECT_EQ(out.skeleton->rest_offsets[1].head<2>().norm(), 0);
}

TEST(SourceBody, OneRigForAll) {
  const Clip clip = with_roles(test::walk(test::body_with({}, 1.2), {.seconds = 1, .rate_hz = 30}).clip);
  Notes notes;
  // The same rig within a tenth of a millimetre: nothing changes.
  auto close = std::make_shared<Skeleton>(*clip.skeleton);
  close->rest_offsets[5].z() += 5e-5;
  Clip out = on_body(clip, close, notes);
  EXPECT_TRUE(notes.empty());
  EXPECT_EQ(out.skeleton, close);
  EXPECT_EQ(out.root_position, clip.root_position);
  // Another size: rotations are kept, travel follows the legs.
  const Clip small = with_roles(test::walk(canonical_body(), {.seconds = 1, .rate_hz = 30}).clip);
  out = on_body(clip, small.skeleton, notes);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("travel scaled by 0.8333"), std::string::npos) << notes[0];
  EXPECT_NEAR(out.source.scale, 1 / 1.2, 1e-12);
  for (std::size_t t = 0; t < clip.frames(); ++t) EXPECT_LT((1.2 * out.root_position[t] - clip.root_position[t]).norm(), 1e-12);
  for (std::size_t i = 0; i < clip.rotations.size(); ++i) EXPECT_EQ(out.rotations[i].coeffs(), clip.rotations[i].coeffs());
}

TEST(SourceBody, ACarriersPlaceIsNoPartOfTheMotion) {
  Notes notes;
  const Clip clip = without_translations(carried_walk(), notes);
  auto body = std::make_shared<Skeleton>(*clip.skeleton);
  body->rest_offsets[1] = Vector3(0.1, -0.2, 0.7);
  const Clip out = on_body(clip, body, notes);
  EXPECT_TRUE(notes.empty());
  const auto a = test::poses_of(clip), b = test::poses_of(out);
  for (std::size_t t = 0; t < a.size(); ++t)
    for (std::size_t j = 1; j < 23; ++j) ASSERT_LT((a[t].positions[j] - b[t].positions[j]).norm(), 1e-9);
}

TEST(SourceBody, NamesTheFirstDifference) {
  const Clip clip = with_roles(test::walk(canonical_body(), {.seconds = 0.1}).clip);
  const std::pair<const char*, std::function<void(Skeleton&)>> changes[] = {
      {"22 joints, expected the 21 of the first input",
       [](Skeleton& s) { s.joint_names.pop_back(), s.parents.pop_back(), s.rest_offsets.pop_back(), s.end_sites.clear(), s.roles.clear(); }},
      {"joint 18 is 'left_elbow', expected 'elbow' as in the first input", [](Skeleton& s) { s.joint_names[18] = "elbow"; }},
      {"joint head hangs on another parent", [](Skeleton& s) { s.parents[15] = 9; }},
      {"joint left_knee lies in another direction", [](Skeleton& s) { s.rest_offsets[4] = Vector3(0.4, 0, 0); }}};
  for (const auto& [text, change] : changes) {
    auto body = std::make_shared<Skeleton>(*clip.skeleton);
    change(*body);
    Notes notes;
    try {
      on_body(clip, body, notes);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
      EXPECT_NE(e.hint().find("--body"), std::string::npos);
    }
  }
  // 19 degrees are the same bone, and so are joints nearly in one place.
  auto body = std::make_shared<Skeleton>(*clip.skeleton);
  body->rest_offsets[4] = exp_map(Vector3(0.33, 0, 0)) * body->rest_offsets[4];
  body->rest_offsets[12] = Vector3(0.005, 0, 0);
  Notes notes;
  EXPECT_NO_THROW(on_body(clip, body, notes));
}

TEST(SourceBody, CanonicalizerKeepsTheRig) {
  Notes notes;
  const Clip walk = with_roles(test::walk(test::body_with({.thigh = 0.9, .shank = 1.1}, 1.1), {.yaw = 2}).clip);
  CanonicalizeOptions options;
  options.body = walk.skeleton;
  const auto result = Canonicalizer(options)(walk);
  ASSERT_EQ(result.clips.size(), 1u);
  const Clip& out = result.clips[0];
  EXPECT_EQ(out.skeleton, walk.skeleton);
  EXPECT_EQ(out.frames(), (walk.frames() + 3) / 4);
  EXPECT_FALSE(result.report);
  for (std::size_t t = 0; t < out.frames(); ++t)
    for (std::size_t j = 1; j < 22; ++j) EXPECT_LT(geodesic_distance(out.frame(t)[j], walk.frame(4 * t)[j]), 1e-9);
  EXPECT_LT(out.root_position[0].head<2>().norm(), 1e-12);
  EXPECT_EQ(out.contacts.size(), out.frames());
}

}  // namespace
}  // namespace mocap
