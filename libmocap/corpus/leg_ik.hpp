// Analytic inverse kinematics of two bones joined by a hinge: hip-knee-ankle, shoulder-elbow-wrist.
//
//   |reach|^2 = a^2 + b^2 + 2 a b cos(flexion)          (law of cosines; flexion 0 is a straight limb)
//   R (upper + Rot(hinge, flexion) lower) = reach,  R hinge as near to hinge_world as that allows
//
// upper, lower  the bones in the rest pose, metres, parallel to each other and perpendicular to `hinge` (unit).
// reach         from the first joint to the wanted end, world, metres; not 0 and not parallel to hinge_world.
// flexion       radians, kept within [min_flexion, max_flexion]: an unreachable end keeps its direction.
// Exact to rounding where reachable. Cost: two square roots and one arc cosine. Thread-safe.
#pragma once
#include "libmocap/math/rotation.hpp"

namespace mocap::corpus {

struct TwoBone {
  Quaternion upper_world;  // world rotation of the upper bone
  double flexion = 0;
  bool reached = true;
};

TwoBone solve_two_bones(const Vector3& upper, const Vector3& lower, const Vector3& hinge, const Vector3& reach,
                        const Vector3& hinge_world, double min_flexion, double max_flexion);

// Distance from first joint to end at a flexion.
double two_bone_reach(double a, double b, double flexion);

}  // namespace mocap::corpus
