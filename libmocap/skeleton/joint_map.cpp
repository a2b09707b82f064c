#include "libmocap/skeleton/joint_map.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>

#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

std::string normalised(std::string_view name) {
  if (const auto colon = name.rfind(':'); colon != std::string_view::npos) name = name.substr(colon + 1);
  std::string s;
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c))) s += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char* prefix : {"mixamorig", "bip01", "joint"})
    if (s.starts_with(prefix) && s.size() > std::string_view(prefix).size()) s = s.substr(std::string_view(prefix).size());
  return s;
}

// Part names without a side, best first. A name that means the clavicle in one convention means the upper arm in
// another ("LeftShoulder"): the order of search in map_to_canonical settles that.
const std::vector<std::string> kHip = {"upleg", "thigh", "upperleg", "hip", "femur"};
const std::vector<std::string> kKnee = {"knee", "shin", "lowerleg", "lowleg", "calf", "tibia", "leg"};
const std::vector<std::string> kAnkle = {"ankle", "foot"};
const std::vector<std::string> kToe = {"toebase", "toes", "toe", "foot", "ball"};
const std::vector<std::string> kArm = {"upperarm", "uparm", "arm", "humerus", "shoulder"};
const std::vector<std::string> kCollar = {"collar", "clavicle", "collarbone", "shoulder"};
const std::vector<std::string> kElbow = {"elbow", "forearm", "lowerarm", "lowarm", "radius"};
const std::vector<std::string> kWrist = {"wrist", "hand"};
const std::vector<std::string> kPelvis = {"hips", "pelvis", "hip", "root"};
const std::vector<std::string> kHead = {"head"};
const std::vector<std::string> kNeck = {"neck"};

class Finder {
 public:
  explicit Finder(const Skeleton& s) : skeleton_(s) {
    for (int j = 0; j < s.joint_count(); ++j) names_.emplace(normalised(s.joint_names[static_cast<std::size_t>(j)]), j);
  }
  int centre(const std::vector<std::string>& parts) const {
    for (const auto& p : parts)
      for (const auto& candidate : {p, p + "1"})
        if (const int j = lookup(candidate); j >= 0) return j;
    return -1;
  }
  // The part on one side ("left"/"right"), below `ancestor` and not among `taken`.
  int side(const char* side, const std::vector<std::string>& parts, int ancestor, std::initializer_list<int> taken = {}) const {
    const std::string word = side, letter(1, side[0]);
    for (const auto& p : parts)
      for (const auto& candidate : {word + p, letter + p, p + word, p + letter}) {
        const int j = lookup(candidate);
        if (j >= 0 && below(j, ancestor) && std::find(taken.begin(), taken.end(), j) == taken.end()) return j;
      }
    return -1;
  }
  bool below(int joint, int ancestor) const {
    if (ancestor < 0) return true;
    for (int j = skeleton_.parents[static_cast<std::size_t>(joint)]; j >= 0; j = skeleton_.parents[static_cast<std::size_t>(j)])
      if (j == ancestor) return true;
    return false;
  }

 private:
  int lookup(const std::string& name) const {
    const auto it = names_.find(name);
    return it == names_.end() ? -1 : it->second;
  }
  const Skeleton& skeleton_;
  std::map<std::string, int> names_;
};

int canonical_index(std::string_view name) { return canonical_body()->find(name); }

// Spreads canonical spine1..spine3 over the joints of the chain above the pelvis by relative height along the chain.
void match_spine(const Skeleton& s, int pelvis, int neck, JointMap& map) {
  std::vector<int> chain;  // joints above the pelvis up to, not including, the neck
  for (int j = s.parents[static_cast<std::size_t>(neck)]; j >= 0 && j != pelvis; j = s.parents[static_cast<std::size_t>(j)]) chain.push_back(j);
  std::reverse(chain.begin(), chain.end());
  // Joints lying on their parent carry rotation but no length of their own; the last of a coincident run stands for it.
  const int n = static_cast<int>(chain.size());
  if (n == 0) return;
  const char* const names[] = {"spine1", "spine2", "spine3"};
  for (int k = 0; k < 3; ++k) {
    const int i = n >= 3 ? static_cast<int>(std::lround(k * (n - 1) / 2.0)) : (n == 2 ? (k == 0 ? 0 : k == 1 ? -1 : 1) : (k == 2 ? 0 : -1));
    if (i >= 0) map.source[static_cast<std::size_t>(canonical_index(names[k]))] = chain[static_cast<std::size_t>(i)];
  }
}

