#include "libmocap/clip/retarget.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "libmocap/base/error.hpp"
#include "libmocap/clip/leg_reach.hpp"
#include "libmocap/clip/pose_alignment.hpp"
#include "libmocap/skeleton/canonical_body.hpp"
#include "libmocap/skeleton/rest_pose.hpp"

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

// Heel above the toes, radians: between these the toe base takes over from the ankle. A foot is seldom quite flat when it is set down, and is not
// yet still where it stands on the heel alone.
constexpr double kOnHeel = -15 * std::numbers::pi / 180, kOnToes = -5 * std::numbers::pi / 180;
// And back again: with the heel that high the foot swings, and the leg had better follow the source's.
constexpr double kPushOff = 45 * std::numbers::pi / 180, kSwing = 75 * std::numbers::pi / 180;

}  // namespace

bool Retargeter::rest_pose_stands(const Skeleton& source) { return t_pose_orientations(source, map_to_canonical(source)).has_value(); }

void Retargeter::require_joints() const {
  if (!map_.missing().empty())
    refuse({{}, 0, "skeleton"}, describe_missing(*source_, map_) + "; expected a body with legs and arms", "--joint-map FILE says which joint is which");
}

Retargeter::Retargeter(std::shared_ptr<const Skeleton> source) : source_(std::move(source)), map_(map_to_canonical(*source_)) {
  require_joints();
  const auto t_pose = t_pose_orientations(*source_, map_);
  if (!t_pose) refuse({{}, 0, "skeleton"}, "its rest pose does not stand upright, expected legs down and arms out or down at zero rotation");
  find_bones();
  align_from_rest(*t_pose);
  measure_legs();
}

Retargeter::Retargeter(std::shared_ptr<const Skeleton> source, const Clip& motion) : source_(std::move(source)), map_(map_to_canonical(*source_)) {
  require_joints();
  find_bones();
  alignment_ = alignment_from_motion(motion, map_);
  measure_legs();
}

void Retargeter::find_bones() {
  const auto body = canonical_body();
  const auto canonical = rest_positions(*body);
  for (std::size_t c = 0; c < 22; ++c) {
    const char* child = bone_child(body->joint_names[c]);
    if (!child || map_.source[c] < 0) continue;
    const auto k = static_cast<std::size_t>(body->find(child));
    // A child joint this rig does not have: the next one up the chain gives the direction.
    int to = map_.source[k];
    for (; to < 0 && bone_child(child); to = map_.source_of(child)) child = bone_child(child);
    if (to >= 0) bones_.push_back({c, static_cast<std::size_t>(map_.source[c]), static_cast<std::size_t>(to), (canonical[k] - canonical[c]).normalized()});
  }
}

void Retargeter::align_from_rest(const std::vector<Quaternion>& t_pose) {
  const auto body = canonical_body();
  const auto p = t_pose_positions(*source_, t_pose);
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
        // But toes that hang straight down at rest belong to a foot that is not flat.
        const bool hangs = foot_hangs(ahead);
        if (!hangs) ahead.z() = 0;
        if (hangs) m[c] = m[c] * rotation_between(body->rest_offsets[static_cast<std::size_t>(body->find(name.substr(0, name.find('_')) + "_foot"))], ahead);
        else if (ahead.norm() > 1e-6) m[c] = m[c] * rotation_between(Vector3::UnitX(), ahead);
      }
    }
    for (const Bone& bone : bones_) {
      if (bone.joint != c) continue;
      const Vector3 d = p[bone.to] - p[bone.from];
      if (d.norm() > 1e-6) m[c] = m[c] * rotation_between(bone.direction, m[c].conjugate() * d);
    }
    if (from >= 0) alignment_[c] = t_pose[static_cast<std::size_t>(from)].conjugate() * m[c];
  }
}

