// Rotations that break careless formulas: no turn, tiny turns, half turns, both quaternion signs, gimbal lock.
#pragma once
#include <cmath>
#include <numbers>
#include <vector>

#include "libmocap/math/rotation.hpp"

namespace mocap::testing {

inline constexpr double kPi = std::numbers::pi;

inline std::vector<Vector3> nasty_axes() {
  return {Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ(), -Vector3::UnitX(), -Vector3::UnitY(), -Vector3::UnitZ(),
          Vector3(1, -2, 3).normalized(), Vector3(-1, 2, -3).normalized()};
}

inline std::vector<double> nasty_angles() { return {0, 1e-12, 1e-7, 1e-4, 1, kPi - 1e-7, kPi}; }

// Written down from half angles, so that no function under test is used.
inline Quaternion turn(const Vector3& axis, double angle) {
  const Vector3 v = std::sin(angle / 2) * axis;
  return Quaternion(std::cos(angle / 2), v.x(), v.y(), v.z());
}

inline Quaternion negated(const Quaternion& q) { return Quaternion(-q.w(), -q.x(), -q.y(), -q.z()); }

inline std::vector<Quaternion> nasty_rotations() {
  std::vector<Quaternion> out;
  for (const Vector3& axis : nasty_axes())
    for (const double angle : nasty_angles()) out.push_back(turn(axis, angle));
  // A quarter turn, exact and missed by little, puts one or another Euler order in gimbal lock.
  for (int i = 0; i < 3; ++i)
    for (const double miss : {0.0, 1e-13, 1e-10, 1e-8, 1e-6, -1e-8})
      for (const double quarter : {kPi / 2, -kPi / 2})
        out.push_back(turn(Vector3::Unit((i + 1) % 3), 0.7) * turn(Vector3::Unit(i), quarter - miss) * turn(Vector3::Unit((i + 2) % 3), -1.1));
  const std::size_t n = out.size();
  for (std::size_t i = 0; i < n; ++i) out.push_back(negated(out[i]));
  return out;
}

}  // namespace mocap::testing
