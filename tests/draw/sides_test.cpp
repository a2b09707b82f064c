#include "libmocap/draw/sides.hpp"

#include <gtest/gtest.h>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::draw {
namespace {

TEST(SideOfName, KnowsTheConventions) {
  for (const char* name : {"left_knee", "LeftUpLeg", "leftShoulder", "mixamorig:LeftArm", "L_Hip", "Hand_L", "thigh.L", "lFemur", "lfemur", "LHipJoint", "lThigh",
                           "Bip01 L Thigh", "lshoulder", "ltoes", "LThumb", "upper_arm_l", "LEFT_HAND", "lCollar"})
    EXPECT_EQ(side_of_name(name), Side::left) << name;
  for (const char* name : {"right_knee", "RightUpLeg", "R_Hip", "Hand_R", "thigh.R", "rtibia", "RHipJoint", "rShldr", "Bip01 R Thigh", "rradius", "mixamorig:RightFoot"})
    EXPECT_EQ(side_of_name(name), Side::right) << name;
  for (const char* name : {"LowerBack", "lowerback", "root", "Root", "Hips", "hip", "neck", "Neck1", "Head", "spine3", "rib", "chest", "lowerneck", "", "1", "reference", "leg"})
    EXPECT_EQ(side_of_name(name), Side::trunk) << name;
}

TEST(Anatomy, OfTheCanonicalBody) {
  const Skeleton& s = *canonical_body();
  const Anatomy a = anatomy_of(s);
  for (std::size_t j = 0; j < s.parents.size(); ++j) {
    const std::string& name = s.joint_names[j];
    const Side expected = name.rfind("left_", 0) == 0 ? Side::left : name.rfind("right_", 0) == 0 ? Side::right : Side::trunk;
    EXPECT_EQ(a.sides[j], expected) << name;
    EXPECT_EQ(a.limbs[j] == 0, expected == Side::trunk) << name;
  }
  const auto limb = [&](const char* name) { return a.limbs[static_cast<std::size_t>(s.find(name))]; };
  EXPECT_EQ(limb("left_hip"), limb("left_foot"));
  EXPECT_EQ(limb("left_collar"), limb("left_wrist"));
  EXPECT_NE(limb("left_hip"), limb("left_collar"));
  EXPECT_NE(limb("left_hip"), limb("right_hip"));
  EXPECT_EQ(a.head, s.find("head"));
  EXPECT_EQ(a.left_foot, s.find("left_foot"));
  EXPECT_EQ(a.right_foot, s.find("right_foot"));
}

TEST(Anatomy, RolesComeFirstAndChildrenInherit) {
  Skeleton s;
  s.joint_names = {"a", "b", "c", "d"};
  s.parents = {-1, 0, 1, 0};
  s.rest_offsets = {{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  s.roles = {{"left_hip", "b"}};
  const Anatomy a = anatomy_of(s);
  EXPECT_EQ(a.sides, (std::vector<Side>{Side::trunk, Side::left, Side::left, Side::trunk}));
  EXPECT_EQ(a.limbs, (std::vector<int>{0, 1, 1, 0}));
  EXPECT_EQ(a.head, -1);
  EXPECT_EQ(a.with_roles.find_role("left_hip"), 1);
}

TEST(Anatomy, FindsPartsByNameWhereThereAreNoRoles) {
  Skeleton s = *canonical_body();
  s.roles.clear();
  const Anatomy a = anatomy_of(s);
  EXPECT_EQ(a.head, s.find("head"));
  EXPECT_EQ(a.left_foot, s.find("left_foot"));
  EXPECT_EQ(a.with_roles.find_role("right_shoulder"), s.find("right_shoulder"));
}

}  // namespace
}  // namespace mocap::draw
