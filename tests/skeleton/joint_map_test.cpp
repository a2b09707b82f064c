#include "libmocap/skeleton/joint_map.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <chrono>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "rig.hpp"

namespace mocap {
namespace {

constexpr const char* kTrunk[] = {"pelvis", "spine1", "spine2", "spine3", "neck", "head"};
constexpr const char* kSides[] = {"collar", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot"};

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> out(1);
  for (const char c : text) {
    if (c == '|') out.emplace_back();
    else out.back() += c;
  }
  return out;
}

std::string name_of(const Skeleton& s, int joint) { return joint < 0 ? "-" : s.joint_names[static_cast<std::size_t>(joint)]; }

// `trunk`: pelvis|spine1|spine2|spine3|neck|head, `sides`: collar|shoulder|elbow|wrist|hip|knee|ankle|foot with the marks of rig.hpp; "-" for none.
void expect_map(const Skeleton& s, const JointMap& map, const char* trunk, const char* sides) {
  const auto centre = split(trunk), limbs = split(sides);
  ASSERT_EQ(centre.size(), std::size(kTrunk));
  ASSERT_EQ(limbs.size(), std::size(kSides));
  for (std::size_t k = 0; k < centre.size(); ++k) EXPECT_EQ(name_of(s, map.source_of(kTrunk[k])), centre[k]) << kTrunk[k];
  for (const bool left : {true, false})
    for (std::size_t k = 0; k < limbs.size(); ++k) {
      const std::string part = (left ? "left_" : "right_") + std::string(kSides[k]);
      EXPECT_EQ(name_of(s, map.source_of(part)), test::on_side(limbs[k], left)) << part;
    }
}

struct Rig {
  const char *name, *tree, *trunk, *sides;
};

constexpr Rig kRigs[] = {
    {"cgspeed MotionBuilder",
     "Hips(%HipJoint=0(*UpLeg(*Leg(*Foot(*ToeBase)))),LowerBack=0.1(Spine=2(Spine1=2(Neck=0.1(Neck1=1.4(Head=1.5)),*Shoulder=0.1(*Arm(*ForeArm(*Hand(*FingerBase(*HandIndex1),%Thumb))))))))",
     "Hips|LowerBack|Spine|Spine1|Neck|Head", "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|*ToeBase"},
    {"cgspeed 3ds Max",
     "Hips(%HipJoint=0(*Hip(*Knee(*Ankle(*Toe)))),lowerback=0.1(Chest=2(Chest2=2(lowerneck=0.1(Neck=1.4(Head=1.5)),*Collar=0.1(*Shoulder(*Elbow(*Wrist(^hand(%Fingers),%Thumb))))))))",
     "Hips|lowerback|Chest|Chest2|lowerneck|Head", "*Collar|*Shoulder|*Elbow|*Wrist|*Hip|*Knee|*Ankle|*Toe"},
    {"CMU ASF",
     "root(^hipjoint=0(^femur(^tibia(^foot(^toes)))),lowerback=0(upperback=2(thorax=2(lowerneck=2(upperneck=1.5(head=1.5)),^clavicle=2(^humerus(^radius(^wrist(^hand(^fingers),^thumb))))))))",
     "root|lowerback|upperback|thorax|lowerneck|head", "^clavicle|^humerus|^radius|^wrist|^femur|^tibia|^foot|^toes"},
    {"SMPL", "pelvis(@_hip(@_knee(@_ankle(@_foot))),spine1(spine2(spine3(neck(head),@_collar(@_shoulder(@_elbow(@_wrist(@_hand))))))))", "pelvis|spine1|spine2|spine3|neck|head",
     "@_collar|@_shoulder|@_elbow|@_wrist|@_hip|@_knee|@_ankle|@_foot"},
    {"SMPL, capitals", "Pelvis(%_Hip(%_Knee(%_Ankle(%_Foot))),Spine1(Spine2(Spine3(Neck(Head),%_Collar(%_Shoulder(%_Elbow(%_Wrist(%_Hand))))))))",
     "Pelvis|Spine1|Spine2|Spine3|Neck|Head", "%_Collar|%_Shoulder|%_Elbow|%_Wrist|%_Hip|%_Knee|%_Ankle|%_Foot"},
    {"SMPL in Blender",
     "root(m_avg_Pelvis(m_avg_%_Hip(m_avg_%_Knee(m_avg_%_Ankle(m_avg_%_Foot))),m_avg_Spine1(m_avg_Spine2(m_avg_Spine3(m_avg_Neck(m_avg_Head),m_avg_%_Collar(m_avg_%_Shoulder(m_avg_%_Elbow("
     "m_avg_%_Wrist(m_avg_%_Hand)))))))))",
     "m_avg_Pelvis|m_avg_Spine1|m_avg_Spine2|m_avg_Spine3|m_avg_Neck|m_avg_Head",
     "m_avg_%_Collar|m_avg_%_Shoulder|m_avg_%_Elbow|m_avg_%_Wrist|m_avg_%_Hip|m_avg_%_Knee|m_avg_%_Ankle|m_avg_%_Foot"},
    {"SMPL-H",
     "pelvis(@_hip(@_knee(@_ankle(@_foot))),spine1(spine2(spine3(neck(head(jaw,@_eye_smplhf)),@_collar(@_shoulder(@_elbow(@_wrist(@_index1(@_index2(@_index3)),@_middle1(@_middle2),@_pinky1,"
     "@_ring1,@_thumb1(@_thumb2(@_thumb3))))))))))",
     "pelvis|spine1|spine2|spine3|neck|head", "@_collar|@_shoulder|@_elbow|@_wrist|@_hip|@_knee|@_ankle|@_foot"},
    {"Mixamo",
     "mixamorig:Hips(mixamorig:Spine(mixamorig:Spine1(mixamorig:Spine2(mixamorig:Neck(mixamorig:Head(mixamorig:HeadTop_End,mixamorig:*Eye)),mixamorig:*Shoulder(mixamorig:*Arm(mixamorig:*ForeArm("
     "mixamorig:*Hand(mixamorig:*HandThumb1(mixamorig:*HandThumb2),mixamorig:*HandIndex1))))))),mixamorig:*UpLeg(mixamorig:*Leg(mixamorig:*Foot(mixamorig:*ToeBase(mixamorig:*Toe_End)))))",
     "mixamorig:Hips|mixamorig:Spine|mixamorig:Spine1|mixamorig:Spine2|mixamorig:Neck|mixamorig:Head",
     "mixamorig:*Shoulder|mixamorig:*Arm|mixamorig:*ForeArm|mixamorig:*Hand|mixamorig:*UpLeg|mixamorig:*Leg|mixamorig:*Foot|mixamorig:*ToeBase"},
    {"HumanIK with rolls",
     "Reference(Hips(*UpLeg(*UpLegRoll,*Leg(*LegRoll,*Foot(*ToeBase))),Spine(Spine1(Spine2(Spine3(*Shoulder(*Arm(*ArmRoll,*ForeArm(*ForeArmRoll,*Hand(*InHandIndex(*HandIndex1),*HandThumb1)))),"
     "Neck(Neck1(Head))))))))",
     "Hips|Spine|Spine1|Spine2|Neck|Head", "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|*ToeBase"},
    {"HumanIK characterised",
     "Character1_Reference(Character1_Hips(Character1_*UpLeg(Character1_*Leg(Character1_*Foot)),Character1_Spine(Character1_Spine1(Character1_Spine2(Character1_*Shoulder(Character1_*Arm("
     "Character1_*ForeArm(Character1_*Hand))),Character1_Neck(Character1_Head))))))",
     "Character1_Hips|Character1_Spine|Character1_Spine1|Character1_Spine2|Character1_Neck|Character1_Head",
     "Character1_*Shoulder|Character1_*Arm|Character1_*ForeArm|Character1_*Hand|Character1_*UpLeg|Character1_*Leg|Character1_*Foot|-"},
    {"Rokoko",
     "Hips(Spine1(Spine2(Spine3(Spine4(Neck(Head),*Shoulder(*Arm(*ForeArm(*Hand(*Finger1Metacarpal(*Finger1Proximal))))))))),*Thigh(*Shin(*Foot(*Toe))))",
     "Hips|Spine1|Spine2|Spine3|Neck|Head", "*Shoulder|*Arm|*ForeArm|*Hand|*Thigh|*Shin|*Foot|*Toe"},
    {"LaFAN1", "Hips(*UpLeg(*Leg(*Foot(*Toe))),Spine=7(Spine1=12.5(Spine2=11.5(Neck=25(Head=11),*Shoulder=20(*Arm(*ForeArm(*Hand)))))))", "Hips|Spine|Spine1|Spine2|Neck|Head",
     "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|*Toe"},
    {"SFU", "Hips(*UpLeg(*Leg(*Foot(*ToeBase))),Spine=6(Spine1=12(Neck=11(Head),*Shoulder(*Arm(*ForeArm(*Hand(*HandThumb,%_Wrist_End)))))))", "Hips|Spine|-|Spine1|Neck|Head",
     "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|*ToeBase"},
    {"Bandai-Namco", "joint_Root(Hips(Spine=6(Chest=12(Neck=11(Head),Shoulder_%(UpperArm_%(LowerArm_%(Hand_%))))),UpperLeg_%(LowerLeg_%(Foot_%(Toes_%)))))", "Hips|Spine|-|Chest|Neck|Head",
     "Shoulder_%|UpperArm_%|LowerArm_%|Hand_%|UpperLeg_%|LowerLeg_%|Foot_%|Toes_%"},
    {"MakeHuman, helper joints",
     "Root(Spine1(Spine2(Spine3(Neck(Head(__Jaw(Jaw),__Eye_%(Eye_%))),__Clavicle_%(Clavicle_%(UpArm_%(LoArm_%(Hand_%(__Thumb1_%(Thumb1_%))))))))),Hips(__UpLeg_%(UpLeg_%(LoLeg_%(Foot_%(Toe_%))))))",
     "Hips|Spine1|Spine2|Spine3|Neck|Head", "Clavicle_%|UpArm_%|LoArm_%|Hand_%|UpLeg_%|LoLeg_%|Foot_%|Toe_%"},
    {"MakeHuman, divided limbs",
     "root(spine05(spine04(spine03(spine02(spine01(neck01(neck02(neck03(head(jaw(tongue00),eye.%)))),clavicle.%(shoulder01.%(upperarm01.%(upperarm02.%(lowerarm01.%(lowerarm02.%(wrist.%("
     "finger1-1.%(finger1-2.%),metacarpal1.%(finger2-1.%))))))))))))),pelvis.%(upperleg01.%(upperleg02.%(lowerleg01.%(lowerleg02.%(foot.%(toe1-1.%(toe1-2.%),toe2-1.%)))))))",
     "root|spine05|spine03|spine02|neck01|head", "clavicle.%|upperarm01.%|lowerarm01.%|wrist.%|upperleg01.%|lowerleg01.%|foot.%|toe1-1.%"},
    {"Biovision", "Hips(*Hip(*Knee(*Ankle)),Chest=5.2(*Collar=18(*Shoulder(*Elbow(*Wrist))),Neck=18.6(Head)))", "Hips|Chest|-|-|Neck|Head", "*Collar|*Shoulder|*Elbow|*Wrist|*Hip|*Knee|*Ankle|-"},
    {"Xsens, 100STYLE", "Hips(Chest(Chest2(Chest3(Chest4(Neck(Head),*Collar(*Shoulder(*Elbow(*Wrist))))))),*Hip(*Knee(*Ankle(*Toe))))", "Hips|Chest|Chest2|Chest3|Neck|Head",
     "*Collar|*Shoulder|*Elbow|*Wrist|*Hip|*Knee|*Ankle|*Toe"},
    {"Xsens, vertebrae", "Pelvis(L5(L3(T12(T8(Neck(Head),*Shoulder(*UpperArm(*ForeArm(*Hand))))))),*UpperLeg(*LowerLeg(*Foot(*Toe))))", "Pelvis|L5|L3|T12|Neck|Head",
     "*Shoulder|*UpperArm|*ForeArm|*Hand|*UpperLeg|*LowerLeg|*Foot|*Toe"},
    {"Motive", "Hip(Ab=6(Chest=12(Neck=11(Head),%Shoulder(%UArm(%FArm(%Hand(%Thumb1,%Index1(%Index2))))))),%Thigh(%Shin(%Foot(%Toe))))", "Hip|Ab|-|Chest|Neck|Head",
     "%Shoulder|%UArm|%FArm|%Hand|%Thigh|%Shin|%Foot|%Toe"},
    {"Poser", "hip(abdomen=6(chest=12(neck=11(head(leftEye,rightEye)),^Collar(^Shldr(^ForeArm(^Hand(^Thumb1(^Thumb2),^Mid1)))))),^Buttock(^Thigh(^Shin(^Foot))))", "hip|abdomen|-|chest|neck|head",
     "^Collar|^Shldr|^ForeArm|^Hand|^Thigh|^Shin|^Foot|-"},
    {"DAZ, bend and twist",
     "hip(pelvis(^ThighBend(^ThighTwist(^Shin(^Foot(^Metatarsals(^Toe(^BigToe,^SmallToe1))))))),abdomenLower(abdomenUpper(chestLower(chestUpper(^Collar(^ShldrBend(^ShldrTwist(^ForearmBend(^ForearmTwist("
     "^Hand(^Thumb1)))))),neckLower(neckUpper(head)))))))",
     "pelvis|abdomenLower|abdomenUpper|chestLower|neckLower|head", "^Collar|^ShldrBend|^ForearmBend|^Hand|^ThighBend|^Shin|^Foot|^Toe"},
    {"3ds Max Biped",
     "Bip01(Bip01 Footsteps,Bip01 Pelvis(Bip01 Spine=6(Bip01 Spine1=12(Bip01 Neck=11(Bip01 Head(Bip01 Ponytail1),Bip01 % Clavicle(Bip01 % UpperArm(Bip01 % Forearm(Bip01 % Hand(Bip01 % Finger0("
     "Bip01 % Finger01)))))))),Bip01 % Thigh(Bip01 % Calf(Bip01 % Foot(Bip01 % Toe0(Bip01 % Toe01))))))",
     "Bip01 Pelvis|Bip01 Spine|-|Bip01 Spine1|Bip01 Neck|Bip01 Head",
     "Bip01 % Clavicle|Bip01 % UpperArm|Bip01 % Forearm|Bip01 % Hand|Bip01 % Thigh|Bip01 % Calf|Bip01 % Foot|Bip01 % Toe0"},
    {"Valve",
     "ValveBiped.Bip01_Pelvis(ValveBiped.Bip01_Spine(ValveBiped.Bip01_Spine1(ValveBiped.Bip01_Spine2(ValveBiped.Bip01_Spine4(ValveBiped.Bip01_Neck1(ValveBiped.Bip01_Head1),ValveBiped.Bip01_%_Clavicle("
     "ValveBiped.Bip01_%_UpperArm(ValveBiped.Bip01_%_Forearm(ValveBiped.Bip01_%_Hand))))))),ValveBiped.Bip01_%_Thigh(ValveBiped.Bip01_%_Calf(ValveBiped.Bip01_%_Foot(ValveBiped.Bip01_%_Toe0))))",
     "ValveBiped.Bip01_Pelvis|ValveBiped.Bip01_Spine|ValveBiped.Bip01_Spine1|ValveBiped.Bip01_Spine2|ValveBiped.Bip01_Neck1|ValveBiped.Bip01_Head1",
     "ValveBiped.Bip01_%_Clavicle|ValveBiped.Bip01_%_UpperArm|ValveBiped.Bip01_%_Forearm|ValveBiped.Bip01_%_Hand|ValveBiped.Bip01_%_Thigh|ValveBiped.Bip01_%_Calf|ValveBiped.Bip01_%_Foot|"
     "ValveBiped.Bip01_%_Toe0"},
    {"Unreal",
     "root(pelvis(spine_01(spine_02(spine_03(clavicle_^(upperarm_^(upperarm_twist_01_^,lowerarm_^(lowerarm_twist_01_^,hand_^(index_01_^(index_02_^),thumb_01_^)))),neck_01(head)))),"
     "thigh_^(thigh_twist_01_^,calf_^(calf_twist_01_^,foot_^(ball_^)))),ik_foot_root(ik_foot_^),ik_hand_root(ik_hand_gun(ik_hand_^)))",
     "pelvis|spine_01|spine_02|spine_03|neck_01|head", "clavicle_^|upperarm_^|lowerarm_^|hand_^|thigh_^|calf_^|foot_^|ball_^"},
    {"Unreal 5",
     "root(pelvis(spine_01(spine_02(spine_03(spine_04(spine_05(clavicle_^(upperarm_^(lowerarm_^(hand_^(index_metacarpal_^(index_01_^))))),neck_01(neck_02(head))))))),thigh_^(calf_^(foot_^(ball_^)))))",
     "pelvis|spine_01|spine_03|spine_04|neck_01|head", "clavicle_^|upperarm_^|lowerarm_^|hand_^|thigh_^|calf_^|foot_^|ball_^"},
    {"Kinect 2", "SpineBase(SpineMid=6(SpineShoulder=12(Neck=11(Head),Shoulder*(Elbow*(Wrist*(Hand*(HandTip*),Thumb*))))),Hip*(Knee*(Ankle*(Foot*))))",
     "SpineBase|SpineMid|-|SpineShoulder|Neck|Head", "-|Shoulder*|Elbow*|Wrist*|Hip*|Knee*|Ankle*|Foot*"},
    {"Kinect 1", "HipCenter(Spine=6(ShoulderCenter=12(Head=11,Shoulder*(Elbow*(Wrist*(Hand*))))),Hip*(Knee*(Ankle*(Foot*))))", "HipCenter|Spine|-|ShoulderCenter|-|Head",
     "-|Shoulder*|Elbow*|Wrist*|Hip*|Knee*|Ankle*|Foot*"},
    {"Azure Kinect",
     "PELVIS(SPINE_NAVEL=6(SPINE_CHEST=12(NECK=11(HEAD(NOSE,EYE_#,EAR_#)),CLAVICLE_#(SHOULDER_#(ELBOW_#(WRIST_#(HAND_#(HANDTIP_#),THUMB_#)))))),HIP_#(KNEE_#(ANKLE_#(FOOT_#))))",
     "PELVIS|SPINE_NAVEL|-|SPINE_CHEST|NECK|HEAD", "CLAVICLE_#|SHOULDER_#|ELBOW_#|WRIST_#|HIP_#|KNEE_#|ANKLE_#|FOOT_#"},
    {"Blender metarig",
     "spine(spine.001(spine.002(spine.003(spine.004(spine.005(spine.006)),shoulder.%(upper_arm.%(forearm.%(hand.%(palm.01.%(f_index.01.%)),thumb.01.%))),breast.%))),pelvis.%,"
     "thigh.%(shin.%(foot.%(heel.02.%,toe.%))))",
     "spine|spine.001|spine.002|spine.003|spine.004|spine.006", "shoulder.%|upper_arm.%|forearm.%|hand.%|thigh.%|shin.%|foot.%|toe.%"},
    {"Auto-Rig Pro",
     "root.x(thigh_stretch.^(thigh_twist.^,leg_stretch.^(leg_twist.^,foot.^(toes_01.^))),spine_01.x(spine_02.x(spine_03.x(neck.x(head.x(jawbone.x)),shoulder.^(arm_stretch.^(arm_twist.^,forearm_stretch.^("
     "forearm_twist.^,hand.^(index1.^))))))))",
     "root.x|spine_01.x|spine_02.x|spine_03.x|neck.x|head.x", "shoulder.^|arm_stretch.^|forearm_stretch.^|hand.^|thigh_stretch.^|leg_stretch.^|foot.^|toes_01.^"},
    {"VRM",
     "J_Bip_C_Hips(J_Bip_C_Spine(J_Bip_C_Chest(J_Bip_C_UpperChest(J_Sec_%_Bust1,J_Bip_C_Neck(J_Bip_C_Head(J_Adj_%_FaceEye,J_Sec_Hair1_01(J_Sec_Hair2_01(J_Sec_Hair3_01)))),J_Bip_%_Shoulder(J_Bip_%_UpperArm("
     "J_Bip_%_LowerArm(J_Bip_%_Hand(J_Bip_%_Index1))))))),J_Bip_%_UpperLeg(J_Bip_%_LowerLeg(J_Bip_%_Foot(J_Bip_%_ToeBase))),J_Sec_%_SkirtBack0_01(J_Sec_%_SkirtBack1_01),J_Sec_%_CoatSkirtFront_01)",
     "J_Bip_C_Hips|J_Bip_C_Spine|J_Bip_C_Chest|J_Bip_C_UpperChest|J_Bip_C_Neck|J_Bip_C_Head",
     "J_Bip_%_Shoulder|J_Bip_%_UpperArm|J_Bip_%_LowerArm|J_Bip_%_Hand|J_Bip_%_UpperLeg|J_Bip_%_LowerLeg|J_Bip_%_Foot|J_Bip_%_ToeBase"},
    {"Unity", "Hips(*UpperLeg(*LowerLeg(*Foot(*Toes))),Spine(Chest(UpperChest(Neck(Head(Jaw,*Eye)),*Shoulder(*UpperArm(*LowerArm(*Hand(*IndexProximal(*IndexIntermediate)))))))))",
     "Hips|Spine|Chest|UpperChest|Neck|Head", "*Shoulder|*UpperArm|*LowerArm|*Hand|*UpperLeg|*LowerLeg|*Foot|*Toes"},
    {"Reallusion",
     "RL_BoneRoot(CC_Base_Hip(CC_Base_Pelvis=1(CC_Base_%_Thigh(CC_Base_%_ThighTwist01,CC_Base_%_Calf(CC_Base_%_CalfTwist01,CC_Base_%_Foot(CC_Base_%_ToeBase(CC_Base_%_BigToe1))))),"
     "CC_Base_Waist=5(CC_Base_Spine01=7(CC_Base_Spine02=6(CC_Base_NeckTwist01=11(CC_Base_NeckTwist02=4(CC_Base_Head)),CC_Base_%_Clavicle(CC_Base_%_Upperarm(CC_Base_%_UpperarmTwist01,CC_Base_%_Forearm("
     "CC_Base_%_Hand(CC_Base_%_Thumb1)))))))))",
     "CC_Base_Pelvis|CC_Base_Waist|CC_Base_Spine01|CC_Base_Spine02|CC_Base_NeckTwist01|CC_Base_Head",
     "CC_Base_%_Clavicle|CC_Base_%_Upperarm|CC_Base_%_Forearm|CC_Base_%_Hand|CC_Base_%_Thigh|CC_Base_%_Calf|CC_Base_%_Foot|CC_Base_%_ToeBase"},
    {"Advanced Skeleton",
     "Root_M(Hip_%(HipPart1_%,Knee_%(Ankle_%(Toes_%(ToesEnd_%)))),Spine1_M(Spine2_M(Chest_M(Scapula_%(Shoulder_%(ShoulderPart1_%,Elbow_%(Wrist_%(MiddleFinger1_%)))),Neck_M(Head_M(HeadEnd_M))))))",
     "Root_M|Spine1_M|Spine2_M|Chest_M|Neck_M|Head_M", "Scapula_%|Shoulder_%|Elbow_%|Wrist_%|Hip_%|Knee_%|Ankle_%|Toes_%"},
    {"Perception Neuron", "Hips(*UpLeg(*Leg(*Foot)),Spine(Spine1(Spine2(Spine3(Neck(Head),*Shoulder(*Arm(*ForeArm(*Hand(*HandThumb1,*InHandIndex(*HandIndex1))))))))))",
     "Hips|Spine|Spine1|Spine2|Neck|Head", "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|-"},
    {"fairmotion", "root(^hip(^knee(^ankle(^toe))),lowerback(upperback(chest(lowerneck(upperneck),^clavicle(^shoulder(^elbow(^wrist)))))))", "root|lowerback|upperback|chest|lowerneck|upperneck",
     "^clavicle|^shoulder|^elbow|^wrist|^hip|^knee|^ankle|^toe"},
    {"iPi", "Hip(LowerSpine(MiddleSpine(Chest(Neck(Head),%Clavicle(%Shoulder(%Forearm(%Hand)))))),%Thigh(%Shin(%Foot(%Toe))))", "Hip|LowerSpine|MiddleSpine|Chest|Neck|Head",
     "%Clavicle|%Shoulder|%Forearm|%Hand|%Thigh|%Shin|%Foot|%Toe"},
    {"DeepMotion", "hips_JNT(^_upleg_JNT(^_leg_JNT(^_foot_JNT(^_toebase_JNT))),spine_JNT(spine1_JNT(spine2_JNT(neck_JNT(head_JNT),^_shoulder_JNT(^_arm_JNT(^_forearm_JNT(^_hand_JNT(^_handIndex1_JNT))))))))",
     "hips_JNT|spine_JNT|spine1_JNT|spine2_JNT|neck_JNT|head_JNT", "^_shoulder_JNT|^_arm_JNT|^_forearm_JNT|^_hand_JNT|^_upleg_JNT|^_leg_JNT|^_foot_JNT|^_toebase_JNT"},
    {"low and up", "Hips(Chest=6(Neck=20(Head),*Collar(*UpArm(*LowArm(*Hand)))),*UpLeg(*LowLeg(*Foot)))", "Hips|Chest|-|-|Neck|Head", "*Collar|*UpArm|*LowArm|*Hand|*UpLeg|*LowLeg|*Foot|-"},
    {"a shank for a leg", "Hips(Spine=10(Neck=10(Head),*Arm(*ForeArm(*Hand))),*Thigh(*Shank(*Foot(*Toes))))", "Hips|-|Spine|-|Neck|Head", "-|*Arm|*ForeArm|*Hand|*Thigh|*Shank|*Foot|*Toes"},
};

TEST(JointMap, KnowsTheRigsOfTheField) {
  for (const Rig& r : kRigs) {
    SCOPED_TRACE(r.name);
    const Skeleton s = test::rig(r.tree);
    expect_map(s, map_to_canonical(s), r.trunk, r.sides);
  }
}

TEST(JointMap, FamiliesAreNamed) {
  const std::pair<const char*, const char*> families[] = {{"cgspeed MotionBuilder", "cmu (cgspeed)"}, {"cgspeed 3ds Max", "cmu (cgspeed, 3ds max)"}, {"CMU ASF", "cmu (asf)"},
                                                          {"SMPL, capitals", "smpl"},                   {"Mixamo", "mixamo"},                          {"Bandai-Namco", "bandai-namco"},
                                                          {"3ds Max Biped", "biped"},                   {"Rokoko", "rokoko"},                          {"LaFAN1", "lafan1"},
                                                          {"Unreal", "unreal"},                         {"Biovision", "biovision"},                    {"Motive", "motive"},
                                                          {"Poser", "poser"},                           {"Blender metarig", "blender"},                {"iPi", "unknown"}};
  for (const auto& [name, family] : families)
    for (const Rig& r : kRigs)
      if (std::string(r.name) == name) { EXPECT_EQ(map_to_canonical(test::rig(r.tree)).family, family) << name; }
  EXPECT_EQ(map_to_canonical(*canonical_body()).family, "canonical");
}

TEST(JointMap, SpinesOfAnyNumberOfJointsBendWhereTheBodyDoes) {
  const auto with_spine = [](const std::string& spine, int joints) {
    std::string tree = "Hips(*UpLeg(*Leg(*Foot)),", close = ")";
    for (int k = 0; k < joints; ++k) tree += fmt::format("{}(", spine + std::to_string(k)), close += ")";
    return test::rig(tree + "Neck(Head),*Shoulder(*Arm(*ForeArm(*Hand)))" + close);
  };
  // Shares of the canonical spine: 0.21, 0.47, 0.64 of the way from pelvis to neck. Joints k = 0.. lie at (k + 1) / (n + 1).
  const std::pair<int, std::array<int, 3>> expected[] = {{1, {-1, 0, -1}}, {2, {0, -1, 1}}, {3, {0, 1, 2}}, {5, {0, 2, 3}}, {8, {1, 3, 5}}};
  for (const auto& [n, joints] : expected) {
    const Skeleton s = with_spine("Spine", n);
    const JointMap map = map_to_canonical(s);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(name_of(s, map.source_of("spine" + std::to_string(k + 1))), joints[k] < 0 ? "-" : "Spine" + std::to_string(joints[k])) << n << " joints, spine" << k + 1;
    EXPECT_EQ(name_of(s, map.source_of("neck")), "Neck");
    EXPECT_TRUE(map.missing().empty());
    // What the joints of the spine are called does not matter.
    EXPECT_EQ(map_to_canonical(with_spine("Vertebra", n)).source, map.source);
  }
}

TEST(JointMap, PartsThatArePutElsewhereOrLeftOut) {
  const auto check = [](const char* tree, const char* trunk, const char* sides) {
    SCOPED_TRACE(tree);
    const Skeleton s = test::rig(tree);
    const JointMap map = map_to_canonical(s);
    expect_map(s, map, trunk, sides);
    EXPECT_TRUE(map.missing().empty());
  };
  // No neck; no head either; a head alone.
  check("Hips(*UpLeg(*Leg(*Foot)),Spine(Head,*Arm(*ForeArm(*Hand))))", "Hips|-|Spine|-|-|Head", "-|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|-");
  check("Hips(*UpLeg(*Leg(*Foot)),Spine=4(Chest=12(*Arm(*ForeArm(*Hand)))))", "Hips|Spine|-|Chest|-|-", "-|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|-");
  // No spine at all, no hands, no clavicles, no toes.
  check("Hips(*UpLeg(*Leg(*Foot)),Neck(Head),*Arm(*ForeArm))", "Hips|-|-|-|Neck|Head", "-|*Arm|*ForeArm|-|*UpLeg|*Leg|*Foot|-");
  // A clavicle that does not carry the arm is none.
  check("Hips(*UpLeg(*Leg(*Foot)),Spine(Neck(Head),*Collar,*Arm(*ForeArm(*Hand))))", "Hips|-|Spine|-|Neck|Head", "-|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|-");
  // Joints between the parts, before and after the joint that is meant.
  check("Root(Hips(*UpLegTwist,*UpLeg(*UpLegTwist1(*KneeRoll(*Leg(*LegTwist(*Foot(*FootRoll,*ToeBase)))))),Gun_%,Spine(Neck(Head(HeadNub)),*ShoulderPad,*Shoulder(*ArmTwist,*Arm(*ArmTwist1(*ForeArm(*ForeArmTwist("
        "*Hand))))))))",
        "Hips|-|Spine|-|Neck|Head", "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|*ToeBase");
  // Words that occur twice in one name, and names that occur twice.
  check("Hips(Left_LeftUpLeg(Left_LeftLeg(Left_LeftFoot)),Right_RightUpLeg(Right_RightLeg(Right_RightFoot)),Spine(Neck(Head,Head#2),*Arm(*ForeArm(*Hand))))", "Hips|-|Spine|-|Neck|Head",
        "-|*Arm|*ForeArm|*Hand|*_*UpLeg|*_*Leg|*_*Foot|-");
  // Clothes and weapons named after the parts they hang from.
  check("Hips(*UpLeg(*Leg(*Foot(*Toe))),Skirt_%(Skirt_%_End),Spine(Neck(Head(Hair_Head)),*Shoulder(*Arm(*ForeArm(*Hand(*HandWeapon)))),Cape_%_Arm))", "Hips|-|Spine|-|Neck|Head",
        "*Shoulder|*Arm|*ForeArm|*Hand|*UpLeg|*Leg|*Foot|*Toe");
}

TEST(JointMap, OfSeveralToesTheMiddleOne) {
  Skeleton s = test::rig("Hips(*UpLeg(*Leg(*Foot(*Toe1,*Toe2,*Toe3,*Toe4,*Toe5))),Neck(Head),*Arm(*ForeArm))");
  for (std::size_t j = 0; j < s.parents.size(); ++j)
    if (s.joint_names[j].find("Toe") != std::string::npos) s.rest_offsets[j] = Vector3(12, 3 - s.joint_names[j].back() + '0', -6);
  const JointMap map = map_to_canonical(s);
  EXPECT_EQ(name_of(s, map.source_of("left_foot")), "LeftToe3");
  EXPECT_EQ(name_of(s, map.source_of("right_foot")), "RightToe3");
}

TEST(JointMap, SkeletonsOfNobody) {
  for (const char* tree : {"root", "base(child1(child2(child3)))", "*Hand(*HandThumb1)", "L(R(l(r)))", "a(*(%))", "Hips(*UpLeg)", "left(right)"}) {
    std::string text = tree;
    if (text.front() == '*') text = "Hands(" + text + ")";
    const Skeleton s = test::rig(text);
    const JointMap map = map_to_canonical(s);
    EXPECT_FALSE(map.missing().empty()) << tree;
    for (const int j : map.source) {
      EXPECT_GE(j, -1);
      EXPECT_LT(j, s.joint_count());
    }
  }
}

// Nested to 100,000 joints (promised for every parser): no recursion, no square of the depth.
TEST(JointMap, DeepSkeletonsTakeBoundedTime) {
  for (const char* name : {"j", "Spine", "LeftToe", "Head"}) {
    Skeleton s = test::rig("Hips(*UpLeg(*Leg(*Foot(*Toe))),Spine(Neck(Head),*Arm(*ForeArm(*Hand))))");
    int parent = s.find("Neck");
    for (int k = 0; k < 100000; ++k) {
      s.joint_names.push_back(name + std::to_string(k));
      s.parents.push_back(parent);
      s.rest_offsets.emplace_back(0, 0, 1);
      parent = s.joint_count() - 1;
    }
    s.joint_names[static_cast<std::size_t>(s.find("Head"))] = "Skull";
    s.joint_names.push_back("Head");
    s.parents.push_back(parent);
    s.rest_offsets.emplace_back(0, 0, 1);
    const auto start = std::chrono::steady_clock::now();
    const JointMap map = map_to_canonical(s);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20)) << name;
    EXPECT_TRUE(map.missing().empty());
    EXPECT_FALSE(describe_missing(s, map).size() > 10000);
  }
}

