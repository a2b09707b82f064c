#include "libmocap/draw/sides.hpp"

#include <algorithm>

#include "libmocap/skeleton/joint_map.hpp"
#include "libmocap/skeleton/joint_names.hpp"

namespace mocap::draw {

Side side_of_name(std::string_view name) {
  const mocap::Side side = parse_joint_name(name).side;
  return side == mocap::Side::left ? Side::left : side == mocap::Side::right ? Side::right : Side::trunk;
}

Anatomy anatomy_of(const Skeleton& s) {
  Anatomy a;
  a.with_roles = s;
  const JointMap map = map_to_canonical(s);
  for (const char* role : {"left_hip", "right_hip", "left_shoulder", "right_shoulder", "left_foot", "right_foot", "left_ankle", "right_ankle", "head"})
    if (const int j = map.source_of(role); s.find_role(role) < 0 && j >= 0) a.with_roles.roles[role] = s.joint_names[static_cast<std::size_t>(j)];
  const int pelvis = map.source_of("pelvis");
  if (pelvis > 0 && s.parents[static_cast<std::size_t>(pelvis)] == 0 && std::count(s.parents.begin(), s.parents.end(), 0) == 1) a.carried = pelvis;
  a.head = a.with_roles.find_role("head");
  a.left_foot = a.with_roles.find_role("left_foot");
  a.right_foot = a.with_roles.find_role("right_foot");

  const std::size_t n = s.parents.size();
  a.sides.resize(n);
  a.limbs.resize(n);
  for (const auto& [role, joint] : s.roles)
    if (const int j = s.find(joint); j >= 0 && side_of_name(role) != Side::trunk) a.sides[static_cast<std::size_t>(j)] = side_of_name(role);
  int limbs = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const auto p = static_cast<std::size_t>(std::max(0, s.parents[j]));
    if (a.sides[j] == Side::trunk) a.sides[j] = side_of_name(s.joint_names[j]);
    if (a.sides[j] == Side::trunk && j > 0) a.sides[j] = a.sides[p];
    if (a.sides[j] != Side::trunk) a.limbs[j] = j > 0 && a.sides[p] == a.sides[j] ? a.limbs[p] : ++limbs;
  }
  return a;
}

}  // namespace mocap::draw
