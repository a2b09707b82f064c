// Which parts of a skeleton are left, right, trunk and head, whatever its joints are called.
#pragma once
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap::draw {

enum class Side { trunk, left, right };

// "left_knee", "LeftUpLeg", "mixamorig:LeftArm", "L_Hip", "Hand_R", "thigh.L", "lFemur", "rtibia": by whole words, or an
// l or r before the name of a limb. "LowerBack" and "root" are trunk.
Side side_of_name(std::string_view joint_name);

struct Anatomy {
  std::vector<Side> sides;  // [J] own name, otherwise the parent's side
  std::vector<int> limbs;   // [J] 0 is the trunk; each limb that leaves it has a number of its own
  int carried = -1;         // the body where joint 0 only carries it about (joint_Root): what lies between is no bone
  int head = -1;            // joint at the base of the skull, -1 where none is known
  int left_foot = -1, right_foot = -1;
  Skeleton with_roles;      // the skeleton with left_hip, left_shoulder, ... filled from the names where roles lack them
};
Anatomy anatomy_of(const Skeleton& skeleton);

}  // namespace mocap::draw
