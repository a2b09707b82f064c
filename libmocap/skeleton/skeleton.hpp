// A tree of joints with a rest pose.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/math/rotation.hpp"

namespace mocap {

// Joints are in an order in which a parent comes before its children; joint 0 is the root.
// rest_offsets are positions relative to the parent in the rest pose (all local rotations identity), metres once the clip
// has been normalised (clip/world_frame.hpp), the file's own unit before.
struct Skeleton {
  struct EndSite {  // tip of a chain: fingertip, toe tip, top of the head. No rotation of its own
    int parent = 0;
    Vector3 offset = Vector3::Zero();
  };

  std::vector<std::string> joint_names;
  std::vector<int> parents;  // -1 for the root
  std::vector<Vector3> rest_offsets;
  std::vector<EndSite> end_sites;
  std::map<std::string, std::string> roles;  // role -> joint name: left_foot, right_foot, left_hand, head, left_hip, ...

  int joint_count() const { return static_cast<int>(parents.size()); }
  int find(std::string_view name) const;       // -1 where there is none
  int find_role(std::string_view role) const;  // joint index, -1 where the role is not filled
  std::vector<std::vector<int>> children() const;

  // Throws Error(data, where) unless: at least one joint; equal sizes; one root, first; parents before children; unique
  // non-empty names; finite offsets; end sites and roles refer to existing joints.
  void validate(const std::string& file = {}) const;

  // Same joints, parents, offsets and end sites, to `tolerance` metres.
  bool same_as(const Skeleton& other, double tolerance = 1e-6) const;
};

// Positions and rotations of the joints in the rest pose, root at the origin.
std::vector<Vector3> rest_positions(const Skeleton& skeleton);

// Impact factor of each joint on the pose (Ghorbani et al. eq. 23): the longest path, in metres, from the joint down to
// an end effector, alpha_k = max_j (alpha_j + l_kj) over the children j. End sites count as children with alpha 0;
// without them head, wrists and feet would weigh nothing. At least `floor` metres. [J]
std::vector<double> impact_factors(const Skeleton& skeleton, double floor = 0.0);

}  // namespace mocap
