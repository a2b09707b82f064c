#include "libmocap/skeleton/joint_names.hpp"

#include <gtest/gtest.h>

#include "rig.hpp"

namespace mocap {
namespace {

using Words = std::vector<std::string>;

struct Spelling {
  const char* name;
  Side side;
  Words words;
};

TEST(JointNames, OnePartInManySpellings) {
  const Spelling table[] = {
      // the examples of the header
      {"mixamorig:LeftUpLeg", Side::left, {"leg", "up"}},
      {"thigh.L", Side::left, {"thigh"}},
      {"lfemur", Side::left, {"femur"}},
      {"upperleg01.L", Side::left, {"leg", "up"}},
      {"L_Hip", Side::left, {"hip"}},
      {"LUArm", Side::left, {"arm", "up"}},
      // upper legs
      {"RightUpperLeg", Side::right, {"leg", "up"}},
      {"UpperLeg_R", Side::right, {"leg", "up"}},
      {"UpLeg_L", Side::left, {"leg", "up"}},
      {"r_upleg", Side::right, {"leg", "up"}},
      {"left_up_leg", Side::left, {"leg", "up"}},
      {"lThigh", Side::left, {"thigh"}},
      {"thigh_r", Side::right, {"thigh"}},
      {"DEF-thigh.L", Side::left, {"thigh"}},
      {"LeftThigh", Side::left, {"thigh"}},
      {"HipLeft", Side::left, {"hip"}},
      {"HIP_RIGHT", Side::right, {"hip"}},
      {"lhip", Side::left, {"hip"}},
      {"LHipJoint", Side::left, {"hip", "joint"}},
      {"rhipjoint", Side::right, {"hip", "joint"}},
      {"lThighBend", Side::left, {"thigh"}},
      // lower legs
      {"LeftLeg", Side::left, {"leg"}},
      {"LoLeg_R", Side::right, {"leg", "low"}},
      {"LowerLeg_L", Side::left, {"leg", "low"}},
      {"rShin", Side::right, {"shin"}},
      {"calf_l", Side::left, {"calf"}},
      {"rtibia", Side::right, {"tibia"}},
      {"KneeRight", Side::right, {"knee"}},
      // feet
      {"LeftToeBase", Side::left, {"base", "toe"}},
      {"ltoes", Side::left, {"toe"}},
      {"Toes_R", Side::right, {"toe"}},
      {"RToe", Side::right, {"toe"}},
      {"ball_l", Side::left, {"ball"}},
      {"toe1-1.R", Side::right, {"toe"}},
      {"LFoot", Side::left, {"foot"}},
      // arms
      {"LFArm", Side::left, {"arm", "low"}},
      {"RUArm", Side::right, {"arm", "up"}},
      {"upper_arm.R", Side::right, {"arm", "up"}},
      {"upperarm_l", Side::left, {"arm", "up"}},
      {"rForeArm", Side::right, {"arm", "low"}},
      {"lforearm", Side::left, {"arm", "low"}},
      {"rShldr", Side::right, {"shoulder"}},
      {"lhumerus", Side::left, {"humerus"}},
      {"rradius", Side::right, {"radius"}},
      {"LeftForeArmRoll", Side::left, {"arm", "low", "twist"}},
      {"upperarm_twist_01_r", Side::right, {"arm", "twist", "up"}},
      {"Clavicle_L", Side::left, {"clavicle"}},
      {"lclavicle", Side::left, {"clavicle"}},
      {"RightInHandIndex", Side::right, {"hand", "in", "index"}},
      // the trunk, with letters in it that are no sides
      {"LowerBack", Side::none, {"back", "low"}},
      {"lowerneck", Side::none, {"low", "neck"}},
      {"root", Side::none, {"root"}},
      {"reference", Side::none, {"reference"}},
      {"Hips", Side::none, {"hip"}},
      {"SpineBase", Side::none, {"base", "spine"}},
      {"rib", Side::none, {"rib"}},
      {"lumbar", Side::none, {"lumbar"}},
      {"L5", Side::none, {"l"}},
      {"R", Side::none, {"r"}},
      {"HeadTop_End", Side::none, {"end", "head", "top"}},
      {"spine.001", Side::none, {"spine"}},
      {"C_Neck", Side::none, {"neck"}},
      {"Chest_M", Side::none, {"chest"}},
      {"neck.x", Side::none, {"neck"}},
      {"scene|rig:Neck1", Side::none, {"neck"}},
      {"talus_l", Side::left, {"ankle"}},
      // Japanese
      {"左足", Side::left, {"leg"}},
      {"右ひざ", Side::right, {"knee"}},
      {"左足首", Side::left, {"ankle"}},
      {"右つま先", Side::right, {"toe"}},
      {"左手首", Side::left, {"wrist"}},
      {"右腕捩", Side::right, {"arm", "twist"}},
      {"首", Side::none, {"neck"}},
      {"上半身2", Side::none, {"spine"}},
      {"下半身", Side::none, {"pelvis"}},
      {"", Side::none, {}},
      {"12", Side::none, {}},
      {":", Side::none, {}},
  };
  for (const auto& t : table) {
    const JointName name = parse_joint_name(t.name);
    EXPECT_EQ(name.side, t.side) << t.name;
    EXPECT_EQ(name.words, t.words) << t.name;
    EXPECT_FALSE(name.helper) << t.name;
  }
}

TEST(JointNames, NumbersAndHelpers) {
  EXPECT_EQ(parse_joint_name("upperleg01.L").numbers, "01");
  EXPECT_EQ(parse_joint_name("finger5-1.L").numbers, "5-1");
  EXPECT_EQ(parse_joint_name("Spine").numbers, "");
  EXPECT_TRUE(parse_joint_name("__UpLeg_L").helper);
  EXPECT_EQ(parse_joint_name("__UpLeg_L").words, (Words{"leg", "up"}));
}

TEST(JointNames, AWordThatEveryJointHasInFrontSaysNothing) {
  const auto words_of = [](const char* text, const char* joint) {
    const Skeleton s = test::rig(text);
    const JointName name = joint_names_of(s)[static_cast<std::size_t>(s.find(joint))];
    return std::pair(name.side, name.words);
  };
  using Named = std::pair<Side, Words>;
  EXPECT_EQ(words_of("Bip01(Bip01 Pelvis(Bip01 % Thigh,Bip01 Spine))", "Bip01 L Thigh"), Named(Side::left, {"thigh"}));
  EXPECT_EQ(words_of("Character1_Hips(Character1_*UpLeg)", "Character1_RightUpLeg"), Named(Side::right, {"leg", "up"}));
  EXPECT_EQ(words_of("J_Bip_C_Hips(J_Bip_%_UpperLeg,J_Bip_C_Spine)", "J_Bip_R_UpperLeg"), Named(Side::right, {"leg", "up"}));
  EXPECT_EQ(words_of("CC_Base_Hip(CC_Base_%_Thigh,CC_Base_Waist)", "CC_Base_L_Thigh"), Named(Side::left, {"thigh"}));
  EXPECT_EQ(words_of("ValveBiped.Bip01_Pelvis(ValveBiped.Bip01_%_Calf)", "ValveBiped.Bip01_R_Calf"), Named(Side::right, {"calf"}));
  // What most joints of an arm begin with is its side.
  EXPECT_EQ(words_of("LeftArm(LeftForeArm(LeftHand(LeftHandThumb1,LeftHandIndex1)))", "LeftForeArm"), Named(Side::left, {"arm", "low"}));
}

TEST(JointNames, JointBehindEveryNameSaysNothing) {
  const Skeleton s = test::rig("hips_joint(left_upLeg_joint(left_leg_joint(left_foot_joint)))");
  EXPECT_EQ(joint_names_of(s)[1].words, (Words{"leg", "up"}));
  // Behind some it does: CMU's hub of the hip is not the hip.
  const Skeleton cmu = test::rig("Hips(LHipJoint(LeftUpLeg(LeftLeg(LeftFoot))))");
  EXPECT_EQ(joint_names_of(cmu)[1].words, (Words{"hip", "joint"}));
}

}  // namespace
}  // namespace mocap
