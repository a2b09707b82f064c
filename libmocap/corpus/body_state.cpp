#include "libmocap/corpus/body_state.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/corpus/leg_ik.hpp"

namespace mocap::corpus {
namespace {

constexpr double kMaxKneeFlexion = 2.6, kMinElbowFlexion = 0.10, kMaxElbowFlexion = 2.5;

Quaternion about(int axis, double angle) {
  Quaternion q(std::cos(angle / 2), 0, 0, 0);
  q.coeffs()[axis] = std::sin(angle / 2);
  return q;
}

// Heading, then forward tilt, then roll: for pelvis and spine alike.
Quaternion attitude(double yaw, double tilt, double roll) { return about(2, yaw) * about(1, tilt) * about(0, roll); }

double side_sign(int side) { return side == 0 ? 1.0 : -1.0; }

Quaternion foot_rotation(const FootState& f) { return about(2, f.yaw) * about(1, -f.pitch); }

void pose_arm(const BodyPlan& body, const ArmState& arm, int side, const Quaternion& thorax, const Vector3& collar,
              std::span<Quaternion> out) {
  const auto& offsets = body.skeleton->rest_offsets;
  const double s = side_sign(side);
  const auto joint = [side](int left) { return static_cast<std::size_t>(left + side); };
  const Quaternion raise = about(0, s * arm.lift);
  const Quaternion hang =
      about(1, -arm.swing) * about(0, -s * (std::numbers::pi / 2 - arm.abduction)) * about(1, arm.twist);
  // In the T-pose the forearm bends forwards about the vertical: -Z on the left, +Z on the right.
  const Vector3 hinge(0, 0, -s);
  out[joint(kLeftCollar)] = raise;
  out[joint(kLeftShoulder)] = hang;
  out[joint(kLeftElbow)] = about(2, -s * arm.elbow);
  out[joint(kLeftWrist)] = about(2, -s * 0.08);
  if (arm.reach <= 0) return;

  const Quaternion world_collar = thorax * raise;
  const Vector3 shoulder = collar + world_collar * offsets[joint(kLeftShoulder)];
  const Vector3 upper = offsets[joint(kLeftElbow)], lower = offsets[joint(kLeftWrist)];
  const Vector3 free_hand = shoulder + world_collar * (hang * (upper + out[joint(kLeftElbow)] * lower));
  const Vector3 hand = free_hand + arm.reach * (arm.hand - free_hand);
  const Vector3 free_axis = world_collar * (hang * hinge);
  const Vector3 reach_axis = thorax * (about(0, s * arm.elbow_out) * Vector3(0, -1, 0));
  const TwoBone bones =
      solve_two_bones(upper, lower, hinge, hand - shoulder, free_axis + arm.reach * (reach_axis - free_axis),
                      kMinElbowFlexion, kMaxElbowFlexion);
  out[joint(kLeftShoulder)] = world_collar.conjugate() * bones.upper_world;
  out[joint(kLeftElbow)] = about(2, -s * bones.flexion);
}

void pose_leg(const BodyPlan& body, const BodyState& state, int side, std::span<Quaternion> out) {
  const auto& offsets = body.skeleton->rest_offsets;
  const auto joint = [side](int left) { return static_cast<std::size_t>(left + side); };
  const FootState& foot = state.feet[static_cast<std::size_t>(side)];
  const double knee_yaw = state.yaw + 0.5 * wrap_angle(foot.yaw - state.yaw) - side_sign(side) * state.knee_in;
  const Vector3 across = about(2, knee_yaw) * Vector3::UnitY();
  const Vector3 reach = ankle_position(body, foot) - hip_position(body, state, side);
  const TwoBone bones = solve_two_bones(offsets[joint(kLeftKnee)], offsets[joint(kLeftAnkle)], Vector3::UnitY(), reach,
                                        across, kMinKneeFlexion, kMaxKneeFlexion);
  const Quaternion knee = about(1, bones.flexion);
  out[joint(kLeftHip)] = out[kPelvis].conjugate() * bones.upper_world;
  out[joint(kLeftKnee)] = knee;
  out[joint(kLeftAnkle)] = (bones.upper_world * knee).conjugate() * foot_rotation(foot);
  out[joint(kLeftFoot)] = about(1, -foot.toe);
}

}  // namespace

FootState standing_foot(const BodyPlan& body, const Vector2& at, double yaw, double pitch) {
  FootState f;
  f.yaw = yaw;
  f.pitch = pitch;
  f.ball = Vector3(at.x(), at.y(), body.ball_height);
  if (pitch > 0) {
    // Turning about the heel on the ground lifts the ball and draws it back.
    const Vector3 flat(body.heel_back + body.ankle_to_ball.x(), 0, body.ball_height);
    f.ball += about(2, yaw) * (about(1, -pitch) * flat - flat);
  } else {
    f.toe = -pitch;
  }
  return f;
}

Vector3 ankle_position(const BodyPlan& body, const FootState& foot) {
  return foot.ball - foot_rotation(foot) * body.ankle_to_ball;
}

Vector3 hip_position(const BodyPlan& body, const BodyState& state, int side) {
  return state.pelvis + attitude(state.yaw, state.tilt, state.roll) *
                            body.skeleton->rest_offsets[static_cast<std::size_t>(kLeftHip + side)];
}

double reach_deficit(const BodyPlan& body, const BodyState& state) {
  const double limit = two_bone_reach(body.thigh, body.shank, kMinKneeFlexion + 0.002);
  double deficit = 0;
  for (int side = 0; side < 2; ++side) {
    const Vector3 leg =
        hip_position(body, state, side) - ankle_position(body, state.feet[static_cast<std::size_t>(side)]);
    const double height = std::sqrt(std::max(0.0, limit * limit - leg.head<2>().squaredNorm()));
    deficit = std::max(deficit, leg.z() - height);
  }
  return deficit;
}

void pose_body(const BodyPlan& body, const BodyState& state, std::span<Quaternion> out) {
  if (out.size() != kJoints)
    throw Error(Exit::internal, {},
                "pose_body: " + std::to_string(out.size()) + " rotations, expected " + std::to_string(kJoints));
  const auto& offsets = body.skeleton->rest_offsets;
  out[kPelvis] = attitude(state.yaw, state.tilt, state.roll);
  Quaternion world = out[kPelvis];
  Vector3 place = state.pelvis;
  constexpr std::array<std::pair<Joint, double>, 3> kSpine = {{{kSpine1, 0.36}, {kSpine2, 0.34}, {kSpine3, 0.30}}};
  for (const auto& [joint, share] : kSpine) {
    place += world * offsets[joint];
    out[joint] = attitude(share * state.twist, share * state.lean, share * state.side);
    world = world * out[joint];
  }
  out[kNeck] = attitude(0.4 * state.head_yaw, 0.4 * state.head_pitch, 0);
  out[kHead] = attitude(0.6 * state.head_yaw, 0.6 * state.head_pitch, 0);
  for (int side = 0; side < 2; ++side) {
    pose_arm(body, state.arms[static_cast<std::size_t>(side)], side, world,
             place + world * offsets[static_cast<std::size_t>(kLeftCollar + side)], out);
    pose_leg(body, state, side, out);
  }
}

}  // namespace mocap::corpus