TEST(JointMap, RolesRoundTrip) {
  for (const Rig& r : kRigs) {
    Skeleton s = test::rig(r.tree);
    const JointMap map = map_to_canonical(s);
    s.roles = roles_of(s, map);
    EXPECT_NO_THROW(s.validate());
    const JointMap again = map_to_canonical(s);
    EXPECT_EQ(again.source, map.source) << r.name;
    EXPECT_EQ(roles_of(s, again), s.roles) << r.name;
  }
  const auto roles = roles_of(*canonical_body(), map_to_canonical(*canonical_body()));
  for (const auto& [role, joint] : canonical_body()->roles) EXPECT_EQ(roles.at(role), joint);
  EXPECT_EQ(roles.at("root"), "pelvis");
  EXPECT_EQ(roles.at("left_hand"), "left_wrist");
  EXPECT_FALSE(roles.contains("pelvis"));
  EXPECT_FALSE(roles.contains("left_wrist"));
  // Without toes the ankles are the feet, and are not taken for toes when the roles are read.
  Skeleton s = test::rig("Hips(*UpLeg(*Leg(*Foot)),Spine(Neck(Head),*Arm(*ForeArm(*Hand))))");
  s.roles = roles_of(s, map_to_canonical(s));
  EXPECT_EQ(s.roles.at("left_foot"), "LeftFoot");
  EXPECT_EQ(s.roles.at("left_ankle"), "LeftFoot");
  EXPECT_EQ(map_to_canonical(s).source_of("left_foot"), -1);
  EXPECT_EQ(map_to_canonical(s).family, "roles");
}

