// Internal to libmocap/features.
#pragma once
#include <cmath>

#include "libmocap/math/rotation.hpp"

namespace mocap::features {

// Rotation vector of a quaternion without choosing the nearer half: continuous where the quaternion is.
inline Vector3 continuous_log(const Quaternion& q) {
  const double n = q.vec().norm();
  if (n < 1e-9) return 2 * q.vec() / (q.w() < 0 ? -1.0 : 1.0);
  return 2 * std::atan2(n, q.w()) / n * q.vec();
}

}  // namespace mocap::features
