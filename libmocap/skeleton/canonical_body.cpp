#include "libmocap/skeleton/canonical_body.hpp"

namespace mocap {
namespace {

constexpr double kStature = 1.70;

Skeleton build() {
  const double h = kStature;
  Skeleton s;
  const auto add = [&](const char* name, const char* parent, double x, double y, double z) {
    s.joint_names.emplace_back(name);
    s.parents.push_back(parent ? s.find(parent) : -1);
    s.rest_offsets.emplace_back(x, y, z);
  };
  // SMPL order: left, right, centre alternate down the tree.
  const double ankle_drop = kAnkleSoleHeight - kFootSoleHeight;
  add("pelvis", nullptr, 0, 0, 0);
  add("left_hip", "pelvis", 0, 0.052 * h, -0.030 * h);
  add("right_hip", "pelvis", 0, -0.052 * h, -0.030 * h);
  add("spine1", "pelvis", 0, 0, 0.060 * h);
  add("left_knee", "left_hip", 0, 0, -0.245 * h);
  add("right_knee", "right_hip", 0, 0, -0.245 * h);
  add("spine2", "spine1", 0, 0, 0.075 * h);
  add("left_ankle", "left_knee", 0, 0, -0.246 * h);
  add("right_ankle", "right_knee", 0, 0, -0.246 * h);
  add("spine3", "spine2", 0, 0, 0.050 * h);
  add("left_foot", "left_ankle", 0.075 * h, 0, -ankle_drop);
  add("right_foot", "right_ankle", 0.075 * h, 0, -ankle_drop);
  add("neck", "spine3", 0, 0, 0.105 * h);
  add("left_collar", "spine3", 0, 0.030 * h, 0.073 * h);
  add("right_collar", "spine3", 0, -0.030 * h, 0.073 * h);
  add("head", "neck", 0, 0, 0.060 * h);
  add("left_shoulder", "left_collar", 0, 0.076 * h, 0);
  add("right_shoulder", "right_collar", 0, -0.076 * h, 0);
  add("left_elbow", "left_shoulder", 0, 0.162 * h, 0);
  add("right_elbow", "right_shoulder", 0, -0.162 * h, 0);
  add("left_wrist", "left_elbow", 0, 0.155 * h, 0);
  add("right_wrist", "right_elbow", 0, -0.155 * h, 0);
  const auto tip = [&](const char* parent, double x, double y, double z) { s.end_sites.push_back({s.find(parent), Vector3(x, y, z)}); };
  tip("head", 0, 0, 0.090 * h);
  tip("left_wrist", 0, 0.107 * h, 0);
  tip("right_wrist", 0, -0.107 * h, 0);
  tip("left_foot", 0.041 * h, 0, 0.010 - kFootSoleHeight);
  tip("right_foot", 0.041 * h, 0, 0.010 - kFootSoleHeight);
  s.roles = {{"root", "pelvis"},
             {"left_foot", "left_foot"},
             {"right_foot", "right_foot"},
             {"left_ankle", "left_ankle"},
             {"right_ankle", "right_ankle"},
             {"left_knee", "left_knee"},
             {"right_knee", "right_knee"},
             {"left_hand", "left_wrist"},
             {"right_hand", "right_wrist"},
             {"left_elbow", "left_elbow"},
             {"right_elbow", "right_elbow"},
             {"head", "head"},
             {"neck", "neck"},
             {"left_hip", "left_hip"},
             {"right_hip", "right_hip"},
             {"left_shoulder", "left_shoulder"},
             {"right_shoulder", "right_shoulder"}};
  s.validate("canonical body");
  return s;
}

}  // namespace

std::shared_ptr<const Skeleton> canonical_body() {
  static const auto body = std::make_shared<const Skeleton>(build());
  return body;
}

double canonical_pelvis_height() {
  const auto& s = *canonical_body();
  double z = kAnkleSoleHeight;
  for (int j = s.find("left_ankle"); j > 0; j = s.parents[static_cast<std::size_t>(j)]) z -= s.rest_offsets[static_cast<std::size_t>(j)].z();
  return z;
}

}  // namespace mocap
