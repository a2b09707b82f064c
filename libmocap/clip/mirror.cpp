#include "libmocap/clip/mirror.hpp"

#include <utility>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/joint_names.hpp"
#include "libmocap/skeleton/rest_pose.hpp"

namespace mocap {
namespace {

Quaternion reflected(const Quaternion& q) { return {q.w(), -q.x(), q.y(), -q.z()}; }
Vector3 reflected(const Vector3& v) { return {v.x(), -v.y(), v.z()}; }

Side opposite(Side side) { return side == Side::left ? Side::right : side == Side::right ? Side::left : Side::none; }

}  // namespace

std::vector<int> counterparts(const Skeleton& s) {
  const auto names = joint_names_of(s);
  const auto children = s.children();
  std::vector<int> pair(s.parents.size(), -1);
  pair[0] = 0;
  for (std::size_t j = 1; j < pair.size(); ++j) {
    // Below the counterpart of the parent: the same words and numbers on the other side.
    for (const int other : children[static_cast<std::size_t>(pair[static_cast<std::size_t>(s.parents[j])])]) {
      const JointName &a = names[j], &b = names[static_cast<std::size_t>(other)];
      if (a.words == b.words && a.numbers == b.numbers && b.side == opposite(a.side)) pair[j] = other;
    }
    if (pair[j] < 0) refuse({{}, 0, "joint " + s.joint_names[j]}, "no counterpart on the other side, expected one to mirror the skeleton");
  }
  return pair;
}

Clip mirror(const Clip& clip) {
  const Skeleton& s = *clip.skeleton;
  const auto pair = counterparts(s);
  const auto t_pose = t_pose_orientations(s, map_to_canonical(s));
  if (!t_pose) refuse({{}, 0, "skeleton"}, "its rest pose does not stand upright, expected one to mirror the skeleton");
  const std::size_t joints = s.parents.size();
  Clip out = clip;
  out.source.mirrored = !clip.source.mirrored;
  std::vector<Quaternion> world(joints);
  Pose pose;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    const auto local = out.frame(t);
    for (std::size_t j = 0; j < joints; ++j) {
      const auto other = static_cast<std::size_t>(pair[j]);
      world[j] = reflected(Quaternion(pose.rotations[other] * (*t_pose)[other].conjugate())) * (*t_pose)[j];
      local[j] = j == 0 ? world[j] : world[static_cast<std::size_t>(s.parents[j])].conjugate() * world[j];
      local[j].normalize();
      if (clip.translations.empty() || j == 0) continue;
      const auto parent = static_cast<std::size_t>(s.parents[j]), across = static_cast<std::size_t>(s.parents[other]);
      out.translations[t * joints + j] = (*t_pose)[parent].conjugate() * reflected(Vector3((*t_pose)[across] * clip.translations[t * joints + other]));
    }
    out.root_position[t] = reflected(clip.root_position[t]);
  }
  for (auto& c : out.contacts) std::swap(c[0], c[1]);
  for (auto& p : out.path) p.y() = -p.y();
  make_sign_continuous(out);
  return out;
}

}  // namespace mocap
