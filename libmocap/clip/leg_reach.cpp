#include "libmocap/clip/leg_reach.hpp"

#include <algorithm>
#include <cmath>

namespace mocap {

void reach(const Vector3& hip_position, double thigh, double shank, const Vector3& ankle, Quaternion& hip, Quaternion& knee) {
  const Vector3 wanted = ankle - hip_position;
  const Vector3 u = hip * Vector3(0, 0, -1), v = knee * Vector3(0, 0, -1), k = knee * Vector3(0, 1, 0);
  // A leg that is as straight already may stay so: the same body under other names keeps its motion.
  const double full = thigh + shank, soft = std::max(1e-13, std::min(0.005 * full, full - (thigh * u + shank * v).norm()));
  double distance = wanted.norm();
  if (distance < 1e-6) return;
  if (distance > full - soft) distance = full - soft * std::exp(-(distance - (full - soft)) / soft);
  // |thigh u + shank R(k, angle) v| = distance, with R turning the shank about the knee's own axis k.
  const double along = u.dot(k) * v.dot(k), a = u.dot(v) - along, b = u.dot(k.cross(v));
  const double cosine = (distance * distance - thigh * thigh - shank * shank) / (2 * thigh * shank);
  const double size = std::hypot(a, b);
  if (size > 1e-9) {
    const double angle = std::atan2(b, a) + std::acos(std::clamp((cosine - along) / size, -1.0, 1.0));
    knee = Quaternion(Eigen::AngleAxisd(angle, k)) * knee;
  }
  const Vector3 now = thigh * u + shank * (knee * Vector3(0, 0, -1));
  if (now.norm() < 1e-6) return;
  const Quaternion turn = rotation_between(now, wanted);
  hip = turn * hip;
  knee = turn * knee;
}

}  // namespace mocap
