#include "libmocap/clip/clip.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

Clip sample() {
  auto s = std::make_shared<Skeleton>();
  s->joint_names = {"root", "tip"};
  s->parents = {-1, 0};
  s->rest_offsets = {{0, 0, 0}, {0, 0, 1}};
  Clip c;
  c.name = "walk";
  c.skeleton = s;
  c.frame_rate_hz = 10;
  for (int t = 0; t < 6; ++t) {
    c.root_position.emplace_back(t, 0, 0);
    for (int j = 0; j < 2; ++j) {
      c.rotations.push_back(exp_map({0.1 * t, 0.2 * j, 0}));
      c.translations.emplace_back(0, 0, 1 + t + 10 * j);
    }
    c.contacts.push_back({static_cast<std::uint8_t>(t % 2), 1});
  }
  c.attributes = {{"action", "walking"}};
  c.source = {"walk.bvh", "aa", 2.0, 2.5, 120, 3, true, "cm", "y"};
  c.segments = {{0, 3, {{"action", "walking"}}}, {3, 3, {{"action", "jogging"}}}};
  c.path = {{0, 0}, {5, 0}};
  return c;
}

TEST(Clip, CountsFramesJointsAndSeconds) {
  const Clip c = sample();
  EXPECT_EQ(c.frames(), 6u);
  EXPECT_EQ(c.joints(), 2);
  EXPECT_DOUBLE_EQ(c.seconds(), 0.5);
  EXPECT_EQ(c.frame(2).data(), &c.rotations[4]);
  EXPECT_EQ(Clip().seconds(), 0);
  EXPECT_EQ(Clip().joints(), 0);
  EXPECT_NO_THROW(c.validate());
}

TEST(Clip, OptionalPartsMayBeMissing) {
  Clip c = sample();
  c.translations.clear();
  c.contacts.clear();
  c.segments.clear();
  c.path.clear();
  EXPECT_NO_THROW(c.validate());
}