bool is_bandai_namco(const Skeleton& s) {
  for (const char* name : {"joint_Root", "Hips", "UpperLeg_L", "LowerLeg_R", "UpperArm_L", "Hand_R", "Toes_L"})
    if (s.find(name) < 0) return false;
  const int knee = s.find("LowerLeg_L");
  const Vector3 d = s.rest_offsets[static_cast<std::size_t>(knee)].normalized();
  return std::max({std::abs(d.x()), std::abs(d.y()), std::abs(d.z())}) > 0.999;
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

}  // namespace

int JointMap::source_of(std::string_view name) const {
  const int c = canonical_index(name);
  return c < 0 ? -1 : source[static_cast<std::size_t>(c)];
}

std::vector<std::string> JointMap::missing() const {
  std::vector<std::string> names;
  for (const char* n : {"pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow"})
    if (source_of(n) < 0) names.emplace_back(n);
  return names;
}

JointMap map_to_canonical(const Skeleton& s) {
  JointMap map;
  map.source.fill(-1);
  map.family = "by name";
  const auto body = canonical_body();
  const auto set = [&](const std::string& name, int joint) { map.source[static_cast<std::size_t>(canonical_index(name))] = joint; };
  if (std::all_of(body->joint_names.begin(), body->joint_names.end(), [&](const auto& n) { return s.find(n) >= 0; })) {
    for (const auto& n : body->joint_names) set(n, s.find(n));
    map.family = "canonical";
    return map;
  }
  const Finder find(s);
  const int pelvis = find.centre(kPelvis) >= 0 ? find.centre(kPelvis) : 0;
  set("pelvis", pelvis);
  for (const char* side : {"left", "right"}) {
    const std::string p = std::string(side) + "_";
    const int hip = find.side(side, kHip, pelvis);
    const int knee = hip < 0 ? -1 : find.side(side, kKnee, hip, {hip});
    const int ankle = knee < 0 ? -1 : find.side(side, kAnkle, knee, {hip, knee});
    const int toe = ankle < 0 ? -1 : find.side(side, kToe, ankle, {ankle});
    set(p + "hip", hip);
    set(p + "knee", knee);
    set(p + "ankle", ankle);
    set(p + "foot", toe);
    const int arm = find.side(side, kArm, pelvis);
    const int elbow = arm < 0 ? -1 : find.side(side, kElbow, arm, {arm});
    const int wrist = elbow < 0 ? -1 : find.side(side, kWrist, elbow, {arm, elbow});
    int collar = find.side(side, kCollar, pelvis, {arm, elbow, wrist});
    if (collar >= 0 && arm >= 0 && !find.below(arm, collar)) collar = -1;
    set(p + "shoulder", arm);
    set(p + "elbow", elbow);
    set(p + "wrist", wrist);
    set(p + "collar", collar);
  }
  const int head = find.centre(kHead), neck = find.centre(kNeck);
  set("head", head);
  set("neck", neck);
  const int top = neck >= 0 ? neck : head;
  if (top >= 0 && find.below(top, pelvis)) match_spine(s, pelvis, top, map);
  if (is_bandai_namco(s)) map.family = "bandai-namco";
  return map;
}

std::optional<std::vector<Quaternion>> t_pose_orientations(const Skeleton& s, const JointMap& map) {
  const auto n = static_cast<std::size_t>(s.joint_count());
  if (map.family == "bandai-namco") {
    // Local frames were conjugated by the permutation C that makes Y up Z up: a local vector v of the file is C v now.
    RotationMatrix c;
    c << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    const Quaternion undo = to_quaternion(c).conjugate();
    std::vector<Quaternion> out(n);
    for (std::size_t j = 0; j < n; ++j) out[j] = bandai_namco_t_pose(s.joint_names[j]) * undo;
    return out;
  }
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
  const Vector3 hips = direction("right_hip", "left_hip"), arms = direction("right_shoulder", "left_shoulder");
  Vector3 left = hips + arms;
  left.z() = 0;
  if (left.norm() < 0.5) return std::nullopt;
  left.normalize();
  // A standing rest pose: legs down. Arms may point out, or down along the body: aligning bone directions by the shortest
  // rotation (retarget.hpp) then lifts them in the frontal plane, which keeps the twist of a T-pose.
  const double leg = std::max(direction("left_hip", "left_ankle").z(), direction("right_hip", "right_ankle").z());
  if (leg > -0.85) return std::nullopt;
  const double yaw = std::atan2(-left.x(), left.y());
  return std::vector<Quaternion>(n, yaw_rotation(-yaw));
}

}  // namespace mocap
