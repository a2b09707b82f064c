#pragma once
#include <cmath>
#include <memory>

#include "libmocap/base/random.hpp"
#include "libmocap/clip/clip.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap::features {

// A random but smooth motion that turns more than once about the vertical and leans strongly.
inline Clip smooth_clip(std::size_t frames, std::uint64_t seed, std::shared_ptr<const Skeleton> skeleton = canonical_body()) {
  Random random(seed, 0);
  Clip clip;
  clip.name = "smooth";
  clip.skeleton = skeleton;
  clip.frame_rate_hz = 30;
  const auto joints = static_cast<std::size_t>(skeleton->joint_count());
  std::vector<Vector3> axis, phase;
  for (std::size_t j = 0; j < joints; ++j) {
    axis.emplace_back(random.normal(), random.normal(), random.normal());
    phase.emplace_back(random.uniform(0, 6), random.uniform(0, 6), random.uniform(0, 6));
  }
  for (std::size_t t = 0; t < frames; ++t) {
    const double s = static_cast<double>(t) / 30;
    for (std::size_t j = 0; j < joints; ++j) {
      const Vector3 v(axis[j].x() * std::sin(2 * s + phase[j].x()), axis[j].y() * std::sin(3 * s + phase[j].y()), axis[j].z() * std::sin(s + phase[j].z()));
      clip.rotations.push_back(j == 0 ? yaw_rotation(2.5 * s) * exp_map(0.5 * v) : exp_map(v));
    }
    clip.root_position.emplace_back(3 * std::sin(s), 2 * s, 0.9 + 0.05 * std::sin(5 * s));
  }
  make_sign_continuous(clip);
  return clip;
}

}  // namespace mocap::features