TEST(Clip, ValidateNamesEachViolation) {
  const double nan = std::nan(""), infinity = HUGE_VAL;
  const std::vector<std::pair<std::string, std::function<void(Clip&)>>> violations = {
      {"no skeleton", [](Clip& c) { c.skeleton = nullptr; }},
      {"frame rate", [](Clip& c) { c.frame_rate_hz = 0; }},
      {"frame rate", [](Clip& c) { c.frame_rate_hz = -30; }},
      {"frame rate", [=](Clip& c) { c.frame_rate_hz = nan; }},
      {"frame rate", [=](Clip& c) { c.frame_rate_hz = infinity; }},
      {"0 frames", [](Clip& c) { c.root_position.clear(); }},
      {"11 rotations, expected 6 frames x 2 joints", [](Clip& c) { c.rotations.pop_back(); }},
      {"12 rotations, expected 5 frames", [](Clip& c) { c.root_position.pop_back(); }},
      {"5 contact rows, expected 6", [](Clip& c) { c.contacts.pop_back(); }},
      {"11 translations, expected 12", [](Clip& c) { c.translations.pop_back(); }},
      {"frame 4: a root position", [=](Clip& c) { c.root_position[4].y() = nan; }},
      {"frame 3 joint tip: a quaternion", [](Clip& c) { c.rotations[7].coeffs() *= 1.01; }},
      {"frame 0 joint root: a quaternion", [=](Clip& c) { c.rotations[0].w() = nan; }},
      {"frame 5 joint root: a quaternion", [](Clip& c) { c.rotations[10].coeffs().setZero(); }},
      {"translation", [=](Clip& c) { c.translations[9].x() = infinity; }},
      {"path", [=](Clip& c) { c.path[1].x() = nan; }},
      {"segment 1", [](Clip& c) { c.segments[1].length = 4; }},
      {"segment 0", [](Clip& c) { c.segments[0].start = -1; }},
      {"segment 1", [](Clip& c) { c.segments[1].length = -1; }},
      {"segment 1", [](Clip& c) { c.segments[1].start = 7; c.segments[1].length = 0; }},
      {"segment 0", [](Clip& c) { c.segments[0] = {INT64_MAX, INT64_MAX, {}}; }},
  };
  for (const auto& [text, damage] : violations) {
    Clip c = sample();
    damage(c);
    try {
      c.validate("f.h5");
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      EXPECT_EQ(std::string(e.what()).rfind("f.h5:clip walk", 0), 0u) << e.what();
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
  }
}

TEST(Clip, WorldPoseUsesTranslationsWhereThereAre) {
  Clip c = sample();
  Pose pose;
  world_pose(c, 3, pose);
  EXPECT_LT((pose.positions[1] - (c.root_position[3] + c.rotations[6] * Vector3(0, 0, 14))).norm(), 1e-14);
  c.translations.clear();
  world_pose(c, 3, pose);
  EXPECT_LT((pose.positions[1] - (c.root_position[3] + c.rotations[6] * Vector3(0, 0, 1))).norm(), 1e-14);
}

TEST(Clip, WithoutFramesIsAllThatFramesDoNotDecide) {
  Clip c = sample();
  c.attribute_probability = {{"action", {{"walking", 0.75f}, {"jogging", 0.25f}}}};
  Clip out = without_frames(c);
  EXPECT_EQ(out.frames(), 0u);
  EXPECT_TRUE(out.rotations.empty() && out.translations.empty() && out.contacts.empty() && out.segments.empty());
  EXPECT_EQ(out.name, "walk");
  EXPECT_EQ(out.skeleton, c.skeleton);
  EXPECT_EQ(out.frame_rate_hz, 10);
  EXPECT_EQ(out.attributes, c.attributes);
  EXPECT_EQ(out.attribute_probability, c.attribute_probability);
  EXPECT_EQ(out.path.size(), 2u);
  EXPECT_EQ(out.source.path, "walk.bvh");
  EXPECT_EQ(out.source.phase, 3);
  EXPECT_TRUE(out.source.mirrored);
  EXPECT_EQ(cut(c, 1, 2).attribute_probability, c.attribute_probability);
}

TEST(Cut, TakesTheFramesAndMovesTheRest) {
  const Clip c = sample(), part = cut(c, 2, 3);
  EXPECT_EQ(part.frames(), 3u);
  EXPECT_NO_THROW(part.validate());
  for (std::size_t t = 0; t < 3; ++t) {
    EXPECT_EQ(part.root_position[t], c.root_position[t + 2]);
    EXPECT_EQ(part.contacts[t], c.contacts[t + 2]);
    for (std::size_t j = 0; j < 2; ++j) {
      EXPECT_EQ(part.rotations[t * 2 + j].coeffs(), c.rotations[(t + 2) * 2 + j].coeffs());
      EXPECT_EQ(part.translations[t * 2 + j], c.translations[(t + 2) * 2 + j]);
    }
  }
  EXPECT_EQ(part.name, "walk");
  EXPECT_EQ(part.attributes, c.attributes);
  EXPECT_EQ(part.path, c.path);
  EXPECT_EQ(part.source.path, "walk.bvh");
  EXPECT_EQ(part.source.phase, 3);
  EXPECT_TRUE(part.source.mirrored);
  EXPECT_DOUBLE_EQ(part.source.start_s, 2.2);
  EXPECT_DOUBLE_EQ(part.source.end_s, 2.4);
  ASSERT_EQ(part.segments.size(), 2u);
  EXPECT_EQ(part.segments[0].start, 0);
  EXPECT_EQ(part.segments[0].length, 1);
  EXPECT_EQ(part.segments[1].start, 1);
  EXPECT_EQ(part.segments[1].length, 2);
  EXPECT_EQ(part.segments[1].attributes.at("action"), "jogging");
}

TEST(Cut, DropsSegmentsOutsideAndKeepsEmptyPartsEmpty) {
  Clip c = sample();
  c.contacts.clear();
  c.translations.clear();
  const Clip part = cut(c, 0, 2);
  EXPECT_EQ(part.segments.size(), 1u);
  EXPECT_TRUE(part.contacts.empty());
  EXPECT_TRUE(part.translations.empty());
  EXPECT_EQ(cut(c, 6, 0).frames(), 0u);
  EXPECT_EQ(cut(c, 0, 6).rotations.size(), 12u);
}

TEST(Cut, RefusesFramesOutOfRange) {
  const Clip c = sample();
  EXPECT_THROW(cut(c, 7, 0), Error);
  EXPECT_THROW(cut(c, 0, 7), Error);
  EXPECT_THROW(cut(c, 3, 4), Error);
  EXPECT_THROW(cut(c, 1, ~std::size_t{0}), Error);
}

TEST(Clip, SignContinuityCoversEveryJoint) {
  Clip c = sample();
  for (std::size_t i = 0; i < c.rotations.size(); i += 3) c.rotations[i].coeffs() *= -1;
  const Clip before = c;
  make_sign_continuous(c);
  for (std::size_t i = 0; i < c.rotations.size(); ++i) {
    if (i >= 2) {
      EXPECT_GT(c.rotations[i].dot(c.rotations[i - 2]), 0);
    }
    EXPECT_NEAR(std::abs(c.rotations[i].dot(before.rotations[i])), 1, 1e-15);
  }
}

}  // namespace
}  // namespace mocap
