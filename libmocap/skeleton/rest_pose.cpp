#include "libmocap/skeleton/rest_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

bool is_bandai_namco(const Skeleton& s) {
  for (const char* name : {"joint_Root", "Hips", "UpperLeg_L", "LowerLeg_L", "LowerLeg_R", "UpperArm_L", "LowerArm_L", "LowerArm_R", "Hand_R", "Toes_L"})
    if (s.find(name) < 0) return false;
  // Another rig may bear the same names; the table is for the one whose bones lie along X, the right side's backwards. Y up has become Z up.
  const auto along = [&](const char* name) { return s.rest_offsets[static_cast<std::size_t>(s.find(name))].normalized().y(); };
  return along("LowerLeg_L") > 0.999 && along("LowerLeg_R") < -0.999 && along("LowerArm_L") > 0.999 && along("LowerArm_R") < -0.999;
}

// Rotation whose columns are the images of the joint's local X and Y axes.
Quaternion axes(const Vector3& x, const Vector3& y) {
  RotationMatrix m;
  m.col(0) = x;
  m.col(1) = y;
  m.col(2) = x.cross(y);
  return to_quaternion(m);
}

// Bandai-Namco Research motion data: local +X runs down the bone on the left and centre, up the bone on the right; the
// hinge of knee and elbow is +-Y. The table speaks of the rig's own axes as they stand in the BVH file, before the file's
// Y-up axes are permuted (to_metres_z_up conjugates every joint frame by the same permutation, undone here).
Quaternion bandai_namco_t_pose(const std::string& joint) {
  const Vector3 fwd = Vector3::UnitX(), left = Vector3::UnitY(), up = Vector3::UnitZ();
  const bool right = joint.ends_with("_R");
  const auto is = [&](const char* part) { return joint.starts_with(part); };
  if (joint == "Hips") return axes(up, -left);
  // The head's bone axis leans with the neck: level gaze lies 25 degrees above the local Y axis (mean over level walks).
  if (joint == "Head") return Quaternion(Eigen::AngleAxisd(25 * std::numbers::pi / 180, left)) * axes(up, fwd);
  if (is("UpperLeg") || is("LowerLeg")) return right ? axes(up, left) : axes(-up, left);
  if (is("Foot") || is("Toes")) {
    // With the sole flat the axis ankle-to-toe falls by this angle; the toe's own axis likewise (median over stance).
    const double fall = (is("Foot") ? 40.0 : 21.5) * std::numbers::pi / 180;
    const Vector3 along = std::cos(fall) * fwd - std::sin(fall) * up;
    return right ? axes(-along, left) : axes(along, left);
  }
  if (is("Shoulder") || is("UpperArm") || is("LowerArm") || is("Hand")) return right ? axes(left, -up) : axes(left, up);
  return axes(up, fwd);  // spine, chest, neck
}

// Where the body stands in its rest pose: the columns are forward, left and up. nullopt where it does not stand.
std::optional<RotationMatrix> standing_frame(const Skeleton& s, const JointMap& map) {
  const auto p = rest_positions(s);
  const auto at = [&](const char* name) -> std::optional<Vector3> {
    const int j = map.source_of(name);
    if (j < 0) return std::nullopt;
    return p[static_cast<std::size_t>(j)];
  };
  const auto direction = [&](const char* from, const char* to) -> Vector3 {
    const auto a = at(from), b = at(to);
    return a && b && (*b - *a).norm() > 1e-9 ? Vector3((*b - *a).normalized()) : Vector3::Zero();
  };
  const Vector3 legs[] = {direction("left_ankle", "left_hip"), direction("right_ankle", "right_hip")};
  Vector3 up = legs[0] + legs[1];
  if (up.norm() < 1e-9) return std::nullopt;
  up.normalize();
  const auto middle = [&](const std::string& part) -> std::optional<Vector3> {
    const auto l = at(("left_" + part).c_str()), r = at(("right_" + part).c_str());
    return l && r ? std::optional<Vector3>((*l + *r) / 2) : std::nullopt;
  };
  const auto hips = middle("hip"), chest = middle("shoulder");
  const Vector3 trunk = hips && chest && (*chest - *hips).norm() > 1e-9 ? Vector3((*chest - *hips).normalized()) : up;
  // Legs that stand nearly along an axis of the file stand along it: a figure is not tilted because its legs are spread. Where its
  // trunk goes with them it is, beyond 8 degrees.
  int axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  const Vector3 along = std::copysign(1.0, up[axis]) * Vector3::Unit(axis);
  if (up.dot(along) > (trunk.dot(up) > trunk.dot(along) ? 0.990 : 0.94)) up = along;
  Vector3 left = direction("right_hip", "left_hip") + direction("right_shoulder", "left_shoulder");
  left -= left.dot(up) * up;
  if (left.norm() < 0.5) return std::nullopt;
  left.normalize();
  // Arms may point out, or down along the body: aligning bone directions by the shortest rotation (retarget.hpp) then lifts
  // them in the frontal plane, which keeps the twist of a T-pose.
  if (std::min(legs[0].dot(up), legs[1].dot(up)) < 0.85) return std::nullopt;
  // Neither does who sits: knees are straight, and the trunk is in line with them.
  for (const auto& [from, to] : {std::pair{"left_knee", "left_hip"}, {"right_knee", "right_hip"}, {"left_ankle", "left_knee"}, {"right_ankle", "right_knee"}})
    if (const Vector3 d = direction(from, to); d.norm() > 0 && d.dot(up) < 0.8) return std::nullopt;
  if (trunk.dot(up) < 0.8) return std::nullopt;
  RotationMatrix frame;
  frame << left.cross(up), left, up;
  return frame;
}

}  // namespace

