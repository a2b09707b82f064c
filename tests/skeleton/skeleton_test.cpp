#include "libmocap/skeleton/skeleton.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "libmocap/base/error.hpp"

namespace mocap {
namespace {

// root - a - b (end site), root - c
Skeleton tree() {
  Skeleton s;
  s.joint_names = {"root", "a", "b", "c"};
  s.parents = {-1, 0, 1, 0};
  s.rest_offsets = {{0, 0, 0}, {3, 4, 0}, {0, 0, 2}, {1, 0, 0}};
  s.end_sites = {{2, {0, 0, 0.5}}};
  s.roles = {{"root", "root"}, {"left_foot", "b"}};
  return s;
}

TEST(Skeleton, FindsJointsRolesAndChildren) {
  const Skeleton s = tree();
  EXPECT_EQ(s.joint_count(), 4);
  EXPECT_EQ(s.find("b"), 2);
  EXPECT_EQ(s.find("B"), -1);
  EXPECT_EQ(s.find_role("left_foot"), 2);
  EXPECT_EQ(s.find_role("head"), -1);
  EXPECT_EQ(s.children(), (std::vector<std::vector<int>>{{1, 3}, {2}, {}, {}}));
  EXPECT_EQ(rest_positions(s)[2], Vector3(3, 4, 2));
}

TEST(Skeleton, ValidateAcceptsATreeAndALoneRoot) {
  EXPECT_NO_THROW(tree().validate());
  Skeleton lone;
  lone.joint_names = {"root"};
  lone.parents = {-1};
  lone.rest_offsets = {{0, 0, 0}};
  EXPECT_NO_THROW(lone.validate());
}

TEST(Skeleton, ValidateNamesEachViolation) {
  const double nan = std::nan(""), infinity = HUGE_VAL;
  const std::vector<std::pair<std::string, std::function<void(Skeleton&)>>> violations = {
      {"no joints", [](Skeleton& s) { s = {}; }},
      {"3 names", [](Skeleton& s) { s.joint_names.pop_back(); }},
      {"3 offsets", [](Skeleton& s) { s.rest_offsets.pop_back(); }},
      {"empty name", [](Skeleton& s) { s.joint_names[1].clear(); }},
      {"joint a: the name occurs twice", [](Skeleton& s) { s.joint_names[3] = "a"; }},
      {"joint root: parent 0, expected -1", [](Skeleton& s) { s.parents[0] = 0; }},
      {"joint b: parent -1", [](Skeleton& s) { s.parents[2] = -1; }},
      {"joint b: parent 2", [](Skeleton& s) { s.parents[2] = 2; }},
      {"joint a: parent 3", [](Skeleton& s) { s.parents[1] = 3; }},
      {"joint a: parent -7", [](Skeleton& s) { s.parents[1] = -7; }},
      {"joint c: an offset", [=](Skeleton& s) { s.rest_offsets[3].y() = nan; }},
      {"joint a: an offset", [=](Skeleton& s) { s.rest_offsets[1].z() = -infinity; }},
      {"end site", [](Skeleton& s) { s.end_sites[0].parent = 4; }},
      {"end site", [](Skeleton& s) { s.end_sites[0].parent = -1; }},
      {"end site", [=](Skeleton& s) { s.end_sites[0].offset.x() = nan; }},
      {"role left_foot: joint z", [](Skeleton& s) { s.roles["left_foot"] = "z"; }},
  };
  for (const auto& [text, damage] : violations) {
    Skeleton s = tree();
    damage(s);
    try {
      s.validate("f.bvh");
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      EXPECT_EQ(std::string(e.what()).rfind("f.bvh:", 0), 0u) << e.what();
      EXPECT_NE(std::string(e.what()).find(text), std::string::npos) << e.what();
    }
  }
}

TEST(Skeleton, SameAsSeesEveryDifference) {
  const Skeleton s = tree();
  EXPECT_TRUE(s.same_as(tree()));
  const std::vector<std::function<void(Skeleton&)>> changes = {
      [](Skeleton& o) { o.joint_names[3] = "d"; },      [](Skeleton& o) { o.parents[3] = 1; },
      [](Skeleton& o) { o.rest_offsets[1].x() += 1e-5; }, [](Skeleton& o) { o.end_sites.clear(); },
      [](Skeleton& o) { o.end_sites[0].parent = 1; },   [](Skeleton& o) { o.end_sites[0].offset.y() += 1e-5; }};
  for (const auto& change : changes) {
    Skeleton o = tree();
    change(o);
    EXPECT_FALSE(s.same_as(o));
  }
  Skeleton close = tree();
  close.rest_offsets[1].x() += 1e-7;
  EXPECT_TRUE(s.same_as(close));
  EXPECT_FALSE(s.same_as(close, 1e-8));
}

TEST(ImpactFactors, AreTheLongestPathsToATip) {
  const auto alpha = impact_factors(tree());
  EXPECT_DOUBLE_EQ(alpha[0], 5 + 2 + 0.5);
  EXPECT_DOUBLE_EQ(alpha[1], 2 + 0.5);
  EXPECT_DOUBLE_EQ(alpha[2], 0.5);
  EXPECT_DOUBLE_EQ(alpha[3], 0);
  EXPECT_DOUBLE_EQ(impact_factors(tree(), 0.1)[3], 0.1);
  EXPECT_DOUBLE_EQ(impact_factors(tree(), 0.1)[0], 7.5);
}

}  // namespace
}  // namespace mocap