void Retargeter::measure_legs() {
  const auto body = canonical_body();
  const auto offset = [&](std::size_t c) { return body->rest_offsets[c]; };
  const double length = leg_length(*source_, map_);
  if (!(length > 0)) refuse({{}, 0, "skeleton"}, "legs of length 0, expected bones between hip, knee and ankle");
  scale_ = leg_length(*body, map_to_canonical(*body)) / length;
  for (const std::size_t k : {0, 1}) {
    const std::string p = k == 0 ? "left_" : "right_";
    const auto index = [&](const char* part) { return static_cast<std::size_t>(body->find(p + part)); };
    Leg& leg = legs_[k];
    leg.hip = index("hip"), leg.knee = index("knee"), leg.ankle = index("ankle"), leg.foot = index("foot");
    leg.thigh = offset(leg.knee).norm(), leg.shank = offset(leg.ankle).norm(), leg.foot_offset = offset(leg.foot);
    leg.source_ankle = static_cast<std::size_t>(map_.source[leg.ankle]);
    leg.source_toe = map_.source[leg.foot];
    double own = 0;
    for (int j = map_.source[leg.ankle]; j != map_.source[leg.hip]; j = source_->parents[static_cast<std::size_t>(j)]) own += source_->rest_offsets[static_cast<std::size_t>(j)].norm();
    leg.lift = scale_ * own - leg.thigh - leg.shank;
    // In T-pose the canonical ankle is not turned, so the source's is turned by A^-1. Joints between ankle and toe are taken as straight.
    Vector3 toe = Vector3::Zero();
    for (int j = leg.source_toe; j >= 0 && j != map_.source[leg.ankle]; j = source_->parents[static_cast<std::size_t>(j)]) toe += source_->rest_offsets[static_cast<std::size_t>(j)];
    leg.toe_difference = scale_ * (alignment_[leg.ankle].conjugate() * toe) - leg.foot_offset;
  }
}

Vector3 Retargeter::ankle_target(const Leg& leg, const Pose& source, const Quaternion& foot) const {
  const Vector3 ankle = source.positions[leg.source_ankle];
  Vector3 target = scale_ * ankle + Vector3(0, 0, leg.lift);
  if (leg.source_toe < 0) return target;
  const double lift = std::asin(std::clamp(-(foot * Vector3::UnitX()).z(), -1.0, 1.0));  // of the heel, above 0 on the toes
  const double w = std::clamp(std::min((lift - kOnHeel) / (kOnToes - kOnHeel), (kSwing - lift) / (kSwing - kPushOff)), 0.0, 1.0);
  if (w == 0) return target;
  const Vector3 v_s = scale_ * (source.positions[static_cast<std::size_t>(leg.source_toe)] - ankle), v_c = foot * leg.foot_offset;
  return target + w * (v_s - v_c - yaw_rotation(yaw_of(foot)) * leg.toe_difference);
}

Clip Retargeter::apply(const Clip& clip) const {
  const auto body = canonical_body();
  Clip out = without_frames(clip);
  out.skeleton = body;
  out.source.scale *= scale_;
  out.source.origin *= scale_;
  out.segments = clip.segments;
  out.rotations.resize(clip.frames() * 22);
  out.root_position.resize(clip.frames());
  const auto left = static_cast<std::size_t>(map_.source[legs_[0].hip]), right = static_cast<std::size_t>(map_.source[legs_[1].hip]);
  const Vector3 hips = (body->rest_offsets[legs_[0].hip] + body->rest_offsets[legs_[1].hip]) / 2;
  Pose pose;
  std::array<Quaternion, 22> world;
  for (std::size_t t = 0; t < clip.frames(); ++t) {
    world_pose(clip, t, pose);
    for (std::size_t c = 0; c < 22; ++c) {
      const int s = map_.source[c];
      world[c] = s >= 0 ? pose.rotations[static_cast<std::size_t>(s)] * alignment_[c] : world[static_cast<std::size_t>(body->parents[c])];
    }
    for (const Bone& bone : bones_) {
      const Vector3 d = pose.positions[bone.to] - pose.positions[bone.from], now = world[bone.joint] * bone.direction;
      const double length = d.norm();
      if (length > 1e-6 && (d / length - now).squaredNorm() > 1e-14) world[bone.joint] = rotation_between(now, d) * world[bone.joint];
    }
    out.root_position[t] = scale_ * (pose.positions[left] + pose.positions[right]) / 2 - world[0] * hips;
    for (const Leg& leg : legs_)
      reach(out.root_position[t] + world[0] * body->rest_offsets[leg.hip], leg.thigh, leg.shank, ankle_target(leg, pose, world[leg.ankle]), world[leg.hip], world[leg.knee]);
    const auto local = out.frame(t);
    for (std::size_t c = 0; c < 22; ++c) {
      local[c] = c == 0 ? world[c] : world[static_cast<std::size_t>(body->parents[c])].conjugate() * world[c];
      local[c].normalize();
    }
  }
  make_sign_continuous(out);
  return out;
}

}  // namespace mocap
