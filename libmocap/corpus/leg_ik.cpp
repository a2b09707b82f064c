#include "libmocap/corpus/leg_ik.hpp"

#include <algorithm>
#include <cmath>

namespace mocap::corpus {

double two_bone_reach(double a, double b, double flexion) {
  return std::sqrt(a * a + b * b + 2 * a * b * std::cos(flexion));
}

TwoBone solve_two_bones(const Vector3& upper, const Vector3& lower, const Vector3& hinge, const Vector3& reach,
                        const Vector3& hinge_world, double min_flexion, double max_flexion) {
  const double a = upper.norm(), b = lower.norm(), distance = reach.norm();
  const double wanted = std::acos(std::clamp((distance * distance - a * a - b * b) / (2 * a * b), -1.0, 1.0));
  TwoBone out;
  out.flexion = std::clamp(wanted, min_flexion, max_flexion);
  out.reached = std::abs(two_bone_reach(a, b, out.flexion) - distance) < 1e-6;
  const Vector3 local = (upper + Quaternion(Eigen::AngleAxisd(out.flexion, hinge)) * lower).normalized();
  const Vector3 along = reach / distance;
  const Vector3 axis = (hinge_world - along * along.dot(hinge_world)).normalized();
  RotationMatrix from, to;
  from << local, hinge, local.cross(hinge);
  to << along, axis, along.cross(axis);
  out.upper_world = Quaternion(RotationMatrix(to * from.transpose())).normalized();
  return out;
}

}  // namespace mocap::corpus
