#include "libmocap/metrics/gait.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/math/rotation.hpp"

namespace mocap::metrics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double mean_step(const Clip& clip) {
  const int feet[2] = {clip.skeleton->find_role("left_foot"), clip.skeleton->find_role("right_foot")};
  if (feet[0] < 0 || feet[1] < 0 || clip.contacts.empty()) return kNaN;
  double sum = 0;
  std::size_t steps = 0;
  int last = -1;  // foot that came down last
  Vector3 place = Vector3::Zero();
  Pose pose;
  for (std::size_t t = 1; t < clip.frames(); ++t)
    for (int f = 0; f < 2; ++f) {
      const auto i = static_cast<std::size_t>(f);
      if (!clip.contacts[t][i] || clip.contacts[t - 1][i]) continue;
      world_pose(clip, t, pose);
      const Vector3& here = pose.positions[static_cast<std::size_t>(feet[f])];
      if (last == 1 - f) {
        sum += (here - place).head<2>().norm();
        ++steps;
      }
      last = f;
      place = here;
    }
  return steps > 0 ? sum / static_cast<double>(steps) : kNaN;
}

}  // namespace

Gait gait(const Clip& clip) {
  Gait out{kNaN, kNaN, mean_step(clip)};
  if (clip.frames() < 2) return out;
  const auto joints = static_cast<std::size_t>(clip.joints());
  double way = 0, turn = 0;
  for (std::size_t t = 1; t < clip.frames(); ++t) {
    way += (clip.root_position[t] - clip.root_position[t - 1]).head<2>().norm();
    turn += std::remainder(yaw_of(clip.rotations[t * joints]) - yaw_of(clip.rotations[(t - 1) * joints]), 2 * std::numbers::pi);
  }
  out.speed_mps = way / clip.seconds();
  out.turning_dps = turn * 180 / std::numbers::pi / clip.seconds();
  return out;
}

std::vector<Clip> stretches(const Clip& clip, std::size_t frames) {
  if (frames == 0) throw Error(Exit::internal, {}, "stretches of 0 frames");
  if (clip.frames() < frames) return {clip};
  std::vector<Clip> out;
  for (std::size_t first = 0; first + frames <= clip.frames(); first += frames) out.push_back(cut(clip, first, frames));
  return out;
}

}  // namespace mocap::metrics
