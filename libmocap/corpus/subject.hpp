// The people of the corpus: body proportions and movement style, drawn from (seed, gender, number).
//
// Gender shows in how a subject moves, not in where the body is: `style` holds ten independent traits of unit variance
// whose means differ by kGenderShift between the genders (pelvis obliquity, sway, counter-rotation of shoulders and
// hips, arm width, phase relations: where Troje 2002 found the difference in walking). Each alone separates the genders
// with about 70 % accuracy, all together with about 95 %; bodies, speeds and postures overlap almost completely.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "libmocap/base/random.hpp"
#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::corpus {

enum class Gender { female, male };
std::string text(Gender gender);

inline constexpr double kGenderShift = 1.15;

// The traits, in standard deviations; positive is the more female side of the mean for the first five.
enum Trait {
  kPelvisRoll,
  kPelvisSway,
  kPelvisYaw,
  kElbowSwing,
  kArmLag,
  kThoraxYaw,
  kThoraxSway,
  kArmWidth,
  kThoraxLag,
  kArmSwing,
  kTraits
};
using Style = std::array<double, kTraits>;

// Joint numbers of the canonical body (SMPL order).
enum Joint {
  kPelvis,
  kLeftHip,
  kRightHip,
  kSpine1,
  kLeftKnee,
  kRightKnee,
  kSpine2,
  kLeftAnkle,
  kRightAnkle,
  kSpine3,
  kLeftFoot,
  kRightFoot,
  kNeck,
  kLeftCollar,
  kRightCollar,
  kHead,
  kLeftShoulder,
  kRightShoulder,
  kLeftElbow,
  kRightElbow,
  kLeftWrist,
  kRightWrist,
  kJoints
};

// A scaled canonical body and the lengths that motions are planned with, metres. All of a leg (thigh, shank, ankle and
// sole height, foot) has one scale: scaling the root path by it carries a motion to the canonical body with feet on the
// ground.
struct BodyPlan {
  std::shared_ptr<const Skeleton> skeleton;
  double stature = 0, leg_scale = 1, arm_scale = 1;  // scales relative to the canonical 1.70 m body
  double thigh = 0, shank = 0, ankle_height = 0, ball_height = 0, heel_back = 0;
  Vector3 ankle_to_ball = Vector3::Zero();
  double hip_half_width = 0, hip_drop = 0;  // of the hip joints from the pelvis
  double leg() const { return thigh + shank; }
};
BodyPlan make_body(double stature, double leg_ratio, double trunk_ratio, double arm_ratio, double shoulder_ratio,
                   double hip_ratio);

struct Subject {
  Gender gender = Gender::female;
  int number = 1;
  std::string name;  // "f001", "m017"
  BodyPlan body;
  Style style{};
  double walk_speed = 1, walk_cadence = 1, jog_speed = 1, jog_cadence = 1;  // factors on the population mean
  double step_width = 1, bounce = 1, foot_roll = 1, knee_lift = 1;          // factors
  double lean = 0, head_pitch = 0, toe_out = 0, arm_abduction = 0, elbow = 0,
         arm_posture = 0;                   // radians added to the mean posture
  double side_asymmetry[2] = {1, 1};        // factor on the swing of the left and right limbs
  double step_asymmetry = 0;                // of the right footfall, cycles from 0.5
  double squat = 0.5;                       // lifting: 0 bends the back, 1 bends the knees
  double jump_height = 0.25, crouch = 0.3;  // metres; fraction of the leg
  double tempo = 1;                         // of scripted motions
};

// The same subject for equal (seed, gender, number), whatever else is drawn.
Subject draw_subject(std::uint64_t seed, Gender gender, int number);

// First index of every stream of a subject: stream_of(subject_stream(...), purpose, clip).
std::uint64_t subject_stream(Gender gender, int number);

}  // namespace mocap::corpus