TEST(JointMap, RolesGoBeforeNames) {
  // Whoever filled the roles knew better: here left is called right.
  Skeleton s = test::rig("Hips(*UpLeg(*Leg(*Foot)),Spine(Neck(Head),*Arm(*ForeArm(*Hand))))");
  s.roles = roles_of(s, map_to_canonical(s));
  for (auto& [role, joint] : s.roles)
    if (joint.starts_with("Left")) joint = "Right" + joint.substr(4);
    else if (joint.starts_with("Right")) joint = "Left" + joint.substr(5);
  EXPECT_EQ(name_of(s, map_to_canonical(s).source_of("left_knee")), "RightLeg");
  s.roles.erase("left_knee");  // not all of them: names decide
  EXPECT_EQ(name_of(s, map_to_canonical(s).source_of("left_knee")), "LeftLeg");
}

TEST(JointMap, ByHand) {
  const Skeleton s = test::rig("Bone0(Bone1(Bone2(Bone3)),Bone4(Bone5(Bone6)),Bone7(Bone8,*Arm(*ForeArm(*Hand))))");
  EXPECT_EQ(map_to_canonical(s).missing(), (std::vector<std::string>{"left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"}));
  const std::map<std::string, std::string> by_hand = {{"left_hip", "Bone1"}, {"left_knee", "Bone2"},  {"left_ankle", "Bone3"}, {"right_hip", "Bone4"},  {"right_knee", "Bone5"},
                                                      {"right_ankle", "Bone6"}, {"head", "Bone8"},   {"left_wrist", ""}};
  const JointMap map = map_to_canonical(s, by_hand);
  EXPECT_TRUE(map.missing().empty());
  EXPECT_EQ(map.family, "by hand");
  EXPECT_EQ(name_of(s, map.source_of("left_knee")), "Bone2");
  EXPECT_EQ(name_of(s, map.source_of("head")), "Bone8");
  EXPECT_EQ(map.source_of("left_wrist"), -1);
  EXPECT_EQ(name_of(s, map.source_of("right_wrist")), "RightHand");
  EXPECT_EQ(map_to_canonical(s, {}).source, map_to_canonical(s).source);
  // The others are looked for around those that were named: toes below the ankle, the pelvis where the legs meet, the spine up from it.
  const Skeleton t = test::rig("Root(Middle(Bone%1(Bone%2(Bone%3(*ToeBase))),Spine=6(Chest=12(Neck=11(Head),Arm%1(*ForeArm(*Hand))))))");
  std::map<std::string, std::string> limbs;
  for (const bool left : {true, false})
    for (const auto& [part, joint] : {std::pair{"hip", "Bone%1"}, {"knee", "Bone%2"}, {"ankle", "Bone%3"}, {"shoulder", "Arm%1"}}) limbs[(left ? "left_" : "right_") + std::string(part)] = test::on_side(joint, left);
  expect_map(t, map_to_canonical(t, limbs), "Middle|Spine|-|Chest|Neck|Head", "-|Arm%1|*ForeArm|*Hand|Bone%1|Bone%2|Bone%3|*ToeBase");
  limbs["left_foot"] = limbs["right_foot"] = limbs["head"] = limbs["spine3"] = "";
  limbs["pelvis"] = "Root";
  expect_map(t, map_to_canonical(t, limbs), "Root|Middle|Spine|-|Neck|-", "-|Arm%1|*ForeArm|*Hand|Bone%1|Bone%2|Bone%3|-");
  const auto message = [&](const std::map<std::string, std::string>& hand) {
    try {
      map_to_canonical(s, hand);
    } catch (const Error& e) {
      EXPECT_EQ(e.status(), Exit::data);
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_NE(message({{"left_thigh", "Bone1"}}).find("'left_thigh', expected a joint of the canonical body: pelvis, left_hip"), std::string::npos);
  EXPECT_NE(message({{"left_hip", "Bone99"}}).find("'Bone99' for left_hip is not in the skeleton"), std::string::npos);
}

TEST(JointMap, DescribesWhatIsMissing) {
  const Skeleton s = test::rig("Hips(*UpLeg(*Leg(*Foot)),Spine(Neck(Head),Bone.012(Bone.013(Bone.014)),RightArm(RightForeArm(RightHand))))");
  const std::string text = describe_missing(s, map_to_canonical(s));
  EXPECT_NE(text.find("no joint found for left_shoulder, left_elbow among 16 joints"), std::string::npos) << text;
  for (const char* joint : {"Bone.012", "Bone.013", "Bone.014"}) EXPECT_NE(text.find(joint), std::string::npos) << text;
  EXPECT_EQ(text.find("RightArm"), std::string::npos) << text;
  std::string tree = "Root(";
  for (int k = 0; k < 40; ++k) tree += "B" + std::to_string(k) + (k < 39 ? "," : ")");
  const Skeleton many = test::rig(tree);
  const std::string long_text = describe_missing(many, map_to_canonical(many));
  EXPECT_NE(long_text.find("and 16 more"), std::string::npos) << long_text;
  EXPECT_EQ(long_text.find("B30"), std::string::npos) << long_text;
}

}  // namespace
}  // namespace mocap
