#include "libmocap/clip/retarget.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include "libmocap/base/error.hpp"
#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

// The child whose direction a canonical joint's bone takes; nullptr: upright or straight on from the parent.
const char* bone_child(const std::string& joint) {
  static const std::map<std::string, const char*> next = {
      {"left_hip", "left_knee"},       {"right_hip", "right_knee"},       {"left_knee", "left_ankle"},   {"right_knee", "right_ankle"},
      {"spine1", "spine2"},            {"spine2", "spine3"},              {"spine3", "neck"},            {"neck", "head"},
      {"left_collar", "left_shoulder"}, {"right_collar", "right_shoulder"}, {"left_shoulder", "left_elbow"}, {"right_shoulder", "right_elbow"},
      {"left_elbow", "left_wrist"},    {"right_elbow", "right_wrist"}};
  const auto it = next.find(joint);
  return it == next.end() ? nullptr : it->second;
}

double leg(const std::vector<Vector3>& p, int hip, int knee, int ankle) {
  const auto at = [&](int j) { return p[static_cast<std::size_t>(j)]; };
  return (at(knee) - at(hip)).norm() + (at(ankle) - at(knee)).norm();
}

}  // namespace

Retargeter::Retargeter(std::shared_ptr<const Skeleton> source) : source_(std::move(source)), map_(map_to_canonical(*source_)) {
  const auto body = canonical_body();
  if (const auto absent = map_.missing(); !absent.empty())
    refuse({{}, 0, "skeleton"}, fmt::format("no joint found for {} among its {} joints, expected a body with legs and arms", fmt::join(absent, ", "), source_->joint_count()));
  const auto t_pose = t_pose_orientations(*source_, map_);
  if (!t_pose)
    refuse({{}, 0, "skeleton"}, "its rest pose does not stand upright and the rig is of no known family, expected legs down at zero rotation");

  const auto n = static_cast<std::size_t>(source_->joint_count());
  std::vector<Vector3> p(n, Vector3::Zero());
  for (std::size_t j = 1; j < n; ++j) {
    const auto parent = static_cast<std::size_t>(source_->parents[j]);
    p[j] = p[parent] + (*t_pose)[parent] * source_->rest_offsets[j];
  }
  const auto canonical = rest_positions(*body);
  std::vector<Quaternion> m(22, Quaternion::Identity());
  alignment_.assign(22, Quaternion::Identity());
  for (std::size_t c = 0; c < 22; ++c) {
    const std::string& name = body->joint_names[c];
    if (c > 0) m[c] = m[static_cast<std::size_t>(body->parents[c])];
    const int from = map_.source[c];
    if (name == "head" || name == "pelvis") m[c] = Quaternion::Identity();
    if (name.ends_with("_ankle")) {
      // The sole is flat in T-pose however the ankle-to-toe line falls: only the toes' outward turn counts.
      const int toe = map_.source_of(name.substr(0, name.find('_')) + "_foot");
      if (toe >= 0) {
        Vector3 ahead = m[c].conjugate() * (p[static_cast<std::size_t>(toe)] - p[static_cast<std::size_t>(from)]);
        ahead.z() = 0;
        if (ahead.norm() > 1e-6) m[c] = m[c] * rotation_between(Vector3::UnitX(), ahead);
      }
    } else if (const char* child = bone_child(name); child && from >= 0) {
      // A child joint this rig does not have: the next one up the chain gives the direction.
      int to = map_.source_of(child);
      for (std::string next = child; to < 0 && bone_child(next);) {
        next = bone_child(next);
        to = map_.source_of(next);
      }
      const auto k = static_cast<std::size_t>(body->find(child));
      if (to >= 0) {
        const Vector3 d = p[static_cast<std::size_t>(to)] - p[static_cast<std::size_t>(from)];
        if (d.norm() > 1e-6) m[c] = m[c] * rotation_between(canonical[k] - canonical[c], m[c].conjugate() * d);
      }
    }
    if (from >= 0) alignment_[c] = (*t_pose)[static_cast<std::size_t>(from)].conjugate() * m[c];
  }
  const auto mean_leg = [](const std::vector<Vector3>& q, const std::array<int, 6>& j) { return (leg(q, j[0], j[1], j[2]) + leg(q, j[3], j[4], j[5])) / 2; };
  std::array<int, 6> ours{}, theirs{};
  const char* const names[] = {"left_hip", "left_knee", "left_ankle", "right_hip", "right_knee", "right_ankle"};
  for (std::size_t i = 0; i < 6; ++i) {
    ours[i] = body->find(names[i]);
    theirs[i] = map_.source_of(names[i]);
  }
  const double length = mean_leg(p, theirs);
  if (!(length > 0)) refuse({{}, 0, "skeleton"}, "legs of length 0, expected bones between hip, knee and ankle");
  scale_ = mean_leg(canonical, ours) / length;
}

Clip Retargeter::apply(const Clip& clip) const {
  const auto body = canonical_body();
  Clip out;
  out.name = clip.name;
  out.skeleton = body;
  out.frame_rate_hz = clip.frame_rate_hz;
  out.attributes = clip.attributes;
  out.source = clip.source;
  out.segments = clip.segments;
  out.path = clip.path;
  out.rotations.resize(clip.frames() * 22);
  out.root_position.resize(clip.frames());
  const auto left = static_cast<std::size_t>(map_.source_of("left_hip")), right = static_cast<std::size_t>(map_.source_of("right_hip"));
  const Vector3 hips = (body->rest_offsets[static_cast<std::size_t>(body->find("left_hip"))] + body->rest_offsets[static_cast<std::size_t>(body->find("right_hip"))]) / 2;
  Pose pose;
  std::array<Quaternion, 22> world;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    const auto local = out.frame(t);
    for (std::size_t c = 0; c < 22; ++c) {
      const int s = map_.source[c], parent = body->parents[c];
      world[c] = s >= 0 ? pose.rotations[static_cast<std::size_t>(s)] * alignment_[c] : world[static_cast<std::size_t>(parent)];
      local[c] = parent < 0 ? world[c] : world[static_cast<std::size_t>(parent)].conjugate() * world[c];
      local[c].normalize();
    }
    out.root_position[t] = scale_ * (pose.positions[left] + pose.positions[right]) / 2 - world[0] * hips;
  }
  make_sign_continuous(out);
  return out;
}

}  // namespace mocap
