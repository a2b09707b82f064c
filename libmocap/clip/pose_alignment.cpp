#include "libmocap/clip/pose_alignment.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

constexpr std::size_t kFrames = 512;

// The rotation that takes (a, b) to (to_a, to_b): a to to_a exactly, b into the half-plane of to_b. Needs pairs that are not parallel.
Quaternion aligning(const Vector3& a, const Vector3& b, const Vector3& to_a, const Vector3& to_b) {
  const auto frame = [](const Vector3& x, const Vector3& y) {
    RotationMatrix m;
    m.col(0) = x.normalized();
    m.col(2) = x.cross(y).normalized();
    m.col(1) = m.col(2).cross(m.col(0));
    return m;
  };
  return to_quaternion(RotationMatrix(frame(to_a, to_b) * frame(a, b).transpose()));
}

bool independent(const Vector3& a, const Vector3& b) { return a.norm() > 1e-6 && b.norm() > 1e-6 && a.normalized().cross(b.normalized()).norm() > 0.02; }

class Observer {
 public:
  Observer(const Clip& clip, const JointMap& map) : map_(map), rate_(clip.frame_rate_hz) {
    const std::size_t step = std::max<std::size_t>(1, clip.frames() / kFrames);
    for (std::size_t t = 0; t < clip.frames(); t += step) {
      poses_.emplace_back();
      world_pose(clip, t, poses_.back());
      before_.emplace_back();
      world_pose(clip, t > 0 ? t - 1 : std::min<std::size_t>(1, clip.frames() - 1), before_.back());
    }
  }

  std::size_t size() const { return poses_.size(); }
  bool has(const std::string& name) const { return map_.source_of(name) >= 0; }
  Vector3 at(std::size_t t, const std::string& name) const { return poses_[t].positions[index(name)]; }
  Quaternion rotation(std::size_t t, const std::string& name) const { return poses_[t].rotations[index(name)]; }
  Vector3 across(std::size_t t, const char* part) const { return at(t, std::string("left_") + part) - at(t, std::string("right_") + part); }
  Vector3 trunk(std::size_t t) const {
    return ((at(t, "left_shoulder") + at(t, "right_shoulder") - at(t, "left_hip") - at(t, "right_hip")) / 2).normalized();
  }
  Vector3 forward(std::size_t t) const { return (across(t, "hip") + across(t, "shoulder")).cross(trunk(t)).normalized(); }
  double speed(std::size_t t, const std::string& name) const { return (at(t, name) - before_[t].positions[index(name)]).norm() * rate_; }

  // Sum over the frames of a world vector as the joint sees it.
  template <class Seen>
  Vector3 mean(const std::string& joint, const Seen& seen) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t t = 0; t < size(); ++t) sum += rotation(t, joint).conjugate() * Vector3(seen(t));
    return sum / static_cast<double>(size());
  }

 private:
  std::size_t index(const std::string& name) const { return static_cast<std::size_t>(map_.source_of(name)); }
  const JointMap& map_;
  double rate_;
  std::vector<Pose> poses_, before_;
};

}  // namespace

