// Which joint of somebody's skeleton plays which part of the canonical body, and how it stands when the body is in
// T-pose.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "libmocap/skeleton/skeleton.hpp"

namespace mocap {

// source[c] is the joint of the source skeleton that stands for canonical joint c, or -1. Names are matched without case,
// separators and namespaces ("mixamorig:LeftUpLeg", "l_thigh"); SMPL, CMU, cgspeed, Mixamo, HumanIK, LaFAN1, Biovision and
// Bandai-Namco conventions are known. The spine is matched along the chain from pelvis to head, whatever its length.
struct JointMap {
  std::array<int, 22> source;
  std::string family;  // "bandai-namco", "canonical", or "by name"

  int source_of(std::string_view canonical_name) const;
  // Joints retargeting cannot do without: pelvis, hips, knees, ankles, shoulders, elbows. Canonical names of those absent.
  std::vector<std::string> missing() const;
};
JointMap map_to_canonical(const Skeleton& skeleton);

// World orientation of every source joint when the figure stands in T-pose, expressed in the canonical frame (facing +X,
// left +Y, up +Z): the skeleton must be in metres, Z up. Rigs that stand upright at rest (any facing; arms out or down) have
// the same rotation everywhere; rigs of a known family whose rest pose is none (Bandai-Namco: every bone along +-X) have theirs
// from a table of axes. nullopt where the rest pose does not stand and the family is unknown. [J]
std::optional<std::vector<Quaternion>> t_pose_orientations(const Skeleton& skeleton, const JointMap& map);

}  // namespace mocap
