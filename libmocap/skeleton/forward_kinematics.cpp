#include "libmocap/skeleton/forward_kinematics.hpp"

#include "libmocap/base/error.hpp"

namespace mocap {

void forward_kinematics(const Skeleton& s, std::span<const Quaternion> local, const Vector3& root_position, Pose& out,
                        std::span<const Vector3> translations) {
  const std::size_t n = s.parents.size();
  if (local.size() != n || (!translations.empty() && translations.size() != n))
    throw Error(Exit::internal, {}, "forward_kinematics: " + std::to_string(local.size()) + " rotations for " + std::to_string(n) + " joints");
  out.rotations.resize(n);
  out.positions.resize(n);
  out.rotations[0] = local[0];
  out.positions[0] = root_position;
  for (std::size_t j = 1; j < n; ++j) {
    const auto p = static_cast<std::size_t>(s.parents[j]);
    out.rotations[j] = out.rotations[p] * local[j];
    out.positions[j] = out.positions[p] + out.rotations[p] * (translations.empty() ? s.rest_offsets[j] : translations[j]);
  }
}

std::vector<Vector3> end_site_positions(const Skeleton& s, const Pose& pose) {
  std::vector<Vector3> out;
  out.reserve(s.end_sites.size());
  for (const auto& e : s.end_sites) {
    const auto p = static_cast<std::size_t>(e.parent);
    out.push_back(pose.positions[p] + pose.rotations[p] * e.offset);
  }
  return out;
}

}  // namespace mocap
