// A body described the way a planner thinks of it (pelvis, spine, arms, planted feet), and its joint rotations.
//
// World: metres, Z up; the body faces +X at yaw 0, left is +Y. Angles in radians; index 0 is left, 1 is right.
#pragma once
#include <array>
#include <span>

#include "libmocap/corpus/subject.hpp"
#include "libmocap/math/rotation.hpp"

namespace mocap::corpus {

inline constexpr double kMinKneeFlexion = 0.105;  // 6 degrees: a knee is never locked, so its angle stays smooth

struct FootState {
  Vector3 ball = Vector3::Zero();  // the toe-base joint
  double yaw = 0;
  double pitch = 0;      // of the foot, toes up positive
  double toe = 0;        // toes bent up relative to the foot
  bool planted = false;  // the ball of the foot stands still on the ground
};

struct ArmState {
  double swing = 0;                // forward (flexion) of the hanging arm
  double abduction = 0;            // away from the trunk
  double twist = 0;                // upper arm turned inwards
  double elbow = 0.1;              // flexion
  double lift = 0;                 // collar raised
  double reach = 0;                // 0: the angles above; 1: the wrist is at `hand`; between: the wrist is on the way
  Vector3 hand = Vector3::Zero();  // world
  double elbow_out = 0;            // of the reaching arm
};

struct BodyState {
  Vector3 pelvis = Vector3::Zero();
  double yaw = 0, tilt = 0, roll = 0;    // pelvis: heading, forward tilt, left side up
  double lean = 0, twist = 0, side = 0;  // spine relative to the pelvis: forward, to the left (about up), left side up
  double head_pitch = 0, head_yaw = 0;   // relative to the thorax, down and left positive
  double knee_in = 0;                    // knees turned towards each other
  std::array<ArmState, 2> arms;
  std::array<FootState, 2> feet;
};

// Foot geometry. A foot pitched up stands on its heel, one pitched down on its ball; `at` is where the ball rests flat.
FootState standing_foot(const BodyPlan& body, const Vector2& at, double yaw, double pitch);
Vector3 ankle_position(const BodyPlan& body, const FootState& foot);
Vector3 hip_position(const BodyPlan& body, const BodyState& state, int side);

// How far the pelvis must sink for both feet to be in reach with kMinKneeFlexion; 0 where they are. Metres.
double reach_deficit(const BodyPlan& body, const BodyState& state);

// Local rotations of the 22 joints. Legs (and reaching arms) by inverse kinematics: exact where in reach.
// out: [22]. Error(internal) for another size.
void pose_body(const BodyPlan& body, const BodyState& state, std::span<Quaternion> out);

}  // namespace mocap::corpus