std::optional<std::vector<Quaternion>> t_pose_orientations(const Skeleton& s, const JointMap& map) {
  const auto n = static_cast<std::size_t>(s.joint_count());
  if (is_bandai_namco(s)) {
    // Local frames were conjugated by the permutation C that makes Y up Z up: a local vector v of the file is C v now.
    RotationMatrix c;
    c << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    const Quaternion undo = to_quaternion(c).conjugate();
    std::vector<Quaternion> out(n);
    for (std::size_t j = 0; j < n; ++j) out[j] = bandai_namco_t_pose(s.joint_names[j]) * undo;
    return out;
  }
  const auto frame = standing_frame(s, map);
  if (!frame) return std::nullopt;
  return std::vector<Quaternion>(n, to_quaternion(RotationMatrix(frame->transpose())));
}

std::optional<Vector3> rest_up(const Skeleton& s, const JointMap& map) {
  const auto frame = standing_frame(s, map);
  return frame ? std::optional<Vector3>(frame->col(2)) : std::nullopt;
}

bool foot_hangs(const Vector3& ankle_to_toe) { return ankle_to_toe.norm() > 1e-6 && -ankle_to_toe.normalized().z() > 0.906; }

std::vector<Vector3> t_pose_positions(const Skeleton& s, const std::vector<Quaternion>& t_pose) {
  std::vector<Vector3> p(s.parents.size(), Vector3::Zero());
  for (std::size_t j = 1; j < p.size(); ++j) {
    const auto parent = static_cast<std::size_t>(s.parents[j]);
    p[j] = p[parent] + t_pose[parent] * s.rest_offsets[j];
  }
  return p;
}

double leg_length(const Skeleton& s, const JointMap& map) {
  const auto side = [&](const char* hip, const char* ankle) {
    const int from = map.source_of(hip);
    double length = 0;
    for (int j = map.source_of(ankle); j != from; j = s.parents[static_cast<std::size_t>(j)]) {
      if (j < 0 || from < 0) return 0.0;
      length += s.rest_offsets[static_cast<std::size_t>(j)].norm();
    }
    return length;
  };
  const double left = side("left_hip", "left_ankle"), right = side("right_hip", "right_ankle");
  return left > 0 && right > 0 ? (left + right) / 2 : std::max(left, right);
}

SoleHeights sole_heights(const Skeleton& s) {
  const JointMap map = map_to_canonical(s);
  const auto index = [&](const char* name) { return map.source_of(name); };
  const int ankle = index("left_ankle"), toe = index("left_foot");
  if (const auto t_pose = ankle >= 0 ? t_pose_orientations(s, map) : std::nullopt) {
    const auto p = t_pose_positions(s, *t_pose);
    const auto at = [&](int j) { return p[static_cast<std::size_t>(j)].z(); };
    std::vector<char> of_foot(p.size(), 0);
    double lowest = std::numeric_limits<double>::infinity();
    for (int j = ankle; j < s.joint_count(); ++j) {
      const auto k = static_cast<std::size_t>(j);
      of_foot[k] = j == ankle || of_foot[static_cast<std::size_t>(s.parents[k])];
      if (of_foot[k] && j != ankle) lowest = std::min(lowest, at(j));
    }
    for (const auto& e : s.end_sites) {
      const auto k = static_cast<std::size_t>(e.parent);
      if (of_foot[k]) lowest = std::min(lowest, (p[k] + (*t_pose)[k] * e.offset).z());
    }
    const bool hangs = toe >= 0 && foot_hangs(p[static_cast<std::size_t>(toe)] - p[static_cast<std::size_t>(ankle)]);
    if (!hangs && lowest < at(ankle) - 0.01) return {at(toe >= 0 ? toe : ankle) - lowest + kToeTipHeight, at(ankle) - lowest + kToeTipHeight};
  }
  const double length = leg_length(s, map);
  const double scale = length > 0 ? length / leg_length(*canonical_body(), map_to_canonical(*canonical_body())) : 1;
  return {scale * (toe >= 0 ? kFootSoleHeight : kAnkleSoleHeight), scale * kAnkleSoleHeight};
}

}  // namespace mocap