std::vector<Quaternion> alignment_from_motion(const Clip& clip, const JointMap& map) {
  const auto body = canonical_body();
  const Observer seen(clip, map);
  std::vector<Quaternion> out(22, Quaternion::Identity());
  const auto set = [&](const std::string& joint, const Quaternion& q) { out[static_cast<std::size_t>(body->find(joint))] = q; };
  const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY(), z = Vector3::UnitZ();
  // Canonical directions a (exact) and b, and where the motion shows them; `else_b` where b was never seen.
  const auto align = [&](const std::string& joint, const Vector3& a, const Vector3& seen_a, const Vector3& b, const Vector3& seen_b, const Vector3& else_b, const Vector3& seen_else) {
    if (independent(seen_a, seen_b)) set(joint, aligning(a, b, seen_a, seen_b));
    else if (independent(seen_a, seen_else)) set(joint, aligning(a, else_b, seen_a, seen_else));
    else if (seen_a.norm() > 1e-6) set(joint, rotation_between(a, seen_a));
  };
  const auto bone = [&](const std::string& from, const std::string& to) {
    return seen.mean(from, [&](std::size_t t) { return Vector3(seen.at(t, to) - seen.at(t, from)); });
  };
  const auto trunk_of = [&](const std::string& j) { return seen.mean(j, [&](std::size_t t) { return seen.trunk(t); }); };
  const auto forward_of = [&](const std::string& j) { return seen.mean(j, [&](std::size_t t) { return seen.forward(t); }); };
  const auto across_of = [&](const std::string& j, const char* part) { return seen.mean(j, [&](std::size_t t) { return seen.across(t, part); }); };

  align("pelvis", y, across_of("pelvis", "hip"), z, trunk_of("pelvis"), x, forward_of("pelvis"));
  const std::array<std::string, 5> trunk = {"spine1", "spine2", "spine3", "neck", "head"};
  for (std::size_t k = 0; k + 1 < trunk.size(); ++k) {
    if (!seen.has(trunk[k])) continue;
    std::size_t next = k + 1;
    while (next < trunk.size() && !seen.has(trunk[next])) ++next;
    const Vector3 up = next < trunk.size() ? bone(trunk[k], trunk[next]) : trunk_of(trunk[k]);
    align(trunk[k], z, up.norm() > 1e-6 ? up : trunk_of(trunk[k]), y, k < 2 ? Vector3(across_of(trunk[k], "hip") + across_of(trunk[k], "shoulder")) : across_of(trunk[k], "shoulder"), x,
          forward_of(trunk[k]));
  }
  if (seen.has("head")) align("head", z, seen.mean("head", [&](std::size_t t) { return seen.trunk(t).z() > 0.5 ? z : seen.trunk(t); }), y, across_of("head", "shoulder"), x, forward_of("head"));

  for (const bool left : {true, false}) {
    const std::string p = left ? "left_" : "right_";
    const Vector3 out_y = left ? y : Vector3(-y), flexion = left ? Vector3(-z) : z;
    // The axis about which the lower bone turns against the upper one; long where it is bent.
    const auto hinge = [&](const std::string& joint, const std::string& a, const std::string& b, const std::string& c) {
      return seen.mean(joint, [&](std::size_t t) { return Vector3((seen.at(t, b) - seen.at(t, a)).normalized().cross((seen.at(t, c) - seen.at(t, b)).normalized())); });
    };
    const std::string hip = p + "hip", knee = p + "knee", ankle = p + "ankle", toe = p + "foot", shoulder = p + "shoulder", elbow = p + "elbow", wrist = p + "wrist", collar = p + "collar";
    for (const auto& j : {hip, knee}) {
      const Vector3 turn = hinge(j, hip, knee, ankle);
      align(j, -z, j == hip ? bone(hip, knee) : bone(knee, ankle), y, turn.norm() > 0.03 ? turn : Vector3::Zero(), y, across_of(j, "hip"));
    }
    // A foot that stands is still, and its shank is nearly upright; one that never stands is taken as square to the shank.
    const auto shank = [&](std::size_t t) { return Vector3((seen.at(t, knee) - seen.at(t, ankle)).normalized()); };
    const Vector3 standing = seen.mean(ankle, [&](std::size_t t) { return seen.speed(t, ankle) < 0.15 && shank(t).z() > 0.85 ? z : Vector3(Vector3::Zero()); });
    const Vector3 foot_up = standing.norm() > 0.02 ? standing : seen.mean(ankle, shank);
    align(ankle, z, foot_up, x, seen.has(toe) ? bone(ankle, toe) : Vector3(Vector3::Zero()), y, seen.mean(ankle, [&](std::size_t t) { return Vector3(seen.rotation(t, knee) * (out[static_cast<std::size_t>(body->find(knee))] * y)); }));
    if (seen.has(collar)) align(collar, out_y, bone(collar, shoulder), z, trunk_of(collar), x, forward_of(collar));
    for (const auto& j : {shoulder, elbow}) {
      const Vector3 along = j == shoulder ? bone(shoulder, elbow) : seen.has(wrist) ? bone(elbow, wrist) : Vector3(Vector3::Zero());
      const Vector3 turn = seen.has(wrist) ? hinge(j, shoulder, elbow, wrist) : Vector3(Vector3::Zero());
      align(j, out_y, along, flexion, turn.norm() > 0.03 ? turn : Vector3::Zero(), x, forward_of(j));
    }
    // Average orientation against the neighbour that is known.
    const auto follow = [&](const std::string& joint, const std::string& known) {
      if (!seen.has(joint)) return;
      const Quaternion& a = out[static_cast<std::size_t>(body->find(known))];
      const auto image = [&](const Vector3& v) { return seen.mean(joint, [&](std::size_t t) { return Vector3(seen.rotation(t, known) * (a * v)); }); };
      align(joint, x, image(x), z, image(z), y, image(y));
    };
    follow(toe, ankle);
    follow(wrist, elbow);
  }
  return out;
}

}  // namespace mocap
